//! Objects join a world and leave it at random, on each executor in turn, for as long as it is let: quantities that
//! must stay do stay.
//!
//! `cargo run --release --no-default-features --example soak -- --minutes 10`, or `--quick` for a minute of it. While
//! nothing joins or leaves, momentum stays as it is; memory grows by no more than a stated bound for each; no call
//! waits long. It ends with an error where one of these does not hold.
//! Bodies float in a space without gravity towards its middle, where they meet.

use metachron::prelude::*;
use metachron::runtime::AgentState;
use std::error::Error;
use std::time::{Duration, Instant};

/// Joins and leavings in ten minutes: a hundred thousand, on the three executors together.
const CHANGES_PER_MINUTE: u64 = 10_000;
/// Objects that are in the world at once.
const CROWD: usize = 24;
/// The most by which the resident memory of the process may grow for each change after the first third, KiB: half of the 450 bytes that a number costs
/// whose object has left, and the memory that the system's allocator has not given back yet.
const GROWTH_MAX_KIB: f64 = 1.0;
/// The longest that a call which changes the world may take.
const WAIT_MAX: Duration = Duration::from_secs(1);
/// The share of their momentum by which the momentum of all may change: rounding, and the residual of solves.
const MOMENTUM_MAX: f64 = 1e-6;
/// Momentum is looked at once in so many changes.
const CHECKED: u64 = 50;
/// Half a rigid body's size, metres, and its mass.
const RADIUS_M: f64 = 0.05;
const MASS_KG: f64 = 0.5;
/// The numbers of the random choices.
const SEED: u64 = 0x5eed;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let minutes = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] | ["--quick"] => 1.0,
        ["--minutes", minutes] => minutes.parse::<f64>()?,
        _ => return Err("expected --quick, or --minutes and a number".into()),
    };
    if !(minutes > 0.0 && minutes < 1e4) {
        return Err(format!("--minutes is {minutes}; expected a number above 0 and below 10000").into());
    }
    let each = Duration::from_secs_f64(minutes * 20.0);
    let changes = (minutes * CHANGES_PER_MINUTE as f64 / 3.0).ceil() as u64;
    println!("executor   changes  simulated s  wall s  memory MiB  growth KiB  longest wait ms  momentum off   parked");
    let mut failures = Vec::new();
    for executor in [ExecutorKind::Lockstep, ExecutorKind::Pool, ExecutorKind::Threads] {
        let row = soak(executor, changes, each)?;
        println!(
            "{:<9} {:>8} {:>12.1} {:>7.1} {:>11.1} {:>11.1} {:>16.2} {:>13.1e} {:>8}",
            format!("{executor:?}").to_lowercase(),
            row.changes,
            row.sim_s,
            row.wall_s,
            row.memory_mib,
            row.growth_kib,
            row.longest.as_secs_f64() * 1e3,
            row.momentum_off,
            row.parked
        );
        failures.extend(row.failures().into_iter().map(|why| format!("{executor:?}: {why}")));
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("; ").into()) }
}

/// The results of one executor.
struct Row {
    changes: u64,
    sim_s: f64,
    wall_s: f64,
    memory_mib: f64,
    growth_kib: f64,
    longest: Duration,
    momentum_off: f64,
    parked: usize,
}

impl Row {
    fn failures(&self) -> Vec<String> {
        let mut all = Vec::new();
        if self.growth_kib > GROWTH_MAX_KIB {
            all.push(format!("memory grew by {:.1} KiB a change; {GROWTH_MAX_KIB} are allowed", self.growth_kib));
        }
        if self.longest > WAIT_MAX {
            all.push(format!("a call took {:?}; {WAIT_MAX:?} are allowed", self.longest));
        }
        if self.momentum_off > MOMENTUM_MAX {
            all.push(format!("momentum is off by {:e}; {MOMENTUM_MAX:e} is allowed", self.momentum_off));
        }
        if self.parked > 0 {
            all.push(format!("{} objects failed", self.parked));
        }
        all
    }
}

