//! Objects join a world that runs and leave it: on every executor they collide with the objects there, and bodies that
//! lay on them fall.

use glam::DVec3;
use metachron_core::{Body, SimSpan, SimTime};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{
    Checkpoint, CheckpointError, EventFilter, Happening, Object, Pace, RecordError, Rigid, Scene, Soft, Touched, World,
    WorldError,
};

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

fn floor(executor: ExecutorKind) -> World {
    let stone = Rigid::cuboid([0.1; 3]).mass_kg(2.0).at([0.0, 0.0, 0.1]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("stone", stone).build().unwrap();
    World::start(&scene, executor).unwrap()
}

fn position(world: &World, object: Object) -> DVec3 {
    let Body::Rigid(state) = world.latest(object).unwrap().body else { panic!("a rigid body") };
    state.position
}

#[test]
fn what_joins_lies_on_what_is_there_and_what_leaves_lets_it_fall() {
    for executor in EXECUTORS {
        let world = floor(executor);
        world.advance(SimSpan::from_millis(800));
        let mut events = world.events(EventFilter::all());
        let ball = world.add("ball", Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.3]).restitution(0.0)).unwrap();
        world.advance(SimSpan::from_millis(1200));
        let stone = world.object("stone").unwrap();
        assert!((position(&world, ball).z - 0.25).abs() < 1e-3, "{executor:?}: {}", position(&world, ball));
        let contacts = world.contacts(ball).unwrap();
        assert!(contacts.iter().any(|contact| contact.with == Touched::Object(stone)), "{executor:?}: {contacts:?}");
        let weight_n: f64 = contacts.iter().map(|contact| contact.force_n.z).sum();
        assert!((weight_n - 0.2 * 9.81).abs() < 0.02, "{executor:?}: {weight_n} N");
        world.remove(stone).unwrap();
        world.advance(SimSpan::from_millis(1200));
        assert!((position(&world, ball).z - 0.05).abs() < 1e-3, "{executor:?}: {}", position(&world, ball));
        assert!(matches!(world.latest(stone), Err(WorldError::Gone { .. })), "{executor:?}");
        let received: Vec<_> = events.drain().filter(|event| event.object == stone).map(|event| event.what).collect();
        assert!(received.contains(&Happening::Gone), "{executor:?}: {received:?}");
    }
}

#[test]
fn the_first_that_could_meet_another_meets_it() {
    for executor in EXECUTORS {
        let lone = Rigid::ball(0.05).mass_kg(1.0).at([0.0; 3]);
        let scene = Scene::builder().gravity([0.0; 3]).add("lone", lone).build().unwrap();
        let world = World::start(&scene, executor).unwrap();
        world.advance(SimSpan::from_millis(100));
        let shot = Rigid::ball(0.05).mass_kg(1.0).at([-1.0, 0.0, 0.0]).velocity_m_s([4.0, 0.0, 0.0]).restitution(1.0);
        let shot = world.add("shot", shot).unwrap();
        world.advance(SimSpan::from_millis(500));
        // equal masses, e = 1: the two exchange their velocities
        let lone = world.object("lone").unwrap();
        let x = [shot, lone].map(|object| position(&world, object).x);
        assert!((x[0] + 0.1).abs() < 0.02 && x[1] > 0.5, "{executor:?}: {x:?}");
    }
}

#[test]
fn names_are_free_again_and_numbers_are_not() {
    let world = floor(ExecutorKind::Lockstep);
    let stone = world.object("stone").unwrap();
    assert!(matches!(world.add("stone", Rigid::ball(0.1)), Err(WorldError::SameName { .. })));
    assert!(world.add("bad", Rigid::ball(-1.0)).is_err());
    world.remove(stone).unwrap();
    world.advance(SimSpan::from_millis(50));
    let again = world.add("stone", Rigid::ball(0.1).at([0.0, 0.0, 2.0])).unwrap();
    assert_ne!(stone, again);
    assert!(matches!(world.remove(stone), Err(WorldError::Gone { .. })));
    world.stop();
    assert!(matches!(world.add("late", Rigid::ball(0.1)), Err(WorldError::Stopped)));
}

