//! A rigid body as an agent: a rapier3d world of its own.

use crate::shape::{Obstacle, Solid};
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// A rigid body before it is built.
#[derive(Debug, Clone)]
pub struct RigidSpec {
    /// Its shape; not a plane.
    pub solid: Solid,
    /// Where the shape's axes start, metres.
    pub position: DVec3,
    /// Rotation from the shape's axes to the world's.
    pub rotation: DQuat,
    /// Velocity of the centre of mass at the start, m/s.
    pub velocity: DVec3,
    /// Angular velocity at the start, rad/s, world axes.
    pub spin: DVec3,
    /// Mass, kilograms, > 0.
    pub mass_kg: f64,
    /// Coefficient of restitution, 0 … 1.
    pub restitution: f64,
    /// Coulomb friction coefficient, ≥ 0.
    pub friction: f64,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Solids that never move.
    pub obstacles: Arc<[Obstacle]>,
    /// Whether the body may report that it is at rest.
    pub sleep: bool,
}
