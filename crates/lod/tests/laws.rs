//! Promises of the laws, over declared plants: the printed one against its worked cases, the corrected one against its
//! claims.

use metachron_lod::Bound;
use metachron_lod::grisoni;
use metachron_lod::grisoni::{GrisoniLaw, Limits};
use metachron_lod::log_law::{Gains, LogLaw, Rest, UNCONFIRMED_ERROR_MAX};
use metachron_lod::share::{Share, water_level};
use proptest::prelude::*;
use serde_json::Value;

const CASES: &str = include_str!("../../../tests/reference/grisoni.json");

fn number(of: &Value, key: &str) -> f64 {
    of[key].as_f64().unwrap_or_else(|| panic!("{key} in {of}"))
}

/// The plant of the worked cases: f = 1 / (c0 + c1 (length/ε) (k0 + k1 2ⁿ)).
fn rate_hz(plant: &Value, law: &GrisoniLaw) -> f64 {
    let polygons = number(plant, "k0") + number(plant, "k1") * f64::from(1_u32 << law.n());
    1.0 / (number(plant, "c0") + number(plant, "c1") * number(plant, "length") / law.eps() * polygons)
}

fn law_of(case: &Value) -> GrisoniLaw {
    let gains = grisoni::Gains { alpha: number(case, "alpha"), beta: number(case, "beta") };
    let n = |key| case[key].as_u64().unwrap() as u8;
    let limits = Limits { eps: (number(case, "eps_lo"), number(case, "eps_hi")), n: (n("n_lo"), n("n_hi")) };
    GrisoniLaw::new(gains, limits, number(case, "eps0"), number(case, "rho0"))
}

#[test]
fn printed_law_gives_the_traces_of_the_worked_cases() {
    let cases: Value = serde_json::from_str(CASES).unwrap();
    for case in cases["cases"].as_array().unwrap() {
        let (mut law, every) = (law_of(case), case["expect"]["every"].as_u64().unwrap());
        let mut rows = case["expect"]["trace"].as_array().unwrap().iter();
        for step in 0..case["steps"].as_u64().unwrap() {
            let f = rate_hz(&case["plant"], &law);
            if step % every == 0 {
                let row = rows.next().unwrap();
                for (got, at) in [(law.eps(), 0), (law.rho(), 1), (f64::from(law.n()), 2), (f, 3)] {
                    let want = row[at].as_f64().unwrap();
                    // the tolerance that the cases ask for
                    assert!(
                        (got - want).abs() <= 1e-9 * want.abs().max(1.0),
                        "{}, step {step}: {got}, {want}",
                        case["id"]
                    );
                }
            }
            assert!(law.observe(number(case, "f0"), f));
        }
        assert!(rows.next().is_none());
    }
}

/// ε̂ at which the plant f = f0 ε/ε₀ runs at its target: the loop gain is α f0/ε₀.
const EPS_AT_TARGET: f64 = 0.13;

/// Seconds until the frame rate is within 5 % of `f0` for good, from 0.4 `f0`; `None` if never.
fn settling_s(alpha: f64, f0: f64) -> Option<f64> {
    let limits = Limits { eps: (0.005, 1.0), n: (2, 2) };
    let mut law = GrisoniLaw::new(grisoni::Gains { alpha, beta: 5.0 }, limits, 0.4 * EPS_AT_TARGET, 2.0);
    let (mut time, mut settled) = (0.0, None);
    for _ in 0..4000 {
        let f = f0 * law.eps() / EPS_AT_TARGET;
        settled = ((f / f0 - 1.0).abs() <= 0.05).then(|| settled.unwrap_or(time));
        time += 1.0 / f;
        law.observe(f0, f);
    }
    settled
}

#[test]
fn printed_law_settles_in_a_second_only_on_fast_machines() {
    // known values of the law at α = 1e-4, seconds, given to two digits: hence 5 %
    for (f0, known_s) in [(460.0, 0.02), (120.0, 0.31), (60.0, 1.21), (30.0, 4.82)] {
        let s = settling_s(1e-4, f0).unwrap();
        assert!((s / known_s - 1.0).abs() < 0.05, "{f0} Hz: {s} s, known {known_s} s");
    }
}

