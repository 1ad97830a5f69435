//! Agents that go from one process to another: their whole state, and their places among the others.
//!
//! In: agents of a run between two turns, their numbers. Out: bytes; from bytes, the same agents in a run of the same agents elsewhere,
//! which go on there as they would have here; of bytes that are refused nothing. Never here: which agents go, and where to.

use super::state::{ShownState, caught};
use super::{Absent, Cut, Made, refuse_absent, refuse_other, runners_of};
use crate::cluster::{Place, Placed, check_places};
use crate::lock_free::sleep::SignalState;
use crate::neighbours::broad_phase::PublishedState;
use crate::time::agent_clock::Timeline;
use metachron_core::{AgentId, Archive, ArchiveError, archive_values};
use std::sync::Arc;
use std::time::Duration;

/// The agents that migrate, and the moment.
#[derive(Default)]
pub(crate) struct Migration {
    /// By rising numbers.
    pub agents: Vec<MigratingAgent>,
    moment: Moment,
}

/// When agents migrate.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Moment {
    timeline: Timeline,
    now: Duration,
}

/// An agent among the others: all of it that it does not keep to itself and does not show.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct MigratingAgent {
    pub id: AgentId,
    /// How many turns it has made.
    pub turns: u64,
    place: Place,
    signal: SignalState,
    /// `None` where there is no broad phase.
    published: Option<PublishedState>,
}

impl Cut {
    /// Writes the agents of these numbers, which rise; `turns` has those of each agent of the run.
    ///
    /// # Errors
    /// [`ArchiveError::Mismatch`] for one that is not there, and the errors of models.
    pub fn write_migration(
        &mut self,
        archive: &mut Archive<'_>,
        of: &[AgentId],
        turns: impl Fn(AgentId) -> u64,
    ) -> Result<(), ArchiveError> {
        let broad_phase = self.run_agents.peers.broad_phase.get();
        let agent = |id: &AgentId| {
            let placed = self.all.get(id.0 as usize).and_then(Option::as_ref);
            let place = placed.filter(|placed| !placed.has_left()).ok_or_else(|| no_agent(*id))?.place;
            let signal = self.run_agents.sleep.signal_state(*id);
            let published = broad_phase.map(|broad_phase| broad_phase.state_of(*id));
            Ok(MigratingAgent { id: *id, turns: turns(*id), place, signal, published })
        };
        let agents = of.iter().map(agent).collect::<Result<Vec<_>, ArchiveError>>()?;
        let mut migration = Migration { agents, moment: Moment { timeline: self.timeline, now: self.now } };
        self.archive_migration(&mut migration, archive, &mut refuse_absent).map(drop)
    }

    /// Reads agents in the place of the run's own of the same numbers, and the time. One that has left here, and is not kept, is made by `absent`.
    ///
    /// # Errors
    /// The errors of [`crate::Run::archive`]; all is as it was then.
    pub fn read_migration(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<Migration, ArchiveError> {
        let mut migration = Migration::default();
        let mut shown = self.archive_migration(&mut migration, archive, absent)?;
        let super::RunAgents { peers, sleep, .. } = &self.run_agents;
        for (agent, shown) in migration.agents.iter().zip(&mut shown) {
            let Some(placed) = &mut self.all[agent.id.0 as usize] else { continue };
            placed.place = agent.place;
            let runner = &mut placed.runner;
            runner.writer.replace(Arc::clone(&shown.newest));
            runner.shared.gauges.set_values(&shown.metrics);
            drop(runner.publish_form());
            sleep.set_signal_state(agent.id, agent.signal);
            if let (Some(broad_phase), Some(published)) = (peers.broad_phase.get(), &agent.published) {
                broad_phase.set_state_of(agent.id, published);
                runner.observer.arrive(broad_phase);
            }
            runner.observer.see(peers, &shown.seen);
            runner.shared.mail.replace(shown.commands.take());
            runner.notify_reader();
        }
        (self.timeline, self.now) = (migration.moment.timeline, migration.moment.now);
        Ok(migration)
    }

    fn archive_migration(
        &mut self,
        migration: &mut Migration,
        archive: &mut Archive<'_>,
        absent: Absent<'_>,
    ) -> Result<Vec<ShownState>, ArchiveError> {
        archive_values!(archive, migration.agents, migration.moment)?;
        let migrates = self.check_migration(migration)?;
        let handles = &self.run_agents.handles;
        let live: Vec<bool> =
            handles.iter().zip(&migrates).map(|(agent, migrates)| *migrates || !agent.has_left()).collect();
        let is_reading = archive.is_reading();
        let mut made = self.make(&migrates, absent)?;
        let own = if is_reading { self.take_own(&migrates)? } else { Vec::new() };
        let shown = |agent: &MigratingAgent| match &self.all[agent.id.0 as usize] {
            Some(placed) if !is_reading => ShownState::of(&placed.runner, &live),
            _ => ShownState::default(),
        };
        let mut shown: Vec<ShownState> = migration.agents.iter().map(shown).collect();
        let mut runners = runners_of(&mut self.all, &mut made, &migrates);
        let archived = caught(|| {
            for (runner, shown) in runners.iter_mut().flatten().zip(&mut shown) {
                runner.archive_own(archive)?;
                shown.archive(archive)?;
                runner.observer.check_seen(&shown.seen, &live)?;
                if !shown.metrics.is_sound() {
                    return Err(refuse_other("the condition of an agent", "none", "one that agents can be in"));
                }
            }
            let mut places = vec![Place::Home; migrates.len()];
            migration.agents.iter().for_each(|agent| places[agent.id.0 as usize] = agent.place);
            check_places(&places, &runners.iter().map(Option::as_deref).collect::<Vec<_>>())?;
            if is_reading { archive.finish() } else { Ok(()) }
        });
        drop(runners);
        if archived.is_err() {
            self.take_back(own);
        } else {
            self.admit_migrating(migration, made);
        }
        archived.map(|()| shown)
    }

    /// They are there from now on, also those that had left.
    fn admit_migrating(&mut self, migration: &Migration, made: Made) {
        let handles = &self.run_agents.handles;
        for (at, runner) in made {
            handles[at].record.begin(&runner.shared);
            self.all[at] = Some(Placed { runner, place: Place::Home });
        }
        migration.agents.iter().for_each(|agent| handles[agent.id.0 as usize].record.set_left(false));
    }

    /// Checks that these agents can come into the run; for each number whether its agent is among them.
    fn check_migration(&self, migration: &Migration) -> Result<Vec<bool>, ArchiveError> {
        let Migration { agents, moment } = migration;
        let mut migrates = vec![false; self.all.len()];
        let mut next = 0;
        for agent in agents {
            let at = agent.id.0 as usize;
            if at < next || at >= migrates.len() {
                return Err(no_agent(agent.id));
            }
            (migrates[at], next) = (true, at + 1);
        }
        if !moment.timeline.is_sound() {
            return Err(refuse_other("the timeline", "none", "one that can be in force"));
        }
        let is_there = |id: AgentId| migrates.get(id.0 as usize) == Some(&true);
        for agent in agents {
            let leads = agent.place.leader().is_none_or(is_there);
            let callers = agent.published.iter().flat_map(|published| &published.callers);
            if !leads || !callers.copied().all(|id| (id.0 as usize) < migrates.len()) {
                return Err(refuse_other(
                    "the place of an agent",
                    "one beside agents that stay",
                    "one among those that go",
                ));
            }
        }
        Ok(migrates)
    }
}

fn no_agent(id: AgentId) -> ArchiveError {
    refuse_other("an agent that migrates", &format!("number {}", id.0), "one that is there, by rising numbers")
}
