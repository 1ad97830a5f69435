//! Judges a law: all disturbances, on machines of several speeds, with several seeds.
//!
//! In: a plant, a candidate, a target. Out: a [`Verdict`] with one number to minimise. Trials are distributed over all cores; the verdict
//! does not depend on the distribution. Never here: the choice of gains to try.

use crate::tune::loops::candidate::Candidate;
use crate::tune::loops::disturbance::Disturbance;
use crate::tune::loops::margins::Loop;
use crate::tune::loops::measures::Measures;
use crate::tune::loops::plant::Plant;
use crate::tune::loops::play::{Start, Trial, play};
use std::cmp::Ordering;
use std::num::NonZero;
use std::sync::atomic;
use std::sync::atomic::AtomicUsize;
use std::thread;

/// The extent of the trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Seeds per disturbance, ≥ 1.
    pub seeds: u64,
    /// Duration of a trial, thousandths of wall seconds.
    pub millis: u64,
    /// Number of threads, ≥ 1; `None`: as many as there are cores.
    pub threads: Option<NonZero<usize>>,
}

impl Extent {
    /// Ten seeds, four seconds each.
    pub const FULL: Self = Self { seeds: 10, millis: 4000, threads: None };
    /// Two seeds, a second and a half each: a law that settles within a second shows that it stays.
    pub const QUICK: Self = Self { seeds: 2, millis: 1500, threads: None };
}

/// The result of judging a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The candidate judged.
    pub candidate: Candidate,
    /// The worse of the settling times from 0.4 and from 2.5 times the target rate, wall seconds; `None` if one does not settle.
    pub settle_s: Option<f64>,
    /// The worse overshoot of the two.
    pub overshoot: f64,
    /// Fraction of frames that took 5 % too long, over all disturbances.
    pub miss_share: f64,
    /// Reversals within three frames, per frame, over all disturbances.
    pub reversals: f64,
    /// Mean fraction of the polygons that the whole time of a frame would have allowed.
    pub quality: f64,
    /// Stability margins at the worst of the speeds tested; `None` if the set point is out of reach at all of them.
    pub margins: Option<Margins>,
    /// Speeds of the machine, relative to the plant's own, at which the law settles within a second and does not oscillate.
    pub robust_to: Vec<f64>,
    /// Speeds tested: speeds at which the picture can be made to take the time of a frame.
    pub asked: Vec<f64>,
    /// The speed among them nearest to the machine's own, at which all else was measured; 1 if none was tested.
    pub at_speed: f64,
    /// How much the margins lack of a gain margin of 2 and a delay margin of 2 frames, as parts of these, 0 … 2; 0: the law keeps them.
    pub shortfall: f64,
    /// J, the number to minimise among laws that lack equally little (control.md, eq. 29).
    pub objective: f64,
}

/// Stability margins of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// The factor on the gains at which the loop becomes unstable.
    pub gain: f64,
    /// The number of additional frames of delay that the loop tolerates.
    pub delay: usize,
}

/// Speeds of the machine that a law must tolerate.
const SPEEDS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Starts from which a law must settle, as fractions of the target rate.
const STARTS: [f64; 2] = [0.4, 2.5];
/// If frame times scatter by less than this, a five-hundredth of the settling band, a trial is not repeated with other seeds.
const NOISE_LEAST: f64 = 1e-4;
/// A law must settle within this time, seconds.
pub(super) const SETTLE_MAX_S: f64 = 1.0;
/// Least margins: a factor on the gain, and frames of delay.
pub(super) const GAIN_MARGIN: f64 = 2.0;
const DELAY_MARGIN: usize = 2;

/// Weight of the objective between laws that lack margins: it decides where they lack equally much.
const TIE: f64 = 1e-3;

/// Weights of a late frame, a reversal, a lost part of quality, a second of settling and a missing margin relative to an error of one.
const WEIGHTS: [f64; 5] = [2.0, 0.1, 1.0, 0.1, 1.0];

/// Speeds of the machine, relative to the plant's own and ascending, at which the objects in view can be made to take the time of a frame.
#[must_use]
pub fn speeds_in_reach(plant: &Plant, target_hz: f64) -> Vec<f64> {
    // by T, not by a law's own set point: a law must not influence the speeds it is tested at
    SPEEDS.into_iter().filter(|&speed| plant.time_range(speed).contains(1.0 / target_hz)).collect()
}

