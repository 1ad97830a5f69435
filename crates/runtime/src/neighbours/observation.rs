//! An agent's view of its peers: which it sees, and by which law each pair interacts.
//!
//! In: the links and laws of the scene, the broad phase. Out: [`Neighbour`]s with their newest states: first the linked peers, always and in
//! their order; then peers near enough to touch, and peers with unsettled impulse ledgers, by rising numbers. No allocation once the sizes
//! settle. Never here: when an agent looks.

use super::broad_phase::{BroadPhase, BroadPhaseState, NeighbourList, PlannedStep};
use crate::agent::agent_record::Live;
use crate::agent::agents::Agents;
use crate::agent::handle::{AgentHandle, Shared};
use crate::cluster::Membership;
use crate::lock_free::slot::SlotWriter;
use crate::turn::helpers::Helpers;
use metachron_contact::remote::{PairClock, computes};
use metachron_contact::{Input, Law, Neighbour, acknowledged};
use metachron_core::{AgentId, Archive, ArchiveError, SimSpan, Snapshot, archive_values};
use metachron_geometry::{CollisionShape, ShapeKind};
use std::sync::atomic::{
    AtomicBool,
    Ordering::{Acquire, Release},
};
use std::sync::{Arc, OnceLock};

/// Data of all agents that have ever been in a run.
#[derive(Debug)]
pub(crate) struct Peers {
    pub all: Agents,
    pub broad_phase: BroadPhaseSlot,
    /// The helpers with the turns of large clusters.
    pub helpers: Helpers,
    /// Whether the order of turns is noted, or followed: a state that a turn publishes is seen by the next.
    pub is_ordered: AtomicBool,
}

/// The broad phase of a run; there is none as long as no two agents could touch, and no agent searches for peers then.
#[derive(Debug, Default)]
pub(crate) struct BroadPhaseSlot {
    made: OnceLock<BroadPhase>,
    is_used: AtomicBool,
}

impl BroadPhaseSlot {
    pub fn get(&self) -> Option<&BroadPhase> {
        self.made.get().filter(|_| self.is_used.load(Acquire))
    }

    /// Makes room for the agent of the next number.
    pub fn join(&self) {
        self.made.get().inspect(|broad_phase| broad_phase.join());
    }

    /// The broad phase of `agents`, from now on in use; one that was not has no box in it.
    pub fn begin(&self, agents: usize) -> &BroadPhase {
        let broad_phase = self.made.get_or_init(|| BroadPhase::new(agents));
        self.is_used.store(true, Release);
        broad_phase
    }

    /// Uses none any more; called between turns.
    fn end(&self) {
        self.is_used.store(false, Release);
        self.made.get().inspect(|broad_phase| broad_phase.clear());
    }

    /// The bounds that agents have published in it; `None` where it is not in use. Called between turns.
    pub fn state(&self) -> Option<BroadPhaseState> {
        self.get().map(BroadPhase::state)
    }

    /// Puts that into it, for so many agents; called between turns.
    pub fn set_state(&self, state: Option<&BroadPhaseState>, agents: usize) {
        match state {
            Some(state) => self.begin(agents).set_state(state),
            None => self.end(),
        }
    }
}

/// The list of peers that an agent sees.
#[derive(Debug)]
pub(crate) struct Observer {
    /// The agent whose view it is.
    me: AgentId,
    neighbours: Vec<Neighbour>,
    /// One for each neighbour, in their order.
    sources: Vec<Source>,
    /// The first `links` neighbours are the linked ones; 32 bits, beside the number of the agent.
    links: u32,
    /// Only where there is a broad phase.
    neighbour_list: Option<Box<NeighbourList>>,
    /// Agents to be seen in addition to the linked ones.
    wanted: Vec<AgentId>,
}

/// One that an agent sees, as it is saved.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    id: AgentId,
    /// Whether it steps as one with the agent.
    is_member: bool,
    /// Its state when it was seen last.
    snapshot: Arc<Snapshot>,
}

/// Source of one neighbour's states.
#[derive(Debug)]
struct Source {
    shared: Arc<Shared>,
    /// It steps as one with the agent: their problem is common, and no law determines their interaction.
    is_member: bool,
}

impl Source {
    /// Brings a neighbour to its newest state and shape.
    fn bring(&self, neighbour: &mut Neighbour) {
        neighbour.snapshot = self.shared.slot.latest();
        self.shared.form.renew(&mut neighbour.form);
    }
}

impl Shared {
    /// By this it is settled which side computes its asynchronous pairs: never a kinematic body, which no impulse
    /// moves.
    fn clock(&self) -> PairClock {
        let step_s = if self.inputs().has(Input::Pose) { f64::INFINITY } else { self.wanted_hz().recip() };
        PairClock { id: self.id, step_s }
    }

