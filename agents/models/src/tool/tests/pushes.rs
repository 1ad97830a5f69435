//! What a tool pushes with: never more than its drive, whatever is in its way; then the tip lags, and comes back.

use super::rigid::{G, down, on_floor};
use super::*;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use crate::soft::SoftBody;
use crate::soft::{SoftMatter, SoftShape, SoftSpec};
use metachron_core::RigidState;
use metachron_geometry::Solid;

pub(super) const HALF: DVec3 = DVec3::new(0.04, 0.04, 0.03);
pub(super) const TOP_M: f64 = 2.0 * HALF.z;
const LIMIT_N: f64 = 20.0;
/// From the tip to the foremost point of the jaws, metres.
pub(super) const JAWS_M: f64 = 0.005;
/// Rates of the body and of the tool, Hz: 1:1, 2:1, 1:10, 10:1, 1:100, 100:1.
const RATES: [(f64, f64); 6] =
    [(240.0, 240.0), (240.0, 120.0), (60.0, 600.0), (600.0, 60.0), (10.0, 1000.0), (1000.0, 10.0)];

pub(super) fn cube(position: DVec3, mass_kg: f64) -> RigidSpec {
    let solid = Solid::Box { half_extents_m: HALF };
    RigidSpec { friction: 0.5, gravity: DVec3::Z * -G, sleep: true, ..RigidSpec::free(solid, position, mass_kg) }
}

/// A tool that pushes with at most `limit_n`.
pub(super) fn tool(keyframes: Vec<Keyframe>, limit_n: f64) -> Tool {
    Tool::new(ToolSpec { max_force_n: limit_n, graspable: vec![], ..spec(keyframes) }).unwrap()
}

pub(super) fn body(stage: &Stage, id: AgentId) -> RigidState {
    let Body::Rigid(state) = stage.newest(id).body else { panic!("a rigid body") };
    state
}

pub(super) fn pose(stage: &Stage, id: AgentId) -> ToolState {
    let Body::Tool(state) = stage.newest(id).body else { panic!("a tool") };
    state
}

/// Down from `high_m` in two seconds, two seconds there, and up again in one.
fn press(high_m: f64, low_m: f64) -> Vec<Keyframe> {
    let key = |at_s, z: f64| down(at_s, DVec3::Z * z, 0.0);
    vec![key(0.0, high_m), key(2.0, low_m), key(4.0, low_m), key(5.0, high_m)]
}

#[test]
fn a_tool_presses_what_stands_with_the_force_of_its_drive_and_no_more() {
    for rates in RATES {
        let mut stage = Stage::new(Faults::default());
        let place = DVec3::Z * HALF.z;
        let cube = stage.add(RigidBody::new(on_floor(cube(place, 1.0))).unwrap(), rates.0);
        // to 20 mm below the top
        let tool = stage.add(tool(press(0.2, TOP_M - 0.02), LIMIT_N), rates.1);
        let (mut most_n, mut moved_m, mut fastest_m_s) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut look = |stage: &Stage| {
            most_n = most_n.max(pose(stage, tool).force_n);
            moved_m = moved_m.max(body(stage, cube).position.distance(place));
            fastest_m_s = fastest_m_s.max(body(stage, cube).velocity.length());
        };
        stage.run(3.0, &mut look);
        let (mut force_n, mut tip_m) = ((f64::INFINITY, 0.0_f64), (f64::INFINITY, 0.0_f64));
        let mut sum = (0.0, 0.0);
        stage.run(4.0, |stage| {
            let (force, tip) = (pose(stage, tool).force_n, pose(stage, tool).tip);
            (force_n, tip_m) = ((force_n.0.min(force), force_n.1.max(force)), (tip_m.0.min(tip.z), tip_m.1.max(tip.z)));
            sum = (sum.0 + force, sum.1 + 1.0);
            look(stage);
        });
        let (lag_m, mean_n) = (stage.newest(tool).residual_m, sum.0 / sum.1);
        stage.run(7.0, &mut look);
        println!(
            "{rates:?}: {force_n:?} N, {mean_n} in the mean, {most_n} N at most, tip {tip_m:?} m, {lag_m} m behind"
        );
        println!("   box {moved_m} m aside, {fastest_m_s} m/s, then at {}", body(&stage, cube).position);
        // beside each other both make steps of 1/60 s at least; the more these differ, the more the force stutters below its bound
        assert!(force_n.0 > 0.6 * LIMIT_N && force_n.1 < 1.1 * LIMIT_N, "{rates:?}: {force_n:?} N");
        assert!(mean_n > 0.85 * LIMIT_N && mean_n < 1.01 * LIMIT_N, "{rates:?}: {mean_n} N in the mean");
        assert!(most_n < 1.2 * LIMIT_N, "{rates:?}: {most_n} N");
        let stands_m = TOP_M + JAWS_M;
        assert!(tip_m.0 > stands_m - 5e-4 && tip_m.1 < stands_m + 5e-4, "{rates:?}: tip at {tip_m:?} m");
        assert!((lag_m - 0.02 - JAWS_M).abs() < 5e-4, "{rates:?}: {lag_m} m behind its path");
        assert!(moved_m < 5e-4 && fastest_m_s < 0.03, "{rates:?}: the box is {moved_m} m aside, {fastest_m_s} m/s");
        let back = pose(&stage, tool);
        assert!(back.tip.distance(DVec3::Z * 0.2) < 1e-4 && back.force_n == 0.0, "{rates:?}: {back:?}");
    }
}