/// Lets objects join and leave `changes` times, or for as long as `most`.
fn soak(executor: ExecutorKind, changes: u64, most: Duration) -> Result<Row, Box<dyn Error>> {
    let scene = Scene::builder().gravity([0.0; 3]).add("first", Rigid::ball(RADIUS_M).mass_kg(MASS_KG));
    let world = World::start(&scene.build()?, executor)?;
    let mut crowd = vec![Joined { object: world.object("first")?, is_rigid: true }];
    let (mut random, begun) = (Random(SEED), Instant::now());
    let (mut made, mut longest, mut settled_mib, mut momentum_off) = (0, Duration::ZERO, None, 0.0_f64);
    while made < changes && begun.elapsed() < most {
        let before = Instant::now();
        if crowd.len() < 2 || crowd.len() < CROWD && random.share() < 0.55 {
            crowd.push(join(&world, made, &mut random)?);
        } else {
            let at = (random.share() * crowd.len() as f64) as usize;
            world.remove(crowd.swap_remove(at).object)?;
        }
        longest = longest.max(before.elapsed());
        made += 1;
        world.advance(SimSpan::from_millis(2));
        if made % CHECKED == 0 {
            momentum_off = momentum_off.max(momentum_change(&world, &crowd)?);
        }
        if settled_mib.is_none() && (made * 3 > changes || begun.elapsed() * 3 > most) {
            settled_mib = Some((memory_mib(), made));
        }
    }
    let (sim_s, memory_mib) = (world.time().as_secs_f64(), memory_mib());
    let parked = world.stop().iter().filter(|agent| matches!(agent.state, AgentState::Parked(_))).count();
    let (settled_mib, then) = settled_mib.unwrap_or((memory_mib, 0));
    let growth_kib = (memory_mib - settled_mib) * 1024.0 / (made - then).max(1) as f64;
    let wall_s = begun.elapsed().as_secs_f64();
    Ok(Row { changes: made, sim_s, wall_s, memory_mib, growth_kib, longest, momentum_off, parked })
}

/// An object that has joined.
struct Joined {
    object: Object,
    is_rigid: bool,
}

/// Lets a ball, a box or a jelly join, on its way to the middle of its kind: balls and boxes meet each other, and jellies each other.
fn join(world: &World, number: u64, random: &mut Random) -> Result<Joined, WorldError> {
    let is_rigid = random.share() < 0.75;
    let from = DVec3::from_array([0, 1, 2].map(|_| random.share() - 0.5));
    let (at, velocity) =
        ((from * 0.6 + if is_rigid { DVec3::ZERO } else { DVec3::X * 100.0 }).to_array(), (from * -0.5).to_array());
    let name = format!("{number}");
    let object = if !is_rigid {
        world.add(name, Soft::cuboid([0.08; 3], [1, 1, 1]).at(at).velocity_m_s(velocity).young_pa(1e4))?
    } else if random.share() < 0.5 {
        world.add(name, Rigid::ball(RADIUS_M).mass_kg(MASS_KG).at(at).velocity_m_s(velocity))?
    } else {
        world.add(name, Rigid::cuboid([2.0 * RADIUS_M; 3]).mass_kg(MASS_KG).at(at).velocity_m_s(velocity))?
    };
    Ok(Joined { object, is_rigid })
}

/// By which share of the momentum that they carry the sum of that of the rigid bodies changes while nothing joins or leaves.
fn momentum_change(world: &World, crowd: &[Joined]) -> Result<f64, WorldError> {
    let sums = || -> Result<(DVec3, f64), WorldError> {
        let (mut sum, mut carried) = (DVec3::ZERO, 0.0);
        for joined in crowd.iter().filter(|joined| joined.is_rigid) {
            if let Body::Rigid(body) = &world.latest(joined.object)?.body {
                sum += body.velocity * MASS_KG;
                carried += body.velocity.length() * MASS_KG;
            }
        }
        Ok((sum, carried))
    };
    // objects that left are gone, and objects that joined have begun
    world.advance(SimSpan::from_millis(20));
    let (before, carried) = sums()?;
    world.advance(SimSpan::from_millis(50));
    Ok((sums()?.0 - before).length() / carried.max(MASS_KG * 0.01))
}

/// The resident memory of this process, MiB; 0 where the system does not say.
fn memory_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok()).unwrap_or_default() / 1024.0
}

/// Random numbers by a seed (SplitMix64).
struct Random(u64);

impl Random {
    /// The next one, 0 … 1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
