//! Worlds in real time: how much their objects live, at which pace, and cuts of them that go on anywhere.

use glam::DVec3;
use metachron_core::{Anchor, Body, SimSpan, SimTime};
use metachron_geometry::Solid;
use metachron_runtime::{AgentState, TimelineCommand};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Checkpoint, Command, Pace, Rigid, Scene, Tube, World, WorldError};

const REAL: [ExecutorKind; 2] = [ExecutorKind::Threads, ExecutorKind::Pool];

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

/// Balls that meet nothing, of different rates.
fn apart() -> Scene {
    let ball =
        |x: f64, rate_hz: f64| Rigid::ball(0.05).at([x, 0.0, 0.0]).velocity_m_s([0.0, 1.0, 0.0]).rate_hz(rate_hz);
    let scene = Scene::builder().gravity([0.0; 3]).add("slow", ball(0.0, 50.0)).add("fast", ball(5.0, 1000.0));
    scene.add("odd", ball(9.0, 300.0)).build().unwrap()
}

/// Balls that fall on a tray of a tube and on each other.
fn touching() -> Scene {
    let ball = |x: f64, z: f64| Rigid::ball(0.03).mass_kg(0.1).at([x, 0.0, z]);
    let tube = Tube::along(&[[-0.2, 0.0, 0.06], [0.2, 0.0, 0.06]]).radius_m(0.01).segments(6).rate_hz(120.0);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("left", ball(-0.02, 0.15)).add("tube", tube);
    scene.add("right", ball(0.03, 0.22).rate_hz(400.0)).build().unwrap()
}

fn free(scene: &Scene, executor: ExecutorKind) -> World {
    let world = World::start(scene, executor).unwrap();
    world.set_pace(Pace::Free).unwrap();
    world
}

#[test]
fn as_fast_as_it_can_each_object_makes_its_own_number_of_steps_and_drops_none() {
    for executor in REAL {
        let world = free(&apart(), executor);
        world.advance(ms(3000));
        world.advance(ms(1000));
        let stats: Vec<_> = world.agents().iter().map(|agent| agent.stats()).collect();
        let expected = [200, 4000, 1200];
        for (stats, expected) in stats.iter().zip(expected) {
            // its step is a whole number of nanoseconds
            assert!(stats.steps.abs_diff(expected) <= 1, "{}: {} steps", stats.name, stats.steps);
            assert_eq!((stats.dropped, stats.misses), (SimSpan::ZERO, 0), "{}", stats.name);
        }
        assert_eq!(world.time(), SimTime::ZERO + ms(4000));
    }
}

#[test]
fn after_an_advance_a_world_stands_still_where_it_was_to_come_to() {
    for executor in REAL {
        let world = World::start(&apart(), executor).unwrap();
        world.set_pace(Pace::Factor(4.0)).unwrap();
        world.advance(ms(200));
        let (time, hash) = (world.time(), world.hash());
        assert_eq!(time, SimTime::ZERO + ms(200));
        world.wait_until(world.now() + std::time::Duration::from_millis(30));
        assert_eq!((world.time(), world.hash()), (time, hash), "it stands still");
        for agent in world.agents().iter() {
            let ahead_s = agent.latest().moment().secs_after(time);
            assert!((0.0..0.02).contains(&ahead_s), "{}: {ahead_s} s", agent.name());
        }
        let refused = world.set_pace(Pace::Factor(0.0));
        assert!(matches!(refused, Err(WorldError::BadPace { factor: 0.0 })));
    }
}

#[test]
fn an_advance_ends_when_told_to_and_goes_on_where_the_world_is_put_back() {
    for executor in REAL {
        for pace in [Pace::RealTime, Pace::Free] {
            let world = World::start(&apart(), executor).unwrap();
            world.set_pace(pace).unwrap();
            let mark = world.checkpoint().unwrap();
            let begun = world.time();
            assert!(!world.advance_while(ms(1_000_000_000), || world.time() <= begun + ms(20)));
            let stands = world.time();
            assert!(stands > begun + ms(20) && stands < begun + ms(500_000_000));
            world.wait_until(world.now() + std::time::Duration::from_millis(10));
            assert_eq!(world.time(), stands, "it stands still");
            // one thread puts it back while another waits, which lives the rest of its span
            let span = ms(if pace == Pace::Free { 4000 } else { 100 });
            std::thread::scope(|scope| {
                scope.spawn(|| world.advance(span));
                while world.time() <= stands {
                    std::thread::yield_now();
                }
                world.restore(&mark).unwrap();
            });
            assert!(world.time() <= begun + span, "{executor:?} {pace:?}: {:?}", world.time());
            assert!(world.advance_while(ms(10), || true));
        }
    }
    let world = World::start(&apart(), ExecutorKind::Lockstep).unwrap();
    assert!(!world.advance_while(ms(1000), || world.time() < SimTime::ZERO + ms(60)));
    assert_eq!(world.time(), SimTime::ZERO + ms(60));
}

