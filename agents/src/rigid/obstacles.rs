//! The fixed solids around a body, as forms that contact can be found with in double precision.
//!
//! In: the obstacles of a spec. Out: each at its place. Never here: how long a flight past them lasts ([`super::clearance`]).

use crate::coupling::{Form, FormKind, Placed, SolidForm, View};
use crate::shape::{Obstacle, ShapeError};
use glam::{DQuat, DVec3};

/// All fixed solids.
pub(super) struct Obstacles(Vec<Standing>);

struct Standing {
    form: Form,
    position: DVec3,
    rotation: DQuat,
}

impl Obstacles {
    /// The forms of `obstacles`.
    ///
    /// # Errors
    /// [`ShapeError`] for a solid that is no shape.
    pub(super) fn new(obstacles: &[Obstacle]) -> Result<Self, ShapeError> {
        let standing = obstacles.iter().map(|obstacle| {
            let kind = FormKind::Solid(SolidForm::new(obstacle.solid.clone(), DVec3::ZERO)?);
            let form = Form { kind, friction: obstacle.friction, restitution: obstacle.restitution };
            Ok(Standing { form, position: obstacle.position, rotation: obstacle.rotation.normalize() })
        });
        Ok(Self(standing.collect::<Result<_, _>>()?))
    }

    /// Each where it stands.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Placed<'_>, &Form)> {
        self.0.iter().map(|Standing { form, position, rotation }| {
            (Placed { form, view: View::Solid { position: *position, rotation: *rotation } }, form)
        })
    }
}
