//! SRDF, which goes with a URDF robot: the pairs of links that do not collide.
//!
//! In: the text of a file, the [`Model`] of its robot. Out: pairs that the model excludes. Never here: groups and postures, which are for planning
//! and move nothing.

use crate::imported::{ImportError, LeftOut};
use crate::model::Model;
use crate::xml::{self, Harmless};

/// Elements for planning.
const HARMLESS: Harmless = Harmless {
    elements: "group group_state end_effector passive_joint joint_property",
    containers: "",
    attributes: "version",
};

/// Adds the pairs of a file and lists the rest; pairs of links that the robot has not are of another version of it.
///
/// # Errors
/// For text that is no SRDF.
pub(crate) fn read(text: &str, model: &mut Model, notes: &mut Vec<LeftOut>) -> Result<(), ImportError> {
    let root = xml::parse(text, Some("the SRDF file"))?;
    if root.tag != "robot" {
        return Err(root.wrong("is not the root of an SRDF file; expected `robot`"));
    }
    for pair in root.children("disable_collisions") {
        pair.read_all(&["reason"]);
        let names = [pair.needed("link1")?, pair.needed("link2")?];
        match names.map(|name| model.links.iter().position(|link| link.name == name)) {
            [Some(a), Some(b)] => model.excluded.push([a, b]),
            found => {
                let unknown = names[usize::from(found[0].is_some())];
                notes.push(pair.note(format!("names `{unknown}`, and there is no such link")).harmless());
            }
        }
    }
    root.list_unread(&HARMLESS, notes);
    Ok(())
}
