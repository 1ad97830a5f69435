//! A model of a user's own, by the contracts of agents and members alone: all that it needs to be touched.

use glam::{DMat3, DQuat, DVec3};
use metachron_contact::member::{ClusterMember, Role, SkinPoint, StepEnd, StepSystem};
use metachron_contact::solve::{Block, Side};
use metachron_contact::{Agent, Stepping};
use metachron_core::{Body, Bounds, RigidState, Snapshot, StepError};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape};
use std::sync::Arc;

/// A plate that rides up and down on a spring.
pub struct Plate {
    form: Arc<CollisionShape>,
    block: [Block; 1],
    free: [DVec3; 1],
    velocity: [DVec3; 1],
    /// Where it is when a step begins, and where its skin is now.
    start: DVec3,
    place: DVec3,
    half_m: DVec3,
    mass_kg: f64,
    /// Velocity and start that a macro step may begin again from.
    kept: (DVec3, DVec3),
}

const GRAVITY_M_S2: f64 = 9.81;
const STIFFNESS_N_M: f64 = 400.0;
const DAMPING_N_S_M: f64 = 10.0;

impl Plate {
    pub fn new(half_m: DVec3, mass_kg: f64) -> Self {
        let solid = SolidShape::new(Solid::Box { half_extents_m: half_m }, DVec3::ZERO).unwrap();
        let form = Arc::new(CollisionShape::new(ShapeKind::Solid(solid), 0.5));
        let block = [Block { row: 0, column: 0, value: DMat3::IDENTITY }];
        let zero = [DVec3::ZERO];
        Self {
            form,
            block,
            free: zero,
            velocity: zero,
            start: DVec3::ZERO,
            place: DVec3::ZERO,
            half_m,
            mass_kg,
            kept: (DVec3::ZERO, DVec3::ZERO),
        }
    }

    /// The load on a plate of this mass whose middle is at `height_m`, N: the force of its spring beyond its own
    /// weight.
    pub fn felt_n(height_m: f64, mass_kg: f64) -> f64 {
        -STIFFNESS_N_M * height_m - mass_kg * GRAVITY_M_S2
    }
}

impl ClusterMember for Plate {
    fn role(&self) -> Role {
        Role::Deformable
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        // across its rails it is as heavy as a house
        let along = self.mass_kg + h_s * DAMPING_N_S_M + h_s * h_s * STIFFNESS_N_M;
        self.block[0].value = DMat3::from_diagonal(DVec3::new(1e6, 1e6, along));
        let momentum = self.mass_kg * (self.velocity[0].z - h_s * GRAVITY_M_S2) - h_s * STIFFNESS_N_M * self.start.z;
        self.free = [DVec3::Z * (momentum / along)];
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        StepSystem { blocks: &self.block, free: &self.free, velocities: &self.velocity, ..StepSystem::default() }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: self.place, rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: &self.form, view })
    }

    fn skin_point(&self, _place: &Place, _contact: ContactSide) -> SkinPoint {
        Side::node(0, 0).into()
    }

    fn keep(&mut self) {
        self.kept = (self.velocity[0], self.start);
    }

    fn go_back(&mut self) {
        (self.velocity[0], self.start) = self.kept;
        self.place = self.start;
    }

    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        self.place = self.start + v[0] * t_s;
    }

    fn end(&mut self, &StepEnd { v, h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        self.velocity = [v[0]];
        self.start += v[0] * h_s;
        self.place = self.start;
        Ok(())
    }
}

impl Agent for Plate {
    fn model(&self) -> &'static str {
        "plate"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
        into.body = Body::Rigid(RigidState {
            position: self.start,
            rotation: DQuat::IDENTITY,
            velocity: self.velocity[0],
            ..RigidState::default()
        });
        // where it may be met: without bounds no search finds it
        let (low, high) = (self.start - self.half_m, self.start + self.half_m);
        into.bounds = Some(Bounds { low, high, speed_m_s: self.velocity[0].length() });
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.velocity[0] * self.mass_kg;
        (linear, self.start.cross(linear))
    }

    fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(Arc::clone(&self.form))
    }
}
