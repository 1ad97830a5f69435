//! The least model that rests on others and bears them: a cube that moves and never turns.
//!
//! In: its size and mass. Out: an [`Agent`] for `Custom`. Never here: turns, anchors, whatever a model may leave out.

use metachron::contact::member::{ClusterMember, Role, SkinPoint, StepEnd, StepSystem};
use metachron::contact::solve::{Block, Side};
use metachron::core::{Bounds, RigidState, StepError};
use metachron::geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, SolidShape};
use metachron::glam::DMat3;
use metachron::prelude::*;
use std::sync::Arc;

/// A cube that does not turn.
#[derive(Clone)]
pub struct Puck {
    half_m: f64,
    form: Arc<CollisionShape>,
    /// Its place, metres.
    at_m: DVec3,
    /// Its place and velocity when they were last kept.
    kept: [DVec3; 2],
    mass: [Block; 1],
    free: [DVec3; 1],
    velocity: [DVec3; 1],
}

impl Puck {
    /// A cube of half the edge `half_m`, metres, and `mass_kg`, kg, both > 0, at rest with its middle at `at_m`.
    ///
    /// # Errors
    /// A size that is no cube's.
    pub fn new(half_m: f64, mass_kg: f64, at_m: DVec3) -> Result<Self, Box<dyn std::error::Error>> {
        let solid = SolidShape::new(Solid::Box { half_extents_m: DVec3::splat(half_m) }, DVec3::ZERO)?;
        let form = Arc::new(CollisionShape::new(ShapeKind::Solid(solid), 0.5));
        let mass = [Block { row: 0, column: 0, value: DMat3::from_diagonal(DVec3::splat(mass_kg)) }];
        let (free, velocity) = ([DVec3::ZERO], [DVec3::ZERO]);
        Ok(Self { half_m, form, at_m, kept: [at_m, DVec3::ZERO], mass, free, velocity })
    }
}

impl ClusterMember for Puck {
    fn role(&self) -> Role {
        Role::Rigid
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.free = [self.velocity[0] - DVec3::Z * (9.81 * h_s)];
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        StepSystem { blocks: &self.mass, free: &self.free, velocities: &self.velocity, ..StepSystem::default() }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: self.at_m, rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: &self.form, view })
    }

    fn skin_point(&self, _place: &Place, _contact: ContactSide) -> SkinPoint {
        Side::node(0, 0).into()
    }

    fn end(&mut self, step: &StepEnd<'_>) -> Result<(), StepError> {
        let at_m = self.at_m + step.v[0] * step.h_s;
        if !at_m.is_finite() {
            return Err(StepError::Diverged { model: "puck", dt_s: step.h_s, what: format!("it is at {at_m} m") });
        }
        (self.at_m, self.velocity) = (at_m, [step.v[0]]);
        Ok(())
    }

    fn keep(&mut self) {
        self.kept = [self.at_m, self.velocity[0]];
    }

    fn go_back(&mut self) {
        (self.at_m, self.velocity) = (self.kept[0], [self.kept[1]]);
    }
}

impl Agent for Puck {
    fn model(&self) -> &'static str {
        "puck"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        let (position, velocity, half_m) = (self.at_m, self.velocity[0], DVec3::splat(self.half_m));
        into.clear();
        into.body = Body::Rigid(RigidState { position, velocity, ..RigidState::default() });
        into.bounds = Some(Bounds { low: position - half_m, high: position + half_m, speed_m_s: velocity.length() });
        into.energy_j = self.mass_kg() * (0.5 * velocity.length_squared() + 9.81 * position.z);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.velocity[0] * self.mass_kg();
        (linear, self.at_m.cross(linear))
    }

    fn mass_kg(&self) -> f64 {
        self.mass[0].value.x_axis.x
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(Arc::clone(&self.form))
    }
}
