//! Broad phase between agents: which agents may touch each other.
//!
//! In: the box that each agent publishes, and a bound of its speed. Out: for every agent a list of the peers near
//! enough to touch within its next turns, and of the peers that have given impulses to it ([`NeighbourList`]). Agents
//! exchange atomic words only: no agent waits for another.
//! A distant peer is not checked before the time at which it could be near (an appointment); an agent that is faster, makes longer steps or comes
//! farther than was published enters itself in a common log, and is checked again.
//! Never here: shapes, contacts, snapshots. A run in which no two agents could touch has no broad phase.

mod neighbour_list;
mod published_bounds;

pub(crate) use neighbour_list::NeighbourList;

use crate::lock_free::table::Table;
use arc_swap::ArcSwapOption;
use glam::DVec3;
use metachron_core::{AgentId, Bounds, SimSpan, SimTime};
use published_bounds::{BoxWords, MovingBox, PublishedBounds, ReadBounds};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::SeqCst};
use std::sync::{Arc, OnceLock};

/// The step that an agent is about to make.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlannedStep {
    /// Its time at the start.
    pub start: SimTime,
    /// Its length.
    pub dt: SimSpan,
}

/// Shared data by which the agents of a run find each other.
#[derive(Debug)]
pub(crate) struct BroadPhase {
    bounds: Table<PublishedBounds>,
    /// Agents that are not where their published boxes led, newest last; a word holds the entry's index and the agent's number.
    log: Vec<AtomicU64>,
    /// Number of entries ever written.
    noted: AtomicU64,
    calls: Table<Calls>,
}

/// The state of a [`BroadPhase`] between turns.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct BroadPhaseState {
    bounds: Vec<Option<BoxWords>>,
    log: Vec<u64>,
    noted: u64,
    callers: Vec<Vec<AgentId>>,
}

/// The bounds that one agent has published, and the agents that have called it.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct PublishedState {
    bounds: Option<BoxWords>,
    pub callers: Vec<AgentId>,
}

/// The box that an agent has published, and whether its box before did not lead to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Published {
    bounds: MovingBox,
    is_new: bool,
}

/// A box that an agent is in, with all places at which it may be found near another one that is in such a box too.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reach {
    /// The agent.
    pub id: AgentId,
    /// Least coordinates, metres.
    pub low_m: DVec3,
    /// Greatest coordinates, metres.
    pub high_m: DVec3,
    /// A bound of the speed of all its points, m/s.
    pub speed_m_s: f64,
}

impl Reach {
    /// Whether `other` lies in this one, whole.
    #[must_use]
    pub fn holds(&self, other: &Self) -> bool {
        self.low_m.cmple(other.low_m).all() && self.high_m.cmpge(other.high_m).all()
    }

    /// Whether the two have a place in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        self.low_m.cmple(other.high_m).all() && self.high_m.cmpge(other.low_m).all()
    }

    /// The same, wider by `by_m` on every side.
    #[must_use]
    pub fn wider(self, by_m: f64) -> Self {
        Self { low_m: self.low_m - by_m, high_m: self.high_m + by_m, ..self }
    }
}

impl BroadPhaseState {
    /// Whether it is of so many agents.
    pub fn is_of(&self, count: usize) -> bool {
        let are_known = self.callers.iter().flatten().all(|from| (from.0 as usize) < count);
        [self.bounds.len(), self.callers.len()] == [count; 2] && self.log.len() as u64 == LOG_LENGTH && are_known
    }
}

/// Agents that have given impulses to one agent, or belong with it, since its last query: a bit each, on pages allocated on first use, since most agents never
/// interact with most others.
#[derive(Debug, Default)]
struct Calls {
    any: AtomicBool,
    pages: ArcSwapOption<Pages>,
}

type Pages = boxcar::Vec<OnceLock<Page>>;

/// The bits of some callers.
type Page = Box<[AtomicU64; PAGE_WORDS]>;

/// Words of a page: it covers 1024 agents.
const PAGE_WORDS: usize = 16;

/// Stored log entries: a reader that is further behind checks all agents again.
const LOG_LENGTH: u64 = 1024;

/// Where agents are that have left, along each axis, metres.
const NOWHERE_M: f64 = 1e15;

/// Least published speed, m/s: small vibrations need not be logged.
const SPEED_LEAST_M_S: f64 = 0.0625;

/// The published speed is this factor above the measured one, so that speed may grow a little before a log entry is needed.
const SPEED_ROOM: f64 = 1.25;

impl BroadPhase {
    /// The broad phase of that many agents, none of which has published a box.
    pub fn new(agents: usize) -> Self {
        Self {
            bounds: Table::of(agents),
            log: zeros(LOG_LENGTH as usize),
            noted: AtomicU64::new(0),
            calls: Table::of(agents),
        }
    }

