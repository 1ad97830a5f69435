//! Choices among real numbers: resolutions, rates and shares of time, against the conditions that only an optimum meets.

use metachron_lod::select::barrier;
use metachron_lod::select::barrier::interior_point;
use metachron_lod::select::gobbetti::{Mesh, closed_form};
use metachron_lod::select::rates::{Agent, rates};
use metachron_lod::select::robin_hood::{Instance, TooLittle, distribute};
use proptest::prelude::*;

fn any_meshes() -> impl Strategy<Value = Vec<Mesh>> {
    let mesh =
        (prop_oneof![0.01..100.0_f64, Just(0.0)], prop_oneof![0.01..10.0_f64, Just(0.0)], 0.0..0.3_f64, 0.0..0.7_f64)
            .prop_map(|(weight, time, least, more)| Mesh { weight, time, least, most: least + more });
    prop::collection::vec(mesh, 0..40)
}

/// The time at `part` of the way from every least to every most.
fn time_at(meshes: &[Mesh], part: f64) -> f64 {
    let (least, most) = meshes.iter().fold((0.0, 0.0), |(l, m), x| (l + x.time * x.least, m + x.time * x.most));
    least + part * (most - least)
}

fn spent(meshes: &[Mesh], r: &[f64]) -> f64 {
    meshes.iter().zip(r).map(|(m, r)| m.time * r).sum()
}

proptest! {
    #[test]
    fn closed_form_meets_the_conditions_of_an_optimum(meshes in any_meshes(), part in 0.001..1.2_f64) {
        let time = time_at(&meshes, part);
        let best = closed_form(time + 2.0, 2.0, &meshes);
        prop_assert!(best.feasible);
        // sums of forty doubles in two orders
        prop_assert!(spent(&meshes, &best.r) <= time * (1.0 + 1e-12) + 1e-12);
        for (m, &r) in meshes.iter().zip(&best.r) {
            prop_assert!(m.least <= r && r <= m.most);
            // gain of a little more r, against the price of its time: w/(2 √r) and λ a
            let (gain, price) = (m.weight / (2.0 * r.sqrt()), best.lambda * m.time);
            prop_assert!(r >= m.most || gain <= price * (1.0 + 1e-9), "{} could be finer", r);
            prop_assert!(r <= m.least || gain >= price * (1.0 - 1e-9), "{} could be coarser", r);
        }
        let all_at_most = meshes.iter().zip(&best.r).all(|(m, &r)| m.weight == 0.0 || r == m.most);
        let full = (spent(&meshes, &best.r) - time).abs() <= 1e-9 * time.max(1e-9);
        prop_assert!(full || all_at_most, "time is left over");
    }

    #[test]
    fn interior_point_is_within_the_time_and_its_bound_holds_however_few_the_steps(
        meshes in any_meshes(), part in 0.001..1.2_f64, steps in 0..60_u32,
    ) {
        let time = time_at(&meshes, part);
        let (best, got) = (closed_form(time, 0.0, &meshes), interior_point(time, 0.0, &meshes, &[], barrier::Limits { steps, tolerance: 0.01 }));
        prop_assert!(got.feasible && got.steps <= steps);
        prop_assert!(spent(&meshes, &got.r) <= time * (1.0 + 1e-12) + 1e-12);
        prop_assert!(got.value <= best.value * (1.0 + 1e-9) + 1e-12);
        prop_assert!(got.upper >= best.value * (1.0 - 1e-9), "{} below {}", got.upper, best.value);
    }

    #[test]
    fn too_little_time_is_infeasible_and_everything_is_at_its_least(meshes in any_meshes(), missing in 0.01..9.0_f64) {
        let time = time_at(&meshes, 0.0) - missing;
        let limits = barrier::Limits { steps: 50, tolerance: 0.01 };
        for got in [closed_form(time, 0.0, &meshes), interior_point(time, 0.0, &meshes, &[], limits)] {
            prop_assert!(!got.feasible && got.upper == 0.0);
            prop_assert!(meshes.iter().zip(&got.r).all(|(m, &r)| r == m.least));
        }
    }

    #[test]
    fn rates_meet_the_conditions_of_an_optimum(
        agents in prop::collection::vec((0.01..50.0_f64, 1e-5..1e-2_f64, 1.0..10.0_f64, 0.0..240.0_f64), 1..30), part in 0.001..1.2_f64,
    ) {
        let agents: Vec<_> = agents
            .into_iter()
            .map(|(weight, step_s, least_hz, more)| Agent { weight, step_s, least_hz, most_hz: least_hz + more })
            .collect();
        let sum = |f: fn(&Agent) -> f64| agents.iter().map(|a| a.step_s * f(a)).sum::<f64>();
        let load = sum(|a| a.least_hz) + part * (sum(|a| a.most_hz) - sum(|a| a.least_hz));
        let best = rates(load, &agents);
        prop_assert!(best.feasible);
        let used: f64 = agents.iter().zip(&best.f_hz).map(|(a, f)| a.step_s * f).sum();
        prop_assert!(used <= load * (1.0 + 1e-9));
        for (a, &f) in agents.iter().zip(&best.f_hz) {
            let (gain, price) = (a.weight / (f * f), best.lambda * a.step_s);
            prop_assert!(f >= a.most_hz || gain <= price * (1.0 + 1e-9));
            prop_assert!(f <= a.least_hz || gain >= price * (1.0 - 1e-9));
        }
    }

    #[test]
    fn robin_hood_distributes_no_more_than_the_budget(
        instances in prop::collection::vec((0.1..5.0_f64, any_number(), prop::collection::vec(any_number(), 0..5)), 0..20),
        time in any_number(), rule in prop_oneof![Just(TooLittle::Nothing), Just(TooLittle::Part)],
    ) {
        let instances: Vec<_> = (0..).zip(instances).map(|(id, (complexity, value, forms))| Instance { id, complexity, value, forms, too_little: rule }).collect();
        let d = distribute(time, &instances);
        let mut taken = 0.0;
        for (i, instance) in instances.iter().enumerate() {
            let Some(form) = d.form[i] else { continue };
            let cost = instance.forms[form as usize] * d.part[i];
            prop_assert!(cost <= d.offered[i] * (1.0 + 1e-12) && (0.0..=1.0).contains(&d.part[i]));
            prop_assert!(rule == TooLittle::Part || d.part[i] == 1.0);
            taken += cost;
        }
        let all = if time > 0.0 { time } else { 0.0 };
        prop_assert!(taken + d.leftover <= all * (1.0 + 1e-9), "{} and {} of {}", taken, d.leftover, all);
        prop_assert!(taken + d.leftover >= all * (1.0 - 1e-9));
    }
}

