//! Cost against number: total cost, cost each, the floor, and the power with which cost grows.
//!
//! In: a [`Growth`]. Out: an experiment whose cases are measured one at a time. Never here: what is counted.

use super::super::experiment::{Experiment, Finding};
use super::super::figure::{Axis, Colour, Figure, Layer, Mark, Panel, span};
use super::super::power::exponent;
use super::super::table::Table;
use super::super::timing::{calibration_us, pace_for_goals};
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
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Case {
    /// The kind.
    pub(super) case: String,
    /// The requested size.
    pub(super) size: u32,
}

/// The cost of a size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Cost {
    /// The actual number of the things counted.
    pub(super) count: f64,
    pub(super) us: f64,
    pub(super) floor_us: f64,
}

/// A case with its measurements.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in super::super) struct Row {
    pub(super) case: String,
    pub(super) size: u32,
    /// Empty, like the numbers after it, where the case could not be carried out.
    pub(super) count: Option<f64>,
    pub(super) us: Option<f64>,
    pub(super) floor_us: Option<f64>,
    /// The calibration measured right after it ([`calibration_us`]).
    pub(super) calibration_us: Option<f64>,
}

impl Row {
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
    type Case = Case;
    type Row = Row;
    const NAME: &'static str = G::NAME;
    const TITLE: &'static str = G::TITLE;
    const ALONE: bool = true;

    fn cases(quick: bool) -> Vec<Case> {
        G::cases(quick)
    }

    fn measure(case: &Case) -> Row {
        let cost = G::measure(case);
        let number = |of: fn(&Cost) -> f64| cost.as_ref().map(of).filter(|number| number.is_finite());
        let Case { case, size } = case.clone();
        let (count, us, floor_us) = (number(|c| c.count), number(|c| c.us), number(|c| c.floor_us));
        Row { case, size, count, us, floor_us, calibration_us: calibration_us() }
    }

    fn case_of(row: &Row) -> Case {
        Case { case: row.case.clone(), size: row.size }
    }

    fn figure(rows: &[Row]) -> Figure {
        Figure { title: G::TITLE.to_owned(), panels: vec![whole::<G>(rows), each::<G>(rows)], columns: 2 }
    }

    fn table(rows: &[Row]) -> Table {
        let columns = ["case", "size", G::COUNTED, "us", "ns each", "floor ns each", "times the floor", "exponent"];
        let mut table = Table::new(&columns);
        for row in rows {
            let (count, us) = row.point();
            let floor_us = row.floor().1;
            table.rows.push(vec![
                row.case.as_str().into(),
                (f64::from(row.size), 0).into(),
                (count, 0).into(),
                (us, 2).into(),
                (row.ns_each(), 1).into(),
                (floor_us * 1e3 / count, 1).into(),
                (row.times_floor(), 2).into(),
                (power(rows, &row.case, ANY_COUNT), 3).into(),
            ]);
        }
        table
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        G::findings(rows)
    }
}

/// The power of the count with which the cost of a case grows, over a range of counts.
pub(super) fn power(rows: &[Row], case: &str, counts: RangeInclusive<f64>) -> f64 {
    let inside = |row: &&Row| row.case == case && row.count.is_some_and(|n| counts.contains(&n));
    let points: Vec<_> = rows.iter().filter(inside).map(Row::point).collect();
    exponent(&points).unwrap_or(f64::NAN)
}

/// The distinct cases, in the order of the rows.
fn names(rows: &[Row]) -> Vec<&str> {
    let mut list: Vec<&str> = rows.iter().map(|row| row.case.as_str()).collect();
    list.dedup();
    list
}

/// Cost against count, the floor as a dashed line, other engines as dots.
fn whole<G: Growth>(rows: &[Row]) -> Panel {
    let of = |case: &str, y: fn(&Row) -> (f64, f64)| rows.iter().filter(|r| r.case == case).map(y).collect::<Vec<_>>();
    let mut layers = Vec::new();
    let peers = G::peers();
    let mut engines: Vec<&str> = peers.iter().map(|peer| peer.0.as_str()).collect();
    engines.dedup();
    for (k, engine) in engines.iter().enumerate() {
        let points = peers.iter().filter(|peer| peer.0 == *engine).map(|peer| (peer.1, peer.2)).collect();
        let colour = Colour::behind(k);
        layers.push(Layer { label: (*engine).to_owned(), colour, mark: Mark::Dots(points) });
    }
    for (case, colour) in names(rows).into_iter().zip(Colour::LINES) {
        let label = format!("{case}: ^{:.2}", power(rows, case, ANY_COUNT));
        layers.push(Layer { label, colour, mark: Mark::Line(of(case, Row::point)) });
        layers.push(Layer { label: String::new(), colour, mark: Mark::Dashed(of(case, Row::floor)) });
    }
    layers.push(Layer { label: G::FLOOR.to_owned(), colour: Colour::Grey, mark: Mark::Dashed(Vec::new()) });
    let all = || rows.iter().flat_map(|row| [row.point(), row.floor()]).chain(peers.iter().map(|p| (p.1, p.2)));
    let ((left, right), (low, high)) = (span(all().map(|p| p.0), true), span(all().map(|p| p.1), true));
    let (x, y) = (Axis::log(G::COUNTED, left, right), Axis::log(G::COST, low, high));
    Panel { title: "total".to_owned(), x, y, layers }
}

/// Cost of each item against count.
fn each<G: Growth>(rows: &[Row]) -> Panel {
    let of = |case: &str| rows.iter().filter(|r| r.case == case).map(|r| (r.point().0, r.ns_each())).collect();
    let lines = names(rows).into_iter().zip(Colour::LINES);
    let layers = lines.map(|(case, colour)| Layer { label: String::new(), colour, mark: Mark::Line(of(case)) });
    let ((left, right), (low, high)) =
        (span(rows.iter().map(|r| r.point().0), true), span(rows.iter().map(Row::ns_each), true));
    let (x, y) = (Axis::log(G::COUNTED, left, right), Axis::log("ns each", low, high));
    Panel { title: "per item".to_owned(), x, y, layers: layers.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_is_fitted_between_two_counts() {
        let row = |size: u32, us: f64| Row {
            case: "a".to_owned(),
            size,
            count: Some(f64::from(size)),
            us: Some(us),
            floor_us: Some(1.0),
            calibration_us: None,
        };
        // a fixed cost below 100, proportional from there on
        let rows = [row(1, 50.0), row(10, 50.0), row(100, 100.0), row(1000, 1000.0)];
        assert!((power(&rows, "a", 100.0..=1000.0) - 1.0).abs() < 1e-12);
        assert!(power(&rows, "a", 0.0..=1e9) < 0.7 && power(&rows, "b", 0.0..=1e9).is_nan());
    }
}
