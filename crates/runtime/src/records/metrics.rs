//! Metrics of an agent: the cost of its turns and how well it keeps its time, readable from any thread at any moment.
//!
//! In: turns, from the thread that makes them. Out: [`AgentStats`]. Each number is one atomic word: consistent in itself, and as new as the
//! last turn. Never here: locks on the agent's side, printing.

use super::histogram::{Histogram, Percentiles};
use crate::time::agent_clock::AgentClock;
use arc_swap::ArcSwapOption;
use metachron_core::{AgentId, Archive, ArchiveError, Resolution, SimSpan, SimTime, archive_values};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, Ordering::Relaxed};
use std::time::Duration;

/// The model of a number of which nothing else is known.
pub(crate) const REMOVED: &str = "removed";

/// State of an agent's execution.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AgentState {
    /// It steps.
    Running,
    /// Its step, or that of one in whose cluster it steps, lasts too long: it goes on where that ends.
    Stalled,
    /// It is at rest and takes no steps until it is woken.
    Resting,
    /// It was parked for this reason; its last snapshot remains.
    Parked(String),
    /// It was taken out of the run.
    Gone,
}

/// Statistics of an agent so far; of one that joined the run and has left nothing but its name.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentStats {
    /// The agent.
    pub id: AgentId,
    /// Its name in the scene.
    pub name: Arc<str>,
    /// Its model.
    pub model: &'static str,
    /// Steps taken.
    pub steps: u64,
    /// Steps per simulated second over the last half second; zero at rest and when parked.
    pub rate_hz: f64,
    /// Steps per simulated second over all time that it was awake.
    pub mean_hz: f64,
    /// Steps per simulated second requested by the scene.
    pub wanted_hz: f64,
    /// The present step length.
    pub dt: SimSpan,
    /// The resolution of the newest state; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// Number of nodes that its newest state was solved at; `None` for a model without nodes.
    pub nodes: Option<u32>,
    /// Its share of the time that cores take for a turn, seconds, waiting for a core included, smoothed; virtual in lockstep.
    pub work_s: f64,
    /// Wall time of the turns that it makes, with all agents that it leads, seconds, smoothed: less than cores take for them where threads
    /// help; 0 before it has made one.
    pub turn_s: f64,
    /// Work of its steps so far, in its model's unit.
    pub work: f64,
    /// CPU time of its turns so far, seconds; measured, in lockstep too.
    pub cpu_s: f64,
    /// Age of its newest state when a reader used it ([`crate::AgentHandle::record_age`]).
    pub age: Percentiles,
    /// Delay between the release of its turns and their start, wall time.
    pub late: Percentiles,
    /// Turns published after the end of their step.
    pub misses: u64,
    /// Simulated time that it has lived: the sum of its steps, and its time at rest.
    pub lived: SimSpan,
    /// Steps of these that were longer than the step asked of it then.
    pub lengthened: u64,
    /// Steps of its cluster so far in which its motion asked for more division than a step may have (docs/theory/clusters.md, section 9).
    pub under_resolved: u64,
    /// Simulated time dropped because it could not be made up.
    pub dropped: SimSpan,
    /// Simulated time at rest.
    pub rested: SimSpan,
    /// State of its execution.
    pub state: AgentState,
    /// Mechanical energy of the newest state, joules.
    pub energy_j: f64,
    /// Estimated error of the newest state, metres.
    pub residual_m: f64,
    /// The part of it caused by its time steps, metres.
    pub drift_m: f64,
    /// The leader that makes its turns, on the leader's thread and clock, because the two are of one cluster; `None` if it makes them itself.
    pub led_by: Option<AgentId>,
}

impl AgentStats {
    /// The figures of an agent that has left and of which nothing is kept.
    pub(crate) fn of_removed(id: AgentId, name: &str) -> Self {
        let (none, times) = (SimSpan::ZERO, Percentiles::default());
        Self {
            id,
            name: name.into(),
            model: REMOVED,
            steps: 0,
            rate_hz: 0.0,
            mean_hz: 0.0,
            wanted_hz: 0.0,
            dt: none,
            resolution: None,
            nodes: None,
            work_s: 0.0,
            turn_s: 0.0,
            work: 0.0,
            cpu_s: 0.0,
            age: times,
            late: times,
            misses: 0,
            lived: none,
            lengthened: 0,
            under_resolved: 0,
            dropped: none,
            rested: none,
            state: AgentState::Gone,
            energy_j: 0.0,
            residual_m: 0.0,
            drift_m: 0.0,
            led_by: None,
        }
    }
}