/// A likely number, or one that is none.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![8 => 0.01..10.0_f64, 1 => Just(0.0), 1 => Just(-1.0), 1 => Just(f64::NAN)]
}

#[test]
fn interior_point_comes_within_a_hundredth_in_some_thirty_steps() {
    // the spread of the stand-in: log-normal sizes and weights, half of the time of full resolution
    for n in [50_u32, 500, 5000] {
        let spread = |i: u32, k: f64| (2.0 * (f64::from(i) * k).sin()).exp();
        let meshes: Vec<_> =
            (0..n).map(|i| Mesh { weight: spread(i, 1.7), time: spread(i, 2.9), least: 0.02, most: 1.0 }).collect();
        let time = time_at(&meshes, 0.5);
        let limits = barrier::Limits { steps: 100, tolerance: 0.01 };
        let (best, cold) = (closed_form(time, 0.0, &meshes), interior_point(time, 0.0, &meshes, &[], limits));
        assert!(
            cold.value >= 0.99 * best.value && cold.upper <= 1.011 * cold.value,
            "{n}: {}",
            cold.value / best.value
        );
        assert!(cold.steps <= 33, "{n} meshes: {} steps", cold.steps); // the known count of a solver in √r at 5000
        let warm = interior_point(0.95 * time, 0.0, &meshes, &cold.r, limits);
        assert!(warm.value >= 0.99 * closed_form(0.95 * time, 0.0, &meshes).value && warm.feasible);
    }
}

#[test]
fn invalid_numbers_become_meshes_that_can_be_solved() {
    let bad = Mesh { weight: f64::NAN, time: f64::INFINITY, least: f64::NAN, most: 9.0 }.sound(0.5);
    assert_eq!(bad, Mesh { weight: 0.0, time: 1.0, least: 0.0, most: 1.0 });
    let crossed = Mesh { weight: 1.0, time: -1.0, least: 0.8, most: 0.2 }.sound(0.5);
    assert_eq!(crossed, Mesh { weight: 1.0, time: 1.0, least: 0.2, most: 0.2 });
}

#[test]
fn partial_form_spends_what_was_offered() {
    let instance = |id, value, too_little| Instance { id, complexity: 1.0, value, forms: vec![8.0, 4.0], too_little };
    let both = |rule| [instance(0, 1.0, rule), instance(1, 3.0, rule)];
    let nothing = distribute(8.0, &both(TooLittle::Nothing));
    assert_eq!((nothing.form, nothing.leftover), (vec![None, Some(0)], 0.0)); // the second is offered all 8
    let part = distribute(8.0, &both(TooLittle::Part));
    assert_eq!((part.form, part.part, part.leftover), (vec![Some(1), Some(1)], vec![0.5, 1.0], 2.0));
}