/// Judges `candidate` on `plant` at `target_hz`.
#[must_use]
pub fn judge(plant: &Plant, candidate: impl Into<Candidate>, target_hz: f64, extent: Extent) -> Verdict {
    let candidate = candidate.into();
    let asked = speeds_in_reach(plant, target_hz);
    let far = |speed: f64| libm::fabs(libm::log(speed));
    let own = asked.iter().copied().min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(1.0);
    let seconds = 1e-3 * extent.millis as f64;
    let undisturbed = |speed: f64, rate: f64| Trial {
        speed,
        start: Start::Rate(rate),
        seconds,
        ..Trial::undisturbed(candidate, target_hz)
    };
    let starts: Vec<_> = asked.iter().flat_map(|&speed| STARTS.map(|rate| undisturbed(speed, rate))).collect();
    let upset = disturbed(&undisturbed(own, 1.0), plant.line.scatter, extent);
    let played = measure(plant, &[starts.clone(), upset.clone()].concat(), extent.threads);
    let (settling, upset_by) = played.split_at(starts.len());
    let mean = |value: fn(&Measures) -> f64| mean(&upset, upset_by, value);
    let at_speed = |speed: f64| starts.iter().zip(settling).filter(move |(t, _)| t.speed == speed).map(|(_, m)| *m);
    let good = |m: Measures| m.settle_s.is_some_and(|s| s <= SETTLE_MAX_S) && m.cycle.is_none();
    let near: Vec<Loop> = asked.iter().filter_map(|&speed| candidate.local_loop(plant, target_hz, speed)).collect();
    let mut verdict = Verdict {
        candidate,
        settle_s: at_speed(own).map(|m| m.settle_s).reduce(|a, b| Some(a?.max(b?))).flatten(),
        overshoot: at_speed(own).map(|m| m.overshoot).fold(0.0, f64::max),
        miss_share: mean(|m| m.miss_share),
        reversals: mean(|m| m.reversals),
        quality: mean(|m| m.quality),
        margins: near.iter().map(Margins::of).reduce(Margins::worse),
        robust_to: asked.iter().copied().filter(|&speed| at_speed(speed).all(good)).collect(),
        asked,
        at_speed: own,
        shortfall: 0.0,
        objective: 0.0,
    };
    verdict.shortfall = verdict.margins.map_or(2.0, Margins::shortfall);
    verdict.objective = verdict.weigh(mean(|m| m.error), mean(|m| m.overrun), seconds);
    verdict
}

impl Verdict {
    /// Mean error, late frames, reversals, lost quality, settling and missing margins in one number (control.md, eq. 29).
    fn weigh(&self, error: f64, overrun: f64, longest_s: f64) -> f64 {
        let [late, reversal, quality, settling, margin] = WEIGHTS;
        let missing = self.shortfall + (self.asked.len() - self.robust_to.len()) as f64 / SPEEDS.len() as f64;
        error
            + late * overrun
            + reversal * self.reversals
            + quality * (1.0 - self.quality)
            + settling * self.settle_s.unwrap_or(2.0 * longest_s)
            + margin * missing
    }

    /// Whether the law keeps the required margins: a factor of two, and two frames.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        self.shortfall == 0.0
    }

    /// The order of verdicts, best first: margins are constraints, so the law that lacks less of them comes first whatever its objective,
    /// and of two that lack equally little the one with the smaller objective (DEB00).
    #[must_use]
    pub fn compare(&self, other: &Self) -> Ordering {
        self.shortfall.total_cmp(&other.shortfall).then(self.objective.total_cmp(&other.objective))
    }

    /// The same order as one number for the simplex: J/(1 + J) of a law that keeps its margins, past 1 by the shortfall
    /// of another.
    pub(crate) fn rank(&self) -> f64 {
        let within = self.objective / (1.0 + self.objective);
        if self.is_safe() { within } else { 1.0 + self.shortfall + TIE * within }
    }
}

impl Margins {
    fn of(near: &Loop) -> Self {
        Self { gain: near.gain_margin(), delay: near.delay_margin() }
    }

    /// The shortfall of the required margins, each as a part of it.
    fn shortfall(self) -> f64 {
        (1.0 - self.gain / GAIN_MARGIN).max(0.0) + (1.0 - self.delay as f64 / DELAY_MARGIN as f64).max(0.0)
    }

    fn worse(self, other: Self) -> Self {
        Self { gain: self.gain.min(other.gain), delay: self.delay.min(other.delay) }
    }
}

