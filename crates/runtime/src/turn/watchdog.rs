//! Turns in progress, and turns that last too long.
//!
//! In: turns, from the threads that make them. Out: the turn in progress of each, and which agents' turns have lasted longer than they may: these
//! are stalled until their turn ends, and readers of their events hear of it. A thread that ends a turn and the watchdog that finds it late
//! compete for one atomic word: the later of the two finds it decided. Threads that make turns are watched by another; a turn on the thread of
//! a caller is judged by the other threads that ask. Never here: what becomes of a thread whose turn does not end.

use crate::agent::agents::Agents;
use crate::agent::handle::{AgentHandle, Shared};
use crate::lock_free::callers_turn::CallersTurn;
use crate::lock_free::sleep::SleepRegistry;
use metachron_core::AgentId;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed, Ordering::Release, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a turn of one agent may last if the scene does not say, wall time, and as how many of its steps at least.
const ALLOWED_DEFAULT: Duration = Duration::from_millis(250);
const ALLOWED_STEPS: u32 = 10;
/// How often a turn is looked at within that time: a suspension of the whole machine counts as one look.
pub(crate) const CHECKS: u32 = 4;
/// The turn of a cluster makes the steps of all its members: it may last as many times as long as it has members, and no more than this.
const MEMBERS_MAX: u32 = 25;

/// The turn that one thread makes.
#[derive(Debug, Default)]
pub(crate) struct WatchdogWord {
    /// The turn in progress: its number and, in the low half, the agent's number plus one; with [`STALLED`] once that lasts too long. [`IDLE`]
    /// between turns.
    word: AtomicU64,
}

/// A turn in progress; equal values are the same turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WatchedTurn(u64);

const IDLE: u64 = 0;
const STALLED: u64 = 1 << 63;
/// The thread makes no more turns.
const ENDED: u64 = u64::MAX;

impl WatchedTurn {
    /// The agent of the turn.
    pub const fn agent(self) -> AgentId {
        AgentId((self.0 as u32).wrapping_sub(1))
    }
}

impl WatchdogWord {
    /// Turn number `turn` begins, of `id`.
    pub fn begin(&self, turn: u32, id: AgentId) -> WatchedTurn {
        let word = (u64::from(turn & 0x3fff_ffff) << 32) | u64::from(id.0.wrapping_add(1));
        // a reader that sees the turn sees when it began
        self.word.store(word, Release);
        WatchedTurn(word)
    }

    /// `turn` has ended; whether in time.
    pub fn end(&self, turn: WatchedTurn) -> bool {
        let in_time = self.word.compare_exchange(turn.0, IDLE, SeqCst, SeqCst).is_ok();
        if !in_time {
            self.word.store(IDLE, SeqCst);
        }
        in_time
    }

    /// The turn in progress, if there is one.
    pub fn current(&self) -> Option<WatchedTurn> {
        let word = self.word.load(SeqCst);
        (word != IDLE && word != ENDED).then_some(WatchedTurn(word & !STALLED))
    }

    /// Whether the turn in progress has lasted too long.
    pub fn is_stalled(&self) -> bool {
        let word = self.word.load(SeqCst);
        word != ENDED && word & STALLED != 0
    }

    /// Notes that `turn` lasts too long, if it is still in progress; whether it is.
    fn stall(&self, turn: WatchedTurn) -> bool {
        self.word.compare_exchange(turn.0, turn.0 | STALLED, SeqCst, SeqCst).is_ok()
    }

    /// Its thread makes no more turns.
    pub fn leave(&self) {
        self.word.store(ENDED, SeqCst);
    }

    /// Whether its thread makes no more turns.
    pub fn has_ended(&self) -> bool {
        self.word.load(SeqCst) == ENDED
    }
}

/// How long turns may last, shared by the caller that sets it and the threads that watch.
#[derive(Debug)]
pub(crate) struct StallLimit(AtomicU64);

impl Default for StallLimit {
    fn default() -> Self {
        Self::of(ALLOWED_DEFAULT)
    }
}

impl StallLimit {
    pub fn of(limit: Duration) -> Self {
        Self(AtomicU64::new(limit.as_nanos() as u64))
    }

    pub fn set(&self, limit: Duration) {
        self.0.store(limit.as_nanos() as u64, Relaxed);
    }

    fn get(&self) -> Duration {
        Duration::from_nanos(self.0.load(Relaxed))
    }

    /// How long to wait between two checks.
    pub fn interval(&self) -> Duration {
        self.get() / CHECKS
    }
}

/// How often a thread was found in the turn in which it is.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    turn: Option<WatchedTurn>,
    checks: u32,
    since: Option<Instant>,
}

/// An agent that is stalled by a turn.
#[derive(Debug, Clone, Copy)]
struct StalledBy {
    agent: AgentId,
    /// The agent whose turn it is.
    turn_of: AgentId,
}

