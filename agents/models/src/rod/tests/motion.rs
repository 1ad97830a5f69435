//! Motion against closed forms and invariants.

use super::*;
use glam::{DQuat, DVec3};
use metachron_contact::AnchorSpring;
use metachron_contact::step::LoneStepper;
use metachron_core::Snapshot;

fn snapshot(tube: &Tube) -> Snapshot {
    let mut snapshot = Snapshot::default();
    tube.write_snapshot(&mut snapshot);
    snapshot
}

#[test]
fn a_free_tube_falls_as_implicit_euler_predicts_and_stays_straight() {
    let mut spec = reference_spec(1e6, 20);
    spec.gravity = DVec3::NEG_Z * 9.81;
    let mut tube = Tube::new(spec).unwrap();
    run(&mut tube, 10.0, 1.0);
    let (x, v) = snapshot(&tube).body.probe(0.5).unwrap();
    // v = g t exactly, x = g t (t + dt)/2: the implicit rule's sum; 100 steps of roundings of 10
    assert!((v - DVec3::NEG_Z * 9.81).length() < 1e-11, "{v}");
    assert!((x - DVec3::new(0.5, 0.0, -9.81 * 1.01 / 2.0)).length() < 1e-11, "{x}");
    assert!((tube.stretch() - 1.0).abs() < 1e-10);
}

#[test]
fn a_free_tube_keeps_its_momentum() {
    for integrator in Integrator::ALL {
        let mut tube = free_tube_by(integrator, 24, 5.0);
        let state = shake(&tube, 5);
        tube.set_state(state);
        let (before, spin) = tube.momentum();
        run(&mut tube, 5.0, 0.5);
        let (after, spin_after) = tube.momentum();
        let name = integrator.name();
        // the solve answers to about 1e-13; 100 steps, or 6000 substeps
        assert!((after - before).length() < 1e-11, "{name}: {before} became {after}");
        // implicit Euler damps a spin; constraints and explicit forces are lumped, and keep it to their order
        assert!(spin_after.length() <= 1.01 * spin.length(), "{name}: {spin} became {spin_after}");
    }
}

#[test]
fn an_undamped_swing_never_gains_energy() {
    for dt_ms in [2.0, 10.0, 33.0] {
        let mut spec = reference_spec(1e6, 32);
        spec.pin = [true, false];
        spec.gravity = DVec3::NEG_Z * 9.81;
        let mut tube = Tube::new(spec).unwrap();
        let mut before = tube.energy_j();
        for step in 0..(2000.0 / dt_ms) as u32 {
            run(&mut tube, dt_ms, dt_ms * 1e-3);
            let after = tube.energy_j();
            assert!(after <= before + 1e-9, "dt {dt_ms} ms, step {step}: {before} J became {after} J"); // mgL/2 is 0.9 J
            before = after;
        }
    }
}

#[test]
fn a_stiff_pinned_rod_swings_with_the_period_of_a_pendulum() {
    // 1 m rod about its end, 0.1 rad from hanging: T = 2π √(2L/3g) (1 + θ²/16)
    let mut spec = reference_spec(1e9, 4);
    let start = DVec3::new(libm::sin(0.1), 0.0, -libm::cos(0.1));
    spec.path_m = vec![DVec3::ZERO, start];
    spec.pin = [true, false];
    spec.gravity = DVec3::NEG_Z * 9.81;
    let mut tube = Tube::new(spec).unwrap();
    let (dt, mut time, mut before, mut crossings) = (0.5e-3, 0.0, start.x, vec![]);
    while crossings.len() < 3 && time < 4.0 {
        run(&mut tube, 0.5, dt);
        time += dt;
        let now = tube.state().x[4].x;
        if now * before < 0.0 {
            crossings.push(time - dt * now / (now - before));
        }
        before = now;
    }
    let period = crossings[2] - crossings[0];
    let want = std::f64::consts::TAU * (2.0_f64 / 3.0 / 9.81).sqrt() * (1.0 + 0.01 / 16.0);
    // first order in dt: the damping of one step is dt ω²/2, a shift of the period of its square; 1e-3 covers both
    assert!((period / want - 1.0).abs() < 1e-3, "{period} s, not {want} s");
}

