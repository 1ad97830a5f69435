//! Motors of hinges and slides, against closed forms.

use crate::joints::{G, ROD_KG_M2, block, on_world, party, pendulum, state};
use crate::table::Table;
use glam::DVec3;
use metachron_contact::joint::{Joint, JointKind, Motor, MotorGoal};
use metachron_models::rigid::RigidSpec;
use std::f64::consts::FRAC_PI_2;

/// The torque by which a rod of 1 kg and 1 m hangs on its hinge where it is level, N m.
const LEVEL_N_M: f64 = 0.5 * G;

fn hinge(goal: MotorGoal, max_effort: f64) -> JointKind {
    JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor: Some(Motor { goal, max_effort }) }
}

fn slide(goal: MotorGoal, max_effort: f64) -> JointKind {
    // the world is b: it moves against a
    JointKind::Prismatic { axis: DVec3::NEG_Z, range_m: None, motor: Some(Motor { goal, max_effort }) }
}

/// By how much a rod has turned from hanging down, the way in which the world turns back against it, rad.
fn angle(table: &Table) -> f64 {
    -state(table, 0).rotation.to_scaled_axis().y
}

fn level(kind: JointKind, rate_hz: f64) -> Table {
    pendulum(-FRAC_PI_2, kind, rate_hz)
}

fn step_for(table: &mut Table, seconds: f64, mut look: impl FnMut(&mut Table)) {
    while table.time.as_secs_f64() < seconds - 1e-9 {
        table.step();
        look(table);
    }
}

#[test]
fn a_motor_holds_a_level_rod_by_a_torque_that_is_its_weights_and_by_no_less() {
    for rate_hz in [60.0, 1000.0] {
        let mut held = level(hinge(MotorGoal::Velocity(0.0), 1.0001 * LEVEL_N_M), rate_hz);
        step_for(&mut held, 1.0, |_| {});
        // the slip in the first step, whose load is new to it, comes back as fast as a ten-thousandth of the torque
        // lifts the rod
        assert!((angle(&held) - FRAC_PI_2).abs() < 5e-4, "{} rad at {rate_hz} Hz", angle(&held) - FRAC_PI_2);
        let short = 0.01;
        let mut falls = level(hinge(MotorGoal::Velocity(0.0), (1.0 - short) * LEVEL_N_M), rate_hz);
        step_for(&mut falls, 0.5, |_| {});
        let spin = state(&falls, 0).spin.length();
        let wanted = short * LEVEL_N_M / ROD_KG_M2 * 0.5;
        assert!((spin / wanted - 1.0).abs() < 0.01, "{spin} rad/s for {wanted} at {rate_hz} Hz");
    }
}

#[test]
fn a_motor_of_a_position_sags_as_its_spring_does() {
    let (stiffness, damping) = (200.0, 20.0);
    let goal = MotorGoal::Spring { position: FRAC_PI_2, velocity: 0.0, stiffness, damping };
    let mut table = level(hinge(goal, f64::INFINITY), 120.0);
    step_for(&mut table, 3.0, |_| {});
    let sag = FRAC_PI_2 - angle(&table);
    let torque = LEVEL_N_M * libm::cos(sag);
    assert!((sag * stiffness / torque - 1.0).abs() < 1e-4, "{sag} rad by {torque} N m");
    // of the whole turns that an angle may be known but for, the shorter way is taken
    let goal = MotorGoal::Spring { position: FRAC_PI_2 - std::f64::consts::TAU, velocity: 0.0, stiffness, damping };
    let mut same = level(hinge(goal, f64::INFINITY), 120.0);
    step_for(&mut same, 3.0, |_| {});
    assert!((angle(&same) - angle(&table)).abs() < 1e-9);
}

#[test]
fn a_motor_turns_at_its_velocity_until_the_load_passes_its_bound() {
    let (velocity, bound) = (0.2, 4.0);
    let mut table = pendulum(0.0, hinge(MotorGoal::Velocity(velocity), bound), 240.0);
    // there the rod's weight gives the bound, and beyond it pulls back as a spring does
    let stalls = libm::asin(bound / LEVEL_N_M);
    let swing = velocity / (LEVEL_N_M * libm::cos(stalls) / ROD_KG_M2).sqrt();
    let mut farthest = 0.0_f64;
    step_for(&mut table, 12.0, |table| {
        let (angle, spin) = (angle(table), -state(table, 0).spin.y);
        farthest = farthest.max(angle);
        if (0.01..0.95 * stalls).contains(&angle) && table.time.as_secs_f64() < 0.9 * stalls / velocity {
            assert!((spin / velocity - 1.0).abs() < 1e-3, "{spin} rad/s at {angle} rad");
        }
        assert!(spin < velocity * 1.001, "{spin} rad/s");
    });
    assert!(farthest > stalls && farthest < stalls + 1.05 * swing, "{farthest} rad, not {stalls} + {swing}");
}

