//! A recording of a world on threads or in a pool repeats it on one thread, to the bit.

mod kept;

use glam::{DQuat, DVec3};
use kept::recorded;
use metachron_contact::joint::JointKind;
use metachron_contact::{Agent, OwnSteps, StepContext, Stepping};
use metachron_core::{Anchor, SimSpan, SimTime, Snapshot, StepError, StepReport};
use metachron_geometry::Solid;
use metachron_runtime::{Demand, Governor, TimelineCommand, TurnMeasure};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{
    Command, Custom, EventFilter, Happening, Member, Pace, Recording, Rigid, Scene, SolveBudget, Tube, World,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::thread;
use std::time::Duration;

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

/// Plays all of a recording.
fn replayed(scene: &Scene, recording: Recording) -> World {
    let world = World::replay(scene, recording, None).unwrap();
    while world.replayed().unwrap().unwrap() < 1.0 {
        world.advance(ms(10));
    }
    world
}

/// A heap that forms and parts, a hinged arm, a tube, and bodies that come to rest.
fn scene() -> Scene {
    let hinge = JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor: None };
    let ball = |x: f64, speed: f64, hz: f64| {
        Rigid::ball(0.05).mass_kg(0.2).at([x, 0.0, 0.2]).velocity_m_s([speed, 0.0, 0.0]).rate_hz(hz)
    };
    let tube = Tube::along(&[[-0.2, 0.1, 0.12], [0.2, 0.1, 0.12]]).radius_m(0.01).segments(6);
    Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("left", ball(-0.3, 1.0, 240.0))
        .add("right", ball(0.3, -0.7, 170.0))
        .add("arm", Rigid::capsule(0.02, 0.1).at([0.0, -0.3, 0.3]))
        .joint("arm", None, hinge, [0.0, -0.3, 0.4])
        .add("tube", tube)
        .add("still", Rigid::cuboid([0.05; 3]).at([1.0, 0.0, 0.05]))
        .build()
        .unwrap()
}

const EXECUTORS: [ExecutorKind; 2] = [ExecutorKind::Threads, ExecutorKind::Pool];

/// Lets everything happen that a recording in real time has, half of it from another thread.
fn play(world: &World) {
    let [left, arm, still, tube] = world.objects(["left", "arm", "still", "tube"]).unwrap();
    let hand = world.clone();
    let pushes = thread::spawn(move || {
        for at in 0..40 {
            let push = Command::force(Anchor::Local(DVec3::ZERO), DVec3::Y * f64::from(at % 3)).key(1).for_ms(30);
            hand.command(arm, push).unwrap();
            hand.command(left, Command::impulse(Anchor::Local(DVec3::ZERO), DVec3::X * 0.01)).unwrap();
            thread::sleep(Duration::from_millis(5));
        }
    });
    world.advance(ms(700));
    let fifth = world.add("fifth", Rigid::ball(0.04).mass_kg(0.1).at([0.0, 0.0, 0.5])).unwrap();
    world.command(tube, Command::velocity(DVec3::Z, DVec3::ZERO)).unwrap();
    world.advance(ms(600));
    world.remove(left).unwrap();
    world.command(still, Command::impulse(Anchor::Local(DVec3::ZERO), DVec3::Z * 0.3)).unwrap();
    world.advance(ms(500));
    world.command(fifth, Command::teleport(DVec3::new(0.1, 0.0, 0.4), DQuat::IDENTITY)).unwrap();
    world.advance(ms(300));
    pushes.join().unwrap();
}

#[test]
fn a_replay_of_turns_ends_with_the_same_bits_whatever_was_done() {
    for executor in EXECUTORS {
        let world = World::start(&scene(), executor).unwrap();
        let kept = recorded(&world);
        world.set_pace(Pace::Factor(4.0)).unwrap();
        let mut events = world.events(EventFilter::all());
        play(&world);
        let all: Vec<_> = events.drain().collect();
        let is_told = |which: fn(&Happening) -> bool| all.iter().any(|event| which(&event.what));
        assert!(is_told(|what| matches!(what, Happening::Contact(contact) if contact.begins)));
        assert!(is_told(|what| matches!(what, Happening::Contact(contact) if !contact.begins)));
        assert!(is_told(|what| matches!(what, Happening::Joined(_))) && is_told(|what| *what == Happening::Left));
        assert!(is_told(|what| *what == Happening::Rests) && is_told(|what| *what == Happening::Wakes));
        assert!(world.end_recording().unwrap());
        let recording = kept.read().unwrap();
        assert!(recording.is_complete() && recording.is_real_time());
        let hash = recording.hash();
        let again = replayed(&scene(), recording);
        assert_eq!(Some(again.hash()), hash, "{executor:?}");
    }
}

