//! A recording repeats a world in lockstep to the bit, whatever was done to it, and says why it cannot.

mod kept;

use glam::{DQuat, DVec3};
use kept::recorded;
use metachron_core::{Anchor, Resolution, SimSpan, SimTime};
use metachron_geometry::Solid;
use metachron_runtime::{Demand, Governor, TurnMeasure};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{BadRecording, Command, Custom, RecordError, Recording, Rigid, Scene, Tube, World, WorldError};
use std::io::Write;

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

fn scene() -> Scene {
    let ball = Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.2]);
    let tube = Tube::along(&[[-0.2, 0.0, 0.12], [0.2, 0.0, 0.12]]).radius_m(0.01).segments(6);
    Scene::builder().fixed("floor", Solid::Plane).add("ball", ball).add("tube", tube).build().unwrap()
}

fn start() -> World {
    World::start(&scene(), ExecutorKind::Lockstep).unwrap()
}

/// Plays all of a recording.
fn replayed(recording: Recording) -> World {
    let world = World::replay(&scene(), recording, None).unwrap();
    while world.replayed().unwrap().unwrap() < 1.0 {
        world.advance(ms(10));
    }
    world
}

/// Lets everything happen that a recording has.
fn play(world: &World) {
    let [ball, tube] = world.objects(["ball", "tube"]).unwrap();
    world.advance(ms(50));
    world.command(ball, Command::force(Anchor::Local(DVec3::ZERO), DVec3::X).key(3).for_ms(40)).unwrap();
    world.command(tube, Command::velocity(DVec3::Y * 0.1, DVec3::ZERO)).unwrap();
    world.spend(std::time::Duration::from_millis(3));
    world.advance(ms(20));
    let crate_ = world.add("crate", Rigid::cuboid([0.02; 3]).at([0.05, 0.0, 0.4])).unwrap();
    let hose = Tube::along(&[[0.0, -0.2, 0.3], [0.0, 0.2, 0.3]]).segments(4);
    world.add("hose", hose).unwrap();
    let mark = world.checkpoint().unwrap();
    world.advance(ms(70));
    world.restore(&mark).unwrap();
    world.command(crate_, Command::teleport(DVec3::Z * 0.6, DQuat::IDENTITY)).unwrap();
    world.advance(ms(40));
    world.remove(ball).unwrap();
    world.advance(ms(30));
}

#[test]
fn a_replay_ends_with_the_same_bits_and_takes_no_commands() {
    let world = start();
    let kept = recorded(&world);
    play(&world);
    world.end_recording().unwrap();
    let recording = kept.read().unwrap();
    assert!(recording.is_complete() && recording.hash() == Some(world.hash()));
    let again = replayed(recording);
    assert_eq!((again.hash(), again.now(), again.time()), (world.hash(), world.now(), world.time()));
    let hose = again.object("hose").unwrap();
    let refused = again.command(hose, Command::pressure(1.0));
    assert!(matches!(&refused, Err(WorldError::Refused { reason, .. }) if reason.contains("recording")), "{refused:?}");
    assert!(matches!(again.record("x"), Err(RecordError::Stopped)));
}

#[test]
fn a_replay_stops_where_it_is_told_to() {
    let world = start();
    let kept = recorded(&world);
    world.advance(ms(500));
    world.end_recording().unwrap();
    let plain = start();
    plain.advance(ms(120));
    let again = World::replay(&scene(), kept.read().unwrap(), Some(SimTime::ZERO + ms(120))).unwrap();
    again.advance(ms(10));
    assert_eq!((again.time(), again.hash(), again.replayed()), (plain.time(), plain.hash(), Some(Ok(1.0))));
}

#[test]
fn a_recording_that_begins_later_begins_with_the_state_of_then() {
    let world = start();
    world.advance(ms(130));
    let kept = recorded(&world);
    world.advance(ms(90));
    world.stop();
    assert_eq!(replayed(kept.read().unwrap()).hash(), world.hash());
}

