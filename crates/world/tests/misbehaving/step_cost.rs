//! A step has a bound of cost, whatever is done to its objects: by counts of fine steps and factors, with the rest of what they asked for reported.

use glam::DVec3;
use metachron_contact::detect::LEAST_STEPS_DEFAULT;
use metachron_contact::step::{FINE_STEPS_MAX, STEP_FACTORS_MAX};
use metachron_core::{Anchor, ClusterSolves, SimSpan};
use metachron_geometry::Solid;
use metachron_runtime::AgentState;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Command, EventFilter, Happening, Object, Rigid, Scene, SceneBuilder, Tube, World};

const STEP: SimSpan = SimSpan::from_millis(5);

/// A tube of ten segments above the floor, 0.19 kg.
fn floor_and_tube() -> SceneBuilder {
    let gut = Tube::along(&[[-0.3, 0.0, 0.05], [0.3, 0.0, 0.05]]).segments(10).rate_hz(200.0);
    Scene::builder().fixed("floor", Solid::Plane).add("gut", gut)
}

fn started(scene: SceneBuilder) -> (World, Object) {
    let world = World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap();
    let gut = world.object("gut").unwrap();
    world.advance(STEP);
    (world, gut)
}

fn strike(world: &World, gut: Object, impulse_n_s: f64) {
    let along = DVec3::new(0.1, 0.2, -1.0);
    world.command(gut, Command::impulse(Anchor::Arc(0.37), along * impulse_n_s)).unwrap();
}

fn solves(world: &World) -> ClusterSolves {
    world.agents()[0].latest().cluster.and_then(|cluster| cluster.solves).unwrap()
}

#[test]
fn no_impulse_makes_a_step_cost_more_than_its_bound() {
    let balls = |scene: SceneBuilder, count: u32| {
        (0..count).fold(scene, |scene, k| {
            scene.add(format!("ball {k}"), Rigid::ball(0.02).at([-0.3 + 0.045 * f64::from(k), 0.0, 0.02]))
        })
    };
    for (impulse_n_s, count) in [(1e6, 0), (1e8, 0), (1e10, 0), (1e8, 8)] {
        let (world, gut) = started(balls(floor_and_tube(), count));
        strike(&world, gut, impulse_n_s);
        let mut before = solves(&world);
        for _ in 0..6 {
            world.advance(STEP);
            let now = solves(&world);
            let fine_steps = now.problems - before.problems;
            // in a fine step six solves of the step and six of impacts at most; the one that spends the last factor has gone on to its end
            let most = u64::from(STEP_FACTORS_MAX) + 400 + fine_steps * 12 * u64::from(LEAST_STEPS_DEFAULT);
            assert!(fine_steps <= u64::from(FINE_STEPS_MAX), "{impulse_n_s:e} N·s: {fine_steps} fine steps");
            assert!(now.factors - before.factors <= most, "{impulse_n_s:e} N·s: {now:?} after {before:?}");
            before = now;
        }
        assert_eq!(world.agents()[0].stats().state, AgentState::Running, "{impulse_n_s:e} N·s");
    }
}

#[test]
fn a_step_that_is_divided_no_further_is_counted_and_told_of_once() {
    let (world, gut) = started(floor_and_tube());
    let mut events = world.events(EventFilter::states());
    strike(&world, gut, 1e6);
    world.advance(SimSpan::from_millis(30));
    let stats = world.agents()[0].stats();
    assert!(stats.under_resolved > 1, "{stats:?}");
    let told: Vec<f64> = events
        .drain()
        .filter_map(|event| if let Happening::UnderResolved(times) = event.what { Some(times) } else { None })
        .collect();
    // 1e6 N·s over a node of 19 g move it by 5e7 m/s: in 1/64 of 5 ms by 7e4 times the length of a segment, of which a step takes a quarter
    assert!(matches!(told[..], [times] if times > 1e3), "{told:?}");
}

#[test]
fn a_motion_that_steps_can_follow_asks_for_no_more() {
    let (world, gut) = started(floor_and_tube());
    strike(&world, gut, 0.1);
    world.advance(SimSpan::from_millis(30));
    assert_eq!(world.agents()[0].stats().under_resolved, 0);
}
