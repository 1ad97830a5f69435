//! The quantities that a change of resolution keeps.

use super::*;
use glam::DVec3;
use metachron_core::Snapshot;
use proptest::prelude::*;

/// The reference tube bent and in motion, smoothly: as a run would leave it.
fn moving(segments: usize, seed: u64, held: [bool; 2]) -> Tube {
    let mut spec = reference_spec(1e6, segments);
    spec.gravity = DVec3::NEG_Z * 9.81;
    spec.clamp = held;
    let mut tube = Tube::new(spec).unwrap();
    let (mut state, mut random) = (tube.state().clone(), Random(seed));
    let waves = [random.vector(), random.vector(), random.vector()];
    let last = state.x.len() - 1;
    for k in 0..=last {
        let s = tube.division().arc_m[k];
        let window = (if held[0] { s } else { 1.0 }) * (if held[1] { 1.0 - s } else { 1.0 });
        state.u[2 * k] = (waves[0] + waves[1] * libm::sin(3.0 * s) + waves[2] * libm::cos(5.0 * s)) * window;
    }
    tube.set_state(state);
    run(&mut tube, 5.0, 0.1);
    tube
}

fn retuned(tube: &Tube, segments: usize) -> Tube {
    let mut other = tube.clone();
    other.set_resolution(Resolution { eps_m: 1.0 / segments as f64, n: 1 });
    other
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn retune_keeps_mass_length_and_linear_momentum(
        from in 8_usize..120, to in 2_usize..300, seed in 1_u64..1000, start in any::<bool>(), end in any::<bool>(),
    ) {
        let tube = moving(from, seed, [start, end]);
        let other = retuned(&tube, to);
        prop_assert_eq!(other.segments(), to);
        prop_assert_eq!(other.mass_kg(), tube.mass_kg());
        prop_assert_eq!(other.division().total_m(), tube.division().total_m());
        let (before, after) = (tube.momentum().0, other.momentum().0);
        // kg·m/s: a few hundred roundings of 0.2
        prop_assert!((after - before).length() < 1e-14, "{} became {}", before, after);
        if start {
            prop_assert_eq!(other.state().x[0], tube.state().x[0]);
            prop_assert_eq!(other.state().u[0], DVec3::ZERO);
        }
        if end {
            prop_assert_eq!(*other.state().x.last().unwrap(), *tube.state().x.last().unwrap());
        }
    }
}

#[test]
fn retune_changes_angular_momentum_by_the_square_of_epsilon() {
    let tube = moving(400, 11, [false; 2]);
    let spin = tube.momentum().1;
    let errors: Vec<f64> = [16, 32, 64, 128].map(|n| (retuned(&tube, n).momentum().1 - spin).length()).to_vec();
    let order = (errors[0] / errors[3]).log2() / 3.0;
    assert!(order > 1.8, "order {order} of {errors:?}"); // second, less the loss by the uneven division
}

#[test]
fn a_finer_division_and_back_is_the_same_shape() {
    for held in [[true, false], [false; 2], [true, true]] {
        let tube = moving(64, 3, held);
        let back = retuned(&retuned(&tube, 150), 64);
        let away = |s: f64| {
            let place = |t: &Tube| {
                let mut snapshot = Snapshot::default();
                t.write_snapshot(&mut snapshot);
                snapshot.body.probe(s).unwrap().0
            };
            (place(&tube) - place(&back)).length()
        };
        let worst = (0..=20).map(|i| away(f64::from(i) / 20.0)).fold(0.0, f64::max);
        assert!(worst < 1.0 / 64.0 / 16.0, "held {held:?}: {worst} m"); // a sixteenth of ε
        let (energy, again) = (tube.energy_j(), back.energy_j());
        assert!((again - energy).abs() < 0.05 * tube.state().kinetic_j, "held {held:?}: {energy} J, {again} J");
    }
}

#[test]
fn a_stress_free_curved_tube_stays_stress_free() {
    let mut spec = reference_spec(1e7, 40);
    spec.path_m = vec![DVec3::ZERO, DVec3::new(0.4, 0.1, 0.0), DVec3::new(0.5, 0.4, 0.2), DVec3::new(0.1, 0.6, 0.3)];
    spec.clamp = [true, true];
    let mut tube = Tube::new(spec).unwrap();
    for segments in [80, 13, 200, 40] {
        let length = tube.length_m();
        tube.set_resolution(Resolution { eps_m: length / segments as f64, n: 1 });
        assert_eq!(tube.segments(), segments);
        assert!(tube.energy_j() < 1e-18, "{segments}: {} J", tube.energy_j()); // rounding, squared, times EA
    }
}

#[test]
fn a_finer_tube_at_rest_has_a_smaller_residual() {
    let mut residuals = vec![];
    for segments in [16, 32, 64] {
        let mut spec = reference_spec(1e6, segments);
        spec.clamp = [true, false];
        spec.gravity = DVec3::NEG_Z * 9.81;
        spec.damping_per_s = 6.0;
        let mut tube = Tube::new(spec).unwrap();
        run(&mut tube, 10.0, 8.0);
        let mut snapshot = Snapshot::default();
        tube.write_snapshot(&mut snapshot);
        residuals.push(snapshot.residual_m);
        // the estimate is of the size of the true error at the tip: 6.2e-3, 1.5e-3, 3.8e-4 m
        let error = 1.58 / (segments * segments) as f64;
        assert!(snapshot.residual_m > 0.3 * error && snapshot.residual_m < 3.0 * error, "{}", snapshot.residual_m);
    }
    assert!(residuals[1] < 0.5 * residuals[0] && residuals[2] < 0.5 * residuals[1], "{residuals:?}");
}

#[test]
fn a_fixed_spacing_is_never_remeshed_and_odd_requests_get_the_nearest() {
    let mut spec = reference_spec(1e6, 10);
    spec.range = ResolutionRange { eps_m: (0.05, 0.05), n: (0, 5) };
    let mut fixed = Tube::new(spec).unwrap();
    fixed.set_resolution(Resolution { eps_m: 0.01, n: 4 });
    assert_eq!((fixed.segments(), fixed.resolution().unwrap().n), (10, 4));
    let mut tube = free_tube(10);
    for (eps_m, segments) in [(f64::NAN, 2), (1e9, 2), (0.0, SEGMENTS_MAX), (-1.0, SEGMENTS_MAX), (0.25, 4)] {
        tube.set_resolution(Resolution { eps_m, n: 1 });
        assert_eq!(tube.segments(), segments, "{eps_m}");
        run(&mut tube, 10.0, 0.02);
    }
}
