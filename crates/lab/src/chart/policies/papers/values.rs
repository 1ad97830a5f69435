//! Shares that the value functions of (RH05) give to near and far trees, side by side (fig. 1).

use crate::chart::policies::numeric::chooser;
use crate::chart::policies::numeric::chooser::Policy;
use crate::chart::policies::numeric::forest;
use crate::chart::policies::numeric::forest::{CameraPath, Forms};
use crate::chart::policies::numeric::machine::Fault;
use crate::chart::policies::numeric::metrics::mean;
use crate::chart::{Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Panel};
use metachron_lod::cost::value::Value;
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct Values;

const VALUES: [(&str, Value); 5] = [
    ("a/√z (eq. 8)", Value::Gentle),
    ("a/z (eq. 9)", Value::Plain),
    ("a/z² (eq. 10)", Value::Steep),
    ("√(a/d²) (eq. 11)", Value::Focus),
    ("√a/d² (eq. 11)", Value::FocusSteep),
];
const TARGET: f64 = 50e3;
/// The frame that is measured: the middle of the path.
const FRAME: usize = 1;
const FRAMES: usize = 2;
/// Depth limits of near and of far trees, metres.
const NEAR_FAR_M: [f64; 2] = [60.0, 180.0];

/// A value function.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Case {
    value: String,
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
    const COLUMNS: &'static str = "value, near.3, between.3, far.3, spent.3";

    fn cases(_: bool) -> Vec<Case> {
        VALUES.map(|v| Case { value: v.0.to_owned() }).to_vec()
    }

    fn measure(case: &Case) -> Row {
        let value = VALUES.iter().find(|v| v.0 == case.value).map_or(Value::Gentle, |v| v.1);
        let (parts, spent) = drawn(value);
        let between = |from: f64, to: f64| {
            let here = parts.iter().filter(|(depth, _)| (from..to).contains(depth)).map(|(_, part)| *part);
            mean(&here.collect::<Vec<_>>())
        };
        let [near, far] = NEAR_FAR_M;
        let (near, between, far) = (between(0.0, near), between(near, far), between(far, f64::INFINITY));
        Row { case: case.clone(), found: Found { near, between, far, spent } }
    }

    fn figure(_: &[Row]) -> Figure {
        let panel = |(name, value): &(&str, Value)| {
            let (x, y) = (Axis::linear("depth, m", 0.0, 320.0), Axis::linear("fraction of its triangles", 0.0, 1.05));
            Panel::new(*name, x, y, [Layer::dots("", Colour::Blue, drawn(*value).0)])
        };
        Figure::new("One frame of 50 ms by each value function (RH05, fig. 1)", 3, VALUES.iter().map(panel).collect())
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of =
            |k: usize, what: fn(&Row) -> f64| rows.iter().find(|r| r.case.value == VALUES[k].0).map_or(f64::NAN, what);
        vec![
            Finding::at_least(
                "near trees get more triangles by a/z² than by a/√z",
                of(2, |r| r.near) - of(0, |r| r.near),
                0.0,
            ),
            Finding::at_least(
                "far trees get fewer triangles by a/z² than by a/√z",
                of(0, |r| r.far) - of(2, |r| r.far),
                0.0,
            ),
        ]
    }
}
