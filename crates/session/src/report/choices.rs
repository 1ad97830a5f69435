//! Summary of a run's choices of levels: predictions, certificates, changes, and the time of each stage of a frame.
//!
//! In: one row per frame. Out: shares, errors and spreads. Never here: measuring.

use super::frames::Statistics;
use crate::FrameRecord;
use serde::Serialize;

/// Summary of the choices in a run's frames; a field is `None` where no frame has a value for it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ChoiceSummary {
    /// Mean of the value of a choice over its bound; `None` for a policy without a certificate.
    pub value_over_bound: Option<f64>,
    /// The certificate: 19 of 20 choices are proven to lack at most this part of the best value.
    pub certificate: Option<f64>,
    /// Levels that changed, per object and frame in view.
    pub level_changes: Option<f64>,
    /// Levels that changed back within three frames, per object and frame in view.
    pub reversals: Option<f64>,
    /// 19 of 20 frames took the predicted time to within this part of it; `None` for a policy without predictions.
    pub model_error: Option<f64>,
    /// Time for gathering states and finding visible objects.
    pub cull_ms: Option<Statistics>,
    /// Time for choosing levels.
    pub select_ms: Option<Statistics>,
    /// Time for building the picture and drawing it.
    pub draw_ms: Option<Statistics>,
    /// From reading the camera to the finished picture.
    pub lag_ms: Option<Statistics>,
    /// Objects in view that were left out for lack of time, over all frames.
    pub holes: Option<u64>,
    /// Passes of a hierarchical search that goes on from the frame before (MB97); `None` for other policies.
    pub passes: Option<Statistics>,
    /// Objects per frame in cells that the eye reached through portals, and objects in no cell in view.
    pub potentially_visible: Option<f64>,
    /// Objects per frame in view: where there are cells, the objects that portals leave in view.
    pub visible: Option<f64>,
    /// Objects per frame in view that were drawn: as themselves, not left out and not replaced by an impostor.
    pub drawn: Option<f64>,
    /// Fraction of its width and height that the picture was drawn with; `None` without a frame.
    pub render_scale: Option<ScaleSummary>,
    /// Share of the frames in which objects threw shadows, where the light does; `None` without a frame.
    pub shadows: Option<f64>,
    /// Primitives per frame, by kind; `None` without a frame.
    pub primitives: Option<PrimitiveSummary>,
    /// Objects per frame by the algorithm that lights them, the rendering algorithm of (FS93); `None` without a frame.
    pub shadings: Option<ShadingSummary>,
}

/// Primitives of a frame, means of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PrimitiveSummary {
    /// Triangles, those of strokes among them.
    pub triangles: f64,
    /// Pieces of objects drawn as points.
    pub points: f64,
    /// Pieces of objects drawn as lines.
    pub lines: f64,
}

/// Objects of a frame, means of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ShadingSummary {
    /// Drawn with one colour a triangle.
    pub flat: f64,
    /// Drawn with colours at vertices.
    pub gouraud: f64,
    /// Drawn with light at every pixel.
    pub per_pixel: f64,
    /// The same with their texture.
    pub textured: f64,
    /// The same with soft shadows.
    pub shadowed: f64,
}

/// The scales of a run's pictures.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ScaleSummary {
    /// Of the last picture.
    pub end: f64,
    /// Mean over all pictures.
    pub mean: f64,
    /// The least.
    pub least: f64,
}