#[test]
fn turning_the_whole_scene_turns_the_answer() {
    let q = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
    let path = [DVec3::ZERO, DVec3::new(0.3, 0.1, 0.0), DVec3::new(0.5, -0.1, 0.2), DVec3::new(0.9, 0.0, 0.1)];
    let tip = |turn: DQuat| {
        let mut spec = reference_spec(1e6, 24);
        spec.path_m = path.iter().map(|p| turn * *p).collect();
        spec.clamp = [true, false];
        spec.gravity = turn * DVec3::NEG_Z * 9.81;
        let mut tube = Tube::new(spec).unwrap();
        run(&mut tube, 10.0, 0.5);
        *tube.state().x.last().unwrap()
    };
    let difference = (q * tip(DQuat::IDENTITY) - tip(q)).length();
    assert!(difference < 1e-9, "{difference} m"); // 50 steps of 1e-15, grown by the swing
}

#[test]
fn a_curved_tube_without_load_stays_exactly_where_it_is() {
    let path: Vec<_> = (0..40)
        .map(|i| {
            let a = f64::from(i) * 0.4;
            DVec3::new(0.1 * libm::cos(a), 0.1 * libm::sin(a), 0.01 * a)
        })
        .collect();
    for (clamp, pin) in [([false; 2], [false; 2]), ([true, true], [false; 2]), ([false; 2], [true, true])] {
        let mut spec = reference_spec(1e7, 80);
        spec.path_m.clone_from(&path);
        (spec.clamp, spec.pin) = (clamp, pin);
        let mut tube = Tube::new(spec).unwrap();
        let start = tube.state().x.clone();
        run(&mut tube, 10.0, 1.0);
        let moved = tube.state().x.iter().zip(&start).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(moved < 1e-12, "clamp {clamp:?}, pin {pin:?}: {moved} m"); // rounding of the rest strains over EI
        assert!(tube.energy_j() < 1e-18, "{} J", tube.energy_j()); // strains of 1e-12, squared, times EA
    }
}

#[test]
fn the_same_calls_give_the_same_bits() {
    let hash = || {
        let mut spec = reference_spec(5e4, 40);
        spec.clamp = [true, false];
        spec.gravity = DVec3::new(1.0, 2.0, -9.81);
        let mut tube = Tube::new(spec).unwrap();
        run(&mut tube, 20.0, 1.0);
        tube.set_resolution(Resolution { eps_m: 0.013, n: 2 });
        run(&mut tube, 7.0, 0.7);
        snapshot(&tube).fold_hash(metachron_core::HASH_START)
    };
    assert_eq!(hash(), hash());
}

#[test]
fn a_refused_step_leaves_every_bit() {
    let mut tube = free_tube(8);
    let state = shake(&tube, 1);
    tube.set_state(state);
    let before = snapshot(&tube).fold_hash(metachron_core::HASH_START);
    for bad in [SimSpan::ZERO, SimSpan::from_secs_f64(2.0).unwrap()] {
        let alone = StepContext::alone(AgentId(0), SimTime::ZERO);
        assert!(LoneStepper::default().step(&mut tube, bad, alone).is_err());
        assert_eq!(snapshot(&tube).fold_hash(metachron_core::HASH_START), before);
    }
}

fn pull(arc_m: f64, target: DVec3) -> AnchorSpring {
    AnchorSpring {
        by: None,
        anchor: metachron_core::Anchor::Arc(arc_m),
        target,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 40.0,
        damping_n_s_m: 0.5,
    }
}

#[test]
fn the_published_force_of_a_pull_is_what_moves_the_tube() {
    Integrator::ALL.into_iter().for_each(published_force_moves);
}

fn published_force_moves(integrator: Integrator) {
    let mut tube = free_tube_by(integrator, 16, 8.0);
    let user_springs = [pull(0.43, DVec3::new(0.5, 0.2, 0.1)), pull(0.9, DVec3::new(0.9, 0.0, -0.3))];
    let (mut stepper, mut time) = (LoneStepper::default(), SimTime::ZERO);
    for _ in 0..100 {
        let before = tube.momentum().0;
        let context = StepContext { user_springs: &user_springs, ..StepContext::alone(AgentId(0), time) };
        stepper.step(&mut tube, millis(8.0), context).unwrap();
        let force: DVec3 = stepper.grips().iter().map(|g| g.force_n).sum();
        let gained = (tube.momentum().0 - before) / 8e-3;
        // the balance of forces holds to the accuracy of the solve, of forces of about 10 N
        assert!((gained - force).length() < 1e-9, "{}: {gained} N, published {force} N", integrator.name());
        time += millis(8.0);
    }
}

