//! Brings a model to a form that a scene can have: links that a fixed joint holds, and links without mass, become part of the bodies that they
//! are on, and nothing is without a shape.
//!
//! In: a [`Model`] as the file has it. Out: the same where every link has a mass and a part. Never here: XML, TOML.

use crate::imported::{ImportError, LeftOut};
use crate::masses::{STAND_IN_M, ball, lend, repair};
use crate::model::{End, Fixed, Joint, Kind, Link, Mass, Model, Part, TieKind, Why};
use crate::pose::Pose;
use crate::weight::Weight;
use glam::{DMat3, DVec3};
use metachron_geometry::COMPOUND_PARTS_MAX;
use std::collections::BTreeSet;

/// The outcome for a link.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    /// Itself.
    Itself,
    /// Part of the world.
    World,
    /// Part of another link, at a place in its axes.
    PartOf(usize, Pose),
}

/// Settles a model.
///
/// # Errors
/// For a link without mass on a joint that moves.
pub(crate) fn settle(mut model: Model, fixed_base: bool, notes: &mut Vec<LeftOut>) -> Result<Model, ImportError> {
    lend(&mut model, notes);
    find_roots(&mut model);
    if fixed_base {
        fix_bases(&mut model);
    }
    let above = model.above();
    let mut fates: Vec<Fate> = Vec::with_capacity(model.links.len());
    for (at, link) in model.links.iter().enumerate() {
        let joint = above[at].map(|joint| &model.joints[joint]);
        let own = fate(link, joint, &fates, &model)?;
        if let Some(joint) = joint.filter(|_| own != Fate::Itself) {
            note_fate(link, joint, own, &model, notes);
        }
        fates.push(own);
    }
    let touched: Vec<bool> = model.links.iter().map(|link| link.parts.iter().any(|part| part.touches)).collect();
    for (at, fate) in fates.iter().enumerate() {
        let parts = if *fate == Fate::Itself { continue } else { std::mem::take(&mut model.links[at].parts) };
        match *fate {
            Fate::PartOf(host, pose) => {
                // each by itself: moments that no body has are blamed on the link that has them
                repair(&mut model.links[host], notes)?;
                repair(&mut model.links[at], notes)?;
                let moved = parts.into_iter().map(|part| Part { pose: pose.then(part.pose), ..part });
                let weights = [host, at].map(|link| Weight::given(&model.links[link].mass));
                let surface = model.links[at].look.surface;
                let host = &mut model.links[host];
                if !host.parts.iter().any(|part| part.touches) {
                    host.look.surface = surface;
                }
                host.parts.extend(moved);
                if let [Some(own), Some(more)] = weights {
                    host.mass = Weight::together(&[own, more.at(pose)]);
                }
            }
            _ => {
                let link = &model.links[at];
                let fixed = parts.into_iter().enumerate().map(|(i, part)| fixed(link, at, i, part));
                model.fixed.extend(fixed.collect::<Vec<_>>());
            }
        }
    }
    move_ties(&mut model, &fates, notes);
    move_joints(&mut model, &fates, notes);
    drop_mimics(&mut model, notes);
    pass_excluded(&mut model, &fates, &touched);
    keep(&mut model, &fates);
    model.pass_neighbours();
    for link in &mut model.links {
        repair(link, notes)?;
        choose_parts(link, notes)?;
    }
    model.drop_unnamed_files();
    Ok(model)
}

/// Lists a link that is no body of its own.
fn note_fate(link: &Link, joint: &Joint, fate: Fate, model: &Model, notes: &mut Vec<LeftOut>) {
    if joint.kind != Kind::Fixed {
        notes.push(link.place.note(format!("has no mass, and carries none: {} is fixed", joint.place.label)));
    } else if let (Fate::PartOf(host, _), Mass::Given { .. }) = (fate, link.mass) {
        let what = format!("is part of `{}`, to which it is fixed", model.links[host].name);
        notes.push(link.place.note(what).harmless());
    }
}

