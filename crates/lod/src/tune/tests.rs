//! Every law on a plant of one tube, against the same law worked out by hand: a few lines of arithmetic instead of the controller.

use super::loops::measures::Measures;
use super::loops::plant::Plant;
use super::loops::plant::tests::{plant_of, tube_alone};
use super::loops::play::{Start, Trial, TrialFrame, play};
use super::{Candidate, Disturbance, Loop};
use crate::control::Law;

const FIXED_S: f64 = 5e-3;
const POLYGON_S: f64 = 1e-6;
const TARGET_HZ: f64 = 30.0;
/// A picture is cut anew where its wish has moved by 3 %.
const CUT: f64 = 0.03;

/// A tube alone whose change shows so many frames late; its n is fixed where a law says so.
fn plant(dead_time: usize, n: (u8, u8)) -> Plant {
    let mut view = tube_alone();
    view.range.n = n;
    Plant { dead_time, ..plant_of(vec![view], FIXED_S, POLYGON_S) }
}

fn played(plant: &Plant, candidate: impl Into<Candidate>, rate: f64, seconds: f64) -> Vec<TrialFrame> {
    play(plant, &Trial { start: Start::Rate(rate), seconds, ..Trial::undisturbed(candidate, TARGET_HZ) })
}

/// t/T_set of (7), (9) and (10) on x = ln polygons, with λ, worked out on exact polygons.
fn by_hand(kappa: f64, lead: f64, set_s: f64, (rate, dead_time, frames): (f64, usize, usize)) -> Vec<f64> {
    let mut x = vec![((set_s / rate - FIXED_S) / POLYGON_S).ln()];
    // it comes from rest
    let (mut before, mut believed, mut ratios) = (0.0_f64, 0.0_f64, Vec::new());
    for k in 0..frames {
        let ratio = (FIXED_S + POLYGON_S * x[k.saturating_sub(dead_time)].exp()) / set_s;
        ratios.push(ratio);
        let error = ratio.ln();
        let again = before * error > 0.0 && before.abs() > 1.5_f64.ln();
        before = error;
        let most = if again { 4.0_f64.ln() } else { 1.5_f64.ln() };
        let error = error.clamp(-most, most);
        let change = lead * (error - believed);
        believed = error;
        let step = if error.abs() <= 0.02 { 0.0 } else { kappa * (error - 0.02 * error.signum()) + change };
        x.push(x[k] - step);
    }
    ratios
}

#[test]
fn the_logarithmic_and_the_pi_law_follow_the_recursion_worked_out_by_hand() {
    for (kappa, lead, rate, dead_time) in
        [(0.5, 0.0, 0.4, 0), (0.5, 0.0, 2.5, 0), (0.3, 0.2, 0.4, 0), (0.3, 0.2, 2.5, 0), (0.3, 0.0, 0.4, 1)]
    {
        let law = Law::Corrected { kappa, lead, margin: 0.1 };
        let frames = played(&plant(dead_time, (0, 5)), law, rate, 2.0);
        let hand = by_hand(kappa, lead, 0.9 / TARGET_HZ, (rate, dead_time, frames.len()));
        for (k, (frame, expected)) in frames.iter().zip(&hand).enumerate() {
            // levels are 3 % apart, and the rounding of one frame is in the error of the next
            let off = (frame.ratio / expected - 1.0).abs();
            assert!(off < 2.0 * CUT, "{law:?} from {rate}, frame {k}: {} and {expected}", frame.ratio);
        }
    }
}

#[test]
fn the_printed_and_the_normalised_law_follow_the_recursion_worked_out_by_hand() {
    for alpha in [1e-4, 4e-4, 0.046 / TARGET_HZ] {
        let frames = played(&plant(0, (2, 2)), Law::Printed { alpha, beta: 5.0 }, 0.4, 4.0);
        let mut eps_hat = 480.0 * 4.0 / frames[0].polygons;
        for (k, frame) in frames.iter().enumerate() {
            let seconds = FIXED_S + POLYGON_S * 480.0 * 4.0 / eps_hat;
            let off = (frame.ratio * (1.0 / TARGET_HZ) / seconds - 1.0).abs();
            assert!(off < CUT, "α = {alpha}, frame {k}: {} and {seconds} s", frame.ratio);
            eps_hat = (eps_hat + alpha * (TARGET_HZ - 1.0 / seconds)).clamp(0.01, 1.0);
        }
    }
}

#[test]
fn the_printed_law_oscillates_beyond_the_boundary_of_its_slope() {
    // near the target α df/dε̂ = 2 is α = 2 ε̂/(s f₀), eq. 4; with n fixed there is nothing else
    let set_s = 1.0 / TARGET_HZ;
    let eps_hat = 480.0 * 4.0 * POLYGON_S / (set_s - FIXED_S);
    let boundary = 2.0 * eps_hat / ((1.0 - FIXED_S / set_s) * TARGET_HZ);
    let swings = |alpha: f64| {
        let frames = played(&plant(0, (2, 2)), Law::Printed { alpha, beta: 5.0 }, 0.8, 12.0);
        Measures::of(&frames).cycle.is_some()
    };
    assert!(!swings(0.9 * boundary), "below {boundary}");
    assert!(swings(1.15 * boundary), "above {boundary}");
    let law = Law::Printed { alpha: 0.5 * boundary, beta: 5.0 };
    let near = Candidate::from(law).local_loop(&plant(0, (2, 2)), TARGET_HZ, 1.0).unwrap();
    assert!((near.gain_margin() - 2.0).abs() < 0.1, "{} and 2", near.gain_margin());
}

