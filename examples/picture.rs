//! Plays a scene file in lockstep and draws its last frame to a picture, without a window or the command.
//!
//! `cargo run --no-default-features --features render --example picture -- scenes/crossing.toml crossing.png`

use metachron::render::{Gpu, Offscreen, RendererOptions, Size, Style};
use metachron::scene::{Source, load};
use metachron::session::{Drawing, End, Headless, Session, play_headless};
use metachron::world::Pace;
use metachron::world::kinds::ExecutorKind;
use std::error::Error;
use std::path::PathBuf;

const SIZE: Size = Size { width: 640, height: 360 };

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene_file = arguments.next().ok_or("expected a scene file, for example scenes/crossing.toml")?;
    let picture_file = PathBuf::from(arguments.next().unwrap_or_else(|| "picture.png".into()));
    let mut scene = load(&Source::open(&scene_file)?, &[])?;
    scene.executor = ExecutorKind::Lockstep;

    let gpu = Gpu::headless()?;
    let screen = Offscreen::new(gpu.clone(), SIZE, RendererOptions::for_adapter(&gpu.info))?;
    let plan = Headless {
        end: End::Seconds(1.0),
        size: SIZE,
        style: Style::default(),
        drawing: Drawing::Last(Box::new(screen)),
        png: Some(picture_file.clone()),
        depth: None,
        film: None,
    };
    let outcome = play_headless(Session::open(scene, Pace::RealTime)?, plan, &mut |_, _| true)?;
    println!(
        "{} agents, {:.2} s, drawn on {}: {}",
        outcome.agents.len(),
        outcome.sim_s,
        gpu.describe(),
        picture_file.display()
    );
    Ok(())
}