#[test]
fn printed_law_oscillates_without_end_where_its_gain_exceeds_two() {
    assert!(settling_s(0.9 * 2.0 * EPS_AT_TARGET / 460.0, 460.0).is_some());
    // α f0/ε₀ = 3.5
    assert_eq!(settling_s(1e-3, 460.0), None);
}

#[test]
fn printed_law_coarsens_into_slower_frames_past_its_turning_point() {
    // cost ∝ 2^(β ε)/ε has its least at ε = 1/(β ln 2) = 0.289 (control.md, eq. 6)
    let limits = Limits { eps: (0.005, 1.0), n: (0, 10) };
    let mut law = GrisoniLaw::new(grisoni::Gains::default(), limits, 0.3, 1.5);
    let seconds = |law: &GrisoniLaw| 2e-3 * f64::from(1_u32 << law.n()) / law.eps();
    let before = seconds(&law);
    for _ in 0..3000 {
        law.observe(110.0, 1.0 / seconds(&law));
    }
    assert_eq!(law.rest(), Some(Bound::Coarsest));
    assert!(seconds(&law) > 2.0 * before, "as coarse as it can be, and slower than before: {}", seconds(&law));
}

#[test]
fn printed_law_ignores_an_invalid_rate() {
    let cases: Value = serde_json::from_str(CASES).unwrap();
    let mut law = law_of(&cases["cases"][0]);
    let before = law;
    for f in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!law.observe(60.0, f) && !law.observe(f, 60.0));
    }
    assert_eq!(law, before);
}

/// Frames until t/T is within 5 % for good, of 200, on a plant of which the share `s` of T scales with 1/ε.
fn settling_frames(s: f64, start: f64, delay: usize) -> Option<usize> {
    let mut law = LogLaw::new(Gains::default(), (-8.0, 8.0), start);
    let mut pipe = vec![start; delay + 1];
    let mut settled = None;
    for frame in 0..200 {
        pipe.push(law.value());
        let ratio = 1.0 - s + s * (-pipe[frame + 1]).exp();
        settled = ((ratio - 1.0).abs() <= 0.05).then(|| settled.unwrap_or(frame));
        law.observe(ratio, None);
    }
    settled
}

#[test]
fn corrected_law_settles_within_twenty_frames_where_a_third_of_the_time_can_be_steered() {
    for s in [0.35, 0.5, 0.7, 1.0] {
        for start in [-4.0_f64.ln(), 4.0_f64.ln()] {
            let frames = settling_frames(s, start, 0).unwrap();
            assert!(frames <= 20, "share {s} from {start}: {frames} frames");
        }
    }
}

#[test]
fn corrected_law_settles_where_a_measurement_comes_a_frame_late() {
    for s in [0.35, 0.5, 1.0] {
        for start in [-4.0_f64.ln(), 4.0_f64.ln()] {
            assert!(settling_frames(s, start, 1).is_some_and(|frames| frames <= 20), "share {s} from {start}");
        }
    }
}

#[test]
fn corrected_law_rests_on_its_clamp_and_leaves_it_at_the_first_frame_of_the_other_sign() {
    for (ratio, bound, end) in [(3.0, Bound::Coarsest, 1.0), (0.3, Bound::Finest, -1.0)] {
        let mut law = LogLaw::new(Gains::default(), (-1.0, 1.0), 0.0);
        for _ in 0..500 {
            law.observe(ratio, None);
        }
        assert_eq!((law.value(), law.rest()), (end, Rest::Clamped(bound)));
        assert_eq!(law.observe(1.0 / ratio, None), Rest::Moving);
        assert!((law.value() - end).abs() > 0.1, "{}", law.value());
    }
}

