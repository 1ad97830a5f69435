//! Searches on costs and errors that are declared, against the best that can be worked out by hand.

use super::*;
use glam::DVec3;

/// An object whose error is a dtᵖ + b/pieces², by method, and whose cost is weight · pieces/dt.
fn plant(settings: &[Setting]) -> Trial {
    let methods = [(0.5, 1.0, 1.0), (20.0, 2.0, 2.5)];
    let one = |s: &Setting| {
        let (a, order, weight) = methods[s.method];
        let pieces = f64::from(s.pieces);
        (a * s.dt_s.powf(order) + 10.0 / (pieces * pieces), weight * 1e-6 * pieces / s.dt_s)
    };
    let all: Vec<_> = settings.iter().map(one).collect();
    Trial { error_m: all.iter().map(|x| x.0).fold(0.0, f64::max), costs_s: all.iter().map(|x| x.1).collect() }
}

fn choice(methods: &[usize]) -> Choice {
    Choice { dt_max_s: 0.1, pieces_min: 4, methods: methods.to_vec() }
}

fn search(choices: &[Choice], tolerance_m: f64, start: Setting) -> Found {
    let settings = vec![start; choices.len()];
    let trial = plant(&settings);
    Search { choices, tolerance_m, trials_max: 500, attempt: &mut |s| Some(plant(s)) }.run(settings, trial)
}

const START: Setting = Setting { dt_s: 1e-3, pieces: 256, method: 0 };

/// The least cost of one object within the tolerance, by looking everywhere.
fn least_cost_s(methods: &[usize], tolerance_m: f64) -> f64 {
    let mut least = f64::INFINITY;
    for &method in methods {
        for pieces in 4..=256 {
            for k in 0..400 {
                let trial = plant(&[Setting { dt_s: 1e-3 * 1.0116_f64.powi(k), pieces, method }]);
                if trial.error_m <= tolerance_m {
                    least = least.min(trial.cost_s());
                }
            }
        }
    }
    least
}

#[test]
fn a_found_setting_meets_the_tolerance_within_a_factor_of_the_least_cost() {
    for tolerance_m in [1e-2, 5e-3, 2e-3] {
        let found = search(&[choice(&[0])], tolerance_m, START);
        let least = least_cost_s(&[0], tolerance_m);
        assert!(found.trial.error_m <= tolerance_m && !found.cut_short);
        // steps of √2 in both miss the best by no more than 2, and twice that near the corner
        assert!(found.trial.cost_s() < 2.5 * least, "{tolerance_m}: {} and {least}", found.trial.cost_s());
        assert!(found.tried < 60, "{} trials", found.tried);
    }
}

#[test]
fn a_method_of_higher_order_is_taken_where_its_longer_steps_pay() {
    let found = search(&[choice(&[0, 1])], 2e-3, START);
    assert_eq!(found.settings[0].method, 1, "{found:?}");
    assert!(found.trial.cost_s() < search(&[choice(&[0])], 2e-3, START).trial.cost_s());
}

#[test]
fn every_object_is_fitted_and_fixed_settings_are_kept() {
    let fixed = Choice { dt_max_s: START.dt_s, pieces_min: START.pieces, methods: vec![] };
    let found = search(&[choice(&[0]), fixed, choice(&[0])], 5e-3, START);
    assert_eq!(found.settings[1], START);
    assert!(found.settings[0] != START && found.settings[2] != START);
}

#[test]
fn a_search_that_is_stopped_keeps_the_best_so_far() {
    let choices = [choice(&[0])];
    let mut left = 5;
    let mut attempt = |s: &[Setting]| {
        left -= 1;
        (left > 0).then(|| plant(s))
    };
    let settings = vec![START];
    let trial = plant(&settings);
    let before = trial.cost_s();
    let found =
        Search { choices: &choices, tolerance_m: 5e-3, trials_max: 500, attempt: &mut attempt }.run(settings, trial);
    assert!(found.cut_short && found.trial.cost_s() < before && found.trial.error_m <= 5e-3);
}

/// A point that errs by a 2⁻ᵖᵏ at level k.
fn level(k: u32, order: i32) -> Vec<Path> {
    let error = 1e-2 * 0.5_f64.powi(order * k as i32);
    vec![Path { samples: (0..10).map(|i| (f64::from(i), DVec3::X * (f64::from(i) + error))).collect() }]
}

#[test]
fn the_error_of_a_converged_answer_is_estimated_from_the_last_refinement() {
    for order in [1, 2] {
        let found = converge(8, 1e-4, &mut |k| Some(level(k, order))).unwrap();
        let truth = 1e-2 * 0.5_f64.powi(order * found.level as i32);
        assert!(found.error_m <= 1e-4 && found.level < 8);
        assert!((found.error_m / truth - 1.0).abs() < 0.01, "order {order}: {} for {truth}", found.error_m);
    }
}

#[test]
fn an_answer_that_does_not_converge_reports_its_error() {
    let wild = |k: u32| vec![Path { samples: vec![(0.0, DVec3::X * if k.is_multiple_of(2) { 0.1 } else { -0.1 })] }];
    let found = converge(4, 1e-4, &mut |k| Some(wild(k))).unwrap();
    assert!(found.level == 4 && found.error_m > 0.2, "{}", found.error_m);
}

#[test]
fn paths_are_compared_at_the_same_times() {
    let line = |step: f64, n: u32| {
        let samples = (0..n).map(|i| (f64::from(i) * step, DVec3::X * (f64::from(i) * step))).collect();
        Path { samples }
    };
    assert!(line(0.3, 10).farthest_m(&line(0.07, 100)) < 1e-15);
    assert_eq!(Path::default().farthest_m(&line(0.1, 5)), f64::INFINITY);
    let g = DVec3::Z * -9.81;
    let fall =
        Path { samples: (0..20).map(|i| (f64::from(i) * 0.1, g * (0.005 * f64::from(i * i)) + DVec3::X)).collect() };
    assert!(fall.from_flight_m(g) < 1e-12 && fall.from_flight_m(DVec3::ZERO) > 1.0);
    assert!((fall.extent_m() - 9.81 * 0.5 * 1.9 * 1.9).abs() < 1e-9);
}
