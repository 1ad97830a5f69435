//! Frames of a session as the frames and rows of [`crate::chart::policies::numeric::metrics`].
//!
//! In: records of frames, rows. Out: frames of the metrics, the columns that are printed. Never here: how frames are played.

use crate::chart::policies::numeric::{Frame, Row};
use crate::chart::{Table, table};
use metachron_session::FrameRecord;

/// The numbers of every frame in a text of a row, of those separated by `/` the one at `place`, with the frame's own.
pub(in super::super) fn of_frames(text: &str, place: usize) -> impl Iterator<Item = (f64, f64)> {
    let numbered = text.split(' ').enumerate();
    numbered.filter_map(move |(frame, numbers)| Some((frame as f64, numbers.split('/').nth(place)?.parse().ok()?)))
}

/// Converts a record to a frame of the metrics.
pub(super) fn frame(row: &FrameRecord, full: f64, target_ms: f64) -> Frame {
    Frame {
        time: row.frame_ms / target_ms,
        full,
        predicted: row.predicted_ms.map_or(f64::NAN, |ms| ms / target_ms),
        gap: row.value_over_bound.map_or(f64::NAN, |part| 1.0 - part),
        quality: row.value_over_bound.unwrap_or(f64::NAN),
        objects: row.objects as usize,
        holes: row.holes as usize,
        changes: row.changes as usize,
        reversals: row.reversals as usize,
        polygons: row.triangles as f64,
        choosing: row.select_ms / target_ms,
    }
}

/// The numbers of rows that compare policies.
pub(in super::super) fn table(rows: &[Row]) -> Table {
    table!(rows, |r| scene: r.setting, policy: r.policy, round: r.round, T_ms(2): r.target_ms, mean(3): r.mean,
        min(3): r.min, max(3): r.max, stddev(4): r.stddev, p50(3): r.p50, p95(3): r.p95, p99(3): r.p99,
        binding(2): r.binding, b_stddev(4): r.binding_stddev, avg_err(4): r.avg_err, late(4): r.late, miss(4): r.misses,
        run: r.miss_run, overshoot(3): r.overshoot, model(4): r.model_error, model95(4): r.model_error95,
        spread95(3): r.spread95, value(4): r.value_over_bound, proven(3): r.certified, changes(4): r.changes,
        reversals(5): r.reversals, holes(4): r.holes, triangles: r.polygons, choosing(4): r.choosing, ssim(4): r.ssim,
        ssim_least(4): r.ssim_least, flip(4): r.flip, psnr_db(1): r.psnr_db, frames: r.frames)
}