#[test]
fn an_advance_is_so_much_life_on_every_executor_at_every_pace() {
    for executor in [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool] {
        let world = World::start(&apart(), executor).unwrap();
        world.set_pace(Pace::Factor(4.0)).unwrap();
        world.advance(ms(100));
        assert_eq!(world.time(), SimTime::ZERO + ms(100), "{executor:?}");
        for (drive, before_ms) in [(TimelineCommand::Pause, 0), (TimelineCommand::Step(ms(20)), 20)] {
            let from = world.time();
            world.drive(drive);
            world.advance(ms(40));
            assert_eq!(world.time(), from + ms(before_ms + 40), "{executor:?} {drive:?}");
        }
    }
}

#[test]
fn what_touches_comes_to_the_end_too() {
    for executor in REAL {
        let world = free(&touching(), executor);
        for step in 1..=8 {
            world.advance(ms(50));
            assert!(world.time() >= SimTime::ZERO + ms(50 * step));
        }
        let left = world.latest(world.object("left").unwrap()).unwrap();
        assert!(left.body.probe(0.0).unwrap().0.z > 0.0, "it has not fallen through");
        world.agents().iter().for_each(|agent| assert_eq!(agent.stats().dropped, SimSpan::ZERO, "{}", agent.name()));
    }
}

/// A cut in the middle of things, and how the world goes on from it in lockstep, twice.
fn goes_on(scene: &Scene, mark: &Checkpoint) -> [u64; 2] {
    [0, 1].map(|_| {
        let world = World::open(scene, ExecutorKind::Lockstep, mark).unwrap();
        assert_eq!(world.time(), mark.time());
        let before = world.hash();
        world.advance(ms(300));
        assert_eq!(world.time(), mark.time() + ms(300));
        assert_ne!(world.hash(), before, "it goes on");
        world.hash()
    })
}

#[test]
fn a_cut_of_a_world_in_real_time_goes_on_in_lockstep_to_the_same_bits() {
    let scene = touching();
    for executor in REAL {
        let world = free(&scene, executor);
        let left = world.object("left").unwrap();
        world.advance(ms(150));
        world.command(left, Command::force(Anchor::Local(DVec3::ZERO), DVec3::X).for_ms(100)).unwrap();
        let (hash, mark) = (world.hash(), world.checkpoint().unwrap());
        assert_eq!(world.hash(), hash, "a cut changes nothing");
        assert_eq!(mark.times().len(), 3);
        let [first, second] = goes_on(&scene, &mark);
        assert_eq!(first, second, "{executor:?}");
        world.advance(ms(100));
        assert_ne!(world.hash(), hash, "it goes on");
        world.restore(&mark).unwrap();
        assert_eq!((world.hash(), world.time()), (hash, mark.time()));
        world.advance(ms(100));
        assert_eq!(world.time(), mark.time() + ms(100));
        // and the other way round
        let lockstep = World::open(&scene, ExecutorKind::Lockstep, &mark).unwrap();
        lockstep.advance(ms(77));
        let world = World::open(&scene, executor, &lockstep.checkpoint().unwrap()).unwrap();
        world.set_pace(Pace::Free).unwrap();
        let (from, hash) = (world.time(), world.hash());
        assert_eq!(from, lockstep.time());
        world.wait_until(world.now() + std::time::Duration::from_millis(30));
        assert_eq!((world.time(), world.hash()), (from, hash), "it stands still until it is advanced");
        world.advance(ms(200));
        assert!((0.2..0.22).contains(&world.time().secs_after(from)), "{:?}", world.time());
        assert!(world.agents().iter().all(|agent| agent.latest().moment() >= world.time() || agent.latest().at_rest));
    }
}

#[test]
fn a_cut_is_as_large_after_a_minute_as_after_a_second() {
    let world = free(&apart(), ExecutorKind::Threads);
    world.advance(ms(1000));
    let early = world.checkpoint().unwrap().size_bytes();
    world.advance(ms(9000));
    let late = world.checkpoint().unwrap().size_bytes();
    // counters of more digits take a byte more each
    assert!(late.abs_diff(early) < 100, "{early} and {late} bytes");
}

/// A ball that rests on a column: where the column goes, it falls.
#[test]
fn what_is_woken_between_two_advances_lives_through_the_next_one_whole() {
    let column = Rigid::cuboid([0.2, 0.2, 0.5]).mass_kg(10.0).at([0.0, 0.0, 0.5]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("column", column);
    let scene = scene.add("ball", Rigid::ball(0.05).mass_kg(0.1).at([0.0, 0.0, 1.05]).rate_hz(1000.0)).build().unwrap();
    // woken as the next one begins, and well before
    for (executor, wait_ms) in REAL.into_iter().flat_map(|executor| [0, 20].map(|wait_ms| (executor, wait_ms))) {
        let world = free(&scene, executor);
        world.advance(ms(3000));
        let (ball, column) = (world.object("ball").unwrap(), world.object("column").unwrap());
        assert_eq!(world.agents().of(ball.id()).unwrap().state(), AgentState::Resting, "{executor:?}");
        world.remove(column).unwrap();
        world.wait_until(world.now() + std::time::Duration::from_millis(wait_ms));
        world.advance(ms(400));
        let Body::Rigid(state) = world.latest(ball).unwrap().body else { panic!("a rigid body") };
        let height_m = state.position.z;
        let fallen_m = 0.5 * 9.81 * 0.4 * 0.4;
        assert!((1.05 - height_m - fallen_m).abs() < 0.01, "{executor:?}: {height_m} m");
    }
}
