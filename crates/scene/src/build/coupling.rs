//! Reads the couplings of a scene file: pairs that act on each other otherwise than as one problem, which is the default.
//!
//! In: [`CouplingFile`]s and the objects of the scene. Out: [`Coupling`]s, problems to the [`Checker`].
//! Never here: forces.

use super::force_limits::ForceLimits;
use super::objects::{NamedObject, Objects};
use super::soft;
use crate::check::{Checker, Place};
use crate::format::ranges::SHARE;
use crate::format::{CouplingFile, CouplingKind as Kind, CouplingLaw, Spot};
use glam::DVec3;
use metachron_contact::Law;
use metachron_core::{AgentId, Anchor};
use metachron_models::rigid::RigidBody;
use metachron_models::soft::SoftShape;
use metachron_world::Spec;
use metachron_world::couplings::{Coupling, CouplingKind};
use std::collections::BTreeMap;

/// The couplings of the scene.
pub(crate) fn couplings(c: &mut Checker<'_, '_>, files: &[CouplingFile], objects: &Objects) -> Vec<Coupling> {
    let mut contacts = BTreeMap::new();
    let mut found = Vec::with_capacity(files.len());
    for (i, file) in files.iter().enumerate() {
        let place = c.place(&format!("coupling.{i}"));
        let Some(coupling) = coupling(c, &place, file, objects) else { continue };
        let pair = (coupling.a.min(coupling.b), coupling.a.max(coupling.b));
        if coupling.kind == CouplingKind::Contact && contacts.insert(pair, i).is_some() {
            c.wrong(&place, "b", "is coupled with `a` by contact already", "expected one contact law for a pair");
        }
        found.push(coupling);
    }
    found
}

fn coupling(c: &mut Checker<'_, '_>, place: &Place, file: &CouplingFile, objects: &Objects) -> Option<Coupling> {
    let (a, b) = (end(c, place, "a", &file.a, objects), end(c, place, "b", &file.b, objects));
    let (a, b) = (a?, b?);
    if a == b {
        c.wrong(place, "b", "is the same object as `a`", "expected another object: a coupling connects two");
        return None;
    }
    if let (NamedObject::Tool(_), NamedObject::Tool(_)) = (a, b) {
        let expected = "expected a tube or a rigid object: both tools are driven, so neither yields";
        c.wrong(place, "b", "is a tool, as `a` is", expected);
        return None;
    }
    let before = c.count();
    let soft = [a, b].into_iter().any(|end| matches!(end, NamedObject::Soft(_)));
    if soft && file.law == Some(CouplingLaw::Tlm) {
        c.wrong(place, "law", "is `tlm`, which sheets, solids and ropes do not support", "expected `ledger` or `off`");
    }
    if let Some(CouplingLaw::Penalty | CouplingLaw::PenaltyExtrapolated) = file.law {
        let law = c.written(place, "law");
        let what = format!("is `{law}`: penalty laws stay in the laboratory (`metachron chart stability`)");
        c.wrong(place, "law", what, "expected `ledger`, `tlm` or `off`, or no law: all that touch is one problem");
        return None;
    }
    check_keys(c, place, file);
    check_traits(c, place, file, [a, b], objects);
    let law = law(file);
    let kind = match file.kind.unwrap_or_default() {
        Kind::Contact => Some(CouplingKind::Contact),
        Kind::Attach => attach(c, place, file, [a, b], objects),
    };
    if c.count() > before {
        return None;
    }
    Some(Coupling { a: a.agent()?, b: b.agent()?, kind: kind?, law: law? })
}

