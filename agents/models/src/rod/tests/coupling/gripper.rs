//! A tube between two fingers that springs hold to driven tools: real bodies, not stand-ins.
//!
//! The tube lies on a floor; the fingers close on it, lift it and hold it. Independent answers: Coulomb's law says whether it
//! must be held, the stretch of the springs says how hard it is squeezed, its weight what friction must carry.

use super::super::reference_spec;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::TubeSpec;
use crate::tool::Tool;
use crate::tool::{Keyframe, ToolSpec};
use glam::{DQuat, DVec3};
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, Anchor, Body};
use metachron_geometry::{Obstacle, Solid};

const RADIUS_M: f64 = 0.015;
const G: f64 = 9.81;
const HALF: DVec3 = DVec3::new(0.01, 0.03, 0.02);
const FINGER_KG: f64 = 0.1;
/// Four springs a finger.
const SPRINGS: f64 = 4.0;
const SPRING_N_M: f64 = 100.0;
/// Where the middle of tube and fingers is at first, above the floor.
const LOW_M: f64 = 0.025;
const LIFT_M: f64 = 0.05;
/// The fingers have closed, have risen, and hold.
const CLOSED_S: f64 = 1.0;
const LIFTED_S: f64 = 2.0;
const END_S: f64 = 4.0;

struct Gripper {
    stage: Stage,
    tube: AgentId,
    fingers: [AgentId; 2],
    hands: [AgentId; 2],
    weight_n: f64,
}

/// A tool that closes by `way` metres to its side and rises.
fn hand(side: f64, way_m: f64) -> Tool {
    let rotation = DQuat::from_rotation_y(-side * std::f64::consts::FRAC_PI_2);
    let key = |at_s, in_m: f64, up_m: f64| Keyframe {
        at_s,
        tip_m: DVec3::new(side * (0.06 - in_m), 0.0, LOW_M + up_m),
        rotation,
        jaw: 0.0,
    };
    let keyframes = vec![
        key(0.0, 0.0, 0.0),
        key(CLOSED_S, way_m, 0.0),
        key(CLOSED_S + 0.2, way_m, 0.0),
        key(LIFTED_S, way_m, LIFT_M),
        key(END_S, way_m, LIFT_M),
    ];
    let spec = ToolSpec {
        keyframes,
        repeat: false,
        reach_m: 0.01,
        stiffness_n_m: 1.0,
        damping_n_s_m: 0.0,
        max_force_n: 50.0,
        graspable: vec![],
        starts_off_m: DVec3::ZERO,
    };
    Tool::new(spec).unwrap()
}

fn finger(side: f64) -> RigidBody {
    RigidBody::new(RigidSpec {
        solid: Solid::Box { half_extents_m: HALF },
        position: DVec3::new(side * (RADIUS_M + HALF.x + 0.005), 0.0, LOW_M),
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        mass_kg: FINGER_KG,
        restitution: 0.0,
        friction: 0.8,
        gravity: DVec3::NEG_Z * G,
        obstacles: [].into(),
        joints: [].into(),
        sleep: false,
    })
    .unwrap()
}

fn floor() -> Obstacle {
    Obstacle {
        name: "floor".to_owned(),
        solid: Solid::Plane,
        position: DVec3::Z * (LOW_M - RADIUS_M),
        rotation: DQuat::IDENTITY,
        friction: 0.3,
        restitution: 0.0,
    }
}

impl Gripper {
    /// Fingers that squeeze with `squeeze_n` once they have closed.
    fn new([tube_hz, finger_hz, hand_hz]: [f64; 3], squeeze_n: f64) -> Self {
        let mut stage = Stage::new(Faults::default());
        let path_m = vec![DVec3::new(0.0, -0.1, LOW_M), DVec3::new(0.0, 0.1, LOW_M)];
        let spec = TubeSpec {
            path_m,
            gravity: DVec3::NEG_Z * G,
            friction: 0.8,
            damping_per_s: 2.0,
            obstacles: [floor()].into(),
            substeps: (60.0 / tube_hz).ceil().max(1.0) as u32,
            ..reference_spec(1e6, 20)
        };
        let weight_n = spec.section.mass_per_length_kg_m * 0.2 * G;
        let tube = stage.add(Tube::new(spec).unwrap(), tube_hz);
        let sides = [-1.0, 1.0];
        let way_m = 0.005 + squeeze_n / (SPRINGS * SPRING_N_M);
        let hands = sides.map(|side| stage.add(hand(side, way_m), hand_hz));
        let fingers = sides.map(|side| stage.add(finger(side), finger_hz));
        for i in 0..2 {
            let turned = DQuat::from_rotation_y(-sides[i] * std::f64::consts::FRAC_PI_2);
            let away = DVec3::X * (sides[i] * (RADIUS_M + HALF.x + 0.005 - 0.06));
            for [b, c] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
                let corner = DVec3::new(0.0, b * HALF.y, c * HALF.z);
                let sag = DVec3::Z * (FINGER_KG * G / (SPRINGS * SPRING_N_M));
                stage.link(
                    fingers[i],
                    Link {
                        other: hands[i],
                        here: Anchor::Local(corner),
                        there: Anchor::Local(turned.conjugate() * (away + corner + sag)),
                        stiffness_n_m: SPRING_N_M,
                        damping_n_s_m: 1.0,
                        rest_m: 0.0,
                        law: Law::Cluster,
                    },
                );
            }
            for other in [tube, fingers[0], fingers[1]] {
                stage.law(hands[i], other, Law::Off);
            }
        }
        Self { stage, tube, fingers, hands, weight_n }
    }

    fn body(&self, id: AgentId) -> metachron_core::RigidState {
        let Body::Rigid(state) = self.stage.newest(id).body else { panic!("a finger") };
        state
    }

    /// How high the tube's middle is above the mean of the fingers, metres.
    fn height_m(&self) -> f64 {
        let middle = self.stage.newest(self.tube).body.probe(0.5).unwrap().0.z;
        middle - 0.5 * (self.body(self.fingers[0]).position.z + self.body(self.fingers[1]).position.z)
    }

    /// What friction carries of the tube, newtons: what the springs hold up beyond the fingers' own weight.
    fn carried_n(&self) -> f64 {
        let up = |id: &AgentId| self.stage.newest(*id).grips.iter().map(|grip| grip.force_n.z).sum::<f64>();
        self.fingers.iter().map(up).sum::<f64>() - 2.0 * FINGER_KG * G
    }

    /// The force of a contact and of the springs behind it, newtons.
    fn squeeze_n(&self, i: usize) -> [f64; 2] {
        let pairs = &self.stage.newest(self.tube).pairs;
        let contact = pairs.iter().find(|pair| pair.with == self.fingers[i]).map_or(0.0, |pair| pair.force_n);
        let pulled: DVec3 = self.stage.newest(self.fingers[i]).grips.iter().map(|grip| grip.force_n).sum();
        let own = DVec3::Z * (FINGER_KG * G);
        [contact, (pulled - own).length()]
    }
}

