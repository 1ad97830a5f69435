//! A step that does not end, or ends late: it is told of, checkpoints give up on it, and all others go on.

use super::rogue::{Kind, Switch};
use super::{ms, scene};
use metachron_core::SimSpan;
use metachron_runtime::{AgentState, TimelineCommand};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{CheckpointError, EventFilter, Happening, Rigid, World};
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

/// Waits for it; the deadline only ends a test that hangs.
pub fn eventually(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !done() {
        assert!(Instant::now() < deadline, "never happened: {what}");
        thread::sleep(Duration::from_millis(1));
    }
}

fn steps(world: &World, name: &str) -> u64 {
    world.latest(world.object(name).unwrap()).unwrap().steps
}

#[test]
fn a_step_that_does_not_end_is_told_of_and_the_world_goes_on() {
    for executor in [ExecutorKind::Threads, ExecutorKind::Pool] {
        let switch = Arc::<Switch>::default();
        let world = World::start(&scene(&switch, false), executor).unwrap();
        let mut events = world.events(EventFilter::states());
        world.advance(ms(50));
        let rogue = world.object("rogue").unwrap();
        let state = || world.agents().of(rogue.id()).unwrap().state();
        switch.set(Kind::Hangs);
        world.drive(TimelineCommand::Run);
        eventually("it is stalled", || state() == AgentState::Stalled);
        let mut told = false;
        eventually("an event says so", || {
            told |= events.drain().any(|event| event.object == rogue && event.what == Happening::Stalled);
            told
        });
        // a checkpoint gives up, twice, and names it; all callers are answered meanwhile
        for _ in 0..2 {
            let (asked, answer) = channel();
            let other = world.clone();
            let saving = thread::spawn(move || asked.send(other.checkpoint().map(drop)).unwrap());
            let refused = answer.recv_timeout(Duration::from_secs(60)).expect("the checkpoint returns").unwrap_err();
            assert!(matches!(refused, CheckpointError::Refused(_)), "{executor:?}: {refused}");
            assert!(refused.to_string().contains("\"rogue\""), "{executor:?}: {refused}");
            saving.join().unwrap();
            assert!(world.time() > metachron_core::SimTime::ZERO && world.timeline().until().is_none());
        }
        // an object that joins meanwhile falls
        let new = world.add("new", Rigid::ball(0.05).at([0.0, 3.0, 1.0])).unwrap();
        eventually("others go on", || steps(&world, "new") > 5);
        world.remove(new).unwrap();
        // where it ends after all it goes on, and can be saved
        switch.set(Kind::None);
        eventually("it runs again", || state() == AgentState::Running);
        let before = steps(&world, "rogue");
        eventually("it steps again", || steps(&world, "rogue") > before);
        eventually("it can be saved", || world.checkpoint().is_ok());
        world.stop();
    }
}

#[test]
fn a_world_ends_while_a_step_does_not() {
    for executor in [ExecutorKind::Threads, ExecutorKind::Pool] {
        let switch = Arc::<Switch>::default();
        let world = World::start(&scene(&switch, true), executor).unwrap();
        world.advance(SimSpan::from_millis(20));
        switch.set(Kind::Hangs);
        world.drive(TimelineCommand::Run);
        let rogue = world.object("rogue").unwrap();
        eventually("it is stalled", || world.agents().of(rogue.id()).unwrap().state() == AgentState::Stalled);
        let (ended, end) = channel();
        let other = world.clone();
        let stopping = thread::spawn(move || ended.send(other.stop()).unwrap());
        let stats = end.recv_timeout(Duration::from_secs(60)).expect("it ends");
        stopping.join().unwrap();
        let of_rogue = stats.iter().find(|stats| &*stats.name == "rogue").unwrap();
        assert!(matches!(of_rogue.state, AgentState::Parked(_)), "{executor:?}: {:?}", of_rogue.state);
        switch.set(Kind::None);
    }
}
