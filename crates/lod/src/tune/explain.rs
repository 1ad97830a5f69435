//! Explains why a pair of gains is slow, oscillates, or is fine.
//!
//! In: a plant, a contender with its gains, a target. Out: the loop near its set point, its fixed points, and two sentences of advice.
//! Never here: a search for other gains.

use super::candidate::Candidate;
use super::equilibria::{FixedPoint, fixed_points};
use super::margins::Loop;
use super::measures::{BAND, Cycle, Measures};
use super::plant::{Plant, Reach};
use super::play::{Beat, Start, Trial, play};
use super::trials::speeds_in_reach;
use crate::control::Law;

/// A contender on a plant, explained.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The range of times that the picture can take.
    pub reach: Reach,
    /// The target time, seconds.
    pub set_s: f64,
    /// s: the share of that time that scales with polygons.
    pub share: f64,
    /// The loop near the set point; `None` if the set point is out of reach.
    pub near: Option<Loop>,
    /// The fixed points, by rising ε̂.
    pub rests: Vec<FixedPoint>,
    /// Measures of trials started at 0.4 and at 2.5 times the target rate, without noise.
    pub from: [Measures; 2],
    /// The remaining oscillation after a start between a quarter and four times the target rate, if there is one.
    pub cycle: Option<Cycle>,
    /// Changes of levels n per frame when the loop should be at rest, the worst of the same starts.
    pub chatter: f64,
    /// The explanation in words.
    pub sentences: String,
}

/// Starts of the trials, as fractions of the target rate.
const STARTS: [f64; 7] = [0.25, 0.4, 0.63, 1.0, 1.6, 2.5, 4.0];
/// Duration of a calm trial, seconds.
const WATCH_S: f64 = 12.0;
/// A loop whose ε̂ stays within this relative range is at rest.
const STANDS: f64 = 1e-4;
/// A longer settling time counts as slow, seconds.
const SLOW_S: f64 = 1.0;
/// A gain margin below this factor counts as small.
const LITTLE_ROOM: f64 = 2.0;

/// Explains the behaviour of `contender` on `plant` at `target_hz`.
#[must_use]
pub fn explain(plant: &Plant, contender: impl Into<Candidate>, target_hz: f64) -> Explanation {
    let contender = contender.into();
    let calm = |rate: f64| {
        let trial = Trial { start: Start::Rate(rate), seconds: WATCH_S, ..Trial::calm(contender, target_hz) };
        play(plant, &trial)
    };
    let played = STARTS.map(calm);
    let runs = played.each_ref().map(|beats| Measures::of(beats));
    let set_s = contender.set_share() / target_hz;
    let mut explanation = Explanation {
        reach: plant.reach(1.0),
        set_s,
        share: plant.share(set_s, 1.0),
        near: contender.local_loop(plant, target_hz, 1.0),
        rests: match contender {
            Candidate::Feedback(_) => with_ends(fixed_points(plant, contender, target_hz), &played),
            // its fixed point from each start depends on the start
            Candidate::Adaptive { .. } => fixed_points(plant, contender, target_hz),
        },
        cycle: runs.iter().find_map(|measured| measured.cycle),
        chatter: runs.iter().map(|measured| measured.chatter).fold(0.0, f64::max),
        from: [runs[1], runs[5]],
        sentences: String::new(),
    };
    explanation.sentences = explanation.tell(contender, target_hz);
    explanation
}

/// Adds the fixed points off the set point at which trials ended: where ε̂ and n are at ends of their ranges there is no line to follow.
fn with_ends(mut rests: Vec<FixedPoint>, played: &[Vec<Beat>]) -> Vec<FixedPoint> {
    for end in played.iter().filter_map(|beats| left_at(beats)) {
        if rests.iter().all(|rest| (rest.ratio - end.ratio).abs() > BAND) {
            rests.push(end);
        }
    }
    rests.sort_by(|a, b| a.eps_hat.total_cmp(&b.eps_hat));
    rests
}

