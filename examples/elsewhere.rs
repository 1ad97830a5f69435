//! Watches a world that runs elsewhere for three seconds, and drops a ball into it: `cargo run --features hosts --example elsewhere -- tcp/127.0.0.1:7447`.

use metachron::hosts::connect;
use metachron::prelude::*;
use metachron::runtime::TimelineCommand;
use metachron::world::WorldCalls;
use std::error::Error;
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let endpoint = std::env::args().nth(1).ok_or("expected an endpoint, such as tcp/127.0.0.1:7447")?;
    let world = connect(&endpoint)?;
    let ball = world.add("a ball from elsewhere", Rigid::ball(0.03).mass_kg(0.1).at([0.0, 0.0, 1.0]).into())?;
    world.drive(TimelineCommand::Run)?;
    let (begun, mut shown, mut frames) = (Instant::now(), 0, 0);
    let mut frame = world.frame();
    while begun.elapsed() < Duration::from_secs(3) {
        frame = world.next_frame(frame.time, Duration::from_secs(1))?;
        frames += 1;
        if begun.elapsed().as_millis() / 500 > shown {
            shown = begun.elapsed().as_millis() / 500;
            let place = frame.body(ball).and_then(|body| body.probe(0.0)).map(|(place, _)| place.to_string());
            let age_ms = world.age().as_secs_f64() * 1e3;
            println!(
                "{:.2} s, {frames} frames, {} objects, {age_ms:.0} ms old, the ball is at {}",
                frame.time.as_secs_f64(),
                frame.states.len(),
                place.unwrap_or_default()
            );
        }
    }
    world.remove(ball)?;
    Ok(())
}
