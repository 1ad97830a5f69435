//! The fixed solids around a body, as forms that contact can be found with in double precision.
//!
//! In: the obstacles of a spec. Out: each at its place. Never here: how long a flight past them lasts ([`super::clearance`]).
//!
//! A plane is a slab under the body, larger than it and as high as the plane: so corners and edges stand on it as on any face.

use crate::coupling::{Form, FormKind, Placed, SolidForm, View};
use crate::shape::{Obstacle, ShapeError, Solid};
use glam::{DQuat, DVec3};

/// All fixed solids.
pub(super) struct Obstacles(Vec<Standing>);

struct Standing {
    form: Form,
    position: DVec3,
    rotation: DQuat,
    /// Half the slab's height, for a plane, metres.
    slab_m: Option<f64>,
}

/// Half the size of a plane's slab, in radii of the body: it reaches past the body on all sides, and as deep.
const SLAB_RADII: f64 = 4.0;

impl Obstacles {
    /// The forms of `obstacles` for a body of `radius_m`.
    ///
    /// # Errors
    /// [`ShapeError`] for a solid that is no shape.
    pub(super) fn new(obstacles: &[Obstacle], radius_m: f64) -> Result<Self, ShapeError> {
        let standing = obstacles.iter().map(|obstacle| {
            let slab_m = matches!(obstacle.solid, Solid::Plane).then_some(SLAB_RADII * radius_m);
            let slab = slab_m.map(|half| Solid::Box { half_extents_m: DVec3::splat(half) });
            let solid = slab.unwrap_or_else(|| obstacle.solid.clone());
            let kind = FormKind::Solid(SolidForm::new(solid, DVec3::ZERO)?);
            let form = Form { kind, friction: obstacle.friction, restitution: obstacle.restitution };
            Ok(Standing { form, position: obstacle.position, rotation: obstacle.rotation.normalize(), slab_m })
        });
        Ok(Self(standing.collect::<Result<_, _>>()?))
    }

    /// Each where it stands, for a body at `at`.
    pub(super) fn iter(&self, at: DVec3) -> impl Iterator<Item = (Placed<'_>, &Form)> {
        self.0.iter().map(move |standing| {
            let view = View::Solid { position: standing.place(at), rotation: standing.rotation };
            (Placed { form: &standing.form, view }, &standing.form)
        })
    }
}

impl Standing {
    /// Where its middle is, for a body at `at`.
    fn place(&self, at: DVec3) -> DVec3 {
        let Some(half) = self.slab_m else { return self.position };
        let up = self.rotation * DVec3::Z;
        at - up * (up.dot(at - self.position) + half)
    }
}
