//! A robust straight line through points with outliers, with a confidence interval of its slope.
//!
//! In: points. Out: intercept and slope by the median of all pairwise slopes (SEN68). Never here: the meaning of the points.

/// y = intercept + slope · x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// y at x = 0.
    pub intercept: f64,
    /// dy/dx.
    pub slope: f64,
    /// The 95 % confidence interval of the slope.
    pub slope_95: (f64, f64),
    /// Typical distance of a point from the line, relative to the line's own value: 1.4826 times the median.
    pub scatter: f64,
}

/// More points than this are thinned: the number of pairs grows with their square.
const POINTS_MAX: usize = 600;
/// Least number of points for a line.
const POINTS_MIN: usize = 8;
/// Standard deviations of a normal distribution that contain 95 % of it.
const Z_95: f64 = 1.96;

impl Line {
    /// Fits a line to at least eight finite points that do not all share one x; else `None`.
    #[must_use]
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let points: Vec<_> = points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        let stride = points.len().div_ceil(POINTS_MAX).max(1);
        let points: Vec<_> = points.into_iter().step_by(stride).collect();
        if points.len() < POINTS_MIN {
            return None;
        }
        let mut slopes = pairwise_slopes(&points);
        if slopes.is_empty() {
            return None;
        }
        slopes.sort_unstable_by(f64::total_cmp);
        let slope = middle(&slopes);
        let mut offsets: Vec<_> = points.iter().map(|(x, y)| y - slope * x).collect();
        offsets.sort_unstable_by(f64::total_cmp);
        let intercept = middle(&offsets);
        let line = Self { intercept, slope, slope_95: interval(&slopes, points.len()), scatter: 0.0 };
        Some(Self { scatter: line.scatter_of(&points), ..line })
    }

    /// The line's value at `x`.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }

    /// The x at which the line is `y`.
    #[must_use]
    pub fn x_of(&self, y: f64) -> f64 {
        (y - self.intercept) / self.slope
    }

    fn scatter_of(&self, points: &[(f64, f64)]) -> f64 {
        let mut errors: Vec<_> = points.iter().map(|&(x, y)| (y / self.at(x) - 1.0).abs()).collect();
        errors.sort_unstable_by(f64::total_cmp);
        1.4826 * middle(&errors)
    }
}

fn pairwise_slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let mut slopes = Vec::with_capacity(points.len() * points.len() / 2);
    for (i, (x, y)) in points.iter().enumerate() {
        slopes.extend(points[..i].iter().filter(|(u, _)| u != x).map(|(u, v)| (y - v) / (x - u)));
    }
    slopes
}

/// Sen's interval from Kendall's variance of the number of rising pairs.
fn interval(slopes: &[f64], points: usize) -> (f64, f64) {
    let n = points as f64;
    let half = 0.5 * Z_95 * (n * (n - 1.0) * (2.0 * n + 5.0) / 18.0).sqrt();
    let centre = 0.5 * slopes.len() as f64;
    let at = |place: f64| slopes[(place.max(0.0) as usize).min(slopes.len() - 1)];
    (at(centre - half), at(centre + half))
}

/// The median of a non-empty sorted list.
fn middle(sorted: &[f64]) -> f64 {
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[half] } else { 0.5 * (sorted[half - 1] + sorted[half]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers in −0.5 … 0.5, identical on every machine.
    fn noise(k: u64) -> f64 {
        (k.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(17).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64
            / 2f64.powi(53)
            - 0.5
    }

    #[test]
    fn a_line_is_fitted_despite_noise_and_outliers() {
        let point = |k: u64| {
            let x = k as f64;
            let wild = if k % 10 == 3 { 50.0 } else { 0.0 };
            (x, 7.0 + 0.25 * x + 0.2 * noise(k) + wild)
        };
        let line = Line::through(&(0..200).map(point).collect::<Vec<_>>()).unwrap();
        assert!((line.slope - 0.25).abs() < 2e-3 && (line.intercept - 7.0).abs() < 0.2, "{line:?}");
        assert!(
            line.slope_95.0 < 0.25 && line.slope_95.1 > 0.25 && line.slope_95.1 - line.slope_95.0 < 0.01,
            "{line:?}"
        );
    }

    #[test]
    fn the_interval_contains_the_true_slope_nineteen_times_in_twenty() {
        let contains = |run: u64| {
            let point = |k: u64| (k as f64, 1.0 + 0.01 * k as f64 + noise(1000 * run + k));
            let line = Line::through(&(0..60).map(point).collect::<Vec<_>>()).unwrap();
            line.slope_95.0 <= 0.01 && 0.01 <= line.slope_95.1
        };
        let kept = (1..=200).filter(|&run| contains(run)).count();
        assert!((180..=200).contains(&kept), "{kept} of 200");
    }

    #[test]
    fn points_without_a_line_give_none() {
        assert!(Line::through(&[(1.0, 2.0); 3]).is_none(), "too few");
        assert!(Line::through(&[(1.0, 2.0); 20]).is_none(), "one x");
        assert!(Line::through(&[(f64::NAN, 2.0); 20]).is_none());
    }
}
