//! Explains why a pair of gains is slow, oscillates, or is fine.
//!
//! In: a plant, a candidate with its gains, a target. Out: the loop near its set point, its fixed points, and two sentences of advice.
//! Never here: a search for other gains.

use super::trials::{GAIN_MARGIN, SETTLE_MAX_S, speeds_in_reach};
use crate::control::Law;
use crate::tune::loops::candidate::Candidate;
use crate::tune::loops::equilibria::{FixedPoint, fixed_points};
use crate::tune::loops::margins::Loop;
use crate::tune::loops::measures::{BAND, Cycle, Measures};
use crate::tune::loops::plant::{Plant, TimeRange};
use crate::tune::loops::play::{Start, Trial, TrialFrame, play};

/// A candidate on a plant, explained.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The range of times that the picture can take.
    pub time_range: TimeRange,
    /// The target time, seconds.
    pub set_s: f64,
    /// s: the share of that time that scales with polygons.
    pub share: f64,
    /// The loop near the set point; `None` if the set point is out of reach.
    pub near: Option<Loop>,
    /// The fixed points, by rising ε̂.
    pub fixed_points: Vec<FixedPoint>,
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
/// Duration of a trial without a disturbance, seconds.
const TRIAL_S: f64 = 12.0;
/// A loop whose ε̂ stays within this relative range is at rest.
const REST_BAND: f64 = 1e-4;

/// Explains the behaviour of `candidate` on `plant` at `target_hz`.
#[must_use]
pub fn explain(plant: &Plant, candidate: impl Into<Candidate>, target_hz: f64) -> Explanation {
    let candidate = candidate.into();
    let undisturbed = |rate: f64| {
        let trial = Trial { start: Start::Rate(rate), seconds: TRIAL_S, ..Trial::undisturbed(candidate, target_hz) };
        play(plant, &trial)
    };
    let played = STARTS.map(undisturbed);
    let runs = played.each_ref().map(|frames| Measures::of(frames));
    let set_s = candidate.set_share() / target_hz;
    let mut explanation = Explanation {
        time_range: plant.time_range(1.0),
        set_s,
        share: plant.share(set_s, 1.0),
        near: candidate.local_loop(plant, target_hz, 1.0),
        fixed_points: match candidate {
            Candidate::Feedback(_) => with_ends(fixed_points(plant, candidate, target_hz), &played),
            // its fixed point from each start depends on the start
            Candidate::Adaptive { .. } => fixed_points(plant, candidate, target_hz),
        },
        cycle: runs.iter().find_map(|measured| measured.cycle),
        chatter: runs.iter().map(|measured| measured.chatter).fold(0.0, f64::max),
        from: [runs[1], runs[5]],
        sentences: String::new(),
    };
    explanation.sentences = explanation.describe(candidate, target_hz);
    explanation
}

/// Adds the fixed points off the set point at which trials ended: where ε̂ and n are at ends of their ranges there is no line to follow.
fn with_ends(mut fixed_points: Vec<FixedPoint>, played: &[Vec<TrialFrame>]) -> Vec<FixedPoint> {
    for end in played.iter().filter_map(|frames| resting_point(frames)) {
        if fixed_points.iter().all(|rest| (rest.ratio - end.ratio).abs() > BAND) {
            fixed_points.push(end);
        }
    }
    fixed_points.sort_by(|a, b| a.eps_hat.total_cmp(&b.eps_hat));
    fixed_points
}

/// The state of a loop that was at rest for its last second, if it was.
fn resting_point(frames: &[TrialFrame]) -> Option<FixedPoint> {
    let last = frames.last()?;
    let mut second = frames.iter().rev().take_while(|frame| frame.time_s > last.time_s - 1.0);
    let stands =
        second.all(|frame| (frame.eps_hat / last.eps_hat - 1.0).abs() < REST_BAND && frame.polygons == last.polygons);
    let clamped = last.status.clamped().is_some();
    stands.then_some(FixedPoint { eps_hat: last.eps_hat, ratio: last.ratio, clamped })
}

/// Why no gain can bring `plant` to `target_hz`; `None` if one can, on this machine or, if the finest picture leaves time, on a slower one.
/// Two sentences.
#[must_use]
pub fn refusal(plant: &Plant, target_hz: f64) -> Option<String> {
    let time_range = plant.time_range(1.0);
    let too_slow = time_range.least_s > 1.0 / target_hz;
    (too_slow || speeds_in_reach(plant, target_hz).is_empty())
        .then(|| describe_range(time_range, 1.0 / target_hz, target_hz))
}