#[test]
fn of_those_that_join_at_once_under_one_name_one_does() {
    for executor in EXECUTORS {
        let world = floor(executor);
        for round in 0..20 {
            let (name, gate) = (format!("twin {round}"), std::sync::Barrier::new(4));
            let join = || {
                gate.wait();
                world.add(name.as_str(), Rigid::ball(0.01).at([f64::from(round), 1.0, 1.0])).is_ok()
            };
            let joined = std::thread::scope(|scope| {
                let all = [(); 4].map(|()| scope.spawn(join));
                all.map(|one| one.join().unwrap()).into_iter().filter(|joined| *joined).count()
            });
            assert_eq!(joined, 1, "{executor:?}");
        }
    }
}

#[test]
fn a_message_names_those_that_are_there() {
    let world = floor(ExecutorKind::Lockstep);
    assert!(world.add("", Rigid::ball(0.1)).is_err_and(|error| error.to_string().contains("an empty name")));
    let frame = world.frame();
    let late = world.add("late", Rigid::ball(0.1).at([2.0, 0.0, 0.1])).unwrap();
    let error = frame.state(late).unwrap_err();
    assert!(matches!(&error, WorldError::Later { name } if name == "late"), "{error}");
    world.remove(world.object("stone").unwrap()).unwrap();
    let again = world.add("stone", Rigid::ball(0.1)).unwrap_err().to_string();
    assert!(again.contains("one that was removed leaves at its next step"), "{again}");
    world.advance(ms(10));
    let known = |world: &World| world.object("stone").unwrap_err().to_string();
    assert!(known(&world).ends_with("its moving objects are late"), "{}", known(&world));
    for number in 0..22 {
        world.add(format!("b{number}"), Rigid::ball(0.01).at([f64::from(number), 1.0, 1.0])).unwrap();
    }
    assert!(known(&world).ends_with("b18 and 3 more"), "{}", known(&world));
}

#[test]
fn hundreds_come_and_go() {
    for executor in EXECUTORS {
        let world = floor(executor);
        for round in 0..20 {
            let fresh: Vec<_> = (0..10)
                .map(|k| {
                    let at = [0.3 * f64::from(k), 1.0, 0.5 + 0.1 * f64::from(round % 3)];
                    world.add(format!("{round}-{k}"), Rigid::ball(0.05).at(at)).unwrap()
                })
                .collect();
            world.advance(SimSpan::from_millis(20));
            fresh.into_iter().for_each(|object| world.remove(object).unwrap());
        }
        world.advance(SimSpan::from_millis(100));
        let stone = world.object("stone").unwrap();
        assert!((position(&world, stone).z - 0.1).abs() < 1e-3, "{executor:?}");
        assert_eq!(world.agents().len(), 201);
        let left = world.agents().iter().filter(|agent| agent.state() != metachron_runtime::AgentState::Gone).count();
        assert_eq!(left, 1, "{executor:?}");
        // a checkpoint looks for the parts of agents that have left, and nobody keeps them
        world.checkpoint().unwrap();
        assert_eq!(world.joined(metachron_core::AgentId(7)).unwrap().spec.model(), "synthetic", "{executor:?}");
    }
}

/// Bytes that a world in lockstep keeps of each of so many objects that have joined it and left, made by `join` from their places in the row.
fn kept_bytes(count: u32, join: impl Fn(&World, u32) -> Object) -> i64 {
    let scene = Scene::builder().gravity([0.0; 3]).add("first", Rigid::ball(0.05).mass_kg(1.0)).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let kept = |numbers: std::ops::Range<u32>| {
        let measured = allocation_counter::measure(|| {
            let mut crowd = std::collections::VecDeque::new();
            for number in numbers {
                crowd.push_back(join(&world, number));
                if crowd.len() > 3 {
                    world.remove(crowd.pop_front().unwrap()).unwrap();
                }
                world.advance(ms(4));
            }
            crowd.into_iter().for_each(|object| world.remove(object).unwrap());
            world.advance(ms(20));
        });
        measured.bytes_current
    };
    // allocations that are made once
    kept(0..200);
    kept(200..count) / i64::from(count - 200)
}