    /// The law of its pair with `other`.
    pub fn law(&self, other: AgentId) -> Law {
        self.laws.binary_search_by_key(&other, |(id, _)| *id).map_or(Law::Cluster, |at| self.laws[at].1)
    }

    /// Whether the two could ever touch.
    pub fn touches(&self, other: &Self) -> bool {
        let (mine, theirs) = (self.form.look(), other.form.look());
        let (Some(mine), Some(theirs)) = (&*mine, &*theirs) else { return false };
        mine.meets(theirs) && !(is_led(mine) && is_led(theirs)) && self.law(other.id) != Law::Off
    }

    fn is_tool(&self) -> bool {
        self.form.look().as_ref().is_some_and(|shape| is_led(shape))
    }

    /// The neighbour `other` as seen by this agent.
    fn neighbour(&self, other: &Self) -> Neighbour {
        // a tool needs the form to grasp it, even if it passes through it
        let known = self.touches(other) || self.is_tool();
        Neighbour {
            id: other.id,
            step_s: other.wanted_hz().recip(),
            snapshot: other.slot.latest(),
            form: if known { other.form.latest() } else { None },
            law: self.law(other.id),
            computed_here: computes(self.clock(), other.clock()),
        }
    }
}

impl Peers {
    pub fn get(&self, id: AgentId) -> Option<Live> {
        self.all.of(id)?.live()
    }

    /// Whether it could ever touch any other.
    pub fn may_meet(&self, one: &Shared) -> bool {
        let others = self.all.iter().filter(|other| other.id() != one.id);
        others.filter_map(AgentHandle::live).any(|other| one.touches(&other))
    }

    /// Begins the broad phase of a run in which nothing could touch until now: with the boxes of the states that agents have published.
    pub fn begin_broad_phase(&self) {
        let broad_phase = self.broad_phase.begin(self.all.len());
        for agent in &self.all {
            let state = agent.latest();
            state.bounds.iter().for_each(|bounds| {
                // how long steps are is published with the next states
                broad_phase.publish(agent.id(), bounds, PlannedStep { start: state.moment(), dt: SimSpan::ZERO });
            });
        }
    }

    /// The neighbour `other` as seen by `me`.
    fn neighbour_of(&self, me: AgentId, other: AgentId) -> Option<Neighbour> {
        Some(self.get(me)?.neighbour(&*self.get(other)?))
    }

    /// The view of `me`, which is linked to `links`.
    pub fn observer(&self, me: AgentId, links: &[AgentId]) -> Observer {
        let mut observer = Observer {
            me,
            neighbours: Vec::new(),
            sources: Vec::new(),
            links: 0,
            neighbour_list: None,
            wanted: Vec::new(),
        };
        links.iter().for_each(|id| observer.list(self, *id));
        observer.links = observer.neighbours.len() as u32;
        observer
    }
}

impl Observer {
    /// The agent whose view it is.
    pub const fn me(&self) -> AgentId {
        self.me
    }

