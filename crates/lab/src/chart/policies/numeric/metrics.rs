//! Metrics of a policy's frames: the definitions by which all policies are compared.
//!
//! In: frames. Out: a row of numbers. Never here: policies. The definitions are those of a run's report.

use super::closed_loop::Frame;
use crate::chart::{Finding, blank, worst};
use metachron_session::report::{BINDING, MISS, SETTLE_BAND, SETTLE_HOLD, SETTLE_MEDIAN};
use serde::{Deserialize, Serialize};

/// A choice whose certificate is within this of the best counts as proven best.
const CERTIFIED: f64 = 0.01;

/// Frames after a step among which the excess over T counts as overshoot.
const AFTER_STEP: usize = 60;

/// A policy on a scene: times as parts of T; NaN where nothing could be measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    /// The scene, path or target.
    pub(crate) setting: String,
    pub(crate) policy: String,
    /// The adapter that drew the pictures; empty where nothing was drawn.
    pub(crate) adapter: String,
    /// Frames played, and frames asked for: fewer are played where they would take too long.
    pub(crate) frames: usize,
    pub(crate) asked: usize,
    /// Which of equal plays, from 0.
    pub(crate) round: usize,
    /// T, milliseconds, where full detail sets it.
    pub(crate) target_ms: f64,
    pub(crate) mean: f64,
    pub(crate) min: f64,
    pub(crate) max: f64,
    pub(crate) stddev: f64,
    /// Percentiles of the frame times.
    pub(crate) p50: f64,
    pub(crate) p95: f64,
    pub(crate) p99: f64,
    /// Share of frames in which full detail takes more than 1.15 T, and mean and deviation of their times.
    pub(crate) binding: f64,
    pub(crate) binding_mean: f64,
    pub(crate) binding_stddev: f64,
    /// Mean |t − T|/T of binding frames.
    pub(crate) avg_err: f64,
    /// Share of frames past T.
    pub(crate) late: f64,
    /// Share of frames past 1.05 T, and the most of them in a row.
    pub(crate) misses: f64,
    pub(crate) miss_run: usize,
    /// The longest of the 60 frames after the sudden step, minus T.
    pub(crate) overshoot: f64,
    /// |predicted − measured| over measured: the mean, and the bound that 19 of 20 frames keep.
    pub(crate) model_error: f64,
    pub(crate) model_error95: f64,
    /// Deviation from their median that 19 of 20 times of one and the same picture keep, where these are measured.
    pub(crate) spread95: f64,
    /// Levels that changed, and levels that changed back within three frames, per object and frame.
    pub(crate) changes: f64,
    pub(crate) reversals: f64,
    /// Objects left out, per object and frame.
    pub(crate) holes: f64,
    /// Benefit over the bound at the true costs, and the share of frames whose own certificate is within 1 %.
    pub(crate) value_over_bound: f64,
    pub(crate) certified: f64,
    /// Frames until times stay close to their later mean after a step of load.
    pub(crate) settled: f64,
    /// Polygons per frame.
    pub(crate) polygons: f64,
    /// Time for choosing levels, as a part of T.
    pub(crate) choosing: f64,
    /// Likeness to full detail: the mean and the least of the pictures compared.
    pub(crate) ssim: f64,
    pub(crate) ssim_least: f64,
    /// Difference from it that is seen when the two take turns, the mean.
    pub(crate) flip: f64,
    pub(crate) psnr_db: f64,
    /// The time of every frame as a part of T, separated by spaces; empty where the figure plays the frames again.
    pub(crate) times: String,
    /// Triangles, lines and points of every frame as `triangles/lines/points`, likewise.
    pub(crate) primitives: String,
}

