//! Shared parts of the policy experiments: a case, the printed columns, the curves of frame times.

use super::chooser::Policy;
use super::closed_loop::Show;
use super::metrics::Row;
use crate::chart::{Axis, Colour, Layer, Panel, Record, Table, number_of, table};
use serde::Serialize;

/// Polygons of each of an object's five levels, as fractions of the polygons at full detail.
pub(crate) const LEVEL_PARTS: [f64; 5] = [0.02, 0.06, 0.18, 0.45, 1.0];

/// A setting or scene, and a policy, in one of some equal rounds.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    pub(crate) setting: String,
    pub(crate) policy: &'static str,
    /// Frames of all runs together, each run with a machine of another seed.
    #[serde(rename = "asked")]
    pub(crate) frames: usize,
    pub(crate) round: usize,
}

impl Case {
    /// A case of the first round.
    pub(crate) fn new(setting: &str, policy: &'static str, frames: usize) -> Self {
        Self { setting: setting.to_owned(), policy, frames, round: 0 }
    }

    /// The policy of `policies` that the case names.
    pub(crate) fn policy_of(&self, policies: &[Policy]) -> Option<Policy> {
        policies.iter().copied().find(|policy| policy.name() == self.policy)
    }

    /// Plays the show once per seed; returns the row of all frames.
    pub(crate) fn measure(&self, show: &Show, policies: &[Policy]) -> Option<Row> {
        let (policy, seeds) = (self.policy_of(policies)?, self.frames / show.frames.max(1));
        let runs: Vec<_> = (1..=seeds as u64).map(|seed| show.play(policy, seed)).collect();
        Some(Row::of(&self.setting, self.policy, &runs))
    }
}

impl Record for Row {
    type Case = Case;
    type Found = Self;

    fn of(_: &Case, found: Self) -> Self {
        found
    }
}

/// The columns in which policies differ.
pub(crate) fn table(rows: &[Row]) -> Table {
    table!(rows, |r| setting: r.setting, policy: r.policy, mean(3): r.mean, max(3): r.max, stddev(4): r.stddev,
        binding(2): r.binding, b_stddev(4): r.binding_stddev, avg_err(4): r.avg_err, miss(4): r.misses,
        model(4): r.model_error, value(4): r.value_over_bound, proven(3): r.certified, changes(4): r.changes,
        reversals(5): r.reversals, holes(4): r.holes)
}

/// A number of the row of a setting and a policy; NaN where there is no such row.
pub(crate) fn number(rows: &[Row], setting: &str, policy: &str, of: fn(&Row) -> f64) -> f64 {
    number_of(rows, |r| r.setting == setting && r.policy == policy, of)
}

/// The time of every frame under some policies, next to the target.
pub(crate) fn curves(title: &str, show: &Show, policies: &[Policy], greatest: f64) -> Panel {
    let line = |(p, colour): (&Policy, Colour)| {
        let times = show.play(*p, 1);
        Layer::line(p.name(), colour, times.iter().enumerate().map(|(k, f)| (k as f64, f.time)))
    };
    let target = Layer::limit("target", [0.0, show.frames as f64], 1.0);
    let drawn = policies.iter().zip(Colour::LINES.into_iter().cycle()).map(line);
    let (x, y) =
        (Axis::linear("frame", 0.0, show.frames as f64), Axis::linear("time of a frame / target", 0.0, greatest));
    Panel::new(title, x, y, [target].into_iter().chain(drawn))
}
