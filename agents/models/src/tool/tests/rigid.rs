//! Rigid bodies in the jaws of a tool, each by its own clock, against closed forms: sag, tilt, weight, free fall.

use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use metachron_core::PairKind;
use metachron_core::RigidState;
use metachron_geometry::{Obstacle, Solid};

pub(super) const G: f64 = 9.81;
const HALF_M: f64 = 0.02;
const MASS_KG: f64 = 0.1;
const STIFFNESS_N_M: f64 = 2000.0;
/// Critical for the cube alone.
const DAMPING_N_S_M: f64 = 28.3;
const REACH_M: f64 = 0.02;
const WEIGHT_N: f64 = MASS_KG * G;
/// Where the cube stands at the start, and the middle of its top.
const START: DVec3 = DVec3::new(0.0, 0.0, HALF_M);
const TOP: DVec3 = DVec3::new(0.0, 0.0, 2.0 * HALF_M);
/// Rates of the body and of the tool, Hz: 1:1, 1:10, 10:1, 1:100, 100:1.
const RATES: [(f64, f64); 5] = [(240.0, 240.0), (60.0, 600.0), (600.0, 60.0), (10.0, 1000.0), (1000.0, 10.0)];
/// Down, so that the shaft stands above what is held.
const DOWN: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

fn cube(position: DVec3) -> RigidSpec {
    let solid = Solid::Box { half_extents_m: DVec3::splat(HALF_M) };
    let gravity = DVec3::Z * -G;
    RigidSpec { friction: 0.3, gravity, sleep: true, ..RigidSpec::free(solid, position, MASS_KG) }
}

pub(super) fn on_floor(spec: RigidSpec) -> RigidSpec {
    let floor = Obstacle {
        name: "floor".to_owned(),
        solid: Solid::Plane,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    };
    RigidSpec { obstacles: [floor].into(), ..spec }
}

/// The jaws of a tool that comes from above.
pub(super) fn down(at_s: f64, tip_m: DVec3, jaw: f64) -> Keyframe {
    Keyframe { rotation: DOWN, ..key(at_s, tip_m, jaw) }
}

/// Lowered open to `tip` in half a second, shut, and lifted by `high_m` until 1.6 s.
fn lift(tip: DVec3, high_m: f64) -> Vec<Keyframe> {
    let key = |at_s, above_m: f64, jaw| down(at_s, tip + DVec3::Z * above_m, jaw);
    vec![key(0.0, 0.05, 1.0), key(0.5, 0.0, 1.0), key(0.7, 0.0, 0.0), key(1.0, 0.0, 0.0), key(1.6, high_m, 0.0)]
}

/// A cube on the floor, and a tool that may grasp it.
struct Pair {
    stage: Stage,
    body: AgentId,
    tool: AgentId,
}

impl Pair {
    fn new(keyframes: Vec<Keyframe>, damping_n_s_m: f64, rates: (f64, f64), faults: Faults) -> Self {
        let mut stage = Stage::new(faults);
        let body = stage.add(RigidBody::new(on_floor(cube(START))).unwrap(), rates.0);
        let (reach_m, stiffness_n_m) = (REACH_M, STIFFNESS_N_M);
        let graspable = vec![body];
        let spec = ToolSpec { reach_m, stiffness_n_m, damping_n_s_m, graspable, ..spec(keyframes) };
        let tool = stage.add(Tool::new(spec).unwrap(), rates.1);
        Self { stage, body, tool }
    }

    fn state(&self) -> RigidState {
        let Body::Rigid(state) = self.stage.newest(self.body).body else { panic!("a rigid body") };
        state
    }

    fn jaws(&self) -> ToolState {
        let Body::Tool(state) = self.stage.newest(self.tool).body else { panic!("a tool") };
        state
    }

    /// How far the held point is from the tip.
    fn stretch(&self) -> DVec3 {
        let Some(Anchor::Local(local)) = self.jaws().grasp.map(|grasp| grasp.anchor) else { panic!("it holds") };
        let state = self.state();
        state.position + state.rotation * local - self.jaws().tip
    }

