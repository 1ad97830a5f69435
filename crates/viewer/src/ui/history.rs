//! Recent history: ring buffers of frames and of each agent's numbers, for the plots.
//!
//! In: the times of each frame and the panels' numbers. Out: the last few seconds of both.
//! Never here: drawing. Nothing is allocated once the rings are full.

use super::protocol::{AgentRow, FrameTimes, Status};
use std::collections::VecDeque;

/// Frames stored: five seconds at 60 frames per second.
pub const FRAMES: usize = 300;
/// Samples stored per agent: a minute.
pub const SAMPLES: usize = 600;
/// Time between two samples of the agents, seconds.
const SAMPLE_S: f64 = 0.1;
/// Agents with stored histories; the table shows all of them.
const AGENTS: usize = 256;

/// The numbers of one agent at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Wall time of the window, seconds.
    pub at_s: f64,
    /// Spacing of the simulation, metres.
    pub sim_eps_m: Option<f64>,
    /// Spacing of the picture, metres.
    pub picture_eps_m: Option<f64>,
    /// Level of the picture's primitive.
    pub n: Option<u8>,
    /// Step length, seconds.
    pub dt_s: f64,
    /// Wall time of a step, seconds.
    pub step_s: f64,
    /// Age of the drawn state, seconds.
    pub age_s: f64,
    /// Steps per second.
    pub rate_hz: f64,
}

/// The mean and the tail of the work of recent frames.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameSummary {
    /// Mean work, seconds.
    pub mean_s: f64,
    /// 99th percentile of the work, seconds.
    pub p99_s: f64,
    /// Frames per second, from the mean interval.
    pub rate_hz: f64,
    /// Fraction of the intervals that were more than a tenth too long, 0 … 1.
    pub late_share: f64,
}

/// Rings of recent frames and samples.
#[derive(Debug, Clone, Default)]
pub struct History {
    frames: VecDeque<FrameTimes>,
    agents: Vec<VecDeque<Sample>>,
    sampled_at_s: Option<f64>,
}

impl History {
    /// Appends a finished frame.
    pub fn push_frame(&mut self, times: &FrameTimes) {
        push_bounded(&mut self.frames, *times, FRAMES);
    }

    /// Appends the agents' numbers at wall time `at_s`, at most ten times a second.
    pub fn sample(&mut self, at_s: f64, status: &Status) {
        if self.sampled_at_s.is_some_and(|last| at_s - last < SAMPLE_S) {
            return;
        }
        self.sampled_at_s = Some(at_s);
        let count = status.agents.len().min(AGENTS);
        self.agents.resize_with(count, VecDeque::new);
        for (ring, row) in self.agents.iter_mut().zip(&status.agents) {
            push_bounded(ring, sample_of(at_s, row), SAMPLES);
        }
    }

    /// Recent frames, oldest first.
    #[must_use]
    pub fn frames(&self) -> &VecDeque<FrameTimes> {
        &self.frames
    }

    /// Recent samples of the agent in this row of the table, oldest first.
    #[must_use]
    pub fn agent(&self, row: usize) -> Option<&VecDeque<Sample>> {
        self.agents.get(row)
    }

    /// Recent frames in four numbers, against a target rate of `target_hz`.
    #[must_use]
    pub fn summary(&self, target_hz: f64) -> FrameSummary {
        let work: Vec<f64> = self.frames.iter().filter(|f| f.skip.is_none()).map(|f| f.work.as_secs_f64()).collect();
        let gaps: Vec<f64> =
            self.frames.iter().filter(|f| f.skip.is_none()).map(|f| f.interval.as_secs_f64()).collect();
        if work.is_empty() {
            return FrameSummary::default();
        }
        let count = work.len() as f64;
        let late = gaps.iter().filter(|&&gap| gap * target_hz > 1.1).count() as f64;
        FrameSummary {
            mean_s: work.iter().sum::<f64>() / count,
            p99_s: percentile_99(work),
            rate_hz: rate_hz(&gaps),
            late_share: late / count,
        }
    }
}

/// Time over which the frame rate is averaged, seconds: long enough to be read, short enough to follow a slider.
const RATE_OVER_S: f64 = 1.0;

/// Frames per second over the newest of these intervals.
fn rate_hz(gaps: &[f64]) -> f64 {
    let (mut count, mut sum_s) = (0.0, 0.0);
    for gap in gaps.iter().rev() {
        (count, sum_s) = (count + 1.0, sum_s + gap);
        if sum_s >= RATE_OVER_S {
            break;
        }
    }
    if sum_s > 0.0 { count / sum_s } else { 0.0 }
}

fn sample_of(at_s: f64, row: &AgentRow) -> Sample {
    Sample {
        at_s,
        sim_eps_m: row.simulation.map(|r| r.eps_m),
        picture_eps_m: row.picture.map(|r| r.eps_m),
        n: row.picture.map(|r| r.n),
        dt_s: row.dt_s,
        step_s: row.step_s,
        age_s: row.age_s,
        rate_hz: row.rate_hz,
    }
}

fn percentile_99(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (0.99 * values.len() as f64).ceil() as usize;
    values[rank.clamp(1, values.len()) - 1]
}

fn push_bounded<T>(ring: &mut VecDeque<T>, value: T, most: usize) {
    if ring.len() == most {
        ring.pop_front();
    }
    ring.push_back(value);
}

#[cfg(test)]
mod tests {
    use super::super::protocol::Skip;
    use super::*;
    use std::time::Duration;

    fn frame(work_ms: u64, interval_ms: u64) -> FrameTimes {
        FrameTimes {
            work: Duration::from_millis(work_ms),
            interval: Duration::from_millis(interval_ms),
            ..FrameTimes::default()
        }
    }

    #[test]
    fn the_summary_excludes_skipped_frames() {
        let mut history = History::default();
        history.push_frame(&FrameTimes { skip: Some(Skip::Hidden), ..frame(9_000, 90_000) });
        (0..9).for_each(|_| history.push_frame(&frame(10, 20)));
        history.push_frame(&frame(20, 40));
        let summary = history.summary(50.0);
        assert!((summary.mean_s - 0.011).abs() < 1e-12); // ten roundings of numbers near 0.01
        assert_eq!(summary.p99_s, 0.020);
        assert!((summary.late_share - 0.1).abs() < 1e-12);
        assert!((summary.rate_hz - 1.0 / 0.022).abs() < 1e-9);
    }

    #[test]
    fn rings_are_bounded_and_sampling_keeps_its_distance() {
        let mut history = History::default();
        let status =
            Status { agents: vec![AgentRow::new(metachron_core::AgentId(0), "a", "rigid"); 2], ..Status::default() };
        for tick in 0..100_000 {
            history.push_frame(&frame(1, 1));
            history.sample(f64::from(tick) * 0.01, &status);
        }
        assert_eq!(history.frames().len(), FRAMES);
        let ring = history.agent(1).unwrap();
        assert_eq!(ring.len(), SAMPLES);
        assert!(ring.iter().zip(ring.iter().skip(1)).all(|(a, b)| b.at_s - a.at_s >= SAMPLE_S - 1e-9));
        assert!(history.agent(2).is_none());
    }
}