#[test]
fn a_single_slow_frame_costs_a_fifth_and_a_lasting_load_counts_in_full() {
    let mut law = LogLaw::new(Gains::default(), (-8.0, 8.0), 0.0);
    law.observe(1.0, None);
    law.observe(5.0, None);
    let quality = (-law.value()).exp();
    assert!(quality > 0.8, "{quality}"); // e^(−κ (ln 1.5 − 0.02)) = 0.825
    law.observe(5.0, None);
    assert!(law.value() > 2.0 * 0.5 * UNCONFIRMED_ERROR_MAX, "{}", law.value());
}

#[test]
fn a_level_that_would_be_late_is_not_requested() {
    // a picture of whole octaves, all of its time in polygons: 0.8 T, and the next level would take 1.6 T
    let mut law = LogLaw::new(Gains::default(), (-8.0, 8.0), 0.0);
    for _ in 0..100 {
        let octave = (law.value() / core::f64::consts::LN_2).ceil() * core::f64::consts::LN_2;
        assert_eq!(octave, 0.0, "ln ε {}", law.value());
        law.observe(0.8, Some(octave));
    }
    assert_eq!(law.rest(), Rest::BetweenLevels);
}

#[test]
fn shares_add_up_to_the_budget_where_they_can() {
    let shares = [(1.0, 2.0, 10.0), (3.0, 0.5, 4.0), (0.1, 0.0, 1.0)];
    let shares = shares.map(|(weight, least, most)| Share { weight, least, most });
    for (budget, want) in [(0.0, 2.5), (2.5, 2.5), (7.0, 7.0), (14.9, 14.9), (15.0, 15.0), (99.0, 15.0)] {
        let mu = water_level(budget, shares.iter().copied(), 1.0);
        let sum: f64 = shares.iter().map(|s| s.at(mu)).sum();
        assert!((sum - want).abs() <= 1e-8 * want, "{budget}: {sum}"); // ten times the solver's own tolerance
    }
    assert_eq!(water_level(1.0, [].into_iter(), 1.0), 0.0);
}

/// Any double at all, and often a likely one.
fn any_ratio() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), 0.01..100.0_f64, Just(f64::NAN), Just(f64::INFINITY), Just(0.0), Just(-1.0)]
}

proptest! {
    #[test]
    fn no_sequence_of_times_moves_the_corrected_law_out_of_its_range(
        lessons in prop::collection::vec((any_ratio(), prop::option::of(any_ratio())), 1..200),
        kappa in any::<f64>(),
    ) {
        let mut law = LogLaw::new(Gains { kappa, ..Gains::default() }, (-2.0, 3.0), 0.0);
        for (ratio, granted) in lessons {
            law.observe(ratio, granted);
            prop_assert!((-2.0..=3.0).contains(&law.value()));
        }
    }

    #[test]
    fn no_sequence_of_rates_moves_the_printed_law_out_of_its_limits(
        lessons in prop::collection::vec((any_ratio(), any_ratio()), 1..200),
        alpha in any::<f64>(),
        beta in any::<f64>(),
    ) {
        let limits = Limits { eps: (0.01, 1.0), n: (1, 6) };
        let mut law = GrisoniLaw::new(grisoni::Gains { alpha, beta }, limits, 0.1, 2.0);
        for (f0, f) in lessons {
            law.observe(f0, f);
            prop_assert!((0.01..=1.0).contains(&law.eps()) && law.rho().is_finite() && (1..=6).contains(&law.n()));
        }
    }

    #[test]
    fn shares_meet_the_budget_for_any_weights(
        parties in prop::collection::vec((1e-6..1e6_f64, 0.0..1e4_f64, 0.0..1e6_f64), 1..50),
        part in 0.0..=1.0_f64,
        start in any_ratio(),
    ) {
        let shares: Vec<_> =
            parties.iter().map(|&(weight, least, more)| Share { weight, least, most: least + more }).collect();
        let (least, most) = shares.iter().fold((0.0, 0.0), |(l, m), s| (l + s.least, m + s.most));
        let budget = least + part * (most - least);
        let mu = water_level(budget, shares.iter().copied(), start);
        let sum: f64 = shares.iter().map(|s| s.at(mu)).sum();
        prop_assert!((sum - budget).abs() <= 1e-6 * budget.max(1e-6), "{sum} of {budget}");
    }
}