/// Sentences on a target time that is out of reach, and on a better request.
fn describe_range(TimeRange { least_s, most_s }: TimeRange, set_s: f64, target_hz: f64) -> String {
    let (end, why) = if set_s < least_s { ("coarsest", "too long") } else { ("finest", "less than they may") };
    format!(
        "At {target_hz} Hz a frame may take {:.2} ms, and the objects in view take {:.2} to {:.2} ms: the loop rests at its {end} and frames \
         take {why}. Choose a rate between {:.0} and {:.0} Hz, or widen the ranges of ε and n.",
        1e3 * set_s,
        1e3 * least_s,
        1e3 * most_s,
        1.0 / most_s,
        1.0 / least_s
    )
}

impl Explanation {
    /// Two sentences: the behaviour with its cause, and the advice.
    fn describe(&self, candidate: Candidate, target_hz: f64) -> String {
        let Some(near) = self.near else {
            return describe_range(self.time_range, self.set_s, target_hz);
        };
        let settle = self.from.iter().map(|m| m.settle_s).reduce(|a, b| Some(a?.max(b?))).flatten();
        let Candidate::Feedback(law) = candidate else { return self.describe_adaptive(near, settle) };
        let (name, value) = main_gain(law);
        let margin = near.gain_margin();
        let safe = value * margin / GAIN_MARGIN;
        if let [FixedPoint { eps_hat, ratio, clamped: true }] = self.fixed_points[..] {
            return format!(
                "The loop rests at a limit, ε̂ = {eps_hat:.3} at {ratio:.2} of its time, although the objects in view could take all of it: β \
                 ties n to ε̂, and the resulting n is too {}. Use the corrected law, which chooses n independently.",
                if ratio < 1.0 { "low" } else { "high" }
            );
        }
        if !near.is_stable() || self.cycle.is_some() {
            return self.describe_oscillation(near, name, value);
        }
        if let [first, .., last] = &self.fixed_points[..] {
            return format!(
                "The loop has {} fixed points, from ε̂ = {:.3} ({:.2} of the time) to {:.3} ({:.2}), depending on its start: β ties \
                 n = ⌊ρ⌋ to ε̂, and not all of them take the whole time. Use the corrected law, which has one.",
                self.fixed_points.len(),
                first.eps_hat,
                first.ratio,
                last.eps_hat,
                last.ratio
            );
        }
        let removes = 100.0 * near.gain;
        match settle {
            Some(s) if s <= SETTLE_MAX_S && margin >= GAIN_MARGIN => format!(
                "The loop settles in {s:.2} s: each frame removes {removes:.0} % of an error, and {name} may be {margin:.1} times as large \
                 before the loop oscillates. Nothing needs to be changed."
            ),
            Some(s) if s <= SETTLE_MAX_S => format!(
                "The loop settles in {s:.2} s, but {name} may be only {margin:.1} times as large before the loop oscillates without end. Lower \
                 {name} to {safe:.3} for a factor of two."
            ),
            Some(s) => format!(
                "The loop takes {s:.1} s to settle: each frame removes only {removes:.1} % of an error, and at {target_hz} Hz frames are few. \
                 Raise {name} from {value:.2e} to {safe:.2e}, which still leaves a factor of two before the loop oscillates."
            ),
            None if safe > value => format!(
                "The loop does not come within 5 % of its time in {TRIAL_S} s: each frame removes {removes:.2} % of an error, or the levels of \
                 the objects in view are too coarse for the target. Raise {name} from {value:.2e} to {safe:.2e}, or widen the ranges of ε and n."
            ),
            None => format!(
                "The loop does not come within 5 % of its time in {TRIAL_S} s, although each frame removes {removes:.0} % of an error: the \
                 levels of the objects in view are too coarse for the target. Widen the ranges of ε and n."
            ),
        }
    }

    /// Sentences on the policy that predicts: it has no gain to set, since its filter weighs the measurements.
    fn describe_adaptive(&self, near: Loop, settle: Option<f64>) -> String {
        let learns = 100.0 * near.gain;
        match settle {
            Some(s) if s <= SETTLE_MAX_S => format!(
                "The policy settles in {s:.2} s: each frame corrects {learns:.0} % of the error of its estimate of the machine, and the loop \
                 tolerates {} more frames of delay before it oscillates. Nothing needs to be changed.",
                near.delay_margin()
            ),
            Some(s) => format!(
                "The policy takes {s:.1} s to settle: each frame corrects {learns:.0} % of the error of its estimate of the machine, which \
                 falls by 5 % a frame at most. Declare the prices of this machine in `[machine]`, or let the program measure them."
            ),
            None => format!(
                "The policy does not come within 5 % of its time in {TRIAL_S} s, although each frame corrects {learns:.0} % of the error of its \
                 estimate of the machine: the levels of the objects in view are too coarse for the target. Widen the ranges of ε and n."
            ),
        }
    }

