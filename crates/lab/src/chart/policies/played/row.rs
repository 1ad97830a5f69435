//! The metrics of a policy's frames in a session.
//!
//! In: records of frames, times of full detail, likenesses. Out: a row, by the definitions of [`crate::chart::policies::numeric::metrics`].

use super::super::super::table::{Cell, Table};
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
        let column = |of: fn(&(f64, f64)) -> f64| likeness.iter().map(of).collect::<Vec<_>>();
        Row {
            adapter: adapter.to_owned(),
            target_ms,
            spread95: deviation95(again_ms),
            ssim: mean(&column(|l| l.0)),
            ssim_least: column(|l| l.0).into_iter().reduce(f64::min).unwrap_or(f64::NAN),
            psnr_db: mean(&column(|l| l.1)),
            times,
            ..Row::of(scene, policy, &[frames_of_row])
        }
    }
}

/// The time of every frame of a row, as a part of T.
pub(super) fn times(row: &Row) -> Vec<f64> {
    row.times.split(' ').filter_map(|time| time.parse().ok()).collect()
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

/// A column: its name, its number, and its digits after the point in the table.
pub(super) type Column = (&'static str, fn(&Row) -> f64, usize);

/// The numbers of a row that compare policies.
pub(super) const COLUMNS: [Column; 30] = [
    ("round", |r| r.round as f64, 0),
    ("T_ms", |r| r.target_ms, 2),
    ("mean", |r| r.mean, 3),
    ("min", |r| r.min, 3),
    ("max", |r| r.max, 3),
    ("stddev", |r| r.stddev, 4),
    ("p50", |r| r.p50, 3),
    ("p95", |r| r.p95, 3),
    ("p99", |r| r.p99, 3),
    ("binding", |r| r.binding, 2),
    ("b_stddev", |r| r.binding_stddev, 4),
    ("avg_err", |r| r.avg_err, 4),
    ("late", |r| r.late, 4),
    ("miss", |r| r.misses, 4),
    ("run", |r| r.miss_run as f64, 0),
    ("overshoot", |r| r.overshoot, 3),
    ("model", |r| r.model_error, 4),
    ("model95", |r| r.model_error95, 4),
    ("spread95", |r| r.spread95, 3),
    ("value", |r| r.value_over_bound, 4),
    ("proven", |r| r.certified, 3),
    ("changes", |r| r.changes, 4),
    ("reversals", |r| r.reversals, 5),
    ("holes", |r| r.holes, 4),
    ("triangles", |r| r.polygons, 0),
    ("choosing", |r| r.choosing, 4),
    ("ssim", |r| r.ssim, 4),
    ("ssim_least", |r| r.ssim_least, 4),
    ("psnr_db", |r| r.psnr_db, 1),
    ("frames", |r| r.frames as f64, 0),
];

/// The table of all numbers of all rows.
pub(in super::super) fn table(rows: &[Row]) -> Table {
    let names: Vec<_> = ["scene", "policy"].into_iter().chain(COLUMNS.map(|column| column.0)).collect();
    let mut table = Table::new(&names);
    table.rows.extend(rows.iter().map(|row| {
        let words = [row.setting.clone().into(), row.policy.clone().into()];
        words.into_iter().chain(COLUMNS.map(|(_, of, digits)| Cell::Number(of(row), digits))).collect()
    }));
    table
}
