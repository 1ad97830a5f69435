//! A model of a user's own: what stands in this file, by the contracts of agents and members alone, is enough to be touched.

use crate::bodies::{rigid, tube};
use crate::table::{GRAVITY, Table, placed};
use glam::{DMat3, DVec3};
use metachron_contact::cluster::{Block, Side};
use metachron_contact::stepper::{ClusterMember, MaterialPoint, Partner, Role};
use metachron_contact::{Agent, StepContext};
use metachron_core::{Anchor, Resolution, SimSpan, Snapshot, StepError, StepReport};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape};
use metachron_models::rigid::RigidBody;

/// A plate that rides up and down on a spring.
pub struct Plate {
    form: CollisionShape,
    block: [Block; 1],
    free: [DVec3; 1],
    velocity: [DVec3; 1],
    /// Where it is when a step begins, and where its skin is now.
    start: DVec3,
    place: DVec3,
    mass_kg: f64,
    /// Velocity and start that a macro step may begin again from.
    kept: (DVec3, DVec3),
}

const STIFFNESS_N_M: f64 = 400.0;
const DAMPING_N_S_M: f64 = 10.0;

impl Plate {
    fn new(half_m: DVec3, mass_kg: f64) -> Self {
        let solid = SolidShape::new(Solid::Box { half_extents_m: half_m }, DVec3::ZERO).unwrap();
        let form = CollisionShape::new(ShapeKind::Solid(solid), 0.5);
        let block = [Block { row: 0, column: 0, value: DMat3::IDENTITY }];
        let zero = [DVec3::ZERO];
        Self {
            form,
            block,
            free: zero,
            velocity: zero,
            start: DVec3::ZERO,
            place: DVec3::ZERO,
            mass_kg,
            kept: (DVec3::ZERO, DVec3::ZERO),
        }
    }

    /// What lies on it, N: what its spring bears beyond its own weight.
    fn felt_n(&self) -> f64 {
        -STIFFNESS_N_M * self.start.z + self.mass_kg * GRAVITY.z
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
        let momentum = self.mass_kg * (self.velocity[0].z + h_s * GRAVITY.z) - h_s * STIFFNESS_N_M * self.start.z;
        self.free = [DVec3::Z * (momentum / along)];
        Ok(())
    }

    fn blocks(&self) -> &[Block] {
        &self.block
    }

    fn free(&self) -> &[DVec3] {
        &self.free
    }

    fn velocities(&self) -> &[DVec3] {
        &self.velocity
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: self.place, rotation: glam::DQuat::IDENTITY };
        Some(PlacedShape { form: &self.form, view })
    }

    fn side(&self, _place: &Place, _contact: ContactSide) -> Side {
        Side::node(0, 0)
    }

    fn anchor(&self, _anchor: Anchor) -> Option<MaterialPoint> {
        None
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

    fn end(&mut self, v: &[DVec3], h_s: f64, _touched: bool) -> Result<(), StepError> {
        self.velocity = [v[0]];
        self.start += v[0] * h_s;
        self.place = self.start;
        Ok(())
    }

    fn is_calm(&self) -> bool {
        false
    }

    fn rest(&mut self) {}
}

impl Agent for Plate {
    fn model(&self) -> &'static str {
        "plate"
    }

    fn step(&mut self, dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let h_s = dt.as_secs_f64();
        self.begin(h_s)?;
        let free = self.free;
        self.end(&free, h_s, false)?;
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }

    fn resolution(&self) -> Option<Resolution> {
        None
    }

    fn set_resolution(&mut self, _wanted: Resolution) {}

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
        // the table of these tests reads what it feels from here
        into.residual_m = self.felt_n();
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.velocity[0] * self.mass_kg;
        (linear, self.start.cross(linear))
    }

    fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    fn member(&mut self) -> Option<&mut dyn ClusterMember> {
        Some(self)
    }
}

#[test]
fn a_plate_of_ones_own_carries_a_ball_and_a_tube_and_feels_their_weight() {
    const WEIGHT_N: f64 = 3.05;
    for plate_hz in [60.0, 240.0, 1000.0] {
        let half_m = DVec3::new(0.1, 0.1, 0.005);
        let lying = tube(DVec3::new(-0.05, 0.0, 0.0152), DVec3::Y * 0.08, 0.01);
        let ball_kg = WEIGHT_N / -GRAVITY.z - lying.agent.mass_kg();
        let ball = rigid(Solid::Ball { radius_m: 0.02 }, DVec3::new(0.05, 0.0, 0.0252), ball_kg);
        let others = [placed(RigidBody::new(ball).unwrap(), false), lying];
        let mut bodies = vec![placed(Plate::new(half_m, 0.5), false)];
        bodies.extend(others);
        let mut table = Table::among(bodies, &[]).at_rates(plate_hz, 240.0);
        let findings = table.play(2.5);
        let mut snapshot = Snapshot::default();
        table.bodies[0].agent.write_snapshot(&mut snapshot);
        let felt_n = snapshot.residual_m;
        assert!((felt_n - WEIGHT_N).abs() < 0.01 * WEIGHT_N, "{plate_hz} Hz: it feels {felt_n} N");
        assert!(findings.rest_m < 1e-4, "{plate_hz} Hz: they rest {} m deep", findings.rest_m);
        let given: f64 =
            [1, 2].map(|body| table.given_n(0, Partner::Agent(metachron_core::AgentId(body)))).iter().sum();
        assert!((given + WEIGHT_N).abs() < 0.01 * WEIGHT_N, "{plate_hz} Hz: they press by {given} N");
        for body in [1, 2] {
            let (place, velocity) = table.middle(body);
            assert!(velocity.length() < 1e-3 && place.z > -0.05, "{plate_hz} Hz: body {body} at {place}, {velocity}");
        }
    }
}
