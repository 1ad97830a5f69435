//! Why a pair of gains is slow, swings, or is fine.
//!
//! In: a plant, a law with its gains, a target. Out: the loop near its set point, where it comes to rest, and two sentences that a
//! person can act on. Never here: other gains than those that were asked about.

use super::disturb::Disturbance;
use super::margins::Loop;
use super::measures::{Cycle, Measures};
use super::plant::{Plant, Reach};
use super::play::{Beat, Start, Trial, play};
use crate::control::Law;

/// Where a loop comes to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPoint {
    /// The loop variable ε̂ there.
    pub eps_hat: f64,
    /// t/T_set there.
    pub ratio: f64,
    /// Whether it rests on a limit of what is in view.
    pub clamped: bool,
}

/// A law on a plant, explained.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// What the picture can take at all.
    pub reach: Reach,
    /// The time that is to be held, seconds.
    pub set_s: f64,
    /// s: the share of that time that goes with polygons.
    pub share: f64,
    /// The loop near the set point; `None` where the set point is out of reach.
    pub near: Option<Loop>,
    /// The places at which it rests, from starts between a quarter and four times the wanted rate, by rising ε̂.
    pub rests: Vec<FixedPoint>,
    /// From 0.4 and from 2.5 times the wanted rate, without noise.
    pub from: [Measures; 2],
    /// The swing that is left, if there is one.
    pub cycle: Option<Cycle>,
    /// What that means.
    pub sentences: String,
}

/// Starts whose rests are looked at, in parts of the wanted rate.
const STARTS: [f64; 7] = [0.25, 0.4, 0.63, 1.0, 1.6, 2.5, 4.0];
/// Seconds that a calm trial is watched.
const WATCH_S: f64 = 12.0;
/// Rests nearer than this, in proportion, are one.
const SAME: f64 = 0.06;
/// Slower than this is slow, seconds.
const SLOW_S: f64 = 1.0;
/// A loop nearer than this factor to swinging has little room.
const LITTLE_ROOM: f64 = 2.0;

/// Explains what `law` does to `plant` at `target_hz`.
#[must_use]
pub fn explain(plant: &Plant, law: Law, target_hz: f64) -> Explanation {
    let calm = |rate: f64| {
        let trial = Trial {
            law,
            target_hz,
            speed: 1.0,
            start: Start::Rate(rate),
            disturbance: Disturbance::Nothing,
            noise: 0.0,
            seed: 0,
            seconds: WATCH_S,
        };
        play(plant, &trial)
    };
    let runs = STARTS.map(calm);
    let from = [&runs[1], &runs[5]].map(|beats| Measures::of(beats));
    let set_s = law.set_share() / target_hz;
    let mut explanation = Explanation {
        reach: plant.reach(1.0),
        set_s,
        share: plant.share(set_s, 1.0),
        near: local_loop(plant, law, target_hz),
        rests: rests(&runs),
        cycle: runs.iter().find_map(|beats| Measures::of(beats).cycle),
        from,
        sentences: String::new(),
    };
    explanation.sentences = explanation.tell(law, target_hz);
    explanation
}

/// The loop near the set point (control.md, eq. 4, 8 and 21); `None` where the picture cannot take that time.
pub(super) fn local_loop(plant: &Plant, law: Law, target_hz: f64) -> Option<Loop> {
    let set_s = law.set_share() / target_hz;
    let reach = plant.reach(1.0);
    if !(reach.least_s <= set_s && set_s <= reach.most_s) {
        return None;
    }
    let share = plant.share(set_s, 1.0);
    let (gain, lead) = match law {
        Law::Corrected { kappa, lead, .. } => (kappa * share, lead * share),
        Law::Printed { alpha, .. } => (alpha * share * target_hz / rest_of(plant, law, target_hz), 0.0),
    };
    Some(Loop { gain, lead, dead_time: plant.dead_time })
}

/// ε̂ with which a law begins that is put where the frame takes its time.
fn rest_of(plant: &Plant, law: Law, target_hz: f64) -> f64 {
    let trial = Trial {
        law,
        target_hz,
        speed: 1.0,
        start: Start::Target,
        disturbance: Disturbance::Nothing,
        noise: 0.0,
        seed: 0,
        seconds: 0.5 / target_hz,
    };
    play(plant, &trial).first().map_or(1.0, |beat| beat.eps_hat)
}

/// Where the runs end, each place once.
fn rests(runs: &[Vec<Beat>]) -> Vec<FixedPoint> {
    let mut found: Vec<FixedPoint> = Vec::new();
    for beats in runs {
        let (Some(last), None) = (beats.last(), Measures::of(beats).cycle) else { continue };
        let point = FixedPoint { eps_hat: last.eps_hat, ratio: last.ratio, clamped: last.status.clamped().is_some() };
        if found.iter().all(|held| (held.eps_hat / point.eps_hat).ln().abs() > SAME) {
            found.push(point);
        }
    }
    found.sort_by(|a, b| a.eps_hat.total_cmp(&b.eps_hat));
    found
}

