//! Joints that follow other joints, against closed forms: gears, a rack, a train on a frame that flies.

use crate::joints::{G, block, party, state};
use crate::table::Table;
use glam::DVec3;
use metachron_contact::joint::{Joint, JointKind, Mimic, Motor, MotorGoal};
use metachron_core::AgentId;
use metachron_models::rigid::RigidSpec;

/// Half the edge of a cube, and the moment of inertia of one of 1 kg, m and kg m².
const HALF_M: f64 = 0.1;
const CUBE_KG_M2: f64 = 2.0 / 3.0 * HALF_M * HALF_M;
/// The torque of a motor that never gets as fast as it wants to, N m.
const TORQUE_N_M: f64 = 0.02;

fn motor(effort: f64) -> Motor {
    Motor { goal: MotorGoal::Velocity(-1e6), max_effort: effort }
}

fn hinge(motor: Option<Motor>) -> JointKind {
    JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor }
}

fn weightless(x_m: f64, mass_kg: f64) -> RigidSpec {
    RigidSpec { gravity: DVec3::ZERO, ..block(DVec3::splat(HALF_M), DVec3::X * x_m, mass_kg) }
}

fn follows(joint: u32, ratio: f64) -> Option<Mimic> {
    Some(Mimic { joint, ratio, offset: 0.0 })
}

fn on_world(body: u32, kind: JointKind, at_m: DVec3) -> Joint {
    Joint { anchor_b_m: at_m, ..Joint::new(AgentId(body), None, kind) }
}

fn step(table: &mut Table, times: u32) {
    for _ in 0..times {
        table.step();
    }
}

/// A wheel of 1 kg with a motor, and one of 2 kg that follows it.
fn gears(ratio: f64, rate_hz: f64) -> Table {
    let wheels = [weightless(0.0, 1.0), weightless(1.0, 2.0)];
    let leads = on_world(0, hinge(Some(motor(TORQUE_N_M))), DVec3::ZERO);
    let led = Joint { mimic: follows(0, ratio), ..on_world(1, hinge(None), DVec3::X) };
    party(wheels, [leads, led], rate_hz)
}

#[test]
fn a_pair_of_gears_speeds_up_by_the_torque_over_both_inertias() {
    for ratio in [1.0, -2.5, 0.3] {
        let mut table = gears(ratio, 100.0);
        step(&mut table, 300);
        let [fast, led] = [0, 1].map(|body| state(&table, body).spin.y);
        let wanted = TORQUE_N_M * 3.0 / (CUBE_KG_M2 * (1.0 + 2.0 * ratio * ratio));
        // the tolerance of solves
        assert!((fast / wanted - 1.0).abs() < 1e-6, "{fast} rad/s for {wanted}, ratio {ratio}");
        assert!((led / fast - ratio).abs() < 1e-9, "{led} rad/s at {fast}, ratio {ratio}");
    }
}

#[test]
fn gears_keep_their_teeth_over_many_turns() {
    // no whole number: an angle that has lost a turn of either shows
    let ratio = std::f64::consts::SQRT_2 - 1.0;
    let mut table = gears(ratio, 240.0);
    let mut turned = [0.0; 2];
    let mut before = [0, 1].map(|body| state(&table, body).rotation);
    for _ in 0..240 * 8 {
        table.step();
        for body in [0, 1] {
            let now = state(&table, body).rotation;
            turned[body] += (now * before[body].conjugate()).to_scaled_axis().y;
            before[body] = now;
        }
    }
    let [leads, led] = turned;
    assert!(leads > 10.0 * std::f64::consts::TAU, "{leads} rad");
    assert!((led - ratio * leads).abs() < 1e-5, "{led} rad at {leads}");
}

#[test]
fn a_rack_falls_as_slowly_as_its_wheel_lets_it() {
    // radians for each metre, and the wheel follows or leads
    let pitch = 20.0;
    let slide = JointKind::Prismatic { axis: DVec3::Z, range_m: None, motor: None };
    for wheel_follows in [true, false] {
        let bodies = [block(DVec3::splat(HALF_M), DVec3::ZERO, 1.0), weightless(1.0, 1.0)];
        let [of_rack, of_wheel] =
            if wheel_follows { [None, follows(0, pitch)] } else { [follows(1, 1.0 / pitch), None] };
        let rack = Joint { mimic: of_rack, ..on_world(0, slide, DVec3::ZERO) };
        let wheel = Joint { mimic: of_wheel, ..on_world(1, hinge(None), DVec3::X) };
        let mut table = party(bodies, [rack, wheel], 100.0);
        step(&mut table, 100);
        let (falls, turns) = (state(&table, 0).velocity.z, state(&table, 1).spin.y);
        let wanted = -G / (1.0 + CUBE_KG_M2 * pitch * pitch);
        assert!((falls / wanted - 1.0).abs() < 1e-6, "{falls} m/s for {wanted}");
        assert!((turns / falls - pitch).abs() < 1e-6 * pitch, "{turns} rad/s at {falls} m/s");
    }
}

