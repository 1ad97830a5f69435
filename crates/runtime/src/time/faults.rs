//! Fault injection: steps that are longer or shorter than requested, states that are never published.
//!
//! In: rates of faults and a seed. Out: the length of a step, whether a state is withheld; both the same on every run with every executor.
//! The faults imitate networks and loaded machines, so that couplings can be tested against them.
//! Never here: a model of physics, time passing.

use super::machine::{GOLDEN, mix, unit_interval};
use metachron_core::{AgentId, DT_MAX_S, SimSpan};

/// Faults injected into one agent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Each step's length is dt · (1 + jitter · u), u uniform in −1 … 1; `0 <= jitter < 1`. The agent still advances by exactly the step it
    /// makes, and a step stays at most [`DT_MAX_S`] long.
    pub jitter: f64,
    /// The share of states that are never published; `0 <= loss < 1`. The last state of an agent is always published.
    pub loss: f64,
    /// Seed: equal seeds give equal faults.
    pub seed: u64,
}

/// Purpose of a random number: one stream each.
#[derive(Debug, Clone, Copy)]
enum Draw {
    Jitter = 1,
    Loss = 2,
}

impl Faults {
    /// Whether both rates are valid fractions.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        [self.jitter, self.loss].iter().all(|share| (0.0..1.0).contains(share))
    }

    /// The length of step number `step` of `id`, where `dt` was requested.
    pub(crate) fn span(&self, dt: SimSpan, id: AgentId, step: u64) -> SimSpan {
        if self.jitter == 0.0 {
            return dt;
        }
        let factor = 1.0 + self.jitter * (2.0 * self.even(Draw::Jitter, id, step) - 1.0);
        let longest = SimSpan::from_secs_f64(DT_MAX_S).unwrap_or(dt);
        let span = SimSpan::from_secs_f64(dt.as_secs_f64() * factor).unwrap_or(dt);
        span.clamp(SimSpan::from_nanos(1), longest)
    }

    /// Whether the state after step number `step` of `id` is withheld.
    pub(crate) fn loses(&self, id: AgentId, step: u64) -> bool {
        self.loss > 0.0 && self.even(Draw::Loss, id, step) < self.loss
    }

    /// A number uniform in 0 … 1 that depends only on its arguments.
    fn even(&self, draw: Draw, id: AgentId, step: u64) -> f64 {
        let stream = mix((draw as u64).wrapping_mul(GOLDEN) ^ mix(u64::from(id.0).wrapping_add(1)));
        unit_interval(mix(self.seed ^ stream) ^ step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: SimSpan = SimSpan::from_nanos(4_000_000);
    const STEPS: u64 = 20_000;

    fn factors(faults: Faults, id: u32) -> Vec<f64> {
        (0..STEPS).map(|k| faults.span(DT, AgentId(id), k).as_secs_f64() / DT.as_secs_f64()).collect()
    }

    #[test]
    fn jitter_is_even_within_its_bounds() {
        let factors = factors(Faults { jitter: 0.2, loss: 0.0, seed: 3 }, 1);
        assert!(factors.iter().all(|f| (0.8..=1.2).contains(f)));
        let count = STEPS as f64;
        let mean = factors.iter().sum::<f64>() / count;
        let variance = factors.iter().map(|f| (f - mean) * (f - mean)).sum::<f64>() / count;
        // a uniform spread of half width 0.2: deviation 0.2/√3; standard error of the mean 8e-4, five of them
        assert!((mean - 1.0).abs() < 4e-3, "{mean}");
        // the variance's own deviation is σ² √(0.8/n) for a uniform spread: 0.6 %, five of them
        assert!((variance / (0.04 / 3.0) - 1.0).abs() < 0.032, "{variance}");
    }

    #[test]
    fn the_share_of_lost_states_is_the_one_asked_for() {
        for loss in [0.02, 0.1, 0.5] {
            let faults = Faults { jitter: 0.0, loss, seed: 9 };
            let lost = (0..STEPS).filter(|k| faults.loses(AgentId(4), *k)).count() as f64 / STEPS as f64;
            let error = (loss * (1.0 - loss) / STEPS as f64).sqrt();
            assert!((lost - loss).abs() < 5.0 * error, "{lost} for {loss}");
        }
    }

    #[test]
    fn agents_seeds_and_kinds_of_fault_are_disturbed_apart() {
        let faults = Faults { jitter: 0.2, loss: 0.5, seed: 3 };
        let one = factors(faults, 1);
        assert_eq!(one, factors(faults, 1));
        let correlation = |other: &[f64]| {
            one.iter().zip(other).map(|(a, b)| (a - 1.0) * (b - 1.0)).sum::<f64>() / (STEPS as f64 * 0.04 / 3.0)
        };
        // independent streams: 1/√n = 0.7 %, five of them
        assert!(correlation(&factors(faults, 2)).abs() < 0.036);
        assert!(correlation(&factors(Faults { seed: 4, ..faults }, 1)).abs() < 0.036);
        let lost: Vec<_> = (0..STEPS).map(|k| if faults.loses(AgentId(1), k) { 1.115 } else { 0.885 }).collect();
        assert!(correlation(&lost).abs() < 0.036);
    }

    #[test]
    fn an_agent_without_faults_is_unchanged() {
        let none = Faults::default();
        assert_eq!(none.span(DT, AgentId(0), 7), DT);
        assert!((0..1000).all(|k| !none.loses(AgentId(0), k)));
    }

    #[test]
    fn a_disturbed_step_is_still_a_step() {
        let wild = Faults { jitter: 0.999_999, loss: 0.0, seed: 1 };
        for (step, nanos) in (0..1000).flat_map(|k| [(k, 1), (k, 2), (k, 1_000_000_000)]) {
            let span = wild.span(SimSpan::from_nanos(nanos), AgentId(0), step);
            assert!(span > SimSpan::ZERO && span.as_secs_f64() <= DT_MAX_S);
        }
    }

    #[test]
    fn shares_outside_their_range_are_invalid() {
        assert!(Faults::default().is_sound());
        for bad in [-0.1, 1.0, f64::NAN] {
            assert!(!Faults { jitter: bad, ..Faults::default() }.is_sound());
            assert!(!Faults { loss: bad, ..Faults::default() }.is_sound());
        }
    }
}
