//! Who may touch whom: the broad phase between agents.
//!
//! In: the box each agent publishes, and how fast it may leave it. Out: for every agent a list of those near enough to touch
//! within its next turns, and of those that have booked impulses for it ([`Sight`]). Agents meet here in atomic words alone:
//! nobody waits for anybody. Who is far is not looked at before the moment at which he could be near (an appointment);
//! who turns out faster than he had said says so in a common log, and is looked at again.
//! Never here: shapes, contacts, snapshots. A run in which no two agents could touch has no crowd.

mod berth;
mod sight;

pub(super) use sight::Sight;

use berth::{Berth, Reach, Seen};
use metachron_core::{AgentId, Bounds, SimTime};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::SeqCst};

/// What the agents of a run share to find each other.
#[derive(Debug)]
pub(super) struct Crowd {
    berths: Vec<Berth>,
    /// Who has become faster than he had said, newest last; a word is the note's place and the agent's number.
    log: Vec<AtomicU64>,
    /// How many notes there ever were.
    noted: AtomicU64,
    calls: Vec<Calls>,
}

/// Who has booked something for one agent since it last asked: a bit each, on pages that are made when first needed, since most
/// agents never hear of most others.
#[derive(Debug, Default)]
struct Calls {
    any: AtomicBool,
    pages: OnceLock<Box<[OnceLock<Page>]>>,
}

/// The bits of some callers.
type Page = Box<[AtomicU64; PAGE_WORDS]>;

/// Words of a page: it tells of 1024 agents.
const PAGE_WORDS: usize = 16;

/// Notes that are kept: who is further behind looks at everybody again.
const LOG_LENGTH: u64 = 1024;

/// No agent's speed is said to be less, m/s: what trembles need not tell everybody.
const SPEED_LEAST_M_S: f64 = 0.0625;

/// What is said is this much above what is measured, so that speed may grow a little before all must know.
const SPEED_ROOM: f64 = 1.25;

impl Crowd {
    /// A crowd of that many agents, none of which is anywhere yet.
    pub fn new(agents: usize) -> Self {
        Self {
            berths: std::iter::repeat_with(Berth::default).take(agents).collect(),
            log: zeros(LOG_LENGTH as usize),
            noted: AtomicU64::new(0),
            calls: std::iter::repeat_with(Calls::default).take(agents).collect(),
        }
    }

    /// `id` is inside `bounds` at its time `time`; said by whoever makes its turns. Gives the speed that is said of it.
    pub fn stand(&self, id: AgentId, bounds: &Bounds, time: SimTime) -> f64 {
        let Some(berth) = self.berths.get(id.0 as usize) else { return 0.0 };
        let before = berth.mine();
        let said = before.map_or(0.0, |reach| reach.speed_m_s);
        let speed_m_s = promise(bounds.speed_m_s, said);
        berth.write(&Reach::new(bounds, speed_m_s, time));
        if speed_m_s > said || before.is_none() {
            self.note(id);
        }
        speed_m_s
    }

    /// Where `id` was said to be last.
    fn seen(&self, id: AgentId) -> Seen {
        self.berths.get(id.0 as usize).map_or(Seen::Nowhere, Berth::read)
    }

    /// `id` stays where it is until it stands somewhere again.
    pub fn stay(&self, id: AgentId) {
        let Some(berth) = self.berths.get(id.0 as usize) else { return };
        if let Some(reach) = berth.mine() {
            berth.write(&Reach { speed_m_s: 0.0, ..reach });
        }
    }

    /// Tells `to` that `from` has booked something for it: it lists it at its next turn.
    pub fn call(&self, to: AgentId, from: AgentId) {
        let Some(calls) = self.calls.get(to.0 as usize) else { return };
        let (word, bit) = (from.0 as usize / 64, 1 << (from.0 % 64));
        let pages = self.calls.len().div_ceil(64 * PAGE_WORDS);
        let pages = calls.pages.get_or_init(|| std::iter::repeat_with(OnceLock::new).take(pages).collect());
        if let Some(page) = pages.get(word / PAGE_WORDS) {
            page.get_or_init(Box::default)[word % PAGE_WORDS].fetch_or(bit, SeqCst);
            calls.any.store(true, SeqCst);
        }
    }

    /// Visits those who have called `id` since the last time, by rising numbers.
    pub fn answer(&self, id: AgentId, mut visit: impl FnMut(AgentId)) {
        let Some(calls) = self.calls.get(id.0 as usize) else { return };
        if !(calls.any.load(SeqCst) && calls.any.swap(false, SeqCst)) {
            return;
        }
        let pages = calls.pages.get().into_iter().flat_map(|pages| pages.iter().enumerate());
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

    fn note(&self, id: AgentId) {
        let at = self.noted.fetch_add(1, SeqCst);
        self.log[(at % LOG_LENGTH) as usize].store(word(at, id), SeqCst);
    }

    /// Visits the notes from number `from` on and gives the number of the next; `None` where some are gone or not yet written:
    /// anybody may have been meant.
    fn notes(&self, from: u64, mut visit: impl FnMut(AgentId)) -> (u64, Option<()>) {
        let end = self.noted.load(SeqCst);
        if end - from > LOG_LENGTH / 2 {
            return (end, None);
        }
        for at in from..end {
            let note = self.log[(at % LOG_LENGTH) as usize].load(SeqCst);
            let id = AgentId(note as u32);
            if note != word(at, id) {
                return (end, None);
            }
            visit(id);
        }
        (end, Some(()))
    }
}

/// A note: its place, so that an older one in the same place is told apart, and whom it means.
const fn word(at: u64, id: AgentId) -> u64 {
    ((at + 1) << 32) | id.0 as u64
}

fn zeros(count: usize) -> Vec<AtomicU64> {
    std::iter::repeat_with(AtomicU64::default).take(count).collect()
}

/// The speed that is said of one who has `speed_m_s`, where `said` was before: a power of two above it, so that it seldom
/// changes, and only lowered when it is far too high.
fn promise(speed_m_s: f64, said: f64) -> f64 {
    let wanted = (speed_m_s * SPEED_ROOM).max(SPEED_LEAST_M_S);
    let told = libm::exp2(libm::ceil(libm::log2(wanted)));
    if said >= speed_m_s && said >= SPEED_LEAST_M_S && said <= 4.0 * told { said } else { told }
}

#[cfg(test)]
mod tests;
