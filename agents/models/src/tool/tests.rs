//! The duties of a tool: follow its script, follow a hand, catch, hold and let go.

use super::{Keyframe, Tool, ToolError, ToolSpec};
use glam::{DQuat, DVec3};
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, AnchorSpring, Neighbour, StepContext};
use metachron_core::{AgentId, Anchor, Body, CurveState, SimSpan, SimTime, Snapshot, StepError, StepReport, ToolState};
use metachron_geometry::ContactTraits;
use std::sync::Arc;

const ME: AgentId = AgentId(7);
const TUBE: AgentId = AgentId(3);
const DT_S: f64 = 0.01;

fn key(at_s: f64, tip_m: DVec3, jaw: f64) -> Keyframe {
    Keyframe { at_s, tip_m, rotation: DQuat::IDENTITY, jaw }
}

fn spec(keyframes: Vec<Keyframe>) -> ToolSpec {
    ToolSpec {
        keyframes,
        repeat: false,
        reach_m: 0.02,
        stiffness_n_m: 200.0,
        damping_n_s_m: 1.0,
        max_force_n: 50.0,
        graspable: vec![TUBE],
        pivot_m: None,
        starts_off_m: DVec3::ZERO,
        traits: ContactTraits::default(),
    }
}

/// A straight tube of 1 cm radius along x, 1 m long, at rest.
fn tube() -> Neighbour {
    let curve = CurveState {
        arc_m: vec![0.0, 0.5, 1.0],
        positions: vec![DVec3::ZERO, DVec3::X * 0.5, DVec3::X],
        velocities: vec![DVec3::ZERO; 3],
        frames: vec![DQuat::IDENTITY; 2],
        radii_m: vec![0.01; 3],
        flattening_m: vec![],
    };
    Neighbour::observed(TUBE, Arc::new(Snapshot { body: Body::Curve(curve), ..Snapshot::default() }))
}

fn state(tool: &Tool) -> ToolState {
    let Body::Tool(state) = snapshot(tool).body else { panic!("a tool writes a tool's state") };
    state
}

fn snapshot(tool: &Tool) -> Snapshot {
    let mut snapshot = Snapshot::default();
    tool.write_snapshot(&mut snapshot);
    snapshot
}

/// A tool and its own time.
struct Stage {
    tool: Tool,
    stepper: LoneStepper,
    time: SimTime,
    neighbours: Vec<Neighbour>,
}

impl Stage {
    fn new(spec: ToolSpec) -> Self {
        let (tool, stepper) = (Tool::new(spec).unwrap(), LoneStepper::default());
        Self { tool, stepper, time: SimTime::ZERO, neighbours: vec![tube()] }
    }

    fn step_with(&mut self, user_springs: &[AnchorSpring]) -> Result<StepReport, StepError> {
        let dt = SimSpan::from_secs_f64(DT_S).unwrap();
        let context = StepContext { neighbours: &self.neighbours, user_springs, ..StepContext::alone(ME, self.time) };
        let report = self.stepper.step(&mut self.tool, dt, context)?;
        self.time += dt;
        Ok(report)
    }

    fn step(&mut self) -> StepReport {
        self.step_with(&[]).unwrap()
    }

    fn run(&mut self, seconds: f64) {
        (0..(seconds / DT_S).round() as u32).for_each(|_| drop(self.step_with(&[])));
    }
}

fn hand(target: DVec3) -> AnchorSpring {
    AnchorSpring {
        by: None,
        anchor: Anchor::Local(DVec3::ZERO),
        target,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 100.0,
        damping_n_s_m: 1.0,
    }
}

#[test]
fn the_first_snapshot_is_right_before_any_step() {
    let tool = Tool::new(spec(vec![key(0.0, DVec3::Y, 0.7), key(1.0, DVec3::X, 0.0)])).unwrap();
    let state = state(&tool);
    assert_eq!((state.tip, state.jaw, state.grasp), (DVec3::Y, 0.7, None));
}