#[test]
fn a_recording_of_turns_that_begins_later_and_goes_back_is_repeated() {
    for executor in EXECUTORS {
        let world = World::start(&scene(), executor).unwrap();
        world.set_pace(Pace::Free).unwrap();
        world.advance(ms(400));
        let crate_ = world.add("crate", Rigid::cuboid([0.02; 3]).at([0.05, 0.0, 0.4])).unwrap();
        world.advance(ms(100));
        let mark = world.checkpoint().unwrap();
        [crate_, world.object("left").unwrap()].into_iter().for_each(|object| world.remove(object).unwrap());
        world.advance(ms(100));
        world.add("left", Rigid::ball(0.03).at([0.0, 0.0, 0.5])).unwrap();
        world.advance(ms(100));
        let kept = recorded(&world);
        world.advance(ms(200));
        world.restore(&mark).unwrap();
        world.advance(ms(200));
        world.stop();
        let recording = kept.read().unwrap();
        let hash = recording.hash();
        assert_eq!(Some(replayed(&scene(), recording).hash()), hash, "{executor:?}");
    }
}

#[test]
fn a_recording_of_turns_that_was_cut_short_is_repeated_to_its_last_whole_chunk() {
    let world = World::start(&scene(), ExecutorKind::Threads).unwrap();
    let kept = recorded(&world);
    world.set_pace(Pace::Factor(4.0)).unwrap();
    for _ in 0..40 {
        world.advance(ms(100));
    }
    world.end_recording().unwrap();
    let whole = kept.0.lock().unwrap().clone();
    let times: Vec<_> = [3, 2, 1]
        .map(|share| whole.len() / share - 1)
        .into_iter()
        .map(|length| {
            let recording = Recording::from_bytes(&whole[..length]).unwrap();
            assert!(!recording.is_complete() && recording.lost_bytes() > 0);
            replayed(&scene(), recording).time()
        })
        .collect();
    assert!(times.is_sorted() && times[2] > times[0], "{times:?}");
}

#[test]
fn a_replay_of_turns_stops_where_it_is_told_to_and_is_of_its_scene_alone() {
    let world = World::start(&scene(), ExecutorKind::Pool).unwrap();
    let kept = recorded(&world);
    world.set_pace(Pace::Free).unwrap();
    world.advance(ms(300));
    world.end_recording().unwrap();
    let until = SimTime::ZERO + ms(120);
    let again = World::replay(&scene(), kept.read().unwrap(), Some(until)).unwrap();
    again.advance(ms(60_000));
    assert!(again.replayed() == Some(Ok(1.0)) && again.time() >= until && again.time() < until + ms(30));
    let other = Scene::builder().add("ball", Rigid::ball(0.05)).build().unwrap();
    let error = World::replay(&other, kept.read().unwrap(), None).unwrap_err().to_string();
    assert!(error.contains("moving objects") && error.contains("expected 1"), "{error}");
}

/// Asks for another step after the time that its turns take, which no replay has.
struct Moody(u64);

impl Governor for Moody {
    fn after_step(&mut self, turn: &TurnMeasure) -> Demand {
        self.0 += 1;
        let dt = self.0.is_multiple_of(3).then(|| SimSpan::from_nanos(3_000_000 + (turn.work_s * 1e9) as u64 % 4096));
        Demand { dt, resolution: None }
    }
}