    /// The held point hangs below the tip by m g/k.
    fn assert_sag(&self, what: &impl std::fmt::Display) {
        let wanted_m = WEIGHT_N / STIFFNESS_N_M;
        let wrong_m = (self.stretch() + DVec3::Z * wanted_m).length();
        assert!(wrong_m < 0.01 * wanted_m, "{what}: {} from the tip, not {wanted_m} m down", self.stretch());
    }

    /// The least and the greatest force that the tool reports from now until `seconds`.
    fn forces(&mut self, seconds: f64) -> (f64, f64) {
        let (tool, mut range) = (self.tool, (f64::INFINITY, 0.0_f64));
        self.stage.run(seconds, |stage| {
            let Body::Tool(state) = stage.newest(tool).body else { panic!("a tool") };
            range = (range.0.min(state.force_n), range.1.max(state.force_n));
        });
        range
    }
}

#[test]
fn a_held_cube_hangs_by_its_weight_as_deep_and_as_upright_as_the_hold_has_it() {
    // above the middle of the top, and beside the middle of a side
    for (rates, tip) in RATES.into_iter().flat_map(|rates| [TOP, START + DVec3::X * HALF_M].map(|tip| (rates, tip))) {
        let mut pair = Pair::new(lift(tip, 0.1), DAMPING_N_S_M, rates, Faults::default());
        pair.stage.run(3.0, |_| {});
        let (least, most) = pair.forces(3.5);
        assert!(least > 0.99 * WEIGHT_N && most < 1.01 * WEIGHT_N, "{rates:?}, {tip}: {least} … {most} N");
        pair.assert_sag(&format_args!("{rates:?}, {tip}"));
        // k a² θ = m g r about the point that is held, r the lever of the centre of mass across gravity
        let (state, grasp) = (pair.state(), pair.jaws().grasp.expect("it holds"));
        let (Anchor::Local(local), Some(orientation)) = (grasp.anchor, grasp.orientation) else { panic!("{grasp:?}") };
        let lever_m = (state.rotation * local).truncate().length();
        let wanted = WEIGHT_N * lever_m / (STIFFNESS_N_M * REACH_M * REACH_M);
        let tilt = (DOWN * orientation.rotation).angle_between(state.rotation);
        println!("{rates:?} {tip}: {least} … {most} N, sag {}, tilt {tilt} for {wanted}", pair.stretch());
        assert!((tilt - wanted).abs() < 0.01 * wanted + 1e-6, "{rates:?}, {tip}: {tilt} rad, not {wanted}");
    }
}

fn faults(seed: u64) -> [Faults; 2] {
    [Faults::default(), Faults { jitter: 0.2, loss: 0.1, late: 0, seed }]
}

#[test]
fn open_jaws_come_over_a_cube_without_pushing_it_and_lift_and_turn_it() {
    for (rates, faults) in RATES.into_iter().flat_map(|rates| faults(3).map(|faults| (rates, faults))) {
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let (inside, mut keys) = (TOP - DVec3::Z * 0.002, lift(TOP - DVec3::Z * 0.002, 0.05));
        keys.push(Keyframe { rotation: quarter * DOWN, ..key(2.4, inside + DVec3::Z * 0.05, 0.0) });
        let mut pair = Pair::new(keys, DAMPING_N_S_M, rates, faults);
        pair.stage.run(0.6, |_| {});
        let moved_m = pair.state().position.distance(START);
        assert!(moved_m < 1e-4, "{rates:?} {faults:?}: it moved by {moved_m} m before it was caught");
        pair.stage.run(1.0, |_| {});
        assert!(pair.jaws().grasp.is_some(), "{rates:?} {faults:?}");
        let (body, tool, mut most_m) = (pair.body, pair.tool, 0.0_f64);
        pair.stage.run(3.5, |stage| {
            let (Body::Rigid(state), Body::Tool(jaws)) = (&stage.newest(body).body, &stage.newest(tool).body) else {
                panic!("a body and a tool")
            };
            let Some(Anchor::Local(local)) = jaws.grasp.map(|g| g.anchor) else { panic!("{rates:?}: it let go") };
            let ahead_s = stage.newest(tool).time.secs_after(stage.newest(body).time);
            let tip = jaws.tip - jaws.velocity * ahead_s;
            most_m = most_m.max((state.position + state.rotation * local - tip).length());
        });
        let turned = pair.state().rotation.angle_between(quarter);
        println!("{rates:?} {faults:?}: {most_m:.2e} m from the tip at most, at rest {}, {turned}", pair.stretch());
        pair.assert_sag(&format_args!("{rates:?} {faults:?}"));
        assert!(turned < 1e-3, "{rates:?} {faults:?}: {turned} rad from where the jaws turned it");
        // what a clock of 10 Hz cannot know of a tool that begins to move: ½ a t² of 0.8 m/s² in 0.1 s, and as much again
        assert!(most_m < 0.01, "{rates:?} {faults:?}: {most_m} m from the tip");
    }
}

