//! Worlds that go back: however often, with objects that join, leave and jump meanwhile and calls of other threads, no
//! world is lost and no object parked; a refused state changes nothing; readers of events learn that the world went
//! back.

#[path = "../examples/rewinds/driver.rs"]
mod driver;
mod kept;

use driver::{Amount, Tally, churn, storm};
use kept::recorded;
use metachron_contact::{Agent, OwnSteps, StepContext, Stepping};
use metachron_core::{Archive, ArchiveError, SimSpan, Snapshot, StepError, StepReport};
use metachron_geometry::Solid;
use metachron_runtime::AgentState;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{
    Checkpoint, CheckpointError, Custom, Event, EventFilter, Happening, Rigid, Scene, Soft, Touched, World,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};
use std::time::Duration;

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

fn nothing_wrong(executor: ExecutorKind, tally: &Tally) {
    assert!(tally.lost.is_empty() && tally.parked.is_empty(), "{executor:?}: {tally:?}");
}

#[test]
fn no_checkpoint_and_no_way_back_loses_a_world_or_an_object() {
    for executor in EXECUTORS {
        let amount = Amount { checkpoints: 1500, restores: 300, change_every: 3 };
        let tally = churn(executor, amount, 11);
        assert_eq!((tally.checkpoints, tally.restores), (1500, 300), "{executor:?}: {tally:?}");
        nothing_wrong(executor, &tally);
    }
}

#[test]
fn eight_threads_call_whatever_they_like() {
    for executor in EXECUTORS {
        let tally = storm(executor, 8, 400, Duration::from_secs(60), 3);
        assert!(tally.restores > 0 && tally.changes > 0, "{executor:?}: {tally:?}");
        nothing_wrong(executor, &tally);
    }
}

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

/// Modes of a [`Clerk`] that reads its state.
const READS: u8 = 0;
const ERRS_ONCE: u8 = 1;
const PANICS_ONCE: u8 = 2;
const NEVER_READS: u8 = 3;

/// A model that counts its steps, and does not always read its state.
struct Clerk {
    steps: u64,
    half_s: f64,
    mood: Arc<AtomicU8>,
}

impl Agent for Clerk {
    fn model(&self) -> &'static str {
        "clerk"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.energy_j = self.half_s;
        into.drift_m = self.steps as f64;
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.steps)?;
        let mood = self.mood.load(Relaxed);
        if archive.is_reading() && mood != READS {
            self.mood.store(if mood == NEVER_READS { NEVER_READS } else { READS }, Relaxed);
            assert!(mood != PANICS_ONCE, "half way");
            return Err(ArchiveError::Refused { what: "a clerk that is on strike".to_owned() });
        }
        archive.value(&mut self.half_s)
    }
}

impl OwnSteps for Clerk {
    fn step(&mut self, dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        self.steps += 1;
        self.half_s += dt.as_secs_f64() / 2.0;
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }
}

/// A clerk, a jelly of so many cells along x, and a ball that fell onto the floor; the jelly and the ball are about to meet.
fn office(mood: &Arc<AtomicU8>, cells: u32) -> Scene {
    let mood = Arc::clone(mood);
    let clerk = Custom::made_by(move |_| Box::new(Clerk { steps: 0, half_s: 0.0, mood: Arc::clone(&mood) }));
    Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("ball", Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.1]))
        .add("clerk", clerk)
        .add("jelly", Soft::cuboid([0.1; 3], [cells, 1, 1]).young_pa(1e4).at([0.0, 0.0, 0.3]))
        .build()
        .unwrap()
}

/// A world of it that another ball has joined and left, which is in `mark`, and one that has joined since.
fn busy(mood: &Arc<AtomicU8>, executor: ExecutorKind) -> (World, Checkpoint) {
    let world = World::start(&office(mood, 1), executor).unwrap();
    let left = world.add("left", Rigid::ball(0.05).at([0.3, 0.0, 0.1])).unwrap();
    world.advance(ms(60));
    let mark = world.checkpoint().unwrap();
    world.add("came", Rigid::ball(0.05).at([0.0, 0.1, 0.5])).unwrap();
    world.remove(left).unwrap();
    world.advance(ms(60));
    (world, mark)
}