#[test]
fn of_what_has_left_nothing_is_kept_but_its_number_and_its_name() {
    let at = |k: u32| [0.04 * f64::from(k % 4), 0.12 + 0.03 * f64::from(k % 3), 0.0];
    let balls = kept_bytes(2000, |world, k| world.add(format!("{k}"), Rigid::ball(0.05).at(at(k))).unwrap());
    let crates = kept_bytes(600, |world, k| world.add(format!("{k}"), Rigid::cuboid([0.1; 3]).at(at(k))).unwrap());
    let jelly = |k: u32| Soft::cuboid([0.08; 3], [1, 1, 1]).young_pa(1e4).at([0.0, 0.0, 3.0 * f64::from(k % 4)]);
    let jellies = kept_bytes(600, |world, k| world.add(format!("{k}"), jelly(k)).unwrap());
    let tube = || metachron_world::Tube::along(&[[5.0, 0.0, 0.0], [5.2, 0.0, 0.0]]).radius_m(0.01).segments(4);
    let tubes = kept_bytes(600, |world, k| world.add(format!("{k}"), tube()).unwrap());
    // a state alone has a thousand bytes
    let all = [balls, crates, jellies, tubes];
    assert!(all.iter().all(|kept| *kept < 600), "{all:?}");
}

#[test]
fn a_world_goes_back_to_where_it_was_with_what_acted_on_it() {
    let world = floor(ExecutorKind::Lockstep);
    let ball = world.add("ball", Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.4])).unwrap();
    let up = metachron_world::Command::force(metachron_core::Anchor::Local(DVec3::ZERO), DVec3::Z * 1.5);
    world.command(ball, up.for_ms(400)).unwrap();
    world.advance(SimSpan::from_millis(150));
    let mark = world.checkpoint().unwrap();
    let ends = [0, 1].map(|_| {
        world.advance(SimSpan::from_millis(500));
        let end = (world.hash(), position(&world, ball));
        world.restore(&mark).unwrap();
        end
    });
    assert_eq!(ends[0], ends[1], "the force ends at the same time again");
}

#[test]
fn a_world_goes_back_to_those_that_were_in_it() {
    for executor in EXECUTORS {
        let world = floor(executor);
        if executor != ExecutorKind::Lockstep {
            world.set_pace(Pace::Factor(4.0)).unwrap();
        }
        let stone = world.object("stone").unwrap();
        let ball = world.add("ball", Rigid::ball(0.05).mass_kg(0.2).at([0.0, 0.0, 0.3]).restitution(0.0)).unwrap();
        world.advance(ms(200));
        let (mark, hash) = (world.checkpoint().unwrap(), world.hash());
        world.advance(ms(100));
        [ball, stone].into_iter().for_each(|object| world.remove(object).unwrap());
        world.advance(ms(50));
        let newer = world.add("ball", Rigid::cuboid([0.02; 3]).at([0.0, 0.0, 0.5])).unwrap();
        let mut events = world.events(EventFilter::all());
        world.advance(ms(50));
        for _ in 0..2 {
            world.restore(&mark).unwrap();
            assert_eq!((world.object("ball").unwrap(), world.object("stone").unwrap()), (ball, stone), "{executor:?}");
            assert_eq!(world.hash(), hash, "{executor:?}");
            assert!(matches!(world.latest(newer), Err(WorldError::Gone { .. })), "{executor:?}");
        }
        let received: Vec<_> = events.drain().filter(|event| event.what == Happening::Gone).collect();
        assert!(received.iter().map(|event| event.object).eq([newer]), "{executor:?}: {received:?}");
        world.advance(ms(1200));
        assert!((position(&world, ball).z - 0.25).abs() < 1e-3, "{executor:?}: it lies on the stone again");
        world.remove(ball).unwrap();
        world.advance(ms(50));
        world.add("ball", Rigid::ball(0.05).at([1.0, 0.0, 0.5])).unwrap();
    }
}

