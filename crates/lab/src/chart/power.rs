//! The power of one quantity with which another one grows or falls.
//!
//! In: pairs of numbers above zero. Out: an exponent. Never here: what was measured.

/// The exponent of the power law y ~ xᵖ closest to the points, by least squares in logarithms; pairs that are not finite and
/// above zero are left out; `None` for fewer than two different x.
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0 && (x + y).is_finite())
        .map(|(x, y)| (libm::log(*x), libm::log(*y)))
        .collect();
    let count = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let (along, across) =
        logs.iter().fold((0.0, 0.0), |sum, p| (sum.0 + (p.0 - x) * (p.0 - x), sum.1 + (p.0 - x) * (p.1 - y)));
    (logs.len() > 1 && along > 0.0).then(|| across / along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_law_is_found() {
        let found = exponent(&[(0.1, 0.03), (0.2, 0.12), (0.3, f64::NAN), (0.4, 0.48)]).unwrap();
        assert!((found - 2.0).abs() < 1e-12, "{found}"); // rounding of logarithms
        assert_eq!(exponent(&[(0.1, 0.03)]), None);
        assert_eq!(exponent(&[(0.1, 0.03), (0.1, 0.05)]), None);
    }
}
