//! A run on one thread that makes the turns of a run in real time again, to the bit.
//!
//! In: agents, the parts of their turns in the order in which they were made ([`crate::turn::turn_order`]), the calls in
//! between. Out: the states that they had. Time is what the readings of the clock say. Never here: when a turn is due,
//! how the calls are read.

use super::archive::{Absent, Cut};
use crate::Run;
use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::agents::Agents;
use crate::agent::agents::RunAgents;
use crate::agent::handle::AgentHandle;
use crate::agent::spawn::{AssembledRun, RunError, assemble};
use crate::cluster::{SolveBound, close_remaining, hand_over, put_back, take_apart};
use crate::commands::mailbox::SendError;
use crate::records::metrics::AgentStats;
use crate::records::turns::Took;
use crate::time::agent_clock::{Timeline, TimelineCommand};
use crate::turn::agent_runner::{AgentRunner, Next, StepOutcome};
use crate::turn::helpers::Helpers;
use crate::turn::turn_order::{PartKind, TurnPart};
use crate::turn::turn_parts::{Prepared, PreparedTurn};
use crate::turn::watchdog::UnwatchedTurns;
use metachron_core::{AgentId, Archive, ArchiveError, SimTime};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Agents that repeat the turns of others.
pub struct Follower {
    timeline: Timeline,
    now: Duration,
    followed: Vec<Followed>,
    all: RunAgents,
    unwatched: Arc<UnwatchedTurns>,
    parts: u64,
}

/// An agent, and where in a turn it is.
#[derive(Default)]
struct Followed {
    /// `None` while another agent leads it.
    actor: Option<Box<AgentRunner>>,
    /// A turn with its step, of which nothing is shown yet.
    turn: Option<(PreparedTurn, Result<StepOutcome, String>)>,
    /// It wants to be led by this one.
    joins: Option<AgentId>,
}

impl Follower {
    /// Begins at wall time zero; time stands.
    ///
    /// # Errors
    /// [`RunError`] for agents that cannot run as asked.
    pub fn start(spawns: Vec<AgentSpawn>) -> Result<Self, RunError> {
        let AssembledRun { actors, all } = assemble(spawns, Helpers::none())?;
        all.set_ordered();
        let followed = actors.into_iter().map(|actor| Followed { actor, ..Followed::default() }).collect();
        let timeline = Timeline::new().after(Duration::ZERO, TimelineCommand::Pause);
        let unwatched = UnwatchedTurns::new(&all.handles);
        Ok(Self { timeline, now: Duration::ZERO, followed, all, unwatched, parts: 0 })
    }

    /// From now on time passes by `timeline`.
    pub fn set_timeline(&mut self, timeline: Timeline) {
        self.timeline = timeline;
    }

    /// Makes a part of a turn.
    ///
    /// # Errors
    /// Why it cannot have been made here: the run is not the one that it is to follow.
    pub fn make(&mut self, part: TurnPart) -> Result<(), String> {
        let TurnPart { kind, agent, wall, factors_max } = part;
        let unknown = || format!("there is no agent {} that could make a turn at {:.6} s", agent.0, wall.as_secs_f64());
        let handle = self.all.handles.of(agent).ok_or_else(unknown)?;
        let followed = self.followed.get_mut(agent.0 as usize).ok_or_else(unknown)?;
        if followed.actor.is_none() {
            followed.actor = handle.take_returned();
        }
        self.now = wall;
        self.parts += 1;
        let turn = self.unwatched.begin(self.parts, agent, Instant::now());
        let done = match kind {
            PartKind::Prepare => followed.prepare(&self.timeline, wall, SolveBound::Given(factors_max)),
            PartKind::Show => followed.show(&self.timeline, wall),
            PartKind::Wake => followed.wake(&self.timeline, wall),
            PartKind::Join => followed.join(),
            PartKind::Restore => None,
        };
        self.unwatched.end(turn);
        followed.actor = followed.actor.take().and_then(AgentRunner::kept);
        let name = handle.name();
        done.ok_or_else(|| {
            format!("at {:.6} s \"{name}\" is in no state in which it could {kind:?}", wall.as_secs_f64())
        })
    }

    /// Puts all into the state in `archive`, as a run in real time did whose clock read `wall`.
    ///
    /// # Errors
    /// The errors of [`Run::archive`].
    pub fn restore(
        &mut self,
        archive: &mut Archive<'_>,
        wall: Duration,
        absent: Absent<'_>,
    ) -> Result<(), ArchiveError> {
        self.now = wall;
        self.cut(|cut| cut.archive_in_real_time(archive, absent))
    }