#[test]
fn a_recording_begins_with_the_objects_that_are_there() {
    let world = start();
    let ball = world.object("ball").unwrap();
    let crate_ = world.add("crate", Rigid::cuboid([0.02; 3]).at([0.05, 0.0, 0.4])).unwrap();
    world.advance(ms(40));
    let before = world.checkpoint().unwrap();
    [ball, crate_].into_iter().for_each(|object| world.remove(object).unwrap());
    world.advance(ms(40));
    world.add("ball", Rigid::ball(0.03).at([0.0, 0.0, 0.5])).unwrap();
    let kept = recorded(&world);
    world.advance(ms(60));
    // the replay has never seen one of these
    world.restore(&before).unwrap();
    world.advance(ms(40));
    world.add("late", Rigid::ball(0.03).at([0.0, 0.0, 0.5])).unwrap();
    world.advance(ms(40));
    world.remove(crate_).unwrap();
    world.advance(ms(40));
    world.end_recording().unwrap();
    let again = replayed(kept.read().unwrap());
    assert_eq!((again.hash(), again.time()), (world.hash(), world.time()));
    assert!(again.object("ball").is_ok() && again.object("crate").is_err());
}

#[test]
fn a_recording_that_was_cut_anywhere_is_read_to_its_last_whole_chunk() {
    let world = start();
    let kept = recorded(&world);
    for _ in 0..300 {
        world.advance(ms(1));
    }
    world.end_recording().unwrap();
    let whole = kept.0.lock().unwrap().clone();
    let mut counts = std::collections::BTreeSet::new();
    for length in (0..whole.len()).step_by(7) {
        match Recording::from_bytes(&whole[..length]) {
            Ok(recording) => {
                assert!(!recording.is_complete() && !recording.is_damaged());
                counts.insert(length - recording.lost_bytes());
            }
            Err(BadRecording::NoRecording | BadRecording::NoHead) => assert!(length < 400, "{length}"),
            Err(other) => panic!("{length} bytes: {other}"),
        }
    }
    assert!(counts.len() >= 3, "head and two chunks: {counts:?}");
    let mut changed = whole.clone();
    let last = changed.len() - 1;
    changed[last] ^= 1;
    let recording = Recording::from_bytes(&changed).unwrap();
    assert!(recording.lost_bytes() > 0 && recording.hash().is_none() && recording.is_damaged());
    let cut = replayed(recording);
    let plain = start();
    plain.advance(cut.time().since(SimTime::ZERO));
    assert_eq!(cut.hash(), plain.hash());
}

#[test]
fn a_flipped_bit_is_damage_wherever_it_is_and_no_missing_end() {
    let world = start();
    let kept = recorded(&world);
    (0..150).for_each(|_| world.advance(ms(1)));
    world.end_recording().unwrap();
    let whole = kept.0.lock().unwrap().clone();
    for at in 12..whole.len() {
        let mut changed = whole.clone();
        changed[at] ^= 0x10;
        match Recording::from_bytes(&changed) {
            Ok(recording) => assert!(recording.is_damaged() && !recording.is_complete(), "byte {at}"),
            Err(error) => assert_eq!(error, BadRecording::Damaged, "byte {at}"),
        }
    }
}

/// Takes so many bytes and no more.
struct FullAfter(usize);