#[test]
fn a_replay_of_turns_takes_what_governors_answered_from_the_recording() {
    let mut scene = scene();
    scene.agents.iter_mut().for_each(|member| member.pace.dt_range = (ms(1), ms(9)));
    let moody = &mut |_: &Member| Some(Box::new(Moody(0)) as Box<dyn Governor>);
    let world = World::start_governed(&scene, ExecutorKind::Threads, moody).unwrap();
    let kept = recorded(&world);
    world.set_pace(Pace::Factor(4.0)).unwrap();
    world.advance(ms(1000));
    world.end_recording().unwrap();
    let (recording, others) = (kept.read().unwrap(), &mut |_: &Member| Some(Box::new(Moody(7)) as Box<dyn Governor>));
    let hash = recording.hash();
    let again = World::replay_governed(&scene, others, recording, None).unwrap();
    again.advance(ms(60_000));
    assert_eq!((again.replayed(), Some(again.hash())), (Some(Ok(1.0)), hash));
}

/// Where the steps of an agent wait.
#[derive(Debug, Default)]
struct Gate {
    stepping: AtomicBool,
    open: AtomicBool,
}

/// An agent whose steps end once its gate is open.
struct Gated {
    gate: Arc<Gate>,
}

impl Agent for Gated {
    fn model(&self) -> &'static str {
        "gated"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, _into: &mut Snapshot) {}
}

impl OwnSteps for Gated {
    fn step(&mut self, _dt: SimSpan, _context: &StepContext<'_>) -> Result<StepReport, StepError> {
        self.gate.stepping.store(true, SeqCst);
        while !self.gate.open.load(SeqCst) {
            thread::sleep(Duration::from_millis(1));
        }
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: false })
    }
}

#[test]
fn a_recording_that_ends_with_its_world_has_the_steps_that_were_in_progress() {
    for executor in EXECUTORS {
        let gate = Arc::<Gate>::default();
        let gated = Arc::clone(&gate);
        let custom = Custom::made_by(move |_| Box::new(Gated { gate: Arc::clone(&gated) })).rate_hz(10.0);
        let scene = Scene::builder().add("gated", custom).build().unwrap();
        let world = World::start(&scene, executor).unwrap();
        let kept = recorded(&world);
        world.drive(TimelineCommand::Run);
        while !gate.stepping.load(SeqCst) {
            thread::yield_now();
        }
        world.drive(TimelineCommand::Pause);
        let ends = world.clone();
        let stopped = thread::spawn(move || ends.stop());
        // long enough for a recording that does not wait for the step to end without it
        thread::sleep(Duration::from_millis(50));
        gate.open.store(true, SeqCst);
        let steps = stopped.join().unwrap()[0].steps;
        assert!(world.end_recording().unwrap(), "{executor:?}: it says once that there was a recording");
        assert!(!world.end_recording().unwrap(), "{executor:?}");
        let recording = kept.read().unwrap();
        assert_eq!((steps, recording.hash()), (1, Some(world.hash())), "{executor:?}");
        assert_eq!(replayed(&scene, recording).hash(), world.hash(), "{executor:?}");
    }
}

/// Boxes that fall on each other, one cluster from the start, with so many steps for each solve in any case.
fn pile(least_steps: u32) -> Scene {
    let empty = Scene::builder().fixed("floor", Solid::Plane).contact_budget(SolveBudget::Timed { least_steps });
    let places = (0..27_u32).map(|k| [k % 3, k / 3 % 3, k / 9].map(f64::from));
    let scene = places.fold(empty, |scene, [x, y, z]| {
        let at = [0.101 * x + 0.02 * z, 0.101 * y, 0.05 + 0.103 * z];
        scene.add(format!("{x} {y} {z}"), Rigid::cuboid([0.05; 3]).at(at).rate_hz(500.0))
    });
    scene.build().unwrap()
}

#[test]
fn a_replay_takes_from_the_recording_how_far_solves_went() {
    for executor in EXECUTORS {
        let world = World::start(&pile(1), executor).unwrap();
        let kept = recorded(&world);
        world.advance(ms(500));
        assert!(world.end_recording().unwrap());
        let solves = world.agents()[0].latest().cluster.and_then(|cluster| cluster.solves).unwrap();
        assert!(solves.unfinished > 0 && solves.contacts > 50, "the budget ends some: {solves:?}");
        let recording = kept.read().unwrap();
        let hash = recording.hash();
        // a replay takes other times than the run: by these its solves would end elsewhere
        assert_eq!(Some(replayed(&pile(1), recording).hash()), hash, "{executor:?}");
    }
}
