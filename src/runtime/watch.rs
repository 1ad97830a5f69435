//! Material points whose path is written down, state by state.
//!
//! In: an agent's snapshots, as it publishes them. Out: for each [`Watch`] the first state at or after every multiple of its
//! period, with that state's own time. Never here: files, units of a report.

use glam::DVec3;
use metachron_agents::{SimSpan, SimTime, Snapshot};

/// A material point to be written down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    /// Which point: share of a tube's rest length, 0 … 1; no meaning for other bodies.
    pub at: f64,
    /// Simulated time between samples, above zero.
    pub every: SimSpan,
}

/// Samples that are kept of one point; later ones are dropped. A run of 24 hours at 10 Hz.
pub const SAMPLES_MAX: usize = 864_000;

/// The time of a state and where the point was, metres.
pub type Sample = (SimTime, DVec3);

/// A point and what was written down of it.
#[derive(Debug)]
pub(super) struct Trace {
    watch: Watch,
    next: SimTime,
    samples: Vec<Sample>,
}

impl Trace {
    pub fn new(watch: Watch) -> Self {
        Self { watch, next: SimTime::ZERO, samples: Vec::new() }
    }

    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Writes the state down if its time has come.
    pub fn look(&mut self, state: &Snapshot) {
        if state.time < self.next || self.samples.len() >= SAMPLES_MAX || self.watch.every == SimSpan::ZERO {
            return;
        }
        let Some((position, _)) = state.body.probe(self.watch.at) else { return };
        self.samples.push((state.time, position));
        let passed = state.time.as_nanos() / self.watch.every.as_nanos();
        self.next = SimTime::from_nanos((passed + 1).saturating_mul(self.watch.every.as_nanos()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_agents::{Body, RigidState};

    fn state(ms: u64) -> Snapshot {
        let position = DVec3::X * ms as f64;
        let body = Body::Rigid(RigidState { position, ..RigidState::default() });
        Snapshot { time: SimTime::from_nanos(ms * 1_000_000), body, ..Snapshot::default() }
    }

    #[test]
    fn a_watch_keeps_the_first_state_at_or_after_each_multiple_of_its_period() {
        let mut trace = Trace::new(Watch { at: 0.0, every: SimSpan::from_nanos(10_000_000) });
        for ms in [0, 4, 8, 12, 16, 20, 24, 28, 32, 55, 57, 60] {
            trace.look(&state(ms));
        }
        let kept: Vec<u64> = trace.samples().iter().map(|(t, _)| t.as_nanos() / 1_000_000).collect();
        assert_eq!(kept, [0, 12, 20, 32, 55, 60]);
    }
}