    /// Makes room for the agent of the next number. Agents join one at a time.
    pub fn join(&self) {
        self.bounds.grow();
        self.calls.grow();
    }

    /// Publishes that `id` is inside `bounds` before a `step`; called by the thread that makes its turns.
    pub fn publish(&self, id: AgentId, bounds: &Bounds, step: PlannedStep) -> Published {
        let PlannedStep { start: time, dt } = step;
        let Bounds { low, high, speed_m_s } = *bounds;
        let written = self.bounds.get(id.0 as usize);
        let before = written.and_then(PublishedBounds::mine);
        let [speed_before_m_s, step_before_s] = before.map_or([0.0; 2], |reach| [reach.speed_m_s, reach.step_s]);
        let speed_m_s = published_speed(speed_m_s, speed_before_m_s);
        let step_s = seldom_changed(dt.as_secs_f64(), dt.as_secs_f64(), step_before_s);
        let published = MovingBox { low, high, speed_m_s, step_s, time };
        written.into_iter().for_each(|written| written.write(&published));
        let is_as_published =
            |before: MovingBox| speed_m_s <= before.speed_m_s && step_s <= before.step_s && before.leads_to(&published);
        let is_new = !before.is_some_and(is_as_published);
        if is_new {
            self.log(id);
        }
        Published { bounds: published, is_new }
    }

    /// The last published box of `id`.
    fn bounds_of(&self, id: AgentId) -> ReadBounds {
        self.bounds.get(id.0 as usize).map_or(ReadBounds::Unpublished, PublishedBounds::read)
    }

    /// Publishes speed zero for `id`: it stays in place until it publishes a box again.
    pub fn publish_rest(&self, id: AgentId) {
        let Some(published) = self.bounds.get(id.0 as usize) else { return };
        if let Some(reach) = published.mine() {
            published.write(&MovingBox { speed_m_s: 0.0, ..reach });
        }
    }

    /// Publishes that `id`, which has left, is so far away that nothing comes near it, and frees its list of callers.
    pub fn publish_nowhere(&self, id: AgentId, time: SimTime) {
        let Some(published) = self.bounds.get(id.0 as usize) else { return };
        let nowhere = DVec3::splat(NOWHERE_M);
        published.write(&MovingBox { low: nowhere, high: nowhere, speed_m_s: 0.0, step_s: 0.0, time });
        self.calls.get(id.0 as usize).into_iter().for_each(|calls| calls.pages.store(None));
    }

    /// Whether `id` has left.
    fn is_nowhere(&self, id: AgentId) -> bool {
        matches!(self.bounds_of(id), ReadBounds::Known(reach) if reach.low.x >= NOWHERE_M / 2.0)
    }

    /// Notifies `to` that `from` has given an impulse to it, or belongs into one cluster with it: `to` lists `from` at its next turn.
    pub fn call(&self, to: AgentId, from: AgentId) {
        let Some(calls) = self.calls.get(to.0 as usize) else { return };
        let (word, bit) = (from.0 as usize / 64, 1 << (from.0 % 64));
        let mut pages = calls.pages.load();
        if pages.is_none() && !self.is_nowhere(to) {
            calls.pages.rcu(|made| made.clone().or_else(|| Some(Arc::default())));
            pages = calls.pages.load();
        }
        let Some(pages) = &*pages else { return };
        while pages.count() <= word / PAGE_WORDS {
            pages.push(OnceLock::new());
        }
        if let Some(page) = pages.get(word / PAGE_WORDS) {
            page.get_or_init(Box::default)[word % PAGE_WORDS].fetch_or(bit, SeqCst);
            calls.any.store(true, SeqCst);
        }
    }

    /// Visits the agents that have called `id` since the last query, by rising numbers.
    pub fn take_callers(&self, id: AgentId, mut visit: impl FnMut(AgentId)) {
        let Some(calls) = self.calls.get(id.0 as usize) else { return };
        if !(calls.any.load(SeqCst) && calls.any.swap(false, SeqCst)) {
            return;
        }
        let pages = calls.pages.load();
        let pages = pages.iter().flat_map(|pages| pages.iter());
        for (page, words) in pages.filter_map(|(at, page)| Some((at, page.get()?))) {
            for (word, bits) in words.iter().enumerate() {
                let mut bits = bits.swap(0, SeqCst);
                while bits != 0 {
                    visit(AgentId((page * PAGE_WORDS + word) as u32 * 64 + bits.trailing_zeros()));
                    bits &= bits - 1;
                }
            }
        }
    }

    /// Forgets all that agents have published; called between turns.
    pub fn clear(&self) {
        self.bounds.iter().for_each(PublishedBounds::clear);
        self.log.iter().chain([&self.noted]).for_each(|word| word.store(0, SeqCst));
        (0..self.calls.len() as u32).for_each(|to| self.take_callers(AgentId(to), |_| {}));
    }

