//! The state of agents and of a lockstep run, written and read back: all that the next bit needs.
//!
//! In: an archive, a run between two events. Out: the same run later, or another of the same agents. Never here: files, what models
//! save of themselves ([`metachron_contact::Agent::archive`]). Not saved: CPU times, percentiles, samples of watched points, storage.

use super::agent_clock::Timeline;
use super::agent_runner::AgentRunner;
use super::cluster::{Place, Placed, check_places};
use super::handle::Shared;
use super::lockstep::Phase;
use super::sleep::SleepRegistry;
use super::spawn::{AgentSpawn, RunAgents};
use super::turn_order::{PartKind, TurnOrder};
use metachron_core::{AgentId, Archive, ArchiveError, archive_values};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;
use std::time::Duration;

impl AgentRunner {
    /// Writes or reads it, without the agents that it leads.
    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.model.archive(archive)?;
        if self.model.broken().is_none() {
            self.publish_form().map_err(|reason| ArchiveError::Refused { what: format!("a model that {reason}") })?;
        }
        archive_values!(archive, self.pace, self.loads, self.open, self.was_near, self.withheld)?;
        archive_values!(archive, self.announced, self.turn_period)?;
        self.led.archive(archive)?;
        self.metrics.archive(archive)?;
        archive.fixed("whether it has a governor", self.governor.is_some())?;
        self.governor.iter_mut().try_for_each(|governor| governor.archive(archive))?;
        archive.fixed("whether it is a member of clusters", self.cluster.is_some())?;
        self.cluster.iter_mut().try_for_each(|seat| seat.archive(archive))?;
        self.archive_states(archive)
    }

    /// The states that it has published and written, and those of others that it has seen.
    fn archive_states(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let Self { writer, observer, peers, .. } = self;
        let mut newest = writer.slot().latest();
        archive.snapshot(&mut newest)?;
        if archive.is_reading() {
            writer.replace(newest);
        }
        archive.option(writer.filled_mut(), Arc::default, |state, archive| archive.snapshot(state))?;
        observer.archive(peers, archive)
    }
}

/// Makes an agent that joined the run of a state which is read, and that is not in the run which reads it: what it joined as, by its number.
pub type Absent<'a> = &'a mut dyn FnMut(AgentId) -> Result<AgentSpawn, ArchiveError>;

