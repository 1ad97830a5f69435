//! Wake-up of a pool's workers: which agents were notified, and which sleeping worker can serve them.
//!
//! In: notifications from any thread. Out: the notified agents, once, to the first worker that looks.
//! No thread blocks another, and no notification is lost: the caller marks the agent first and looks for sleepers after; a worker declares
//! itself asleep first and looks at the marks after. With a fence (SeqCst) between, at least one of the two sees the other.
//! Never here: what a worker does with the notified agents, how long it sleeps.

use super::sync::Mutex;
use super::sync::atomic::{
    AtomicBool, AtomicU64,
    Ordering::{AcqRel, Acquire, Relaxed, Release, SeqCst},
    fence,
};
use super::sync::thread;
use super::sync::thread::Thread;
use metachron_core::AgentId;
use std::sync::PoisonError;
use std::time::Duration;

/// The marks of all agents and the sleep states of all workers.
#[derive(Debug)]
pub(crate) struct WorkerWakeup {
    /// One bit per agent.
    marks: boxcar::Vec<AtomicU64>,
    notified: AtomicBool,
    workers: Vec<Parker>,
}

/// Sleep state of one worker.
#[derive(Debug, Default)]
struct Parker {
    asleep: AtomicBool,
    /// Changes only when a worker is replaced.
    thread: Mutex<Option<Thread>>,
}

impl WorkerWakeup {
    pub fn new(agents: usize, workers: usize) -> Self {
        let wakeup = Self {
            marks: boxcar::Vec::new(),
            notified: AtomicBool::new(false),
            workers: std::iter::repeat_with(Parker::default).take(workers).collect(),
        };
        wakeup.reach(agents);
        wakeup
    }

    /// Makes room for so many agents.
    pub fn reach(&self, agents: usize) {
        while self.marks.count() < agents.div_ceil(64) {
            self.marks.push(AtomicU64::default());
        }
    }

    /// Worker `at` runs on this thread.
    pub fn register(&self, at: usize) {
        if let Some(worker) = self.workers.get(at) {
            worker.asleep.store(false, Relaxed);
            *worker.thread.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread::current());
        }
    }

    /// Summons `id`: a worker that is awake sees it before its next turn, else one is woken.
    pub fn notify(&self, id: AgentId) {
        let Some(word) = self.marks.get(id.0 as usize / 64) else { return };
        word.fetch_or(1 << (id.0 % 64), Release);
        self.notified.store(true, Release);
        fence(SeqCst);
        self.wake_one();
    }

    /// Wakes one sleeping worker, if there is one.
    pub fn wake_one(&self) {
        if let Some(worker) =
            self.workers.iter().find(|worker| worker.asleep.load(Relaxed) && worker.asleep.swap(false, AcqRel))
        {
            worker.wake();
        }
    }

    /// Makes every worker check for work, whether it sleeps or is about to.
    pub fn wake_all(&self) {
        self.workers.iter().for_each(Parker::wake);
    }

    /// Whether any agent was notified since the last [`Self::take_notified`].
    pub fn is_notified(&self) -> bool {
        self.notified.load(Acquire)
    }

    /// Visits the agents notified since the last call, by rising numbers; returns their count.
    pub fn take_notified(&self, mut visit: impl FnMut(AgentId)) -> usize {
        if !self.notified.swap(false, AcqRel) {
            return 0;
        }
        let mut count = 0;
        for (at, word) in self.marks.iter().filter(|(_, word)| word.load(Relaxed) != 0) {
            let mut bits = word.swap(0, AcqRel);
            while bits != 0 {
                visit(AgentId(at as u32 * 64 + bits.trailing_zeros()));
                bits &= bits - 1;
                count += 1;
            }
        }
        count
    }

    /// Sleeps as worker `at` for `span` (`None`: without a timeout), unless an agent was notified. It may wake early.
    pub fn sleep(&self, at: usize, span: Option<Duration>) {
        let Some(worker) = self.workers.get(at) else { return };
        worker.asleep.store(true, Relaxed);
        fence(SeqCst);
        if !self.is_notified() {
            match span {
                Some(span) => thread::park_timeout(span),
                None => thread::park(),
            }
        }
        worker.asleep.store(false, Relaxed);
    }
}

impl Parker {
    fn wake(&self) {
        if let Some(thread) = &*self.thread.lock().unwrap_or_else(PoisonError::into_inner) {
            thread.unpark();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answered(wakeup: &WorkerWakeup) -> Vec<u32> {
        let mut seen = Vec::new();
        let count = wakeup.take_notified(|id| seen.push(id.0));
        assert_eq!(count, seen.len());
        seen
    }

    #[test]
    fn a_notified_agent_is_visited_once() {
        let wakeup = WorkerWakeup::new(200, 1);
        assert!(answered(&wakeup).is_empty());
        [199, 3, 64, 3, 0].iter().for_each(|id| wakeup.notify(AgentId(*id)));
        assert!(wakeup.is_notified());
        assert_eq!(answered(&wakeup), [0, 3, 64, 199]);
        assert!(answered(&wakeup).is_empty());
        wakeup.notify(AgentId(5000));
        assert!(!wakeup.is_notified(), "unknown agents are ignored");
    }

    #[test]
    fn no_worker_sleeps_through_a_notification() {
        let wakeup = WorkerWakeup::new(1, 1);
        let (rings, done) = (20_000, AtomicBool::new(false));
        let answered = AtomicU64::new(0);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                wakeup.register(0);
                while !done.load(SeqCst) {
                    wakeup.sleep(0, None);
                    wakeup.take_notified(|_| {
                        answered.fetch_add(1, SeqCst);
                    });
                }
            });
            for ring in 1..=rings {
                wakeup.notify(AgentId(0));
                while answered.load(SeqCst) < ring {
                    thread::yield_now();
                }
            }
            done.store(true, SeqCst);
            wakeup.notify(AgentId(0));
            wakeup.wake_all();
        });
        assert!(answered.load(SeqCst) >= rings);
    }
}