impl Row {
    /// The row of the frames of some runs.
    pub(crate) fn of(setting: &str, policy: &str, runs: &[Vec<Frame>]) -> Self {
        let frames = &runs.concat();
        let times = |keep: fn(&&Frame) -> bool| frames.iter().filter(keep).map(|f| f.time).collect::<Vec<_>>();
        let (all, binding) = (times(|_| true), times(|f| f.full > BINDING));
        let part = |count: usize, of: usize| if of > 0 { count as f64 / of as f64 } else { f64::NAN };
        let objects = frames.iter().map(|f| f.objects).sum();
        let each = |of: fn(&Frame) -> usize| part(frames.iter().map(of).sum(), objects);
        let known = |of: fn(&Frame) -> f64| frames.iter().map(of).filter(|x| x.is_finite()).collect::<Vec<_>>();
        let gaps = known(|f| f.gap);
        let errors = known(|f| (f.predicted - f.time).abs() / f.time);
        Self {
            setting: setting.to_owned(),
            policy: policy.to_owned(),
            frames: frames.len(),
            asked: frames.len(),
            mean: mean(&all),
            min: within(&all, 0.0),
            max: within(&all, 1.0),
            stddev: stddev(&all),
            p50: within(&all, 0.5),
            p95: within(&all, 0.95),
            p99: within(&all, 0.99),
            binding: part(binding.len(), all.len()),
            binding_mean: mean(&binding),
            binding_stddev: stddev(&binding),
            avg_err: mean(&binding.iter().map(|x| (x - 1.0).abs()).collect::<Vec<_>>()),
            late: part(all.iter().filter(|t| **t > 1.0).count(), all.len()),
            misses: part(all.iter().filter(|t| **t > MISS).count(), all.len()),
            miss_run: runs.iter().map(|run| longest_run(run)).max().unwrap_or(0),
            overshoot: worst(runs.iter().map(|run| overshoot(run, steepest(run)))),
            model_error: mean(&errors),
            model_error95: within(&errors, 0.95),
            changes: each(|f| f.changes),
            reversals: each(|f| f.reversals),
            holes: each(|f| f.holes),
            value_over_bound: mean(&known(|f| f.quality)),
            certified: part(gaps.iter().filter(|g| **g <= CERTIFIED).count(), gaps.len()),
            polygons: mean(&known(|f| f.polygons)),
            choosing: mean(&known(|f| f.choosing)),
            ..blank()
        }
    }
}

