//! An integer level from a real number, with hysteresis: no chatter when the number fluctuates about an integer.
//!
//! In: ρ. Out: ⌊ρ⌋, held until ρ, or its mean, is half a level past an edge. Never here: where ρ comes from.
//! Theory: `docs/theory/control.md`, eq. 15.

/// How far past an edge ρ must be, in levels. Two switches of the same edge are a level apart, a factor 2 of polygons.
pub const BAND: f64 = 0.5;

/// The level for `rho` when `held` is the present one: `held` as long as held − ½ ≤ ρ < held + 1½, otherwise ⌊ρ⌋.
///
/// With no level held, ⌊ρ⌋. The result is inside `0..=255`; a NaN keeps the level, or gives 0.
#[must_use]
pub fn floor(held: Option<u8>, rho: f64) -> u8 {
    held_within(held, rho, BAND)
}

fn held_within(held: Option<u8>, rho: f64, band: f64) -> u8 {
    match held {
        Some(n) if rho.is_nan() || (f64::from(n) - band <= rho && rho < f64::from(n) + 1.0 + band) => n,
        _ => libm::floor(rho) as u8, // a cast of floats saturates, and takes NaN to 0
    }
}

/// A level that goes by the mean of ρ, with a band as wide as ρ scatters: a machine that wanders moves ρ to and fro, and not the level.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeanLevel {
    held: Option<u8>,
    mean: f64,
    variance: f64,
    /// Values that the mean is of.
    count: f64,
}

impl MeanLevel {
    /// The level after one value more, where the mean is of the last `memory` values, ≥ 1: held until the mean is past an edge by half a level, and
    /// by the standard deviation of ρ. A ρ that is not finite leaves the level.
    pub fn floor(&mut self, rho: f64, memory: f64) -> u8 {
        if rho.is_finite() {
            self.count = (self.count + 1.0).min(memory.max(1.0));
            let (off, part) = (rho - self.mean, 1.0 / self.count);
            self.mean += part * off;
            self.variance = (1.0 - part) * (self.variance + part * off * off);
        }
        let n = held_within(self.held, self.mean, BAND.max(libm::sqrt(self.variance)));
        self.held = Some(n);
        n
    }

    /// Holds another level from now on.
    pub fn set(&mut self, n: u8) {
        self.held = Some(n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_fluctuates_about_an_edge_switches_once() {
        let mut held = Some(2);
        let mut switches = 0;
        for k in 0..1000 {
            // slowly from 2.9 to 3.9, with an alternating ± 0.2 < BAND
            let rho = 2.9 + 0.001 * f64::from(k) + if k % 2 == 0 { 0.2 } else { -0.2 };
            let n = floor(held, rho);
            switches += u32::from(held != Some(n));
            held = Some(n);
        }
        assert_eq!((held, switches), (Some(3), 1));
    }

    #[test]
    fn a_level_changes_half_a_level_past_its_edges() {
        assert_eq!(floor(Some(3), 4.499), 3);
        assert_eq!(floor(Some(3), 4.5), 4);
        assert_eq!(floor(Some(3), 2.5), 3);
        assert_eq!(floor(Some(3), 2.499), 2);
    }

    #[test]
    fn a_level_by_the_mean_stays_where_the_number_swings_over_two_levels_and_follows_where_it_has_moved() {
        let (mut level, mut last, mut switches) = (MeanLevel::default(), None, 0);
        let mut play = |centre: f64, frames: u32| {
            for k in 0..frames {
                let n = level.floor(centre + libm::sin(0.1 * f64::from(k)), 120.0);
                switches += u32::from(last.is_some_and(|last| last != n));
                last = Some(n);
            }
            (last, switches)
        };
        // the first values are a mean of few
        let first = play(2.95, 600);
        assert!(first.1 <= 1, "{first:?}");
        assert_eq!(play(2.95, 600), first);
        // three levels farther it is there after a time or two of its memory, by one switch or two on the way
        let (last, switches) = play(5.95, 600);
        assert!(last == Some(5) && switches <= first.1 + 2, "{last:?} {switches}");
        let mut level = MeanLevel::default();
        assert_eq!([3.2, f64::NAN, f64::INFINITY].map(|rho| level.floor(rho, 120.0)), [3, 3, 3]);
    }

    #[test]
    fn an_invalid_number_keeps_the_level() {
        assert_eq!(floor(Some(4), f64::NAN), 4);
        assert_eq!(floor(None, f64::NAN), 0);
        assert_eq!(floor(Some(4), f64::NEG_INFINITY), 0);
        assert_eq!(floor(None, f64::INFINITY), 255);
    }
}
