//! What a policy's frames on an adapter come to.
//!
//! In: records of frames, what full detail took, likenesses. Out: a row, by the definitions of [`super::super::metrics`].

use super::super::super::table::Table;
use super::super::closed_loop::Frame;
use super::super::metrics::{self, mean};
use crate::frame::FrameRecord;
use serde::{Deserialize, Serialize};

/// A policy on a scene, drawn: times as parts of T; NaN where nothing was to be measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super::super) struct Row {
    pub(super) scene: String,
    pub(super) policy: String,
    pub(super) adapter: String,
    pub(super) frames: usize,
    /// T, milliseconds.
    pub(super) target_ms: f64,
    pub(super) mean: f64,
    pub(super) max: f64,
    pub(super) stddev: f64,
    /// The part of frames in which full detail takes more than 1.15 T, and the spread of their times.
    pub(super) binding: f64,
    pub(super) binding_stddev: f64,
    /// Mean |t − T|/T of binding frames.
    pub(super) avg_err: f64,
    /// The part of frames past 1.05 T.
    pub(super) misses: f64,
    /// |predicted − measured| over measured: the mean, and what 19 of 20 frames are within.
    pub(super) model_error: f64,
    pub(super) model_error95: f64,
    pub(super) value_over_bound: f64,
    /// Levels that changed, and changed back within three frames, to an object and frame.
    pub(super) changes: f64,
    pub(super) reversals: f64,
    /// Objects left out, to an object and frame.
    pub(super) holes: f64,
    /// Triangles to a frame.
    pub(super) polygons: f64,
    /// Choosing levels, milliseconds to a frame.
    pub(super) select_ms: f64,
    /// Likeness to full detail: the mean and the least of the frames compared.
    pub(super) ssim: f64,
    pub(super) ssim_least: f64,
    pub(super) psnr_db: f64,
    /// The time of every frame as a part of T, with spaces between.
    times: String,
}

/// What a row is made of.
pub(super) struct Played<'a> {
    pub(super) scene: &'a str,
    pub(super) policy: &'a str,
    pub(super) adapter: &'a str,
    pub(super) target_ms: f64,
    pub(super) frames: &'a [FrameRecord],
    /// What full detail took at the same places, milliseconds.
    pub(super) full_ms: &'a [f64],
    /// SSIM and PSNR of the frames that were compared.
    pub(super) likeness: &'a [(f64, f64)],
}

impl Row {
    pub(super) fn of(played: &Played<'_>) -> Self {
        let Played { scene, policy, adapter, target_ms, frames, full_ms, likeness } = *played;
        let told: Vec<Frame> =
            frames.iter().zip(full_ms).map(|(row, full)| frame(row, full / target_ms, target_ms)).collect();
        let sums = metrics::Row::of(scene, policy, &told);
        let mut errors: Vec<f64> = told.iter().map(|f| (f.predicted - f.time).abs() / f.time).collect();
        errors.retain(|error| error.is_finite());
        errors.sort_by(f64::total_cmp);
        let column = |of: fn(&(f64, f64)) -> f64| likeness.iter().map(of).collect::<Vec<_>>();
        Self {
            scene: scene.to_owned(),
            policy: policy.to_owned(),
            adapter: adapter.to_owned(),
            frames: frames.len(),
            target_ms,
            mean: sums.mean,
            max: sums.max,
            stddev: sums.stddev,
            binding: sums.binding,
            binding_stddev: sums.binding_stddev,
            avg_err: sums.avg_err,
            misses: sums.misses,
            model_error: sums.model_error,
            model_error95: errors.get(errors.len() * 19 / 20).copied().unwrap_or(f64::NAN),
            value_over_bound: sums.value_over_bound,
            changes: sums.changes,
            reversals: sums.reversals,
            holes: sums.holes,
            polygons: sums.polygons,
            select_ms: mean(&frames.iter().map(|row| row.select_ms).collect::<Vec<_>>()),
            ssim: mean(&column(|l| l.0)),
            ssim_least: column(|l| l.0).into_iter().reduce(f64::min).unwrap_or(f64::NAN),
            psnr_db: mean(&column(|l| l.1)),
            times: told.iter().map(|f| format!("{:.3}", f.time)).collect::<Vec<_>>().join(" "),
        }
    }

    /// The time of every frame, as a part of T.
    pub(super) fn times(&self) -> Vec<f64> {
        self.times.split(' ').filter_map(|time| time.parse().ok()).collect()
    }
}

/// A record in the words of the metrics.
fn frame(row: &FrameRecord, full: f64, target_ms: f64) -> Frame {
    Frame {
        time: row.frame_ms / target_ms,
        full,
        predicted: row.predicted_ms.map_or(f64::NAN, |ms| ms / target_ms),
        gap: row.value_over_bound.map_or(f64::NAN, |part| 1.0 - part),
        quality: row.value_over_bound.unwrap_or(f64::NAN),
        things: row.objects as usize,
        holes: row.holes as usize,
        changes: row.changes as usize,
        reversals: row.reversals as usize,
        polygons: row.triangles as f64,
    }
}

/// The columns that tell policies apart.
pub(super) fn table(rows: &[Row]) -> Table {
    let mut table = Table::new(&[
        "scene",
        "policy",
        "T_ms",
        "mean",
        "max",
        "stddev",
        "binding",
        "b_stddev",
        "avg_err",
        "miss",
        "model",
        "model95",
        "value",
        "changes",
        "reversals",
        "holes",
        "triangles",
        "select_ms",
        "ssim",
        "ssim_least",
        "psnr_db",
    ]);
    table.rows.extend(rows.iter().map(|r| {
        vec![
            r.scene.clone().into(),
            r.policy.clone().into(),
            (r.target_ms, 2).into(),
            (r.mean, 3).into(),
            (r.max, 3).into(),
            (r.stddev, 4).into(),
            (r.binding, 2).into(),
            (r.binding_stddev, 4).into(),
            (r.avg_err, 4).into(),
            (r.misses, 4).into(),
            (r.model_error, 4).into(),
            (r.model_error95, 4).into(),
            (r.value_over_bound, 4).into(),
            (r.changes, 4).into(),
            (r.reversals, 5).into(),
            (r.holes, 4).into(),
            (r.polygons, 0).into(),
            (r.select_ms, 3).into(),
            (r.ssim, 4).into(),
            (r.ssim_least, 4).into(),
            (r.psnr_db, 1).into(),
        ]
    }));
    table
}
