//! The state of agents and of a run, written and read back: all that the next bit needs.
//!
//! In: an archive, a run between two turns. Out: the same run later, or another of the same agents; of a state that is refused nothing, and
//! the run as it was. Never here: files, what models save of themselves ([`metachron_contact::Agent::archive`]). Not saved: CPU times,
//! percentiles, samples of watched points, storage.

mod migration;
mod state;

use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::agents::RunAgents;
use crate::agent::handle::AgentHandle;
use crate::cluster::{Place, Placed};
use crate::records::events::EventKind;
use crate::time::agent_clock::Timeline;
use crate::time::virtual_events::VirtualEvents;
use crate::turn::agent_runner::AgentRunner;
use crate::turn::turn_order::{PartKind, TurnOrder};
use metachron_core::{AgentId, Archive, ArchiveError};
pub(super) use migration::Migration;
use state::{OwnState, RunState, caught};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Makes an agent that joined the run of a state which is read, and that is not in the run which reads it: its spawn,
/// by its number.
pub type Absent<'a> = &'a mut dyn FnMut(AgentId) -> Result<AgentSpawn, ArchiveError>;

/// A run in real time, which is saved and recorded between turns.
pub(super) trait CutBetweenTurns {
    /// Ends all turns in progress, does something with the agents and the order of their turns, and lets them go on.
    fn cut(
        &mut self,
        act: impl FnOnce(&mut Cut, &mut Option<Arc<TurnOrder>>) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError>;

    /// The agents of the run, as it knows them.
    fn agents_of_run(&self) -> &RunAgents;

    /// [`crate::Run::archive`].
    fn archive_between_turns(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.cut(|cut, order| cut.archive_in_order(archive, order.as_deref(), absent))
    }

    /// [`crate::Run::record`].
    fn record_between_turns(
        &mut self,
        order: Arc<TurnOrder>,
        begun: Option<&mut Archive<'_>>,
    ) -> Result<(), ArchiveError> {
        self.agents_of_run().set_ordered();
        self.cut(|cut, mine| {
            begun.map_or(Ok(()), |archive| cut.archive_in_real_time(archive, &mut refuse_absent))?;
            *mine = Some(order);
            Ok(())
        })
    }
}

/// All agents of a run, taken from their places, and the time.
pub(crate) struct Cut {
    /// By their numbers; `None` of one that has left and is not kept.
    pub all: Vec<Option<Placed>>,
    pub run_agents: RunAgents,
    pub timeline: Timeline,
    pub now: Duration,
    /// The most agents that the executor can run.
    pub most: usize,
}

/// Agents that are not in the run, made for a state that has them, by their numbers.
type Made = BTreeMap<usize, Box<AgentRunner>>;

/// The state that each agent kept to itself before another one was read into it, by numbers.
type OwnStates = Vec<(usize, OwnState)>;

impl Cut {
    /// The agents of `run_agents`, taken from their places.
    pub const fn new(all: Vec<Option<Placed>>, run_agents: RunAgents, timeline: Timeline, now: Duration) -> Self {
        Self { all, run_agents, timeline, now, most: usize::MAX }
    }

    /// Writes or reads agents, places, time and the pending `events` of executors in virtual time; returns the events
    /// of a state that was read.
    ///
    /// # Errors
    /// The errors of [`crate::Run::archive`]; all is as it was then.
    pub fn archive(
        &mut self,
        archive: &mut Archive<'_>,
        absent: Absent<'_>,
        events: Option<VirtualEvents>,
    ) -> Result<Option<VirtualEvents>, ArchiveError> {
        let handles = &self.run_agents.handles;
        if self.all.iter().zip(handles).any(|(placed, agent)| placed.is_none() && agent.live().is_some()) {
            let what = "an agent whose step does not end, or whose thread panicked,";
            return Err(ArchiveError::Refused { what: what.to_owned() });
        }
        if archive.is_reading() {
            return self.read(archive, absent);
        }
        let Self { all, run_agents, timeline, now, .. } = self;
        let mut state = RunState { timeline: *timeline, now: *now, events, ..RunState::of(all, run_agents) };
        archive.value(&mut state.present)?;
        let mut none = Made::new();
        let mut runners = runners_of(&mut self.all, &mut none, &state.present);
        state.archive(&mut runners, archive)?;
        Ok(None)
    }

