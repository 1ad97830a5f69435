//! Built-in scenes that several worlds step together have the bits of one.

use metachron::scene::{Source, load};
use metachron::world::kinds::ExecutorKind;
use metachron::world::{Pace, PlacedHost, PlacedWorld, World, WorldCalls};
use metachron_core::SimSpan;
use std::sync::Arc;

/// Scenes in which objects meet, are tied, rest or are governed.
const SCENES: [&str; 6] = ["crossing", "gripper", "yard", "chain", "mesentery", "stack"];

fn path(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

const TENTH: SimSpan = SimSpan::from_millis(100);

#[test]
fn built_in_scenes_on_two_and_four_hosts_have_the_bits_of_one_process() {
    for name in SCENES {
        let scene = load(&Source::open(&path(name)).unwrap(), &[]).unwrap();
        let start = || {
            let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
            world.set_pace(Pace::Free).unwrap();
            world
        };
        let host = |number: usize| PlacedHost { name: number.to_string(), world: Arc::new(start()) };
        let placed = [2, 4].map(|hosts| PlacedWorld::start(&scene, (0..hosts).map(host).collect()).unwrap());
        let whole = start();
        for tenth in 1..=7 {
            whole.advance(TENTH);
            for placed in &placed {
                placed.advance(TENTH).unwrap();
                let loads = placed.loads();
                assert_eq!(placed.hash().unwrap(), whole.hash(), "{name} after {tenth} tenths: {loads:?}");
            }
        }
    }
}
