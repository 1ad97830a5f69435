//! A run is one small file: a program's calls to a world are written down, and repeated to the same bits.
//!
//! `cargo run --no-default-features --example record_and_replay -- run.rec`

use metachron::prelude::*;
use metachron::world::Recording;
use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).map_or_else(|| std::env::temp_dir().join("metachron.rec"), PathBuf::from);
    let hose = Tube::along(&[[-0.3, 0.0, 0.3], [0.3, 0.0, 0.3]]).radius_m(0.015).young_pa(1e6).clamp([true, true]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("hose", hose).build()?;

    let recorded = record(&scene, &path)?;
    let bytes = std::fs::metadata(&path)?.len();
    println!("recorded {} bytes: state hash {recorded:016x}", bytes);

    let recording = Recording::read(&path)?;
    println!("the file is whole: {}; it says {:016x}", recording.is_complete(), recording.hash().unwrap_or_default());
    let world = World::replay(&scene, recording, None)?;
    while world.replayed().transpose()?.is_some_and(|share| share < 1.0) {
        world.advance(SimSpan::from_millis(100));
    }
    println!(
        "replayed {:.1} s, {} objects: state hash {:016x}",
        world.time().as_secs_f64(),
        world.agents().len(),
        world.hash()
    );
    if world.hash() == recorded { Ok(()) } else { Err("the replay differs".into()) }
}

/// Pulls at a hose and drops balls on it; the state hash at the end.
fn record(scene: &Scene, path: &Path) -> Result<u64, Box<dyn Error>> {
    let world = World::start(scene, ExecutorKind::Lockstep)?;
    world.record(path)?;
    let hose = world.object("hose")?;
    world.command(hose, Command::force(Anchor::Arc(0.2), DVec3::Y * 2.0).for_ms(300))?;
    for number in 0..3 {
        let ball = Rigid::ball(0.03).mass_kg(0.05).at([0.1 * f64::from(number) - 0.1, 0.0, 0.5]);
        world.add(format!("ball {number}"), ball)?;
        world.advance(SimSpan::from_millis(400));
    }
    world.end_recording()?;
    Ok(world.hash())
}
