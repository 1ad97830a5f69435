//! Any bytes as a checkpoint with a checksum that fits: a state that a world goes on from, or an error that leaves it as it was or stopped.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metachron::world::Checkpoint;
use metachron_fuzz::{LIVES, allow_caught_panics, seal_checkpoint, world, write_checkpoint};

fn begin() {
    allow_caught_panics();
    write_checkpoint();
}

fuzz_target!(init: begin(), |bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    seal_checkpoint(&mut bytes);
    let Ok(checkpoint) = Checkpoint::from_bytes(&bytes) else { return };
    let world = world();
    if world.restore(&checkpoint).is_ok() {
        world.advance(LIVES);
    }
});
