//! The metrics of a policy's frames in a session.
//!
//! In: records of frames, times of full detail, likenesses. Out: a row, by the definitions of [`crate::chart::policies::numeric::metrics`].

use crate::chart::policies::numeric::closed_loop::Frame;
use crate::chart::policies::numeric::metrics::{Row, deviation95, mean};
use metachron_session::FrameRecord;

/// The data of a row.
pub(super) struct Played<'a> {
    pub(super) scene: &'a str,
    pub(super) policy: &'a str,
    pub(super) adapter: &'a str,
    pub(super) target_ms: f64,
    pub(super) frames: &'a [FrameRecord],
    /// Times of full detail at the same places, milliseconds.
    pub(super) full_ms: &'a [f64],
    /// Times of one and the same picture, milliseconds.
    pub(super) again_ms: &'a [f64],
    /// SSIM and PSNR of the frames that were compared.
    pub(super) likeness: &'a [(f64, f64)],
}

impl Played<'_> {
    pub(super) fn row(&self) -> Row {
        let Self { scene, policy, adapter, target_ms, frames, full_ms, again_ms, likeness } = *self;
        let frames_of_row: Vec<Frame> =
            frames.iter().zip(full_ms).map(|(row, full)| frame(row, full / target_ms, target_ms)).collect();
        let times = frames_of_row.iter().map(|f| format!("{:.3}", f.time)).collect::<Vec<_>>().join(" ");
        let primitives = frames.iter().map(|row| format!("{}/{}/{}", row.triangles, row.lines, row.points));
        let primitives = primitives.collect::<Vec<_>>().join(" ");
        let column = |of: fn(&(f64, f64)) -> f64| likeness.iter().map(of).collect::<Vec<_>>();
        Row {
            adapter: adapter.to_owned(),
            target_ms,
            spread95: deviation95(again_ms),
            ssim: mean(&column(|l| l.0)),
            ssim_least: column(|l| l.0).into_iter().reduce(f64::min).unwrap_or(f64::NAN),
            psnr_db: mean(&column(|l| l.1)),
            times,
            primitives,
            ..Row::of(scene, policy, &[frames_of_row])
        }
    }
}

/// The numbers of every frame in a text of a row, of those separated by `/` the one at `place`, with the frame's own.
pub(super) fn of_frames(text: &str, place: usize) -> impl Iterator<Item = (f64, f64)> {
    let numbered = text.split(' ').enumerate();
    numbered.filter_map(move |(frame, numbers)| Some((frame as f64, numbers.split('/').nth(place)?.parse().ok()?)))
}

/// Converts a record to a frame of the metrics.
fn frame(row: &FrameRecord, full: f64, target_ms: f64) -> Frame {
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

/// The numbers of a row that compare policies.
pub(in super::super) const COLUMNS: &str = "\
    setting as scene, policy, round.0, target_ms.2 as T_ms, mean.3, min.3, max.3, stddev.4, p50.3, p95.3, p99.3, \
    binding.2, binding_stddev.4 as b_stddev, avg_err.4, late.4, misses.4 as miss, miss_run.0 as run, overshoot.3, \
    model_error.4 as model, model_error95.4 as model95, spread95.3, value_over_bound.4 as value, certified.3 as proven, \
    changes.4, reversals.5, holes.4, polygons.0 as triangles, choosing.4, ssim.4, ssim_least.4, psnr_db.1, frames.0";