/// A part of a link that is part of the world.
fn fixed(link: &Link, number: usize, index: usize, part: Part) -> Fixed {
    let name = if index == 0 { link.name.clone() } else { format!("{}-{}", link.name, index + 1) };
    let part = Part { pose: link.pose.then(part.pose), ..part };
    Fixed { name, root: Some(link.root), link: Some(number), part, look: link.look.clone() }
}

/// Finds for each link the one that all of its tree hangs on.
fn find_roots(model: &mut Model) {
    for (at, above) in model.above().into_iter().enumerate() {
        let parent = above.and_then(|joint| model.joints[joint].parent);
        model.links[at].root = parent.map_or(at, |parent| model.links[parent].root);
    }
}

/// Fixes links that move freely and that others hang on, and a robot that is one link.
fn fix_bases(model: &mut Model) {
    let joints = std::mem::take(&mut model.joints);
    let is_base = |at: usize| {
        joints.iter().all(|joint| joint.child != at)
            && (model.links.len() == 1 || joints.iter().any(|joint| joint.parent == Some(at)))
    };
    let bases = (0..model.links.len()).filter(|at| is_base(*at) && !matches!(model.links[*at].mass, Mass::None));
    let welds: Vec<Joint> = bases.map(|at| Joint::weld(model.links[at].place.clone(), None, at)).collect();
    model.joints = welds.into_iter().chain(joints).collect();
}

/// Brings the pairs that the file excludes to the bodies that links become: two of several links each pass through each other where all of
/// their links do that something touches.
fn pass_excluded(model: &mut Model, fates: &[Fate], touched: &[bool]) {
    let body = |link: usize| if let Fate::PartOf(host, _) = fates[link] { host } else { link };
    let excluded: BTreeSet<[usize; 2]> = model.excluded.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
    let links = |of: usize| (0..fates.len()).filter(move |link| body(*link) == of && touched[*link]);
    let pass = |&[a, b]: &[usize; 2]| links(a).all(|one| links(b).all(|other| excluded.contains(&[one, other])));
    let names = |link: usize| -> Vec<String> {
        if fates[link] == Fate::Itself {
            return vec![model.links[link].name.clone()];
        }
        let own = model.fixed.iter().filter(|fixed| fixed.link == Some(link) && fixed.can_pass());
        own.map(|fixed| fixed.name.clone()).collect()
    };
    let moving = model.excluded.iter().filter(|pair| pair.iter().any(|link| fates[*link] != Fate::World));
    let pairs: Vec<[Vec<String>; 2]> =
        moving.map(|pair| pair.map(body)).filter(pass).map(|pair| pair.map(names)).collect();
    for [first, second] in pairs {
        for (a, b) in first.iter().flat_map(|a| second.iter().map(move |b| (a, b))) {
            model.let_pass(a, b, Why::Excluded);
        }
    }
}

/// The fate of a link, where the links before it have theirs.
fn fate(link: &Link, joint: Option<&Joint>, before: &[Fate], model: &Model) -> Result<Fate, ImportError> {
    let weighs = !matches!(link.mass, Mass::None);
    if weighs && (link.is_free || joint.is_none_or(|joint| joint.kind != Kind::Fixed)) {
        return Ok(Fate::Itself);
    }
    if link.is_free {
        return Err(link.place.wrong("has no mass, and moves freely; expected a mass above zero"));
    }
    let Some(joint) = joint else { return Ok(Fate::World) };
    if joint.kind != Kind::Fixed && !model.fixes_massless {
        let reason = format!("has no mass, and {} lets it move; expected a mass above zero", joint.place.label);
        return Err(link.place.wrong(reason));
    }
    let host = match joint.parent.map(|parent| (parent, before[parent])) {
        None | Some((_, Fate::World)) => return Ok(Fate::World),
        Some((parent, Fate::Itself)) => parent,
        Some((_, Fate::PartOf(host, _))) => host,
    };
    if weighs && !can_join(link, host, before, &model.links) {
        return Ok(Fate::Itself);
    }
    Ok(Fate::PartOf(host, model.links[host].pose.inverse().then(link.pose)))
}