#[test]
fn a_tool_follows_its_script_to_the_bit() {
    let mut stage = Stage::new(spec(vec![key(0.0, DVec3::Y, 1.0), key(1.0, DVec3::X, 1.0), key(2.0, DVec3::Z, 1.0)]));
    stage.run(1.0);
    assert_eq!(state(&stage.tool).tip, DVec3::X);
    stage.run(1.5);
    assert_eq!(state(&stage.tool).tip, DVec3::Z);
    assert!(stage.step().at_rest);
}

#[test]
fn a_shaft_passes_through_its_pivot_all_along_a_script_and_a_user_s_way() {
    let pivot_m = DVec3::new(0.0, 0.0, 0.3);
    let tips = [DVec3::new(0.05, 0.0, 0.1), DVec3::new(-0.04, 0.06, 0.12), DVec3::new(0.0, -0.05, 0.2)];
    let keys = tips.iter().zip(0..).map(|(tip, i)| key(f64::from(i), *tip, 1.0)).collect();
    let mut stage = Stage::new(ToolSpec { pivot_m: Some(pivot_m), ..spec(keys) });
    let check = |stage: &Stage, what: &str| {
        let ToolState { tip, rotation, .. } = state(&stage.tool);
        let local = rotation.conjugate() * (pivot_m - tip);
        // on the axis, and inserted by the distance between tip and pivot
        assert!(local.distance(DVec3::NEG_Z * tip.distance(pivot_m)) < 1e-12, "{what}: {local}");
    };
    check(&stage, "start");
    for _ in 0..150 {
        stage.step();
        check(&stage, "script");
    }
    for i in 0..200 {
        let user = hand(DVec3::new(0.002 * f64::from(i) - 0.2, 0.1, 0.05));
        stage.step_with(&[user]).unwrap();
        check(&stage, "user");
    }
    // farther than the shaft is long it stops, on the line to where it is led
    let far = DVec3::new(3.0, 0.0, -3.7);
    (0..200).for_each(|_| drop(stage.step_with(&[hand(far)])));
    check(&stage, "far");
    let stop = pivot_m + DVec3::new(3.0, 0.0, -4.0) / 5.0 * ToolSpec::insertion_m().end();
    assert!(state(&stage.tool).tip.distance(stop) < 1e-6, "{}", state(&stage.tool).tip);
    stage.run(4.0);
    assert!(state(&stage.tool).tip.distance(tips[2]) < 1e-4);
}

#[test]
fn a_pivot_that_no_shaft_passes_through_is_refused() {
    let refuse =
        |pivot_m| Tool::new(ToolSpec { pivot_m: Some(pivot_m), ..spec(vec![key(0.0, DVec3::Y, 1.0)]) }).unwrap_err();
    for away_m in [0.0, 0.024, 0.326, 5.0] {
        let error = refuse(DVec3::new(0.0, 1.0, away_m));
        assert!(matches!(error, ToolError::Unreachable { index: 0, .. }), "{error}");
    }
    for bad in [DVec3::NAN, DVec3::Y * f64::INFINITY] {
        assert!(matches!(refuse(bad), ToolError::BadNumber(_)));
    }
}

#[test]
fn a_repeating_script_never_rests() {
    let still = ToolSpec { repeat: true, ..spec(vec![key(0.0, DVec3::Y, 1.0), key(1.0, DVec3::X, 1.0)]) };
    let mut stage = Stage::new(still);
    assert!((0..1000).all(|_| !stage.step().at_rest));
}

#[test]
fn a_tool_with_one_keyframe_waits_there() {
    let mut stage = Stage::new(ToolSpec { repeat: true, ..spec(vec![key(0.0, DVec3::Y, 0.7)]) });
    assert!(stage.step().at_rest);
    assert_eq!(state(&stage.tool).tip, DVec3::Y);
}

