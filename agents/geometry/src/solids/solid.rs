//! Solid shapes of rigid bodies and static obstacles.

use crate::solids::contact_traits::{ContactTraits, FRICTION, RESTITUTION};
use glam::{DQuat, DVec3};
use metachron_core::OutOfRange;
use std::sync::Arc;

/// A solid in its own axes, metres, with its primitive's centre at the origin.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Solid {
    /// A ball.
    Ball {
        /// Radius, > 0.
        radius_m: f64,
    },
    /// A box.
    Box {
        /// Half of each edge, all > 0.
        half_extents_m: DVec3,
    },
    /// A capsule along z.
    Capsule {
        /// Radius, > 0.
        radius_m: f64,
        /// Half the length of the straight part, > 0.
        half_height_m: f64,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius, > 0.
        radius_m: f64,
        /// Half the length, > 0.
        half_height_m: f64,
    },
    /// The half space below z = 0; only as a static obstacle.
    Plane,
    /// The convex hull of points.
    Hull {
        /// At least four points, not all in one plane.
        points_m: Arc<[DVec3]>,
    },
    /// A triangle mesh; solid if it is closed.
    Mesh {
        /// Corners.
        points_m: Arc<[DVec3]>,
        /// Corner indices of each triangle, counter-clockwise seen from outside.
        triangles: Arc<[[u32; 3]]>,
    },
    /// Several solids as one, each solid to others where any of them is; only of bodies that move.
    Compound {
        /// 1 … [`COMPOUND_PARTS_MAX`]; none is a plane or a compound.
        parts: Arc<[CompoundPart]>,
    },
}

/// The most parts of a compound.
pub const COMPOUND_PARTS_MAX: usize = 16;

/// A part of a compound.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CompoundPart {
    /// Its shape.
    pub solid: Solid,
    /// Where its own axes are, in those of the compound, metres.
    pub position_m: DVec3,
    /// From its own axes to those of the compound; of length 1.
    pub rotation: DQuat,
    /// Its density against that of other parts, > 0: of volumes that overlap both count.
    pub density: f64,
}

impl CompoundPart {
    /// A part as dense as others.
    #[must_use]
    pub fn new(solid: Solid, position_m: DVec3, rotation: DQuat) -> Self {
        Self { solid, position_m, rotation: rotation.normalize(), density: 1.0 }
    }
}

impl Solid {
    /// A solid made of points or parts with all of them elsewhere in its axes, metres; a primitive, whose centre is their origin, stays.
    #[must_use]
    pub fn shifted(&self, by_m: DVec3) -> Self {
        let moved = |points: &Arc<[DVec3]>| points.iter().map(|point| *point + by_m).collect();
        match self {
            _ if by_m == DVec3::ZERO => self.clone(),
            Self::Hull { points_m } => Self::Hull { points_m: moved(points_m) },
            Self::Mesh { points_m, triangles } => {
                Self::Mesh { points_m: moved(points_m), triangles: Arc::clone(triangles) }
            }
            Self::Compound { parts } => {
                let part = |part: &CompoundPart| CompoundPart { position_m: part.position_m + by_m, ..part.clone() };
                Self::Compound { parts: parts.iter().map(part).collect() }
            }
            primitive => primitive.clone(),
        }
    }

    /// The distance of the farthest point from `centre_m`, metres; of primitives, from their own centre. Zero for a plane.
    pub(crate) fn radius_about_m(&self, centre_m: DVec3) -> f64 {
        match self {
            Self::Ball { radius_m } => *radius_m,
            Self::Box { half_extents_m } => half_extents_m.length(),
            Self::Capsule { radius_m, half_height_m } => radius_m + half_height_m,
            Self::Cylinder { radius_m, half_height_m } => libm::hypot(*radius_m, *half_height_m),
            Self::Plane => 0.0,
            Self::Hull { points_m } | Self::Mesh { points_m, .. } => {
                points_m.iter().map(|p| p.distance(centre_m)).fold(0.0, f64::max)
            }
            Self::Compound { parts } => {
                let far =
                    |part: &CompoundPart| part.position_m.distance(centre_m) + part.solid.radius_about_m(DVec3::ZERO);
                parts.iter().map(far).fold(0.0, f64::max)
            }
        }
    }
}

/// A static solid: every agent may touch it, no agent owns it.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Obstacle {
    /// The object's name in the scene.
    pub name: String,
    /// Its shape.
    pub solid: Solid,
    /// Position of its axes' origin, metres.
    pub position: DVec3,
    /// Rotation from its axes to the world's.
    pub rotation: DQuat,
    /// Coulomb friction coefficient, within [`FRICTION`](crate::FRICTION).
    pub friction: f64,
    /// Coefficient of restitution, within [`RESTITUTION`](crate::RESTITUTION).
    pub restitution: f64,
    /// Its groups, combine rules, spin friction, and whether it is a sensor.
    pub traits: ContactTraits,
}

impl Obstacle {
    /// Whether its friction and its restitution are in their ranges, which are those of bodies.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check_surface(&self) -> Result<(), OutOfRange> {
        FRICTION.check("friction", self.friction)?;
        RESTITUTION.check("restitution", self.restitution)
    }

    /// A solid with its axes at the origin, unturned, with a friction of 0.5 and no rebound, which touches everything.
    #[must_use]
    pub fn new(name: impl Into<String>, solid: Solid) -> Self {
        let (position, rotation, traits) = (DVec3::ZERO, DQuat::IDENTITY, ContactTraits::NONE);
        Self { name: name.into(), solid, position, rotation, friction: 0.5, restitution: 0.0, traits }
    }
}
