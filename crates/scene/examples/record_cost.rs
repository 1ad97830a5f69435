//! The cost of a recording of a scene in real time for its agents: `record_cost SCENE.toml [threads|pool [SECONDS
//! [PAIRS]]]`, built for release.
//!
//! Out: of pairs of runs with and without one the CPU time of a step in the mean of all, and its ratio; the size of a minute. Never here: a limit.

use metachron_core::SimSpan;
use metachron_scene::{Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};
use std::error::Error;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Counts the bytes that are written.
#[derive(Clone, Default)]
struct Counted(Arc<AtomicUsize>);

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.fetch_add(bytes.len(), Relaxed);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let file = args.next().ok_or("usage: record_cost SCENE.toml [threads|pool [SECONDS [PAIRS]]]")?;
    let executor = match args.next().as_deref() {
        Some("pool") => ExecutorKind::Pool,
        _ => ExecutorKind::Threads,
    };
    let seconds: f64 = args.next().map_or(Ok(10.0), |text| text.parse())?;
    let pairs: u32 = args.next().map_or(Ok(6), |text| text.parse())?;
    let scene = load(&Source::open(&file)?, &[])?;
    let mut ratios = Vec::new();
    for pair in 0..pairs {
        // each goes first in turn
        let order = [pair % 2 == 0, pair % 2 != 0];
        let [first, second] = order.map(|recorded| run(&scene, executor, seconds, recorded));
        let (first, second) = (first?, second?);
        let (with, without) = if order[0] { (first, second) } else { (second, first) };
        let (ratio, minute) = (with.step_s / without.step_s, with.bytes as f64 * 60.0 / seconds);
        println!(
            "{:.2} µs a step recorded, {:.2} µs not: {ratio:.4}; {:.0} and {:.0} steps; {:.2} MB a minute",
            with.step_s * 1e6,
            without.step_s * 1e6,
            with.steps,
            without.steps,
            minute * 1e-6
        );
        ratios.push(ratio);
    }
    ratios.sort_by(f64::total_cmp);
    println!("median {:.4}", ratios[ratios.len() / 2]);
    Ok(())
}

/// The cost of a run.
struct Cost {
    /// CPU time of a step in the mean of all.
    step_s: f64,
    steps: f64,
    bytes: usize,
}

fn run(scene: &Scene, executor: ExecutorKind, seconds: f64, recorded: bool) -> Result<Cost, Box<dyn Error>> {
    let world = World::start(scene, executor)?;
    let bytes = Counted::default();
    if recorded {
        world.record_to(Box::new(bytes.clone()), None)?;
    }
    world.advance(SimSpan::from_secs_f64(seconds).ok_or("the time must be at least 0 s")?);
    let stats = world.stop();
    let (cpu_s, steps) =
        stats.iter().fold((0.0, 0.0), |(cpu_s, steps), agent| (cpu_s + agent.cpu_s, steps + agent.steps as f64));
    Ok(Cost { step_s: cpu_s / steps, steps, bytes: bytes.0.load(Relaxed) })
}