/// A number that one thread writes and any thread reads.
#[derive(Debug, Default)]
pub(crate) struct Gauge(AtomicU64);

impl Gauge {
    pub fn set(&self, value: f64) {
        self.0.store(value.to_bits(), Relaxed);
    }

    pub fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Relaxed))
    }
}

const RUNNING: u8 = 0;
const RESTING: u8 = 1;
const PARKED: u8 = 2;
const GONE: u8 = 3;
const STALLED: u8 = 4;

/// A turn that has lasted for so long is not waited for any more.
pub const STALLED_FOR_GOOD: Duration = Duration::from_secs(5);

/// The readable side of an agent's metrics.
#[derive(Debug, Default)]
pub(crate) struct Metrics {
    pub steps: AtomicU64,
    pub misses: AtomicU64,
    pub lengthened: AtomicU64,
    pub under_resolved: AtomicU64,
    /// The sum of its steps, nanoseconds.
    pub stepped: AtomicU64,
    pub dt: AtomicU64,
    pub dropped: AtomicU64,
    pub rested: AtomicU64,
    pub cpu_nanos: AtomicU64,
    /// The scene time at which it woke last.
    pub woken_at: AtomicU64,
    pub rate_hz: Gauge,
    pub mean_hz: Gauge,
    pub work_s: Gauge,
    pub turn_s: Gauge,
    pub work: Gauge,
    late: [Gauge; 3],
    state: AtomicU8,
    /// How often its code was the reason of a turn that lasted too long, and for how long the last one had, ms.
    pub stalls: AtomicU32,
    stalled_ms: AtomicU32,
    /// Why it was parked; read when it is.
    reason: ArcSwapOption<String>,
}

/// Counts in files are no larger: they go on rising.
const COUNT_MAX: u64 = u64::MAX / 2;

/// The part of [`Metrics`] that a checkpoint has.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct MetricsValues {
    counts: [u64; 8],
    gauges: [f64; 4],
    state: u8,
    reason: Option<String>,
}

impl MetricsValues {
    /// Whether an agent can be in that condition.
    pub fn is_sound(&self) -> bool {
        matches!(self.state, RUNNING | RESTING | PARKED | GONE) && self.counts.iter().all(|count| *count <= COUNT_MAX)
    }
}

impl Metrics {
    pub fn state(&self) -> AgentState {
        match self.state.load(Relaxed) {
            RUNNING => AgentState::Running,
            RESTING => AgentState::Resting,
            GONE => AgentState::Gone,
            STALLED => AgentState::Stalled,
            _ => AgentState::Parked(self.reason.load().as_deref().cloned().unwrap_or_default()),
        }
    }

    pub fn is_resting(&self) -> bool {
        self.state.load(Relaxed) == RESTING
    }

    pub fn is_running(&self) -> bool {
        self.state.load(Relaxed) == RUNNING
    }

    pub fn is_stalled(&self) -> bool {
        self.state.load(Relaxed) == STALLED
    }

    /// Whether it makes no more turns: it is parked, or has left.
    pub fn has_ended(&self) -> bool {
        matches!(self.state.load(Relaxed), PARKED | GONE)
    }

    /// Its turn has lasted too long, for so long already; `by_it`: by its own code.
    pub fn stall(&self, lasts: Duration, by_it: bool) {
        self.set_stalled_for(lasts);
        self.stalls.fetch_add(u32::from(by_it), Relaxed);
        // one that rests or is parked makes no turn
        let _ = self.state.compare_exchange(RUNNING, STALLED, Relaxed, Relaxed);
    }

    /// Such a turn has ended.
    pub fn resume(&self) {
        let _ = self.state.compare_exchange(STALLED, RUNNING, Relaxed, Relaxed);
    }

    pub fn set_stalled_for(&self, lasts: Duration) {
        self.stalled_ms.store(lasts.as_millis().min(u128::from(u32::MAX)) as u32, Relaxed);
    }

    pub fn stalled_for(&self) -> Duration {
        Duration::from_millis(u64::from(self.stalled_ms.load(Relaxed)))
    }

