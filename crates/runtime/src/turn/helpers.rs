//! Threads that help with turns: the members of a large cluster are stepped by several of them at the same time.
//!
//! In: the turn of a cluster. Out: its return value, and its time on threads other than the caller's. The bits do not
//! depend on who makes what ([`metachron_core::parallel`]). Never here: which turns are worth it, what is done side by
//! side.

use crate::executors::priority::{Priority, take_priority};
use crate::time::cpu::thread_time;
use metachron_core::parallel::is_worth_dividing;
use metachron_core::{ParallelFor, PlainLoop};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::Cell;
use std::num::NonZero;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::thread;
use std::time::{Duration, Instant};

/// The helping threads of a run, started by the first turn that is worth it.
pub(crate) struct Helpers {
    pool: OnceLock<Option<ThreadPool>>,
    threads: usize,
    priority: Priority,
}

/// The time of turns while other threads made them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Helped {
    /// Wall time for which the caller waited.
    pub waited: Duration,
    /// CPU time of the helpers.
    pub cpu: Duration,
}

impl Helped {
    /// The time of cores that a turn took whose caller took `caller_s` seconds.
    pub fn core_s(self, caller_s: f64) -> f64 {
        (caller_s - self.waited.as_secs_f64()).max(0.0) + self.cpu.as_secs_f64()
    }
}

/// One turn that is made by helpers.
#[derive(Debug, Default)]
struct Turn {
    cpu_ns: AtomicU64,
}

thread_local! {
    /// CPU time that jobs which began on this thread have accounted for, nanoseconds: the work of a thread while it
    /// waits for a part of one turn may be a part of another.
    static ACCOUNTED_NS: Cell<u64> = const { Cell::new(0) };
}

impl std::fmt::Debug for Helpers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Helpers").field("threads", &self.threads).finish_non_exhaustive()
    }
}

impl Helpers {
    /// No helpers: every turn is made by its caller.
    pub const fn none() -> Self {
        Self::with_threads(1, Priority::Normal)
    }

    /// A helper per core that the system gives.
    pub fn one_per_core(priority: Priority) -> Self {
        Self::with_threads(thread::available_parallelism().map_or(1, NonZero::get), priority)
    }

    const fn with_threads(threads: usize, priority: Priority) -> Self {
        Self { pool: OnceLock::new(), threads, priority }
    }

    /// Makes a `turn` of members of `size` blocks of three velocities in all: by helpers where that is worth it, while the caller waits.
    pub fn make<T: Send>(
        &self,
        size: usize,
        helped: &mut Helped,
        turn: impl FnOnce(&dyn ParallelFor) -> T + Send,
    ) -> T {
        let is_shared = self.threads > 1 && is_worth_dividing(size);
        let pool = is_shared.then(|| self.pool.get_or_init(|| self.start())).and_then(Option::as_ref);
        // the system may refuse threads
        let Some(pool) = pool else { return turn(&PlainLoop) };
        let (this, since) = (Turn::default(), Instant::now());
        let made = pool.install(|| this.account(|| turn(&this)));
        helped.waited += since.elapsed();
        helped.cpu += Duration::from_nanos(this.cpu_ns.into_inner());
        made
    }

    fn start(&self) -> Option<ThreadPool> {
        let priority = self.priority;
        let pool = ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .thread_name(|at| format!("helper:{at}"))
            // a refusal was already reported to the caller of `ask_priority`
            .start_handler(move |_| drop(take_priority(priority)));
        pool.build().ok()
    }
}

impl Turn {
    /// Runs `job`, which began on this thread, and accounts for the CPU time that it takes there.
    fn account<T>(&self, job: impl FnOnce() -> T) -> T {
        let _account = Account { turn: self, from: thread_time(), before_ns: ACCOUNTED_NS.get() };
        job()
    }
}

/// A job that is accounted for when it ends, by a panic too.
struct Account<'a> {
    turn: &'a Turn,
    /// On the thread's clock, and the time that jobs on the thread had accounted for, when it began.
    from: Option<Duration>,
    before_ns: u64,
}

impl Drop for Account<'_> {
    fn drop(&mut self) {
        let took = thread_time().zip(self.from).map_or(Duration::ZERO, |(to, from)| to.saturating_sub(from));
        let took_ns = took.as_nanos() as u64;
        let others_ns = ACCOUNTED_NS.get() - self.before_ns;
        self.turn.cpu_ns.fetch_add(took_ns.saturating_sub(others_ns), Relaxed);
        ACCOUNTED_NS.set(self.before_ns + took_ns);
    }
}