#[test]
fn a_motor_of_a_slide_lifts_with_what_its_force_leaves_of_the_weight() {
    let (velocity, force) = (0.5, 15.0);
    for rate_hz in [60.0, 240.0] {
        let kind = slide(MotorGoal::Velocity(velocity), force);
        let mut table = party([block(DVec3::splat(0.1), DVec3::ZERO, 1.0)], [on_world(kind)], rate_hz);
        let mut fastest = 0.0_f64;
        step_for(&mut table, 2.0, |table| {
            let (rises, time) = (state(table, 0).velocity.z, table.time.as_secs_f64());
            let expected = ((force - G) * time).min(velocity);
            // where the velocity is reached within a step
            let near = ((force - G) * time - velocity).abs() < (force - G) / rate_hz;
            assert!(near || (rises - expected).abs() < 1e-3, "{rises} m/s for {expected} at {time} s");
            fastest = fastest.max(rises);
        });
        assert!((state(&table, 0).velocity.z / velocity - 1.0).abs() < 1e-9, "what is owed is nothing in the end");
        assert!(fastest < velocity * 1.002);
    }
}

#[test]
fn a_damped_motor_without_a_spring_gives_as_much_as_the_velocity_lacks() {
    // c (v* − v) = m g: it slips by m g/c
    let (damping, wanted) = (40.0, 1.0);
    let goal = MotorGoal::Spring { position: 0.0, velocity: wanted, stiffness: 0.0, damping };
    let mut table = party([block(DVec3::splat(0.1), DVec3::ZERO, 1.0)], [on_world(slide(goal, f64::INFINITY))], 120.0);
    step_for(&mut table, 2.0, |_| {});
    let rises = state(&table, 0).velocity.z;
    // the tolerance of the solve
    assert!((rises - (wanted - G / damping)).abs() < 5e-6, "{rises} m/s");
}

#[test]
fn a_limit_stops_a_rod_with_no_energy_gained() {
    let range_rad = Some([0.3, FRAC_PI_2]);
    let kind = JointKind::Revolute { axis: DVec3::Y, range_rad, motor: None };
    for rate_hz in [60.0, 240.0] {
        let mut table = level(kind, rate_hz);
        let (start, mut least, mut gained) = (table.energy_j(), f64::INFINITY, 0.0_f64);
        step_for(&mut table, 2.0, |table| {
            let energy = table.energy_j();
            assert!(energy < start + 1e-9, "{energy} J of {start} J");
            // in flight a published energy is first order in the step: rests are compared
            if state(table, 0).spin.length() < 1e-6 {
                gained = gained.max(energy - least);
                least = least.min(energy);
            }
        });
        assert!((angle(&table) - 0.3).abs() < 1e-5, "stopped at {} rad", angle(&table));
        assert!(state(&table, 0).spin.length() < 1e-4 && gained < 1e-6, "{gained:e} J at {rate_hz} Hz");
        // all of the fall is lost
        let lies_j = -0.5 * G * libm::cos(0.3);
        assert!((table.energy_j() - lies_j).abs() < 1e-4, "{} J", table.energy_j());
    }
}

#[test]
fn an_undamped_servo_swings_a_rotor_as_it_swings_that_mass_on_the_body() {
    let goal = MotorGoal::Spring { position: 0.05, velocity: 0.0, stiffness: 400.0, damping: 0.0 };
    let built = |mass_kg: f64, armature: f64| {
        let body = RigidSpec { gravity: DVec3::ZERO, ..block(DVec3::splat(0.1), DVec3::ZERO, mass_kg) };
        party([body], [Joint { armature, ..on_world(slide(goal, f64::INFINITY)) }], 200.0)
    };
    let [mut heavy, mut geared] = [built(1.01, 0.0), built(0.01, 1.0)];
    for step in 0..1200 {
        heavy.step();
        geared.step();
        let [heavy, geared] = [&heavy, &geared].map(|table| state(table, 0).position.z);
        assert!((heavy - geared).abs() < 1e-6, "step {step}: {heavy} {geared} m");
    }
}