#[test]
fn a_way_back_that_is_refused_changes_nothing() {
    for executor in EXECUTORS {
        let mood = Arc::new(AtomicU8::new(READS));
        let (world, mark) = busy(&mood, executor);
        let mut events = world.events(EventFilter::all());
        let other = World::start(&office(&mood, 2), executor).unwrap().checkpoint().unwrap();
        let (before, hash, count) = (world.checkpoint().unwrap(), world.hash(), world.agents().len());
        for (next, mark, why) in [
            (ERRS_ONCE, &mark, "a clerk that is on strike does not save its state"),
            (PANICS_ONCE, &mark, "half way"),
            (READS, &other, "in the saved state"),
        ] {
            mood.store(next, Relaxed);
            let refused = world.restore(mark).unwrap_err();
            assert!(matches!(&refused, CheckpointError::Unreadable(_)), "{executor:?}: {refused}");
            assert!(refused.to_string().contains(why), "{executor:?}: {refused}");
            let after = world.checkpoint().unwrap();
            assert_eq!(after.times(), before.times(), "{executor:?}, {why}");
            // in real time a checkpoint has readings of the clock
            assert!(executor != ExecutorKind::Lockstep || after == before, "{why}");
            assert_eq!((world.hash(), world.agents().len()), (hash, count), "{executor:?}, {why}");
            assert!(world.object("came").is_ok() && world.object("left").is_err(), "{executor:?}, {why}");
        }
        assert_eq!(events.drain().count(), 0, "{executor:?}");
        // it goes on as if nobody had asked, and back
        world.advance(ms(100));
        if executor == ExecutorKind::Lockstep {
            let (twin, _) = busy(&mood, executor);
            twin.advance(ms(100));
            assert_eq!(world.hash(), twin.hash());
        }
        assert!(world.agents().iter().all(|agent| !matches!(agent.state(), AgentState::Parked(_))), "{executor:?}");
        world.restore(&mark).unwrap();
        assert!(world.object("left").is_ok() && world.object("came").is_err(), "{executor:?}");
        world.advance(ms(20));
    }
}

#[test]
fn a_way_back_that_is_refused_leaves_no_trace_in_a_recording() {
    for executor in EXECUTORS {
        let mood = Arc::new(AtomicU8::new(READS));
        let world = World::start(&office(&mood, 1), executor).unwrap();
        world.advance(ms(60));
        let mark = world.checkpoint().unwrap();
        let path = std::env::temp_dir().join(format!("metachron-trace-{}-{executor:?}.bin", std::process::id()));
        mark.write(&path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        // a recording begins with the state of then, which is another one
        world.advance(ms(20));
        for mood_then in [ERRS_ONCE, READS] {
            let kept = recorded(&world);
            world.advance(ms(20));
            mood.store(mood_then, Relaxed);
            assert_eq!(world.restore(&mark).is_ok(), mood_then == READS, "{executor:?}");
            world.advance(ms(20));
            world.end_recording().unwrap();
            let hash = kept.read().unwrap().hash();
            let has_it = kept.0.lock().unwrap().windows(bytes.len()).any(|part| part == bytes);
            assert_eq!(has_it, mood_then == READS, "{executor:?}");
            let again = World::replay(&office(&mood, 1), kept.read().unwrap(), None).unwrap();
            while again.replayed().unwrap().unwrap() < 1.0 {
                again.advance(ms(10));
            }
            assert_eq!(Some(again.hash()), hash, "{executor:?}");
        }
    }
}

#[test]
fn a_model_that_does_not_read_what_it_has_written_is_parked_alone() {
    for executor in EXECUTORS {
        let mood = Arc::new(AtomicU8::new(READS));
        let (world, mark) = busy(&mood, executor);
        mood.store(NEVER_READS, Relaxed);
        assert!(matches!(world.restore(&mark), Err(CheckpointError::Unreadable(_))), "{executor:?}");
        world.advance(ms(100));
        for agent in world.agents() {
            let is_parked = matches!(agent.state(), AgentState::Parked(_));
            assert_eq!(is_parked, agent.name() == "clerk", "{executor:?}: {} is {:?}", agent.name(), agent.state());
        }
        let ball = world.latest(world.object("ball").unwrap()).unwrap();
        assert!(ball.time.as_secs_f64() > 0.215, "{executor:?}: {:?}", ball.time);
    }
}

/// A ball that falls onto the floor, and a stone that lies on it.
fn falling(executor: ExecutorKind) -> World {
    let scene = Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("ball", Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.15]).restitution(0.0))
        .add("stone", Rigid::cuboid([0.1; 3]).mass_kg(1.0).at([1.0, 0.0, 0.05]))
        .build();
    World::start(&scene.unwrap(), executor).unwrap()
}

