//! The state of a run between turns, as it is written and read: the internal states of its agents in place, all else as
//! values.
//!
//! In: agents that make no turns. Out: the same in an archive; from one, values that were checked, and that nobody has been shown. Never here:
//! when they are shown ([`super::Cut`]), what models save of themselves ([`metachron_contact::Agent::archive`]).

use crate::agent::agents::RunAgents;
use crate::cluster::{Place, Placed, Steppers, check_places};
use crate::commands::loads::Loads;
use crate::commands::mailbox::PendingCommands;
use crate::lock_free::sleep::SleepState;
use crate::neighbours::broad_phase::{BroadPhaseState, NeighbourList};
use crate::neighbours::observation::Seen;
use crate::records::metrics::MetricsValues;
use crate::time::agent_clock::Timeline;
use crate::time::virtual_events::VirtualEvents;
use crate::turn::agent_runner::AgentRunner;
use crate::turn::model::contained;
use metachron_core::{Archive, ArchiveError, Snapshot, archive_values};
use std::sync::Arc;
use std::time::Duration;

/// The parts of a state that agents do not keep to themselves.
pub(super) struct RunState {
    /// For each number whether its agent is there.
    pub present: Vec<bool>,
    /// Of the agents that are there, by rising numbers.
    pub shown: Vec<ShownState>,
    pub sleep: SleepState,
    /// `None` where no broad phase is in use.
    pub broad_phase: Option<BroadPhaseState>,
    pub places: Vec<Place>,
    pub timeline: Timeline,
    pub now: Duration,
    /// Only of a run in virtual time.
    pub events: Option<VirtualEvents>,
}

/// The part of an agent that it shows others, was sent by them or has seen of them.
#[derive(Default)]
pub(super) struct ShownState {
    pub newest: Arc<Snapshot>,
    pub metrics: MetricsValues,
    /// Commands that it has not obeyed yet.
    pub commands: Option<PendingCommands>,
    pub seen: Vec<Seen>,
}

/// The state that an agent kept to itself before another one was read into it.
pub(super) struct OwnState {
    parts: OwnParts,
    /// The bytes of all else.
    rest: Vec<u8>,
}

/// Parts that a state which is read makes anew: they are moved, and not written.
struct OwnParts {
    filled: Option<Arc<Snapshot>>,
    loads: Option<Box<Loads>>,
    neighbour_list: Option<Box<NeighbourList>>,
    steppers: Option<Steppers>,
}

impl RunState {
    /// The state of a run without events to come, at no time, without the internal states of its agents.
    pub fn of(all: &[Option<Placed>], run_agents: &RunAgents) -> Self {
        let present: Vec<bool> = run_agents.handles.iter().map(|agent| !agent.has_left()).collect();
        let there = all.iter().zip(&present).filter(|(_, present)| **present);
        let shown = there.filter_map(|(one, _)| Some(ShownState::of(&one.as_ref()?.runner, &present))).collect();
        let place =
            |one: &Option<Placed>| one.as_ref().filter(|one| !one.has_left()).map_or(Place::Home, |one| one.place);
        Self {
            shown,
            sleep: run_agents.sleep.state(),
            broad_phase: run_agents.peers.broad_phase.state(),
            places: all.iter().map(place).collect(),
            ..Self::empty(present)
        }
    }

    /// One that is to be read.
    pub fn empty(present: Vec<bool>) -> Self {
        let shown = present.iter().filter(|present| **present).map(|_| ShownState::default()).collect();
        let (sleep, timeline) = (SleepState::default(), Timeline::new());
        let (broad_phase, places, now, events) = (None, Vec::new(), Duration::ZERO, None);
        Self { present, shown, sleep, broad_phase, places, timeline, now, events }
    }

    /// Writes or reads it, with the internal states of the agents that are there; all of it fits together then.
    ///
    /// # Errors
    /// The errors of agents; [`ArchiveError::Mismatch`].
    pub fn archive(
        &mut self,
        runners: &mut [Option<&mut AgentRunner>],
        archive: &mut Archive<'_>,
    ) -> Result<(), ArchiveError> {
        for (runner, shown) in runners.iter_mut().flatten().zip(&mut self.shown) {
            runner.archive_own(archive)?;
            shown.archive(archive)?;
        }
        archive_values!(archive, self.sleep, self.broad_phase, self.places, self.timeline, self.now, self.events)?;
        self.check(runners)
    }