    pub fn set_resting(&self, resting: bool) {
        self.state.store(if resting { RESTING } else { RUNNING }, Relaxed);
    }

    /// Notes that the agent has left the run for good.
    pub fn leave(&self) {
        self.state.store(GONE, Relaxed);
    }

    pub fn has_left(&self) -> bool {
        self.state.load(Relaxed) == GONE
    }

    /// Parks the agent for good; the first reason is kept.
    pub fn park(&self, reason: String) {
        if matches!(self.state.load(Relaxed), RUNNING | RESTING | STALLED) {
            self.reason.store(Some(Arc::new(reason)));
            self.state.store(PARKED, Relaxed);
        }
    }

    /// The numbers and the condition, but CPU time and the times by which turns were late.
    pub fn values(&self) -> MetricsValues {
        MetricsValues {
            counts: self.counts().map(|count| count.load(Relaxed)),
            gauges: self.gauges().map(Gauge::get),
            // between turns none is stalled
            state: if self.is_stalled() { RUNNING } else { self.state.load(Relaxed) },
            reason: self.reason.load().as_deref().cloned(),
        }
    }

    /// Takes such values over; called between turns.
    pub fn set_values(&self, values: &MetricsValues) {
        self.counts().iter().zip(values.counts).for_each(|(count, value)| count.store(value, Relaxed));
        self.gauges().iter().zip(values.gauges).for_each(|(gauge, value)| gauge.set(value));
        self.reason.store(values.reason.clone().map(Arc::new));
        self.state.store(values.state, Relaxed);
    }

    const fn counts(&self) -> [&AtomicU64; 8] {
        let Self { steps, misses, lengthened, under_resolved, stepped, dt, dropped, rested, .. } = self;
        [steps, misses, lengthened, under_resolved, stepped, dt, dropped, rested]
    }

    const fn gauges(&self) -> [&Gauge; 4] {
        let Self { rate_hz, mean_hz, work_s, work, .. } = self;
        [rate_hz, mean_hz, work_s, work]
    }

    /// CPU time of turns so far, seconds.
    pub fn cpu_s(&self) -> f64 {
        self.cpu_nanos.load(Relaxed) as f64 * 1e-9
    }

    pub fn late(&self) -> Percentiles {
        let [p50_s, p99_s, max_s] = [0, 1, 2].map(|k| self.late[k].get());
        Percentiles { p50_s, p99_s, max_s }
    }

    fn set_late(&self, times: Percentiles) {
        for (gauge, value) in self.late.iter().zip([times.p50_s, times.p99_s, times.max_s]) {
            gauge.set(value);
        }
    }
}

/// Window of the recent rate, simulated time.
const RATE_WINDOW: SimSpan = SimSpan::from_nanos(500_000_000);

/// The weight of a new value in a smoothed one: about eight values count.
pub(crate) const SMOOTHING: f64 = 0.125;

/// The writing side of an agent's metrics, owned by the thread that makes its turns.
#[derive(Debug)]
pub(crate) struct MetricsWriter {
    turns: u64,
    steps: u64,
    late: Histogram,
    work_s: Option<f64>,
    turn_s: Option<f64>,
    window: (SimTime, u64),
    first_window: bool,
}

/// A turn, as recorded in the metrics.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    /// Steps of its own that it made.
    pub steps: u32,
    /// How long they took together.
    pub span: SimSpan,
    /// Simulated time at the turn's end.
    pub now: SimTime,
    /// How late it began.
    pub late: Duration,
    /// Whether it was published after the end of its step.
    pub missed: bool,
    /// The time that cores took for it, seconds.
    pub work_s: f64,
}

impl MetricsWriter {
    pub fn new() -> Self {
        let window = (SimTime::ZERO, 0);
        Self { turns: 0, steps: 0, late: Histogram::default(), work_s: None, turn_s: None, window, first_window: true }
    }

