//! A world built in code, without scene files, drawing or a window: a ball falls on a tube that is held at both ends.
//!
//! `cargo run --no-default-features --example headless`; with the feature `scene` a file may be named instead: `-- scenes/crossing.toml`.

use metachron::prelude::*;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::start(&scene()?, ExecutorKind::Lockstep)?;
    for _ in 0..10 {
        world.advance(SimSpan::from_millis(100));
        let heights = world.agents().iter().filter_map(|agent| {
            let (middle, _) = agent.latest().body.probe(0.5)?;
            Some(format!("{} {:.4} m", agent.name(), middle.z))
        });
        println!("{:.1} s: {}", world.time().as_secs_f64(), heights.collect::<Vec<_>>().join(", "));
    }
    println!("state hash {:016x}", world.hash());
    Ok(())
}

fn scene() -> Result<Scene, Box<dyn Error>> {
    #[cfg(feature = "scene")]
    if let Some(path) = std::env::args().nth(1) {
        return Ok(metachron::scene::load(&metachron::scene::Source::open(&path)?, &[])?);
    }
    let tube = Tube::along(&[[-0.2, 0.0, 0.2], [0.2, 0.0, 0.2]]).radius_m(0.015).young_pa(1e6).clamp([true, true]);
    let ball = Rigid::ball(0.02).mass_kg(0.05).at([0.0, 0.0, 0.3]);
    Ok(Scene::builder().fixed("floor", Solid::Plane).add("tube", tube).add("ball", ball).build()?)
}