    /// Writes or reads the agents that it has found near it.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let me = self.me;
        let first = || Box::new(NeighbourList::new(me));
        archive.option(&mut self.neighbour_list, first, |list, archive| list.archive(archive))
    }

    /// The agents near it; `None` of one that nothing can touch.
    pub fn neighbour_list_mut(&mut self) -> &mut Option<Box<NeighbourList>> {
        &mut self.neighbour_list
    }

    /// Looks at all agents of a run that it comes into from another process.
    pub fn arrive(&mut self, broad_phase: &BroadPhase) {
        self.neighbour_list.iter_mut().for_each(|list| list.arrive(broad_phase));
    }

    /// The agents that it sees, each as it was seen last: its linked peers, and of the others those `present`. An agent
    /// that has left is seen until the next turn.
    pub fn seen(&self, present: &[bool]) -> Vec<Seen> {
        let links = self.links as usize;
        let is_present = |id: AgentId| present.get(id.0 as usize).is_some_and(|present| *present);
        let all = self.neighbours.iter().zip(&self.sources).enumerate();
        let seen = all.filter(|(at, (neighbour, _))| *at < links || is_present(neighbour.id));
        seen.map(|(_, (neighbour, source))| Seen {
            id: neighbour.id,
            is_member: source.is_member,
            snapshot: Arc::clone(&neighbour.snapshot),
        })
        .collect()
    }

    /// Checks that it can see those agents in a run of the `present` ones.
    ///
    /// # Errors
    /// [`ArchiveError::Mismatch`].
    pub fn check_seen(&self, seen: &[Seen], present: &[bool]) -> Result<(), ArchiveError> {
        let linked = self.neighbours.iter().take(self.links as usize).map(|neighbour| neighbour.id);
        let is_linked = linked.clone().eq(seen.iter().take(linked.len()).map(|seen| seen.id));
        let others = seen.iter().skip(linked.len()).map(|seen| seen.id);
        let wrong = |id: &AgentId| *id == self.me || !present.get(id.0 as usize).is_some_and(|present| *present);
        let found = match others.clone().find(wrong) {
            None if is_linked => return Ok(()),
            None => format!("{:?}", seen.iter().map(|seen| seen.id.0).collect::<Vec<_>>()),
            Some(id) => id.0.to_string(),
        };
        let expected = "that of an agent that it sees".to_owned();
        Err(ArchiveError::Mismatch { what: "the number of a neighbour", found, expected })
    }

    /// Sees these agents from now on, as they were seen then; called between turns, where all of them are there.
    pub fn see(&mut self, peers: &Peers, seen: &[Seen]) {
        let links = self.links as usize;
        self.neighbours.truncate(links);
        self.sources.truncate(links);
        seen.iter().skip(links).for_each(|seen| self.list(peers, seen.id));
        for ((neighbour, source), seen) in self.neighbours.iter_mut().zip(&mut self.sources).zip(seen) {
            if seen.is_member != source.is_member {
                source.is_member = seen.is_member;
                set_member(neighbour, peers, self.me, seen.is_member);
            }
            neighbour.snapshot.clone_from(&seen.snapshot);
        }
    }

    /// Sees only the peers that it is linked to: it has left.
    pub fn forget(&mut self) {
        let links = self.links as usize;
        self.neighbours.truncate(links);
        self.sources.truncate(links);
        (self.neighbour_list, self.wanted) = (None, Vec::new());
    }

    /// The agents so near that they may touch it, as they were at the last update, by rising numbers.
    pub fn near(&self) -> &[AgentId] {
        self.neighbour_list.as_ref().map_or(&[], |list| list.near())
    }

    /// Its neighbours, as they were at the last update.
    pub fn neighbours(&self) -> &[Neighbour] {
        &self.neighbours
    }

    /// Publishes the bounds of the state that this agent has just written to the broad phase; its next step takes `dt`.
    pub fn publish(&mut self, peers: &Peers, state: &Snapshot, dt: SimSpan) {
        if let Some(broad_phase) = peers.broad_phase.get() {
            let me = self.me;
            let neighbour_list = self.neighbour_list.get_or_insert_with(|| Box::new(NeighbourList::new(me)));
            neighbour_list.publish(broad_phase, state.bounds.as_ref(), PlannedStep { start: state.moment(), dt });
        }
    }

    /// Whether all impulses exchanged between `me`, whose states `writer` writes, and its neighbours for which `live` is true have been
    /// taken.
    pub fn is_settled(&self, me: AgentId, writer: &SlotWriter<Snapshot>, live: impl Fn(AgentId) -> bool) -> bool {
        newest(writer, |mine| self.neighbours.iter().filter(|n| live(n.id)).all(|n| is_settled(me, mine, n)))
    }

    /// Reads the newest states of the present neighbours, without searching for others.
    pub fn refresh(&mut self) {
        for (neighbour, source) in self.neighbours.iter_mut().zip(&self.sources) {
            source.bring(neighbour);
        }
    }

    /// Updates the neighbours before the `step` of the agent, whose states `writer` writes and which steps as one with `members`.
    pub fn update(&mut self, peers: &Peers, writer: &SlotWriter<Snapshot>, step: PlannedStep, members: &Membership) {
        let me = self.me;
        // before its first publication among others nothing is near it
        if let (Some(neighbour_list), Some(broad_phase)) = (&mut self.neighbour_list, peers.broad_phase.get()) {
            let mine = peers.get(me);
            neighbour_list.update(broad_phase, step, members, |other| {
                mine.as_ref().zip(peers.get(other)).is_some_and(|(a, b)| a.touches(&b))
            });
            self.collect_wanted(broad_phase, writer, members);
            self.list_wanted(peers);
        }
        for (neighbour, source) in self.neighbours.iter_mut().zip(&mut self.sources) {
            let is_member = members.has(neighbour.id);
            if is_member != source.is_member {
                source.is_member = is_member;
                set_member(neighbour, peers, me, is_member);
            }
            source.bring(neighbour);
        }
    }

    /// Collects the agents to be seen: near peers, callers, former neighbours with unsettled ledgers, and agents that give impulses to a
    /// body to which this agent also gives.
    fn collect_wanted(&mut self, broad_phase: &BroadPhase, writer: &SlotWriter<Snapshot>, members: &Membership) {
        let Self { me, neighbours, links, neighbour_list, wanted, sources } = self;
        let (me, links) = (*me, *links as usize);
        let (linked, near_once) = neighbours.split_at_mut(links);
        let is_linked = |id: AgentId| linked.iter().any(|link| link.id == id);
        wanted.clear();
        let near = neighbour_list.iter().flat_map(|neighbour_list| neighbour_list.near().iter().copied());
        wanted.extend(near.filter(|id| !is_linked(*id) && !members.has(*id)));
        let near = wanted.len();
        for (neighbour, source) in near_once.iter_mut().zip(&sources[links..]) {
            if wanted[..near].binary_search(&neighbour.id).is_ok() {
                continue;
            }
            neighbour.snapshot = source.shared.slot.latest();
            if !newest(writer, |mine| is_settled(me, mine, neighbour)) {
                wanted.push(neighbour.id);
            }
        }
        broad_phase.take_callers(me, |caller| {
            if !is_linked(caller) {
                wanted.push(caller);
            }
        });
        for neighbour in linked.iter().chain(&*near_once) {
            let givers = other_givers(me, &neighbour.snapshot);
            wanted.extend(givers.filter(|id| !is_linked(*id) && !members.has(*id)));
        }
        if wanted.len() > near {
            wanted.sort_unstable();
            wanted.dedup();
        }
    }

    fn list_wanted(&mut self, peers: &Peers) {
        let links = self.links as usize;
        if self.neighbours[links..].iter().map(|n| n.id).eq(self.wanted.iter().copied()) {
            return;
        }
        self.neighbours.truncate(links);
        self.sources.truncate(links);
        for at in 0..self.wanted.len() {
            self.list(peers, self.wanted[at]);
        }
    }

    fn list(&mut self, peers: &Peers, id: AgentId) {
        let (Some(theirs), Some(neighbour)) = (peers.get(id), peers.neighbour_of(self.me, id)) else { return };
        self.neighbours.push(neighbour);
        self.sources.push(Source { shared: Arc::clone(&theirs), is_member: false });
    }
}

