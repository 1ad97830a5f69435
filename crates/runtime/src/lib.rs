//! Execution of agents: threads, clocks, slots and pacing.
//!
//! In: agents with their rates and links ([`AgentSpawn`]). Out: [`AgentHandle`]s with their newest states and statistics.
//! Never here: a model of physics, a picture, a control law, a file.
//!
//! Every executor makes the same turns of an agent behind the same interface, [`Run`], so that there is one frame loop: [`Threads`]
//! gives each agent its own thread and real time; [`Pool`] shares a few threads among thousands; [`Lockstep`] runs all in virtual time
//! on a declared [`Machine`], bit-identical from run to run. Agents near enough to touch see each other without being linked (`broad_phase`),
//! and agents that may touch or are tied step as one problem, a cluster, in the turns of one of them (`cluster`).
//!
//! ```
//! use glam::DVec3;
//! use metachron_geometry::Solid;
//! use metachron_models::rigid::{RigidBody, RigidSpec};
//! use metachron_runtime::{AgentSpawn, Lockstep, Machine, Run};
//! use std::time::Duration;
//!
//! let ball = RigidSpec::free(Solid::Ball { radius_m: 0.1 }, DVec3::ZERO, 1.0);
//! let ball = RigidBody::new(RigidSpec { velocity: DVec3::X, ..ball }).unwrap();
//! let spawn = AgentSpawn::alone("ball", Box::new(ball), 100.0);
//! let mut run = Lockstep::start(vec![spawn], Machine::two_cores_software()).unwrap();
//! run.wait_until(Duration::from_secs(2));
//! let state = run.agents()[0].latest();
//! let (position, t) = (state.body.probe(0.0).unwrap().0, state.time.as_secs_f64());
//! assert!(t >= 1.99 && (position.x - t).abs() < 1e-9); // 1 m/s, for the agent's own time
//! ```

mod agent;
mod cluster;
mod commands;
mod executors;
mod lock_free;
mod neighbours;
mod records;
mod time;
mod turn;

pub use agent::agent_spawn::{AgentSpawn, RATE_MAX_HZ};
pub use agent::agents::Agents;
pub use agent::handle::{AgentHandle, state_hash};
pub use agent::reader::Reader;
pub use agent::spawn::RunError;
pub use commands::bounds::{Bound, OutOfBounds, check_state};
pub use commands::mailbox::{AwaitedMotion, Command, KEYS, Keyed, SendError};
pub use executors::archive::Absent;
pub use executors::follower::Follower;
pub use executors::ghosts::Ghosts;
pub use executors::lockstep::Lockstep;
pub use executors::pool::Pool;
pub use executors::priority::{Priority, PriorityRefused, ask_priority, take_priority};
pub use executors::side_by_side::{on_a_thread, side_by_side};
pub use executors::threads::{AUTO_THREADS_MAX, THREADS_MAX, Threads};
pub use lock_free::slot::{LatestSlot, SlotWriter};
pub use neighbours::broad_phase::Reach;
pub use records::events::{AgentEvent, ContactEvent, EVENTS_KEPT, EventKind};
pub use records::governor::{Demand, Governor, TurnMeasure};
pub use records::histogram::Percentiles;
pub use records::metrics::{AgentState, AgentStats, STALLED_FOR_GOOD};
pub use records::probe::{SAMPLES_MAX, Sample, WatchedPoint};
pub use records::streams::StreamReader;
pub use records::turns::{TURNS_KEPT, Turn};
pub use time::agent_clock::{AgentClock, LAG_CAP, SPEED_RANGE, SharedTimeline, Start, Timeline, TimelineCommand};
pub use time::clock::{Clock, ManualClock, SystemClock, wait_until};
pub use time::faults::Faults;
pub use time::machine::{DrawPrice, FACTOR, Machine, OTHER_STEP_US, ObjectPrice, PRESETS, StepPrice};
pub use turn::turn_order::{Held, OrderLog, PartKind, TurnOrder, TurnPart};

use executors::archive::refuse_absent;
use metachron_core::{AgentId, Archive, ArchiveError, SimTime};
use std::sync::Arc;
use std::time::Duration;

/// A run of agents, on any executor.
pub trait Run: Send {
    /// Wall time since the run began; virtual in lockstep.
    fn now(&self) -> Duration;