/// Lifted, swung to and fro by 0.2 m in two thirds of a second until 5.9 s, then held still.
fn swing() -> Vec<Keyframe> {
    let (mut keys, high) = (lift(TOP, 0.1), TOP + DVec3::Z * 0.1);
    for i in 0..6_u32 {
        let side = if i % 2 == 0 { 0.1 } else { -0.1 };
        keys.push(down(2.0 + 2.0 * f64::from(i) / 3.0, high + DVec3::X * side, 0.0));
    }
    keys.push(down(5.9, high, 0.0));
    keys
}

#[test]
fn a_cube_that_is_swung_sideways_stays_in_the_jaws_and_comes_to_rest_with_them() {
    for (rates, faults) in RATES.into_iter().flat_map(|rates| faults(5).map(|faults| (rates, faults))) {
        let mut pair = Pair::new(swing(), DAMPING_N_S_M, rates, faults);
        let (body, mut fastest, mut tilt) = (pair.body, 0.0_f64, 0.0_f64);
        pair.stage.run(5.9, |stage| {
            let Body::Rigid(state) = &stage.newest(body).body else { panic!("a body") };
            fastest = fastest.max(state.velocity.truncate().length());
            tilt = tilt.max(state.rotation.angle_between(DQuat::IDENTITY));
        });
        pair.stage.run(8.0, |_| {});
        let state = pair.state();
        let end_m_s = state.velocity.length();
        println!("{rates:?} {faults:?}: up to {fastest:.2} m/s, {tilt:.3} rad, at the end {end_m_s:.1e} m/s");
        // 0.2 m in 2/3 s along a cubic: 1.5 times the mean, 0.45 m/s, and 2.7 m/s² at its ends. What a slow clock does not tell
        // of that is taken up by a critical spring, whose speed is then ω x/e and whose acceleration ω² x
        let unseen_s = if faults.loss > 0.0 { 2.0 } else { 1.0 } / rates.1;
        let (unseen_m, square) = (0.5 * 2.7 * unseen_s * unseen_s, STIFFNESS_N_M / MASS_KG);
        let limit_m_s = 1.1 * (0.45 + square.sqrt() * unseen_m / std::f64::consts::E);
        assert!(fastest > 0.4 && fastest < limit_m_s, "{rates:?} {faults:?}: {fastest} m/s");
        let limit = 1.2 * MASS_KG * HALF_M * (2.7 + square * unseen_m) / (STIFFNESS_N_M * REACH_M * REACH_M);
        assert!(tilt < limit, "{rates:?} {faults:?}: {tilt} rad");
        assert!(end_m_s < 1e-4 && state.spin.length() < 1e-3, "{rates:?} {faults:?}: {state:?}");
        pair.assert_sag(&format_args!("{rates:?} {faults:?}"));
    }
}

#[test]
fn a_cube_that_hangs_undamped_swings_less_and_less() {
    for (rates, faults) in RATES.into_iter().flat_map(|rates| faults(11).map(|faults| (rates, faults))) {
        let mut pair = Pair::new(lift(START + DVec3::X * HALF_M, 0.1), 0.0, rates, faults);
        pair.stage.run(2.0, |_| {});
        let (body, mut before_j) = (pair.body, f64::INFINITY);
        for half in 5..10_u32 {
            let mut most_j = 0.0_f64;
            pair.stage.run(0.5 * f64::from(half), |stage| {
                let Body::Rigid(state) = &stage.newest(body).body else { panic!("a body") };
                most_j = most_j.max(0.5 * MASS_KG * state.velocity.length_squared());
            });
            assert!(most_j <= before_j * 1.001 + 1e-12, "{rates:?} {faults:?}: {most_j} J after {before_j} J");
            before_j = most_j;
        }
        println!("{rates:?} {faults:?}: {before_j:e} J left");
    }
}

