//! Assembly of a run: checks the requested agents, and introduces them to each other.
//!
//! In: [`AgentSpawn`]s; an agent's number is its place in their list. Out: actors and handles, or a [`RunError`].
//! Never here: threads, time passing.

use super::agent_record::AgentRecord;
use super::agent_spawn::{AgentSpawn, RATE_MAX_HZ};
use super::agents::{Agents, RunAgents};
use super::form_slot::FormSlot;
use super::handle::{AgentHandle, Identity, Shared};
use crate::cluster::{Handover, JointedTo, Led, MemberState, assign_leaders};
use crate::commands::mailbox::Mailbox;
use crate::lock_free::sleep::SleepRegistry;
use crate::lock_free::slot::SlotWriter;
use crate::neighbours::observation::{BroadPhaseSlot, Peers};
use crate::records::metrics::{Metrics, MetricsWriter};
use crate::records::probe::Trace;
use crate::records::streams::EventStreams;
use crate::time::agent_clock::AgentClock;
use crate::time::faults::Faults;
use crate::turn::agent_runner::{AgentRunner, TurnPeriod};
use crate::turn::helpers::Helpers;
use crate::turn::model::{Model, Traits};
use metachron_contact::member::CallMark;
use metachron_contact::{Input, Law, Link};
use metachron_core::{AgentId, DT_MAX_S, SimSpan, SimTime, Snapshot};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

/// Reason why a run did not start. No agent has made a step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// More agents than this executor takes.
    #[error("{agents} agents are too many for one thread each (at most {most}); use executor = \"pool\" or \"auto\"")]
    TooMany {
        /// Number of requested agents.
        agents: usize,
        /// The limit.
        most: usize,
    },
    /// An invalid rate.
    #[error("agent \"{name}\": the rate of {rate_hz} Hz must be above zero and at most 1e6")]
    BadRate {
        /// The agent's name.
        name: String,
        /// The requested rate, Hz.
        rate_hz: f64,
    },
    /// An invalid range of step lengths.
    #[error(
        "agent \"{name}\": the step range {shortest_s} s to {longest_s} s is invalid; expected 0 < shortest <= longest <= 1 s"
    )]
    BadStep {
        /// The agent's name.
        name: String,
        /// The shortest requested step, seconds.
        shortest_s: f64,
        /// The longest requested step, seconds.
        longest_s: f64,
    },
    /// A link to an agent that does not exist.
    #[error("agent \"{name}\" is linked to agent {link}, which does not exist")]
    BadLink {
        /// The agent's name.
        name: String,
        /// The number of the missing agent.
        link: u32,
    },
    /// An agent that joins a run has a law, a link or an attachment with another.
    #[error("agent \"{name}\" joins a run that goes on: it can touch others, and cannot be tied to them")]
    LateTie {
        /// The agent's name.
        name: String,
    },
    /// Invalid fault rates.
    #[error("agent \"{name}\": jitter {jitter} and loss {loss} must be at least 0 and below 1")]
    BadFaults {
        /// The agent's name.
        name: String,
        /// The requested jitter.
        jitter: f64,
        /// The requested loss.
        loss: f64,
    },
    /// The system gave no thread.
    #[error("the operating system refused a thread for {name}: {error}")]
    NoThread {
        /// The purpose of the thread.
        name: String,
        /// The system's error.
        error: std::io::Error,
    },
}

/// The agents of a run, before their first turn.
pub(crate) struct AssembledRun {
    /// Agents with turns of their own; an agent that is led from the start belongs to its leader.
    pub actors: Vec<Option<Box<AgentRunner>>>,
    pub all: RunAgents,
}

/// Assembles all agents; `helpers` help with the turns of their large clusters. Each has published its initial state, at simulated time zero.
pub(crate) fn assemble(mut spawns: Vec<AgentSpawn>, helpers: Helpers) -> Result<AssembledRun, RunError> {
    let count = spawns.len();
    spawns.iter().try_for_each(|spawn| check(spawn, count))?;
    attach_both_sides(&mut spawns);
    let sleep = Arc::new(SleepRegistry::new(count));
    let (peers, writers) = peers(&mut spawns, &sleep, helpers);
    let peers = Arc::new(peers);
    let mut jointed = jointed(&spawns);
    let live = peers.all.iter().filter_map(AgentHandle::live);
    let actors = spawns.into_iter().zip(live).zip(writers).map(|((spawn, live), writer)| {
        let shared = Arc::clone(&live);
        let jointed = std::mem::take(&mut jointed[shared.id.0 as usize]);
        actor(shared, Spawned { spawn, jointed, writer }, &peers)
    });
    let mut actors: Vec<_> = actors.collect();
    actors.iter_mut().for_each(AgentRunner::publish_initial);
    let handles = Agents::new(&sleep, peers.all.iter().cloned());
    Ok(AssembledRun { actors: assign_leaders(actors), all: RunAgents { handles, sleep, peers } })
}

