//! `bench agents`: the cost of an agent over the bare physics, and the lateness of agents.
//!
//! In: executor, model, number and rate. Out: a row: CPU per step next to the bare loops of the same run, ages as a reader at 60 Hz
//! finds them, lateness, dropped time, memory, thread switches. Never here: files, tables.

use super::rig::bare;
use super::rig::cast::{Model, agent, spawn};
use super::rig::machine::{others_cpu, own_cpu, resident_bytes, switches};
use metachron_runtime::{
    AgentStats, Lockstep, Machine, Pool, Priority, Reader, Run, SystemClock, Threads, TimelineCommand,
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::{Duration, Instant};

metachron_core::choices! {
    /// The executor of the agents.
    pub enum Executor {
        Threads = "threads",
        Pool = "pool",
        Lockstep = "lockstep",
    }
}

/// One case to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    pub executor: Executor,
    pub model: Model,
    pub agents: usize,
    pub priority: Priority,
    /// Mean rate of an agent; far above the rate that the machine can hold where the case is unpaced.
    pub rate_hz: f64,
}

/// The measurements of one case. Times are those of the agent at which half, or 99 in 100, of the agents are better.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub executor: Executor,
    pub model: Model,
    pub realtime: bool,
    pub agents: usize,
    pub rate_hz: f64,
    /// CPU time of all threads but the reader's, per step; NaN where no agent steps.
    pub cpu_us_per_step: f64,
    /// The same per second of wall time.
    pub cores: f64,
    /// The limit of speed: the same steps in a loop that never sleeps.
    pub bare_us_per_step: f64,
    /// The same steps in a loop that sleeps to the same due times.
    pub sleeping_us_per_step: f64,
    /// The same steps on a plain thread each that sleeps to the same due times, for agents on threads only; and the ratio of an
    /// agent's step to that.
    pub thread_us_per_step: Option<f64>,
    pub over_thread: Option<f64>,
    pub steps_per_s: f64,
    pub wanted_steps_per_s: f64,
    pub age_ms_p50: f64,
    pub age_ms_p99: f64,
    pub late_ms_p50: f64,
    pub late_ms_p99: f64,
    /// Mean over the agents.
    pub dropped_ms: f64,
    /// Memory added by the run, without the models' own.
    pub bytes_per_agent: Option<f64>,
    pub switches_per_step: Option<f64>,
    /// Lateness of the starts of the reader's frames, 99 in 100.
    pub frame_late_ms_p99: f64,
    /// Time for the reader to take all newest states, per agent.
    pub read_ns_per_agent: f64,
    /// Time until all agents were running.
    pub start_ms: f64,
    pub shutdown_ms: f64,
}

/// A rate that no machine keeps.
pub(super) const UNPACED_HZ: f64 = 1e5;

/// A rate at which one agent in ten has a new state in each of the reader's frames.
pub(super) const TENTH_HZ: f64 = 6.0;

/// Longest wait for the first steps of all agents.
const WARM_UP: Duration = Duration::from_secs(20);

const FRAME: Duration = Duration::from_micros(16_667);

/// The cases of the benchmark.
pub(super) fn cases(quick: bool) -> Vec<Case> {
    use Executor::{Lockstep, Pool, Threads};
    use Model::{Asleep, Rigid, Rod, Synthetic};
    let counts: &[(usize, f64)] = if quick {
        &[(10, 198.0), (100, 198.0), (1000, 198.0), (10_000, 9.9), (100_000, 1.98)]
    } else {
        &[(1, 198.0), (10, 198.0), (30, 198.0), (100, 198.0), (300, 198.0), (1000, 198.0), (3000, 33.0), (10_000, 9.9)]
    };
    let more: &[(usize, f64)] = if quick { &[] } else { &[(30_000, 3.3), (100_000, 1.98)] };
    let case =
        |executor, model, (agents, rate_hz)| Case { executor, model, priority: Priority::Normal, agents, rate_hz };
    let mut cases = Vec::new();
    for &of in counts.iter().chain(more) {
        let executors: &[Executor] = if of.0 <= 1000 { &[Threads, Pool, Lockstep] } else { &[Pool, Lockstep] };
        cases.extend(executors.iter().map(|executor| case(*executor, Synthetic, of)));
    }
    cases.extend([1000, 10_000, 100_000].map(|agents| case(Pool, Synthetic, (agents, UNPACED_HZ))));
    cases.push(case(Pool, Synthetic, (10_000, TENTH_HZ)));
    cases.push(case(Pool, Asleep, (100_000, 1.98)));
    for executor in [Threads, Pool] {
        let thousand = case(executor, Synthetic, (64, 1000.0));
        cases.extend([thousand, Case { priority: Priority::Realtime, ..thousand }]);
    }
    for model in [Rod, Rigid] {
        cases.extend([Threads, Pool, Lockstep].map(|executor| case(executor, model, (100, 60.0))));
        cases.extend([6.0, UNPACED_HZ].map(|rate_hz| case(Pool, model, (1000, rate_hz))));
    }
    cases
}

