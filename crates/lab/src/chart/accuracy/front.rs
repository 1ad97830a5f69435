//! Work against precision: the Pareto front of some points.
//!
//! In: pairs of cost and error. Out: the Pareto front. Never here: what was measured.

/// The points for which no other is both cheaper and more accurate, the cheapest first.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_leaves_out_what_is_beaten() {
        let points = [(3.0, 0.1), (1.0, 1.0), (2.0, 2.0), (4.0, f64::NAN), (5.0, 0.1), (6.0, 0.01)];
        assert_eq!(front(points), [(1.0, 1.0), (3.0, 0.1), (6.0, 0.01)]);
    }
}