/// Summarises the choices of `frames`.
#[must_use]
pub fn summarise_choices(frames: &[FrameRecord]) -> ChoiceSummary {
    let statistics = |of: fn(&FrameRecord) -> f64| Statistics::of(frames.iter().map(of));
    let some = |of: fn(&FrameRecord) -> Option<f64>| Statistics::of(frames.iter().filter_map(of));
    let any = !frames.is_empty();
    let seen = frames.iter().map(|row| row.objects).sum::<u64>().max(1) as f64;
    let total = |of: fn(&FrameRecord) -> u32| frames.iter().map(|row| u64::from(of(row))).sum::<u64>();
    let mean = |of: fn(&FrameRecord) -> f64| statistics(of).map_or(0.0, |s| s.mean);
    let share = |of| any.then(|| total(of) as f64 / seen);
    ChoiceSummary {
        value_over_bound: some(|row| row.value_over_bound).map(|s| s.mean),
        certificate: some(|row| row.value_over_bound.map(|part| 1.0 - part)).map(|s| s.p95),
        level_changes: share(|row| row.changes),
        reversals: share(|row| row.reversals),
        model_error: some(|row| row.predicted_ms.map(|predicted| (row.frame_ms / predicted - 1.0).abs()))
            .map(|s| s.p95),
        cull_ms: statistics(|row| row.cull_ms),
        select_ms: statistics(|row| row.select_ms),
        draw_ms: statistics(|row| row.draw_ms),
        lag_ms: statistics(|row| row.lag_ms),
        holes: any.then(|| total(|row| row.holes)),
        passes: some(|row| (row.passes > 0).then_some(f64::from(row.passes))),
        potentially_visible: statistics(|row| row.potentially_visible as f64).map(|s| s.mean),
        visible: statistics(|row| row.objects as f64).map(|s| s.mean),
        drawn: statistics(|row| row.drawn as f64).map(|s| s.mean),
        render_scale: scales(frames),
        shadows: Statistics::of(frames.iter().map(|row| f64::from(u8::from(row.shadows)))).map(|spread| spread.mean),
        primitives: any.then(|| PrimitiveSummary {
            triangles: mean(|row| row.triangles as f64),
            points: mean(|row| row.points as f64),
            lines: mean(|row| row.lines as f64),
        }),
        shadings: any.then(|| ShadingSummary {
            flat: mean(|row| f64::from(row.flat)),
            gouraud: mean(|row| f64::from(row.gouraud)),
            per_pixel: mean(|row| f64::from(row.per_pixel)),
            textured: mean(|row| f64::from(row.textured)),
            shadowed: mean(|row| f64::from(row.shadowed)),
        }),
    }
}

fn scales(frames: &[FrameRecord]) -> Option<ScaleSummary> {
    let spread = Statistics::of(frames.iter().map(|row| row.render_scale))?;
    frames.last().map(|last| ScaleSummary { end: last.render_scale, mean: spread.mean, least: spread.min })
}

impl ChoiceSummary {
    /// The same for frames that were not drawn and have no declared cost: the fields that need drawing times are `None`.
    #[must_use]
    pub fn undrawn(self) -> Self {
        Self { model_error: None, draw_ms: None, lag_ms: None, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_changes_are_per_object_in_view_and_errors_relative_to_the_prediction() {
        let frame = |k: u32| FrameRecord {
            objects: 10,
            frame_ms: 10.0 + f64::from(k) * 0.01,
            predicted_ms: Some(10.0),
            value_over_bound: Some(1.0 - 1e-4 * f64::from(k)),
            changes: k % 2,
            reversals: u32::from(k == 7),
            holes: 3,
            lag_ms: f64::from(k),
            ..FrameRecord::default()
        };
        let frames: Vec<_> = (1..=100).map(frame).collect();
        let summary = summarise_choices(&frames);
        assert_eq!(
            (summary.level_changes, summary.reversals, summary.holes),
            (Some(50.0 / 1000.0), Some(1.0 / 1000.0), Some(300))
        );
        let near = |found: Option<f64>, wanted: f64| (found.unwrap() - wanted).abs() < 1e-9;
        assert!(near(summary.model_error, 0.095) && near(summary.certificate, 95e-4), "{summary:?}");
        assert!(near(summary.value_over_bound, 1.0 - 50.5e-4));
        assert_eq!(summary.lag_ms.map(|s| (s.p99, s.max)), Some((99.0, 100.0)));
        let none = summarise_choices(&[FrameRecord::default()]);
        assert_eq!((none.value_over_bound, none.certificate, none.model_error), (None, None, None));
        let none = summarise_choices(&[]);
        assert_eq!((none.level_changes, none.holes, none.cull_ms), (None, None, None));
    }
}