/// Measures one case: about `span` for the bare loops and about `span` for the run.
pub fn measure(case: &Case, span: Duration) -> anyhow::Result<Row> {
    let bare = bare::measure(case.model, case.agents, case.rate_hz, span / 2)?;
    let on_threads = || bare::on_threads(case.model, case.agents, case.rate_hz, span / 2);
    let thread_us_per_step = (case.executor == Executor::Threads).then(on_threads).transpose()?;
    let spawns = (0..case.agents).map(|k| anyhow::Ok(spawn(agent(case.model, k)?, k, case.rate_hz)));
    let spawns = spawns.collect::<Result<Vec<_>, _>>()?;
    let clock = Arc::new(SystemClock::new());
    let before = resident_bytes();
    let started = Instant::now();
    let mut run: Box<dyn Run> = match case.executor {
        Executor::Threads => Box::new(Threads::start(spawns, clock, case.priority)?),
        Executor::Pool => Box::new(Pool::start(spawns, clock, case.priority)?),
        Executor::Lockstep => Box::new(Lockstep::start(spawns, Machine::default())?),
    };
    run.drive(TimelineCommand::Run);
    let start_ms = millis(started.elapsed());
    let observed = observe(&mut *run, case.executor == Executor::Lockstep, span);
    let after = resident_bytes();
    let started = Instant::now();
    let stats = run.shutdown();
    let shutdown_ms = millis(started.elapsed());
    let cpu_us_per_step = observed.per_step(observed.cpu.as_secs_f64() * 1e6);
    Ok(Row {
        executor: case.executor,
        model: case.model,
        realtime: case.priority == Priority::Realtime,
        agents: case.agents,
        rate_hz: case.rate_hz,
        cpu_us_per_step,
        cores: observed.cpu.as_secs_f64() / observed.wall.as_secs_f64(),
        bare_us_per_step: bare.free_us,
        sleeping_us_per_step: bare.paced_us,
        thread_us_per_step,
        over_thread: thread_us_per_step.map(|floor| cpu_us_per_step / floor),
        steps_per_s: observed.steps / observed.wall.as_secs_f64(),
        wanted_steps_per_s: stats.iter().map(|s| s.wanted_hz).sum(),
        age_ms_p50: 1e3 * quantile_over(&stats, 0.5, |s| s.age.p50_s),
        age_ms_p99: 1e3 * quantile_over(&stats, 0.99, |s| s.age.p99_s),
        late_ms_p50: 1e3 * quantile_over(&stats, 0.5, |s| s.late.p50_s),
        late_ms_p99: 1e3 * quantile_over(&stats, 0.99, |s| s.late.p99_s),
        dropped_ms: 1e3 * stats.iter().map(|s| s.dropped.as_secs_f64()).sum::<f64>() / stats.len().max(1) as f64,
        bytes_per_agent: before.zip(after).map(|(from, to)| (to - from).max(0.0) / case.agents as f64),
        switches_per_step: observed.switches_per_step,
        frame_late_ms_p99: 1e3 * share(observed.late_s, 0.99),
        read_ns_per_agent: 1e9 * share(observed.read_s, 0.5) / case.agents as f64,
        start_ms,
        shutdown_ms,
    })
}

