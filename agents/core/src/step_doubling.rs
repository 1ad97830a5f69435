//! Error that an object's steps accumulate, metres, estimated by repeating some steps in halves.
//!
//! In: the steps made, and how far the same steps made again in halves ended from them. Out: the error accumulated over
//! [`DRIFT_S`] at that rate. Objects are staggered by their numbers, so that similar ones do not all make expensive steps simultaneously.
//! Never here: how a step is repeated. Theory: docs/theory/control.md, eq. 31, 32.

use crate::AgentId;

/// The error is extrapolated to this span, seconds: long enough to be visible, short enough that no motion has reversed.
pub const DRIFT_S: f64 = 0.1;

/// Number of consecutive steps that are repeated: jitter deviates in another direction after each and partly cancels.
const STEPS: u32 = 2;
/// … out of this many: twice the work of two steps is 4.2 % of the work of 96.
const EVERY: u64 = 96;
/// The first step that may be repeated: later than the very first ones, from which controllers learn the cost of a step.
pub const FIRST: u64 = EVERY / 2;
/// Number of rows that fit into that many steps without overlap.
const ROWS: u64 = EVERY / STEPS as u64;
/// 2³² over the golden ratio: its multiples are spread evenly over 0 … 2³², however many there are.
const GOLDEN: u32 = 2_654_435_769;

/// The error estimate of one object's steps.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub struct DoublingSchedule {
    /// Number of steps of the present row that have been repeated; `None` between rows.
    made: Option<u32>,
    /// Their length, seconds.
    span_s: f64,
}

impl DoublingSchedule {
    /// Starts a row of the object number `agent` if step number `steps` is its first; returns whether it does.
    pub fn begins(&mut self, steps: u64, agent: AgentId) -> bool {
        let first = FIRST + u64::from(STEPS) * row(agent);
        let begins = steps >= first && (steps - first).is_multiple_of(EVERY);
        if begins {
            (self.made, self.span_s) = (Some(0), 0.0);
        }
        begins
    }

    /// Whether the present step is to be repeated.
    pub fn is_on(&self) -> bool {
        self.made.is_some()
    }

    /// Abandons the row: it gives no estimate.
    pub fn cancel(&mut self) {
        self.made = None;
    }

    /// Counts a repeated step of `dt_s` seconds; returns whether it was the last of its row.
    pub fn finish_step(&mut self, dt_s: f64) -> bool {
        self.span_s += dt_s;
        let made = self.made.map_or(0, |made| made + 1);
        self.made = (made < STEPS).then_some(made);
        made == STEPS
    }

    /// The span of the present row's steps so far, seconds; zero before the first.
    #[must_use]
    pub fn span_s(&self) -> f64 {
        self.span_s
    }
}

/// Error accumulated in [`DRIFT_S`], metres, by steps over `span_s` seconds that end `apart_m` metres from the same in halves: these leave half
/// of the error of a rule of first order (eq. 31).
#[must_use]
pub fn drift_m(apart_m: f64, span_s: f64) -> f64 {
    apart_m / 0.5 * DRIFT_S / span_s
}

/// Index of an object's row among [`ROWS`]: consecutive numbers get different rows.
fn row(agent: AgentId) -> u64 {
    (u64::from(agent.0.wrapping_mul(GOLDEN)) * ROWS) >> 32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twenty_fourth_of_a_thousand_steps_is_repeated_in_halves() {
        let mut schedule = DoublingSchedule::default();
        let mut again = 0;
        for step in 0..960 {
            schedule.begins(step, AgentId(0));
            if schedule.is_on() {
                again += 2;
                if schedule.finish_step(1e-3) {
                    // two steps of 1 ms end 1 µs apart: their error is 2 µs, that of a hundred steps 100 µs
                    assert!((drift_m(1e-6, schedule.span_s()) - 1e-4).abs() < 1e-15);
                }
            }
        }
        assert_eq!(again, 40); // 4.2 %
    }

    #[test]
    fn similar_objects_are_staggered_and_none_starts_early() {
        // (number of objects of one rate, the most of them that repeat a step simultaneously); the mean stays as without staggering
        for (count, most) in [(1, 1), (10, 1), (24, 1), (48, 2), (96, 3), (1000, 22)] {
            let mut schedules = vec![DoublingSchedule::default(); count];
            let (mut first, mut busiest, mut again) = (u64::MAX, 0, 0);
            for step in 0..960 {
                let mut now = 0;
                for (schedule, agent) in schedules.iter_mut().zip((0..).map(AgentId)) {
                    schedule.begins(step, agent);
                    if schedule.is_on() {
                        now += 1;
                        schedule.finish_step(1e-3);
                    }
                }
                first = if now > 0 { first.min(step) } else { first };
                (busiest, again) = (busiest.max(now), again + now);
            }
            assert!(busiest <= most, "{busiest} of {count}");
            // the last object begins 94 steps after the first, less than one row in ten
            assert!(first == FIRST && again <= 20 * count && again >= 18 * count, "{first}, {again} of {count}");
        }
    }
}