#[test]
fn a_limit_cycle_has_the_amplitude_and_the_period_worked_out_by_hand() {
    // three frames late, κ s past 0.445: the swing grows until its lessons are bounded
    let (kappa, dead_time) = (0.9, 3);
    let frames = played(&plant(dead_time, (0, 5)), Law::Corrected { kappa, lead: 0.0, margin: 0.1 }, 0.8, 12.0);
    let found = Measures::of(&frames).cycle.expect("it swings");
    let hand = by_hand(kappa, 0.0, 0.9 / TARGET_HZ, (0.8, dead_time, 400));
    let tail = &hand[200..];
    let (low, high) = tail.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), r| (l.min(*r), h.max(*r)));
    let middle = 0.5 * (low + high);
    let rises: Vec<usize> = (1..tail.len()).filter(|&k| tail[k - 1] < middle && tail[k] >= middle).collect();
    // a frame takes its work, or the wanted time where it is early
    let seconds: f64 = tail[rises[0]..rises[rises.len() - 1]].iter().map(|r| (0.9 * r).max(1.0) / TARGET_HZ).sum();
    let period_s = seconds / (rises.len() - 1) as f64;
    assert!((found.amplitude / (0.5 * (high - low)) - 1.0).abs() < 0.2, "{found:?} and {}", 0.5 * (high - low));
    assert!((found.period_s / period_s - 1.0).abs() < 0.1, "{found:?} and {period_s} s");
}

#[test]
fn a_clamped_loop_leaves_its_clamp_without_windup() {
    // the coarsest takes too long for a third of the trial; then the machine is twice as fast
    let plant = plant(0, (0, 5));
    let target_hz = 0.9 / (0.7 * plant.time_range(1.0).least_s);
    let settled = |frames: &[TrialFrame]| frames.iter().position(|b| (b.ratio - 1.0).abs() < 0.05).expect("it settles");
    for law in [Law::CORRECTED, Law::Corrected { kappa: 0.3, lead: 0.3, margin: 0.1 }] {
        let undisturbed = Trial { seconds: 3.0, ..Trial::undisturbed(law, target_hz) };
        let frames = play(&plant, &Trial { disturbance: Disturbance::Speed(2.0), ..undisturbed });
        assert!(frames[5].status.clamped().is_some(), "{law:?}: {:?}", frames[5].status);
        let fast = frames.iter().position(|b| b.ratio < 1.0).expect("the machine becomes faster");
        let fresh = settled(&play(&plant, &Trial { speed: 2.0, start: Start::Rate(1e3), ..undisturbed }));
        let after = settled(&frames[fast..]);
        assert!(after.abs_diff(fresh) <= 2, "{law:?}: {after} frames after the clamp, {fresh} without one");
    }
}

#[test]
fn the_adaptive_policy_corrects_the_share_given_by_its_filter() {
    // steady state of the filter: p⁻ g = Q and g = p⁻/(p⁻ + R), iterated instead of solved
    let plant = plant(0, (0, 5));
    let near = Candidate::ADAPTIVE.local_loop(&plant, TARGET_HZ, 1.0).unwrap();
    let table = (0.98 / TARGET_HZ - FIXED_S) * TARGET_HZ;
    let noise = (0.01 / table) * (0.01 / table);
    let (mut variance, mut gain) = (0.02, 0.0);
    for _ in 0..200 {
        variance += 2e-4;
        gain = variance / (variance + noise);
        variance *= 1.0 - gain;
    }
    assert!((near.gain - gain).abs() < 1e-6, "{} and {gain}", near.gain);
}

#[test]
fn the_adaptive_policy_settles_at_its_predicted_time_on_machines_of_other_speeds() {
    for (speed, rate) in [(1.0, 0.4), (1.0, 2.5), (2.0, 0.4), (0.5, 2.5)] {
        let trial = Trial {
            speed,
            start: Start::Rate(rate),
            seconds: 3.0,
            ..Trial::undisturbed(Candidate::ADAPTIVE, TARGET_HZ)
        };
        let measured = Measures::of(&play(&plant(0, (0, 5)), &trial));
        assert!(
            measured.settle_s.is_some_and(|s| s <= 1.0) && measured.cycle.is_none(),
            "{speed} {rate}: {measured:?}"
        );
    }
}

#[test]
fn both_parts_of_a_pi_law_count_in_its_margins() {
    let near = Candidate::from(Law::Corrected { kappa: 0.2, lead: 0.3, margin: 0.1 });
    let near = near.local_loop(&plant(0, (0, 5)), TARGET_HZ, 1.0).unwrap();
    let share = 1.0 - FIXED_S / (0.9 / TARGET_HZ);
    assert_eq!(near.dead_time, 0);
    let Loop { gain, lead, .. } = near;
    assert!((gain - 0.2 * share).abs() < 1e-9 && (lead - 0.3 * share).abs() < 1e-9, "{near:?}");
}
