//! Fixed points of a loop: every state at which the time is on target and a small error decays.
//!
//! In: a plant, a candidate, a target. Out: its fixed points. For feedback the open loop is swept through its whole range; n = ⌊ρ⌋ makes
//! frames slower where ε̂ grows, so there can be two. Never here: the way to a fixed point.
//! Theory: `docs/theory/control.md`, eq. 2, 4 and 6.

use super::candidate::Candidate;
use super::plant::Plant;
use super::play::{Start, Trial, play};
use crate::control::{FrameWork, Law, PictureControl};
use std::time::Duration;

/// A state in which a loop rests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPoint {
    /// The loop variable ε̂ there.
    pub eps_hat: f64,
    /// t/T_set there.
    pub ratio: f64,
    /// Whether the loop rests at an end of the range of the objects in view.
    pub clamped: bool,
}

/// Steps of the corrected law's range, and the factor from one ε̂ of the printed law to the next.
const STEPS: usize = 2000;
const FACTOR: f64 = 1.002;
/// Steps of the printed law at most: from 1e-9 to 1e9.
const STEPS_MAX: usize = 20_000;
/// α used to sweep the printed law: the frame rate is then far from 0 whatever the step.
const SWEEP_ALPHA: f64 = 1e-2;
/// Time after which a predicting policy counts as settled, seconds.
const REST_S: f64 = 5.0;

/// The fixed points of `candidate` on `plant` at `target_hz`, by rising ε̂.
#[must_use]
pub fn fixed_points(plant: &Plant, candidate: Candidate, target_hz: f64) -> Vec<FixedPoint> {
    let set_s = candidate.set_share() / target_hz;
    match candidate {
        Candidate::Feedback(Law::Corrected { .. }) => crossings(&along_the_range(plant, candidate, target_hz), set_s),
        Candidate::Feedback(Law::Printed { beta, .. }) => {
            crossings(&along_the_line(plant, candidate, target_hz, beta), set_s)
        }
        Candidate::Adaptive { .. } => end_of_undisturbed_trial(plant, candidate, target_hz),
    }
}

/// (ε̂, seconds) over the range of the corrected law, finest first.
fn along_the_range(plant: &Plant, candidate: Candidate, target_hz: f64) -> Vec<(f64, f64)> {
    let mut control = candidate.control(plant, target_hz);
    control.plan(plant.views(0));
    let place = |step: usize| {
        control.seek(step as f64 / STEPS as f64);
        let seconds = plant.seconds(control.plan(plant.views(0)).polygons, 1.0);
        (control.eps_hat(), seconds)
    };
    (0..=STEPS).map(place).collect()
}

/// (ε̂, seconds) along the line ρ − β ε̂ = constant on which the printed law moves from its start, finest first.
fn along_the_line(plant: &Plant, candidate: Candidate, target_hz: f64, beta: f64) -> Vec<(f64, f64)> {
    let mut control = candidate.control(plant, target_hz);
    control.plan(plant.views(0));
    control.set_law(Law::Printed { alpha: SWEEP_ALPHA, beta });
    step_printed_law(&mut control, target_hz, -1e6);
    let mut places: Vec<(f64, f64)> = Vec::new();
    for _ in 0..STEPS_MAX {
        let seconds = plant.seconds(control.plan(plant.views(0)).polygons, 1.0);
        let eps_hat = control.eps_hat();
        if places.last().is_some_and(|&(before, _)| eps_hat <= before) {
            break;
        }
        places.push((eps_hat, seconds));
        step_printed_law(&mut control, target_hz, (FACTOR - 1.0) * eps_hat);
    }
    places
}

/// Moves the printed law by `by` in ε̂, and n with it: f₀ − f = by/α.
fn step_printed_law(control: &mut PictureControl, target_hz: f64, by: f64) {
    let rate_hz = (target_hz - by / SWEEP_ALPHA).clamp(1e-3 * target_hz, 1e8);
    let work = Duration::from_secs_f64(1.0 / rate_hz);
    control.observe(FrameWork { work, draw: work, ..FrameWork::default() });
}

