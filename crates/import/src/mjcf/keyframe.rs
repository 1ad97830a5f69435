//! The keyframe that a model starts from: the positions of its joints, and the commands of its actuators.
//!
//! In: `key` elements. Out: their numbers, joint by joint. Never here: the use of them in joints; the keyframes that
//! are not started from.

use crate::imported::ImportError;
use crate::xml::Element;

/// A keyframe, and how much of it joints have taken.
#[derive(Debug)]
pub(super) struct Keyframe<'a> {
    element: &'a Element,
    positions: Option<Vec<f64>>,
    controls: Option<Vec<f64>>,
    taken: usize,
}

impl<'a> Keyframe<'a> {
    /// The one of a name.
    ///
    /// # Errors
    /// Where there is none, or a value of it is no number.
    pub(super) fn find(root: &'a Element, name: &str) -> Result<Self, ImportError> {
        let mut all = root.children("keyframe").flat_map(Element::all);
        let Some(element) = all.find(|key| key.tag == "key" && key.text("name") == Some(name)) else {
            return Err(root.wrong(format!("has no keyframe `{name}`")));
        };
        let (positions, controls) = (element.read().list("qpos")?, element.list("ctrl")?);
        Ok(Self { element, positions, controls, taken: 0 })
    }

    /// The coordinates of the next joint; `None` where the keyframe gives none.
    pub(super) fn next<const N: usize>(&mut self) -> Option<[f64; N]> {
        let from = self.taken;
        self.taken += N;
        self.positions.as_ref()?.get(from..self.taken)?.try_into().ok()
    }

    /// The command of the actuator of this number; zero where the keyframe says nothing.
    pub(super) fn control(&self, number: usize) -> f64 {
        self.controls.as_ref().and_then(|all| all.get(number)).copied().unwrap_or(0.0)
    }

    /// Checks that joints have taken all there is, and that each of the actuators has a command.
    pub(super) fn check(&self, actuators: usize) -> Result<(), ImportError> {
        let lists = [("qpos", &self.positions, self.taken), ("ctrl", &self.controls, actuators)];
        for (name, given, expected) in lists {
            if let Some(given) = given.as_ref().filter(|given| given.len() != expected) {
                return Err(self.element.wrong(format!("`{name}` has {} numbers; expected {expected}", given.len())));
            }
        }
        Ok(())
    }

    /// The rotation of four numbers, w first.
    pub(super) fn rotation(&self, [w, x, y, z]: [f64; 4]) -> Result<glam::DQuat, ImportError> {
        let rotation = glam::DQuat::from_xyzw(x, y, z, w);
        if rotation.length() < 1e-9 {
            return Err(self.element.wrong("`qpos` has a rotation without direction"));
        }
        Ok(rotation.normalize())
    }
}