impl RunAgents {
    /// From now on the order of turns is noted, or followed.
    pub fn set_ordered(&self) {
        self.peers.is_ordered.store(true, Relaxed);
    }

    /// Takes up an agent that begins at `now`, under the next number; agents join one at a time. It has published its first state.
    ///
    /// # Errors
    /// [`RunError`] for an agent that cannot run as requested, and for one with ties: nothing was done then.
    pub fn join(&self, spawn: AgentSpawn, now: SimTime) -> Result<Box<AgentRunner>, RunError> {
        let Self { handles, peers, .. } = self;
        let mut spawn = spawn;
        self.check_joining(&spawn)?;
        let id = AgentId(handles.len() as u32);
        let writer = SlotWriter::new(Snapshot::default());
        let shared = Arc::new(shared(id, &mut spawn, &self.sleep, &writer, false));
        let handle = AgentHandle::of(&shared);
        self.reserve(&handle);
        if peers.broad_phase.get().is_none() && peers.may_meet(&shared) {
            peers.begin_broad_phase();
        }
        let mut actor = actor(shared, Spawned { spawn, jointed: Vec::new(), writer }, peers);
        actor.pace = AgentClock::new(now, actor.pace.wanted());
        actor.publish_initial();
        handles.push(handle);
        Ok(Box::new(actor))
    }

    /// Adds numbers of agents until there are `count`: numbers of agents that were `made`, and others of which nothing
    /// is known but that they have left.
    pub fn reach<'a>(&self, count: usize, made: impl Fn(usize) -> Option<&'a Arc<Shared>>) {
        for number in self.handles.len()..count {
            let id = AgentId(number as u32);
            let unknown = || AgentHandle { record: Arc::new(AgentRecord::unknown(id)) };
            let handle = made(number).map_or_else(unknown, AgentHandle::of);
            self.reserve(&handle);
            self.sleep.close(id);
            self.handles.push(handle);
        }
    }

    /// An agent that joined the run of a state as `spawn` says, and is not in this one: its state is read next, and nobody finds it before it is
    /// admitted.
    pub fn revive(&self, id: AgentId, mut spawn: AgentSpawn) -> Box<AgentRunner> {
        let writer = match self.handles.of(id) {
            Some(known) => SlotWriter::of(Arc::clone(&known.record.slot)),
            None => SlotWriter::new(Snapshot::default()),
        };
        let shared = Arc::new(shared(id, &mut spawn, &self.sleep, &writer, false));
        Box::new(actor(shared, Spawned { spawn, jointed: Vec::new(), writer }, &self.peers))
    }

    /// Checks that an agent can join a run that goes on.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn check_joining(&self, spawn: &AgentSpawn) -> Result<(), RunError> {
        check(spawn, self.handles.len())?;
        if !(spawn.laws.is_empty() && spawn.attached.is_empty()) {
            return Err(RunError::LateTie { name: spawn.name.clone() });
        }
        Ok(())
    }

    /// Makes room for the next number.
    fn reserve(&self, agent: &AgentHandle) {
        self.sleep.join();
        self.peers.broad_phase.join();
        self.peers.all.push(agent.clone());
    }
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
    let Faults { jitter, loss, .. } = spawn.faults;
    if !spawn.faults.is_sound() {
        return Err(RunError::BadFaults { name: name(), jitter, loss });
    }
    let laws = spawn.laws.iter().map(|(id, _)| *id);
    let mut others = spawn.links.iter().copied().chain(laws).chain(spawn.attached.iter().map(|l| l.other));
    match others.find(|other| other.0 as usize >= agents) {
        Some(link) => Err(RunError::BadLink { name: name(), link: link.0 }),
        None => Ok(()),
    }
}

