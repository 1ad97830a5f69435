//! Any bytes as a recording whose chunks have checksums that fit: what a world is made to do again, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metachron::prelude::*;
use metachron::world::Recording;
use metachron_fuzz::{LIVES, allow_caught_panics, scene, seal_recording, write_recording};

fn begin() {
    allow_caught_panics();
    write_recording();
}

fuzz_target!(init: begin(), |bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    seal_recording(&mut bytes);
    let Ok(recording) = Recording::from_bytes(&bytes) else { return };
    if let Ok(world) = World::replay(&scene(), recording, None) {
        world.advance(LIVES);
    }
});