/// Measurements of a run from outside.
struct ObservedRun {
    wall: Duration,
    cpu: Duration,
    steps: f64,
    switches_per_step: Option<f64>,
    late_s: Vec<f64>,
    read_s: Vec<f64>,
}

impl ObservedRun {
    fn per_step(&self, total: f64) -> f64 {
        if self.steps > 0.0 { total / self.steps } else { f64::NAN }
    }
}

/// Lets `run` go on for `span` and reads all states at 60 Hz; a run in virtual time is stepped by this thread itself.
fn observe(run: &mut dyn Run, is_virtual: bool, span: Duration) -> ObservedRun {
    let cpu = || if is_virtual { own_cpu() } else { others_cpu() };
    let mut reader = Reader::new(run.agents());
    read(run, &mut reader, is_virtual, span / 4);
    // warm-up: until every agent has made its first step, at most WARM_UP
    let began = Instant::now();
    while run.agents().iter().any(|agent| agent.steps() == 0) && began.elapsed() < WARM_UP {
        read(run, &mut reader, is_virtual, FRAME);
    }
    // reading the switches of a thousand threads takes seconds on a busy machine: they are divided by the steps between these readings
    let from_switched = (switches(), steps(run));
    let (from_cpu, from_steps, from) = (cpu(), steps(run), Instant::now());
    let (late_s, read_s) = read(run, &mut reader, is_virtual, span);
    let reading = if is_virtual { Duration::from_secs_f64(read_s.iter().sum()) } else { Duration::ZERO };
    reader.finish(run.agents());
    let (wall, cpu, made) = (from.elapsed(), (cpu() - from_cpu).saturating_sub(reading), steps(run) - from_steps);
    let switched = (switches(), steps(run));
    ObservedRun {
        wall,
        cpu,
        steps: made,
        switches_per_step: increase_per_step(from_switched, switched),
        late_s,
        read_s,
    }
}

/// Rise of a count per step from one moment to another; each is a count and the number of steps made by then.
fn increase_per_step(from: (Option<f64>, f64), to: (Option<f64>, f64)) -> Option<f64> {
    let count = to.0.zip(from.0).map(|(to, from)| (to - from).max(0.0))?;
    let steps = to.1 - from.1;
    Some(if steps > 0.0 { count / steps } else { f64::NAN })
}

/// Reads frame by frame; returns the lateness of each frame's start and the duration of its reading, seconds.
fn read(run: &mut dyn Run, reader: &mut Reader, is_virtual: bool, span: Duration) -> (Vec<f64>, Vec<f64>) {
    let (began, start) = (Instant::now(), run.now());
    let (mut late_s, mut read_s) = (Vec::new(), Vec::new());
    let mut frame = start;
    // virtual time does not follow the wall clock: it must not make the benchmark longer
    while began.elapsed() < span && (is_virtual || run.now() < start + span) {
        frame += FRAME;
        run.wait_until(frame);
        late_s.push(run.now().saturating_sub(frame).as_secs_f64());
        let from = Instant::now();
        reader.read(run.agents(), run.sim_now(), |_, _, _| ());
        read_s.push(from.elapsed().as_secs_f64());
        frame = frame.max(run.now().saturating_sub(FRAME));
    }
    (late_s, read_s)
}

fn steps(run: &dyn Run) -> f64 {
    run.agents().iter().map(|agent| agent.steps() as f64).sum()
}

/// The value that a share `part` of the agents does not exceed.
fn quantile_over(stats: &[AgentStats], part: f64, of: impl Fn(&AgentStats) -> f64) -> f64 {
    share(stats.iter().map(of).collect(), part)
}

fn share(mut numbers: Vec<f64>, part: f64) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    let at = (part * numbers.len() as f64).ceil() as usize;
    numbers.get(at.saturating_sub(1)).copied().unwrap_or(0.0)
}

fn millis(span: Duration) -> f64 {
    span.as_secs_f64() * 1e3
}