impl Write for FullAfter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let Some(left) = self.0.checked_sub(bytes.len()) else { return Err(std::io::ErrorKind::StorageFull.into()) };
        self.0 = left;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_recording_that_cannot_be_written_on_is_known_meanwhile_and_says_once_why() {
    let world = start();
    world.record_to(Box::new(FullAfter(1000)), None).unwrap();
    let failed_after = (0..1000).find(|_| {
        world.advance(ms(1));
        world.recording_failed()
    });
    assert!(failed_after.is_some_and(|calls| calls < 300), "{failed_after:?}");
    let error = world.end_recording().unwrap_err();
    assert!(error.to_string().contains("no storage space") && std::error::Error::source(&error).is_none(), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_finds_no_room_names_its_file() {
    let error = start().record("/dev/full").unwrap_err().to_string();
    assert!(error.contains("/dev/full: ") && error.contains("os error"), "{error}");
}

#[test]
fn another_format_another_scene_and_other_worlds_are_named() {
    let world = start();
    let kept = recorded(&world);
    world.end_recording().unwrap();
    let format = std::mem::replace(&mut kept.0.lock().unwrap()[8], 99);
    assert!(matches!(kept.read(), Err(BadRecording::OtherFormat { found: 99 })));
    kept.0.lock().unwrap()[8] = format;
    let other = Scene::builder().add("ball", Rigid::ball(0.05)).build().unwrap();
    let error = World::replay(&other, kept.read().unwrap(), None).unwrap_err().to_string();
    assert!(error.contains("moving objects") && error.contains("expected 1"), "{error}");
}

#[test]
fn an_agent_of_ones_own_joins_no_recording() {
    let world = start();
    let _kept = recorded(&world);
    let refused = world.add("own", Custom::made_by(|_| unreachable!("it is refused before")));
    assert!(matches!(&refused, Err(WorldError::Refused { reason, .. }) if reason.contains("agent of your own")));
}

/// Asks for another step whenever it is called an even number of times, of numbers that no replay has.
struct Moody(u64);

impl Governor for Moody {
    fn after_step(&mut self, _: &TurnMeasure) -> Demand {
        self.0 += 1;
        let dt = self.0.is_multiple_of(3).then(|| SimSpan::from_nanos(3_000_000 + self.0 * 1000));
        Demand { dt, resolution: None::<Resolution> }
    }
}

#[test]
fn a_replay_takes_what_governors_answered_from_the_recording() {
    let mut scene = scene();
    scene.agents[0].pace.dt_range = (ms(1), ms(9));
    let world =
        World::start_governed(&scene, ExecutorKind::Lockstep, &mut |_| Some(Box::new(Moody(0)) as Box<_>)).unwrap();
    let kept = recorded(&world);
    (0..20).for_each(|_| world.advance(ms(13)));
    world.end_recording().unwrap();
    let others = &mut |_: &metachron_world::Member| Some(Box::new(Moody(7)) as Box<dyn Governor>);
    let again = World::replay_governed(&scene, others, kept.read().unwrap(), None).unwrap();
    again.advance(ms(300));
    assert_eq!((again.replayed(), again.hash()), (Some(Ok(1.0)), world.hash()));
    // without any governor too: a program that repeats a run of another does not have them
    let again = World::replay(&scene, kept.read().unwrap(), None).unwrap();
    again.advance(ms(300));
    assert_eq!((again.replayed(), again.hash()), (Some(Ok(1.0)), world.hash()));
}

#[test]
fn a_recording_of_a_world_that_another_thread_drives_repeats_it() {
    let world = start();
    std::thread::scope(|scope| {
        let driver = world.clone();
        let driven = scope.spawn(move || (0..400).for_each(|_| driver.advance(ms(1))));
        let ball = world.object("ball").unwrap();
        while !driven.is_finished() {
            let kept = recorded(&world);
            world.command(ball, Command::impulse(Anchor::Local(DVec3::ZERO), DVec3::X * 1e-3)).unwrap();
            world.end_recording().unwrap();
            let recording = kept.read().unwrap();
            let hash = recording.hash();
            assert_eq!(Some(replayed(recording).hash()), hash);
        }
    });
}

#[test]
fn a_second_recording_is_refused_and_ends_nothing() {
    let (world, path) = (start(), std::env::temp_dir().join(format!("metachron-second-{}.rec", std::process::id())));
    std::fs::write(&path, "mine").unwrap();
    let kept = recorded(&world);
    assert!(matches!(world.record(&path), Err(RecordError::Recorded)));
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
    std::fs::remove_file(&path).unwrap();
    world.advance(ms(10));
    world.end_recording().unwrap();
    assert!(kept.read().unwrap().is_complete());
}
