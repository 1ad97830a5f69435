//! Serves a scene file until it is stopped: `cargo run --example host -- ../../scenes/crossing.toml tcp/127.0.0.1:7447`.

use metachron::prelude::*;
use metachron::scene::{Source, load};
use metachron_hosts::serve;
use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(path), Some(endpoint)) = (arguments.next(), arguments.next()) else {
        return Err("expected a scene file and an endpoint, such as tcp/127.0.0.1:7447".into());
    };
    let scene = load(&Source::open(&path)?, &[])?;
    let world = World::start(&scene, ExecutorKind::Auto)?;
    let host = serve(Arc::new(world.clone()), "bench", &endpoint)?;
    println!(
        "\"{}\" at {endpoint}, {} objects; time stands until a caller lets it run",
        scene.name,
        world.agents().len()
    );
    loop {
        std::thread::sleep(Duration::from_secs(1));
        let (callers, refused) = (host.callers(), host.refused().total());
        println!("{:.1} s, {callers} callers, {refused} messages refused", world.time().as_secs_f64());
    }
}