/// Whether a link that weighs something can be part of the body of another: it has a mass and a surface for all of its solids, and room for so
/// many.
fn can_join(link: &Link, host: usize, before: &[Fate], links: &[Link]) -> bool {
    let is_part = |fate: &Fate| matches!(fate, Fate::PartOf(body, _) if *body == host);
    let joined = before.iter().zip(links).filter(|(fate, _)| is_part(fate)).map(|(_, link)| link);
    let body: Vec<&Link> = std::iter::once(&links[host]).chain(joined).collect();
    let parts: usize = body.iter().map(|one| one.parts.len()).sum();
    // the surface of what is only seen has no meaning
    let touches = |one: &&Link| one.parts.iter().any(|part| part.touches);
    let surface = body.iter().copied().find(touches).filter(|_| touches(&link)).map(|one| one.look.surface);
    [link, &links[host]].iter().all(|one| Weight::given(&one.mass).is_some())
        && surface.is_none_or(|surface| surface == link.look.surface)
        && parts + link.parts.len() <= COMPOUND_PARTS_MAX
}

/// How much longer than its rope a distance may be by rounding alone, metres.
const ROUNDING_M: f64 = 1e-9;

/// Brings the ends of ties to the bodies that links become; a tie of a body to itself is left out, and so is a rope
/// that is too short to start with.
fn move_ties(model: &mut Model, fates: &[Fate], notes: &mut Vec<LeftOut>) {
    let Model { links, ties, .. } = model;
    for end in ties.iter_mut().flat_map(|tie| &mut tie.ends) {
        let Some(link) = end.link else { continue };
        *end = match fates[link] {
            Fate::Itself => *end,
            Fate::PartOf(host, pose) => End { link: Some(host), at_m: pose.point(end.at_m) },
            Fate::World => End { link: None, at_m: links[link].pose.point(end.at_m) },
        };
    }
    ties.retain(|tie| {
        let [a, b] = tie.ends.map(|end| end.link.map_or(end.at_m, |link| links[link].pose.point(end.at_m)));
        let apart_m = a.distance(b);
        let why = match tie.kind {
            _ if tie.ends[0].link == tie.ends[1].link => "both of its ends are on one body".to_owned(),
            TieKind::Rope { length_m } if apart_m > length_m + ROUNDING_M => {
                format!("its ends start {apart_m:.4} m apart, and it is at most {length_m} m long")
            }
            TieKind::Rope { .. } | TieKind::Spring { .. } => return true,
        };
        notes.push(tie.place.note(format!("is left out: {why}")));
        false
    });
}

/// Brings joints that close loops to the bodies that links become, and leaves of the others the joints whose link
/// remains itself.
fn move_joints(model: &mut Model, fates: &[Fate], notes: &mut Vec<LeftOut>) {
    let Model { links, joints, .. } = model;
    let host = |link: usize| match fates[link] {
        Fate::Itself => Some(link),
        Fate::PartOf(host, _) => Some(host),
        Fate::World => None,
    };
    let mut hangs = vec![false; links.len()];
    joints.retain_mut(|joint| {
        // the joint that a link hangs on comes first
        if !std::mem::replace(&mut hangs[joint.child], true) {
            return fates[joint.child] == Fate::Itself;
        }
        let [one, other] = [host(joint.child), joint.parent.and_then(host)];
        let Some(child) = one.max(other).filter(|_| one != other) else {
            notes.push(joint.place.note("is left out: both of its ends are on one body"));
            return false;
        };
        let at_m = links[joint.child].pose.point(joint.anchor_m);
        joint.anchor_m = links[child].pose.inverse().point(at_m);
        (joint.parent, joint.child) = (one.min(other), child);
        true
    });
}