/// The value that a share `share` of some numbers, 0 … 1, does not exceed (the nearest rank); NaN for no numbers.
pub(crate) fn within(x: &[f64], share: f64) -> f64 {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * x.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// Deviation from their median that 19 of 20 times keep; NaN for no times.
pub(crate) fn deviation95(times: &[f64]) -> f64 {
    let middle = within(times, 0.5);
    within(&times.iter().map(|time| (time / middle - 1.0).abs()).collect::<Vec<_>>(), 0.95)
}

/// Error of 19 of 20 predictions over the allowed one: a tenth (FS93, §4), or 1.2 times the spread of one and the same picture if that is
/// more, since no prediction can err by less; NaN where one of the two is.
pub(crate) fn error_over_allowed(error95: f64, spread95: f64) -> f64 {
    if spread95.is_nan() { f64::NAN } else { error95 / (1.2 * spread95).max(0.1) }
}

/// The claim about that number in a scene.
pub(crate) fn predicts(scene: &str, over_allowed: f64) -> Finding {
    let allowed =
        "error of 19 of 20 predictions over 10 %, or over 1.2 times the spread of one picture if that is more";
    Finding::at_most(format!("adaptive, {scene}: {allowed}"), over_allowed, 1.0)
}

/// The most misses in a row.
fn longest_run(run: &[Frame]) -> usize {
    run.split(|f| f.time <= MISS).map(<[Frame]>::len).max().unwrap_or(0)
}

/// The frame with the greatest rise of full detail's time over the previous frame: the sudden turn, where a path has one.
fn steepest(run: &[Frame]) -> usize {
    let rise = |k: &usize| run[*k].full - run[k - 1].full;
    (1..run.len()).max_by(|a, b| rise(a).total_cmp(&rise(b))).unwrap_or(0)
}

/// The longest of the 60 frames from `step` on as a part of T, minus 1; NaN for no frames.
pub(crate) fn overshoot(run: &[Frame], step: usize) -> f64 {
    worst(run.iter().skip(step).take(AFTER_STEP).map(|f| f.time)) - 1.0
}

/// The mean; NaN for no numbers.
pub(crate) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// The standard deviation; NaN for no numbers.
pub(crate) fn stddev(x: &[f64]) -> f64 {
    let middle = mean(x);
    (x.iter().map(|x| (x - middle) * (x - middle)).sum::<f64>() / x.len() as f64).sqrt()
}

/// Frames after `step` until the median of nine stays within 6 % of the mean of `later` for twenty frames; NaN where it never does.
pub(crate) fn settled(times: &[f64], step: usize, later: std::ops::Range<usize>) -> f64 {
    let goal = mean(&times[later.clone()]);
    let median = |at: usize| {
        let mut near = times[at - SETTLE_MEDIAN / 2..=at + SETTLE_MEDIAN / 2].to_vec();
        near.sort_by(f64::total_cmp);
        near[SETTLE_MEDIAN / 2]
    };
    let holds = |k: &usize| (0..SETTLE_HOLD).all(|j| (median(step + k + j) / goal - 1.0).abs() <= SETTLE_BAND);
    (0..later.end - step - SETTLE_HOLD - SETTLE_MEDIAN).find(holds).map_or(f64::NAN, |k| k as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: f64, full: f64) -> Frame {
        let none = f64::NAN;
        let (objects, polygons) = (4, 10.0);
        Frame {
            time,
            full,
            predicted: 1.1 * time,
            gap: none,
            quality: none,
            objects,
            holes: 1,
            changes: 2,
            reversals: 0,
            polygons,
            choosing: none,
        }
    }

    #[test]
    fn only_binding_frames_enter_the_error() {
        let row = Row::of("", "", &[vec![frame(0.9, 2.0), frame(1.1, 3.0), frame(0.2, 0.2), frame(1.0, 1.1)]]);
        assert!((row.binding - 0.5).abs() < 1e-15 && (row.avg_err - 0.1).abs() < 1e-12);
        assert!((row.binding_stddev - 0.1).abs() < 1e-12 && (row.mean - 0.8).abs() < 1e-12);
        assert!((row.misses - 0.25).abs() < 1e-15 && (row.model_error - 0.1).abs() < 1e-12);
        assert!((row.holes - 0.25).abs() < 1e-15 && (row.changes - 0.5).abs() < 1e-15 && row.certified.is_nan());
    }

    #[test]
    fn late_frames_are_counted_in_a_row_within_a_run_and_from_the_steepest_rise_on() {
        let times = [1.2, 1.0, 1.06, 1.3, 1.1, 0.9];
        let fulls = [2.0, 2.1, 4.0, 4.0, 4.2, 1.0];
        let run: Vec<_> = times.into_iter().zip(fulls).map(|(time, full)| frame(time, full)).collect();
        let row = Row::of("", "", &[run.clone(), run]);
        // the last frame of the first run and the first of the second are not neighbours
        assert_eq!((row.miss_run, row.frames), (3, 12));
        assert!((row.overshoot - 0.3).abs() < 1e-12, "{}", row.overshoot);
        // twelve frames: the sixth, the twelfth
        assert_eq!((row.min, row.p50, row.p95, row.p99, row.max), (0.9, 1.06, 1.3, 1.3, 1.3));
        assert!((row.late - 8.0 / 12.0).abs() < 1e-15 && (row.misses - 8.0 / 12.0).abs() < 1e-15);
    }

    #[test]
    fn step_that_decays_settles_when_it_is_within_six_parts_in_a_hundred() {
        // 1 + 0.5 · 0.8^k is within 6 % from the tenth frame on: 0.5 · 0.8^10 = 0.054
        let times: Vec<_> = (0..300).map(|k| if k < 100 { 1.0 } else { 1.0 + 0.5 * 0.8_f64.powi(k - 100) }).collect();
        assert_eq!(settled(&times, 100, 150..300), 10.0);
    }
}
