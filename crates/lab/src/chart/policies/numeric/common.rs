//! Shared parts of the policy experiments: a case, the printed columns, the curves of frame times.

use super::chooser::Policy;
use super::closed_loop::Show;
use super::metrics::Row;
use crate::chart::{Axis, Colour, Layer, Panel, Record};
use csv::StringRecord;

/// Polygons of each of an object's five levels, as fractions of the polygons at full detail.
pub(crate) const LEVEL_PARTS: [f64; 5] = [0.02, 0.06, 0.18, 0.45, 1.0];

/// A setting or scene, and a policy, in one of some equal rounds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Case {
    pub(crate) setting: String,
    pub(crate) policy: String,
    /// Frames of all runs together, each run with a machine of another seed.
    pub(crate) frames: usize,
    pub(crate) round: usize,
}

impl Case {
    /// A case of some runs.
    pub(crate) fn new(setting: &str, policy: Policy, seeds: usize, frames: usize) -> Self {
        Self { setting: setting.to_owned(), policy: policy.name().to_owned(), frames: seeds * frames, round: 0 }
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

impl Record for Row {
    type Case = Case;

    fn case(&self) -> Case {
        Case { setting: self.setting.clone(), policy: self.policy.clone(), frames: self.asked, round: self.round }
    }

    fn read(names: &StringRecord, line: &StringRecord) -> csv::Result<Self> {
        line.deserialize(Some(names))
    }
}

/// The columns in which policies differ.
pub(crate) const COLUMNS: &str = "\
    setting, policy, mean.3, max.3, stddev.4, binding.2, binding_stddev.4 as b_stddev, avg_err.4, \
    misses.4 as miss, model_error.4 as model, value_over_bound.4 as value, certified.3 as proven, \
    changes.4, reversals.5, holes.4";

/// A number of the row of a setting and a policy; NaN where there is no such row.
pub(crate) fn number(rows: &[Row], setting: &str, policy: &str, of: fn(&Row) -> f64) -> f64 {
    rows.iter().find(|r| r.setting == setting && r.policy == policy).map_or(f64::NAN, of)
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
