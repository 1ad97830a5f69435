//! CPU time of turns, read from the thread's clock once per batch: reading the clock costs as much as a small step.
//!
//! In: the wall time of each turn of a batch. Out: the share of it that was CPU time. A turn that was interrupted took long wall time and
//! little CPU time: the batch's share corrects for it. Never here: which agents made the turns.

use cpu_time::ThreadTime;
use std::time::{Duration, Instant};

/// Turns made on one thread since the thread's clock was last read.
#[derive(Debug, Default)]
pub(crate) struct CpuBatch {
    opened: Option<Opened>,
    wall: Duration,
    turns: u32,
}

/// When a batch was opened.
#[derive(Debug, Clone, Copy)]
struct Opened {
    /// On the thread's clock; `None` if the system does not provide it, and wall time is used instead.
    cpu: Option<Duration>,
    wall: Instant,
}

/// A batch is closed after this many turns.
const TURNS_MAX: u32 = 256;

/// A batch is closed after this much work.
const WORK_MAX: Duration = Duration::from_millis(20);

/// A batch is closed at this age, so that the metrics of a slow agent are no older.
const AGE_MAX: Duration = Duration::from_millis(500);

impl CpuBatch {
    /// Opens a batch on this thread, unless one is open.
    pub fn open(&mut self) {
        self.opened.get_or_insert_with(|| Opened { cpu: thread_time(), wall: Instant::now() });
    }

    /// Counts a turn that took `wall`; returns whether the batch should be closed.
    pub fn add(&mut self, wall: Duration) -> bool {
        self.count(wall);
        self.is_full() || self.opened.is_some_and(|o| o.wall.elapsed() >= AGE_MAX)
    }

    fn count(&mut self, wall: Duration) {
        self.wall += wall;
        self.turns += 1;
    }

    fn is_full(&self) -> bool {
        self.turns >= TURNS_MAX || self.wall >= WORK_MAX
    }

    /// Whether no turn has been counted since the last batch was closed.
    pub const fn is_empty(&self) -> bool {
        self.turns == 0
    }

    /// Closes the batch on the thread that opened it: the share of its turns' wall time that was CPU time, `0..=1`.
    pub fn close(&mut self) -> f64 {
        let Self { opened, wall, .. } = std::mem::take(self);
        let Some(from) = opened.and_then(|o| o.cpu) else { return 1.0 };
        let Some(to) = thread_time() else { return 1.0 };
        let cpu = to.saturating_sub(from);
        if wall.is_zero() { 1.0 } else { (cpu.as_secs_f64() / wall.as_secs_f64()).min(1.0) }
    }
}

/// The share of wall time that is CPU time, for turns that must be accounted for immediately, because other agents make the next ones.
#[derive(Debug)]
pub(crate) struct CpuShare {
    batch: CpuBatch,
    share: f64,
    /// CPU time used and not accounted for, seconds; negative if too much was accounted for.
    owed_s: f64,
}

impl CpuShare {
    pub fn new() -> Self {
        Self { batch: CpuBatch::default(), share: 1.0, owed_s: 0.0 }
    }

    /// Counts a turn that took `wall` and began after [`Self::open`]; returns the share of it to be accounted for. The error of the newest
    /// batch is corrected in the next one.
    pub fn count(&mut self, wall: Duration) -> f64 {
        let share = self.share;
        self.batch.count(wall);
        if self.batch.is_full() {
            let wall_s = self.batch.wall.as_secs_f64();
            let measured = self.batch.close();
            self.owed_s += (measured - share) * wall_s;
            self.share = if wall_s > 0.0 { (measured + self.owed_s / wall_s).clamp(0.0, 1.0) } else { measured };
        }
        share
    }

    /// The worker's thread starts making turns.
    pub fn open(&mut self) {
        self.batch.open();
    }
}

/// The CPU time of this thread.
pub(crate) fn thread_time() -> Option<Duration> {
    ThreadTime::try_now().ok().map(|t| t.as_duration())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_on_the_wall_without_computing_is_no_cpu_time() {
        let mut batch = CpuBatch::default();
        batch.open();
        batch.add(Duration::from_secs(3600));
        // the test itself computes far less than 36 s
        assert!(batch.close() < 0.01);
    }

    #[test]
    fn an_overcount_of_one_batch_is_made_up_by_the_next_ones() {
        let mut share = CpuShare::new();
        let mut counted_s = 0.0;
        // turns of an hour that the test does not really compute
        for _ in 0..10 {
            share.open();
            counted_s += 3600.0 * share.count(Duration::from_secs(3600));
        }
        assert!(share.owed_s < 0.0 && counted_s <= 3600.0, "{counted_s}");
        assert!(share.share == 0.0);
    }

    #[test]
    fn a_turn_never_costs_more_than_it_took() {
        let mut batch = CpuBatch::default();
        batch.open();
        let busy = (0..1_000_000_u64).fold(0, |a, b| a ^ b.wrapping_mul(a | 1));
        batch.add(Duration::from_nanos(1 + busy % 2));
        assert_eq!(batch.close(), 1.0);
    }
}
