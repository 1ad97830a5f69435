//! How far an object's steps carry it from where exact ones would, metres: when they are made a second time, and what that told.
//!
//! In: steps that were made, and how far those made again in halves ended from them. Out: the error that the steps of
//! [`DRIFT_S`] make at that rate. Objects take turns by their numbers: alike ones do not all make dear steps at once.
//! Never here: how a step is made again. Theory: docs/theory/control.md, eq. 31, 32.

use crate::AgentId;
use glam::DVec3;

/// The error of steps is told over so long, seconds: long enough to be seen, short enough that nothing has turned round.
pub const DRIFT_S: f64 = 0.1;

/// So many steps in a row are made a second time: what merely trembles is another way off after each.
const STEPS: u32 = 2;
/// … of so many: twice two steps' work is 4.2 % of that of 96.
const EVERY: u64 = 96;
/// The first that may be one of them: not the first of all, by which controllers learn what a step costs.
pub const FIRST: u64 = EVERY / 2;
/// So many rows fit into that many steps side by side.
const ROWS: u64 = EVERY / STEPS as u64;
/// 2³² over the golden ratio: multiples of it lie evenly in 0 … 2³², however many there are.
const GOLDEN: u32 = 2_654_435_769;

/// The watch over the steps of one object.
#[derive(Debug, Clone, Copy, Default)]
pub struct Watch {
    /// Steps of the present row that have been made twice; `None` between rows.
    made: Option<u32>,
    /// Their length, seconds.
    span_s: f64,
    /// What the last row told, metres.
    error_m: f64,
}

impl Watch {
    /// Whether a row of the object with the number `whose` begins with its step number `steps`.
    pub fn begins(&mut self, steps: u64, whose: AgentId) -> bool {
        let first = FIRST + u64::from(STEPS) * row(whose);
        let begins = steps >= first && (steps - first).is_multiple_of(EVERY);
        if begins {
            (self.made, self.span_s) = (Some(0), 0.0);
        }
        begins
    }

    /// Whether the present step is made twice.
    pub fn is_on(&self) -> bool {
        self.made.is_some()
    }

    /// The row cannot be ended: it tells nothing.
    pub fn give_up(&mut self) {
        self.made = None;
    }

    /// A step of `dt_s` seconds has been made twice; whether it was the last of its row.
    pub fn made_twice(&mut self, dt_s: f64) -> bool {
        self.span_s += dt_s;
        let made = self.made.map_or(0, |made| made + 1);
        self.made = (made < STEPS).then_some(made);
        made == STEPS
    }

    /// The row has ended `apart_m` from the same in halves, by a rule of this order: those leave 2⁻ᵖ of the error (eq. 31).
    pub fn learn(&mut self, apart_m: f64, order: i32) {
        let error_m = apart_m / (1.0 - 0.5_f64.powi(order)) * DRIFT_S / self.span_s;
        if error_m.is_finite() {
            self.error_m = error_m;
        }
    }

    /// The object rests: how it came there no longer matters.
    pub fn rest(&mut self) {
        *self = Self::default();
    }

    /// What steps make wrong in [`DRIFT_S`], metres.
    pub fn error_m(&self) -> f64 {
        self.error_m
    }
}

/// Which of [`ROWS`] is an object's: neighbouring numbers have others.
fn row(whose: AgentId) -> u64 {
    (u64::from(whose.0.wrapping_mul(GOLDEN)) * ROWS) >> 32
}

/// The greatest distance of a point from its own in another state, metres.
pub fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_thousand_steps_a_twenty_fourth_is_made_again_in_halves() {
        let mut watch = Watch::default();
        let mut again = 0;
        for step in 0..960 {
            watch.begins(step, AgentId(0));
            if watch.is_on() {
                again += 2;
                if watch.made_twice(1e-3) {
                    watch.learn(1e-6, 1);
                }
            }
        }
        assert_eq!(again, 40); // 4.2 %
        // two steps of 1 ms end 1 µs apart: they err by 2 µs, a hundred by 100
        assert!((watch.error_m() - 1e-4).abs() < 1e-15);
        watch.learn(f64::NAN, 1);
        assert!((watch.error_m() - 1e-4).abs() < 1e-15);
        watch.rest();
        assert_eq!(watch.error_m(), 0.0);
    }
    #[test]
    fn alike_objects_take_turns_and_none_is_early() {
        // of so many objects of one rate, the most whose step is made again at once, and as many as are on average
        for (count, most) in [(1, 1), (10, 1), (24, 1), (48, 2), (96, 3), (1000, 22)] {
            let mut watches = vec![Watch::default(); count];
            let (mut first, mut busiest, mut again) = (u64::MAX, 0, 0);
            for step in 0..960 {
                let mut now = 0;
                for (watch, whose) in watches.iter_mut().zip((0..).map(AgentId)) {
                    watch.begins(step, whose);
                    if watch.is_on() {
                        now += 1;
                        watch.made_twice(1e-3);
                    }
                }
                first = if now > 0 { first.min(step) } else { first };
                (busiest, again) = (busiest.max(now), again + now);
            }
            assert!(busiest <= most, "{busiest} of {count}");
            // the last of them begins 94 steps later than the first, which is less than one row in ten
            assert!(first == FIRST && again <= 20 * count && again >= 18 * count, "{first}, {again} of {count}");
        }
    }
}