/// A body on a hinge, a tube across it and a stone.
fn hung() -> Scene {
    let hinge = metachron_models::rigid::JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor: None };
    Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("arm", Rigid::capsule(0.02, 0.1).at([0.1, 0.0, 0.5]))
        .add("tube", metachron_world::Tube::along(&[[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]).radius_m(0.01).segments(4))
        .add("stone", Rigid::cuboid([0.1; 3]).at([0.0, 0.0, 0.1]))
        .joint("arm", None, hinge, [0.0, 0.0, 0.5])
        .build()
        .unwrap()
}

/// A newcomer joins after a checkpoint, and the world goes on: its hash and time.
fn go_on(world: &World, newcomer: &str) -> (u64, SimTime) {
    world.advance(ms(60));
    world.add(newcomer, Rigid::ball(0.03).at([0.05, 0.0, 0.6])).unwrap();
    world.advance(ms(200));
    (world.hash(), world.time())
}

#[test]
fn what_follows_a_checkpoint_of_others_is_the_same_to_the_bit() {
    let world = World::start(&hung(), ExecutorKind::Lockstep).unwrap();
    let [arm, tube] = world.objects(["arm", "tube"]).unwrap();
    world.advance(ms(40));
    let cloth = Soft::sheet([0.2; 2], 0.002, [3, 3]).at([0.0, 0.0, 0.45]).young_pa(1e5);
    let cloth = world.add("cloth", cloth).unwrap();
    world.add("brief", Rigid::ball(0.02).at([0.3, 0.0, 0.4])).unwrap();
    world.advance(ms(40));
    world.remove(world.object("brief").unwrap()).unwrap();
    world.advance(ms(40));
    let early = world.checkpoint().unwrap();
    let first = go_on(&world, "one");
    [arm, tube, cloth].into_iter().for_each(|object| world.remove(object).unwrap());
    world.advance(ms(40));
    let late = world.checkpoint().unwrap();
    let second = go_on(&world, "two");
    for _ in 0..2 {
        world.restore(&early).unwrap();
        assert!([arm, tube, cloth].iter().all(|object| world.latest(*object).is_ok()));
        assert_eq!(go_on(&world, "one"), first);
        world.restore(&late).unwrap();
        assert!([arm, tube, cloth].iter().all(|object| world.latest(*object).is_err()));
        assert_eq!(go_on(&world, "two"), second);
    }
    // in another world, from the bytes of a file
    for (mark, end, are_there) in [(&early, first, true), (&late, second, false)] {
        let path = std::env::temp_dir().join(format!("metachron-joined-{}.mark", std::process::id()));
        mark.write(&path).unwrap();
        let read = Checkpoint::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(&read, mark);
        let opened = World::open(&hung(), ExecutorKind::Lockstep, &read).unwrap();
        assert_eq!(opened.checkpoint().unwrap(), read);
        assert_eq!(opened.object("cloth").is_ok(), are_there);
        assert_eq!(go_on(&opened, "two"), end);
        [ExecutorKind::Threads, ExecutorKind::Pool].into_iter().for_each(|executor| {
            let opened = World::open(&hung(), executor, &read).unwrap();
            opened.advance(ms(20));
            opened.add("late", Rigid::ball(0.03).at([0.05, 0.0, 0.6])).unwrap();
            assert_eq!(opened.object("arm").is_ok(), are_there, "{executor:?}");
        });
    }
}