    fn check(&self, runners: &[Option<&mut AgentRunner>]) -> Result<(), ArchiveError> {
        let count = self.present.len();
        let mismatch = |what, found: String, expected: String| Err(ArchiveError::Mismatch { what, found, expected });
        let counts = [
            ("the number of agents that may sleep", Some(self.sleep.signals.len())),
            ("the number of agents with phases", self.events.as_ref().map(|events| events.phases.len())),
        ];
        for (what, found) in counts {
            if let Some(found) = found.filter(|found| *found != count) {
                return mismatch(what, found.to_string(), count.to_string());
            }
        }
        if !self.broad_phase.as_ref().is_none_or(|state| state.is_of(count)) {
            return mismatch("the broad phase", "that of other agents".to_owned(), format!("one of {count} agents"));
        }
        if let Some(agent) = self.events.iter().flat_map(VirtualEvents::owners).find(|owner| *owner as usize >= count) {
            return mismatch("the number of an agent with a turn", agent.to_string(), format!("below {count}"));
        }
        if !self.timeline.is_sound() {
            return mismatch("the timeline", format!("{:?}", self.timeline), "one that can be in force".to_owned());
        }
        if let Some(turn) = self.events.as_ref().and_then(|events| events.impossible_turn(self.now)) {
            return mismatch(
                "a turn in progress",
                format!("{turn:?}"),
                "one that began before, and has its jobs".to_owned(),
            );
        }
        if !self.shown.iter().all(|shown| shown.metrics.is_sound()) {
            return mismatch("the condition of an agent", "none".to_owned(), "one that agents can be in".to_owned());
        }
        for (runner, shown) in runners.iter().flatten().zip(&self.shown) {
            runner.observer.check_seen(&shown.seen, &self.present)?;
        }
        let runners: Vec<_> = runners.iter().map(Option::as_deref).collect();
        check_places(&self.places, &runners)
    }
}

impl ShownState {
    pub fn of(runner: &AgentRunner, present: &[bool]) -> Self {
        Self {
            newest: runner.shared.slot.latest(),
            metrics: runner.shared.gauges.values(),
            commands: runner.shared.mail.waiting(),
            seen: runner.observer.seen(present),
        }
    }

    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.snapshot(&mut self.newest)?;
        archive_values!(archive, self.metrics, self.commands)?;
        archive.list(&mut self.seen, Seen::default, Seen::archive)
    }
}

impl AgentRunner {
    /// Writes or reads its internal state, in place, without the agents that it leads.
    ///
    /// # Errors
    /// The errors of its model and its governor, also where one of them panics.
    pub(super) fn archive_own(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let shared = Arc::clone(&self.shared);
        archive.within(format_args!("agent \"{}\"", shared.name()), |archive| caught(|| self.archive_parts(archive)))
    }

    fn archive_parts(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.model.archive(archive)?;
        archive_values!(archive, self.pace, self.loads, self.open, self.was_near, self.withheld)?;
        archive_values!(archive, self.announced, self.turn_period)?;
        self.led.archive(archive)?;
        self.metrics.archive(archive)?;
        archive.fixed("whether it has a governor", self.governor.is_some())?;
        self.governor.iter_mut().try_for_each(|governor| governor.archive(archive))?;
        archive.fixed("whether it is a member of clusters", self.cluster.is_some())?;
        self.cluster.iter_mut().try_for_each(|member| member.archive(archive))?;
        archive.option(self.writer.filled_mut(), Arc::default, |state, archive| archive.snapshot(state))?;
        self.observer.archive(archive)
    }

    /// Takes the parts out of it that a state is read into; [`Self::take_back`] makes it from them as it is now.
    ///
    /// # Errors
    /// The errors of [`Self::archive_own`]; it is as it was then.
    pub(super) fn take_own(&mut self) -> Result<OwnState, ArchiveError> {
        let (parts, mut archive) = (self.take_parts(), Archive::writer());
        match self.archive_own(&mut archive) {
            Ok(()) => Ok(OwnState { parts, rest: archive.into_bytes() }),
            Err(error) => {
                self.put_parts(parts);
                Err(error)
            }
        }
    }

    /// Makes it as it was when that was taken.
    ///
    /// # Errors
    /// Where its model fails to read its own state.
    pub(super) fn take_back(&mut self, own: OwnState) -> Result<(), ArchiveError> {
        let read = self.archive_own(&mut Archive::reader(&own.rest));
        self.put_parts(own.parts);
        read
    }

    /// Puts back the parts that were taken, where nothing was read since.
    pub(super) fn keep_own(&mut self, own: OwnState) {
        self.put_parts(own.parts);
    }

    fn take_parts(&mut self) -> OwnParts {
        OwnParts {
            filled: self.writer.filled_mut().take(),
            loads: self.loads.take(),
            neighbour_list: self.observer.neighbour_list_mut().take(),
            steppers: self.cluster.as_mut().map(|member| member.take_steppers()),
        }
    }

    fn put_parts(&mut self, parts: OwnParts) {
        let OwnParts { filled, loads, neighbour_list, steppers } = parts;
        *self.writer.filled_mut() = filled;
        self.loads = loads;
        *self.observer.neighbour_list_mut() = neighbour_list;
        if let (Some(member), Some(steppers)) = (&mut self.cluster, steppers) {
            member.put_steppers(steppers);
        }
    }
}

/// Runs `visit`; a panic in the code of a model is an error.
pub(super) fn caught<T>(visit: impl FnOnce() -> Result<T, ArchiveError>) -> Result<T, ArchiveError> {
    contained(|| Ok(visit())).unwrap_or_else(|reason| Err(ArchiveError::Panicked { reason }))
}
