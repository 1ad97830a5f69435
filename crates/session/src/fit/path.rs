//! The path of a point over time, and the distance between two paths.
//!
//! In: samples at any times. Out: distances at the times of one of them. Never here: the moving object.

use glam::DVec3;

/// The path of one point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Path {
    /// Times, seconds, ascending, and positions, metres.
    pub samples: Vec<(f64, DVec3)>,
}

impl Path {
    /// The position at a time, linear between samples; `None` before the first and after the last.
    #[must_use]
    pub fn at(&self, time_s: f64) -> Option<DVec3> {
        let after = self.samples.partition_point(|(t, _)| *t < time_s);
        let &(t1, x1) = self.samples.get(after)?;
        if t1 == time_s {
            return Some(x1);
        }
        let &(t0, x0) = self.samples.get(after.checked_sub(1)?)?;
        Some(x0.lerp(x1, (time_s - t0) / (t1 - t0)))
    }

    /// The greatest distance from `other` at the same times, metres; infinite if the two share no time.
    #[must_use]
    pub fn farthest_m(&self, other: &Self) -> f64 {
        let apart = self.samples.iter().filter_map(|(t, x)| other.at(*t).map(|y| x.distance(y)));
        apart.reduce(f64::max).unwrap_or(f64::INFINITY)
    }

    /// The greatest distance from the starting position, metres.
    #[must_use]
    pub fn extent_m(&self) -> f64 {
        let start = self.samples.first().map_or(DVec3::ZERO, |(_, x)| *x);
        self.samples.iter().map(|(_, x)| x.distance(start)).fold(0.0, f64::max)
    }

    /// The greatest distance from the parabola of gravity through its first two samples, metres; infinite with fewer than three.
    #[must_use]
    pub fn from_flight_m(&self, gravity: DVec3) -> f64 {
        let [(t0, x0), (t1, x1), rest @ ..] = self.samples.as_slice() else { return f64::INFINITY };
        if rest.is_empty() {
            return f64::INFINITY;
        }
        let span = t1 - t0;
        let velocity = (*x1 - *x0) / span - gravity * (0.5 * span);
        let flown = |t: f64| *x0 + velocity * (t - t0) + gravity * (0.5 * (t - t0) * (t - t0));
        rest.iter().map(|(t, x)| x.distance(flown(*t))).fold(0.0, f64::max)
    }
}

/// The greatest distance of any of `paths` from its counterpart in `others`, metres.
#[must_use]
pub fn farthest_m(paths: &[Path], others: &[Path]) -> f64 {
    paths.iter().zip(others).map(|(path, other)| path.farthest_m(other)).fold(0.0, f64::max)
}