/// The judge of turns; copies judge as one.
#[derive(Debug, Clone)]
pub(crate) struct Watchdog {
    handles: Agents,
    sleep: Arc<SleepRegistry>,
    pub limit: Arc<StallLimit>,
    /// All that are stalled: a turn that ends may have released some of them before.
    stalled: Arc<Mutex<Vec<StalledBy>>>,
}

impl Watchdog {
    /// One for the turns of `handles`, which may last as long as `limit` says.
    pub fn new(handles: &Agents, limit: StallLimit) -> Self {
        let sleep = Arc::clone(&handles.sleep);
        Self { handles: handles.clone(), sleep, limit: Arc::new(limit), stalled: Arc::default() }
    }

    /// How long a turn of `id` may last.
    pub fn allowed(&self, id: AgentId) -> Duration {
        let dt = self.handles.of(id).map_or(Duration::ZERO, |agent| Duration::from_nanos(agent.dt_ns()));
        let members = self.turned_by(id).take(MEMBERS_MAX as usize).count().max(1) as u32;
        self.limit.get().max(dt * ALLOWED_STEPS) * members
    }

    /// Looks at a thread: whether its turn is found to have lasted too long now.
    pub fn judge(&self, word: &WatchdogWord, seen: &mut Seen) -> bool {
        let turn = word.current();
        if turn.is_none() || turn != seen.turn {
            *seen = Seen { turn, checks: 0, since: turn.map(|_| Instant::now()) };
            return false;
        }
        seen.checks += 1;
        let (Some(turn), Some(since)) = (turn, seen.since) else { return false };
        (seen.checks >= CHECKS || word.is_stalled()) && self.judge_after(word, turn, since.elapsed())
    }

    /// Looks at a thread whose `turn` has lasted for so long: whether that is found to be too long now.
    fn judge_after(&self, word: &WatchdogWord, turn: WatchedTurn, lasts: Duration) -> bool {
        if word.is_stalled() {
            self.each_live(turn.agent(), |shared| shared.gauges.set_stalled_for(lasts));
            return false;
        }
        if lasts < self.limit.get() || lasts < self.allowed(turn.agent()) || !word.stall(turn) {
            return false;
        }
        let culprit = self.culprit(turn.agent());
        let turned = self.turned_by(turn.agent()).map(|agent| StalledBy { agent: agent.id(), turn_of: turn.agent() });
        self.stalled().extend(turned);
        self.each_live(turn.agent(), |shared| {
            shared.gauges.stall(lasts, Some(shared.id) == culprit);
            self.sleep.changed.mark(shared.id);
        });
        // it may have ended meanwhile
        if !word.is_stalled() {
            self.resume(turn.agent());
        }
        true
    }

    /// A turn of `id` that was stalled has ended: the agents stalled by it go on, led by it still or not.
    pub fn resume(&self, id: AgentId) {
        self.stalled().retain(|stalled| {
            if stalled.turn_of != id {
                return true;
            }
            let live = self.handles.of(stalled.agent).and_then(AgentHandle::live);
            live.iter().for_each(|shared| shared.gauges.resume());
            self.sleep.changed.mark(stalled.agent);
            false
        });
    }

    fn stalled(&self) -> MutexGuard<'_, Vec<StalledBy>> {
        self.stalled.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Of the agents whose turns `id` makes the one whose code runs now; `id` where that of none does.
    fn culprit(&self, id: AgentId) -> Option<AgentId> {
        let runs = |agent: &&AgentHandle| agent.live().is_some_and(|shared| shared.calls.is_running());
        Some(self.turned_by(id).find(runs).map_or(id, AgentHandle::id))
    }

    /// Why nothing can be done between turns: names the agent whose step does not end; `None` where no turn is stalled.
    pub fn complaint(&self) -> Option<String> {
        let stalled = |agent: &&AgentHandle| agent.live().is_some_and(|shared| shared.gauges.is_stalled());
        let first = self.handles.iter().find(stalled)?;
        let culprit = self.culprit(self.sleep.leader(first.id())).and_then(|id| self.handles.of(id)).unwrap_or(first);
        Some(format!("agent \"{}\", whose step does not end,", culprit.name()))
    }

    /// Waits until no turn is stalled, no longer than one may last.
    ///
    /// # Errors
    /// The complaint, where one still is.
    pub fn await_stalled(&self) -> Result<(), String> {
        let (begun, limit) = (Instant::now(), self.limit.get());
        while let Some(complaint) = self.complaint() {
            if begun.elapsed() >= limit {
                return Err(complaint);
            }
            std::thread::sleep(limit / 50);
        }
        Ok(())
    }

    /// The agents whose turns `id` makes, itself among them.
    fn turned_by(&self, id: AgentId) -> impl Iterator<Item = &AgentHandle> {
        self.handles.iter().filter(move |agent| self.sleep.leader(agent.id()) == id)
    }

