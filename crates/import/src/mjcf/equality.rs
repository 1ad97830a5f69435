//! Equalities: a point that two bodies share, or all of their pose; a joint that follows another.
//!
//! In: `equality` elements. Out: joints that close loops, joints that follow. Never here: couplings of tendons (they are listed: scenes
//! have none).

use super::bodies::BodyReader;
use crate::imported::ImportError;
use crate::model::{Joint, Kind, Mimic};
use crate::xml::{Element, RATIO_MAX};
use glam::DVec3;
use metachron_core::DisjointSets;

/// Coordinates that differ by less are equal, rad or m.
const ROUNDING: f64 = 1e-9;

/// Reads the equalities.
///
/// # Errors
/// For one of a body that there is none of.
pub(super) fn read(root: &Element, reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    let mut tied = DisjointSets::of(reader.model.joints.len());
    for element in root.children("equality").flat_map(Element::all) {
        if element.text("active") == Some("false") {
            element.read_all_within();
            continue;
        }
        let kind = match element.tag.as_str() {
            "connect" if element.has("body1") && element.has("anchor") => Kind::Spherical,
            "weld" if element.has("body1") => Kind::Fixed,
            "joint" => {
                follow(element.read(), reader, &mut tied)?;
                continue;
            }
            tag => {
                element.read_all_within();
                reader.notes.push(element.note(match tag {
                    "connect" | "weld" => {
                        "is left out: it is between sites; expected `body1`, and of `connect` an `anchor`"
                    }
                    _ => "is left out: scenes have joints between two bodies, and joints that follow joints",
                }));
                continue;
            }
        };
        let [first, second] = [body(element.read(), "body1", reader)?, body(element, "body2", reader)?];
        if first.is_some() && first == second {
            return Err(element.wrong("holds a body to itself; expected two bodies"));
        }
        // in the first body
        let anchor_m = element.numbers("anchor")?.map_or(DVec3::ZERO, DVec3::from_array);
        let at_m = first.map_or(anchor_m, |link| reader.model.links[link].pose.point(anchor_m));
        // the later body is the child, as a link follows the one that it hangs on; a static body is the world
        let [first, second] = [first, second].map(|link| link.filter(|link| !reader.is_static(*link)));
        let (Some(child), parent) = (first.max(second), first.min(second)) else {
            reader.notes.push(element.note("is left out: neither of its bodies moves").harmless());
            continue;
        };
        let anchor_m = match kind {
            // all of the child is held, wherever
            Kind::Fixed => DVec3::ZERO,
            _ => reader.model.links[child].pose.inverse().point(at_m),
        };
        if reader.keyframe.is_some() {
            reader.notes.push(element.note("holds its bodies as they start, not as they are without the keyframe"));
        }
        let name = element.text("name").unwrap_or_default().to_owned();
        let weld = Joint::weld(element.place.clone(), parent, child);
        reader.model.joints.push(Joint { name, kind, anchor_m, ..weld });
    }
    Ok(())
}

/// Lets a joint follow another: its way from the file's pose is a polynomial of that of the other, of which scenes have the first power.
/// `tied` are sets of joints that follow each other.
fn follow(element: &Element, reader: &mut BodyReader<'_>, tied: &mut DisjointSets) -> Result<(), ImportError> {
    if !element.has("joint2") {
        element.read_all_within();
        reader.notes.push(element.note("is left out: it holds one joint; expected `joint2`, which that one follows"));
        return Ok(());
    }
    let joint = |key: &'static str| {
        let name = element.needed(key)?;
        let found = reader.travelling.get(name).copied();
        found.ok_or_else(|| element.wrong(format!("names `{name}`, and there is no hinge or slide of that name")))
    };
    let [follows, leads] = [joint("joint1")?, joint("joint2")?];
    let [offset, ratio, higher @ ..] = element.numbers_or("polycoef", [0.0, 1.0, 0.0, 0.0, 0.0])?;
    if follows == leads {
        return Err(element.wrong("ties a joint to itself; expected two joints"));
    }
    if ratio.abs() > RATIO_MAX {
        return Err(element.wrong(format!("`polycoef` has the ratio {ratio}; expected -{RATIO_MAX} to {RATIO_MAX}")));
    }
    let joints = &mut reader.model.joints;
    let mut note = |what: String| reader.notes.push(element.note(what));
    if joints[follows].mimic.is_some() {
        note("is left out: a joint of a scene follows one other, and this one does already".to_owned());
        return Ok(());
    }
    if !tied.join(follows, leads) {
        let [joint, other] = [follows, leads].map(|at| &joints[at].name);
        note(format!("is left out: `{other}` follows `{joint}` already"));
        return Ok(());
    }
    if higher != [0.0; 3] {
        note("has no powers above the first: a joint of a scene follows another by a ratio".to_owned());
    }
    let off = reader.starts[follows] - offset - ratio * reader.starts[leads];
    if off.abs() > ROUNDING {
        note(format!("holds its joints as they start, {off} from where the file does"));
    }
    let joint = joints[leads].name.clone();
    joints[follows].mimic = Some(Mimic { joint, ratio });
    Ok(())
}

/// The body that an element names; `None` for the world.
fn body(element: &Element, key: &str, reader: &BodyReader<'_>) -> Result<Option<usize>, ImportError> {
    let Some(name) = element.text(key).filter(|name| *name != "world") else { return Ok(None) };
    let found = reader.model.links.iter().position(|link| link.name == name);
    found.map(Some).ok_or_else(|| element.wrong(format!("names `{name}`, and there is no such body")))
}