#[test]
fn an_agent_of_ones_own_comes_back_from_memory_and_from_no_file() {
    let own = |_| {
        let spec = RigidSpec::free(Solid::Ball { radius_m: 0.05 }, DVec3::new(0.5, 0.0, 0.5), 1.0);
        Box::new(RigidBody::new(spec).unwrap()) as Box<dyn metachron_contact::Agent>
    };
    let world = floor(ExecutorKind::Lockstep);
    let mill = world.add("mill", metachron_world::Custom::made_by(own)).unwrap();
    world.advance(ms(50));
    let (mark, hash) = (world.checkpoint().unwrap(), world.hash());
    let path = std::env::temp_dir().join(format!("metachron-own-{}.mark", std::process::id()));
    mark.write(&path).unwrap();
    let read = Checkpoint::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    world.advance(ms(50));
    // it is there
    world.restore(&read).unwrap();
    assert_eq!(world.hash(), hash);
    world.remove(mill).unwrap();
    world.advance(ms(50));
    let gone = world.hash();
    let refused = world.restore(&read).unwrap_err();
    assert!(matches!(&refused, CheckpointError::Own { name } if name == "mill"), "{refused}");
    assert_eq!(world.hash(), gone);
    world.record_to(Box::new(std::io::sink()), None).unwrap();
    let refused = world.restore(&mark).unwrap_err();
    assert!(matches!(&refused, CheckpointError::Own { .. }), "no recording has it: {refused}");
    world.end_recording().unwrap();
    world.restore(&mark).unwrap();
    assert_eq!((world.hash(), world.object("mill").unwrap()), (hash, mill));
    let stone = Rigid::cuboid([0.1; 3]).mass_kg(2.0).at([0.0, 0.0, 0.1]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("stone", stone).build().unwrap();
    assert_eq!(World::open(&scene, ExecutorKind::Lockstep, &mark).unwrap().hash(), hash);
    assert!(matches!(World::open(&scene, ExecutorKind::Lockstep, &read), Err(CheckpointError::Own { .. })));
    let recorded = world.record_to(Box::new(std::io::sink()), None);
    assert!(matches!(recorded, Err(RecordError::Begun(CheckpointError::Own { .. }))));
}

#[test]
fn a_checkpoint_of_another_world_whose_numbers_are_taken_is_refused() {
    let [world, other] = [0, 1].map(|_| floor(ExecutorKind::Lockstep));
    world.add("ball", Rigid::ball(0.05).at([0.0, 0.0, 0.5])).unwrap();
    other.add("ball", Rigid::ball(0.07).at([0.0, 0.0, 0.5])).unwrap();
    let (mark, hash) = (other.checkpoint().unwrap(), world.hash());
    let error = world.restore(&mark).unwrap_err().to_string();
    assert!(error.contains("agent 1 is \"ball\"") && world.hash() == hash, "{error}");
}

#[test]
fn one_that_has_failed_can_be_removed() {
    use metachron_world::{Command, Custom};
    for executor in EXECUTORS {
        let scene = Scene::builder().add("broken", Custom::made_by(|_| Box::new(Broken))).build().unwrap();
        let world = World::start(&scene, executor).unwrap();
        world.advance(SimSpan::from_millis(100));
        let broken = world.object("broken").unwrap();
        assert!(matches!(world.agents()[0].state(), metachron_runtime::AgentState::Parked(_)), "{executor:?}");
        world.command(broken, Command::wake()).unwrap();
        world.remove(broken).unwrap();
        assert!(matches!(world.latest(broken), Err(WorldError::Gone { .. })), "{executor:?}");
        world.add("broken", Rigid::ball(0.1)).unwrap();
    }
}

/// An agent whose first step fails.
struct Broken;

impl metachron_contact::Agent for Broken {
    fn model(&self) -> &'static str {
        "broken"
    }

    fn stepping(&mut self) -> metachron_contact::Stepping<'_> {
        metachron_contact::Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut metachron_core::Snapshot) {
        into.body = Body::Nothing;
    }
}

impl metachron_contact::OwnSteps for Broken {
    fn step(
        &mut self,
        dt: SimSpan,
        _context: &metachron_contact::StepContext<'_>,
    ) -> Result<metachron_core::StepReport, metachron_core::StepError> {
        let what = "it always does".to_owned();
        Err(metachron_core::StepError::Diverged { model: "broken", dt_s: dt.as_secs_f64(), what })
    }
}