/// The weight of the tube is 0.36 N, the friction of the pair 0.8: two fingers must squeeze with 0.23 N at least.
const ENOUGH_N: f64 = 1.0;
const TOO_LITTLE_N: f64 = 0.1;
/// Rates of tube and fingers, Hz.
const RATES: [[f64; 2]; 16] = [
    [1000.0, 1000.0],
    [1000.0, 500.0],
    [1000.0, 200.0],
    [1000.0, 100.0],
    [1000.0, 50.0],
    [1000.0, 20.0],
    [1000.0, 10.0],
    [500.0, 1000.0],
    [200.0, 1000.0],
    [100.0, 1000.0],
    [50.0, 1000.0],
    [20.0, 1000.0],
    [10.0, 1000.0],
    [240.0, 480.0],
    [120.0, 100.0],
    [60.0, 55.0],
];

#[test]
fn a_tube_is_lifted_and_held_by_friction_at_any_rates() {
    for [tube_hz, finger_hz] in RATES {
        let mut all = Gripper::new([tube_hz, finger_hz, 120.0], ENOUGH_N);
        all.stage.run(CLOSED_S + 0.2, |_| {});
        let before = all.height_m();
        all.stage.run(LIFTED_S + 0.5, |_| {});
        let lifted = all.height_m();
        all.stage.run(END_S, |_| {});
        let (slip, creep) = (all.height_m() - before, all.height_m() - lifted);
        let [contact, springs] = all.squeeze_n(0);
        let (felt, carried) = (contact / springs, all.carried_n() / all.weight_n);
        println!(
            "{tube_hz} in {finger_hz} Hz: slip {slip:.1e} m, creep {creep:.1e} m, {springs:.3} N, {felt:.4}, {carried:.4}"
        );
        let rates = format!("{tube_hz} Hz in {finger_hz} Hz");
        assert!(
            slip.abs() < 5e-3 && creep.abs() < 1e-3,
            "{rates}: slips by {slip} m, {creep} of it when all is at rest"
        );
        assert!((felt - 1.0).abs() < 0.05, "{rates}: the contact bears {contact} N, the springs {springs} N");
        assert!((carried - 1.0).abs() < 0.02, "{rates}: friction carries {carried} of the weight");
        assert!((springs / ENOUGH_N.hypot(0.5 * all.weight_n) - 1.0).abs() < 0.1, "{rates}: {springs} N");
        let Body::Tool(hand) = all.stage.newest(all.hands[0]).body else { panic!("a tool") };
        let borne = ENOUGH_N.hypot(0.5 * all.weight_n + FINGER_KG * G);
        assert!((hand.force_n / borne - 1.0).abs() < 0.1, "{rates}: the hand feels {} N of {borne} N", hand.force_n);
    }
}

#[test]
fn a_tube_that_is_squeezed_less_than_its_weight_needs_stays_where_it_lies() {
    for [tube_hz, finger_hz] in [[240.0, 240.0], [1000.0, 50.0], [50.0, 1000.0]] {
        let mut all = Gripper::new([tube_hz, finger_hz, 120.0], TOO_LITTLE_N);
        all.stage.run(END_S, |_| {});
        let middle = all.stage.newest(all.tube).body.probe(0.5).unwrap().0.z;
        assert!((middle - LOW_M).abs() < 1e-3, "{tube_hz} Hz in {finger_hz} Hz: at {middle} m");
    }
}