#[test]
fn closing_jaws_hold_the_nearest_point_and_opening_jaws_let_go() {
    let over = DVec3::new(0.3, 0.0, 0.02); // 1 cm from the skin
    let mut stage =
        Stage::new(spec(vec![key(0.0, over, 1.0), key(1.0, over, 0.0), key(2.0, over, 0.0), key(3.0, over, 1.0)]));
    let mut opening = vec![];
    for _ in 0..350 {
        stage.step();
        let state = state(&stage.tool);
        let held = state.grasp.is_some();
        if opening.last().is_none_or(|&(was, _)| was != held) {
            opening.push((held, state.jaw));
        }
        if let Some(grasp) = state.grasp {
            assert_eq!((grasp.target, grasp.anchor), (TUBE, Anchor::Arc(0.3)));
            assert!(grasp.stiffness_n_m > 0.0 && grasp.stiffness_n_m <= 200.0);
            assert_eq!(snapshot(&stage.tool).touches, [TUBE]);
        } else {
            assert!(snapshot(&stage.tool).touches.is_empty());
        }
    }
    let [(false, _), (true, grasped), (false, released)] = opening[..] else { panic!("{opening:?}") };
    // jaws are looked at when the next step begins, and move by less than 2 % a step here
    assert!(grasped < 0.2 && grasped > 0.16, "grasps at {grasped}");
    assert!(released > 0.3 && released < 0.34, "lets go at {released}");
}

#[test]
fn a_grasp_ramps_up_smoothly_to_its_stiffness() {
    let over = DVec3::new(0.3, 0.0, 0.02);
    let mut stage = Stage::new(spec(vec![key(0.0, over, 0.0)]));
    let mut last = 0.0;
    for _ in 0..30 {
        stage.step();
        let now = state(&stage.tool).grasp.expect("shut jaws over a tube hold it from the start").stiffness_n_m;
        assert!(now >= last && now - last < 25.0, "{last} to {now} N/m"); // 200 N/m in 0.15 s, 1.5 at the steepest
        last = now;
    }
    assert_eq!(last, 200.0);
}

#[test]
fn jaws_that_shut_on_nothing_catch_nothing_later() {
    let (away, over) = (DVec3::new(0.3, 0.0, 0.5), DVec3::new(0.3, 0.0, 0.01));
    let mut stage = Stage::new(spec(vec![key(0.0, away, 1.0), key(0.5, away, 0.0), key(1.5, over, 0.0)]));
    stage.run(2.0);
    assert_eq!(state(&stage.tool).tip, over);
    assert_eq!(state(&stage.tool).grasp, None);
}

#[test]
fn a_tube_that_may_not_be_grasped_is_not() {
    let over = DVec3::new(0.3, 0.0, 0.02);
    let mut stage = Stage::new(ToolSpec { graspable: vec![AgentId(99)], ..spec(vec![key(0.0, over, 0.0)]) });
    stage.run(0.1);
    assert_eq!(state(&stage.tool).grasp, None);
}

#[test]
fn a_tube_out_of_reach_is_not_grasped() {
    let over = DVec3::new(0.3, 0.0, 0.0301); // 2.01 cm from the skin, the jaws reach 2 cm
    let mut stage = Stage::new(spec(vec![key(0.0, over, 0.0)]));
    stage.run(0.1);
    assert_eq!(state(&stage.tool).grasp, None);
}

#[test]
fn a_user_spring_moves_the_tip_without_a_jump_and_the_tool_returns_to_its_script() {
    let mut stage = Stage::new(spec(vec![key(0.0, DVec3::Y, 0.7)]));
    let (mut before, target) = (state(&stage.tool), DVec3::new(0.5, 1.0, 0.5));
    let mut step = |stage: &mut Stage, user_springs: &[AnchorSpring]| {
        let report = stage.step_with(user_springs).unwrap();
        let now = state(&stage.tool);
        // 0.7 m at 60/s: no faster than 0.7·60/e m/s, so no farther than that in a step
        assert!(now.tip.distance(before.tip) < 0.7 * 60.0 / std::f64::consts::E * DT_S * 1.01);
        before = now;
        report.at_rest
    };
    (0..50).for_each(|_| assert!(!step(&mut stage, &[hand(target)])));
    assert!(state(&stage.tool).tip.distance(target) < 1e-9); // e⁻³⁰ of the way is left
    let steps = (0..1000).position(|_| step(&mut stage, &[])).expect("it comes to rest");
    assert!(steps < 700, "it takes {steps} steps");
    assert_eq!((state(&stage.tool).tip, state(&stage.tool).jaw), (DVec3::Y, 0.7));
}

