//! The remains of an agent that has left: its number, its name, and that it has left.
//!
//! In: its runner, which makes no more turns. Out: the same where the run began with it, else nothing: an agent that
//! joined the run is made again from its spawn ([`crate::executors::archive`]). Never here: when an agent leaves.

use super::agent_record::{AgentRecord, nothing};
use super::agents::RunAgents;
use crate::cluster::Led;
use crate::commands::mailbox::SendError;
use crate::records::events::EventKind;
use crate::records::metrics::{AgentState, STALLED_FOR_GOOD};
use crate::turn::agent_runner::AgentRunner;
use metachron_core::AgentId;

impl RunAgents {
    /// Takes an agent out: at its next turn, or at once where it makes no more. `home` has its runner where that makes turns of its own, or none any
    /// more.
    ///
    /// # Errors
    /// [`SendError::NoAgent`].
    pub fn leave(&self, id: AgentId, home: &mut Option<Box<AgentRunner>>) -> Result<(), SendError> {
        let agent = self.handles.of(id).ok_or(SendError::NoAgent(id))?;
        match agent.state() {
            AgentState::Gone => return Ok(()),
            AgentState::Parked(_) => {}
            // where its step ends after all it obeys that
            AgentState::Stalled if agent.stalled_for() >= STALLED_FOR_GOOD => agent.leave(),
            AgentState::Running | AgentState::Resting | AgentState::Stalled => {
                agent.leave();
                return Ok(());
            }
        }
        if let Some(mut runner) = home.take() {
            runner.take_out();
            *home = runner.kept();
            return Ok(());
        }
        // it is in a step that does not end
        if let Some(broad_phase) = self.peers.broad_phase.get() {
            broad_phase.publish_nowhere(id, agent.latest().moment());
        }
        agent.live().into_iter().for_each(|shared| shared.gauges.leave());
        agent.record.set_left(true);
        Ok(())
    }
}

impl AgentRunner {
    /// Publishes that nothing of it is left, where no other agent finds it.
    pub fn vanish(&mut self) {
        self.withheld = false;
        self.writer.retire(nothing());
        if let Some(broad_phase) = self.peers.broad_phase.get() {
            broad_phase.publish_nowhere(self.id(), self.pace.time());
        }
        self.shared.gauges.leave();
        self.record().set_left(true);
    }

    /// Takes it out at once: called between turns, of one that no other leads.
    pub fn take_out(&mut self) {
        self.shared.mail.clear();
        self.open = None;
        self.record_event(EventKind::Gone);
        self.vanish();
        self.metrics.flush(&self.shared.gauges);
        self.notify_reader();
        self.shared.sleep.close(self.id());
        self.forget();
    }

    /// Frees the data of its turns: an agent that has left makes none.
    pub fn forget(&mut self) {
        (self.loads, self.announced) = (None, Vec::new());
        self.led = Led::default();
        self.observer.forget();
        self.shared.form.publish(None);
    }

    /// It, which makes no more turns; `None` of one that has left and can be made again.
    pub fn kept(self: Box<Self>) -> Option<Box<Self>> {
        if self.shared.is_forgotten() {
            self.record().end();
            return None;
        }
        Some(self)
    }

    fn record(&self) -> &AgentRecord {
        &self.peers.all[self.id().0 as usize].record
    }
}