/// A run in real time, which is saved and recorded between turns.
pub(super) trait CutBetweenTurns {
    /// Ends all turns in progress, does something with the agents and the order of their turns, and lets them go on.
    fn cut(
        &mut self,
        act: impl FnOnce(&mut Cut, &mut Option<Arc<TurnOrder>>) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError>;

    /// What it knows of its agents.
    fn agents_of_run(&self) -> &RunAgents;

    /// [`super::Run::archive`].
    fn archive_between_turns(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.cut(|cut, order| cut.archive_in_order(archive, order.as_deref(), absent))
    }

    /// [`super::Run::record`].
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
pub(super) struct Cut {
    /// By their numbers; `None` of one that has left and is not kept.
    pub all: Vec<Option<Placed>>,
    pub run_agents: RunAgents,
    /// How many agents the state that was read or written is of, those that had left included: all others have left.
    pub counted: usize,
    pub timeline: Timeline,
    pub now: Duration,
}

impl Cut {
    /// The agents of `run_agents`, taken from their places.
    pub const fn new(all: Vec<Option<Placed>>, run_agents: RunAgents, timeline: Timeline, now: Duration) -> Self {
        Self { all, run_agents, counted: 0, timeline, now }
    }

    /// Writes or reads agents, places and time: what every executor has. What lockstep has besides follows.
    pub fn archive(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        let handles = &self.run_agents.handles;
        if self.all.iter().zip(handles).any(|(placed, agent)| placed.is_none() && agent.live().is_some()) {
            let what = "an agent whose step does not end, or whose thread panicked,";
            return Err(ArchiveError::Refused { what: what.to_owned() });
        }
        let mut present: Vec<bool> = handles.iter().map(|agent| !agent.has_left()).collect();
        archive.value(&mut present)?;
        self.counted = present.len();
        if archive.is_reading() {
            self.admit(&present, absent)?;
        }
        let Self { all, run_agents, counted, timeline, now } = self;
        archive_agents(&mut all[..*counted], &present, archive)?;
        archive_sleep(&run_agents.sleep, *counted, archive)?;
        run_agents.peers.broad_phase.archive(*counted, all.len(), archive)?;
        let of = all[..*counted].iter();
        let mut places: Vec<Place> =
            of.map(|one| one.as_ref().filter(|one| !one.has_left()).map_or(Place::Home, |one| one.place)).collect();
        archive.value(&mut places)?;
        check_places(&places, &all[..*counted])?;
        let places = places.into_iter().chain(std::iter::repeat(Place::Home));
        all.iter_mut().zip(places).for_each(|(one, place)| one.iter_mut().for_each(|one| one.place = place));
        archive_values!(archive, *timeline, *now)
    }

    /// Lets those be in the run that are `present` in the state which is read, and no others. Nothing is changed before all that are absent are
    /// made.
    fn admit(&mut self, present: &[bool], absent: Absent<'_>) -> Result<(), ArchiveError> {
        let Self { all, run_agents, .. } = self;
        let mut made = BTreeMap::new();
        for (at, _) in present.iter().enumerate().filter(|(_, present)| **present) {
            // one that is there, or that left and is kept
            if all.get(at).is_some_and(Option::is_some) {
                continue;
            }
            let spawn = absent(AgentId(at as u32))?;
            run_agents.check_joining(&spawn).map_err(|error| ArchiveError::Mismatch {
                what: "an agent that joined",
                found: error.to_string(),
                expected: "one that can".to_owned(),
            })?;
            made.insert(at, spawn);
        }
        run_agents.reach(present.len());
        all.resize_with(run_agents.handles.len(), || None);
        for (at, spawn) in made {
            all[at] = Some(Placed { runner: run_agents.revive(AgentId(at as u32), spawn), place: Place::Home });
        }
        let there = run_agents.handles.iter().zip(present).filter(|(_, present)| **present);
        there.for_each(|(agent, _)| agent.record.set_left(false));
        let present = present.iter().copied().chain(std::iter::repeat(false));
        for (one, _) in all.iter_mut().zip(present).filter(|(_, present)| !present) {
            if let Some(placed) = one.as_mut().filter(|placed| !placed.has_left()) {
                placed.runner.take_out();
            }
            *one = one.take().and_then(Placed::kept);
        }
        Ok(())
    }

    /// As [`Self::archive`], where no events follow, and none are heard of.
    pub fn archive_whole(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.archive(archive, absent)?;
        let mut events: Option<VirtualEvents> = None;
        archive.option(&mut events, VirtualEvents::default, VirtualEvents::archive)
    }

    /// As [`Self::archive_in_real_time`], of a run whose turns are noted in `order`.
    pub fn archive_in_order(
        &mut self,
        archive: &mut Archive<'_>,
        order: Option<&TurnOrder>,
        absent: Absent<'_>,
    ) -> Result<(), ArchiveError> {
        let noted = order.filter(|_| archive.is_reading());
        noted.inspect(|order| order.hold().note(PartKind::Restore, AgentId(0), self.now));
        self.archive_in_real_time(archive, absent)
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

/// The events to come of a run in virtual time.
#[derive(Default)]
pub(super) struct VirtualEvents {
    /// Due times of turns.
    pub due: BinaryHeap<Reverse<(Duration, u32)>>,
    /// Service of the cores, and the jobs in progress.
    pub served: u128,
    pub jobs: BinaryHeap<Reverse<(u128, u32)>>,
    /// For each agent its phase and how many turns it has made.
    pub phases: Vec<(Phase, u64)>,
}

impl VirtualEvents {
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.due, self.served, self.jobs, self.phases)
    }
}

/// Says that no agent is absent: of what is written, and of runs of the same agents.
///
/// # Errors
/// [`ArchiveError::Mismatch`].
pub(super) fn refuse_absent(id: AgentId) -> Result<AgentSpawn, ArchiveError> {
    let (found, expected) = (format!("number {}", id.0), "one of this run".to_owned());
    Err(ArchiveError::Mismatch { what: "an agent that joined", found, expected })
}

impl Placed {
    fn has_left(&self) -> bool {
        self.runner.shared.gauges.has_left()
    }

    fn kept(self) -> Option<Self> {
        self.runner.kept().map(|runner| Self { runner, ..self })
    }
}

/// Writes or reads the agents of a run that are `present`, by rising numbers.
fn archive_agents(all: &mut [Option<Placed>], present: &[bool], archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
    let there = all.iter_mut().zip(present).filter(|(_, present)| **present);
    for Placed { runner, .. } in there.filter_map(|(one, _)| one.as_mut()) {
        let shared = Arc::clone(&runner.shared);
        archive.within(format_args!("agent \"{}\"", shared.name()), |archive| {
            let Shared { gauges, mail, .. } = &*shared;
            runner.archive(archive)?;
            gauges.archive(archive)?;
            mail.archive(archive)
        })?;
    }
    Ok(())
}

/// Writes or reads who rests and who leads whom, of the first `agents`.
fn archive_sleep(sleep: &SleepRegistry, agents: usize, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
    let mut state = sleep.state();
    archive.value(&mut state)?;
    if !archive.is_reading() {
        return Ok(());
    }
    if state.signals.len() != agents {
        let (found, expected) = (state.signals.len().to_string(), agents.to_string());
        return Err(ArchiveError::Mismatch { what: "the number of agents that may sleep", found, expected });
    }
    sleep.set_state(&state);
    Ok(())
}