#[test]
fn under_a_user_spring_jaws_close_on_a_near_tube_and_open_on_release() {
    let mut stage = Stage::new(spec(vec![key(0.0, DVec3::new(0.3, 0.0, 0.3), 0.7)]));
    let near = hand(DVec3::new(0.3, 0.0, 0.015)); // 5 mm from the skin
    (0..100).for_each(|_| drop(stage.step_with(&[near])));
    assert_eq!(state(&stage.tool).grasp.map(|g| g.anchor), Some(Anchor::Arc(0.3)));
    (0..100).for_each(|_| drop(stage.step_with(&[hand(DVec3::new(0.3, 0.0, 0.2))])));
    assert!(state(&stage.tool).grasp.is_some(), "it drags what it holds");
    stage.run(0.5);
    assert_eq!(state(&stage.tool).grasp, None);
}

#[test]
fn lost_time_does_not_make_the_tip_jump() {
    let mut stage = Stage::new(spec(vec![key(0.0, DVec3::Y, 1.0), key(1.0, DVec3::X, 1.0)]));
    stage.run(0.3);
    let before = state(&stage.tool);
    stage.time += SimSpan::from_secs_f64(0.4).unwrap();
    stage.step();
    let moved = state(&stage.tool).tip.distance(before.tip);
    assert!(moved < 0.06, "{moved} m"); // the script runs 2 m/s here and catches up at 4/s of 0.8 m
    stage.run(6.0);
    assert!(state(&stage.tool).tip.distance(DVec3::X) < 1e-6);
}

#[test]
fn a_user_spring_without_a_finite_target_is_refused() {
    for target in [DVec3::NAN, DVec3::splat(1e300), DVec3::splat(f64::INFINITY)] {
        let mut stage = Stage::new(spec(vec![key(0.0, DVec3::Y, 0.7)]));
        let before = state(&stage.tool);
        let error = stage.step_with(&[hand(target)]).unwrap_err();
        assert!(matches!(error, StepError::Diverged { model: "tool", .. }), "{error}");
        assert_eq!(state(&stage.tool), before);
    }
}

#[test]
fn invalid_scripts_are_refused() {
    let refuse = |spec: ToolSpec| Tool::new(spec).expect_err("it is refused");
    assert_eq!(refuse(spec(vec![])), ToolError::NoKeyframe);
    let backwards = refuse(spec(vec![key(1.0, DVec3::Y, 1.0), key(1.0, DVec3::X, 1.0)]));
    assert!(matches!(backwards, ToolError::NotRising { index: 1, .. }), "{backwards}");
    for bad in [
        key(-1.0, DVec3::Y, 1.0),
        key(f64::NAN, DVec3::Y, 1.0),
        key(0.0, DVec3::NAN, 1.0),
        key(0.0, DVec3::Y, 1.1),
        key(0.0, DVec3::Y, f64::NAN),
        Keyframe { rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..key(0.0, DVec3::Y, 1.0) },
    ] {
        assert!(matches!(refuse(spec(vec![bad])), ToolError::BadKeyframe { index: 0, .. }), "{bad:?}");
    }
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let good = spec(vec![key(0.0, DVec3::Y, 1.0)]);
        assert!(matches!(refuse(ToolSpec { reach_m: value, ..good.clone() }), ToolError::BadNumber(_)));
        assert!(matches!(refuse(ToolSpec { stiffness_n_m: value, ..good.clone() }), ToolError::BadNumber(_)));
        assert!(matches!(refuse(ToolSpec { max_force_n: value, ..good.clone() }), ToolError::BadNumber(_)));
        assert!(matches!(refuse(ToolSpec { max_force_n: 1001.0, ..good.clone() }), ToolError::BadNumber(_)));
        let damped = Tool::new(ToolSpec { damping_n_s_m: value, ..good });
        assert_eq!(damped.is_ok(), value == 0.0, "damping {value}");
    }
}
