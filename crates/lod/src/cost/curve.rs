//! A measured curve between its points: the time of a primitive by its area, the time of logic by the visible objects
//! (RH05, §4).
//!
//! In: measured points, in any order. Out: a time for any abscissa. Never here: a law; the curves are not straight.
//! Theory: `docs/theory/budget.md`, eq. 44 and 45.

use alloc::vec::Vec;

use super::fit::quantile;

/// Linear interpolation between the medians measured at each abscissa.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// The curve through points (abscissa, time), each ≥ 0, in any order; several at one abscissa are replaced by their median.
    ///
    /// `None` where no point is valid. Times never fall along the curve: more area or more objects take no less time, whatever the noise.
    #[must_use]
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let number = |x: f64| x.is_finite() && x >= 0.0;
        let mut all: Vec<_> = points.iter().copied().filter(|p| number(p.0) && number(p.1)).collect();
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut points: Vec<(f64, f64)> = Vec::new();
        for group in all.chunk_by(|a, b| a.0 == b.0) {
            let time = quantile(group.iter().map(|p| p.1), 0.5);
            points.push((group[0].0, points.last().map_or(time, |last| time.max(last.1))));
        }
        (!points.is_empty()).then_some(Self { points })
    }

    /// The time at `x`: linear between points, constant before the first, extrapolated with the last segment's slope past the last.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        between(&self.points, x)
    }

    /// The points, in ascending abscissa.
    #[must_use]
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }
}

/// The time at `x` on straight lines through points in ascending abscissa: constant before the first, extrapolated with the last segment's
/// slope past the last. 0 without a point.
#[must_use]
pub fn between(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|p| p.0 <= x);
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return 0.0 };
    if after == 0 || x.is_nan() {
        return first.1;
    }
    let to = if after < points.len() { after } else { after - 1 };
    if to == 0 {
        return last.1;
    }
    let (a, b) = (points[to - 1], points[to]);
    a.1 + (b.1 - a.1) / (b.0 - a.0) * (x - a.0)
}

/// The time of an instance of `primitives` equal primitives that cover `area` together, by the curve of one primitive (eq. 44).
#[must_use]
pub fn instance(curve: &Curve, primitives: u32, area: f64) -> f64 {
    let count = f64::from(primitives);
    if primitives == 0 { 0.0 } else { count * curve.at(area / count) }
}