/// Lets joints move by themselves that follow one that is gone.
fn drop_mimics(model: &mut Model, notes: &mut Vec<LeftOut>) {
    let moving: BTreeSet<String> =
        model.joints.iter().filter(|joint| joint.kind.travels()).map(|j| j.name.clone()).collect();
    for joint in &mut model.joints {
        if let Some(gone) = joint.mimic.take_if(|mimic| !moving.contains(&mimic.joint)) {
            notes.push(joint.place.note(format!("moves by itself: `{}`, which it follows, is fixed", gone.joint)));
        }
    }
}

/// Leaves the links that remain themselves.
fn keep(model: &mut Model, fates: &[Fate]) {
    let mut numbers = Vec::with_capacity(fates.len());
    let mut count = 0;
    for fate in fates {
        numbers.push(count);
        count += usize::from(*fate == Fate::Itself);
    }
    let standing = |link: usize| match fates[link] {
        Fate::Itself => Some(numbers[link]),
        Fate::PartOf(host, _) => Some(numbers[host]),
        Fate::World => None,
    };
    for joint in &mut model.joints {
        (joint.parent, joint.child) = (joint.parent.and_then(standing), numbers[joint.child]);
    }
    for end in model.ties.iter_mut().flat_map(|tie| &mut tie.ends) {
        end.link = end.link.and_then(standing);
    }
    let mut at = 0;
    model.links.retain(|_| {
        at += 1;
        fates[at - 1] == Fate::Itself
    });
}

/// Leaves a link the parts that are touched, or else the visual parts, or else a ball with its moments of inertia.
fn choose_parts(link: &mut Link, notes: &mut Vec<LeftOut>) -> Result<(), ImportError> {
    let touched = link.parts.iter().any(|part| part.touches);
    let mut left_out = |part: &Part, what: String| {
        let note = part.place.note(what);
        notes.push(if part.touches { note } else { note.harmless() });
    };
    let weighs = |part: &Part| matches!(link.mass, Mass::OfParts) && part.density_kg_m3 != Some(0.0);
    if touched {
        if let Some(part) = link.parts.iter().find(|part| !part.touches && weighs(part)) {
            let reason = "weighs something, and nothing touches it, where something touches other parts of its body; \
                          expected an inertial element in the body";
            return Err(part.place.wrong(reason));
        }
        link.parts
            .iter()
            .filter(|part| !part.touches)
            .for_each(|part| left_out(part, "is only seen: is left out".into()));
        link.parts.retain(|part| part.touches);
    }
    if link.parts.len() > COMPOUND_PARTS_MAX {
        let beyond = &link.parts[COMPOUND_PARTS_MAX..];
        if beyond.iter().any(weighs) {
            let reason = format!("has {} solids that weigh; expected at most {COMPOUND_PARTS_MAX}", link.parts.len());
            return Err(link.place.wrong(reason));
        }
        beyond.iter().for_each(|part| left_out(part, format!("is left out: it is beyond {COMPOUND_PARTS_MAX} solids")));
        link.parts.truncate(COMPOUND_PARTS_MAX);
    }
    if link.parts.is_empty() {
        link.parts.push(stand_in(link));
    }
    Ok(())
}

/// A ball at the centre of mass, as large as one of its mass and its mean moment of inertia, that nothing touches.
fn stand_in(link: &Link) -> Part {
    let (mass_kg, com_m, tensor) = match link.mass {
        Mass::Given { mass_kg, com_m, inertia_kg_m2: Some(tensor) } => (mass_kg, com_m, tensor),
        Mass::Given { com_m, inertia_kg_m2: None, .. } => (1.0, com_m, DMat3::ZERO),
        Mass::None | Mass::OfParts => (1.0, DVec3::ZERO, DMat3::ZERO),
    };
    let mean = (tensor.x_axis.x + tensor.y_axis.y + tensor.z_axis.z) / 3.0;
    // a ball has 2/5 m r²
    let radius_m = if mean > 0.0 { (2.5 * mean / mass_kg).sqrt().clamp(1e-6, 1e4) } else { STAND_IN_M };
    ball(link, com_m, radius_m)
}
