//! What the targets share: a small scene, and the seals of files that the program writes itself.
//!
//! In: bytes of a mutated file. Out: the same with lengths and checksums that fit, so that what is behind them is reached; files to begin from. Never here: a target.

use metachron::prelude::*;
use std::path::{Path, PathBuf};

/// Bytes before the body of a checkpoint: name, version, length, checksum.
const CHECKPOINT_HEAD: usize = 8 + 4 + 8 + 8;
/// Bytes before the chunks of a recording: name, version.
const RECORDING_HEAD: usize = 8 + 4;
/// Bytes before the contents of a chunk: length, checksum.
const CHUNK_HEAD: usize = 4 + 8;

/// A body of each kind, in 0.4 ms of building.
pub fn scene() -> Scene {
    let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.051]);
    let plate = Rigid::cuboid([0.1, 0.1, 0.01]).kinematic().at([0.5, 0.0, 0.1]);
    let tube = Tube::along(&[[-0.2, 1.0, 0.3], [0.2, 1.0, 0.3]]).radius_m(0.01).clamp([true, true]);
    let jelly = Soft::cuboid([0.1; 3], [1, 1, 1]).at([0.0, -1.0, 0.051]).young_pa(1e4);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("plate", plate);
    scene.add("tube", tube).add("jelly", jelly).build().expect("a scene that stands in the code")
}

/// A world that has run for a few steps.
pub fn world() -> World {
    let world = World::start(&scene(), ExecutorKind::Lockstep).expect("it starts");
    world.advance(SimSpan::from_millis(20));
    world
}

/// Gives a checkpoint the length and the checksum that its bytes have.
pub fn seal_checkpoint(bytes: &mut [u8]) {
    let Some((head, body)) = bytes.split_first_chunk_mut::<CHECKPOINT_HEAD>() else { return };
    head[12..20].copy_from_slice(&(body.len() as u64).to_le_bytes());
    head[20..].copy_from_slice(&checksum(body).to_le_bytes());
}

/// Gives each chunk of a recording the checksum that its bytes have; the last one the length that is left.
pub fn seal_recording(bytes: &mut [u8]) {
    let mut at = RECORDING_HEAD;
    while let Some(chunk) = bytes.get_mut(at..)
        && let Some((head, after)) = chunk.split_first_chunk_mut::<CHUNK_HEAD>()
    {
        let says = u32::from_le_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let length = says.min(after.len());
        head[..4].copy_from_slice(&(length as u32).to_le_bytes());
        head[4..].copy_from_slice(&checksum(&after[..length]).to_le_bytes());
        at += CHUNK_HEAD + length;
    }
}

/// FNV-1a of 64 bits, as the files have it.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// A checkpoint to begin from, written where the target's inputs are.
///
/// # Panics
/// Where that cannot be written.
pub fn write_checkpoint() {
    world().checkpoint().expect("it can be saved").write(input("checkpoint")).expect("a folder for inputs");
}

/// A recording to begin from, with an entry of every kind that a program makes, written where the target's inputs are.
///
/// # Panics
/// Where that cannot be written.
pub fn write_recording() {
    let act = || -> Result<(), Box<dyn std::error::Error>> {
        let world = World::start(&scene(), ExecutorKind::Lockstep)?;
        world.record(input("recording"))?;
        let (ball, plate) = (world.object("ball")?, world.object("plate")?);
        world.command(ball, Command::force(Anchor::Local(DVec3::ZERO), DVec3::Z).for_ms(5))?;
        world.command(plate, Command::pose(DVec3::Z * 0.1, DQuat::IDENTITY))?;
        world.advance(SimSpan::from_millis(2));
        let other = world.add("other", Rigid::ball(0.05).at([0.0, 0.0, 1.0]))?;
        world.add("cloth", Soft::sheet([0.2, 0.2], 0.002, [2, 2]).at([2.0, 0.0, 0.5]).young_pa(1e5))?;
        world.add("hose", Tube::along(&[[-0.2, 2.0, 0.3], [0.2, 2.0, 0.3]]).radius_m(0.01))?;
        world.advance(SimSpan::from_millis(2));
        world.set_state(ball, &world.latest(ball)?.body)?;
        world.restore(&world.checkpoint()?)?;
        world.remove(other)?;
        world.advance(SimSpan::from_millis(2));
        world.end_recording()?;
        Ok(())
    };
    act().expect("a recording of plain calls");
}

/// The first input of a target.
fn input(target: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    std::fs::create_dir_all(&folder).expect("a folder for inputs");
    folder.join("world")
}

/// Lets panics that the program catches itself pass: libFuzzer's hook would end the process at them. What reaches a target still does.
pub fn allow_caught_panics() {
    std::panic::set_hook(Box::new(|panic| {
        if std::env::var_os("METACHRON_FUZZ_SHOW_PANICS").is_some() {
            eprintln!("{panic}");
        }
    }));
}

/// How long a world is let live with what was read.
pub const LIVES: SimSpan = SimSpan::from_millis(10);
