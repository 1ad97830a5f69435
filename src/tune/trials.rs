//! A law judged: all that may upset it, on machines of several speeds, with several seeds.
//!
//! In: a plant, a law, a target. Out: a [`Verdict`] with one number to be made small. Trials are dealt to all cores; the verdict does
//! not depend on who plays which. Never here: which gains to try.

use super::disturb::Disturbance;
use super::explain::local_loop;
use super::margins::Loop;
use super::measures::Measures;
use super::plant::Plant;
use super::play::{Start, Trial, play};
use crate::control::Law;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// How much is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Seeds a disturbance, ≥ 1.
    pub seeds: u64,
    /// Wall seconds of a trial are this many thousandths.
    pub millis: u64,
}

impl Extent {
    /// Ten seeds, four seconds each.
    pub const FULL: Self = Self { seeds: 10, millis: 4000 };
    /// Two seeds, three seconds each.
    pub const QUICK: Self = Self { seeds: 2, millis: 3000 };
}

/// What a law came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The law with its gains.
    pub law: Law,
    /// The worse of the settling times from 0.4 and from 2.5 times the wanted rate, wall seconds; `None` where one does not settle.
    pub settle_s: Option<f64>,
    /// The worse overshoot of the two.
    pub overshoot: f64,
    /// Share of frames that took 5 % too long, over all disturbances.
    pub miss_share: f64,
    /// Turns back within three frames, a frame, over all disturbances.
    pub reversals: f64,
    /// Mean share of the polygons that the time would have paid for.
    pub quality: f64,
    /// The factor on the gains at which it begins to swing for ever.
    pub gain_margin: f64,
    /// How many frames later a change may show.
    pub delay_margin: usize,
    /// Speeds of the machine, in parts of the plant's own, at which it settles within a second and does not swing; those whose
    /// target the picture cannot reach are not asked.
    pub robust_to: Vec<f64>,
    /// Speeds that were asked.
    pub asked: Vec<f64>,
    /// The number to be made small: see [`Verdict::objective`].
    pub objective: f64,
}

/// Speeds of the machine that a law must bear.
const SPEEDS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Starts from which it must settle.
const STARTS: [f64; 2] = [0.4, 2.5];
/// It must settle within a second.
const SETTLE_MAX_S: f64 = 1.0;
/// Least margins: a factor on the gain, and frames of delay.
const GAIN_MARGIN: f64 = 2.0;
const DELAY_MARGIN: usize = 2;

/// What a late frame, a reversal, a lost part of quality, a second of settling and a missing margin count beside an error of one.
const WEIGHTS: [f64; 5] = [2.0, 0.1, 1.0, 0.1, 1.0];

/// Judges `law` on `plant` at `target_hz`.
#[must_use]
pub fn judge(plant: &Plant, law: Law, target_hz: f64, extent: Extent) -> Verdict {
    let calm = |speed: f64, rate: f64| Trial {
        law,
        target_hz,
        speed,
        start: Start::Rate(rate),
        disturbance: Disturbance::Nothing,
        noise: 0.0,
        seed: 0,
        seconds: 1e-3 * extent.millis as f64,
    };
    let asked: Vec<f64> = SPEEDS.into_iter().filter(|&speed| can_reach(plant, law, target_hz, speed)).collect();
    let starts: Vec<_> = asked.iter().flat_map(|&speed| STARTS.map(|rate| calm(speed, rate))).collect();
    let upset = disturbed(&calm(1.0, 1.0), plant.line.scatter, extent);
    let played = play_all(plant, &[starts.clone(), upset].concat());
    let (settling, upset) = played.split_at(starts.len());
    let at_speed = |speed: f64| starts.iter().zip(settling).filter(move |(t, _)| t.speed == speed).map(|(_, m)| *m);
    let good = |m: Measures| m.settle_s.is_some_and(|s| s <= SETTLE_MAX_S) && m.cycle.is_none();
    let own = if asked.contains(&1.0) { 1.0 } else { asked.first().copied().unwrap_or(1.0) };
    let worst = at_speed(own).map(|m| m.settle_s).reduce(|a, b| Some(a?.max(b?))).flatten();
    let local = local_loop(plant, law, target_hz);
    let mut verdict = Verdict {
        law,
        settle_s: worst,
        overshoot: at_speed(own).map(|m| m.overshoot).fold(0.0, f64::max),
        miss_share: mean(upset, |m| m.miss_share),
        reversals: mean(upset, |m| m.reversals),
        quality: mean(upset, |m| m.quality),
        gain_margin: local.map_or(0.0, Loop::gain_margin),
        delay_margin: local.map_or(0, Loop::delay_margin),
        robust_to: asked.iter().copied().filter(|&speed| at_speed(speed).all(good)).collect(),
        asked,
        objective: 0.0,
    };
    verdict.objective = verdict.weigh(mean(upset, |m| m.error), 1e-3 * extent.millis as f64);
    verdict
}

impl Verdict {
    /// Mean error, late frames, reversals, lost quality, settling and missing margins in one number (control.md, eq. 29).
    fn weigh(&self, error: f64, longest_s: f64) -> f64 {
        let [late, reversal, quality, settling, margin] = WEIGHTS;
        let missing = (1.0 - self.gain_margin / GAIN_MARGIN).max(0.0)
            + (1.0 - self.delay_margin as f64 / DELAY_MARGIN as f64).max(0.0)
            + (self.asked.len() - self.robust_to.len()) as f64 / SPEEDS.len() as f64;
        error
            + late * self.miss_share
            + reversal * self.reversals
            + quality * (1.0 - self.quality)
            + settling * self.settle_s.unwrap_or(2.0 * longest_s)
            + margin * missing
    }
}

/// Whether the target lies in what the picture can take on a machine so fast.
fn can_reach(plant: &Plant, law: Law, target_hz: f64, speed: f64) -> bool {
    let (set_s, reach) = (law.set_share() / target_hz, plant.reach(speed));
    reach.least_s <= set_s && set_s <= reach.most_s
}

/// Trials with every disturbance and every seed.
fn disturbed(calm: &Trial, noise: f64, extent: Extent) -> Vec<Trial> {
    let seeds = 1..=extent.seeds.max(1);
    let of =
        |disturbance| seeds.clone().map(move |seed| Trial { disturbance, seed, noise, start: Start::Target, ..*calm });
    Disturbance::ALL.into_iter().flat_map(of).collect()
}

fn mean(all: &[Measures], value: impl Fn(&Measures) -> f64) -> f64 {
    all.iter().map(value).sum::<f64>() / all.len().max(1) as f64
}

/// Plays every trial, on all cores.
fn play_all(plant: &Plant, trials: &[Trial]) -> Vec<Measures> {
    let cores = thread::available_parallelism().map_or(1, NonZero::get).min(trials.len().max(1));
    let next = AtomicUsize::new(0);
    let work = || {
        let mut mine = Vec::new();
        while let Some((at, trial)) = {
            let at = next.fetch_add(1, Ordering::Relaxed);
            trials.get(at).map(|t| (at, t))
        } {
            mine.push((at, Measures::of(&play(plant, trial))));
        }
        mine
    };
    let mut all: Vec<(usize, Measures)> = thread::scope(|scope| {
        let hands: Vec<_> = (1..cores).map(|_| scope.spawn(work)).collect();
        let mut all = work();
        // a panic in a trial is a bug of ours: it is printed already, and its trials are missing
        hands.into_iter().for_each(|hand| all.extend(hand.join().unwrap_or_default()));
        all
    });
    all.sort_unstable_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, measures)| measures).collect()
}
