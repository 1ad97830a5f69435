//! Recording of the paths of material points, state by state.
//!
//! In: an agent's snapshots, as it publishes them. Out: for each [`WatchedPoint`] the first state at or after every multiple of its
//! period, with that state's own time; while the agent rests, its state at every multiple. Never here: files, units of a report.

use glam::DVec3;
use metachron_core::{SimSpan, SimTime, Snapshot};

/// A material point to be recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchedPoint {
    /// Which point: share of a tube's rest length, 0 … 1; no meaning for other bodies.
    pub at: f64,
    /// Simulated time between samples, above zero.
    pub every: SimSpan,
}

/// Samples stored of one point; later ones are dropped. A run of 24 hours at 10 Hz.
pub const SAMPLES_MAX: usize = 864_000;

/// The time of a state and the position of the point, metres.
pub type Sample = (SimTime, DVec3);

/// A point and its samples.
#[derive(Debug)]
pub(crate) struct Trace {
    watch: WatchedPoint,
    next: SimTime,
    samples: Vec<Sample>,
}

impl Trace {
    pub fn new(watch: WatchedPoint) -> Self {
        Self { watch, next: SimTime::ZERO, samples: Vec::new() }
    }

    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Records the state if a sample is due.
    pub fn record(&mut self, state: &Snapshot) {
        if state.moment() < self.next || self.samples.len() >= SAMPLES_MAX || self.watch.every == SimSpan::ZERO {
            return;
        }
        let Some((position, _)) = state.body.probe(self.watch.at) else { return };
        self.samples.push((state.moment(), position));
        self.next = self.multiple_after(state.moment());
    }

    /// Records the state at every multiple of the period up to `until`, for which it is valid.
    pub fn hold(&mut self, state: &Snapshot, until: SimTime) {
        if self.watch.every == SimSpan::ZERO {
            return;
        }
        let Some((position, _)) = state.body.probe(self.watch.at) else { return };
        while self.next <= until && self.samples.len() < SAMPLES_MAX {
            self.samples.push((self.next, position));
            self.next = self.multiple_after(self.next);
        }
    }

    fn multiple_after(&self, time: SimTime) -> SimTime {
        let every = self.watch.every.as_nanos();
        SimTime::from_nanos((time.as_nanos() / every + 1).saturating_mul(every))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::{Body, RigidState};

    fn state(ms: u64) -> Snapshot {
        let position = DVec3::X * ms as f64;
        let body = Body::Rigid(RigidState { position, ..RigidState::default() });
        Snapshot { time: SimTime::from_nanos(ms * 1_000_000), body, ..Snapshot::default() }
    }

    #[test]
    fn a_watch_keeps_the_first_state_at_or_after_each_multiple_of_its_period() {
        let mut trace = Trace::new(WatchedPoint { at: 0.0, every: SimSpan::from_nanos(10_000_000) });
        for ms in [0, 4, 8, 12, 16, 20, 24, 28, 32, 55, 57, 60] {
            trace.record(&state(ms));
        }
        let kept: Vec<u64> = trace.samples().iter().map(|(t, _)| t.as_nanos() / 1_000_000).collect();
        assert_eq!(kept, [0, 12, 20, 32, 55, 60]);
    }

    #[test]
    fn a_state_that_holds_is_written_down_at_every_multiple() {
        let mut trace = Trace::new(WatchedPoint { at: 0.0, every: SimSpan::from_nanos(10_000_000) });
        trace.record(&state(4));
        trace.hold(&state(4), SimTime::from_nanos(30_000_000));
        trace.hold(&state(4), SimTime::from_nanos(39_000_000));
        trace.record(&state(41));
        let kept: Vec<_> = trace.samples().iter().map(|(t, at)| (t.as_nanos() / 1_000_000, at.x)).collect();
        assert_eq!(kept, [(4, 4.0), (10, 4.0), (20, 4.0), (30, 4.0), (41, 41.0)]);
    }
}
