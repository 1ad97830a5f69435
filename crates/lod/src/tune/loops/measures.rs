//! Measures of a simulated loop: settling time, overshoot, late frames, oscillation.
//!
//! In: the frames of a trial. Out: numbers. Never here: their relative weights.

use super::play::TrialFrame;

/// Settled: the median of nine frames is within this fraction of the set point, and stays there.
pub const BAND: f64 = 0.05;
/// A frame is late beyond this multiple of its allowed time.
pub const LATE: f64 = 1.05;
/// Frames of the running median.
const MEDIAN: usize = 9;
/// Frames within which two opposite changes of the loop variable are a reversal.
const REVERSAL: usize = 3;
/// A smaller amplitude, as a fraction of the set point, is due to a level or a dead zone and is not a cycle.
const CYCLE_LEAST: f64 = 0.05;

/// A persistent oscillation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Half the distance from its lowest to its highest t/T_set.
    pub amplitude: f64,
    /// Its period, wall seconds.
    pub period_s: f64,
}

/// One trial in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Wall seconds after which it stays within ± 5 % of the set point, or at the end of the range of the objects in view; `None` if it
    /// does not.
    pub settle_s: Option<f64>,
    /// How far t/T_set passed 1 to the side opposite the start, ≥ 0.
    pub overshoot: f64,
    /// Fraction of frames that exceeded their time by 5 %.
    pub miss_share: f64,
    /// The same without a step: a frame counts 0 up to its time, 1 from 5 % past it, and linearly between.
    pub overrun: f64,
    /// Mean |t/T_set − 1|, 0 at the end of the range of the objects in view.
    pub error: f64,
    /// Reversals within three frames, per frame.
    pub reversals: f64,
    /// Changes of levels n in the second half, per frame.
    pub chatter: f64,
    /// Mean fraction of the polygons that the whole time of a frame would have allowed, 0 … 1.
    pub quality: f64,
    /// The oscillation in the last third, if there is one; meaningful only for trials without noise.
    pub cycle: Option<Cycle>,
    /// Whether the trial ends at the end of the range of the objects in view.
    pub clamped: bool,
}

impl Measures {
    /// Measures the frames of a trial, at least one.
    #[must_use]
    pub fn of(frames: &[TrialFrame]) -> Self {
        let count = frames.len().max(1) as f64;
        let mean = |value: &dyn Fn(&TrialFrame) -> f64| frames.iter().map(value).sum::<f64>() / count;
        let second_half = &frames[frames.len() / 2..];
        Self {
            settle_s: settle_s(frames),
            overshoot: overshoot(frames),
            miss_share: mean(&|b| f64::from(u8::from(b.part > LATE))),
            overrun: mean(&|b| ((b.part - 1.0) / (LATE - 1.0)).clamp(0.0, 1.0)),
            error: mean(&error),
            reversals: f64::from(reversals(frames)) / count,
            chatter: f64::from(second_half.iter().map(|b| b.switches).sum::<u32>()) / second_half.len().max(1) as f64,
            quality: mean(&|b| (b.polygons / b.polygons_ideal).clamp(0.0, 1.0)),
            cycle: cycle(&frames[frames.len() * 2 / 3..]),
            clamped: frames.last().is_some_and(|b| b.at_end),
        }
    }
}

fn error(frame: &TrialFrame) -> f64 {
    if frame.at_end { 0.0 } else { (frame.ratio - 1.0).abs() }
}

/// Wall seconds after which a trial stays within ± 5 %, or rests where nothing better is possible.
fn settle_s(frames: &[TrialFrame]) -> Option<f64> {
    let rows: Vec<_> = frames.iter().map(|b| (b.time_s, b.ratio)).collect();
    settled_after(&rows, |at| frames[at].at_end)
}

/// The time of the frame after the last at which the running median of nine (time, t/T_set) is past ± 5 % and which does not `rest` on a
/// limit; `None` if the last frame is still past. For the first frames the median is taken of as many frames before as after: otherwise a
/// loop that settles within four frames would count as settled from the start.
#[must_use]
pub fn settled_after(rows: &[(f64, f64)], rests: impl Fn(usize) -> bool) -> Option<f64> {
    let mut window = [0.0; MEDIAN];
    let mut good = |at: usize| {
        let half = (MEDIAN / 2).min(at);
        let from = (at - half).min(rows.len().saturating_sub(2 * half + 1));
        let near = &rows[from..(from + 2 * half + 1).min(rows.len())];
        let held = &mut window[..near.len()];
        held.iter_mut().zip(near).for_each(|(slot, (_, ratio))| *slot = *ratio);
        held.sort_unstable_by(f64::total_cmp);
        (held[held.len() / 2] - 1.0).abs() <= BAND || rests(at)
    };
    match (0..rows.len()).rev().find(|&at| !good(at)) {
        None => Some(0.0),
        Some(at) => rows.get(at + 1).map(|(time_s, _)| *time_s),
    }
}