    /// The bounds that agents have published, and their calls of each other; called between turns.
    pub fn state(&self) -> BroadPhaseState {
        BroadPhaseState {
            bounds: self.bounds.iter().map(PublishedBounds::words).collect(),
            log: self.log.iter().map(|word| word.load(SeqCst)).collect(),
            noted: self.noted.load(SeqCst),
            callers: (0..self.calls.len() as u32).map(|to| self.callers_of(AgentId(to))).collect(),
        }
    }

    /// The agents that have called `to` since its last query; called between turns.
    fn callers_of(&self, to: AgentId) -> Vec<AgentId> {
        let mut callers = Vec::new();
        self.take_callers(to, |from| callers.push(from));
        callers.iter().for_each(|from| self.call(to, *from));
        callers
    }

    fn set_callers_of(&self, to: AgentId, callers: &[AgentId]) {
        self.take_callers(to, |_| {});
        callers.iter().for_each(|from| self.call(to, *from));
    }

    /// The bounds of `id` and its callers; called between turns.
    pub fn state_of(&self, id: AgentId) -> PublishedState {
        let bounds = self.bounds.get(id.0 as usize).and_then(PublishedBounds::words);
        PublishedState { bounds, callers: self.callers_of(id) }
    }

    /// Puts that in the place of what `id` has published, and lets all others look at it; called between turns.
    pub fn set_state_of(&self, id: AgentId, state: &PublishedState) {
        self.bounds.get(id.0 as usize).into_iter().for_each(|bounds| bounds.set_words(state.bounds));
        self.set_callers_of(id, &state.callers);
        self.log(id);
    }

    /// The reach of `id` where no step of any agent is longer than `dt`; `None` of one that has published no box.
    pub fn reach_of(&self, id: AgentId, dt: SimSpan) -> Option<Reach> {
        let published = self.bounds.get(id.0 as usize)?.mine().filter(|published| published.low.x < NOWHERE_M / 2.0)?;
        let MovingBox { low: low_m, high: high_m, .. } = published;
        let speed_m_s = published.speed_m_s.max(SPEED_LEAST_M_S);
        Some(Reach { id, low_m, high_m, speed_m_s }.wider(neighbour_list::reach_m(speed_m_s, dt)))
    }

    /// Puts that of the first agents into it; nobody has called the others then. Called between turns.
    pub fn set_state(&self, state: &BroadPhaseState) {
        self.bounds.iter().zip(&state.bounds).for_each(|(bounds, words)| bounds.set_words(*words));
        self.log.iter().zip(&state.log).for_each(|(word, value)| word.store(*value, SeqCst));
        self.noted.store(state.noted, SeqCst);
        let callers = state.callers.iter().map(Vec::as_slice).chain(std::iter::repeat(&[][..]));
        (0..self.calls.len() as u32)
            .map(AgentId)
            .zip(callers)
            .for_each(|(to, callers)| self.set_callers_of(to, callers));
    }

    fn log(&self, id: AgentId) {
        let at = self.noted.fetch_add(1, SeqCst);
        self.log[(at % LOG_LENGTH) as usize].store(word(at, id), SeqCst);
    }

    /// Visits the log entries from number `from` on and returns the number of the next one; `None` if some are overwritten or not yet
    /// written: any agent may be affected.
    fn read_log(&self, from: u64, mut visit: impl FnMut(AgentId)) -> (u64, Option<()>) {
        let end = self.noted.load(SeqCst);
        if end - from > LOG_LENGTH / 2 {
            return (end, None);
        }
        for at in from..end {
            let entry = self.log[(at % LOG_LENGTH) as usize].load(SeqCst);
            let id = AgentId(entry as u32);
            if entry != word(at, id) {
                return (end, None);
            }
            visit(id);
        }
        (end, Some(()))
    }
}

/// A log entry: its index, so that an older entry in the same place is recognised, and the agent.
const fn word(at: u64, id: AgentId) -> u64 {
    ((at + 1) << 32) | id.0 as u64
}

fn zeros(count: usize) -> Vec<AtomicU64> {
    std::iter::repeat_with(AtomicU64::default).take(count).collect()
}

/// The speed to publish for an agent of `speed_m_s` that published `published` before.
fn published_speed(speed_m_s: f64, published: f64) -> f64 {
    let least = speed_m_s.max(SPEED_LEAST_M_S);
    seldom_changed(least, (speed_m_s * SPEED_ROOM).max(least), published)
}

/// A bound to publish that is not below `least`, and was `published` before: a power of two above what is `wanted`, so that it seldom changes,
/// lowered only if it is far too high.
fn seldom_changed(least: f64, wanted: f64, published: f64) -> f64 {
    let raised = libm::exp2(libm::ceil(libm::log2(wanted)));
    if published >= least && published <= 4.0 * raised { published } else { raised }
}

#[cfg(test)]
mod tests;
