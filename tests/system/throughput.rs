//! Promises of a pool of workers for thousands of agents: counts and ratios, whatever the machine does meanwhile.

use metachron_core::{N_MAX, Resolution, ResolutionRange, SimSpan};
use metachron_models::synthetic::{Synthetic, SyntheticSpec};
use metachron_runtime::{AgentSpawn, AgentState, Command, Pool, Priority, Run, SystemClock, TimelineCommand};
use std::sync::Arc;
use std::time::Duration;

/// An agent that nominally takes `cost_us` a step.
fn agent(cost_us: f64, rate_hz: f64) -> AgentSpawn {
    let spec = SyntheticSpec { cost_us, cost_order: 1.0, error_m: 1e-3, error_order: 1.0 };
    let range = ResolutionRange { eps_m: (0.01, 0.01), n: (0, N_MAX) };
    let agent = Synthetic::new(spec, range, Resolution { eps_m: 0.01, n: 1 }).unwrap();
    AgentSpawn { range: Some(range), ..AgentSpawn::alone(format!("{rate_hz} Hz"), Box::new(agent), rate_hz) }
}

fn pool(spawns: Vec<AgentSpawn>) -> Box<Pool> {
    let mut pool = Pool::start(spawns, Arc::new(SystemClock::new()), Priority::Normal).unwrap();
    pool.drive(TimelineCommand::Run);
    Box::new(pool)
}

/// Goes on until everybody has made so many steps, a frame at a time; a minute only ends a test that hangs.
fn play_until(run: &mut dyn Run, steps: u64) {
    let end = run.now() + Duration::from_secs(60);
    while run.agents().iter().any(|agent| agent.steps() < steps) {
        assert!(run.now() < end, "somebody starves");
        run.wait_until(run.now() + Duration::from_millis(16));
    }
}

#[test]
fn ten_thousand_agents_make_the_turns_of_their_rates_and_every_nanosecond_is_accounted_for() {
    let rates = [2.0, 3.0, 5.0, 7.0];
    let mut run = pool((0..10_000).map(|k| agent(0.5, rates[k % 4])).collect());
    play_until(&mut *run, 4);
    let kept = run.agents().to_vec();
    for (agent, stats) in kept.iter().zip(run.shutdown()) {
        assert_eq!(stats.state, AgentState::Running);
        let lived = stats.steps * stats.dt.as_nanos() + stats.dropped.as_nanos();
        assert_eq!(agent.latest().time.as_nanos(), lived, "{}", stats.name);
        assert_eq!(agent.latest().steps, stats.steps, "the last state is seen");
    }
}

#[test]
fn under_overload_everybody_falls_to_the_same_share_of_its_rate() {
    // for each worker 3.5 cores' worth of work
    let rates = [1000.0, 2000.0, 4000.0];
    let count = 30 * std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut run = pool((0..count).map(|k| agent(50.0, rates[k % 3])).collect());
    // the first agents are served while the last are not yet there
    play_until(&mut *run, 20);
    let before: Vec<_> = run.agents().iter().map(|agent| agent.steps()).collect();
    play_until(&mut *run, 1520);
    let made: Vec<_> = run.agents().iter().zip(before).map(|(agent, before)| (agent.steps() - before) as f64).collect();
    let share = |k: usize| made[k] / rates[k % 3];
    let mean = (0..count).map(share).sum::<f64>() / count as f64;
    for k in 0..count {
        // queues are evened out to 5 ms of served time, of 1500, a little later: a worker may have no core for a tenth of a second
        assert!((share(k) / mean - 1.0).abs() < 0.25, "agent {k} has {:.3} of the mean share", share(k) / mean);
    }
    assert!(run.shutdown().iter().all(|stats| stats.dropped > SimSpan::ZERO));
}

#[test]
fn a_hundred_thousand_agents_start_and_a_pause_stops_them_all() {
    let mut run = pool((0..100_000).map(|_| agent(0.5, 1.0)).collect());
    run.drive(TimelineCommand::Pause);
    // agents that were due at the start have made their turns
    let due = |run: &dyn Run| run.agents().iter().filter(|agent| agent.latest().time <= run.sim_now()).count();
    let end = run.now() + Duration::from_secs(60);
    while due(&*run) > 0 {
        assert!(run.now() < end, "{} have not begun", due(&*run));
        run.wait_until(run.now() + Duration::from_millis(16));
    }
    let steps = |run: &dyn Run| run.agents().iter().map(|agent| agent.steps()).sum::<u64>();
    let before = steps(&*run);
    run.wait_until(run.now() + Duration::from_millis(100));
    assert_eq!(steps(&*run), before);
    run.agents()[99_999].send(Command::wake()).unwrap();
    assert!(run.shutdown().iter().all(|stats| stats.steps >= 1));
}