/// The state of a loop that was at rest for its last second, if it was.
fn left_at(beats: &[Beat]) -> Option<FixedPoint> {
    let last = beats.last()?;
    let mut second = beats.iter().rev().take_while(|beat| beat.time_s > last.time_s - 1.0);
    let stands =
        second.all(|beat| (beat.eps_hat / last.eps_hat - 1.0).abs() < STANDS && beat.polygons == last.polygons);
    let clamped = last.status.clamped().is_some();
    stands.then_some(FixedPoint { eps_hat: last.eps_hat, ratio: last.ratio, clamped })
}

/// Why no gain can bring `plant` to `target_hz`; `None` if one can, on this machine or, if the finest picture leaves time, on a slower one.
/// Two sentences.
#[must_use]
pub fn refusal(plant: &Plant, target_hz: f64) -> Option<String> {
    let reach = plant.reach(1.0);
    let too_slow = reach.least_s > 1.0 / target_hz;
    (too_slow || speeds_in_reach(plant, target_hz).is_empty())
        .then(|| tell_of_the_range(reach, 1.0 / target_hz, target_hz))
}

/// Sentences on a target time that is out of reach, and on a better request.
fn tell_of_the_range(Reach { least_s, most_s }: Reach, set_s: f64, target_hz: f64) -> String {
    let (end, why) = if set_s < least_s { ("coarsest", "too long") } else { ("finest", "less than it may") };
    format!(
        "At {target_hz} Hz a frame may take {:.2} ms, and what is in view takes {:.2} to {:.2} ms: it rests at its {end} and takes {why}. Ask \
         for a rate between {:.0} and {:.0} Hz, or widen the ranges of ε and n.",
        1e3 * set_s,
        1e3 * least_s,
        1e3 * most_s,
        1.0 / most_s,
        1.0 / least_s
    )
}