/// Gives every permanent link to both sides, and lets them see each other.
fn attach_both_sides(spawns: &mut [AgentSpawn]) {
    for at in 0..spawns.len() {
        let me = AgentId(at as u32);
        for link in spawns[at].attached.clone() {
            let other = &mut spawns[link.other.0 as usize];
            let back = Link { other: me, here: link.there, there: link.here, ..link };
            if !other.attached.contains(&back) {
                other.attached.push(back);
            }
            other.links.push(me);
            spawns[at].links.push(link.other);
        }
    }
}

/// The data fixed at the start, and the writer of each agent.
fn peers(
    spawns: &mut [AgentSpawn],
    sleep: &Arc<SleepRegistry>,
    helpers: Helpers,
) -> (Peers, Vec<SlotWriter<Snapshot>>) {
    let mut writers = Vec::with_capacity(spawns.len());
    let mut all = Vec::with_capacity(spawns.len());
    let laws = laws(spawns);
    for ((spawn, laws), id) in spawns.iter_mut().zip(laws).zip((0..).map(AgentId)) {
        let writer = SlotWriter::new(Snapshot::default());
        all.push(Shared { laws: laws.into(), ..shared(id, spawn, sleep, &writer, true) });
        writers.push(writer);
    }
    let broad_phase = BroadPhaseSlot::default();
    if may_any_touch(&all) {
        broad_phase.begin(all.len());
    }
    let is_ordered = AtomicBool::new(false);
    let all = Agents::new(sleep, all.into_iter().map(|shared| AgentHandle::of(&Arc::new(shared))));
    (Peers { all, broad_phase, helpers, is_ordered }, writers)
}

impl Identity {
    /// That of the agent that is to be started, whose name it takes.
    fn of(id: AgentId, spawn: &mut AgentSpawn, traits: &Traits, is_first: bool) -> Self {
        let inputs = traits.inputs;
        let is_motored = spawn.scene.joints_of(id).any(|(_, joint)| joint.takes_motor());
        Self {
            name: std::mem::take(&mut spawn.name).into(),
            model: traits.model,
            wanted_hz: spawn.rate_hz,
            dt_max: spawn.dt_range.1,
            motored: is_motored.then(|| Arc::clone(&spawn.scene)),
            inputs: inputs.with(Input::Resolution, inputs.has(Input::Resolution) && spawn.range.is_some()),
            is_first,
            handover: traits.is_member.then(|| Box::<Handover>::default() as _),
        }
    }
}

/// For each agent the joints that hold it to others.
fn jointed(spawns: &[AgentSpawn]) -> Vec<Vec<JointedTo>> {
    let mut jointed = vec![Vec::new(); spawns.len()];
    for (spawn, a) in spawns.iter().zip((0..).map(AgentId)) {
        let joints = spawn.scene.joints_of(a).flat_map(|(number, joint)| {
            let leads = joint.mimic.and_then(|mimic| spawn.scene.joint(mimic.joint));
            let others = [joint.b, leads.map(|leads| leads.a), leads.and_then(|leads| leads.b)];
            others.into_iter().flatten().map(move |other| JointedTo { number, other })
        });
        for joint in joints.filter(|joint| joint.other != a && (joint.other.0 as usize) < spawns.len()) {
            jointed[a.0 as usize].push(joint);
            jointed[joint.other.0 as usize].push(JointedTo { other: a, ..joint });
        }
    }
    jointed
}

/// Whether any two agents could touch.
fn may_any_touch(all: &[Shared]) -> bool {
    let formed: Vec<&Shared> = all.iter().filter(|peer| peer.form.look().is_some()).collect();
    formed.iter().enumerate().any(|(at, peer)| formed[..at].iter().any(|other| peer.touches(other)))
}

/// For each agent the laws of its pairs, whichever side gave them.
fn laws(spawns: &[AgentSpawn]) -> Vec<Vec<(AgentId, Law)>> {
    let mut all = vec![Vec::new(); spawns.len()];
    for (spawn, me) in spawns.iter().zip((0..).map(AgentId)) {
        for &(other, law) in spawn.laws.iter().filter(|(other, _)| *other != me) {
            for (a, b) in [(me, other), (other, me)] {
                let laws: &mut Vec<(AgentId, Law)> = &mut all[a.0 as usize];
                if let Err(at) = laws.binary_search_by_key(&b, |(id, _)| *id) {
                    laws.insert(at, (b, law));
                }
            }
        }
    }
    all
}