#[test]
fn a_cube_that_is_let_go_falls_straight_by_gravity() {
    for (rates, faults) in RATES.into_iter().flat_map(|rates| faults(7).map(|faults| (rates, faults))) {
        let high = TOP + DVec3::Z;
        let mut keys = lift(TOP, 1.0);
        keys.extend([down(3.0, high, 0.0), down(3.2, high, 1.0)]);
        let mut pair = Pair::new(keys, DAMPING_N_S_M, rates, faults);
        pair.stage.run(2.9, |_| {});
        assert!(pair.jaws().grasp.is_some());
        let start = pair.state();
        pair.stage.run(3.25, |_| {});
        let (first, then) = (pair.state(), pair.stage.newest(pair.body).time);
        pair.stage.run(3.35, |_| {});
        let (last, now) = (pair.state(), pair.stage.newest(pair.body).time);
        let wrong = (last.velocity - first.velocity + DVec3::Z * (G * now.secs_after(then))).length();
        let aside_m = (last.position - start.position).truncate().length();
        let spin = last.spin.length();
        println!("{rates:?} {faults:?}: {wrong:e} m/s off, {aside_m:e} m aside, spin {spin:e}");
        assert!(pair.jaws().grasp.is_none() && wrong < 1e-9, "{rates:?} {faults:?}: {wrong} m/s");
        // from rest: the speed tells how long it has fallen, and that how deep
        let (deep_m, wanted_m) = (start.position.z - last.position.z, last.velocity.z.powi(2) / (2.0 * G));
        assert!(deep_m > 0.05 && (deep_m - wanted_m).abs() < 0.01 * wanted_m, "{rates:?}: {deep_m} m, not {wanted_m}");
        assert!(aside_m < 1e-5 && spin < 1e-4, "{rates:?} {faults:?}: {aside_m} m aside, {last:?}");
    }
}

#[test]
fn the_hold_of_a_rigid_body_is_a_grasp_in_the_accounts_of_both() {
    let mut pair = Pair::new(lift(TOP, 0.1), DAMPING_N_S_M, (240.0, 600.0), Faults::default());
    pair.stage.run(2.5, |_| {});
    let state = pair.stage.newest(pair.body).pairs.iter().find(|state| state.with == pair.tool).copied();
    let state = state.expect("a pair");
    assert_eq!((state.kind, state.contacts), (PairKind::Grasp, 1));
    assert!((state.force_n - WEIGHT_N).abs() < 0.01 * WEIGHT_N, "{state:?}");
    assert_eq!(pair.stage.newest(pair.tool).touches, [pair.body], "what is held must not sleep");
}

#[test]
fn a_rigid_body_out_of_reach_or_not_to_be_grasped_is_left_alone() {
    for (tip, graspable) in [(DVec3::Z * (HALF_M + REACH_M + 1e-4), true), (DVec3::Z * HALF_M, false)] {
        let mut stage = Stage::new(Faults::default());
        let body = stage.add(RigidBody::new(RigidSpec { gravity: DVec3::ZERO, ..cube(DVec3::ZERO) }).unwrap(), 240.0);
        let graspable = if graspable { vec![body] } else { vec![] };
        let tool = ToolSpec { graspable, reach_m: REACH_M, ..spec(vec![down(0.0, tip, 0.0)]) };
        let tool = stage.add(Tool::new(tool).unwrap(), 240.0);
        stage.law(body, tool, metachron_contact::Law::Off);
        stage.run(0.2, |_| {});
        let Body::Tool(state) = stage.newest(tool).body else { panic!("a tool") };
        assert_eq!((state.grasp, state.admits), (None, None), "{tip}");
    }
}