    fn each_live(&self, id: AgentId, visit: impl Fn(&Shared)) {
        self.turned_by(id).filter_map(AgentHandle::live).for_each(|shared| visit(&shared));
    }
}

/// The turns of a run that makes them on its caller's thread. No thread watches them: a caller on another one judges
/// the turn in progress.
#[derive(Debug)]
pub(crate) struct UnwatchedTurns {
    word: WatchdogWord,
    /// When the turn in progress began, or the last one, nanoseconds after [`Self::epoch`].
    began_ns: AtomicU64,
    epoch: Instant,
    watchdog: Watchdog,
}

impl UnwatchedTurns {
    /// The turns of the run of `handles`, judged for as long as they are kept.
    pub fn new(handles: &Agents) -> Arc<Self> {
        let (word, began_ns, epoch) = (WatchdogWord::default(), AtomicU64::new(0), Instant::now());
        let watchdog = Watchdog::new(handles, StallLimit::default());
        let turns = Arc::new(Self { word, began_ns, epoch, watchdog });
        handles.sleep.callers_turn.set(&turns);
        turns
    }

    pub fn set_limit(&self, limit: Duration) {
        self.watchdog.limit.set(limit);
    }

    /// Turn number `turn` of the run begins at `now`, of `id`.
    pub fn begin(&self, turn: u64, id: AgentId, now: Instant) -> WatchedTurn {
        self.began_ns.store(now.saturating_duration_since(self.epoch).as_nanos() as u64, Relaxed);
        self.word.begin(turn as u32, id)
    }

    /// It has ended.
    pub fn end(&self, turn: WatchedTurn) {
        if !self.word.end(turn) {
            self.watchdog.resume(turn.agent());
        }
    }
}

impl CallersTurn for UnwatchedTurns {
    fn judge(&self) -> Option<AgentId> {
        // read first: it began no later than this says
        let turn = self.word.current()?;
        let began = self.epoch + Duration::from_nanos(self.began_ns.load(Relaxed));
        self.watchdog.judge_after(&self.word, turn, began.elapsed());
        if self.word.is_stalled() { self.watchdog.culprit(turn.agent()) } else { None }
    }

    fn park(&self) -> bool {
        let (Some(_), Some(turn)) = (self.judge(), self.word.current()) else { return false };
        self.watchdog.each_live(turn.agent(), |shared| {
            let lasts_s = shared.gauges.stalled_for().as_secs_f64();
            shared.gauges.park(format!("a step did not end within {lasts_s:.1} s"));
            self.watchdog.sleep.changed.mark(shared.id);
        });
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::helpers::Helpers;
    use super::*;
    use crate::agent::spawn::{AssembledRun, assemble};
    use crate::executors::testing::{Dummy, eventually};
    use crate::records::metrics::AgentState;
    use std::cell::RefCell;

    #[test]
    fn agents_that_a_stalled_turn_released_go_on_when_it_ends() {
        let spawns = vec![Dummy::new(1.0).at(1e5), Dummy::new(1.0).at(1e5)];
        let AssembledRun { all, .. } = assemble(spawns, Helpers::none()).unwrap();
        let watchdog = Watchdog::new(&all.handles, StallLimit::of(Duration::from_millis(1)));
        all.sleep.follow(AgentId(1), Some(AgentId(0)));
        let (word, seen) = (WatchdogWord::default(), RefCell::new(Seen::default()));
        let turn = word.begin(1, AgentId(0));
        eventually("it is stalled", || watchdog.judge(&word, &mut seen.borrow_mut()));
        let states = || all.handles.iter().map(AgentHandle::state).collect::<Vec<_>>();
        assert_eq!(states(), [AgentState::Stalled, AgentState::Stalled]);
        // its cluster parts in the turn
        all.sleep.follow(AgentId(1), None);
        assert!(!word.end(turn));
        watchdog.resume(AgentId(0));
        assert_eq!(states(), [AgentState::Running, AgentState::Running]);
    }

    #[test]
    fn either_the_step_returns_or_it_is_stalled() {
        let word = WatchdogWord::default();
        assert_eq!(word.current(), None);
        let first = word.begin(1, AgentId(7));
        assert_eq!(word.current().map(WatchedTurn::agent), Some(AgentId(7)));
        assert!(word.end(first));
        assert!(!word.stall(first), "it is over");
        let second = word.begin(2, AgentId(7));
        assert_ne!(first, second);
        assert!(word.stall(second) && word.is_stalled());
        assert_eq!(word.current(), Some(second), "it goes on");
        assert!(!word.end(second), "it was stalled");
        assert!(word.current().is_none() && !word.is_stalled());
        word.leave();
        assert!(word.has_ended() && word.current().is_none() && !word.is_stalled());
    }
}
