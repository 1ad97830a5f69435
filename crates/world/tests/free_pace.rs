//! Worlds at the free pace: neither time nor length of step is given up, whatever the machine, on every executor.

use glam::DVec3;
use metachron_contact::joint::JointKind;
use metachron_core::{SimSpan, SimTime};
use metachron_geometry::Solid;
use metachron_runtime::{Demand, Governor, TurnMeasure};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Member, Pace, Rigid, Scene, StepCost, Tube, World};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

/// Length of a link, metres.
const LINK_M: f64 = 0.1;

const fn ms(count: u64) -> SimSpan {
    SimSpan::from_millis(count)
}

/// A chain of boxes that hangs from the world by hinges with parallel axes, held straight out. Of each, `rate_hz` says the rate.
fn chain(links: usize, rate_hz: impl Fn(usize) -> f64) -> Scene {
    let mut scene = Scene::builder().gravity([0.0, 0.0, -9.81]);
    let name = |link: usize| format!("link{link}");
    for link in 0..links {
        let at = [(link as f64 + 0.5) * LINK_M, 0.0, 0.0];
        let body = Rigid::cuboid([0.45 * LINK_M, 0.01, 0.01]).mass_kg(0.2).at(at).rate_hz(rate_hz(link));
        scene = scene.add(name(link), body);
    }
    for link in 0..links {
        let before = link.checked_sub(1).map(name);
        let hinge = JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor: None };
        scene = scene.joint(name(link), before.as_deref(), hinge, [link as f64 * LINK_M, 0.0, 0.0]);
    }
    scene.build().unwrap()
}

/// The same on a machine whose steps cost so many milliseconds each.
fn costing(scene: &Scene, step_ms: f64) -> Scene {
    let mut scene = scene.clone();
    scene.machine.step.insert("rigid".to_owned(), StepCost { base_us: Some(1e3 * step_ms), unit_us: Some(0.0) });
    scene
}

fn free(scene: &Scene, executor: ExecutorKind) -> World {
    let world = World::start(scene, executor).unwrap();
    world.set_pace(Pace::Free).unwrap();
    assert!(world.is_free());
    world
}

/// That each object made its steps, all as long as asked for, and lived as long as time has passed.
fn assert_whole(world: &World, steps: u64, dt: SimSpan, span: SimSpan) {
    let on = world.executor();
    assert_eq!((world.time(), world.given_up()), (SimTime::ZERO + span, SimSpan::ZERO), "{on:?}");
    for agent in world.agents() {
        let stats = agent.stats();
        let made = (stats.steps, stats.dt, stats.lived, stats.lengthened, stats.dropped);
        assert_eq!(made, (steps, dt, span, 0, SimSpan::ZERO), "{on:?} {}", stats.name);
    }
}

#[test]
fn hinged_boxes_make_every_step_as_long_as_asked_for() {
    let scene = chain(25, |_| 8000.0);
    for executor in EXECUTORS {
        let world = free(&scene, executor);
        // in two calls, so that one begins where another has ended
        world.advance(ms(60));
        world.advance(ms(40));
        assert_whole(&world, 800, SimSpan::from_nanos(125_000), ms(100));
    }
}

#[test]
fn the_declared_machine_says_nothing_of_the_bits_at_the_free_pace() {
    let scene = chain(12, |_| 8000.0);
    // on a clock slow enough for the declared machine, no step is late either
    let slow = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    slow.set_pace(Pace::Factor(0.001)).unwrap();
    slow.advance(ms(100));
    assert_eq!(slow.given_up(), SimSpan::ZERO);
    for scene in [scene.clone(), costing(&scene, 0.0), costing(&scene, 1000.0)] {
        let world = free(&scene, ExecutorKind::Lockstep);
        world.advance(ms(100));
        assert_eq!(world.hash(), slow.hash());
    }
}

#[test]
fn a_declared_machine_that_is_too_slow_says_how_much_was_given_up() {
    let scene = costing(&chain(4, |_| 1000.0), 2.0);
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(ms(2000));
    let first = world.agents().iter().next().unwrap().clone();
    let stats = first.stats();
    // four steps of 2 ms on two cores take 4 ms of time, and are 2.5 ms long at most
    let lacks = world.given_up();
    assert!(stats.lengthened > 0 && stats.lengthened <= stats.steps, "{stats:?}");
    assert!(lacks > ms(700), "{lacks:?}");
    let missing_s = 2.0 - stats.lived.as_secs_f64();
    // a step in progress is not seen yet
    assert!((missing_s - lacks.as_secs_f64()).abs() < 0.005, "{missing_s} and {lacks:?}");
    let free = free(&scene, ExecutorKind::Lockstep);
    free.advance(ms(2000));
    assert_whole(&free, 2000, SimSpan::from_nanos(1_000_000), ms(2000));
}