#[test]
fn the_frame_of_gears_takes_their_reaction() {
    // a free frame with two wheels at its ends, which a motor between the frame and one of them turns
    let frame = RigidSpec { gravity: DVec3::ZERO, ..block(DVec3::new(0.6, 0.05, 0.05), DVec3::ZERO, 3.0) };
    let wheels = [weightless(-0.5, 1.0), weightless(0.5, 1.0)];
    let ratio = -3.0;
    let on_frame = |body: u32, at_m: f64, motor| Joint {
        anchor_b_m: DVec3::X * at_m,
        ..Joint::new(AgentId(body), Some(AgentId(0)), hinge(motor))
    };
    let leads = on_frame(1, -0.5, Some(motor(TORQUE_N_M)));
    let led = Joint { mimic: follows(0, ratio), ..on_frame(2, 0.5, None) };
    let masses_kg = [3.0, 1.0, 1.0];
    let frame_kg_m2 = (0.6 * 0.6 + 0.05 * 0.05) * 3.0 / 3.0;
    let moments = [frame_kg_m2, CUBE_KG_M2, CUBE_KG_M2];
    let mut table = party([frame].into_iter().chain(wheels), [leads, led], 200.0);
    for _ in 0..200 {
        table.step();
        let all = [0, 1, 2].map(|body| state(&table, body));
        let of = |at: usize| moments[at] * all[at].spin.y + masses_kg[at] * all[at].position.cross(all[at].velocity).y;
        let sum: f64 = (0..3).map(of).sum();
        let largest = (0..3).map(|at| of(at).abs()).fold(0.0, f64::max);
        assert!(sum.abs() < 1e-6 * largest.max(1e-3), "{sum:e} of {largest} N m s");
    }
    let [frame, leads, led] = [0, 1, 2].map(|body| state(&table, body).spin.y);
    // rates q of the wheels against the frame, whose rate is w, at no momentum: I w + J (q + w) + J (r q + w) = 0, with the wheels' masses at
    // the ends of the frame; the torque τ speeds q up by (J (1 + r²) − J² (1 + r)²/(I + 2 J)) q̇ = τ
    let all_kg_m2 = frame_kg_m2 + 2.0 * (CUBE_KG_M2 + 0.25);
    let own = CUBE_KG_M2 * (1.0 + ratio * ratio) - (CUBE_KG_M2 * (1.0 + ratio)).powi(2) / all_kg_m2;
    let rate = TORQUE_N_M / own;
    assert!(((leads - frame) / rate - 1.0).abs() < 1e-5, "{} rad/s for {rate}", leads - frame);
    assert!(((led - frame) / (leads - frame) - ratio).abs() < 1e-6 * ratio.abs());
    let wanted = -CUBE_KG_M2 * (1.0 + ratio) * rate / all_kg_m2;
    // the tolerance of the solve is that of velocities
    assert!((frame - wanted).abs() < 2e-7, "{frame} rad/s for {wanted}");
}

#[test]
fn gears_that_start_apart_come_together_half_way() {
    // the one that follows starts at 0.2 rad in place of 0
    let [wheel, other] = [weightless(0.0, 1.0), weightless(1.0, 1.0)];
    let led = Joint { mimic: Some(Mimic { joint: 0, ratio: 1.0, offset: 0.2 }), ..on_world(1, hinge(None), DVec3::X) };
    let mut table = party([wheel, other], [on_world(0, hinge(None), DVec3::ZERO), led], 100.0);
    step(&mut table, 200);
    let [leads, led] = [0, 1].map(|body| state(&table, body).rotation.to_scaled_axis().y);
    // the world turns the other way against a body that turns: both meet half-way
    assert!((leads - led - 0.2).abs() < 1e-5 && (leads + led).abs() < 1e-5, "{leads} and {led} rad");
}

/// A screw of 10 mm a radian in a nut that has 20 mm of room either way: a motor turns it, its nut follows.
fn screw(effort: f64) -> Table {
    let slide = JointKind::Prismatic { axis: DVec3::Z, range_m: Some([-0.02, 0.02]), motor: None };
    let turned = Motor { goal: MotorGoal::Velocity(5.0), max_effort: effort };
    let nut = Joint { mimic: follows(1, PITCH_M), ..on_world(1, slide, DVec3::X) };
    let bodies = [weightless(0.0, 1.0), weightless(1.0, 1.0)];
    party(bodies, [nut, on_world(0, hinge(Some(turned)), DVec3::ZERO)], 240.0)
}

const PITCH_M: f64 = 0.01;

/// How far the nut has moved, m, and the screw has turned in a step, rad.
fn of_screw(table: &mut Table) -> [f64; 2] {
    let before = state(table, 0).rotation;
    table.step();
    // the world turns the other way against a body that turns
    let turned = (state(table, 0).rotation * before.conjugate()).to_scaled_axis().y;
    [-state(table, 1).position.z, -turned]
}

#[test]
fn a_screw_whose_nut_is_at_its_stop_stands_and_forgets_no_turn() {
    for effort in [0.2, 20.0, 2000.0, 2e5] {
        let mut table = screw(effort);
        let mut turned = 0.0;
        // 20 mm are 0.32 turns: then it would have turned eleven times
        for step in 0..240 * 15 {
            let [nut_m, turn] = of_screw(&mut table);
            turned += turn;
            assert!(nut_m < 0.02 + 1e-5, "{nut_m} m after {step} steps at {effort} N m");
            assert!((nut_m - PITCH_M * turned).abs() < 1e-5, "{nut_m} m at {turned} rad, {effort} N m");
        }
        assert!((turned - 0.02 / PITCH_M).abs() < 1e-3, "{turned} rad at {effort} N m");
    }
}

#[test]
fn a_screw_that_forces_its_stop_never_lets_its_nut_slip_by_a_turn() {
    // 1e11 N on a nut of 1 kg: more than a stop can bear
    let mut table = screw(1e9);
    let mut before_m = 0.0;
    for step in 0..240 * 15 {
        let [nut_m, _] = of_screw(&mut table);
        assert!(nut_m > before_m - 1e-3, "{before_m} m, then {nut_m} m after {step} steps");
        before_m = nut_m;
    }
}