impl Default for Seen {
    /// One that is to be read.
    fn default() -> Self {
        Self { id: AgentId(0), is_member: false, snapshot: Arc::default() }
    }
}

impl Seen {
    /// Writes or reads it.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.id, self.is_member)?;
        archive.snapshot(&mut self.snapshot)
    }
}

/// Whether the form is a tool's.
const fn is_led(form: &CollisionShape) -> bool {
    matches!(form.kind, ShapeKind::Tool(_))
}

/// Treats `neighbour` as a member of the same cluster, or again as a peer outside it.
fn set_member(neighbour: &mut Neighbour, peers: &Peers, me: AgentId, is_member: bool) {
    if is_member {
        // a tool needs the shape of a body that it may grasp, whichever agent steps both
        let is_tool = peers.get(me).is_some_and(|shared| shared.is_tool());
        let form = neighbour.form.take().filter(|_| is_tool);
        (neighbour.form, neighbour.law) = (form, Law::Off);
    } else if let Some(outsider) = peers.neighbour_of(me, neighbour.id) {
        *neighbour = outsider;
    }
}

/// Whether all impulses that the two have given each other have been taken.
fn is_settled(me: AgentId, mine: &Snapshot, other: &Neighbour) -> bool {
    let given = mine.given.iter().find(|ledger| ledger.with == other.id);
    let received = other.snapshot.given.iter().find(|ledger| ledger.with == me);
    let taken = mine.taken.iter().find(|ledger| ledger.with == other.id);
    given.is_none_or(|ledger| ledger.is_settled(acknowledged(other, me)))
        && received.is_none_or(|ledger| ledger.is_settled(taken))
}

/// The other agents that give impulses to an agent to which `me` also gives: their impulses must be anticipated.
fn other_givers(me: AgentId, other: &Snapshot) -> impl Iterator<Item = AgentId> + '_ {
    let mine = other.taken.iter().any(|ledger| ledger.with == me);
    other.taken.iter().map(|ledger| ledger.with).filter(move |with| mine && *with != me)
}

/// The state that was written last, published or not.
pub(crate) fn newest<R>(writer: &SlotWriter<Snapshot>, read: impl FnOnce(&Snapshot) -> R) -> R {
    match writer.filled() {
        Some(state) => read(state),
        None => read(&writer.slot().latest()),
    }
}

#[cfg(test)]
mod tests;