impl Explanation {
    /// Two sentences: the behaviour with its cause, and the advice.
    fn tell(&self, contender: Candidate, target_hz: f64) -> String {
        let Some(near) = self.near else {
            return tell_of_the_range(self.reach, self.set_s, target_hz);
        };
        let settle = self.from.iter().map(|m| m.settle_s).reduce(|a, b| Some(a?.max(b?))).flatten();
        let Candidate::Feedback(law) = contender else { return self.tell_of_prices(near, settle) };
        let (name, value) = knob(law);
        let margin = near.gain_margin();
        let safe = value * margin / LITTLE_ROOM;
        if let [FixedPoint { eps_hat, ratio, clamped: true }] = self.rests[..] {
            return format!(
                "It rests on a limit, ε̂ = {eps_hat:.3} at {ratio:.2} of its time, though what is in view could take all of it: β ties n to \
                 ε̂, and the n that comes with it is too {}. Use the corrected law, which chooses n by itself.",
                if ratio < 1.0 { "low" } else { "high" }
            );
        }
        if !near.is_stable() || self.cycle.is_some() {
            return self.tell_of_a_swing(near, name, value);
        }
        if let [first, .., last] = &self.rests[..] {
            return format!(
                "It can rest in {} places, from ε̂ = {:.3} ({:.2} of the time) to {:.3} ({:.2}), depending on where it begins: β ties \
                 n = ⌊ρ⌋ to ε̂, and not all of these places take the time. Use the corrected law, which has one.",
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
            None if safe > value => format!(
                "It does not come within 5 % of its time in {WATCH_S} s: each frame removes {removes:.2} % of an error, or the levels of what is \
                 in view are too coarse for the target. Raise {name} from {value:.2e} to {safe:.2e}, or widen the ranges of ε and n."
            ),
            None => format!(
                "It does not come within 5 % of its time in {WATCH_S} s, though each frame removes {removes:.0} % of an error: the levels of \
                 what is in view are too coarse for the target. Widen the ranges of ε and n."
            ),
        }
    }

    /// Sentences on the policy that predicts: it has no gain to set, since its filter weighs the measurements.
    fn tell_of_prices(&self, near: Loop, settle: Option<f64>) -> String {
        let learns = 100.0 * near.gain;
        match settle {
            Some(s) if s <= SLOW_S => format!(
                "It settles in {s:.2} s: each frame corrects {learns:.0} % of what it believes wrongly of the machine, and it bears {} more \
                 frames of delay before it swings. Nothing needs to be changed.",
                near.delay_margin()
            ),
            Some(s) => format!(
                "It takes {s:.1} s to settle: each frame corrects {learns:.0} % of what it believes wrongly of the machine, and what it \
                 believes falls by 5 % a frame at most. Tell it the prices of this machine in `[machine]`, or let it measure them."
            ),
            None => format!(
                "It does not come within 5 % of its time in {WATCH_S} s, though each frame corrects {learns:.0} % of what it believes wrongly of \
                 the machine: what is in view has levels too coarse for the target. Widen the ranges of ε and n."
            ),
        }
    }

    fn tell_of_a_swing(&self, near: Loop, name: &str, value: f64) -> String {
        let swing = self.cycle.map_or_else(String::new, |c| {
            format!(" by {:.0} % of its time every {:.2} s", 100.0 * c.amplitude, c.period_s)
        });
        let margin = near.gain_margin();
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

/// The gain that determines the speed of a law.
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
    fn advice_on_the_printed_gains_leads_to_gains_that_work_or_to_another_law() {
        // the tube's plant: all advice is followed, for as long as it names a gain of the printed law
        for target_hz in [30.0, 60.0] {
            let mut law = Law::PRINTED;
            for _ in 0..4 {
                let told = explain(&plant(), law, target_hz);
                if told.sentences.contains("Nothing needs") || told.sentences.contains("Use the corrected law") {
                    break;
                }
                let Law::Printed { alpha, beta } = law else { panic!("printed") };
                let to = told.sentences.rsplit(" to ").next().unwrap().split([',', '.']).collect::<Vec<_>>();
                let advised: f64 =
                    format!("{}.{}", to[0], to[1]).parse().unwrap_or_else(|_| panic!("{}", told.sentences));
                assert!((advised / alpha - 1.0).abs() > 0.01, "no news: {}", told.sentences);
                law = Law::Printed { alpha: advised, beta };
            }
            let told = explain(&plant(), law, target_hz).sentences;
            assert!(told.contains("Nothing needs") || told.contains("Use the corrected law"), "{target_hz}: {told}");
        }
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
        // 5 times the boundary of the slope, 2 ε̂/(s f)
        let near = Candidate::from(Law::PRINTED).local_loop(&plant(), 30.0, 1.0).unwrap();
        let alpha = 1e-4 * 5.0 * near.gain_margin();
        let told = explain(&plant(), Law::Printed { alpha, beta: 1e-6 }, 30.0);
        assert!(told.sentences.starts_with("It swings"), "{}", told.sentences);
    }

    #[test]
    fn the_policy_that_predicts_is_fine_and_says_what_it_learns() {
        let told = explain(&plant(), Candidate::ADAPTIVE, 30.0);
        assert!(told.sentences.starts_with("It settles in"), "{}", told.sentences);
        assert_eq!(told.rests.len(), 1, "{:?}", told.rests);
    }

    #[test]
    fn a_target_is_refused_where_no_machine_that_is_asked_can_take_it() {
        assert_eq!(refusal(&plant(), 30.0), None);
        assert!(refusal(&plant(), 200.0).unwrap().contains("coarsest"));
        assert!(refusal(&plant(), 0.1).unwrap().contains("finest"));
        // the finest leaves time here, and a machine of a quarter of the speed would need it
        let most_s = plant().reach(1.0).most_s;
        assert_eq!(refusal(&plant(), 0.4 / most_s), None);
    }

    #[test]
    fn a_target_out_of_reach_is_told_with_the_range() {
        let told = explain(&plant(), Law::CORRECTED, 500.0);
        assert!(told.near.is_none() && told.sentences.contains("coarsest"), "{}", told.sentences);
    }
}