/// The ball's events: each time that the world went back, and the first event of its contact with the floor after that.
fn told(world: &World, events: Vec<Event>) -> Vec<&'static str> {
    let ball = world.object("ball").unwrap();
    let of_it = events.into_iter().filter(|event| event.object == ball);
    let named = |event: Event| match event.what {
        Happening::Rewound => Some("rewound"),
        Happening::Contact(contact) if contact.with == Touched::Fixed(0) => {
            Some(if contact.begins { "begins" } else { "ends" })
        }
        _ => None,
    };
    let mut all: Vec<_> = of_it.filter_map(named).collect();
    // it bounces
    let mut was_told = false;
    all.retain(|what| {
        let is_first = *what == "rewound" || !was_told;
        was_told = *what != "rewound";
        is_first
    });
    all
}

#[test]
fn a_contact_that_begins_again_after_a_way_back_begins() {
    for executor in EXECUTORS {
        for filter in [EventFilter::contacts(), EventFilter::all()] {
            let world = falling(executor);
            let mut events = world.events(filter);
            world.advance(ms(50));
            let in_the_air = world.checkpoint().unwrap();
            world.advance(ms(1000));
            let on_the_floor = world.checkpoint().unwrap();
            assert_eq!(told(&world, events.drain().collect()), ["begins"], "{executor:?}");
            world.restore(&in_the_air).unwrap();
            assert_eq!(told(&world, events.drain().collect()), ["rewound"], "{executor:?}");
            world.advance(ms(300));
            assert_eq!(told(&world, events.drain().collect()), ["begins"], "{executor:?}");
            // contacts of the state that the world goes back to begin there
            world.restore(&on_the_floor).unwrap();
            assert_eq!(told(&world, events.drain().collect()), ["rewound", "begins"], "{executor:?}");
            // read at once, in the order in which it happened, whatever the times
            world.restore(&in_the_air).unwrap();
            world.advance(ms(300));
            world.restore(&on_the_floor).unwrap();
            let all: Vec<_> = events.drain().collect();
            let stones = all.iter().filter(|event| event.what == Happening::Rewound).count();
            assert_eq!(stones, 4, "{executor:?}: of two objects, twice: {all:?}");
            assert_eq!(told(&world, all), ["rewound", "begins", "rewound", "begins"], "{executor:?}");
        }
    }
}

#[test]
fn who_was_away_or_slept_through_it_learns_that_the_world_went_back() {
    for executor in EXECUTORS {
        let world = falling(executor);
        let joined = world.add("ball 2", Rigid::ball(0.05).at([0.5, 0.0, 0.15]).restitution(0.0)).unwrap();
        let mut events = world.events(EventFilter::contacts());
        world.advance(ms(50));
        let mark = world.checkpoint().unwrap();
        world.advance(ms(300));
        world.remove(joined).unwrap();
        world.advance(ms(50));
        events.drain().for_each(drop);
        world.restore(&mark).unwrap();
        let of_it = |events: Vec<Event>| -> Vec<_> {
            events.into_iter().filter(|event| event.object == joined).map(|event| event.what).collect()
        };
        assert_eq!(of_it(events.drain().collect()), [Happening::Rewound], "{executor:?}: it was away");
        // so many that the first event is overwritten: each way back tells of itself and of the contact that is there
        world.advance(ms(1000));
        events.drain().for_each(drop);
        let mark = world.checkpoint().unwrap();
        (0..100).for_each(|_| world.restore(&mark).unwrap());
        let all = of_it(events.drain().collect());
        assert!(events.lost() > 0, "{executor:?}");
        assert_eq!(all.first(), Some(&Happening::Rewound), "{executor:?}: {all:?}");
        assert!(matches!(all.last(), Some(Happening::Contact(contact)) if contact.begins), "{executor:?}: {all:?}");
    }
}
