//! Work against precision: what of some points nothing else beats, and by which power errors fall.
//!
//! In: pairs of cost and error. Out: the Pareto front, a fitted order. Never here: what was measured.

/// Those points that no other is both cheaper and more accurate than, the cheapest first.
pub(super) fn front(points: impl IntoIterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut sorted: Vec<_> = points.into_iter().filter(|(cost, error)| cost.is_finite() && error.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut best = f64::INFINITY;
    sorted.retain(|(_, error)| {
        let better = *error < best;
        best = best.min(*error);
        better
    });
    sorted
}

/// The power by which errors fall with a size, by least squares in logarithms; none of fewer than two sizes.
pub(super) fn order(sizes_and_errors: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = sizes_and_errors
        .iter()
        .filter(|(size, error)| *size > 0.0 && *error > 0.0 && error.is_finite())
        .map(|(size, error)| (libm::log(*size), libm::log(*error)))
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
    fn the_front_leaves_out_what_is_beaten() {
        let points = [(3.0, 0.1), (1.0, 1.0), (2.0, 2.0), (4.0, f64::NAN), (5.0, 0.1), (6.0, 0.01)];
        assert_eq!(front(points), [(1.0, 1.0), (3.0, 0.1), (6.0, 0.01)]);
    }

    #[test]
    fn the_order_of_a_power_is_its_exponent() {
        let order = order(&[(0.1, 0.03), (0.2, 0.12), (0.4, 0.48)]).unwrap();
        assert!((order - 2.0).abs() < 1e-12, "{order}"); // rounding of logarithms
        assert_eq!(super::order(&[(0.1, 0.03)]), None);
    }
}
