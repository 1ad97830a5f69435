//! A run that several processes make together: each has all its agents, and makes the turns of some of them.
//!
//! In: the numbers of agents that others make turns of, agents that come from there, boxes that agents may not leave. Out: agents that go
//! there, and those that left their boxes. As long as agents of two processes stay in boxes that have no place in common, none of them is
//! near one of the others, and all turns are those of a run in one process, to the bit (docs/theory/clusters.md,
//! section 11; CM79). Never here: who makes whose turns, which boxes.

use super::super::archive::Migration;
use super::{Absent, Cut, Lockstep, Phase, Place, phase_of, put_back, take_apart};
use crate::agent::handle::AgentHandle;
use crate::commands::mailbox::SendError;
use crate::neighbours::broad_phase::Reach;
use metachron_core::{AgentId, Archive, ArchiveError, SimSpan};

/// The part of a divided run that is made here.
#[derive(Debug, Default)]
pub(super) struct Division {
    /// For each number whether its turns are made elsewhere; missing ones are made here.
    away: Vec<bool>,
    /// Boxes that agents may not leave, by their numbers.
    fences: Vec<Option<Reach>>,
    escaped: Option<AgentId>,
    /// No step is longer.
    dt_max: SimSpan,
}

impl Division {
    pub fn is_away(&self, agent: usize) -> bool {
        self.away.get(agent) == Some(&true)
    }

    /// Whether some turns are made elsewhere.
    pub fn is_divided(&self) -> bool {
        self.away.contains(&true)
    }

    /// All turns are made here.
    pub fn end(&mut self) {
        self.away.clear();
        self.fences.clear();
    }

    /// Whether an agent has left the box that it may not leave.
    pub const fn has_escaped(&self) -> bool {
        self.escaped.is_some()
    }

    fn set(&mut self, id: AgentId, away: bool) {
        let at = id.0 as usize;
        self.away.resize(self.away.len().max(at + 1), false);
        self.away[at] = away;
    }
}

impl Lockstep {
    /// Makes no more turns of these agents: another process does, and of all that are bonded with them. None here meets them.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] in the middle of a turn.
    pub fn release(&mut self, agents: impl IntoIterator<Item = AgentId>) -> Result<(), ArchiveError> {
        self.division.dt_max = self.dt_max();
        let (count, mut away) = (self.entries.len(), Vec::new());
        for id in agents.into_iter().filter(|id| (id.0 as usize) < count) {
            self.division.set(id, true);
            away.push(id);
            if let Some(broad_phase) = self.all.peers.broad_phase.get() {
                broad_phase.publish_nowhere(id, self.timeline.sim_at(self.now));
            }
        }
        // its leader leads it elsewhere
        self.cut(|cut| {
            for id in away {
                cut.run_agents.sleep.follow(id, None);
                cut.all[id.0 as usize].iter_mut().for_each(|placed| placed.place = Place::Home);
            }
            Ok(())
        })?;
        self.schedule_all();
        Ok(())
    }

    /// The state of these agents, whose numbers rise, by which [`Lockstep::adopt`] goes on in another process.
    ///
    /// # Errors
    /// [`ArchiveError::Mismatch`] for one that is not there, [`ArchiveError::Refused`] in the middle of a turn, and the errors of models.
    pub fn pack(&mut self, agents: &[AgentId]) -> Result<Vec<u8>, ArchiveError> {
        let turns: Vec<u64> = self.entries.iter().map(|entry| entry.turns).collect();
        let mut archive = Archive::writer();
        self.cut(|cut| cut.write_migration(&mut archive, agents, |id| turns[id.0 as usize]))?;
        Ok(archive.into_bytes())
    }

    /// Goes on with agents as they were packed elsewhere, at the moment at which they were: makes their turns from now on. One that joined the
    /// run and has left it here is made by `absent`.
    ///
    /// # Errors
    /// The errors of [`crate::Run::archive`]; nothing has changed then.
    pub fn adopt(&mut self, packed: &[u8], absent: Absent<'_>) -> Result<(), ArchiveError> {
        let Migration { agents, .. } = self.cut(|cut| cut.read_migration(&mut Archive::reader(packed), absent))?;
        for agent in agents {
            self.entries[agent.id.0 as usize].turns = agent.turns;
            self.division.set(agent.id, false);
            // one on its way home, or woken, is served
            self.all.sleep.notify(agent.id);
        }
        self.schedule_all();
        Ok(())
    }

