//! A step in lockstep that does not end keeps the thread that made it, and no other that calls the world.

use super::rogue::{Kind, Switch};
use super::stalls::eventually;
use super::{ms, scene};
use metachron_runtime::AgentState;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{CheckpointError, EventFilter, Happening, Object, RecordError, Rigid, World, WorldError};
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::Duration;

const SPAN_MS: u64 = 400;

/// A world whose rogue does `kind` from 50 ms on, and the thread that lets it live for [`SPAN_MS`] more.
fn passing(switch: &Arc<Switch>, kind: Kind) -> (World, Object, JoinHandle<()>) {
    let world = World::start(&scene(switch, false), ExecutorKind::Lockstep).unwrap();
    world.advance(ms(50));
    let rogue = world.object("rogue").unwrap();
    let before = switch.times.load(SeqCst);
    switch.set(kind);
    let other = world.clone();
    let passing = thread::spawn(move || other.advance(ms(SPAN_MS)));
    eventually("its step begins", || switch.times.load(SeqCst) > before);
    (world, rogue, passing)
}

fn state(world: &World, object: Object) -> AgentState {
    world.agents().of(object.id()).unwrap().state()
}

/// The answer of a call on a thread of its own; the deadline only ends a test that hangs.
fn answered<T: Send + 'static>(world: &World, call: impl FnOnce(&World) -> T + Send + 'static) -> T {
    let (answers, answer) = channel();
    let world = world.clone();
    thread::spawn(move || answers.send(call(&world)));
    answer.recv_timeout(Duration::from_secs(60)).expect("the call returns")
}

#[test]
fn others_are_told_of_it_and_answered_and_it_goes_on_to_the_same_bits() {
    let switch = Arc::<Switch>::default();
    let good = World::start(&scene(&switch, false), ExecutorKind::Lockstep).unwrap();
    good.advance(ms(50));
    let (time, mark) = (good.time(), good.checkpoint().unwrap());
    let (world, rogue, passing) = passing(&switch, Kind::Hangs);
    let mut events = world.events(EventFilter::states());
    eventually("it is stalled", || state(&world, rogue) == AgentState::Stalled);
    eventually("an event says so", || {
        events.drain().any(|event| event.object == rogue && event.what == Happening::Stalled)
    });
    assert_eq!(events.drain().count(), 0, "it says so once");
    let beside = world.object("beside").unwrap();
    assert_eq!(state(&world, beside), AgentState::Stalled, "its cluster waits for it");
    assert_eq!(state(&world, world.object("far ball").unwrap()), AgentState::Running);
    assert!(world.agents().of(rogue.id()).unwrap().stalled_for() >= Duration::from_millis(250));
    let refused = answered(&world, |world| world.checkpoint().map(drop)).unwrap_err();
    assert!(matches!(refused, CheckpointError::Refused(_)) && refused.to_string().contains("\"rogue\""), "{refused}");
    let refused = answered(&world, move |world| world.restore(&mark)).unwrap_err();
    assert!(
        matches!(refused, CheckpointError::Unreadable(_)) && refused.to_string().contains("\"rogue\""),
        "{refused}"
    );
    let refused = answered(&world, |world| world.record_to(Box::new(std::io::sink()), None)).unwrap_err();
    assert!(matches!(refused, RecordError::Begun(_)) && refused.to_string().contains("\"rogue\""), "{refused}");
    let refused = answered(&world, World::end_recording).unwrap_err();
    assert!(matches!(&refused, RecordError::Stalled { name, .. } if name == "rogue"), "{refused}");
    let refused = answered(&world, |world| world.add("new", Rigid::ball(0.05))).unwrap_err();
    assert!(matches!(&refused, WorldError::Stalled { name, .. } if name == "rogue"), "{refused}");
    let refused = answered(&world, move |world| world.remove(beside)).unwrap_err();
    assert!(matches!(&refused, WorldError::Stalled { name, .. } if name == "rogue"), "{refused}");
    assert_eq!(answered(&world, |world| (world.time(), world.now(), world.timeline().until())).0, time);
    answered(&world, |world| world.advance(ms(100)));
    // nobody has done anything to it: it ends where it would have
    switch.set(Kind::None);
    passing.join().unwrap();
    good.advance(ms(SPAN_MS));
    assert_eq!((state(&world, rogue), world.hash()), (AgentState::Running, good.hash()));
    assert!(world.checkpoint().is_ok() && world.add("new", Rigid::ball(0.05).at([0.0, 3.0, 1.0])).is_ok());
}

#[test]
fn a_call_that_lasts_long_is_waited_for_while_its_turns_end() {
    let switch = Arc::<Switch>::default();
    let (world, rogue, passing) = passing(&switch, Kind::Slow);
    answered(&world, World::checkpoint).unwrap();
    assert_eq!(state(&world, rogue), AgentState::Running);
    passing.join().unwrap();
    // together they took longer than a turn of three may
    assert!(switch.times.load(SeqCst) * 10 > 3 * 250, "{} steps of ten milliseconds", switch.times.load(SeqCst));
}

#[test]
fn a_world_in_lockstep_ends_while_a_step_does_not() {
    let switch = Arc::<Switch>::default();
    let (world, rogue, passing) = passing(&switch, Kind::Hangs);
    let stats = answered(&world, World::stop);
    let of_rogue = stats.iter().find(|stats| &*stats.name == "rogue").unwrap();
    let AgentState::Parked(reason) = &of_rogue.state else { panic!("{:?}", of_rogue.state) };
    assert!(reason.contains("did not end"), "{reason}");
    let flying = world.object("flying").unwrap();
    let before = world.latest(flying).unwrap().steps;
    assert!(matches!(world.checkpoint(), Err(CheckpointError::Refused(_) | CheckpointError::Stopped)));
    // where it ends after all no other turn begins
    switch.set(Kind::None);
    passing.join().unwrap();
    assert_eq!(world.latest(flying).unwrap().steps, before);
    assert!(matches!(world.checkpoint(), Err(CheckpointError::Stopped)));
    assert_eq!(state(&world, rogue), of_rogue.state);
}
