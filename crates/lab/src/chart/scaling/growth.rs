//! Cost against number: total cost, cost each, the floor, and the power with which cost grows.
//!
//! In: a [`Growth`]. Out: an experiment whose cases are measured one at a time. Never here: what is counted.

use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, LiveColumns, Measured, Panel, Table, calibration_us, distinct,
    each, exponent, lines, pace_for_goals, table,
};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::ops::RangeInclusive;

/// Every count.
const ANY_COUNT: RangeInclusive<f64> = 0.0..=f64::INFINITY;

/// A measurement of how cost grows with a number.
pub(in super::super) trait Growth: Send + Sync + 'static {
    /// As [`Experiment::NAME`].
    const NAME: &'static str;
    /// As [`Experiment::TITLE`].
    const TITLE: &'static str;
    /// Label of the axis of counts.
    const COUNTED: &'static str;
    /// Label of the cost axis.
    const COST: &'static str;
    /// Label of the floor.
    const FLOOR: &'static str;

    /// The cases in the order of the rows.
    fn cases(quick: bool) -> Vec<Case>;

    /// Measures a case; `None` where it could not be carried out.
    fn measure(case: &Case) -> Option<Cost>;

    /// The claims and their measured values.
    fn findings(rows: &[Row]) -> Vec<Finding>;

    /// Points of other engines on the same axes: name, count, microseconds.
    fn peers() -> Vec<(String, f64, f64)> {
        Vec::new()
    }
}

/// One size of one kind.
#[derive(Debug, Clone, Serialize)]
pub(in super::super) struct Case {
    /// The kind.
    pub(super) case: &'static str,
    /// The requested size.
    pub(super) size: u32,
}

impl Case {
    /// Every kind in every size.
    pub(super) fn of(kinds: impl IntoIterator<Item = &'static str>, sizes: &[u32]) -> Vec<Self> {
        each!(case in kinds, &size in sizes => Self { case, size })
    }
}

/// The cost of a size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Cost {
    /// The actual number of the things counted.
    pub(super) count: f64,
    pub(super) us: f64,
    pub(super) floor_us: f64,
}

/// The measurements of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Found {
    /// Empty, like the numbers after it, where the case could not be carried out.
    pub(super) count: Option<f64>,
    pub(super) us: Option<f64>,
    pub(super) floor_us: Option<f64>,
    /// The calibration measured right after it ([`calibration_us`]).
    pub(super) calibration_us: Option<f64>,
}

pub(in super::super) type Row = Measured<Case, Found>;

impl Found {
    /// Count and microseconds; NaN where there are none.
    pub(super) fn point(&self) -> (f64, f64) {
        (self.count.unwrap_or(f64::NAN), self.us.unwrap_or(f64::NAN))
    }

    fn floor(&self) -> (f64, f64) {
        (self.count.unwrap_or(f64::NAN), self.floor_us.unwrap_or(f64::NAN))
    }

    /// Ratio of the cost to the floor.
    pub(super) fn times_floor(&self) -> f64 {
        self.point().1 / self.floor().1
    }

    /// Nanoseconds each.
    pub(super) fn ns_each(&self) -> f64 {
        let (count, us) = self.point();
        us * 1e3 / count
    }
}

/// Factor that scales times to the machine for which goals were set.
pub(super) fn pace(rows: &[Row]) -> f64 {
    pace_for_goals(rows.iter().map(|row| row.calibration_us))
}

/// The diagram of a [`Growth`].
pub(in super::super) struct Scaling<G>(PhantomData<G>);

impl<G: Growth> Experiment for Scaling<G> {
    type Row = Row;
    const NAME: &'static str = G::NAME;
    const TITLE: &'static str = G::TITLE;
    const ALONE: bool = true;
    const LIVE: LiveColumns = LiveColumns::These(&["us", "ns each", "floor ns each", "times the floor", "exponent"]);
    const TABLE: fn(&[Row]) -> Table = |rows| {
        let mut table = table!(rows, |row| case: row.case.case, size: row.case.size, count: row.count, us(2): row.us,
            "ns each"(1): row.ns_each(), "floor ns each"(1): row.floor().1 * 1e3 / row.floor().0,
            "times the floor"(2): row.times_floor(), exponent(3): power(rows, row.case.case, ANY_COUNT));
        G::COUNTED.clone_into(&mut table.columns[2]);
        table
    };

