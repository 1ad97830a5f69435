//! Costs of calls: a read of a state, an object that joins a thousand others, events with and without a reader.
//!
//! `cargo run --release -p metachron-world --example call_cost`. Times are of the wall clock: nothing else should run meanwhile.

use glam::DVec3;
use metachron_core::SimSpan;
use metachron_geometry::Solid;
use metachron_runtime::TimelineCommand;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{EventFilter, Object, Rigid, Scene, World, WorldError};
use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};

const READS: u32 = 5_000_000;
const AGENTS: u32 = 1000;
const JOINS: u32 = 100;
/// Between two joins.
const APART: Duration = Duration::from_millis(20);
/// Balls that bounce, and for how long.
const BALLS: u32 = 200;
const BOUNCES_MS: u64 = 4000;
const REPEATS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    for executor in [ExecutorKind::Lockstep, ExecutorKind::Threads] {
        let Reads { still_ns, stepping_ns } = read(executor)?;
        println!("read, {executor:?}: {still_ns:.1} ns while nothing steps, {stepping_ns:.1} ns while it steps");
    }
    for rate_hz in [30.0, 60.0] {
        let Joins { median, most, before, during } = join(rate_hz)?;
        println!(
            "add, {AGENTS} agents at {rate_hz} Hz in a pool: median {:.3} ms, most {:.3} ms; steps missed a second {before:.1} before, \
             {during:.1} while {JOINS} joined",
            1e3 * median.as_secs_f64(),
            1e3 * most.as_secs_f64()
        );
    }
    let mut times: [Vec<f64>; 2] = Default::default();
    let mut received = 0;
    for _ in 0..REPEATS {
        for (times, listens) in times.iter_mut().zip([false, true]) {
            let bounced = bounce(listens)?;
            times.push(1e3 * bounced.taken.as_secs_f64());
            received = received.max(bounced.events);
        }
    }
    let [without, with] = times.map(|times| times.into_iter().fold(f64::INFINITY, f64::min));
    println!(
        "events, {BALLS} balls: {without:.1} ms without a reader, {with:.1} ms with one, which received {received}"
    );
    Ok(())
}

/// Nanoseconds of a read of the newest state, while time stands and while it passes.
struct Reads {
    still_ns: f64,
    stepping_ns: f64,
}

fn read(executor: ExecutorKind) -> Result<Reads, Box<dyn Error>> {
    let scene = Scene::builder().gravity([0.0; 3]).add("ball", Rigid::ball(0.05).rate_hz(1000.0)).build()?;
    let world = World::start(&scene, executor)?;
    let ball = world.object("ball")?;
    let still_ns = reads_ns(&world, ball)?;
    if executor == ExecutorKind::Lockstep {
        // another thread lets its time pass
        let other = world.clone();
        let passing = std::thread::spawn(move || other.advance(SimSpan::from_millis(200_000)));
        let stepping_ns = reads_ns(&world, ball)?;
        world.stop();
        passing.join().map_err(|_| "the thread that lets time pass has failed")?;
        return Ok(Reads { still_ns, stepping_ns });
    }
    world.drive(TimelineCommand::Run);
    let stepping_ns = reads_ns(&world, ball)?;
    world.stop();
    Ok(Reads { still_ns, stepping_ns })
}

fn reads_ns(world: &World, ball: Object) -> Result<f64, WorldError> {
    let begun = Instant::now();
    for _ in 0..READS {
        black_box(world.latest(black_box(ball))?);
    }
    Ok(1e9 * begun.elapsed().as_secs_f64() / f64::from(READS))
}

/// Times to join, and the steps that were missed a second.
struct Joins {
    median: Duration,
    most: Duration,
    before: f64,
    during: f64,
}

/// Balls that float apart from each other, and others that join them.
fn join(rate_hz: f64) -> Result<Joins, Box<dyn Error>> {
    let ball = |k: u32| {
        let at = DVec3::new(f64::from(k % 40), f64::from(k / 40), 0.0);
        Rigid::ball(0.05).at(at.to_array()).velocity_m_s([0.0, 0.0, 0.01]).rate_hz(rate_hz)
    };
    let scene = (0..AGENTS).fold(Scene::builder().gravity([0.0; 3]), |scene, k| scene.add(format!("{k}"), ball(k)));
    let world = World::start(&scene.build()?, ExecutorKind::Pool)?;
    world.drive(TimelineCommand::Run);
    // until rates have settled
    std::thread::sleep(Duration::from_secs(2));
    let span = APART * JOINS;
    let start = misses(&world);
    std::thread::sleep(span);
    let before = misses(&world) - start;
    let (begun, start) = (Instant::now(), misses(&world));
    let mut taken = Vec::new();
    for k in 0..JOINS {
        let part = ball(AGENTS + k);
        let called = Instant::now();
        world.add(format!("{}", AGENTS + k), part)?;
        taken.push(called.elapsed());
        std::thread::sleep((APART * (k + 1)).saturating_sub(begun.elapsed()));
    }
    let during = misses(&world) - start;
    let seconds = span.as_secs_f64();
    world.stop();
    taken.sort_unstable();
    let (median, most) = (taken[taken.len() / 2], taken[taken.len() - 1]);
    Ok(Joins { median, most, before: before as f64 / seconds, during: during as f64 / seconds })
}

fn misses(world: &World) -> u64 {
    world.agents().iter().map(|agent| agent.stats().misses).sum()
}

/// How long bouncing balls take in lockstep, and how many events a reader received.
struct Bounced {
    taken: Duration,
    events: u64,
}

fn bounce(listens: bool) -> Result<Bounced, Box<dyn Error>> {
    let floor = Scene::builder().fixed("floor", Solid::Plane);
    let scene = (0..BALLS).fold(floor, |scene, k| {
        let at = [0.3 * f64::from(k % 20), 0.3 * f64::from(k / 20), 0.2 + 0.01 * f64::from(k % 7)];
        scene.add(format!("{k}"), Rigid::ball(0.05).restitution(0.8).at(at))
    });
    let world = World::start(&scene.build()?, ExecutorKind::Lockstep)?;
    let mut events = listens.then(|| world.events(EventFilter::all()));
    let mut received = 0;
    let begun = Instant::now();
    for _ in 0..BOUNCES_MS / 20 {
        world.advance(SimSpan::from_millis(20));
        received += events.as_mut().map_or(0, |events| events.drain().count() as u64);
    }
    Ok(Bounced { taken: begun.elapsed(), events: received })
}