/// The agent at one end of a coupling; refuses static solids, scenery and synthetic agents.
fn end(c: &mut Checker<'_, '_>, place: &Place, key: &str, name: &str, objects: &Objects) -> Option<NamedObject> {
    let (what, expected) = match objects.names.get(name) {
        None => {
            let moves = |named| !matches!(named, NamedObject::Fixed | NamedObject::Scenery | NamedObject::Synthetic(_));
            c.reference(place, key, name, objects.names.only(moves));
            return None;
        }
        Some(NamedObject::Fixed) => (
            "which is fixed",
            "expected an object that moves: fixed objects collide with everything without a coupling",
        ),
        Some(NamedObject::Scenery) => ("which is scenery and only drawn", "expected a tube, a rigid object or a tool"),
        Some(NamedObject::Synthetic(_)) => {
            ("which is a synthetic agent without a body", "expected a tube, a rigid object or a tool")
        }
        Some(named) => return Some(named),
    };
    c.wrong(place, key, format_args!("names `{name}`, {what}"), expected);
    None
}

/// Reports keys that have no meaning for this kind and law, and required keys that are missing.
fn check_keys(c: &mut Checker<'_, '_>, place: &Place, file: &CouplingFile) {
    let attach = file.kind.unwrap_or_default() == Kind::Attach;
    let spring = attach || file.law == Some(CouplingLaw::Tlm);
    let what = match file.law {
        _ if attach => "an attachment".to_owned(),
        Some(_) => format!("contact by `{}`", c.written(place, "law")),
        None => "contact".to_owned(),
    };
    let (of_attach, of_spring) =
        (["at_a", "at_b", "rest_m", "tears_above_n", "yields_above_n"], ["stiffness_n_m", "damping_n_s_m"]);
    let foreign: &[&str] = if attach { &[] } else { &of_attach };
    c.refuse(place, foreign, format_args!("does not belong to {what}"), "expected no such key here");
    let (foreign, needed): (&[&str], &[&str]) = match (attach, spring) {
        (true, _) => (&[], &["at_a", "at_b", "stiffness_n_m"]),
        (_, true) => (&[], &["stiffness_n_m"]),
        _ => (&of_spring, &[]),
    };
    c.refuse(place, foreign, format_args!("does not belong to {what}"), "expected no such key here");
    let given = c.given(place, needed);
    for key in needed.iter().filter(|key| !given.contains(key)) {
        c.wrong(place, key, "is missing", format!("{what} needs it: expected `{key}` in this table"));
    }
    if let (true, Some(CouplingLaw::Ledger | CouplingLaw::Tlm)) = (attach, file.law) {
        let law = c.written(place, "law");
        let what =
            format_args!("does not belong to an attachment by `{law}`, of which either side knows its own force");
        let expected = "expected no `law` beside it: then the two are one problem";
        c.refuse(place, &["tears_above_n", "yields_above_n"], what, expected);
    }
    if attach && file.law == Some(CouplingLaw::Off) {
        c.wrong(place, "law", "is `off`, which attaches nothing", "expected another law, or no such coupling");
    }
}

/// Reports contact by a law of its own between objects that do not collide, or of which one only senses.
fn check_traits(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &CouplingFile,
    ends: [NamedObject; 2],
    objects: &Objects,
) {
    let traits = |end: NamedObject| {
        let id = end.agent()?;
        objects.agents.iter().find(|member| member.id == id).map(|member| member.spec.traits())
    };
    let [Some(a), Some(b)] = ends.map(traits) else { return };
    if file.kind.unwrap_or_default() != Kind::Contact || file.law == Some(CouplingLaw::Off) {
        return;
    }
    if !a.groups.meet(b.groups) {
        let expected = "expected `law = \"off\"`, no such coupling, or other groups under their `contact`";
        c.wrong(place, "b", "does not collide with `a` by their groups", expected);
    } else if a.is_sensor || b.is_sensor {
        let expected = "expected no such coupling: a sensor gives no force";
        c.wrong(place, "b", "or `a` only senses", expected);
    }
}

fn law(file: &CouplingFile) -> Option<Law> {
    match file.law {
        None => Some(Law::Cluster),
        Some(CouplingLaw::Off) => Some(Law::Off),
        Some(CouplingLaw::Tlm) => {
            let (stiffness_n_m, damping_n_s_m) = spring(file)?;
            Some(Law::Tlm { stiffness_n_m, damping_n_s_m })
        }
        // penalties are refused before
        Some(CouplingLaw::Ledger | CouplingLaw::Penalty | CouplingLaw::PenaltyExtrapolated) => Some(Law::Ledger),
    }
}