    /// Writes or reads the counts, but for the times by which turns were late.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let Self { turns, steps, work_s, turn_s, window, first_window, .. } = self;
        archive_values!(archive, *turns, *steps, *work_s, *turn_s, *window, *first_window)?;
        if window.1 <= *steps && *steps <= COUNT_MAX && *turns <= COUNT_MAX {
            return Ok(());
        }
        let found = format!("{steps} after {} steps, in {turns} turns", window.1);
        Err(ArchiveError::Mismatch { what: "the number of steps", found, expected: "one that rises".to_owned() })
    }

    /// Turns recorded so far.
    pub const fn turns(&self) -> u64 {
        self.turns
    }

    /// Steps recorded so far.
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// Reads a word of the memory that a turn will write to ([`crate::turn::prefetch`]).
    pub fn fetch(&self) {
        self.late.fetch();
    }

    /// Records a turn.
    pub fn write(&mut self, gauges: &Metrics, pace: &AgentClock, entry: Entry) {
        self.turns += 1;
        self.steps += u64::from(entry.steps);
        self.late.record(entry.late);
        let work_s = smoothed(&mut self.work_s, entry.work_s);
        gauges.steps.store(self.steps, Relaxed);
        add(&gauges.misses, u64::from(entry.missed));
        add(&gauges.stepped, entry.span.as_nanos());
        if is_longer(entry.span, entry.steps, pace.wanted()) {
            add(&gauges.lengthened, u64::from(entry.steps));
        }
        gauges.work_s.set(work_s);
        self.pace(gauges, pace);
        // the step just made covers the time up to the agent's own
        let lived = pace.scene_time().max(entry.now).since(SimTime::ZERO + pace.rested());
        gauges.mean_hz.set(self.steps as f64 / lived.as_secs_f64());
        self.count_rate(gauges, entry.now);
    }

    /// Records the wall time of a turn that the agent made, turns of the agents that it leads included.
    pub fn time_turn(&mut self, gauges: &Metrics, turn_s: f64) {
        gauges.turn_s.set(smoothed(&mut self.turn_s, turn_s));
    }

    /// Publishes the values of the pace.
    pub fn pace(&self, gauges: &Metrics, pace: &AgentClock) {
        gauges.dt.store(pace.dt().as_nanos(), Relaxed);
        gauges.dropped.store(pace.dropped().as_nanos(), Relaxed);
        gauges.rested.store(pace.rested().as_nanos(), Relaxed);
    }

    /// Restarts the measurement of the rate, after a rest.
    pub fn restart(&mut self, now: SimTime) {
        self.window = (now, self.steps);
    }

    /// Updates the percentiles: too expensive for every turn.
    pub fn flush(&self, gauges: &Metrics) {
        gauges.set_late(self.late.percentiles());
    }

    fn count_rate(&mut self, gauges: &Metrics, now: SimTime) {
        let (since, steps) = self.window;
        let span = now.since(since);
        let full = span >= RATE_WINDOW;
        if full || (self.first_window && span > SimSpan::ZERO) {
            gauges.rate_hz.set((self.steps - steps) as f64 / span.as_secs_f64());
        }
        if full {
            self.window = (now, self.steps);
            self.first_window = false;
            self.flush(gauges);
        }
    }
}

/// Adds to a count that no other thread writes: an atomic addition would cost more.
pub(crate) fn add(count: &AtomicU64, more: u64) {
    count.store(count.load(Relaxed) + more, Relaxed);
}

/// Whether so many steps that take a span together are longer than the one that was asked for, by more than each is rounded, a nanosecond.
fn is_longer(span: SimSpan, steps: u32, wanted: SimSpan) -> bool {
    span.as_nanos() > u64::from(steps) * (wanted.as_nanos() + 1)
}

fn smoothed(held: &mut Option<f64>, new: f64) -> f64 {
    *held.insert(held.map_or(new, |old| old + SMOOTHING * (new - old)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reason_to_park_stands() {
        let gauges = Metrics::default();
        gauges.park("first".into());
        gauges.park("second".into());
        assert_eq!(gauges.state(), AgentState::Parked("first".into()));
    }

    #[test]
    fn counts_that_cannot_go_on_rising_are_refused() {
        for (turns, steps, before) in [(3, 3, 4), (3, u64::MAX, 0), (u64::MAX, 3, 0)] {
            let mut counts = MetricsWriter { turns, steps, window: (SimTime::ZERO, before), ..MetricsWriter::new() };
            assert!(counts.archive(&mut Archive::writer()).is_err());
        }
        let full = MetricsValues { counts: [u64::MAX; 8], state: RUNNING, ..MetricsValues::default() };
        assert!(!full.is_sound());
    }
}
