//! The recording that a test makes of a world: the bytes, while they are written, and the recording read from them.

use metachron_world::{BadRecording, Recording, World};
use std::io::Write;
use std::sync::{Arc, Mutex};

/// Bytes that are written while they are kept.
#[derive(Clone, Default)]
pub struct Kept(pub Arc<Mutex<Vec<u8>>>);

impl Write for Kept {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Kept {
    pub fn read(&self) -> Result<Recording, BadRecording> {
        Recording::from_bytes(&self.0.lock().unwrap())
    }
}

pub fn recorded(world: &World) -> Kept {
    let kept = Kept::default();
    world.record_to(Box::new(kept.clone()), None).unwrap();
    kept
}
