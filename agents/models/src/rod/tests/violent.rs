//! Starts that no scene should have: the safeguards must hold them.

use super::*;
use glam::DVec3;

/// A tube that spins about its middle at `spin` rad/s, in no field.
fn spinning(integrator: Integrator, young_pa: f64, spin: f64) -> Tube {
    let mut tube = Tube::new(TubeSpec { integrator, ..reference_spec(young_pa, 32) }).unwrap();
    let mut state = tube.state().clone();
    let (axis, centre) = (DVec3::Z * spin, DVec3::X * 0.5);
    for (k, x) in state.x.iter().enumerate() {
        state.u[2 * k] = axis.cross(*x - centre);
    }
    (0..state.q.len()).for_each(|k| state.u[2 * k + 1] = axis);
    tube.set_state(state);
    tube
}

/// Runs `tube` for `seconds` and checks at every step that the energy did not rise.
fn never_rises(tube: &mut Tube, dt_ms: f64, seconds: f64, what: &str) {
    let mut before = tube.energy_j();
    let start = before;
    for step in 0..(seconds * 1e3 / dt_ms).ceil() as u32 {
        run(tube, dt_ms, dt_ms * 1e-3);
        let after = tube.energy_j();
        // the slack of the check itself: a billionth of the energies at work
        let slack = 1e-8 * (start.abs() + before.abs());
        assert!(after <= before + slack, "{what}, step {step}: {before} J became {after} J");
        before = after;
    }
}

const CASES: [(f64, f64); 9] =
    [(5e4, 5.0), (5e4, 20.0), (5e4, 40.0), (1e6, 5.0), (1e6, 20.0), (1e6, 40.0), (1e8, 5.0), (1e8, 20.0), (1e8, 40.0)];

#[test]
fn a_spinning_tube_never_gains_energy() {
    for (young_pa, dt_ms) in CASES {
        let mut tube = spinning(Integrator::ImplicitEuler, young_pa, 20.0);
        never_rises(&mut tube, dt_ms, 2.0, &format!("E {young_pa:e}, dt {dt_ms} ms"));
        assert!(tube.stretch() < 2.5, "E {young_pa:e}, dt {dt_ms} ms: stretch {}", tube.stretch());
    }
}

#[test]
fn methods_of_second_order_never_have_more_energy_than_a_spin_began_with() {
    for integrator in [Integrator::Bdf2, Integrator::EnergyMomentum] {
        for (young_pa, dt_ms) in CASES {
            let mut tube = spinning(integrator, young_pa, 20.0);
            let start = tube.energy_j();
            for step in 0..(2e3 / dt_ms) as u32 {
                run(&mut tube, dt_ms, dt_ms * 1e-3);
                let (now, name) = (tube.energy_j(), integrator.name());
                // backward differences lose and find energy in turns; an iteration leaves 1e-9 of it a substep
                assert!(
                    now <= start * (1.0 + 1e-6),
                    "{name}, E {young_pa:e}, dt {dt_ms} ms, step {step}: {start} -> {now} J"
                );
            }
        }
    }
}

#[test]
fn an_upright_column_of_bent_joints_falls_without_gaining_energy() {
    for (young_pa, dt_ms) in CASES {
        let mut spec = reference_spec(young_pa, 32);
        spec.path_m = vec![DVec3::ZERO, DVec3::Z];
        spec.clamp = [true, false];
        spec.gravity = DVec3::NEG_Z * 9.81;
        let mut tube = Tube::new(spec).unwrap();
        let (mut state, mut random) = (tube.state().clone(), Random(7));
        let mut turn = glam::DQuat::IDENTITY;
        for k in 0..state.q.len() {
            turn = rotation::unit(rotation::exp(random.vector() * 0.5) * turn);
            state.q[k] = turn * state.q[k];
            state.x[k + 1] = state.x[k] + rotation::director(state.q[k]) * tube.division().length[k];
        }
        tube.set_state(state);
        never_rises(&mut tube, dt_ms, 2.0, &format!("E {young_pa:e}, dt {dt_ms} ms"));
    }
}

#[test]
fn a_teleported_tip_comes_back_to_the_same_rest() {
    CASES.into_iter().for_each(|case| comes_back(Integrator::ImplicitEuler, case));
}

#[test]
fn a_tip_teleported_under_methods_of_second_order_comes_back_to_the_same_rest() {
    for integrator in [Integrator::Bdf2, Integrator::EnergyMomentum] {
        [(5e4, 20.0), (1e6, 5.0), (1e6, 40.0), (1e8, 40.0)].into_iter().for_each(|case| comes_back(integrator, case));
    }
}

fn comes_back(integrator: Integrator, (young_pa, dt_ms): (f64, f64)) {
    let mut spec = TubeSpec { integrator, ..reference_spec(young_pa, 32) };
    spec.clamp = [true, false];
    spec.gravity = DVec3::NEG_Z * 9.81;
    // soft tissue alone creeps for minutes; the same rest is the claim, not how soon
    spec.damping_per_s = if young_pa < 1e5 { 2.0 } else { 6.0 };
    let mut calm = Tube::new(spec.clone()).unwrap();
    run(&mut calm, 10.0, 20.0);
    let rest = calm.state().x[32];
    let mut state = calm.state().clone();
    state.x[32] += DVec3::new(0.3, 0.5, 0.4);
    let mut thrown = calm.clone();
    thrown.set_state(state);
    run(&mut thrown, dt_ms, 20.0);
    let error = (thrown.state().x[32] - rest).length();
    let name = integrator.name();
    assert!(error < 1e-5, "{name}, E {young_pa:e}, dt {dt_ms} ms: {error} m"); // the wanted bound, per length of 1 m
}