#[test]
fn links_of_unlike_rates_make_no_step_longer_than_each_asks_for() {
    let rates = [8000.0, 250.0, 1000.0, 3000.0, 500.0];
    let scene = chain(5, |link| rates[link]);
    for executor in EXECUTORS {
        let world = free(&scene, executor);
        for _ in 0..5 {
            world.advance(ms(20));
        }
        for (agent, rate_hz) in world.agents().iter().zip(rates) {
            let stats = agent.stats();
            let lived_s = stats.lived.as_secs_f64();
            assert_eq!((stats.lengthened, stats.dropped), (0, SimSpan::ZERO), "{executor:?} {}", stats.name);
            // the step that leads to the end may go beyond it
            assert!((0.1..0.105).contains(&lived_s) && stats.steps as f64 >= 0.1 * rate_hz - 1.0, "{stats:?}");
        }
    }
}

#[test]
fn what_meets_on_its_way_makes_no_longer_step_to_come_to_one_time() {
    let ball = |x: f64, z: f64| Rigid::ball(0.03).mass_kg(0.1).at([x, 0.0, z]);
    let tube = Tube::along(&[[-0.2, 0.0, 0.06], [0.2, 0.0, 0.06]]).radius_m(0.01).segments(6).rate_hz(130.0);
    let scene =
        Scene::builder().fixed("floor", Solid::Plane).add("left", ball(-0.02, 0.15).rate_hz(70.0)).add("tube", tube);
    let scene = scene.add("right", ball(0.03, 0.22).rate_hz(410.0)).build().unwrap();
    for executor in EXECUTORS {
        let world = free(&scene, executor);
        for _ in 0..8 {
            world.advance(ms(50));
        }
        assert!(world.agents().iter().any(|agent| agent.led_by().is_some()), "{executor:?}: they have met");
        for agent in world.agents() {
            let stats = agent.stats();
            assert_eq!((stats.lengthened, stats.dropped), (0, SimSpan::ZERO), "{executor:?} {}", stats.name);
            // a sum of steps and rest, against the time of its state
            assert_eq!(SimTime::ZERO + stats.lived, agent.lived_to(), "{executor:?} {}", stats.name);
        }
    }
}

/// Notes whether a turn was shown as one that takes time.
struct Watcher(Arc<AtomicU64>);

impl Governor for Watcher {
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand {
        let is_late = measure.lateness_s > 0.0 || measure.real_period_s != measure.wanted_period_s;
        if is_late || measure.work_s > 0.0 || measure.dropped > SimSpan::ZERO {
            self.0.fetch_add(1, Relaxed);
        }
        Demand::default()
    }
}

#[test]
fn no_governor_is_shown_that_turns_take_time_at_the_free_pace() {
    let scene = chain(6, |_| 8000.0);
    let shown = |executor, pace| {
        let count = Arc::<AtomicU64>::default();
        let mut govern = |_: &Member| -> Option<Box<dyn Governor>> { Some(Box::new(Watcher(Arc::clone(&count)))) };
        let world = World::start_governed(&scene, executor, &mut govern).unwrap();
        world.set_pace(pace).unwrap();
        world.advance(ms(50));
        world.stop();
        count.load(Relaxed)
    };
    for executor in EXECUTORS {
        assert_eq!(shown(executor, Pace::Free), 0, "{executor:?}");
        assert!(shown(executor, Pace::RealTime) > 0, "{executor:?}");
    }
}

/// Where the middles of all links are after `span` at a rate.
fn played(rate_hz: f64, span: SimSpan) -> Vec<DVec3> {
    let world = free(&Scene { contacts: false, ..chain(10, |_| rate_hz) }, ExecutorKind::Lockstep);
    world.advance(span);
    assert_eq!(world.given_up(), SimSpan::ZERO);
    world.agents().iter().map(|agent| agent.latest().body.probe(0.5).unwrap().0).collect()
}

#[test]
fn the_error_of_a_falling_chain_of_ten_hinges_falls_with_the_step() {
    let span = ms(500);
    let finest = played(16_000.0, span);
    let errors_m = [250.0, 500.0, 1000.0, 2000.0, 4000.0].map(|rate_hz| {
        let apart = played(rate_hz, span).into_iter().zip(&finest).map(|(a, b)| a.distance(*b));
        apart.fold(0.0, f64::max)
    });
    for pair in errors_m.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order > 0.7, "{errors_m:?} m");
    }
}