fn spring(file: &CouplingFile) -> Option<(f64, f64)> {
    Some((file.stiffness_n_m?, file.damping_n_s_m.unwrap_or(0.0)))
}

fn attach(
    c: &mut Checker<'_, '_>,
    place: &Place,
    file: &CouplingFile,
    [a, b]: [NamedObject; 2],
    objects: &Objects,
) -> Option<CouplingKind> {
    let at_a = Attachment { key: "at_a", object: a, spot: file.at_a? }.anchor(c, place, objects);
    let at_b = Attachment { key: "at_b", object: b, spot: file.at_b? }.anchor(c, place, objects);
    let (stiffness_n_m, damping_n_s_m) = spring(file)?;
    let rest_m = file.rest_m.unwrap_or(0.0);
    let ForceLimits { tears_above_n, yields_above_n } =
        ForceLimits::read(c, place, [file.tears_above_n, file.yields_above_n]);
    let (at_a, at_b) = (at_a?, at_b?);
    Some(CouplingKind::Attach { at_a, at_b, stiffness_n_m, damping_n_s_m, rest_m, tears_above_n, yields_above_n })
}

/// One end of an attachment: an object, and the spot on it that the key of the coupling gives.
struct Attachment {
    key: &'static str,
    object: NamedObject,
    spot: Spot,
}

impl Attachment {
    /// The material point of the attached object that its spot denotes.
    fn anchor(self, c: &mut Checker<'_, '_>, place: &Place, objects: &Objects) -> Option<Anchor> {
        let Self { key, object, spot } = self;
        let id = object.agent()?;
        let soft = if let Some(Spec::Soft(spec)) = spec_of(objects, id) { Some(spec) } else { None };
        let is_rope = soft.is_some_and(|spec| matches!(spec.shape, SoftShape::Rope { .. }));
        match (spot, is_rope || matches!(object, NamedObject::Tube(_))) {
            (Spot::Share(share), true) => {
                let share = c.number(place, key, share, SHARE);
                match soft {
                    Some(rope) => soft::along(rope, share),
                    None => Some(Anchor::Arc(share * tube_length_m(objects, id)?)),
                }
            }
            (Spot::Point(at), false) => match soft {
                Some(spec) => soft::nearest(spec, at.into()),
                None => Some(Anchor::Local(DVec3::from(at) - centre_of_mass(objects, id))),
            },
            (Spot::Point(_), true) => {
                let what = format_args!("is a point, but the object is a {}", if is_rope { "rope" } else { "tube" });
                c.wrong(place, key, what, "expected a share of its length, 0 … 1");
                None
            }
            (Spot::Share(_), false) => {
                let from = if soft.is_some() { " from its middle" } else { "" };
                let expected = format!("expected a point [x, y, z] in the object's axes, metres{from}");
                c.wrong(place, key, "is a share of a length, but the object is neither a tube nor a rope", expected);
                None
            }
        }
    }
}

fn spec_of(objects: &Objects, id: AgentId) -> Option<&Spec> {
    objects.agents.iter().find(|member| member.id == id).map(|member| &member.spec)
}

/// Rest length of a tube's skeleton, metres; `None` where the tube cannot be built, which is reported elsewhere.
fn tube_length_m(objects: &Objects, id: AgentId) -> Option<f64> {
    let Spec::Tube(spec) = spec_of(objects, id)? else { return None };
    metachron_models::rod::Tube::new(spec.clone()).ok().map(|tube| tube.length_m())
}

/// The centre of mass of a rigid object in its shape's axes; zero for any other object, such as a tool, whose origin is its tip.
fn centre_of_mass(objects: &Objects, id: AgentId) -> DVec3 {
    match spec_of(objects, id) {
        Some(Spec::Rigid(spec)) => RigidBody::new(spec.clone()).map_or(DVec3::ZERO, |body| body.com_local()),
        _ => DVec3::ZERO,
    }
}