#[test]
fn a_tool_presses_what_bends_with_the_force_of_its_drive_and_no_more() {
    let obstacles = on_floor(cube(DVec3::Z, 1.0)).obstacles;
    let material = Material { young_pa: 2e5, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    for rates in [(240.0, 240.0), (60.0, 240.0), (600.0, 60.0)] {
        let path = vec![DVec3::new(-0.1, 0.0, 0.02), DVec3::new(0.1, 0.0, 0.02)];
        let free = TubeSpec::free(path, Section::hollow(0.02, 0.004, material), 8);
        let tube = TubeSpec { gravity: DVec3::Z * -G, damping_per_s: 2.0, obstacles: obstacles.clone(), ..free };
        let block = SoftSpec {
            shape: SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.04), segments: [4, 4, 2] },
            matter: SoftMatter { young_pa: 2e5, poisson: 0.3, density_kg_m3: 1000.0, damping_per_s: 4.0 },
            position: DVec3::new(-0.05, -0.05, 0.0),
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            held: vec![],
            friction: 0.5,
            gravity: DVec3::Z * -G,
            obstacles: obstacles.clone(),
            sleep: false,
        };
        let bodies: [Box<dyn Agent>; 2] = [Box::new(Tube::new(tube).unwrap()), Box::new(SoftBody::new(block).unwrap())];
        for body in bodies {
            let model = body.model();
            let mut stage = Stage::new(Faults::default());
            stage.add_boxed(body, rates.0);
            let tool = stage.add(tool(press(0.1, -0.02), LIMIT_N), rates.1);
            let (mut most_n, mut least_m) = (0.0_f64, f64::INFINITY);
            stage.run(2.5, |stage| {
                most_n = most_n.max(pose(stage, tool).force_n);
                least_m = least_m.min(pose(stage, tool).tip.z);
            });
            println!("{model} {rates:?}: {most_n} N, tip down to {least_m} m");
            // a tool whose steps are ten times the body's hears of the first touch as of a force that goes on through one of its own
            assert!(most_n > 0.8 * LIMIT_N && most_n < 1.5 * LIMIT_N, "{model} {rates:?}: {most_n} N");
            assert!(least_m > 0.0, "{model} {rates:?}: through it and the floor, to {least_m} m");
        }
    }
}

#[test]
fn a_tool_that_starts_inside_a_box_comes_out_of_it_and_throws_nothing() {
    for (rates, depth_m) in RATES.into_iter().flat_map(|rates| [0.035, 0.01, 0.0].map(|depth_m| (rates, depth_m))) {
        let (mut stage, place) = (Stage::new(Faults::default()), DVec3::Z * HALF.z);
        let cube = stage.add(RigidBody::new(on_floor(cube(place, 0.5))).unwrap(), rates.0);
        let tip = DVec3::Z * (TOP_M + JAWS_M - depth_m);
        let tool = stage.add(tool(vec![down(0.0, tip, 0.0)], LIMIT_N), rates.1);
        let (mut most_j, mut fastest_m_s) = (0.0_f64, 0.0_f64);
        stage.run(3.0, |stage| {
            most_j = most_j.max(stage.settled(cube, stage.newest(cube).time.as_secs_f64()).kinetic_j());
            fastest_m_s = fastest_m_s.max(pose(stage, tool).velocity.length());
        });
        let (tip, moved_m) = (pose(&stage, tool).tip, body(&stage, cube).position.distance(place));
        println!("{rates:?} {depth_m} m: {most_j:e} J, {fastest_m_s} m/s, tip at {tip}, box {moved_m} m aside");
        assert!(most_j < 1e-3, "{rates:?} {depth_m} m: {most_j} J"); // 0.5 kg at 6 cm/s
        assert!(fastest_m_s < 0.25, "{rates:?} {depth_m} m: it leaves at {fastest_m_s} m/s");
        assert!(moved_m < 1e-3 && tip.z > TOP_M + JAWS_M - 1e-3, "{rates:?} {depth_m} m: {moved_m} m, tip at {tip}");
    }
}

#[test]
fn a_tool_carries_what_is_light_along_as_fast_as_it_is_led() {
    for rates in RATES {
        let mut stage = Stage::new(Faults::default());
        let spec = RigidSpec { friction: 0.0, gravity: DVec3::ZERO, ..cube(DVec3::ZERO, 0.2) };
        let cube = stage.add(RigidBody::new(spec).unwrap(), rates.0);
        let key = |at_s, z: f64| down(at_s, DVec3::Z * z, 0.0);
        let tool = stage.add(tool(vec![key(0.0, 0.1), key(1.0, 0.0), key(2.0, -0.1)], LIMIT_N), rates.1);
        let mut lag_m = 0.0_f64;
        stage.run(1.6, |stage| lag_m = lag_m.max(stage.newest(tool).residual_m));
        let (tip, top) = (pose(&stage, tool).tip.z - JAWS_M, body(&stage, cube).position.z + HALF.z);
        println!("{rates:?}: {lag_m} m behind, jaws at {tip}, box at {top} m");
        // it flies ahead where the path comes to its end, and is never gone through
        assert!(lag_m < 3e-3 && tip - top > -1e-3, "{rates:?}: {lag_m} m behind, jaws at {tip}, box at {top} m");
    }
}
