//! Objects join a world that runs and leave it: a fountain of balls of which never more than ten are there.
//!
//! `cargo run --no-default-features --example add_and_remove`

use metachron::prelude::*;
use std::collections::VecDeque;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::builder().fixed("floor", Solid::Plane).build()?;
    let world = World::start(&scene, ExecutorKind::Pool)?;
    let mut there = VecDeque::new();
    for number in 0..40 {
        let turn = f64::from(number) * 0.7;
        let ball = Rigid::ball(0.04)
            .mass_kg(0.1)
            .at([0.0, 0.0, 0.1])
            .velocity_m_s([0.6 * turn.cos(), 0.6 * turn.sin(), 3.0])
            .restitution(0.6);
        there.push_back(world.add(format!("ball {number}"), ball)?);
        if there.len() > 10
            && let Some(oldest) = there.pop_front()
        {
            world.remove(oldest)?;
        }
        world.advance(SimSpan::from_millis(50));
    }
    for ball in there {
        let place = world.frame().point(ball, Anchor::Local(DVec3::ZERO))?;
        println!("{:?} at {place:.2} m", ball.id());
    }
    println!("{} have been there", world.agents().len());
    Ok(())
}
