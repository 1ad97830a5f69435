//! Objects join a world that runs and leave it: on every executor they meet what is there, and what lay on them falls.

use glam::DVec3;
use metachron_core::{Body, SimSpan};
use metachron_geometry::Solid;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{EventFilter, Happening, Object, Rigid, Scene, Touched, World, WorldError};

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

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
        let told: Vec<_> = events.drain().filter(|event| event.object == stone).map(|event| event.what).collect();
        assert!(told.contains(&Happening::Gone), "{executor:?}: {told:?}");
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
    }
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
    world.remove(ball).unwrap();
    world.advance(SimSpan::from_millis(50));
    assert!(world.restore(&mark).unwrap_err().to_string().contains("left"));
    let without = world.checkpoint().unwrap();
    world.advance(SimSpan::from_millis(50));
    world.restore(&without).unwrap();
}

#[test]
fn one_that_has_failed_can_be_removed() {
    use metachron_world::{Command, Custom};
    for executor in EXECUTORS {
        let scene = Scene::builder().add("broken", Custom::new(|_| Box::new(Broken))).build().unwrap();
        let world = World::start(&scene, executor).unwrap();
        world.advance(SimSpan::from_millis(100));
        let broken = world.object("broken").unwrap();
        assert!(matches!(world.agents()[0].state(), metachron_runtime::AgentState::Parked(_)), "{executor:?}");
        world.command(broken, Command::Wake).unwrap();
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

    fn step(
        &mut self,
        dt: SimSpan,
        _context: &metachron_contact::StepContext<'_>,
    ) -> Result<metachron_core::StepReport, metachron_core::StepError> {
        let what = "it always does".to_owned();
        Err(metachron_core::StepError::Diverged { model: "broken", dt_s: dt.as_secs_f64(), what })
    }

    fn write_snapshot(&self, into: &mut metachron_core::Snapshot) {
        into.body = Body::Nothing;
    }
}