/// The points at which the time falls through `set_s` as ε̂ rises, and ends of the range that a law would pass.
fn crossings(places: &[(f64, f64)], set_s: f64) -> Vec<FixedPoint> {
    let (Some(&finest), Some(&coarsest)) = (places.first(), places.last()) else { return Vec::new() };
    let end = |(eps_hat, seconds): (f64, f64)| FixedPoint { eps_hat, ratio: seconds / set_s, clamped: true };
    let falls = places.windows(2).filter(|w| w[0].1 > set_s && w[1].1 <= set_s);
    let within = falls.map(|w| {
        let passed = (w[0].1 - set_s) / (w[0].1 - w[1].1);
        let eps_hat = w[0].0 + passed * (w[1].0 - w[0].0);
        let nearest = if (w[0].1 / set_s - 1.0).abs() < (w[1].1 / set_s - 1.0).abs() { w[0].1 } else { w[1].1 };
        FixedPoint { eps_hat, ratio: nearest / set_s, clamped: false }
    });
    let first = (finest.1 <= set_s).then(|| end(finest));
    let last = (coarsest.1 > set_s).then(|| end(coarsest));
    first.into_iter().chain(within).chain(last).collect()
}

/// The single fixed point of a predicting policy, which budgets by its prediction: the end of a trial without a disturbance.
fn end_of_undisturbed_trial(plant: &Plant, candidate: Candidate, target_hz: f64) -> Vec<FixedPoint> {
    let trial = Trial { start: Start::Target, seconds: REST_S, ..Trial::undisturbed(candidate, target_hz) };
    let last = play(plant, &trial).last().map(|frame| FixedPoint {
        eps_hat: frame.eps_hat,
        ratio: frame.ratio,
        clamped: frame.status.clamped().is_some(),
    });
    last.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::super::plant::tests::tube_alone;
    use super::*;
    use crate::control::ObjectView;

    const FIXED_S: f64 = 5e-3;
    const POLYGON_S: f64 = 1e-6;

    /// t = fixed + c · 480 · 2ⁿ/ε̂ on a tube with this range of n (control.md, eq. 6).
    fn plant(n: (u8, u8)) -> Plant {
        let mut view: ObjectView = tube_alone();
        view.range.n = n;
        super::super::plant::tests::plant_of(vec![view], FIXED_S, POLYGON_S)
    }

    #[test]
    fn the_corrected_law_has_one_fixed_point_on_the_fitted_line() {
        let points = fixed_points(&plant((0, 5)), Law::CORRECTED.into(), 30.0);
        let expected = 480.0 * POLYGON_S / (0.9 / 30.0 - FIXED_S);
        assert_eq!(points.len(), 1, "{points:?}");
        assert!((points[0].eps_hat / expected - 1.0).abs() < 0.04, "{points:?} and {expected}"); // recut every 3 %
        assert!(!points[0].clamped);
    }

    #[test]
    fn the_floor_of_rho_makes_two_fixed_points_each_on_its_own_level() {
        // from the middle of the range: ε̂ₙ = 480 · 2ⁿ c/(T − a) wherever ⌊ρ₀ + β (ε̂ₙ − ε̂₀)⌋ is n
        let plant = plant((0, 5));
        let view = plant.views(0)[0];
        let crate::control::Kind::Tube { length_m, .. } = view.kind else { panic!("a tube") };
        let ends = (40.0 * view.range.eps_m.0 / length_m, 40.0 * view.range.eps_m.1 / length_m);
        let (start, rho) = ((ends.0 * ends.1).sqrt(), 2.5);
        for (target_hz, beta) in [(30.0, 5.0), (30.0, 9.0), (60.0, 5.0), (60.0, 20.0), (100.0, 9.0)] {
            let on_flat = |n: i32| {
                let eps_hat = 480.0 * 2.0_f64.powi(n) * POLYGON_S / (1.0 / target_hz - FIXED_S);
                let there = (rho + beta * (eps_hat - start)).floor().clamp(0.0, 5.0);
                ((ends.0..=ends.1).contains(&eps_hat) && there == f64::from(n)).then_some(eps_hat)
            };
            let expected: Vec<f64> = (0..=5).filter_map(on_flat).collect();
            let found: Vec<f64> = fixed_points(&plant, Law::Printed { alpha: 1e-4, beta }.into(), target_hz)
                .iter()
                .filter(|p| !p.clamped)
                .map(|p| p.eps_hat)
                .collect();
            assert_eq!(found.len(), expected.len(), "{target_hz} Hz, β {beta}: {found:?} and {expected:?}");
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found / expected - 1.0).abs() < 0.02, "{target_hz} Hz, β {beta}: {found} and {expected}");
            }
        }
    }

    #[test]
    fn a_target_beyond_the_range_has_its_fixed_point_at_the_end() {
        let points = fixed_points(&plant((0, 5)), Law::CORRECTED.into(), 190.0);
        assert!(matches!(points[..], [FixedPoint { clamped: true, .. }]) && points[0].ratio > 1.0, "{points:?}");
    }
}