#[test]
fn a_tube_on_a_spring_hangs_where_its_weight_balances_the_spring() {
    let mut spec = reference_spec(1e6, 16);
    spec.gravity = DVec3::NEG_Z * 9.81;
    spec.damping_per_s = 8.0;
    let mut tube = Tube::new(spec).unwrap();
    let user_springs = [pull(0.5, DVec3::new(0.5, 0.0, 0.0))];
    let (mut stepper, mut time) = (LoneStepper::default(), SimTime::ZERO);
    for _ in 0..2000 {
        let context = StepContext { user_springs: &user_springs, ..StepContext::alone(AgentId(0), time) };
        stepper.step(&mut tube, millis(10.0), context).unwrap();
        time += millis(10.0);
    }
    let weight = tube.mass_kg() * 9.81;
    let snapshot = snapshot(&tube);
    assert!((stepper.grips()[0].force_n - DVec3::Z * weight).length() < 1e-6 * weight); // e^(−4 t) of 20 s, and rounding
    let sag = -snapshot.body.point(metachron_core::Anchor::Arc(0.5)).unwrap().0.z;
    assert!((sag - weight / 40.0).abs() < 1e-6, "{sag} m");
}

#[test]
fn attachments_hold_a_tube_at_its_weight_over_their_stiffness_beyond_their_slack() {
    for slack_m in [0.0, 0.02] {
        let mut spec = reference_spec(1e6, 16);
        spec.gravity = DVec3::NEG_Z * 9.81;
        spec.damping_per_s = 8.0;
        spec.attachments = vec![Attachment {
            yields_above_n: f64::INFINITY,
            from: 0.0,
            to: 1.0,
            stiffness_n_m2: 90.0,
            slack_m,
            damping_n_s_m2: 1.0,
            tears_above_n: f64::INFINITY,
        }];
        let weight = spec.section.mass_per_length_kg_m * 9.81;
        let mut tube = Tube::new(spec).unwrap();
        run(&mut tube, 10.0, 20.0);
        for x in &tube.state().x {
            assert!((x.z + slack_m + weight / 90.0).abs() < 1e-7, "slack {slack_m}: {}", x.z); // e^(−4 t) of 20 s
        }
    }
}

#[test]
fn a_tube_at_rest_reports_it_and_wakes_when_pulled() {
    let mut spec = reference_spec(1e6, 16);
    spec.clamp = [true, false];
    spec.gravity = DVec3::NEG_Z * 9.81;
    spec.damping_per_s = 6.0;
    spec.sleep = true;
    let mut tube = Tube::new(spec).unwrap();
    let (mut stepper, mut time) = (LoneStepper::default(), SimTime::ZERO);
    let mut asleep = false;
    for _ in 0..1500 {
        asleep = stepper.step(&mut tube, millis(10.0), StepContext::alone(AgentId(0), time)).unwrap().at_rest;
        time += millis(10.0);
        assert!(!asleep || time > SimTime::from_nanos(500_000_000));
    }
    assert!(asleep);
    let user_springs = [pull(1.0, DVec3::new(1.0, 0.0, 0.0))];
    let context = StepContext { user_springs: &user_springs, ..StepContext::alone(AgentId(0), time) };
    assert!(!stepper.step(&mut tube, millis(10.0), context).unwrap().at_rest);
}

#[test]
fn the_radius_follows_pressure_and_the_wave() {
    let mut spec = reference_spec(5e4, 16);
    spec.pressure_pa = 1000.0;
    spec.peristalsis = Some(Peristalsis { amplitude: 0.4, wavelength_m: 0.25, speed_m_s: 0.02 });
    let widened = 0.015 + 1000.0 * 0.015 * 0.015 * (1.0 - 0.225) / (5e4 * 0.002);
    assert!((pressed_radius_m(&spec.section, 1000.0) - widened).abs() < 1e-17);
    let mut tube = Tube::new(spec).unwrap();
    assert!((tube.radius_at_m(0.0) - 0.6 * widened).abs() < 1e-17); // the wave's trough starts at the start …
    assert!((tube.radius_at_m(0.125) - widened).abs() < 1e-17);
    run(&mut tube, 100.0, 5.0);
    assert!((tube.radius_at_m(0.1) - 0.6 * widened).abs() < 1e-15); // … and has gone 0.1 m
}

#[test]
fn an_overstretched_tube_warns() {
    let mut tube = free_tube(4);
    assert!(tube.warnings().is_empty());
    let mut state = tube.state().clone();
    state.x.iter_mut().for_each(|x| *x *= 1.5);
    tube.set_state(state);
    assert!(tube.warnings()[0].contains("1.50"), "{:?}", tube.warnings());
}
