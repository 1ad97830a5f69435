//! A haptic device beside a world: a thread of its own, at 1 kHz, leads a stylus into soft tissue and gives back its
//! contact force.
//!
//! `cargo run --no-default-features --features devices --example haptic_loop`; the device is simulated: a handle in a hand, at the end of a link.
//! A device of your own implements `Device`: a pose in, a wrench out.

use metachron::devices::{DeviceLoop, Hand, HandPath, Link, LoopOptions, Served, SimulatedDevice};
use metachron::models::soft::Side;
use metachron::models::tool::Keyframe;
use metachron::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tissue = Soft::cuboid([0.12, 0.12, 0.05], [6, 6, 3]).at([0.0, 0.0, 0.025]).young_pa(1e4).damping(2.0, 0.002);
    let tissue = tissue.hold(&[Side::Bottom]).rate_hz(500.0);
    let stylus = Rigid::ball(0.01).kinematic().at([0.0, 0.0, 0.08]).rate_hz(1000.0);
    let scene = Scene::builder().add("tissue", tissue).add("stylus", stylus);
    let world = World::start(&scene.build()?, ExecutorKind::Threads)?;
    // the hand goes down and up once a second, 2 cm into the tissue
    let keys = [(0.0, 0.08), (0.5, 0.04), (1.0, 0.08)];
    let keys = keys.map(|(at_s, z)| Keyframe { at_s, tip_m: DVec3::Z * z, rotation: DQuat::IDENTITY, jaw: 1.0 });
    let path = HandPath::along(&keys, true).ok_or("a path has keyframes")?;
    let device = SimulatedDevice::new(Hand::default(), path, Link { delay_s: 0.002, ..Link::default() }, 10.0);
    let served = Served::start(DeviceLoop::new(&world, "stylus", Box::new(device), LoopOptions::default())?)?;
    world.advance(SimSpan::from_millis(2000));
    println!("{:#?}", served.stop());
    Ok(())
}
