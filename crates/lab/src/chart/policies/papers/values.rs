//! Shares that the value functions of (RH05) give to near and far trees, side by side (fig. 1).

use crate::chart::policies::numeric::{CameraPath, Fault, Forms, Policy, chooser, forest, mean};
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Named, Panel, Table, claims, number_of, table,
};
use metachron_lod::cost::value::Value;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct Values;

const VALUES: [Named<Value>; 5] = [
    Named("a/√z (eq. 8)", Value::Gentle),
    Named("a/z (eq. 9)", Value::Plain),
    Named("a/z² (eq. 10)", Value::Steep),
    Named("√(a/d²) (eq. 11)", Value::Focus),
    Named("√a/d² (eq. 11)", Value::FocusSteep),
];
const TARGET: f64 = 50e3;
/// The frame that is measured: the middle of the path.
const FRAME: usize = 1;
const FRAMES: usize = 2;
/// Depth limits of near and of far trees, metres.
const NEAR_FAR_M: [f64; 2] = [60.0, 180.0];

/// A value function.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    value: Named<Value>,
}

/// The result of a value function.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Mean share of its triangles that a tree is drawn with: near, between, far.
    near: f64,
    between: f64,
    far: f64,
    /// Time of the frame, as a part of T.
    spent: f64,
}

/// Depth in metres and drawn part of everything in view, and the time of the frame as a part of T.
fn drawn(value: Value) -> (Vec<(f64, f64)>, f64) {
    let mut show = forest::show(600, CameraPath::Linear, TARGET, Forms::Whole, FRAMES);
    show.fault = Fault { wander: 0.0, tremble: 0.0, ..Fault::NONE };
    let mut parts = Vec::new();
    let frames = show.watch(Policy::RobinHood(value), 1, &mut |frame, seen, choice| {
        if frame == FRAME {
            let of = |p: &chooser::Pick| if p.level.is_some() { p.part } else { 0.0 };
            parts.extend(seen.iter().zip(&choice.picks).map(|(s, p)| (s.depth_m, of(p))));
        }
    });
    (parts, frames[FRAME].time)
}

type Row = Measured<Case, Found>;

impl Experiment for Values {
    type Row = Row;
    const NAME: &'static str = "values";
    const TITLE: &'static str = "Robin Hood's value functions: detail of near and far trees";
    const TABLE: fn(&[Row]) -> Table = table!(|r| value: r.case.value, near(3): r.near, between(3): r.between,
        far(3): r.far, spent(3): r.spent);

    fn cases(_: bool) -> Vec<Case> {
        VALUES.map(|value| Case { value }).to_vec()
    }

    fn measure(case: &Case) -> Option<Found> {
        let (parts, spent) = drawn(case.value.1);
        let between = |from: f64, to: f64| {
            let here = parts.iter().filter(|(depth, _)| (from..to).contains(depth)).map(|(_, part)| *part);
            mean(&here.collect::<Vec<_>>())
        };
        let [near, far] = NEAR_FAR_M;
        let (near, between, far) = (between(0.0, near), between(near, far), between(far, f64::INFINITY));
        Some(Found { near, between, far, spent })
    }

    fn figure(_: &[Row]) -> Figure {
        let panel = |Named(name, value): Named<Value>| {
            let (x, y) = (Axis::linear("depth, m", 0.0, 320.0), Axis::linear("fraction of its triangles", 0.0, 1.05));
            Panel::new(name, x, y, [Layer::dots("", Colour::Blue, drawn(value).0)])
        };
        Figure::new("One frame of 50 ms by each value function (RH05, fig. 1)", 3, VALUES.map(panel).to_vec())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |k: usize, what: fn(&Row) -> f64| number_of(rows, |r| r.case.value == VALUES[k], what);
        claims![
            "near trees get more triangles by a/z² than by a/√z" => of(2, |r| r.near) - of(0, |r| r.near), at_least 0.0;
            "far trees get fewer triangles by a/z² than by a/√z" => of(0, |r| r.far) - of(2, |r| r.far), at_least 0.0;
        ]
    }
}