impl ParallelFor for Turn {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        rayon::join_context(|_| first(), |context| if context.migrated() { self.account(second) } else { second() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use metachron_contact::detect::ClusterScene;
    use metachron_contact::member::{ContactMemory, Participant};
    use metachron_contact::step::ClusterStepper;
    use metachron_contact::{Agent, StepContext};
    use metachron_core::{AgentId, HASH_START, SimSpan, SimTime, Snapshot};
    use metachron_models::rod::{Material, Section, Tube, TubeSpec};

    /// Computes for at least `span` of CPU time.
    fn compute(span: Duration) {
        let from = thread_time().unwrap();
        while thread_time().unwrap() - from < span {}
    }

    fn nested(threads: &dyn ParallelFor, depth: u32) {
        if depth == 0 {
            return compute(Duration::from_millis(2));
        }
        threads.join(&mut || nested(threads, depth - 1), &mut || nested(threads, depth - 1));
    }

    #[test]
    fn cpu_time_is_counted_once_whoever_took_a_part_on() {
        let helpers = Helpers::with_threads(3, Priority::Normal);
        thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    let mut helped = Helped::default();
                    helpers.make(1000, &mut helped, |threads| nested(threads, 4));
                    let ms = helped.cpu.as_secs_f64() * 1e3;
                    // 16 parts of 2 ms; the time of a thread that looks for work is not a multiple of it
                    assert!((32.0..64.0).contains(&ms), "{ms}");
                    assert!(helped.waited > Duration::from_millis(4), "32 ms on three threads take more than 4 ms");
                });
            }
        });
    }

    #[test]
    fn a_panic_reaches_the_caller_and_the_next_turn_is_made() {
        let helpers = Helpers::with_threads(2, Priority::Normal);
        let fails = || {
            helpers.make(1000, &mut Helped::default(), |threads| threads.join(&mut || (), &mut || panic!("here")));
        };
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(fails)).is_err());
        assert_eq!(helpers.make(1000, &mut Helped::default(), |_| 7), 7);
    }

    /// A tube of 20 segments, 6 mm thick.
    fn tube(middle: DVec3, half: DVec3, gravity: DVec3) -> Tube {
        let material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
        let section = Section::hollow(0.003, 0.003, material);
        let spec = TubeSpec::free(vec![middle - half, middle + half], section, 20);
        Tube::new(TubeSpec { gravity, friction: 0.5, ..spec }).unwrap()
    }

    /// Six tubes fall on six others that lie across, for 60 steps: the hash of their states, and the helpers' time.
    fn fall(helpers: &Helpers) -> (u64, Helped) {
        let place = |k: u32| 0.02 * f64::from(k) - 0.05;
        let low = (0..6).map(|k| tube(DVec3::X * place(k), DVec3::Y * 0.1, DVec3::ZERO));
        let high = (0..6).map(|k| tube(DVec3::new(0.0, place(k), 0.0065), DVec3::X * 0.1, DVec3::Z * -9.81));
        let mut tubes: Vec<Tube> = low.chain(high).collect();
        let mut kept: Vec<_> = tubes.iter().map(|_| (ContactMemory::default(), Vec::new())).collect();
        let (mut stepper, mut helped) = (ClusterStepper::default(), Helped::default());
        let (dt, mut time, mut contacts) = (SimSpan::from_nanos(4_000_000), SimTime::ZERO, 0);
        for _ in 0..60 {
            let agents = tubes.iter_mut().zip(&mut kept).zip((0..).map(AgentId));
            let mut all: Vec<_> = agents
                .map(|((tube, (memory, grips)), id)| {
                    let context = StepContext::alone(id, time);
                    Participant {
                        id,
                        member: tube.member().unwrap().into(),
                        context,
                        laws: &[],
                        memory,
                        parts: 1,
                        alone_s: 0.004,
                        grips,
                    }
                })
                .collect();
            let size = all.iter().map(Participant::size).sum();
            let scene = ClusterScene::default();
            let step = |threads: &dyn ParallelFor| stepper.step(&scene, &mut all, dt, threads).unwrap();
            contacts += helpers.make(size, &mut helped, step).contacts;
            time += dt;
        }
        assert!(contacts > 1000, "they touch: {contacts}");
        let mut state = Snapshot::default();
        let hash = tubes.iter().fold(HASH_START, |hash, tube| {
            tube.write_snapshot(&mut state);
            state.fold_hash(hash)
        });
        (hash, helped)
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_helpers() {
        let (alone, helped) = fall(&Helpers::none());
        assert_eq!(helped, Helped::default());
        for threads in [2, 8] {
            let (hash, helped) = fall(&Helpers::with_threads(threads, Priority::Normal));
            assert_eq!(hash, alone, "{threads} threads");
            assert!(helped.cpu > Duration::ZERO && helped.waited > Duration::ZERO);
        }
    }
}