impl Explanation {
    /// Two sentences: what it does and why, and what to change.
    fn tell(&self, law: Law, target_hz: f64) -> String {
        let ms = |s: f64| 1e3 * s;
        let Reach { least_s, most_s } = self.reach;
        let Some(near) = self.near else {
            let (end, why) =
                if self.set_s < least_s { ("coarsest", "too long") } else { ("finest", "less than it may") };
            return format!(
                "At {target_hz} Hz a frame may take {:.2} ms, and what is in view takes {:.2} to {:.2} ms: it rests at its {end} and takes \
                 {why}. Ask for a rate between {:.0} and {:.0} Hz, or widen the ranges of ε and n.",
                ms(self.set_s),
                ms(least_s),
                ms(most_s),
                1.0 / most_s,
                1.0 / least_s
            );
        };
        let (name, value) = knob(law);
        let margin = near.gain_margin();
        let settle = self.from.iter().map(|m| m.settle_s).reduce(|a, b| Some(a?.max(b?))).flatten();
        let safe = value * margin / LITTLE_ROOM;
        if !near.is_stable() || self.cycle.is_some() {
            return self.tell_of_a_swing(near, (name, value, margin));
        }
        if let [first, .., last] = &self.rests[..] {
            return format!(
                "It comes to rest in {} places, from ε̂ = {:.3} ({:.2} of the time) to {:.3} ({:.2}), depending on where it begins: n = ⌊ρ⌋ \
                 makes frames slower where ε̂ grows. Use the corrected law, which has one.",
                self.rests.len(),
                first.eps_hat,
                first.ratio,
                last.eps_hat,
                last.ratio
            );
        }
        let removes = 100.0 * near.gain;
        match settle {
            Some(s) if s <= SLOW_S && margin >= LITTLE_ROOM => format!(
                "It settles in {s:.2} s: each frame removes {removes:.0} % of an error, and {name} may be {margin:.1} times as large before it \
                 swings. Nothing needs to be changed."
            ),
            Some(s) if s <= SLOW_S => format!(
                "It settles in {s:.2} s, but {name} may be only {margin:.1} times as large before it swings for ever. Lower {name} to {safe:.3} \
                 for a factor of two."
            ),
            Some(s) => format!(
                "It takes {s:.1} s to settle: each frame removes only {removes:.1} % of an error, and at {target_hz} Hz frames are few. Raise \
                 {name} from {value:.2e} to {safe:.2e}, which still leaves a factor of two before it swings."
            ),
            None => format!(
                "It does not come within 5 % of its time in {WATCH_S} s: each frame removes {removes:.2} % of an error, or the levels of what is \
                 in view are too coarse for the target. Raise {name} from {value:.2e} to {safe:.2e}, or widen the ranges of ε and n."
            ),
        }
    }

    fn tell_of_a_swing(&self, near: Loop, (name, value, margin): (&str, f64, f64)) -> String {
        let swing = self.cycle.map_or_else(String::new, |c| {
            format!(" by {:.0} % of its time every {:.2} s", 100.0 * c.amplitude, c.period_s)
        });
        let safe = value * margin / LITTLE_ROOM;
        if near.is_stable() {
            return format!(
                "It swings{swing} though small errors die away: levels are so few that each step of n overshoots. Lower {name} from \
                 {value:.2e} to {:.2e}, or allow finer steps of ε and n.",
                0.5 * value
            );
        }
        format!(
            "It swings{swing}: each frame answers {:.0} % of an error, and more than {:.0} % is too much with {} frames of delay. Lower {name} \
             from {value:.2e} to {safe:.2e}.",
            100.0 * near.gain,
            100.0 * near.gain * margin,
            near.dead_time
        )
    }
}

/// The gain that makes a law fast or slow.
fn knob(law: Law) -> (&'static str, f64) {
    match law {
        Law::Corrected { kappa, .. } => ("κ", kappa),
        Law::Printed { alpha, .. } => ("α", alpha),
    }
}

#[cfg(test)]
mod tests {
    use super::super::plant::tests::observed;
    use super::*;

    fn plant() -> Plant {
        Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap()
    }

    #[test]
    fn the_printed_gains_are_slow_here_and_it_says_so() {
        let told = explain(&plant(), Law::PRINTED, 30.0);
        assert!(told.near.unwrap().gain < 0.2, "{:?}", told.near);
        assert!(!told.sentences.contains("Nothing needs"), "{}", told.sentences);
    }

    #[test]
    fn the_corrected_law_is_fine() {
        let told = explain(&plant(), Law::CORRECTED, 30.0);
        assert!(told.sentences.contains("Nothing needs to be changed"), "{}", told.sentences);
        assert_eq!(told.rests.len(), 1, "{:?}", told.rests);
        assert!((told.near.unwrap().gain - 0.5 * told.share).abs() < 1e-12);
    }

    #[test]
    fn a_gain_that_is_too_high_swings() {
        // 5 times the slope's boundary of 2 ε̂/(s f)
        let near = local_loop(&plant(), Law::PRINTED, 30.0).unwrap();
        let alpha = 1e-4 * 5.0 * near.gain_margin();
        let told = explain(&plant(), Law::Printed { alpha, beta: 1e-6 }, 30.0);
        assert!(told.sentences.starts_with("It swings"), "{}", told.sentences);
    }

    #[test]
    fn a_target_out_of_reach_is_told_with_the_range() {
        let told = explain(&plant(), Law::CORRECTED, 500.0);
        assert!(told.near.is_none() && told.sentences.contains("coarsest"), "{}", told.sentences);
    }
}
