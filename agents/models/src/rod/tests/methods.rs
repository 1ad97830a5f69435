//! Every integrator of the tube, against independent answers.

use super::state::RodState;
use super::step::{Setting, Stepper};
use super::*;
use glam::DVec3;

const SWING: &str = include_str!("../../../../../crates/lab/src/chart/accuracy/swing_cable.json");

/// The cable of the reference: inextensible but for a thousandth, pinned at the origin, horizontal at first.
fn swinging(integrator: Integrator, segments: usize, substeps: u32) -> Tube {
    let mut spec = reference_spec(1e6, segments);
    (spec.section.ea_n, spec.section.ga_n) = (spec.section.ea_n * 1e3, spec.section.ga_n * 1e3);
    (spec.integrator, spec.substeps) = (integrator, substeps);
    (spec.pin, spec.gravity) = ([true, false], DVec3::NEG_Z * 9.81);
    Tube::new(spec).unwrap()
}

/// μ g L²/2, J: the energy of a fall of the cable's middle by half its length.
fn scale_j(tube: &Tube) -> f64 {
    tube.mass_kg() * 9.81 * tube.length_m() / 2.0
}

/// RMS distance of the tip from the reference over the first second, metres, and the least and the greatest energy over two
/// seconds, in that of [`scale_j`], from the start; then how many substeps a step took.
fn swing_error(tube: &mut Tube) -> (f64, f64, f64, f64) {
    let file: serde_json::Value = serde_json::from_str(SWING).unwrap();
    let tips = file["tip_xz_every_10ms"].as_array().unwrap();
    let (start, scale) = (tube.energy_j(), scale_j(tube));
    let (mut sum, mut least, mut most, mut taken) = (0.0, 0.0_f64, 0.0_f64, 0);
    for (k, tip) in tips.iter().enumerate().skip(1) {
        taken += run(tube, 10.0, 0.01);
        let want = DVec3::new(tip[0].as_f64().unwrap(), 0.0, tip[1].as_f64().unwrap());
        if k <= 100 {
            sum += tube.state().x.last().unwrap().distance_squared(want);
        }
        let change = (tube.energy_j() - start) / scale;
        (least, most) = (least.min(change), most.max(change));
    }
    ((sum / 100.0_f64).sqrt(), least, most, f64::from(taken) / 200.0)
}

#[test]
fn second_order_methods_follow_the_swinging_cable() {
    for (integrator, loses) in [(Integrator::Bdf2, 5e-3), (Integrator::EnergyMomentum, 1e-6)] {
        let (rms, least, most, substeps) = swing_error(&mut swinging(integrator, 32, 4));
        let name = integrator.name();
        println!("{name}: RMS {rms:e} m, energy {least:e} … {most:e}, {substeps} substeps a step");
        // the wanted bounds; 4.4e-4 m is the error of 32 links in space alone (`link_chain_error_vs_extrapolated`)
        assert!(rms <= 5e-4, "{name}: {rms} m");
        assert!(least >= -loses && most <= 1e-6, "{name}: energy from {least} to {most}");
    }
}

#[test]
fn the_energy_momentum_rule_keeps_the_energy_of_a_swing_for_ten_seconds() {
    let mut tube = swinging(Integrator::EnergyMomentum, 32, 4);
    let (start, scale) = (tube.energy_j(), scale_j(&tube));
    for _ in 0..1000 {
        run(&mut tube, 10.0, 0.01);
        let change = (tube.energy_j() - start) / scale;
        // a loss of 5e-3 is allowed; the iteration's rest adds up over 4000 substeps and more
        assert!(change.abs() < 1e-5, "{change} of the energy");
    }
}

/// Where the tip of a clamped soft tube is 0.2 s after it is let go.
fn let_go(integrator: Integrator, dt_ms: f64) -> DVec3 {
    let mut spec = reference_spec(1e6, 16);
    (spec.integrator, spec.clamp, spec.gravity) = (integrator, [true, false], DVec3::NEG_Z * 9.81);
    let mut tube = Tube::new(spec).unwrap();
    run(&mut tube, dt_ms, 0.2);
    tube.state().x[16]
}