fn shared(
    id: AgentId,
    spawn: &mut AgentSpawn,
    sleep: &Arc<SleepRegistry>,
    writer: &SlotWriter<Snapshot>,
    is_first: bool,
) -> Shared {
    let calls = CallMark::default();
    let traits = Traits::of(&mut *spawn.agent, &calls);
    Shared {
        id,
        identity: Identity::of(id, spawn, &traits, is_first),
        calls,
        laws: Box::default(),
        gauges: Metrics::default(),
        form: FormSlot::new(traits.form),
        mail: Mailbox::default(),
        streams: EventStreams::default(),
        slot: writer.slot(),
        sleep: Arc::clone(sleep),
        ages: Mutex::default(),
        traces: spawn.watches.drain(..).map(|watch| Mutex::new(Trace::new(watch))).collect(),
    }
}

/// The parts of an agent that is assembled.
struct Spawned {
    spawn: AgentSpawn,
    /// The joints that hold it to others.
    jointed: Vec<JointedTo>,
    writer: SlotWriter<Snapshot>,
}

fn actor(shared: Arc<Shared>, parts: Spawned, peers: &Arc<Peers>) -> AgentRunner {
    let Spawned { spawn, jointed, writer } = parts;
    let id = shared.id;
    let mut links: Vec<AgentId> = Vec::with_capacity(spawn.links.len());
    for link in spawn.links {
        if link != id && !links.contains(&link) {
            links.push(link);
        }
    }
    let mut asynchronous = shared.laws.iter().map(|(_, law)| *law).chain(spawn.attached.iter().map(|link| link.law));
    let asynchronous = asynchronous.any(Law::is_asynchronous);
    let is_member = shared.handover().is_some();
    let cluster = is_member.then(|| Box::new(MemberState::new(spawn.scene, jointed, asynchronous)));
    // within a cluster there are no messages to lose, and no clock of its own to disturb
    let faults = if !is_member || asynchronous { spawn.faults } else { Faults::default() };
    let model = Model::new(spawn.agent, Arc::clone(&shared));
    AgentRunner {
        shared,
        peers: Arc::clone(peers),
        model,
        pace: AgentClock::new(SimTime::ZERO, spawn.dt.clamp(spawn.dt_range.0, spawn.dt_range.1)),
        dt_range: spawn.dt_range,
        range: spawn.range,
        governor: spawn.governor,
        faults,
        writer,
        carved: false,
        observer: peers.observer(id, &links),
        links: spawn.attached,
        loads: None,
        cluster,
        led: Led::default(),
        metrics: MetricsWriter::new(),
        turn_period: TurnPeriod::default(),
        open: None,
        was_near: None,
        withheld: false,
        announced: Vec::new(),
        unsettled_ns: 0,
        served: SimTime::ZERO,
        owed: SimSpan::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executors::testing::Dummy;
    use glam::DVec3;
    use metachron_geometry::Solid;
    use metachron_models::rigid::RigidBody;
    use metachron_models::rigid::RigidSpec;
    use metachron_models::rod::Tube;
    use metachron_models::rod::{Material, Section, TubeSpec};

    fn ball() -> AgentSpawn {
        let spec = RigidSpec::free(Solid::Ball { radius_m: 0.1 }, DVec3::ZERO, 1.0);
        AgentSpawn::alone("ball", Box::new(RigidBody::new(spec).unwrap()), 100.0)
    }

    fn tube() -> AgentSpawn {
        let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 0.5 };
        let spec = TubeSpec::free(vec![DVec3::ZERO, DVec3::X], Section::hollow(0.015, 0.002, material), 8);
        AgentSpawn::alone("tube", Box::new(Tube::new(spec).unwrap()), 100.0)
    }

    /// Whether a broad phase is set up, and how many agents can lead or be led.
    fn set_up(mut spawns: Vec<AgentSpawn>) -> (bool, usize) {
        let sleep = Arc::new(SleepRegistry::new(spawns.len()));
        let (peers, _) = peers(&mut spawns, &sleep, Helpers::none());
        (
            peers.broad_phase.get().is_some(),
            peers.all.iter().filter_map(AgentHandle::live).filter(|peer| peer.handover().is_some()).count(),
        )
    }

    #[test]
    fn unneeded_parts_of_a_run_are_not_set_up() {
        assert_eq!(set_up(vec![ball()]), (false, 1));
        assert_eq!(set_up(vec![tube()]), (false, 1));
        assert_eq!(set_up(vec![tube(), tube(), ball()]), (true, 3));
        assert_eq!(set_up(vec![Dummy::new(1.0).at(100.0), ball(), ball()]), (true, 2));
    }
}
