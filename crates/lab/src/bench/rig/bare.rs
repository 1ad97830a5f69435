//! The same steps without agents around them: a lower bound for the cost of a step.
//!
//! In: a model, a number, a rate. Out: CPU time per step, of a loop that never sleeps, of a loop that sleeps to the
//! same due times as the agents do, and of as many threads that each do. Never here: the runtime.

use super::cast::{Model, agent, rate_hz};
use super::machine::own_cpu;
use anyhow::Context;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, StepContext};
use metachron_core::{AgentId, SimSpan, SimTime};
use metachron_runtime::THREADS_MAX;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::thread;
use std::time::{Duration, Instant};

/// CPU time of bare steps, microseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bare {
    /// Step after step.
    pub free_us: f64,
    /// With a sleep wherever nothing is due.
    pub paced_us: f64,
}

/// Measures both loops over `count` agents, each for `span`.
pub(crate) fn measure(model: Model, count: usize, mean_hz: f64, span: Duration) -> anyhow::Result<Bare> {
    let mut agents = (0..count).map(|k| agent(model, k)).collect::<Result<Vec<_>, _>>()?;
    let spans: Vec<_> = (0..count).map(|k| period(k, mean_hz)).collect();
    // one round to fill caches and size buffers
    let mut stepper = LoneStepper::default();
    for (agent, dt) in agents.iter_mut().zip(&spans) {
        step(&mut **agent, &mut stepper, *dt)?;
    }
    Ok(Bare { free_us: free(&mut agents, &spans, span)?, paced_us: run_paced(&mut agents, &spans, span)? })
}

fn free(agents: &mut [Box<dyn Agent>], spans: &[SimSpan], span: Duration) -> anyhow::Result<f64> {
    let mut stepper = LoneStepper::default();
    let (cpu, mut steps) = (own_cpu(), 0_u64);
    while own_cpu() - cpu < span {
        for (agent, dt) in agents.iter_mut().zip(spans) {
            step(&mut **agent, &mut stepper, *dt)?;
        }
        steps += agents.len() as u64;
    }
    Ok(micros(own_cpu() - cpu) / steps as f64)
}

fn run_paced(agents: &mut [Box<dyn Agent>], spans: &[SimSpan], span: Duration) -> anyhow::Result<f64> {
    let mut due: BinaryHeap<_> = (0..agents.len()).map(|k| Reverse((Duration::ZERO, k))).collect();
    let mut stepper = LoneStepper::default();
    let (cpu, start, mut steps) = (own_cpu(), Instant::now(), 0_u64);
    let mut now = start.elapsed();
    while now < span {
        let Some(Reverse((at, k))) = due.pop() else { break };
        if at > now {
            thread::sleep(at - now);
        }
        step(&mut *agents[k], &mut stepper, spans[k])?;
        steps += 1;
        due.push(Reverse((at + Duration::from_nanos(spans[k].as_nanos()), k)));
        now = start.elapsed();
    }
    Ok(micros(own_cpu() - cpu) / steps.max(1) as f64)
}

/// CPU time per step, microseconds, of one thread per agent, at most [`THREADS_MAX`]: each sleeps to the due times of one agent
/// and makes its bare steps, nothing else. The thread switches of these are a lower bound for agents on threads of their own.
pub(crate) fn on_threads(model: Model, count: usize, mean_hz: f64, span: Duration) -> anyhow::Result<f64> {
    let agents = (0..count.min(THREADS_MAX)).map(|k| agent(model, k)).collect::<Result<Vec<_>, _>>()?;
    let start = Instant::now();
    let spent = thread::scope(|scope| {
        let lives = agents.into_iter().enumerate().map(|(k, mut agent)| {
            let life = move || run_alone(&mut *agent, period(k, mean_hz), start, span);
            thread::Builder::new().name(format!("bare:{k}")).spawn_scoped(scope, life)
        });
        let lives = lives.collect::<Result<Vec<_>, _>>().context("no thread could be started")?;
        let ended = lives.into_iter().map(|life| life.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        ended.collect::<anyhow::Result<Vec<_>>>()
    })?;
    let (cpu, steps) = spent.iter().fold((Duration::ZERO, 0), |(cpu, steps), one| (cpu + one.0, steps + one.1));
    Ok(micros(cpu) / steps.max(1) as f64)
}

/// Steps one agent at its due times until `span` after `start`; returns the CPU time of this thread and the number of steps.
fn run_alone(agent: &mut dyn Agent, dt: SimSpan, start: Instant, span: Duration) -> anyhow::Result<(Duration, u64)> {
    let mut stepper = LoneStepper::default();
    step(agent, &mut stepper, dt)?;
    let (cpu, mut due, mut steps) = (own_cpu(), start.elapsed(), 0);
    while start.elapsed() < span {
        thread::sleep(due.saturating_sub(start.elapsed()));
        step(agent, &mut stepper, dt)?;
        steps += 1;
        due += Duration::from_nanos(dt.as_nanos());
    }
    Ok((own_cpu() - cpu, steps))
}

/// One step of an agent without neighbours.
pub(crate) fn step(agent: &mut dyn Agent, stepper: &mut LoneStepper, dt: SimSpan) -> anyhow::Result<()> {
    stepper.step(agent, dt, StepContext::alone(AgentId(0), SimTime::ZERO))?;
    Ok(())
}

fn period(k: usize, mean_hz: f64) -> SimSpan {
    SimSpan::from_secs_f64(1.0 / rate_hz(k, mean_hz)).unwrap_or(SimSpan::ZERO)
}

fn micros(span: Duration) -> f64 {
    span.as_secs_f64() * 1e6
}
