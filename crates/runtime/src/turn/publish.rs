//! Publication of an agent: its states, and the notification of the agents that it acts on.
//!
//! In: a step that has been made. Out: a state, written and later published or withheld ([`crate::time::faults`]); the agents it acts on are
//! notified once the state is visible. Never here: the step, the agent's own view.

use super::agent_runner::{AgentRunner, PendingTurn};
use crate::records::metrics::Entry;
use crate::records::probe::Trace;
use crate::records::turns::{Took, Turn};
use crate::time::agent_clock::Timeline;
use metachron_core::{AgentId, PairKind, SimSpan, SimTime};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

impl AgentRunner {
    /// Records a step in the metrics and publishes its state; whether the state is visible.
    pub fn record_step(&mut self, open: &PendingTurn, timeline: &Timeline, wall: Duration, work_s: f64) -> bool {
        let now = timeline.sim_at(wall);
        let missed = now > self.pace.scene_time() && !timeline.is_free();
        let entry = Entry { steps: self.own_steps(), span: open.dt, now, late: open.start.late, missed, work_s };
        // metrics first: a state that is visible is accounted for
        self.metrics.write(&self.shared.gauges, &self.pace, entry);
        self.withheld = self.faults.loses(self.id(), self.metrics.turns());
        !self.withheld && self.publish(now)
    }

    /// Publishes the state that was written last; whether it is visible.
    pub fn publish(&mut self, now: SimTime) -> bool {
        let concerns = self
            .writer
            .filled()
            .is_some_and(|state| !(state.touches.is_empty() && state.given.is_empty() && state.pairs.is_empty()));
        let published = self.show();
        if published {
            self.notify_reader();
            if concerns {
                self.notify_receivers(now);
            }
        }
        published
    }

    /// Writes the state at `time`, to be published later; `at_rest`: the agent is about to rest in it.
    pub fn write_snapshot(&mut self, time: SimTime, at_rest: bool) -> Result<(), String> {
        let cluster = self.cluster.as_deref();
        let made = if time > self.pace.time() { self.own_steps() } else { 0 };
        let (model, clock_offset) = (&mut self.model, self.pace.clock_offset());
        let steps = self.metrics.steps() + u64::from(made);
        self.withheld = false;
        let finite = self.writer.fill(|into| {
            into.clear();
            model.call(|agent| agent.write_snapshot(into))?;
            if let Some(member) = cluster {
                member.complete(into);
            }
            (into.time, into.clock_offset, into.steps, into.at_rest) = (time, clock_offset, steps, at_rest);
            Ok::<_, String>(into.is_finite())
        })?;
        let model = self.shared.model();
        if let (true, Some(state)) = (finite, self.writer.filled()) {
            self.observer.publish(&self.peers, state, self.pace.wanted());
            self.shared.traces.iter().for_each(|trace| locked(trace).record(state));
            Ok(())
        } else {
            Err(format!("the state of the {model} agent at {:.6} s is not finite", time.as_secs_f64()))
        }
    }

    /// Publishes the state that was written last; whether it did. In a run that is recorded, and in its replay, no reader keeps it from that.
    pub fn show(&mut self) -> bool {
        let mut published = self.writer.publish();
        while !published && self.writer.filled().is_some() && self.peers.is_ordered.load(Relaxed) {
            // readers are in their cells for nanoseconds, unless they are suspended there
            thread::yield_now();
            published = self.writer.publish();
        }
        published
    }

    /// Publishes the contact shape, where it is another one.
    ///
    /// # Errors
    /// Where the model panics.
    pub fn publish_form(&mut self) -> Result<(), String> {
        let form = self.model.call(|agent| agent.form())?;
        self.shared.form.publish(form);
        Ok(())
    }

    /// Publishes a withheld state: the last state of an agent is never withheld.
    pub fn show_withheld(&mut self) {
        if std::mem::take(&mut self.withheld) && self.show() {
            self.notify_reader();
        }
    }

    /// Reports a new state of this agent to the run's reader.
    pub fn notify_reader(&self) {
        self.shared.sleep.changed.mark(self.shared.id);
    }

    /// Records that the watched points stay in place until `now`: a state at rest is still valid.
    pub fn hold_watched(&self, now: SimTime) {
        if self.shared.traces.is_empty() {
            return;
        }
        let state = self.shared.slot.latest();
        self.shared.traces.iter().for_each(|trace| locked(trace).hold(&state, now));
    }

    /// Notifies the agents that this agent acts on, once its state is visible.
    fn notify_receivers(&mut self, now: SimTime) {
        let newest = self.shared.slot.latest();
        let sleep = &self.shared.sleep;
        let leader = sleep.leader(self.shared.id);
        // the far end of a line has to answer the wave that comes down it
        let pushing = newest.pairs.iter().filter(|pair| pair.kind == PairKind::Tlm && pair.force_n > 0.0);
        let touched = newest.touches.iter().copied().chain(pushing.map(|pair| pair.with));
        touched.filter(|id| sleep.leader(*id) != leader).for_each(|id| sleep.touch(id, now));
        let Some(broad_phase) = self.peers.broad_phase.get() else { return };
        for ledger in &newest.given {
            let known = self.announced.iter_mut().find(|(with, _)| *with == ledger.with);
            if known.as_ref().is_some_and(|(_, revision)| *revision == ledger.revision) {
                continue;
            }
            match known {
                Some((_, revision)) => *revision = ledger.revision,
                None => self.announced.push((ledger.with, ledger.revision)),
            }
            broad_phase.call(ledger.with, self.shared.id);
            if sleep.is_resting(ledger.with) {
                sleep.wake(ledger.with);
            }
        }
    }
}

impl AgentRunner {
    /// Tells readers of its turns of the step that is `open`, made in a turn of `led_by`.
    pub(crate) fn record_turn(&mut self, open: &PendingTurn, led_by: AgentId, took: Took) {
        let Self { shared, model, pace, .. } = self;
        shared.streams.turn(|| Turn {
            begun: took.begun,
            ended: took.ended,
            time: pace.time(),
            dt: open.dt,
            eps_m: model.call(|agent| agent.resolution()).ok().flatten().map(|held| held.eps_m),
            led_by,
            late: open.start.late,
            dropped: open.start.dropped,
        });
    }

    /// Tells readers of its turns that it waits, with all it leads.
    pub(crate) fn record_wait(&self, took: Took) {
        self.shared.streams.turn(|| Turn {
            begun: took.begun,
            ended: took.ended,
            time: self.pace.time(),
            dt: SimSpan::ZERO,
            eps_m: None,
            led_by: self.id(),
            late: Duration::ZERO,
            dropped: SimSpan::ZERO,
        });
    }
}

/// Uncontended while the agent runs: other threads read at the end.
fn locked(trace: &Mutex<Trace>) -> MutexGuard<'_, Trace> {
    trace.lock().unwrap_or_else(PoisonError::into_inner)
}
