//! Reading of states: the states of a frame, agents that have joined, agents that have left.
//!
//! In: the published states of agents. Out: an up-to-date scene view and list of couplings. Never here: a choice,
//! drawing.

use super::super::assemble;
use super::Session;
use metachron_core::SimTime;
use metachron_runtime::AgentState;

impl Session {
    /// Reads the newest states without a frame: for their couplings.
    pub fn read_states(&mut self) {
        self.gather();
    }

    /// Simulated time of the states in the last frame.
    #[must_use]
    pub const fn picture_time(&self) -> SimTime {
        self.chosen.sim
    }

    /// Reads the newest states and poses the states of the frame: these, or the moment that is looked at.
    pub(super) fn gather(&mut self) {
        self.elsewhere.iter_mut().for_each(super::super::elsewhere::Elsewhere::follow);
        let now = self.world.time();
        let shown = self.rewind.as_ref().and_then(super::Rewind::shown_beside);
        let Self { scene, scene_view, couplings, world, reader, .. } = self;
        let before = scene.agents.len();
        reader.read(world.agents(), now, |agent, newest, awake| {
            let id = agent.id();
            if id.0 as usize == scene.agents.len()
                && let Some(member) = world.joined(id)
            {
                assemble::join(scene, scene_view, member);
            }
            couplings.mark_changed(id);
            match agent.state() {
                _ if shown.is_some() => {}
                AgentState::Gone => scene_view.leave(id),
                _ => scene_view.set_snapshot(id, newest, awake),
            }
            agent.form().iter().for_each(|form| scene_view.set_shape(id, form));
        });
        if self.scene.agents.len() > before {
            (before..self.scene.agents.len()).for_each(|_| self.visible_resolution.join());
            self.fixed_parts = assemble::fixed_parts(&self.scene);
            self.levels.clear();
        }
        let time = shown.unwrap_or(now);
        self.scene_view.pose(time, self.scene.states);
        self.chosen.sim = time;
        self.couplings.note(self.reader.newest());
        if let Some(trace) = &mut self.trace {
            trace.note(&self.scene, self.reader.newest());
            trace.note_couplings(now, self.couplings.all());
        }
    }

    /// Shows the newest states of all agents again.
    pub(super) fn show_newest(&mut self) {
        let agents = self.world.agents().iter().take(self.scene.agents.len());
        for (agent, newest) in agents.zip(self.reader.newest()) {
            match agent.state() {
                AgentState::Gone => self.scene_view.leave(agent.id()),
                state => self.scene_view.set_snapshot(agent.id(), newest, state == AgentState::Running),
            }
        }
    }
}
