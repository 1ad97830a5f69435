//! Prefetch of the memory that a turn will use.
//!
//! In: an agent whose turn begins after thousands of others, so that none of the forty cache lines that it needs is cached. Out: nothing:
//! one word of each line was read. Loaded one after the other during the turn, the lines take longer than a cheap step; loaded together,
//! they arrive while the step computes. Never here: anything that depends on the values read.

use super::agent_runner::AgentRunner;
use crate::agent::handle::Shared;
use metachron_core::{Body, Inertia, Snapshot};
use std::hint::black_box;
use std::sync::atomic::Ordering::Relaxed;

impl AgentRunner {
    /// Reads one word of each block of memory that a turn of this agent reads or writes.
    pub fn fetch(&mut self) {
        self.model.fetch();
        black_box([
            self.pace.time().as_nanos(),
            self.served.as_nanos(),
            self.dt_range.0.as_nanos(),
            self.metrics.turns(),
            self.faults.seed,
            self.unsettled_ns,
        ]);
        black_box([
            self.links.len(),
            usize::from(self.loads.is_some()),
            self.led.len(),
            self.announced.len(),
            self.observer.neighbours().len(),
        ]);
        black_box([self.open.is_some(), self.governor.is_some(), self.range.is_some(), self.withheld]);
        self.writer.spare().into_iter().for_each(fetch_state);
        fetch_shared(&self.shared);
        self.metrics.fetch();
    }
}

fn fetch_shared(shared: &Shared) {
    let Shared { gauges, .. } = shared;
    black_box([
        gauges.steps.load(Relaxed),
        gauges.dropped.load(Relaxed),
        gauges.cpu_nanos.load(Relaxed),
        gauges.work.get().to_bits(),
        shared.wanted_hz().to_bits(),
        u64::from(shared.id.0),
    ]);
    black_box([gauges.is_running(), shared.handover().is_some(), shared.traces.is_empty(), shared.mail.has_pending()]);
    shared.slot.fetch();
}

fn fetch_state(state: &Snapshot) {
    black_box([state.time.as_nanos(), state.steps, state.energy_j.to_bits(), state.acceleration.x.to_bits()]);
    black_box([state.touches.len(), state.grips.len(), state.given.len(), state.pairs.len(), state.bonds.len()]);
    black_box([state.at_rest, state.resolution.is_some(), state.bounds.is_some()]);
    black_box([matches!(state.body, Body::Nothing), matches!(state.inertia, Inertia::Immovable)]);
}
