//! SRDF, which goes with a URDF robot: the pairs of links that do not collide.
//!
//! In: the text of a file, the [`Model`] of its robot. Out: pairs that the model excludes. Never here: groups and postures, which are for planning
//! and move nothing.

use crate::imported::ImportError;
use crate::model::Model;
use crate::xml;

/// Adds the pairs of a file; those of links that the robot has not are of another version of it.
///
/// # Errors
/// For text that is no SRDF.
pub(crate) fn read(text: &str, model: &mut Model) -> Result<(), ImportError> {
    let root = xml::parse(text, Some("the SRDF file"))?;
    if root.tag != "robot" {
        return Err(root.wrong("is not the root of an SRDF file; expected `robot`"));
    }
    for pair in root.children("disable_collisions") {
        let find = |name: &str| model.links.iter().position(|link| link.name == name);
        if let (Some(a), Some(b)) = (find(pair.needed("link1")?), find(pair.needed("link2")?)) {
            model.excluded.push([a, b]);
        }
    }
    Ok(())
}
