//! Fingers on springs to driven hands lift a cube by friction, each by its own clock: a body that owns contact with sprung ones.
//!
//! Independent answers: the stretch of the springs says how hard the cube is squeezed, Coulomb's law that it must be held.

use super::*;
use crate::harness::{Faults, Stage};
use crate::tool::Tool;
use crate::tool::{Keyframe, ToolSpec};
use metachron_contact::{Law, Link};

const CUBE_M: f64 = 0.015;
const CUBE_KG: f64 = 0.05;
const HALF: DVec3 = DVec3::new(0.01, 0.03, 0.02);
const FINGER_KG: f64 = 0.1;
const GAP_M: f64 = 0.005;
const SPRING_N_M: f64 = 100.0;
const SPRINGS: f64 = 4.0;
const SQUEEZE_N: f64 = 2.0;
/// The fingers have closed, have risen, and hold.
const CLOSED_S: f64 = 1.0;
const LIFTED_S: f64 = 2.0;
const END_S: f64 = 4.0;
/// Rates of cube and fingers, Hz.
const RATES: [[f64; 2]; 8] = [
    [1000.0, 1000.0],
    [1000.0, 500.0],
    [1000.0, 100.0],
    [1000.0, 50.0],
    [1000.0, 20.0],
    [1000.0, 10.0],
    [120.0, 100.0],
    [60.0, 55.0],
];

struct Grip {
    stage: Stage,
    cube: AgentId,
    fingers: [AgentId; 2],
}

fn solid(half: DVec3, at: DVec3, mass_kg: f64, obstacles: Arc<[Obstacle]>) -> RigidBody {
    let plain = spec(Solid::Box { half_extents_m: half }, at);
    RigidBody::new(RigidSpec { mass_kg, friction: 0.8, restitution: 0.0, sleep: false, obstacles, ..plain }).unwrap()
}

fn floor() -> Obstacle {
    let (name, position) = ("floor".to_owned(), DVec3::Z * -CUBE_M);
    Obstacle { name, solid: Solid::Plane, position, rotation: DQuat::IDENTITY, friction: 0.3, restitution: 0.0 }
}

/// A hand that closes from `at` to its middle until the springs press, and rises.
fn hand(at: DVec3) -> Tool {
    let inwards = -at.normalize() * (GAP_M + SQUEEZE_N / (SPRINGS * SPRING_N_M));
    let key = |at_s, way: DVec3| Keyframe { at_s, tip_m: at + way, rotation: DQuat::IDENTITY, jaw: 0.0 };
    let risen = inwards + UP * 0.05;
    let keyframes = vec![
        key(0.0, DVec3::ZERO),
        key(CLOSED_S, inwards),
        key(CLOSED_S + 0.2, inwards),
        key(LIFTED_S, risen),
        key(END_S, risen),
    ];
    let tool = ToolSpec {
        keyframes,
        repeat: false,
        reach_m: 0.01,
        stiffness_n_m: 1.0,
        damping_n_s_m: 0.0,
        max_force_n: 50.0,
        graspable: vec![],
        starts_off_m: DVec3::ZERO,
    };
    Tool::new(tool).unwrap()
}

impl Grip {
    fn new([cube_hz, finger_hz]: [f64; 2]) -> Self {
        let mut stage = Stage::new(Faults::default());
        let cube = stage.add(solid(DVec3::splat(CUBE_M), DVec3::ZERO, CUBE_KG, [floor()].into()), cube_hz);
        let places = [-1.0, 1.0].map(|side| DVec3::X * (side * (CUBE_M + HALF.x + GAP_M)));
        let hands = places.map(|at| stage.add(hand(at * 2.0), 120.0));
        let fingers = places.map(|at| stage.add(solid(HALF, at, FINGER_KG, [].into()), finger_hz));
        for i in 0..2 {
            for [b, c] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
                let corner = DVec3::new(0.0, b * HALF.y, c * HALF.z);
                let sag = UP * (FINGER_KG * G / (SPRINGS * SPRING_N_M));
                let link = Link {
                    other: hands[i],
                    here: Anchor::Local(corner),
                    there: Anchor::Local(corner + sag - places[i]),
                    stiffness_n_m: SPRING_N_M,
                    damping_n_s_m: 1.0,
                    rest_m: 0.0,
                    law: Law::Cluster,
                };
                stage.link(fingers[i], link);
            }
            [cube, fingers[0], fingers[1]].iter().for_each(|other| stage.law(hands[i], *other, Law::Off));
        }
        stage.law(hands[0], hands[1], Law::Off);
        Self { stage, cube, fingers }
    }

    fn place(stage: &Stage, id: AgentId) -> DVec3 {
        let Body::Rigid(state) = &stage.newest(id).body else { panic!("a body") };
        state.position
    }

    /// How high the cube is above the mean of the fingers, metres.
    fn height_m(&self) -> f64 {
        let [cube, a, b] = [self.cube, self.fingers[0], self.fingers[1]].map(|id| Self::place(&self.stage, id).z);
        cube - 0.5 * (a + b)
    }

    /// What the cube has given the first finger so far, N·s.
    fn given_n_s(stage: &Stage, [cube, finger]: [AgentId; 2]) -> f64 {
        stage.newest(cube).pairs.iter().filter(|pair| pair.with == finger).map(|pair| pair.impulse_n_s).sum()
    }
}

#[test]
fn a_cube_is_lifted_and_held_between_slower_fingers_with_the_force_of_their_springs() {
    for rates in RATES {
        let mut all = Grip::new(rates);
        all.stage.run(CLOSED_S + 0.2, |_| {});
        let before = all.height_m();
        all.stage.run(LIFTED_S + 0.5, |_| {});
        let (lifted, pair) = (all.height_m(), [all.cube, all.fingers[0]]);
        let (given, began) = (Grip::given_n_s(&all.stage, pair), all.stage.newest(all.cube).time);
        all.stage.run(END_S, |_| {});
        let (slip, creep) = (lifted - before, all.height_m() - lifted);
        let held_s = all.stage.newest(all.cube).time.secs_after(began);
        let contact = (Grip::given_n_s(&all.stage, pair) - given) / held_s;
        // squeezed, and half of the cube's weight carried
        let force = contact / SQUEEZE_N.hypot(0.5 * CUBE_KG * G);
        let deep = all.stage.newest(all.cube).pairs.iter().map(|pair| pair.penetration_m).fold(0.0, f64::max);
        println!("{rates:?}: slip {slip:.1e} m, creep {creep:.1e} m, {force:.4} of the force, {deep:.1e} m deep");
        let height = Grip::place(&all.stage, all.cube).z;
        assert!(height > 0.045, "{rates:?}: it lies at {height} m");
        assert!(slip.abs() < 1e-3 && creep.abs() < 1e-4, "{rates:?}: slips by {slip} m, {creep} m of it at rest");
        assert!((force - 1.0).abs() < 0.05, "{rates:?}: the contact bears {contact} N");
        assert!(deep < 1e-4, "{rates:?}: {deep} m deep");
    }
}