    /// Where the agents whose turns are made here may be found near another one: nothing of those that nothing can touch.
    #[must_use]
    pub fn reaches(&self) -> Vec<Reach> {
        let Some(broad_phase) = self.all.peers.broad_phase.get() else { return Vec::new() };
        let dt_max = self.dt_max();
        let own = (0..self.entries.len()).filter(|agent| !self.division.is_away(*agent));
        own.filter_map(|agent| broad_phase.reach_of(AgentId(agent as u32), dt_max)).collect()
    }

    /// Which agents whose turns are made here belong together: each with the one that leads it, and with those that it is bonded with. They step
    /// as one, or are about to, for a while after nothing is near.
    #[must_use]
    pub fn bonds(&self) -> Vec<[AgentId; 2]> {
        if self.all.peers.broad_phase.get().is_none() {
            return Vec::new();
        }
        let own = self.all.handles.iter().filter(|agent| !self.division.is_away(agent.id().0 as usize));
        let of = |agent: &AgentHandle| {
            let (id, newest) = (agent.id(), agent.latest());
            let leader = self.all.sleep.led_by(id);
            leader.into_iter().chain(newest.bonds.iter().copied()).map(|other| [id, other]).collect::<Vec<_>>()
        };
        own.flat_map(of).collect()
    }

    /// From now on the run stops where one of these agents is no longer inside its box, with all of its reach.
    pub fn set_fences(&mut self, fences: impl IntoIterator<Item = Reach>) {
        let division = &mut self.division;
        (division.escaped, division.fences) = (None, Vec::new());
        for fence in fences.into_iter().filter(|fence| (fence.id.0 as usize) < self.entries.len()) {
            let at = fence.id.0 as usize;
            division.fences.resize(division.fences.len().max(at + 1), None);
            division.fences[at] = Some(fence);
        }
    }

    /// The agent that has left its box.
    #[must_use]
    pub const fn escaped(&self) -> Option<AgentId> {
        self.division.escaped
    }

    /// Looks whether an agent, and all that it leads, is inside its box after a step.
    pub(super) fn check_fences(&mut self, agent: usize) {
        if self.division.fences.is_empty() || self.division.has_escaped() {
            return;
        }
        let (Some(actor), Some(broad_phase)) = (&self.entries[agent].actor, self.all.peers.broad_phase.get()) else {
            return;
        };
        let Division { fences, dt_max, .. } = &self.division;
        let has_left = |id: &AgentId| {
            let fence = fences.get(id.0 as usize).copied().flatten();
            let reach = broad_phase.reach_of(*id, *dt_max);
            fence.zip(reach).is_some_and(|(fence, reach)| !fence.holds(&reach))
        };
        self.division.escaped = std::iter::once(actor.id()).chain(actor.led.ids()).find(has_left);
    }

    /// Takes an agent out whose turns are made elsewhere: there it leaves at its next turn.
    pub(super) fn take_out(&mut self, id: AgentId) -> Result<(), SendError> {
        let taken = self.cut(|cut| {
            if let Some(place) = cut.all.get_mut(id.0 as usize)
                && let Some(mut placed) = place.take()
            {
                placed.runner.take_out();
                *place = placed.kept();
            }
            Ok(())
        });
        taken.map_err(|_| SendError::NoAgent(id))
    }

    /// The longest step that any agent may make.
    fn dt_max(&self) -> SimSpan {
        let longest = self.all.handles.iter().filter_map(|agent| agent.live().map(|shared| shared.identity.dt_max));
        longest.max().unwrap_or(SimSpan::ZERO)
    }

    /// Does something with all agents, taken from their places.
    fn cut<T>(&mut self, act: impl FnOnce(&mut Cut) -> Result<T, ArchiveError>) -> Result<T, ArchiveError> {
        if self.entries.iter().any(|entry| matches!(entry.phase, Phase::Busy(_))) {
            return Err(ArchiveError::Refused { what: "an agent in the middle of its turn".to_owned() });
        }
        self.settle();
        let all = take_apart(self.entries.iter_mut().map(|entry| entry.actor.take()), &self.all.handles);
        let mut cut = Cut::new(all, self.all.clone(), self.timeline, self.now);
        let outcome = act(&mut cut);
        (self.timeline, self.now) = (cut.timeline, cut.now);
        for (entry, placed) in self.entries.iter_mut().zip(&cut.all) {
            entry.phase = placed.as_ref().map_or(Phase::Parked, phase_of);
        }
        let homes = put_back(cut.all, &self.all.handles);
        self.entries.iter_mut().zip(homes).for_each(|(entry, home)| entry.actor = home);
        outcome
    }
}