#[test]
fn methods_converge_in_time_with_their_order_to_what_another_one_finds() {
    // the finest of one of second order is the answer for the others, and errs by 1/100 of theirs
    for (integrator, judge, dt_ms, order) in [
        (Integrator::SymplecticEuler, Integrator::EnergyMomentum, 0.8, 1.0),
        (Integrator::ImplicitEuler, Integrator::EnergyMomentum, 2.0, 1.0),
        (Integrator::Bdf2, Integrator::EnergyMomentum, 4.0, 2.0),
        (Integrator::EnergyMomentum, Integrator::Bdf2, 8.0, 2.0),
    ] {
        let answer = let_go(judge, 0.1);
        let errors = [dt_ms, 0.5 * dt_ms].map(|dt_ms| let_go(integrator, dt_ms).distance(answer));
        let fitted = (errors[0] / errors[1]).log2();
        println!("{}: order {fitted:.2} of {errors:?}", integrator.name());
        assert!((fitted - order).abs() < 0.1, "{}: order {fitted} of {errors:?}", integrator.name());
    }
}

#[test]
fn every_integrator_hangs_as_the_reference_does() {
    // tests/reference/cosserat_tube.json, soft, Simo and Reissner's law
    let want = DVec3::new(0.154_509_821_663_971_9, 0.0, -0.945_477_291_339_209_9);
    for integrator in Integrator::ALL {
        let mut spec = reference_spec(1e6, 16);
        (spec.integrator, spec.clamp, spec.damping_per_s) = (integrator, [true, false], 6.0);
        spec.gravity = DVec3::NEG_Z * 9.81;
        let mut tube = Tube::new(carried(spec, 11.0)).unwrap();
        run(&mut tube, 10.0, 8.0);
        let error = tube.state().x[16].distance(want);
        // 6.17e-3 is the floor of 16 segments; constraints may bend a tenth too softly
        let allowed = if integrator == Integrator::Xpbd { 9e-3 } else { 6.3e-3 };
        println!("{}: {error:e}", integrator.name());
        assert!(error < allowed, "{}: {error} m", integrator.name());
    }
}

#[test]
fn the_explicit_limit_lies_just_below_where_the_tube_blows_up() {
    for (young_pa, segments) in [(1e6, 8), (1e6, 32), (1e8, 16)] {
        let mut spec = reference_spec(young_pa, segments);
        (spec.integrator, spec.clamp) = (Integrator::SymplecticEuler, [true, false]);
        let tube = Tube::new(spec).unwrap();
        let limit_s = tube.longest_substep_s().unwrap();
        let grown = |share: f64| {
            let mut tube = tube.clone();
            let mut state = tube.state().clone();
            let mut random = Random(3);
            state.u.iter_mut().skip(1).for_each(|u| *u = random.vector() * 1e-6);
            tube.set_state(state);
            let start = tube.energy_j();
            // the integrator itself takes any span
            let whole = |stepper: &mut Stepper, now: &mut RodState, setting: &Setting<'_>| {
                stepper.step(now, &Setting { longest_s: f64::INFINITY, ..*setting })
            };
            let steps = (0..3000).take_while(|_| {
                let divergence = tube.step_by(share * limit_s, whole).is_err();
                !divergence && tube.energy_j() < 1e6 * start
            });
            (steps.count(), tube.energy_j() / start)
        };
        let (steps, growth) = grown(0.99);
        assert!(steps == 3000 && growth < 10.0, "E {young_pa:e}, {segments} segments: {growth} after {steps} steps");
        let (steps, growth) = grown(1.25);
        assert!(steps < 3000, "E {young_pa:e}, {segments} segments: only {growth} at 1.25 of the limit");
    }
}

/// A square of the map of `chart stability`: the explicit limit is 2.26 ms at rest, 1.88 ms as the tube hangs, stretched by a fifth.
#[test]
fn an_explicit_tube_that_stretches_on_its_way_takes_shorter_substeps_and_hangs_as_the_implicit_one() {
    let hang = |integrator| {
        let spec = TubeSpec { integrator, damping_per_s: 6.0, ..reference_spec(5e4, 32) };
        let mut tube = Tube::new(TubeSpec { clamp: [true, false], gravity: DVec3::NEG_Z * 9.81, ..spec }).unwrap();
        let mut most = 1.0_f64;
        for _ in 0..60 {
            run(&mut tube, 2.0, 0.1);
            most = most.max(tube.stretch());
        }
        (tube, most)
    };
    let (explicit, most) = hang(Integrator::SymplecticEuler);
    let (limit_s, (implicit, _)) = (explicit.longest_substep_s().unwrap(), hang(Integrator::ImplicitEuler));
    let apart_m = explicit.state().x[32].distance(implicit.state().x[32]);
    println!("limit {limit_s:e} s at rest, stretched {most:.3} times, {apart_m:e} m apart");
    assert!(limit_s > 2e-3 && limit_s < 2e-3 * most, "{limit_s} s, stretched {most} times");
    assert!(apart_m < 1e-7, "{apart_m} m"); // what is left of the swing after 6 s: 1.2e-9 measured
}
