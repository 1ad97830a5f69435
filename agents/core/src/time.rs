//! Simulated time: whole nanoseconds, so that sums of steps are exact.
//!
//! In: seconds or nanoseconds. Out: [`SimTime`] (a point) and [`SimSpan`] (a length).
//! Never here: wall time. That is a `std::time::Duration`, related to simulated time only in the runtime's pacing.

use std::ops::{Add, AddAssign, Sub};

/// A point of simulated time: nanoseconds since the scene began, `0..=u64::MAX` (584 years).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, serde::Serialize, serde::Deserialize)]
pub struct SimTime(u64);

/// A length of simulated time in nanoseconds, `0..=u64::MAX`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, serde::Serialize, serde::Deserialize)]
pub struct SimSpan(u64);

const NANOS_PER_SECOND: f64 = 1e9;

impl SimTime {
    /// The start of the scene.
    pub const ZERO: Self = Self(0);

    /// A point `nanos` nanoseconds after the start.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the start.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Seconds since the start; exact to the nanosecond below 104 days.
    #[must_use]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / NANOS_PER_SECOND
    }

    /// The span from `earlier` to this time; zero where `earlier` is later.
    #[must_use]
    pub const fn since(self, earlier: Self) -> SimSpan {
        SimSpan(self.0.saturating_sub(earlier.0))
    }

    /// Seconds from `other` to this time, negative where `other` is later.
    #[must_use]
    pub fn secs_after(self, other: Self) -> f64 {
        if self >= other { self.since(other).as_secs_f64() } else { -other.since(self).as_secs_f64() }
    }
}

impl SimSpan {
    /// The zero span. A step refuses it.
    pub const ZERO: Self = Self(0);

    /// So many seconds; the longest span that there is where they are more.
    #[must_use]
    pub const fn from_secs(seconds: u64) -> Self {
        Self(seconds.saturating_mul(1_000_000_000))
    }

    /// So many milliseconds; the longest span that there is where they are more.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// A span of `nanos` nanoseconds.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// The span nearest to `seconds`; `None` if that is negative, not finite or past 584 years.
    #[must_use]
    pub fn from_secs_f64(seconds: f64) -> Option<Self> {
        let nanos = (seconds * NANOS_PER_SECOND).round();
        (nanos >= 0.0 && nanos < u64::MAX as f64).then_some(Self(nanos as u64))
    }

    /// The length in nanoseconds.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The length in seconds.
    #[must_use]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / NANOS_PER_SECOND
    }
}

impl Add<SimSpan> for SimTime {
    type Output = Self;
    fn add(self, span: SimSpan) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

impl AddAssign<SimSpan> for SimTime {
    fn add_assign(&mut self, span: SimSpan) {
        *self = *self + span;
    }
}

impl Sub<SimSpan> for SimTime {
    type Output = Self;
    fn sub(self, span: SimSpan) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

impl Add for SimSpan {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl AddAssign for SimSpan {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for SimSpan {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_steps_of_a_millisecond_are_exactly_a_second() {
        let step = SimSpan::from_secs_f64(0.001).unwrap();
        let end = (0..1000).fold(SimTime::ZERO, |t, _| t + step);
        assert_eq!(end, SimTime::from_nanos(1_000_000_000));
    }

    #[test]
    fn whole_seconds_are_as_long_as_their_milliseconds() {
        assert_eq!(SimSpan::from_secs(3), SimSpan::from_millis(3000));
        assert_eq!(SimSpan::from_secs(u64::MAX), SimSpan::from_nanos(u64::MAX));
    }

    #[test]
    fn an_invalid_span_is_refused() {
        for bad in [-1.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(SimSpan::from_secs_f64(bad), None, "{bad}");
        }
    }

    #[test]
    fn the_distance_between_two_times_has_a_sign() {
        let (early, late) = (SimTime::from_nanos(1_000), SimTime::from_nanos(3_000));
        assert_eq!(late.secs_after(early), 2e-6);
        assert_eq!(early.secs_after(late), -2e-6);
    }
}
