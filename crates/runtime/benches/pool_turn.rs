//! Cost of a turn in a pool whose agents are always due, against their number. Wall time, all workers busy.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use metachron_core::{N_MAX, Resolution, ResolutionRange};
use metachron_models::synthetic::{Synthetic, SyntheticSpec};
use metachron_runtime::{AgentSpawn, Pool, Priority, Run, SystemClock, TimelineCommand};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Far above what any machine can do: no agent ever waits.
const UNPACED_HZ: f64 = 1e5;

/// An agent whose step is next to nothing.
fn agent(k: usize) -> AgentSpawn {
    let spec = SyntheticSpec { cost_us: 0.01, cost_order: 1.0, error_m: 1e-3, error_order: 1.0 };
    let range = ResolutionRange { eps_m: (0.01, 0.01), n: (0, N_MAX) };
    let agent = Synthetic::new(spec, range, Resolution { eps_m: 0.01, n: 1 }).expect("the agent is sound");
    AgentSpawn::alone(format!("agent {k}"), Box::new(agent), UNPACED_HZ)
}

fn steps(run: &dyn Run) -> u64 {
    run.agents().iter().map(|agent| agent.steps()).sum()
}

/// How long `turns` turns take.
fn time(run: &dyn Run, turns: u64) -> Duration {
    let (start, from) = (Instant::now(), steps(run));
    loop {
        std::thread::sleep(Duration::from_millis(1));
        let made = steps(run) - from;
        if made >= turns {
            // more were made than asked for
            return start.elapsed().mul_f64(turns as f64 / made as f64);
        }
    }
}

fn make_turns(c: &mut Criterion) {
    let mut group = c.benchmark_group("runtime/pool_turn");
    for agents in [100_usize, 1000, 10_000] {
        let spawns = (0..agents).map(agent).collect();
        let mut run = Pool::start(spawns, Arc::new(SystemClock::new()), Priority::Normal).expect("the pool starts");
        run.drive(TimelineCommand::Run);
        group.throughput(Throughput::Elements(1));
        group.bench_function(BenchmarkId::from_parameter(agents), |b| b.iter_custom(|turns| time(&run, turns)));
        Box::new(run).shutdown();
    }
    group.finish();
}

criterion_group!(benches, make_turns);
criterion_main!(benches);
