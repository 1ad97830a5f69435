//! Solid shapes of rigid bodies and static obstacles.

use crate::ContactTraits;
use glam::{DQuat, DVec3};
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
}

impl Solid {
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
        }
    }
}

/// A static solid: every agent may touch it, no agent owns it.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// The object's name in the scene.
    pub name: String,
    /// Its shape.
    pub solid: Solid,
    /// Position of its axes' origin, metres.
    pub position: DVec3,
    /// Rotation from its axes to the world's.
    pub rotation: DQuat,
    /// Coulomb friction coefficient, ≥ 0.
    pub friction: f64,
    /// Coefficient of restitution, 0 … 1.
    pub restitution: f64,
    /// What else it says about its contacts.
    pub traits: ContactTraits,
}
