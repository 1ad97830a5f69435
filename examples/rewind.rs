//! A world goes back and tries again: which throw knocks a tower down with the least speed?
//!
//! `cargo run --no-default-features --example rewind`

use metachron::prelude::*;
use std::error::Error;

const STOREYS: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let ball = Rigid::ball(0.05).mass_kg(0.4).at([-0.6, 0.0, 0.3]);
    let mut scene = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball);
    for storey in 0..STOREYS {
        let height_m = 0.1 + 0.2 * storey as f64;
        scene = scene.add(format!("block {storey}"), Rigid::cuboid([0.1; 3]).mass_kg(1.0).at([0.0, 0.0, height_m]));
    }
    let world = World::start(&scene.build()?, ExecutorKind::Lockstep)?;
    let mark = world.checkpoint()?;
    println!("{} bytes to go back to", mark.size_bytes());

    // bisection: each try begins from the same bits
    let (mut stands_m_s, mut falls_m_s) = (0.5, 16.0);
    while falls_m_s - stands_m_s > 0.25 {
        let speed_m_s = 0.5 * (stands_m_s + falls_m_s);
        world.restore(&mark)?;
        let height_m = throw(&world, speed_m_s)?;
        let falls = height_m < 0.2 * STOREYS as f64 - 0.15;
        println!("{speed_m_s:.2} m/s: the top ends {height_m:.3} m high");
        *(if falls { &mut falls_m_s } else { &mut stands_m_s }) = speed_m_s;
    }

    let again = || -> Result<u64, Box<dyn Error>> {
        world.restore(&mark)?;
        throw(&world, falls_m_s)?;
        Ok(world.hash())
    };
    let (first, second) = (again()?, again()?);
    println!("{falls_m_s:.2} m/s, twice: state hash {first:016x} and {second:016x}");
    if first == second { Ok(()) } else { Err("two runs from one checkpoint differ".into()) }
}

/// Throws the ball; how high the uppermost block is two seconds later, metres.
fn throw(world: &World, speed_m_s: f64) -> Result<f64, WorldError> {
    let [ball, top] = world.objects(["ball", &format!("block {}", STOREYS - 1)])?;
    world.command(ball, Command::velocity(DVec3::new(speed_m_s, 0.0, 2.0), DVec3::ZERO))?;
    world.advance(SimSpan::from_millis(2000));
    Ok(world.frame().point(top, Anchor::Local(DVec3::ZERO))?.z)
}
