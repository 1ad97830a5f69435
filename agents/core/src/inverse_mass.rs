//! How a rigid body resists impulses: the inverse of its mass and of its inertia.
//!
//! In: nothing. Out: plain data. Never here: where a body is, what acts on it.

use glam::DMat3;

/// How a rigid body resists: the inverse of its mass and of its inertia about its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseMass {
    /// Inverse of the mass, 1/kg, ≥ 0.
    pub linear_per_kg: f64,
    /// Inverse of the inertia tensor in world axes, 1/(kg·m²).
    pub angular_per_kg_m2: DMat3,
}
