//! The response of the frame time to polygons, identified from an experiment with a scene on a machine.
//!
//! In: frames drawn at designed resolutions. Out: t = fixed + c · polygons, the noise around it, and the delay in frames until a change
//! shows. Never here: the drawing of the frames, a law.
//! Theory: `docs/theory/control.md`, eq. 26.

use super::robust_fit::Line;
use crate::control::{Law, ObjectView, PictureControl, Policy};

/// One frame of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// The objects in view.
    pub views: Vec<ObjectView>,
    /// Triangles requested by the controller.
    pub polygons: f64,
    /// Time of the frame, seconds.
    pub work_s: f64,
}

/// A scene's picture on a machine, as its controller sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Seconds per frame as a function of polygons.
    pub line: Line,
    /// Frames after which a change of polygons shows in the measured time; 0: in the same frame.
    pub dead_time: usize,
    /// The objects in view, frame by frame; never empty.
    pub frames: Vec<Vec<ObjectView>>,
    /// Points of the experiment: polygons, and the seconds of the frame in which they showed.
    pub points: Vec<(f64, f64)>,
}

/// Why there is no plant to control.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// No object in view can be drawn in more than one way.
    #[error("nothing in view can be drawn at more than one resolution: there is nothing to control")]
    NothingToControl,
    /// Time does not increase with polygons.
    #[error(
        "the time of a frame does not depend on its polygons ({slope_ns:.2} ns each, 95 % between {low_ns:.2} and {high_ns:.2}): \
         no gain can control it"
    )]
    NoResponse {
        /// Fitted nanoseconds a polygon.
        slope_ns: f64,
        /// Lower end of its interval.
        low_ns: f64,
        /// Upper end of its interval.
        high_ns: f64,
    },
    /// Too few frames, or invalid times.
    #[error("{frames} frames with a valid time are too few to identify the plant: at least 30 are needed")]
    TooFew {
        /// Number of usable frames.
        frames: usize,
    },
}

/// The range of times that a plant can take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeRange {
    /// With everything in view at its coarsest, seconds.
    pub least_s: f64,
    /// With everything in view as fine as a controller draws it, seconds.
    pub most_s: f64,
}

impl TimeRange {
    /// Whether a time is within the range.
    #[must_use]
    pub fn contains(self, time_s: f64) -> bool {
        self.least_s <= time_s && time_s <= self.most_s
    }
}

/// The longest dead time tested, frames.
pub(crate) const DEAD_TIME_MAX: usize = 4;
/// A longer dead time is accepted if its scatter is below this fraction of that of the best shorter one.
const BETTER: f64 = 0.9;
/// Least number of frames for an identification.
const FRAMES_MIN: usize = 30;

impl Plant {
    /// Fits a plant to the frames of an experiment, in their order.
    ///
    /// # Errors
    /// [`IdentifyError`] if there is none.
    pub fn identify(observed: &[Observed]) -> Result<Self, IdentifyError> {
        let sound = |o: &&Observed| o.work_s.is_finite() && o.work_s > 0.0 && o.polygons.is_finite();
        let frames = observed.iter().filter(sound).count();
        if frames < FRAMES_MIN {
            return Err(IdentifyError::TooFew { frames });
        }
        let (least, most) =
            observed.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), o| (l.min(o.polygons), m.max(o.polygons)));
        if most <= least {
            return Err(IdentifyError::NothingToControl);
        }
        // polygons may come and go with the objects in view though none of these has a choice
        let (coarsest, finest) = ends(&observed[0].views);
        let (dead_time, line) =
            best_dead_time(observed).filter(|_| finest > coarsest).ok_or(IdentifyError::NothingToControl)?;
        if line.slope_95.0 <= 0.0 {
            let [slope_ns, low_ns, high_ns] = [line.slope, line.slope_95.0, line.slope_95.1].map(|s| 1e9 * s);
            return Err(IdentifyError::NoResponse { slope_ns, low_ns, high_ns });
        }
        let frames = observed.iter().map(|o| o.views.clone()).collect();
        Ok(Self { line, dead_time, frames, points: delayed(observed, dead_time) })
    }

    /// Time of `polygons` on a machine `speed` times as fast, seconds.
    #[must_use]
    pub fn seconds(&self, polygons: f64, speed: f64) -> f64 {
        // a fit through few large frames may give a negative fixed part; a frame takes some time
        self.line.at(polygons).max(1e-3 * self.line.slope * polygons).max(1e-9) / speed
    }

    /// The same picture on a machine `speed` times as fast.
    #[must_use]
    pub fn on(&self, speed: f64) -> Self {
        let mut plant = self.clone();
        let line = &mut plant.line;
        (line.intercept, line.slope) = (line.intercept / speed, line.slope / speed);
        line.slope_95 = (line.slope_95.0 / speed, line.slope_95.1 / speed);
        plant.points.iter_mut().for_each(|(_, seconds)| *seconds /= speed);
        plant
    }

    /// The objects in view in frame `k`; the experiment runs forwards and backwards without end.
    #[must_use]
    pub fn views(&self, k: usize) -> &[ObjectView] {
        let last = self.frames.len() - 1;
        let place = k % (2 * last).max(1);
        &self.frames[if place > last { 2 * last - place } else { place }]
    }

    /// The range of times of the picture between its coarsest and its finest, on a machine `speed` times as fast.
    #[must_use]
    pub fn time_range(&self, speed: f64) -> TimeRange {
        let (least, most) = ends(self.views(0));
        TimeRange { least_s: self.seconds(least, speed), most_s: self.seconds(most, speed) }
    }

    /// s: the share of a frame of `time_s` seconds that scales with its polygons (control.md, eq. 3).
    #[must_use]
    pub fn share(&self, time_s: f64, speed: f64) -> f64 {
        (1.0 - self.line.intercept.max(0.0) / speed / time_s).clamp(0.0, 1.0)
    }
}

