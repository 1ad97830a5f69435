//! A haptic device beside a world: a thread of its own, at 1 kHz, leads a stylus into soft tissue and gets back what that gives it.
//!
//! `cargo run --no-default-features --example haptic_loop`; the device is simulated: a handle in a hand, and the delay of its link.

use metachron::models::soft::Side;
use metachron::prelude::*;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

const PERIOD_S: f64 = 1e-3;
const TICKS: u64 = 2000;
const DELAY_TICKS: usize = 2;
/// The handle, and the hand that leads it.
const MASS_KG: f64 = 0.1;
const STIFFNESS_N_M: f64 = 150.0;
const DAMPING_N_S_M: f64 = 6.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tissue = Soft::cuboid([0.12, 0.12, 0.05], [6, 6, 3]).at([0.0, 0.0, 0.025]).young_pa(1e4).damping(2.0, 0.002);
    let tissue = tissue.hold(&[Side::Bottom]).rate_hz(500.0);
    let stylus = Rigid::ball(0.01).kinematic().at([0.0, 0.0, 0.08]).rate_hz(1000.0);
    let scene = Scene::builder().add("tissue", tissue).add("stylus", stylus);
    let world = World::start(&scene.build()?, ExecutorKind::Threads)?;
    std::thread::scope(|scope| {
        let device = scope.spawn(|| run_device(&world));
        world.advance(SimSpan::from_millis(TICKS));
        device.join().map_err(|_| "the device's thread panicked")?.map_err(Into::into)
    })
}

/// Leads the stylus and feels what it touches.
fn run_device(world: &World) -> Result<(), WorldError> {
    let stylus = world.object("stylus")?;
    let (mut height_m, mut speed_m_s, mut most_n) = (0.08, 0.0, 0.0_f64);
    let (mut link, mut late_us, mut age_ms) = (VecDeque::from([0.0; DELAY_TICKS]), Vec::new(), Vec::new());
    let begun = Instant::now();
    for due in (0..TICKS).map(|tick| begun + Duration::from_millis(tick)) {
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        late_us.push(due.elapsed().as_secs_f64() * 1e6);
        let state = world.latest(stylus)?;
        age_ms.push(world.time().secs_after(state.time) * 1e3);
        link.push_back(state.contact_wrench.force_n.z);
        let felt_n = link.pop_front().unwrap_or(0.0);
        most_n = felt_n.max(most_n);
        // the hand goes down and up once a second, 2 cm into the tissue
        let phase = std::f64::consts::TAU * (due - begun).as_secs_f64();
        let pull_n = STIFFNESS_N_M * (0.06 + 0.02 * phase.cos() - height_m) - DAMPING_N_S_M * speed_m_s;
        speed_m_s += (pull_n + felt_n) / MASS_KG * PERIOD_S;
        height_m += speed_m_s * PERIOD_S;
        let pose = Command::pose(DVec3::Z * height_m, DQuat::IDENTITY).moving(DVec3::Z * speed_m_s, DVec3::ZERO);
        world.command(stylus, pose.for_ms(20))?;
    }
    for (what, mut values) in [("late by µs", late_us), ("age of the force, ms", age_ms)] {
        values.sort_by(f64::total_cmp);
        let [half, most, worst] = [0.5, 0.99, 1.0].map(|share| values[((values.len() - 1) as f64 * share) as usize]);
        println!("{what}: {half:.2} at half of the ticks, {most:.2} at 99 %, {worst:.2} at worst");
    }
    println!("the tissue gave {most_n:.2} N at most");
    Ok(())
}
