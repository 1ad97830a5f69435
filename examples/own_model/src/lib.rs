//! A model of one's own: a pontoon that floats between piles, up and down, and carries bodies put on it.
//!
//! In: its hull, the water's density and drag. Out: an [`Agent`] for `Custom`. Never here: the bodies that rest on it.
//!
//! It is one node on one spring that goes as deep as water carries it (Archimedes): m z'' = B(z) − m g − c z', with the surface at z = 0.
//! A step is linearly implicit: (m + h c + h² k) v' = m v + h (B − m g), where k = −dB/dz; contact adds its impulses on the right.

pub mod puck;

use metachron::contact::member::{ClusterMember, MemberMotion, Pose, Role, SkinPoint, StepEnd, StepSystem};
use metachron::contact::solve::{Block, ProblemError, Side, SideTerm};
use metachron::core::{Archive, ArchiveError, Bounds, RigidState, StepError, archive_values};
use metachron::geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, SolidShape};
use metachron::glam::DMat3;
use metachron::prelude::*;
use std::sync::Arc;

const GRAVITY_M_S2: f64 = 9.81;
const WATER_KG_M3: f64 = 1000.0;

/// A box that floats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hull {
    /// Half its length, width and height, metres, > 0.
    pub half_m: DVec3,
    /// Its mass, kg, > 0.
    pub mass_kg: f64,
    /// The water's drag at 1 m/s, N s/m, ≥ 0.
    pub drag_n_s_m: f64,
}

impl Hull {
    /// How deep it lies in still water under a load, metres: where it displaces its mass and the load's.
    pub fn draught_m(&self, load_kg: f64) -> f64 {
        (self.mass_kg + load_kg) / (WATER_KG_M3 * self.area_m2())
    }

    fn area_m2(&self) -> f64 {
        4.0 * self.half_m.x * self.half_m.y
    }
}

/// Height of its middle, metres, and how fast that rises, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State {
    height_m: f64,
    velocity_m_s: f64,
}

/// The pontoon.
#[derive(Clone)]
pub struct Pontoon {
    hull: Hull,
    form: Arc<CollisionShape>,
    side: Side,
    now: State,
    kept: State,
    /// Where its skin is within a step, metres.
    skin_m: f64,
    block: [Block; 1],
    free: [DVec3; 1],
    velocity: [DVec3; 1],
}

impl Pontoon {
    /// Puts `hull` into still water, where it floats without a load.
    ///
    /// # Errors
    /// A size that is no box's.
    pub fn new(hull: Hull) -> Result<Self, Box<dyn std::error::Error>> {
        let solid = SolidShape::new(Solid::Box { half_extents_m: hull.half_m }, DVec3::ZERO)?;
        let now = State { height_m: hull.half_m.z - hull.draught_m(0.0), velocity_m_s: 0.0 };
        Ok(Self {
            hull,
            form: Arc::new(CollisionShape::new(ShapeKind::Solid(solid), 0.5)),
            side: upright()?,
            now,
            kept: now,
            skin_m: now.height_m,
            block: [Block { row: 0, column: 0, value: DMat3::IDENTITY }],
            free: [DVec3::ZERO],
            velocity: [DVec3::ZERO],
        })
    }

    fn draught_m(&self) -> f64 {
        (self.hull.half_m.z - self.now.height_m).clamp(0.0, 2.0 * self.hull.half_m.z)
    }

    fn middle(&self) -> DVec3 {
        DVec3::Z * self.now.height_m
    }

    fn take(&mut self, state: State) {
        self.now = state;
        self.skin_m = state.height_m;
        self.velocity = [DVec3::Z * state.velocity_m_s];
    }
}

/// How each of its points moves with its node: along z alone, the piles hold the rest.
fn upright() -> Result<Side, ProblemError> {
    Side::new(0, &[SideTerm { block: 0, map: DMat3::from_diagonal(DVec3::Z) }])
}

impl ClusterMember for Pontoon {
    /// It keeps steps of its own, whatever the rates of the bodies that rest on it.
    fn role(&self) -> Role {
        Role::Deformable
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        let (Hull { mass_kg, drag_n_s_m, .. }, State { velocity_m_s, .. }) = (self.hull, self.now);
        let lift_n_m = WATER_KG_M3 * GRAVITY_M_S2 * self.hull.area_m2();
        let draught_m = self.draught_m();
        let is_wet = draught_m > 0.0;
        let (k, c) = (if is_wet { lift_n_m } else { 0.0 }, if is_wet { drag_n_s_m } else { 0.0 });
        let a = mass_kg + h_s * c + h_s * h_s * k;
        self.block[0].value = DMat3::from_diagonal(DVec3::splat(a));
        let force_n = lift_n_m * draught_m - mass_kg * GRAVITY_M_S2;
        self.free = [DVec3::Z * ((mass_kg * velocity_m_s + h_s * force_n) / a)];
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        StepSystem { blocks: &self.block, free: &self.free, velocities: &self.velocity, ..StepSystem::default() }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: DVec3::Z * self.skin_m, rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: &self.form, view })
    }

    fn skin_point(&self, _place: &Place, _contact: ContactSide) -> SkinPoint {
        self.side.into()
    }

    fn keep(&mut self) {
        self.kept = self.now;
    }

    fn go_back(&mut self) {
        self.take(self.kept);
    }

    fn move_to(&mut self, v: &[DVec3], t_s: f64) {
        self.skin_m = self.now.height_m + v[0].z * t_s;
    }

    fn end(&mut self, &StepEnd { v, h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        let State { height_m, .. } = self.now;
        let velocity_m_s = v[0].z;
        let height_m = height_m + velocity_m_s * h_s;
        if !height_m.is_finite() {
            let what = format!("its height is {height_m} m");
            return Err(StepError::Diverged { model: "pontoon", dt_s: h_s, what });
        }
        self.take(State { height_m, velocity_m_s });
        Ok(())
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }
}

impl MemberMotion for Pontoon {
    /// The pontoon moves as a whole: so the engine sums its contacts in its state's `contact_wrench`.
    fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        // no velocities are given for where it is now
        let way_m = v.first().map_or(0.0, |v| v.z * t_s);
        let centre_m = self.middle() + DVec3::Z * way_m;
        Some(Pose { centre_m, origin_m: centre_m, ..Pose::WORLD })
    }
}

impl Agent for Pontoon {
    fn model(&self) -> &'static str {
        "pontoon"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        let (position, velocity) = (self.middle(), self.velocity[0]);
        into.clear();
        into.body = Body::Rigid(RigidState { position, velocity, ..RigidState::default() });
        let Hull { half_m, mass_kg, .. } = self.hull;
        // where others may meet it: they look for nothing that has no bounds
        let (low, high) = (position - half_m, position + half_m);
        into.bounds = Some(Bounds { low, high, speed_m_s: velocity.length() });
        let lift_j = 0.5 * WATER_KG_M3 * GRAVITY_M_S2 * self.hull.area_m2() * self.draught_m().powi(2);
        into.energy_j = mass_kg * (0.5 * velocity.length_squared() + GRAVITY_M_S2 * position.z) + lift_j;
        into.residual_m = position.length() * f64::EPSILON;
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.now.height_m, self.now.velocity_m_s)?;
        self.take(self.now);
        Ok(())
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.velocity[0] * self.hull.mass_kg;
        (linear, self.middle().cross(linear))
    }

    fn mass_kg(&self) -> f64 {
        self.hull.mass_kg
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(Arc::clone(&self.form))
    }
}
