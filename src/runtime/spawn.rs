//! Bringing agents into a run: what is asked is checked, and everybody is told of the others.
//!
//! In: [`AgentSpawn`]s; an agent's number is its place in their list. Out: actors and handles, or a [`RunError`].
//! Never here: threads, time passing.

use super::account::{Diary, Gauges, Times};
use super::governor::Governor;
use super::handle::{AgentHandle, Shared};
use super::mailbox::Mailbox;
use super::pace::Pace;
use super::slot::SlotWriter;
use super::switchboard::Switchboard;
use super::turn::{Actor, Rhythm};
use super::watch::{Trace, Watch};
use metachron_agents::{Agent, AgentId, DT_MAX_S, Neighbour, ResolutionRange, SimSpan, SimTime, Snapshot};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// An agent on its way into a run.
pub struct AgentSpawn {
    /// Its name in the scene.
    pub name: String,
    /// The agent.
    pub agent: Box<dyn Agent>,
    /// Steps a simulated second that are wanted, `0 < rate <=` [`RATE_MAX_HZ`].
    pub rate_hz: f64,
    /// The length of its first step; clamped to `dt_range`.
    pub dt: SimSpan,
    /// The shortest and the longest step it may be given; `0 < shortest <= longest <=` [`DT_MAX_S`].
    pub dt_range: (SimSpan, SimSpan),
    /// The resolutions it may be given; `None` for an agent that is never retuned.
    pub range: Option<ResolutionRange>,
    /// Whose newest states it sees. Its own number and repeats are left out.
    pub links: Vec<AgentId>,
    /// Points of it that are written down ([`AgentHandle::samples`]).
    pub watches: Vec<Watch>,
    /// Who steers its rate; `None` for an agent that keeps what it has.
    pub governor: Option<Box<dyn Governor>>,
}

/// The highest rate that may be wanted: a step of a microsecond is less than a thread needs to wake.
pub const RATE_MAX_HZ: f64 = 1e6;

/// Why a run did not begin. No agent has made a step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// More agents than this executor takes.
    #[error("{agents} agents are too many: one thread each, and at most {most}")]
    TooMany {
        /// How many agents were asked for.
        agents: usize,
        /// How many it takes.
        most: usize,
    },
    /// A rate that is none.
    #[error("agent \"{name}\": the rate of {rate_hz} Hz must be above zero and at most 1e6")]
    BadRate {
        /// The agent's name.
        name: String,
        /// The rate asked for, Hz.
        rate_hz: f64,
    },
    /// A range of step lengths that is none.
    #[error(
        "agent \"{name}\": the step range {shortest_s} s to {longest_s} s must rise, lie above zero and end at 1 s at most"
    )]
    BadStep {
        /// The agent's name.
        name: String,
        /// The shortest step asked for, seconds.
        shortest_s: f64,
        /// The longest step asked for, seconds.
        longest_s: f64,
    },
    /// A link to nobody.
    #[error("agent \"{name}\" is linked to agent {link}, which does not exist")]
    BadLink {
        /// The agent's name.
        name: String,
        /// The number it is linked to.
        link: u32,
    },
    /// The system gave no thread.
    #[error("no thread for agent \"{name}\": {source}")]
    NoThread {
        /// The agent's name.
        name: String,
        /// What the system said.
        source: std::io::Error,
    },
}

/// The agents of a run, before anybody makes them step.
pub(super) struct Company {
    pub actors: Vec<Actor>,
    pub handles: Vec<AgentHandle>,
    pub board: Arc<Switchboard>,
}

/// Brings all agents into a run; each has published the state it starts from, at simulated time zero.
pub(super) fn assemble(spawns: Vec<AgentSpawn>) -> Result<Company, RunError> {
    let count = spawns.len();
    spawns.iter().try_for_each(|spawn| check(spawn, count))?;
    let board = Arc::new(Switchboard::new(count));
    let mut links = Vec::with_capacity(count);
    let mut actors = Vec::with_capacity(count);
    for (spawn, id) in spawns.into_iter().zip(0..) {
        links.push(spawn.links.clone());
        actors.push(actor(AgentId(id), spawn, &board));
    }
    actors.iter_mut().for_each(Actor::introduce);
    for (at, links) in links.iter().enumerate() {
        link(&mut actors, at, links);
    }
    let handles = actors.iter().map(|a| AgentHandle { shared: Arc::clone(&a.shared) }).collect();
    Ok(Company { actors, handles, board })
}

fn check(spawn: &AgentSpawn, agents: usize) -> Result<(), RunError> {
    let name = || spawn.name.clone();
    if !(spawn.rate_hz > 0.0 && spawn.rate_hz <= RATE_MAX_HZ) {
        return Err(RunError::BadRate { name: name(), rate_hz: spawn.rate_hz });
    }
    let (shortest, longest) = spawn.dt_range;
    let (shortest_s, longest_s) = (shortest.as_secs_f64(), longest.as_secs_f64());
    if shortest == SimSpan::ZERO || shortest > longest || longest_s > DT_MAX_S {
        return Err(RunError::BadStep { name: name(), shortest_s, longest_s });
    }
    match spawn.links.iter().find(|link| link.0 as usize >= agents) {
        Some(link) => Err(RunError::BadLink { name: name(), link: link.0 }),
        None => Ok(()),
    }
}

fn actor(id: AgentId, spawn: AgentSpawn, board: &Arc<Switchboard>) -> Actor {
    let writer = SlotWriter::new(Snapshot::default());
    let shared = Shared {
        id,
        name: spawn.name.into(),
        model: spawn.agent.model(),
        wanted_hz: spawn.rate_hz,
        gauges: Gauges::default(),
        mail: Mailbox::new(),
        slot: writer.slot(),
        board: Arc::clone(board),
        ages: Mutex::new(Times::new()),
        traces: Mutex::new(spawn.watches.into_iter().map(Trace::new).collect()),
    };
    Actor {
        shared: Arc::new(shared),
        agent: spawn.agent,
        pace: Pace::new(SimTime::ZERO, spawn.dt.clamp(spawn.dt_range.0, spawn.dt_range.1)),
        dt_range: spawn.dt_range,
        range: spawn.range,
        governor: spawn.governor,
        writer,
        links: Vec::new(),
        neighbours: Vec::new(),
        hands: Vec::with_capacity(1),
        diary: Diary::new(),
        rhythm: Rhythm::default(),
        open: None,
        unsettled: Duration::ZERO,
    }
}

fn link(actors: &mut [Actor], at: usize, links: &[AgentId]) {
    let mut seen: Vec<AgentId> = Vec::with_capacity(links.len());
    for &id in links {
        if id.0 as usize != at && !seen.contains(&id) {
            seen.push(id);
        }
    }
    let slots: Vec<_> = seen.iter().map(|id| Arc::clone(&actors[id.0 as usize].shared.slot)).collect();
    let met = seen.iter().zip(&slots).map(|(&id, slot)| Neighbour::seen(id, slot.latest()));
    actors[at].neighbours = met.collect();
    actors[at].links = slots;
}
