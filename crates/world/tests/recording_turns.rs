//! A recording of a world on threads or in a pool repeats it on one thread, to the bit.

use metachron_core::SimSpan;
use metachron_geometry::Solid;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{BadRecording, Pace, Recording, Rigid, Scene, World};
use std::io::Write;
use std::sync::{Arc, Mutex};

/// Bytes that are written while they are kept.
#[derive(Clone, Default)]
struct Kept(Arc<Mutex<Vec<u8>>>);

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
    fn read(&self) -> Result<Recording, BadRecording> {
        Recording::from_bytes(&self.0.lock().unwrap())
    }
}

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

fn recorded(world: &World) -> Kept {
    let kept = Kept::default();
    world.record_to(Box::new(kept.clone()), None).unwrap();
    kept
}

/// Plays all of a recording.
fn replayed(scene: &Scene, recording: Recording) -> World {
    let world = World::replay(scene, recording, None).unwrap();
    while world.replayed().unwrap().unwrap() < 1.0 {
        world.advance(ms(10));
    }
    world
}

#[test]
fn two_balls_that_meet_are_repeated() {
    let ball = |x: f64, speed: f64, hz: f64| {
        Rigid::ball(0.05).mass_kg(0.2).at([x, 0.0, 0.2]).velocity_m_s([speed, 0.0, 0.0]).rate_hz(hz)
    };
    let scene = Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("left", ball(-0.3, 1.0, 240.0))
        .add("right", ball(0.3, -0.7, 170.0))
        .build()
        .unwrap();
    for executor in [ExecutorKind::Threads, ExecutorKind::Pool] {
        let world = World::start(&scene, executor).unwrap();
        let kept = recorded(&world);
        world.set_pace(Pace::Factor(2.0)).unwrap();
        world.advance(ms(2000));
        assert!(world.end_recording().unwrap());
        let recording = kept.read().unwrap();
        let hash = recording.hash();
        println!("{executor:?} {} bytes", kept.0.lock().unwrap().len());
        let again = replayed(&scene, recording);
        assert_eq!(Some(again.hash()), hash);
    }
}