    /// Waits until the wall time `until`, while the agents run; returns immediately if that has passed.
    fn wait_until(&mut self, until: Duration);

    /// Lets the frame's own work of `work` pass: nothing on threads, where it really passed; in lockstep it occupies a core of the declared
    /// machine, and takes longer if agents compete for the cores.
    fn spend(&mut self, work: Duration);

    /// The timeline in force.
    fn timeline(&self) -> Timeline;

    /// Sets how long a turn of one agent may last, wall time, > 0, before the agent counts as stalled ([`AgentState::Stalled`]): 250 ms, but ten
    /// of its steps at least, and a cluster's so many times as long as it has members, 25 at most. In lockstep, whose turns are its caller's, other
    /// threads that ask for an agent's state judge the turn in progress.
    fn set_stall_limit(&mut self, limit: Duration);

    /// Changes the timeline: pause, run, speed, single step.
    fn drive(&mut self, drive: TimelineCommand);

    /// All agents that have ever been in the run, in the order of their numbers.
    fn agents(&self) -> &Agents;

    /// Takes up another agent, under the next number: it begins at the timeline's present. The others step on meanwhile.
    ///
    /// # Errors
    /// [`RunError`] for an agent that cannot run as requested, for one that is tied to others, and where there are too many; nothing was done
    /// then.
    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError>;

    /// Takes an agent out, at its next turn: nothing of it is left then but its number.
    ///
    /// # Errors
    /// [`SendError::NoAgent`].
    fn remove(&mut self, id: AgentId) -> Result<(), SendError>;

    /// Lets no further turn begin and waits for turns in progress (with a timeout): all that a recording of the run is
    /// to have has happened then. From now on commands are refused ([`SendError::Ended`]).
    fn end_turns(&mut self);

    /// Ends the run: waits for the turns in progress (with a timeout) and returns every agent's statistics. Existing handles keep showing
    /// the last states.
    fn shutdown(self: Box<Self>) -> Vec<AgentStats>;

    /// Writes the state of the run and of all its agents to an archive, or reads it from one into a run of the same first agents, which then
    /// goes on as that run did; in lockstep to the bit. Agents that joined since are taken out, agents that left since
    /// are put back: an agent that joined the run of the state and is not in this one is made by `absent`. In real time
    /// all turns in progress end first, each agent at a time of its own, and the clock goes on from where it is.
    /// Watched points keep their samples. A state that one executor has written another can read.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] where a step does not end within the time that it may last ([`Run::set_stall_limit`]), and by agents and governors
    /// that do not save their state; any other for a state that is not one of this run, or that a model does not read. The run goes on as it was
    /// then: all is read and checked before anything is shown.
    fn archive(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError>;

    /// Writes the state of the run ([`Run::archive`]).
    ///
    /// # Errors
    /// The errors of [`Run::archive`].
    fn save(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.archive(archive, &mut refuse_absent)
    }

    /// Makes the parts of its turns in `order` from now on, which begins between two turns; before it does, writes its state to `begun` if
    /// that is given. In lockstep the order follows from the calls, and is not noted. A caller that holds `order` keeps
    /// turns from going on, but does not keep this from returning.
    ///
    /// # Errors
    /// The errors of [`Run::archive`]; the order is not noted then.
    fn record(&mut self, order: Arc<TurnOrder>, begun: Option<&mut Archive<'_>>) -> Result<(), ArchiveError> {
        drop(order);
        begun.map_or(Ok(()), |archive| self.save(archive))
    }

    /// The run in lockstep, which several processes can make together ([`Lockstep::release`]); `None` of a run in real time.
    fn as_lockstep(&mut self) -> Option<&mut Lockstep> {
        None
    }

    /// Simulated time now.
    fn sim_now(&self) -> SimTime {
        self.timeline().sim_at(self.now())
    }

    /// Sends a command to an agent ([`AgentHandle::send`]).
    ///
    /// # Errors
    /// [`SendError`]: nothing was delivered.
    fn send(&self, to: AgentId, command: Command) -> Result<(), SendError> {
        self.agents().of(to).ok_or(SendError::NoAgent(to))?.send(command)
    }
}