/// How far the loop passed the set point to the side opposite its start.
fn overshoot(frames: &[TrialFrame]) -> f64 {
    let Some(first) = frames.first() else { return 0.0 };
    let past = |b: &TrialFrame| if first.ratio >= 1.0 { 1.0 - b.ratio } else { b.ratio - 1.0 };
    frames.iter().filter(|b| !b.at_end).map(past).fold(0.0, f64::max)
}

/// How often ε̂ reversed its direction within three frames.
fn reversals(frames: &[TrialFrame]) -> u32 {
    let way = |w: &[TrialFrame]| {
        (w[1].eps_hat / w[0].eps_hat - 1.0).signum() * f64::from(u8::from(w[1].eps_hat != w[0].eps_hat))
    };
    let (mut count, mut last) = (0, None::<(usize, f64)>);
    for (at, now) in frames.windows(2).map(way).enumerate().filter(|(_, w)| *w != 0.0) {
        count += u32::from(last.is_some_and(|(k, before)| before != now && at - k <= REVERSAL));
        last = Some((at, now));
    }
    count
}

/// The oscillation of frames that should be at rest.
fn cycle(tail: &[TrialFrame]) -> Option<Cycle> {
    let (low, high) = tail.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), b| (l.min(b.ratio), h.max(b.ratio)));
    let amplitude = 0.5 * (high - low);
    if amplitude.is_nan() || amplitude <= CYCLE_LEAST {
        return None;
    }
    let middle = 0.5 * (high + low);
    let rises = tail.windows(2).filter(|w| w[0].ratio < middle && w[1].ratio >= middle);
    let times: Vec<_> = rises.map(|w| w[1].time_s).collect();
    match times[..] {
        // a single rise without a second one is a drift
        [] | [_] => None,
        [first, .., last] => Some(Cycle { amplitude, period_s: (last - first) / (times.len() - 1) as f64 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Status;

    fn frames(ratio: impl Fn(usize) -> f64) -> Vec<TrialFrame> {
        let frame = |k: usize| TrialFrame {
            time_s: (k + 1) as f64 / 30.0,
            ratio: ratio(k),
            part: 0.9 * ratio(k),
            eps_hat: 1.0 / ratio(k),
            polygons: 50.0,
            polygons_ideal: 100.0,
            switches: u32::from(k.is_multiple_of(10)),
            status: Status::Moving,
            at_end: false,
        };
        (0..300).map(frame).collect()
    }

    #[test]
    fn a_loop_that_decays_settles_when_its_error_is_five_hundredths() {
        // 1 + 1.5·0.9^k is within 0.05 from k = 33 on
        let measured = Measures::of(&frames(|k| 1.0 + 1.5 * 0.9_f64.powi(k as i32)));
        let settle_s = measured.settle_s.unwrap();
        assert!((settle_s - 34.0 / 30.0).abs() < 4.0 / 30.0, "{settle_s}");
        assert!(measured.cycle.is_none() && measured.overshoot == 0.0 && measured.quality == 0.5);
        assert!((measured.chatter - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_loop_that_settles_in_two_frames_does_not_count_as_settled_before() {
        let rows = |k: usize| (0.1 * (k + 1) as f64, if k < 2 { 2.5 } else { 1.0 });
        let rows: Vec<_> = (0..20).map(rows).collect();
        assert_eq!(settled_after(&rows, |_| false), Some(rows[2].0));
    }

    #[test]
    fn an_oscillating_loop_never_settles_and_has_a_cycle() {
        let measured = Measures::of(&frames(|k| 1.0 + 0.4 * libm::sin(k as f64 * std::f64::consts::TAU / 15.0)));
        let cycle = measured.cycle.unwrap();
        assert_eq!(measured.settle_s, None);
        assert!((cycle.amplitude - 0.4).abs() < 0.01 && (cycle.period_s - 0.5).abs() < 0.01, "{cycle:?}");
    }

    #[test]
    fn a_frame_overruns_by_degrees_and_is_missed_past_a_twentieth() {
        // 0.9 of 1.0 on time, of 1.14 half way, of 1.2 missed: a third each
        let measured = Measures::of(&frames(|k| [1.0, 1.025 / 0.9, 1.2][k % 3]));
        assert!((measured.miss_share - 1.0 / 3.0).abs() < 1e-9, "{}", measured.miss_share);
        assert!((measured.overrun - 0.5).abs() < 1e-9, "{}", measured.overrun);
    }

    #[test]
    fn reversals_are_counted() {
        let measured = Measures::of(&frames(|k| if k % 2 == 0 { 1.0 } else { 1.01 }));
        assert!(measured.reversals > 0.9, "{}", measured.reversals);
    }
}