    fn cases(quick: bool) -> Vec<Case> {
        G::cases(quick)
    }

    fn measure(case: &Case) -> Option<Found> {
        let cost = G::measure(case);
        let number = |of: fn(&Cost) -> f64| cost.as_ref().map(of).filter(|number| number.is_finite());
        let (count, us, floor_us) = (number(|c| c.count), number(|c| c.us), number(|c| c.floor_us));
        Some(Found { count, us, floor_us, calibration_us: calibration_us() })
    }

    fn figure(rows: &[Row]) -> Figure {
        Figure::new(G::TITLE, 2, vec![whole::<G>(rows), each::<G>(rows)])
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        G::findings(rows)
    }
}

/// The power of the count with which the cost of a case grows, over a range of counts.
pub(super) fn power(rows: &[Row], case: &str, counts: RangeInclusive<f64>) -> f64 {
    let inside = |row: &&Row| row.case.case == case && row.count.is_some_and(|n| counts.contains(&n));
    let points: Vec<_> = rows.iter().filter(inside).map(|row| row.point()).collect();
    exponent(&points).unwrap_or(f64::NAN)
}

/// Cost against count, the floor as a dashed line, other engines as dots.
fn whole<G: Growth>(rows: &[Row]) -> Panel {
    let of = |case: &'_ str, y: fn(&Found) -> (f64, f64)| -> Vec<_> {
        rows.iter().filter(|r| r.case.case == case).map(|r| y(r)).collect()
    };
    let mut layers = Vec::new();
    let peers = G::peers();
    for (k, engine) in distinct(peers.iter().map(|peer| peer.0.as_str())).into_iter().enumerate() {
        let points = peers.iter().filter(|peer| peer.0 == engine).map(|peer| (peer.1, peer.2));
        layers.push(Layer::dots(engine, Colour::behind(k), points));
    }
    for (case, colour) in distinct(rows.iter().map(|row| row.case.case)).into_iter().zip(Colour::LINES) {
        let label = format!("{case}: ^{:.2}", power(rows, case, ANY_COUNT));
        layers.push(Layer::line(label, colour, of(case, Found::point)));
        layers.push(Layer::dashed("", colour, of(case, Found::floor)));
    }
    layers.push(Layer::dashed(G::FLOOR, Colour::Grey, []));
    Panel::new("total", Axis::log_fit(G::COUNTED), Axis::log_fit(G::COST), layers)
}

/// Cost of each item against count.
fn each<G: Growth>(rows: &[Row]) -> Panel {
    let of = |case| rows.iter().filter(move |r| r.case.case == case).map(|r| (r.point().0, r.ns_each()));
    let layers =
        lines(distinct(rows.iter().map(|row| row.case.case)), of).map(|line| Layer { label: String::new(), ..line });
    Panel::new("per item", Axis::log_fit(G::COUNTED), Axis::log_fit("ns each"), layers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_is_fitted_between_two_counts() {
        let row = |size: u32, us: f64| Row {
            case: Case { case: "a", size },
            found: Found { count: Some(f64::from(size)), us: Some(us), floor_us: Some(1.0), calibration_us: None },
        };
        // a fixed cost below 100, proportional from there on
        let rows = [row(1, 50.0), row(10, 50.0), row(100, 100.0), row(1000, 1000.0)];
        assert!((power(&rows, "a", 100.0..=1000.0) - 1.0).abs() < 1e-12);
        assert!(power(&rows, "a", 0.0..=1e9) < 0.7 && power(&rows, "b", 0.0..=1e9).is_nan());
    }
}