    /// Takes up an agent as [`Run::add`] does, which begins at `at`.
    ///
    /// # Errors
    /// The errors of [`Run::add`].
    pub fn add_at(&mut self, spawn: AgentSpawn, at: SimTime) -> Result<AgentHandle, RunError> {
        let actor = self.all.join(spawn, at)?;
        let handle = self.all.handles[actor.id().0 as usize].clone();
        self.followed.push(Followed { actor: Some(actor), ..Followed::default() });
        Ok(handle)
    }

    fn cut(&mut self, act: impl FnOnce(&mut Cut) -> Result<(), ArchiveError>) -> Result<(), ArchiveError> {
        if let Some(open) =
            self.followed.iter().find_map(|followed| followed.turn.as_ref().and(followed.actor.as_ref()))
        {
            let what = format!("a replay in the middle of a turn of \"{}\"", open.shared.name());
            return Err(ArchiveError::Refused { what });
        }
        let all = take_apart(self.followed.iter_mut().map(|one| one.actor.take()), &self.all.handles);
        let mut cut = Cut::new(all, self.all.clone(), self.timeline, self.now);
        let outcome = act(&mut cut);
        (self.timeline, self.now) = (cut.timeline, cut.now);
        let homes = put_back(cut.all, &self.all.handles);
        self.followed.resize_with(homes.len(), Followed::default);
        self.followed.iter_mut().zip(homes).for_each(|(one, actor)| *one = Followed { actor, ..Followed::default() });
        outcome
    }

    fn end(&mut self) {
        self.end_turns();
        let actors = self.followed.drain(..).filter_map(|one| one.actor);
        actors.for_each(|mut actor| actor.close_account(&self.timeline, self.now));
        close_remaining(&self.all.handles, &self.timeline, self.now);
    }
}

impl Followed {
    fn prepare(&mut self, timeline: &Timeline, wall: Duration, bound: SolveBound) -> Option<()> {
        let actor = self.actor.as_mut().filter(|actor| !actor.is_parked())?;
        self.turn = None;
        match actor.prepare(timeline, wall, bound) {
            Prepared::Parked => {}
            Prepared::Waits(_) => self.finish(timeline, wall, Duration::ZERO),
            Prepared::Steps(turn) => {
                let made = actor.solve(&turn);
                self.turn = Some((turn, made));
            }
        }
        Some(())
    }

    fn show(&mut self, timeline: &Timeline, wall: Duration) -> Option<()> {
        let actor = self.actor.as_mut()?;
        match self.turn.take() {
            Some((turn, made)) => {
                if actor.complete(&turn, made).is_some() {
                    self.finish(&turn.timeline, wall, wall.saturating_sub(turn.wall));
                }
            }
            // a turn of a run in lockstep, whose state was put in
            None if actor.open.is_some() => self.finish(timeline, wall, Duration::ZERO),
            None => return None,
        }
        Some(())
    }

    fn wake(&mut self, timeline: &Timeline, wall: Duration) -> Option<()> {
        self.actor.as_mut()?.try_wake(timeline, wall).then_some(())
    }

    fn finish(&mut self, timeline: &Timeline, wall: Duration, took: Duration) {
        let took_s = took.as_secs_f64();
        let took = Took { begun: wall.saturating_sub(took), ended: wall };
        let next = self.actor.as_mut().map(|actor| actor.finish(timeline, took, took_s));
        self.joins = if let Some(Next::Join(leader)) = next { Some(leader) } else { None };
    }

    fn join(&mut self) -> Option<()> {
        let leader = self.joins.take()?;
        self.actor = hand_over(self.actor.take()?, leader).err();
        Some(())
    }
}

impl Drop for Follower {
    fn drop(&mut self) {
        self.end();
    }
}

impl Run for Follower {
    fn now(&self) -> Duration {
        self.now
    }

    /// Time passes, and nothing happens: turns are made by [`Self::make`] alone.
    fn wait_until(&mut self, until: Duration) {
        self.now = self.now.max(until);
    }

    fn spend(&mut self, _work: Duration) {}

    fn timeline(&self) -> Timeline {
        self.timeline
    }

    fn set_stall_limit(&mut self, limit: Duration) {
        self.unwatched.set_limit(limit);
    }

    fn drive(&mut self, drive: TimelineCommand) {
        self.timeline = self.timeline.after(self.now, drive);
    }

    fn agents(&self) -> &Agents {
        &self.all.handles
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        self.add_at(spawn, self.sim_now())
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        let home = self.followed.get_mut(id.0 as usize).map(|one| &mut one.actor);
        self.all.leave(id, home.unwrap_or(&mut None))
    }

    /// In the middle of a turn its state cannot be written.
    fn archive(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.cut(|cut| cut.archive_whole(archive, absent))
    }

    /// No turn is in progress between two calls.
    fn end_turns(&mut self) {
        self.all.sleep.end();
    }

    fn shutdown(mut self: Box<Self>) -> Vec<AgentStats> {
        self.end();
        self.all.handles.iter().map(AgentHandle::stats).collect()
    }
}
