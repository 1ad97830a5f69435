//! Shared parts of the policy experiments: a case, the printed columns, the curves of frame times.

use super::chooser::Policy;
use super::closed_loop::Show;
use super::metrics::Row;
use crate::chart::experiment::Finding;
use crate::chart::figure::{Axis, Colour, Figure, Layer, Mark, Panel};
use crate::chart::table::Table;

/// Polygons of each of an object's five levels, as fractions of the polygons at full detail.
pub(crate) const LEVEL_PARTS: [f64; 5] = [0.02, 0.06, 0.18, 0.45, 1.0];

/// A setting and a policy.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Case {
    pub(crate) setting: String,
    pub(crate) policy: String,
    /// Frames of all runs together, each run with a machine of another seed.
    pub(crate) frames: usize,
}

impl Case {
    /// A case of some runs.
    pub(crate) fn new(setting: &str, policy: Policy, seeds: usize, frames: usize) -> Self {
        Self { setting: setting.to_owned(), policy: policy.name().to_owned(), frames: seeds * frames }
    }

    /// The case of a row.
    pub(crate) fn of(row: &Row) -> Self {
        Self { setting: row.setting.clone(), policy: row.policy.clone(), frames: row.frames }
    }

    /// The policy of `policies` that the case names; the last one where it names none of them.
    pub(crate) fn policy_of(&self, policies: &[Policy]) -> Policy {
        let named = policies.iter().find(|p| p.name() == self.policy);
        *named.or(policies.last()).unwrap_or(&Policy::Full)
    }

    /// Plays the show once per seed; returns the row of all frames.
    pub(crate) fn measure(&self, show: &Show, policies: &[Policy]) -> Row {
        let (policy, seeds) = (self.policy_of(policies), self.frames / show.frames.max(1));
        let runs: Vec<_> = (1..=seeds as u64).map(|seed| show.play(policy, seed)).collect();
        Row::of(&self.setting, &self.policy, &runs)
    }
}

/// The table of the columns in which policies differ.
pub(crate) fn table(rows: &[Row]) -> Table {
    let mut table = Table::new(&[
        "setting",
        "policy",
        "mean",
        "max",
        "stddev",
        "binding",
        "b_stddev",
        "avg_err",
        "miss",
        "model",
        "value",
        "proven",
        "changes",
        "reversals",
        "holes",
    ]);
    table.rows.extend(rows.iter().map(|r| {
        vec![
            r.setting.clone().into(),
            r.policy.clone().into(),
            (r.mean, 3).into(),
            (r.max, 3).into(),
            (r.stddev, 4).into(),
            (r.binding, 2).into(),
            (r.binding_stddev, 4).into(),
            (r.avg_err, 4).into(),
            (r.misses, 4).into(),
            (r.model_error, 4).into(),
            (r.value_over_bound, 4).into(),
            (r.certified, 3).into(),
            (r.changes, 4).into(),
            (r.reversals, 5).into(),
            (r.holes, 4).into(),
        ]
    }));
    table
}

/// A number of the row of a setting and a policy; NaN where there is no such row.
pub(crate) fn number(rows: &[Row], setting: &str, policy: &str, of: fn(&Row) -> f64) -> f64 {
    rows.iter().find(|r| r.setting == setting && r.policy == policy).map_or(f64::NAN, of)
}

/// A claim that something is at least `limit`.
pub(crate) fn at_least(claim: impl Into<String>, measured: f64, limit: f64) -> Finding {
    Finding { claim: claim.into(), measured, limit, holds: Some(measured >= limit) }
}

/// The time of every frame under some policies, next to the target.
pub(crate) fn curves(title: &str, show: &Show, policies: &[Policy], greatest: f64) -> Panel {
    let line = |p: &Policy| {
        let times = show.play(*p, 1);
        Mark::Line(times.iter().enumerate().map(|(k, f)| (k as f64, f.time)).collect())
    };
    let mut layers = vec![Layer {
        label: "target".to_owned(),
        colour: Colour::Grey,
        mark: Mark::Dashed(vec![(0.0, 1.0), (show.frames as f64, 1.0)]),
    }];
    let drawn = policies.iter().zip(Colour::LINES.into_iter().cycle());
    layers.extend(drawn.map(|(p, colour)| Layer { label: p.name().to_owned(), colour, mark: line(p) }));
    let (x, y) =
        (Axis::linear("frame", 0.0, show.frames as f64), Axis::linear("time of a frame / target", 0.0, greatest));
    Panel { title: title.to_owned(), x, y, layers }
}

/// A figure of panels in so many columns.
pub(crate) fn figure(title: &str, panels: Vec<Panel>, columns: usize) -> Figure {
    Figure { title: title.to_owned(), panels, columns }
}