/// Polygons of the objects in view at their coarsest, and as fine as a controller draws them.
pub(crate) fn ends(views: &[ObjectView]) -> (f64, f64) {
    let end = |factor: f64| {
        let mut control = PictureControl::new(Policy::Feedback, Law::CORRECTED, 30.0);
        control.plan(views);
        control.coarsen(factor);
        control.plan(views).polygons
    };
    (end(1e12), end(1e-12))
}

/// The shortest dead time that no longer one clearly improves on.
fn best_dead_time(observed: &[Observed]) -> Option<(usize, Line)> {
    let mut best: Option<(usize, Line)> = None;
    for frames in 0..=DEAD_TIME_MAX {
        let Some(line) = Line::through(&delayed(observed, frames)) else { continue };
        if best.is_none_or(|(_, held)| line.slope > 0.0 && line.scatter < BETTER * held.scatter) {
            best = Some((frames, line));
        }
    }
    best
}

/// Pairs of polygons and the time of the frame `frames` later.
fn delayed(observed: &[Observed], frames: usize) -> Vec<(f64, f64)> {
    observed.iter().zip(observed.iter().skip(frames)).map(|(cause, effect)| (cause.polygons, effect.work_s)).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::control::Kind;
    use metachron_core::ResolutionRange;

    /// A tube of 1.6 m and a ball.
    pub fn views() -> Vec<ObjectView> {
        let object =
            |id, kind, range, pixels| ObjectView { range, pixels, distance_m: 0.6, ..ObjectView::plain(id, kind) };
        let ball = Kind::Primitive { radius_m: 0.02, triangles: std::array::from_fn(|n| 48 << n) };
        vec![
            object(
                0,
                Kind::Tube { length_m: 1.6, radius_m: 0.015 },
                ResolutionRange { eps_m: (5e-4, 0.04), n: (0, 5) },
                1e9,
            ),
            object(1, ball, ResolutionRange { eps_m: (1.0, 1.0), n: (0, 6) }, 2e4),
        ]
    }

    /// A long thin tube whose ε̂ ranges from 0.01 to 1.
    pub fn tube_alone() -> ObjectView {
        let [tube, _] = <[ObjectView; 2]>::try_from(views()).unwrap();
        ObjectView { range: ResolutionRange { eps_m: (4e-4, 0.04), n: (0, 5) }, ..tube }
    }

    /// A plant without noise, with these objects in view.
    pub fn plant_of(views: Vec<ObjectView>, fixed_s: f64, polygon_s: f64) -> Plant {
        let points: Vec<_> = (1..40).map(|k| (1e3 * f64::from(k), fixed_s + polygon_s * 1e3 * f64::from(k))).collect();
        Plant { line: Line::through(&points).unwrap(), dead_time: 0, frames: vec![views], points }
    }

    /// An experiment on a plant of `fixed_s` and `polygon_s` with a delay of `dead_time` frames.
    pub fn observed(fixed_s: f64, polygon_s: f64, dead_time: usize) -> Vec<Observed> {
        let polygons = |k: usize| 2e3 * (1.0 + ((k * 7919) % 97) as f64);
        let frame = |k: usize| {
            let noise = 1.0 + 0.02 * (((k * 31) % 17) as f64 / 8.0 - 1.0);
            let work_s = noise * (fixed_s + polygon_s * polygons(k.saturating_sub(dead_time)));
            Observed { views: views(), polygons: polygons(k), work_s }
        };
        (0..200).map(frame).collect()
    }

    #[test]
    fn a_plant_is_identified_from_its_frames() {
        for dead_time in [0, 1, 2] {
            let plant = Plant::identify(&observed(7e-3, 0.22e-6, dead_time)).unwrap();
            assert_eq!(plant.dead_time, dead_time);
            assert!((plant.line.slope / 0.22e-6 - 1.0).abs() < 0.02, "{:?}", plant.line);
            assert!((plant.line.intercept / 7e-3 - 1.0).abs() < 0.05, "{:?}", plant.line);
        }
    }

    #[test]
    fn frames_that_do_not_respond_to_polygons_give_no_plant() {
        assert!(matches!(Plant::identify(&observed(7e-3, 0.0, 0)), Err(IdentifyError::NoResponse { .. })));
        let mut still = observed(7e-3, 1e-6, 0);
        still.iter_mut().for_each(|o| o.polygons = 5.0);
        assert_eq!(Plant::identify(&still), Err(IdentifyError::NothingToControl));
        assert_eq!(Plant::identify(&still[..5]), Err(IdentifyError::TooFew { frames: 5 }));
        let mut fixed = observed(7e-3, 1e-6, 0);
        let fix = |view: &mut ObjectView| {
            view.range = ResolutionRange { eps_m: (view.range.eps_m.0, view.range.eps_m.0), n: (1, 1) }
        };
        fixed.iter_mut().flat_map(|o| &mut o.views).for_each(fix);
        assert_eq!(Plant::identify(&fixed), Err(IdentifyError::NothingToControl), "polygons that no control chose");
    }

    #[test]
    fn views_run_forwards_and_backwards() {
        let mut plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        plant.frames.truncate(3);
        plant.frames.iter_mut().enumerate().for_each(|(k, views)| views[0].distance_m = k as f64);
        let order: Vec<_> = (0..8).map(|k| plant.views(k)[0].distance_m as u32).collect();
        assert_eq!(order, [0, 1, 2, 1, 0, 1, 2, 1]);
        plant.frames.truncate(1);
        assert_eq!(plant.views(7)[0].distance_m, 0.0);
    }
}