    fn describe_oscillation(&self, near: Loop, name: &str, value: f64) -> String {
        let swing = self.cycle.map_or_else(String::new, |c| {
            format!(" by {:.0} % of its time every {:.2} s", 100.0 * c.amplitude, c.period_s)
        });
        let margin = near.gain_margin();
        let safe = value * margin / GAIN_MARGIN;
        if near.is_stable() {
            return format!(
                "The loop oscillates{swing} although small errors decay: there are so few levels that each step of n overshoots. Lower {name} \
                 from {value:.2e} to {:.2e}, or allow finer steps of ε and n.",
                0.5 * value
            );
        }
        format!(
            "The loop oscillates{swing}: each frame corrects {:.0} % of an error, and more than {:.0} % is too much with {} frames of delay. \
             Lower {name} from {value:.2e} to {safe:.2e}.",
            100.0 * near.gain,
            100.0 * near.gain * margin,
            near.dead_time
        )
    }
}

/// The gain that determines the speed of a law.
fn main_gain(law: Law) -> (&'static str, f64) {
    match law {
        Law::Corrected { kappa, .. } => ("κ", kappa),
        Law::Printed { alpha, .. } => ("α", alpha),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tune::loops::plant::tests::observed;

    fn plant() -> Plant {
        Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap()
    }

    #[test]
    fn the_printed_gains_are_explained_as_slow_on_this_plant() {
        let explanation = explain(&plant(), Law::PRINTED, 30.0);
        assert!(explanation.near.unwrap().gain < 0.2, "{:?}", explanation.near);
        assert!(!explanation.sentences.contains("Nothing needs"), "{}", explanation.sentences);
    }

    #[test]
    fn advice_on_the_printed_gains_leads_to_gains_that_work_or_to_another_law() {
        // the tube's plant: all advice is followed, for as long as it names a gain of the printed law
        for target_hz in [30.0, 60.0] {
            let mut law = Law::PRINTED;
            for _ in 0..4 {
                let explanation = explain(&plant(), law, target_hz);
                if explanation.sentences.contains("Nothing needs")
                    || explanation.sentences.contains("Use the corrected law")
                {
                    break;
                }
                let Law::Printed { alpha, beta } = law else { panic!("printed") };
                let to = explanation.sentences.rsplit(" to ").next().unwrap().split([',', '.']).collect::<Vec<_>>();
                let advised: f64 =
                    format!("{}.{}", to[0], to[1]).parse().unwrap_or_else(|_| panic!("{}", explanation.sentences));
                assert!((advised / alpha - 1.0).abs() > 0.01, "no news: {}", explanation.sentences);
                law = Law::Printed { alpha: advised, beta };
            }
            let explanation = explain(&plant(), law, target_hz).sentences;
            assert!(
                explanation.contains("Nothing needs") || explanation.contains("Use the corrected law"),
                "{target_hz}: {explanation}"
            );
        }
    }

    #[test]
    fn the_corrected_law_needs_no_change() {
        let explanation = explain(&plant(), Law::CORRECTED, 30.0);
        assert!(explanation.sentences.contains("Nothing needs to be changed"), "{}", explanation.sentences);
        assert_eq!(explanation.fixed_points.len(), 1, "{:?}", explanation.fixed_points);
        assert!((explanation.near.unwrap().gain - 0.5 * explanation.share).abs() < 1e-12);
    }

    #[test]
    fn a_gain_that_is_too_high_is_explained_as_oscillation() {
        // 5 times the boundary of the slope, 2 ε̂/(s f)
        let near = Candidate::from(Law::PRINTED).local_loop(&plant(), 30.0, 1.0).unwrap();
        let alpha = 1e-4 * 5.0 * near.gain_margin();
        let explanation = explain(&plant(), Law::Printed { alpha, beta: 1e-6 }, 30.0);
        assert!(explanation.sentences.starts_with("The loop oscillates"), "{}", explanation.sentences);
    }

    #[test]
    fn the_adaptive_policy_needs_no_change_and_reports_its_correction() {
        let explanation = explain(&plant(), Candidate::ADAPTIVE, 30.0);
        assert!(explanation.sentences.starts_with("The policy settles in"), "{}", explanation.sentences);
        assert_eq!(explanation.fixed_points.len(), 1, "{:?}", explanation.fixed_points);
    }

    #[test]
    fn a_target_is_refused_where_it_is_out_of_range_at_every_tested_speed() {
        assert_eq!(refusal(&plant(), 30.0), None);
        assert!(refusal(&plant(), 200.0).unwrap().contains("coarsest"));
        assert!(refusal(&plant(), 0.1).unwrap().contains("finest"));
        // the finest leaves time here, and a machine of a quarter of the speed would need it
        let most_s = plant().time_range(1.0).most_s;
        assert_eq!(refusal(&plant(), 0.4 / most_s), None);
    }

    #[test]
    fn a_target_out_of_range_is_explained_with_the_range() {
        let explanation = explain(&plant(), Law::CORRECTED, 500.0);
        assert!(explanation.near.is_none() && explanation.sentences.contains("coarsest"), "{}", explanation.sentences);
    }
}
