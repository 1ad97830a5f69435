//! Equalities between bodies: a point that two share, or all of their pose.
//!
//! In: `equality` elements. Out: joints that close loops. Never here: couplings of joints and of tendons (they are listed: scenes have none).

use super::bodies::BodyReader;
use crate::imported::ImportError;
use crate::model::{Joint, Kind};
use crate::xml::Element;
use glam::DVec3;

/// Reads the equalities.
///
/// # Errors
/// For one of a body that there is none of.
pub(super) fn read(root: &Element, reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    for element in root.children("equality").flat_map(Element::all) {
        if element.text("active") == Some("false") {
            element.read_all_within();
            continue;
        }
        let kind = match element.tag.as_str() {
            "connect" if element.has("body1") && element.has("anchor") => Kind::Spherical,
            "weld" if element.has("body1") => Kind::Fixed,
            tag => {
                element.read_all_within();
                reader.notes.push(element.note(match tag {
                    "connect" | "weld" => {
                        "is left out: it is between sites; expected `body1`, and of `connect` an `anchor`"
                    }
                    _ => "is left out: scenes have joints between two bodies, and nothing that couples joints",
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

/// The body that an element names; `None` for the world.
fn body(element: &Element, key: &str, reader: &BodyReader<'_>) -> Result<Option<usize>, ImportError> {
    let Some(name) = element.text(key).filter(|name| *name != "world") else { return Ok(None) };
    let found = reader.model.links.iter().position(|link| link.name == name);
    found.map(Some).ok_or_else(|| element.wrong(format!("names `{name}`, and there is no such body")))
}
