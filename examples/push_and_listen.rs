//! A program acts on a world that runs, and hears its events: a crate is pushed along the floor until it strikes a
//! ball.
//!
//! `cargo run --no-default-features --example push_and_listen`

use metachron::prelude::*;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let carton = Rigid::cuboid([0.1, 0.1, 0.1]).mass_kg(2.0).at([0.0, 0.0, 0.1]).friction(0.3);
    let ball = Rigid::ball(0.1).mass_kg(0.5).at([0.8, 0.0, 0.1]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("carton", carton).add("ball", ball).build()?;
    let world = World::start(&scene, ExecutorKind::Lockstep)?;
    let [carton, ball] = world.objects(["carton", "ball"])?;
    let mut events = world.events(EventFilter::all().above_n(1.0));

    // 20 N in the middle of the carton, for 0.6 s of its own time
    world.command(carton, Command::force(Anchor::Local(DVec3::ZERO), DVec3::X * 20.0).for_ms(600))?;
    for frame in world.frames(10.0).take(20) {
        for event in events.drain() {
            println!("{event}");
        }
        let [carton, ball] = [carton, ball].map(|object| frame.point(object, Anchor::Local(DVec3::ZERO)));
        println!("{:.1} s: carton at {:.3} m, ball at {:.3} m", frame.time().as_secs_f64(), carton?.x, ball?.x);
    }
    Ok(())
}