    /// Reads and checks a state whole, and only then shows anything of it. The internal states of agents are read in
    /// place: where the state is refused the agents take their former ones back.
    fn read(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<Option<VirtualEvents>, ArchiveError> {
        let mut present = Vec::new();
        archive.value(&mut present)?;
        let mut made = self.make(&present, absent)?;
        let own = self.take_own(&present)?;
        let mut state = RunState::empty(present);
        let mut runners = runners_of(&mut self.all, &mut made, &state.present);
        let read = caught(|| state.archive(&mut runners, archive).and_then(|()| archive.finish()));
        if let Err(error) = read {
            drop(runners);
            self.take_back(own);
            return Err(error);
        }
        // before they are found: nobody finds one that is back in a state of another time
        for (runner, shown) in runners.into_iter().flatten().zip(&state.shown) {
            runner.writer.replace(Arc::clone(&shown.newest));
            runner.shared.gauges.set_values(&shown.metrics);
        }
        self.admit(&state.present, made);
        self.show(&mut state);
        (self.timeline, self.now) = (state.timeline, state.now);
        Ok(state.events)
    }

    /// Makes the agents that are `present` in a state and not in the run.
    fn make(&self, present: &[bool], absent: Absent<'_>) -> Result<Made, ArchiveError> {
        let Self { all, run_agents, most, .. } = self;
        let mismatch = |what, found, expected| ArchiveError::Mismatch { what, found, expected };
        let numbers = || present.iter().enumerate().filter(|(_, present)| **present).map(|(at, _)| at);
        if numbers().count() > *most {
            return Err(mismatch("the number of agents", numbers().count().to_string(), format!("at most {most}")));
        }
        let mut made = Made::new();
        // one that is there, or that left and is kept, is not absent
        for at in numbers().filter(|at| all.get(*at).is_none_or(Option::is_none)) {
            let id = AgentId(at as u32);
            let runner = caught(|| {
                let spawn = absent(id)?;
                let joins = run_agents.check_joining(&spawn);
                joins
                    .map_err(|error| mismatch("an agent that joined", error.to_string(), "one that can".to_owned()))?;
                Ok(run_agents.revive(id, spawn))
            });
            made.insert(at, runner?);
        }
        Ok(made)
    }

    /// Takes the internal states out of the agents that a state is read into.
    ///
    /// # Errors
    /// The errors of agents that do not save it; all have it then.
    fn take_own(&mut self, present: &[bool]) -> Result<OwnStates, ArchiveError> {
        let mut own = OwnStates::new();
        for at in (0..self.all.len()).filter(|at| present.get(*at) == Some(&true)) {
            let Some(placed) = &mut self.all[at] else { continue };
            match placed.runner.take_own() {
                Ok(taken) => own.push((at, taken)),
                Err(error) => {
                    for (at, own) in own {
                        if let Some(placed) = &mut self.all[at] {
                            placed.runner.keep_own(own);
                        }
                    }
                    return Err(error);
                }
            }
        }
        Ok(own)
    }

    /// Puts the internal states back that were taken. An agent whose model fails to read its own state is parked.
    fn take_back(&mut self, own: OwnStates) {
        for (at, own) in own {
            if let Some(Err(error)) = self.all[at].as_mut().map(|placed| placed.runner.take_back(own)) {
                self.park(at, &error.to_string());
            }
        }
    }

    /// Parks an agent: it makes its own turns then, none, and so do the agents that it led.
    pub fn park(&mut self, at: usize, reason: &str) {
        let (id, sleep) = (AgentId(at as u32), &self.run_agents.sleep);
        if self.all.get(at).is_none_or(Option::is_none) {
            // its leader makes a step that does not end, and lets it return after that
            let live = self.run_agents.handles.of(id).and_then(AgentHandle::live);
            live.into_iter().for_each(|shared| shared.gauges.park(reason.to_owned()));
        }
        for Placed { runner, place } in self.all.iter_mut().flatten() {
            let is_led = matches!(*place, Place::Led { leader, .. } | Place::Waiting { leader, .. } if leader == id);
            if runner.id() == id {
                *place = Place::Home;
                runner.park(reason.to_owned());
            } else if is_led {
                *place = Place::Returning;
            } else {
                continue;
            }
            sleep.follow(runner.id(), None);
            sleep.notify(runner.id());
        }
    }

    /// Takes the agents into the run that are `present` in the state which was read, and takes all others out.
    fn admit(&mut self, present: &[bool], made: Made) {
        let Self { all, run_agents, .. } = self;
        run_agents.reach(present.len(), |at| made.get(&at).map(|runner| &runner.shared));
        all.resize_with(run_agents.handles.len(), || None);
        for (at, runner) in made {
            run_agents.handles[at].record.begin(&runner.shared);
            all[at] = Some(Placed { runner, place: Place::Home });
        }
        let present = present.iter().copied().chain(std::iter::repeat(false));
        for ((one, agent), present) in all.iter_mut().zip(&run_agents.handles).zip(present) {
            if present {
                agent.record.set_left(false);
                continue;
            }
            if let Some(placed) = one.as_mut().filter(|placed| !placed.has_left()) {
                placed.runner.take_out();
            }
            *one = one.take().and_then(Placed::kept);
        }
    }

    /// Shows the state that was read, once all agents are there. Commands come after the sleep states: one that is sent
    /// meanwhile wakes the agent that is to obey it.
    fn show(&mut self, state: &mut RunState) {
        let Self { all, run_agents: RunAgents { peers, sleep, .. }, .. } = self;
        for (one, present) in all.iter_mut().zip(&state.present) {
            // where its model panics its next turn parks it
            one.iter_mut().filter(|_| *present).for_each(|placed| drop(placed.runner.publish_form()));
        }
        peers.broad_phase.set_state(state.broad_phase.as_ref(), all.len());
        sleep.set_state(&state.sleep);
        let places = state.places.iter().copied().chain(std::iter::repeat(Place::Home));
        all.iter_mut().zip(places).for_each(|(one, place)| one.iter_mut().for_each(|one| one.place = place));
        let there = all.iter_mut().zip(&state.present).filter(|(_, present)| **present);
        for (Placed { runner, .. }, shown) in there.filter_map(|(one, _)| one.as_mut()).zip(&mut state.shown) {
            runner.observer.see(peers, &shown.seen);
            runner.shared.mail.replace(shown.commands.take());
            if runner.shared.mail.has_pending() && !sleep.is_woken(runner.id()) {
                sleep.wake(runner.id());
            }
            runner.record_rewound();
        }
    }

    /// As [`Self::archive`], of a run in real time, which has no events to come.
    pub fn archive_whole(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.archive(archive, absent, None).map(drop)
    }

    /// As [`Self::archive_in_real_time`], of a run whose turns are noted in `order`.
    pub fn archive_in_order(
        &mut self,
        archive: &mut Archive<'_>,
        order: Option<&TurnOrder>,
        absent: Absent<'_>,
    ) -> Result<(), ArchiveError> {
        self.archive_in_real_time(archive, absent)?;
        let noted = order.filter(|_| archive.is_reading());
        noted.inspect(|order| order.hold().note(PartKind::Restore, AgentId(0), self.now));
        Ok(())
    }

    /// The same for an executor in real time, whose clock reads the present `now`: its time passes or stands as before.
    pub fn archive_in_real_time(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        let (wall, own) = (self.now, self.timeline);
        self.archive_whole(archive, absent)?;
        if !archive.is_reading() {
            return Ok(());
        }
        self.all.iter_mut().flatten().for_each(|placed| placed.runner.rebase(wall));
        let sim = self.timeline.sim_at(self.now);
        (self.timeline, self.now) = (own.set_to(wall, wall, sim, &self.timeline), wall);
        Ok(())
    }
}

/// The error of a state that is not one of this run.
fn refuse_other(what: &'static str, found: &str, expected: &str) -> ArchiveError {
    ArchiveError::Mismatch { what, found: found.to_owned(), expected: expected.to_owned() }
}

/// Says that no agent is absent: for writing, and for runs of the same agents.
///
/// # Errors
/// [`ArchiveError::Mismatch`].
pub(crate) fn refuse_absent(id: AgentId) -> Result<AgentSpawn, ArchiveError> {
    let (found, expected) = (format!("number {}", id.0), "one of this run".to_owned());
    Err(ArchiveError::Mismatch { what: "an agent that joined", found, expected })
}

/// The runners of the agents that are `present` in a state, for each number: the run's own, and runners made for the
/// state.
fn runners_of<'a>(
    all: &'a mut [Option<Placed>],
    made: &'a mut Made,
    present: &[bool],
) -> Vec<Option<&'a mut AgentRunner>> {
    let mut made = made.iter_mut().peekable();
    let mut all = all.iter_mut();
    let runner = |(at, present): (usize, &bool)| {
        let here = all.next().and_then(Option::as_mut).map(|placed| &mut *placed.runner);
        let made = made.next_if(|(number, _)| **number == at).map(|(_, runner)| &mut **runner);
        here.or(made).filter(|_| *present)
    };
    present.iter().enumerate().map(runner).collect()
}

impl AgentRunner {
    /// Tells readers of its events that it went back, and its contacts in the state that it went back to.
    fn record_rewound(&self) {
        self.record_event(EventKind::Rewound);
        self.cluster.iter().for_each(|member| member.record_contacts(self.pace.time(), &self.shared.streams));
    }
}

impl Placed {
    /// Whether its agent has left.
    fn has_left(&self) -> bool {
        self.runner.shared.gauges.has_left()
    }

    pub fn kept(self) -> Option<Self> {
        self.runner.kept().map(|runner| Self { runner, ..self })
    }
}