/// Trials with every disturbance and every seed; one of each that the seed does not change.
fn disturbed(undisturbed: &Trial, noise: f64, extent: Extent) -> Vec<Trial> {
    let of = |disturbance: Disturbance| {
        let by_chance = disturbance.is_random() || noise > NOISE_LEAST;
        let seeds = if by_chance { extent.seeds.max(1) } else { 1 };
        (1..=seeds).map(move |seed| Trial { disturbance, seed, noise, start: Start::Target, ..*undisturbed })
    };
    Disturbance::ALL.into_iter().flat_map(of).collect()
}

/// The mean over disturbances of the mean over their trials.
fn mean(trials: &[Trial], measured: &[Measures], value: fn(&Measures) -> f64) -> f64 {
    let of = |disturbance: &Disturbance| {
        let its = trials.iter().zip(measured).filter(|(trial, _)| trial.disturbance == *disturbance);
        let (sum, count) = its.fold((0.0, 0.0), |(sum, count), (_, m)| (sum + value(m), count + 1.0));
        sum / count
    };
    Disturbance::ALL.iter().map(of).sum::<f64>() / Disturbance::ALL.len() as f64
}

/// Simulates every trial on `threads` threads; `None`: as many as there are cores.
#[must_use]
pub fn measure(plant: &Plant, trials: &[Trial], threads: Option<NonZero<usize>>) -> Vec<Measures> {
    let threads = threads.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZero::get);
    let threads = threads.min(trials.len().max(1));
    let next = AtomicUsize::new(0);
    let work = || {
        let mut mine = Vec::new();
        while let Some((at, trial)) = {
            let at = next.fetch_add(1, atomic::Ordering::Relaxed);
            trials.get(at).map(|t| (at, t))
        } {
            mine.push((at, Measures::of(&play(plant, trial))));
        }
        mine
    };
    let mut all: Vec<(usize, Measures)> = thread::scope(|scope| {
        let handles: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut all = work();
        // a panic in a trial is our own bug: it is printed already, and its trials are missing
        handles.into_iter().for_each(|handle| all.extend(handle.join().unwrap_or_default()));
        all
    });
    all.sort_unstable_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, measures)| measures).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Law;
    use crate::tune::loops::plant::tests::observed;

    fn judged(margin: f64) -> Verdict {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let extent = Extent { seeds: 1, millis: 2000, threads: None };
        judge(&plant, Law::Corrected { kappa: 0.5, lead: 0.0, margin }, 30.0, extent)
    }

    #[test]
    fn a_margin_costs_the_polygons_that_it_leaves_out() {
        // of T = 33.3 ms, 7 ms are fixed: a margin m leaves (1 − m − 0.21)/(1 − 0.21) of the polygons, apart from disturbances
        let (thin, wide) = (judged(0.05), judged(0.5));
        let expected = (0.5 - 0.21) / (0.95 - 0.21);
        assert!((wide.quality / thin.quality / expected - 1.0).abs() < 0.1, "{} and {}", wide.quality, thin.quality);
        assert!(wide.objective > thin.objective + 0.2, "{} and {}", wide.objective, thin.objective);
        assert_eq!(wide.asked, thin.asked, "the same speeds are asked of every margin");
    }

    #[test]
    fn margins_are_those_of_the_worst_speed() {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let verdict = judged(0.1);
        // the larger the share of the time that scales with polygons, the larger the loop's gain: the fastest machine is the worst
        let fastest = verdict.asked.iter().copied().filter(|s| plant.time_range(*s).contains(0.03)).fold(0.0, f64::max);
        let share = plant.share(0.03, fastest);
        assert!((verdict.margins.unwrap().gain - 2.0 / (0.5 * share)).abs() < 0.01, "{verdict:?}");
    }

    #[test]
    fn trials_without_randomness_run_once_and_weigh_as_much() {
        let undisturbed = Trial::undisturbed(Law::CORRECTED, 30.0);
        let extent = Extent { seeds: 10, millis: 500, threads: None };
        let still = disturbed(&undisturbed, 0.0, extent);
        assert_eq!((still.len(), disturbed(&undisturbed, 0.01, extent).len()), (17, 80));
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let ten = |trial: &Trial| (1..=10).map(|seed| Trial { seed, ..*trial }).collect::<Vec<_>>();
        let all: Vec<_> = still.iter().filter(|trial| trial.seed == 1).flat_map(ten).collect();
        let miss = |trials: &[Trial]| mean(trials, &measure(&plant, trials, None), |m| m.error);
        assert!((miss(&still) - miss(&all)).abs() < 1e-12, "{} and {}", miss(&still), miss(&all));
    }
}
