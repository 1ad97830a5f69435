//! Coordinates of joints are where closed forms of mechanisms put their bodies.

use glam::{DQuat, DVec3};
use metachron_core::{Body, RigidState, SimSpan};
use metachron_models::rigid::JointKind;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{JointState, Recording, Rigid, Scene, SceneBuilder, World, WorldError};

const UPPER_M: f64 = 0.4;
const LOWER_M: f64 = 0.3;

fn hinge(range_rad: Option<[f64; 2]>) -> JointKind {
    JointKind::Revolute { axis: DVec3::Y, range_rad, motor: None }
}

fn bar(half_m: f64, middle: [f64; 3]) -> Rigid {
    Rigid::cuboid([half_m, 0.01, 0.01]).mass_kg(0.5).at(middle).rate_hz(1000.0)
}

/// Two bars along x, hinged about y: to the world in the origin, and to each other.
fn arm() -> SceneBuilder {
    Scene::builder()
        .gravity([0.0; 3])
        .add("upper", bar(0.5 * UPPER_M, [0.5 * UPPER_M, 0.0, 0.0]))
        .add("lower", bar(0.5 * LOWER_M, [UPPER_M + 0.5 * LOWER_M, 0.0, 0.0]))
        .joint("lower", Some("upper"), hinge(Some([-1.0, 2.0])), [UPPER_M, 0.0, 0.0])
        .joint_name("elbow")
        .joint("upper", None, hinge(None), [0.0; 3])
        .joint_name("shoulder")
}

fn started(scene: SceneBuilder) -> World {
    World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap()
}

fn rigid(world: &World, name: &str) -> RigidState {
    let Body::Rigid(state) = world.latest(world.object(name).unwrap()).unwrap().body else { panic!("a rigid body") };
    state
}

fn state(world: &World, joint: &str, position: f64, velocity: f64) -> JointState {
    JointState { joint: world.joint(joint).unwrap(), position, velocity }
}

fn close(found: DVec3, expected: DVec3, within: f64) {
    assert!(found.distance(expected) < within, "{found} instead of {expected}");
}

#[test]
fn an_arm_is_where_the_sums_of_its_angles_put_it() {
    let world = started(arm());
    // a joint turns b relative to a: the world relative to the upper bar, and the upper relative to the lower bar
    let (shoulder, elbow, shoulder_rate, elbow_rate) = (0.7, -0.4, 1.5, -2.5);
    world.set_joint_states(&[state(&world, "shoulder", shoulder, shoulder_rate)]).unwrap();
    // a second call before the next step goes on from the first
    world.set_joint_states(&[state(&world, "elbow", elbow, elbow_rate)]).unwrap();
    let all = world.joint_states().unwrap();
    for (found, expected) in all.iter().zip([(elbow, elbow_rate), (shoulder, shoulder_rate)]) {
        assert!((found.position - expected.0).abs() < 1e-14 && (found.velocity - expected.1).abs() < 1e-13, "{all:?}");
    }
    world.advance(SimSpan::from_millis(1));
    let h = 1e-3;
    let (upper, lower) = (rigid(&world, "upper"), rigid(&world, "lower"));
    // about +y x turns to −z; nothing but the step moved it since
    let (first, second) = (-shoulder, -shoulder - elbow);
    let (first_rate, second_rate) = (-shoulder_rate, -shoulder_rate - elbow_rate);
    let along = |angle: f64| DVec3::new(angle.cos(), 0.0, -angle.sin());
    let across = |angle: f64| DVec3::new(-angle.sin(), 0.0, -angle.cos());
    let middle = along(first) * (0.5 * UPPER_M);
    let velocity = across(first) * (0.5 * UPPER_M * first_rate);
    close(upper.position, middle + velocity * h, 1e-5); // a v²/r h² of second order: 0.2 · 2.25 · 1e-6
    let end = along(first) * UPPER_M + along(second) * (0.5 * LOWER_M);
    let end_velocity = across(first) * (UPPER_M * first_rate) + across(second) * (0.5 * LOWER_M * second_rate);
    close(lower.position, end + end_velocity * h, 1e-5);
    assert!(upper.rotation.angle_between(DQuat::from_rotation_y(first + first_rate * h)) < 1e-5);
    assert!(lower.rotation.angle_between(DQuat::from_rotation_y(second + second_rate * h)) < 1e-5);
    close(lower.velocity, end_velocity, 0.01); // it turns by 4e-3 rad within the step
    close(lower.spin, DVec3::Y * second_rate, 0.01);
}

#[test]
fn a_reset_arm_is_where_it_began_and_at_rest() {
    let world = started(arm());
    let begun = ["upper", "lower"].map(|name| rigid(&world, name));
    world.set_joint_states(&[state(&world, "shoulder", 2.0, 3.0), state(&world, "elbow", 1.5, 0.0)]).unwrap();
    world.advance(SimSpan::from_millis(300));
    world.reset_joints().unwrap();
    assert!(world.joint_states().unwrap().iter().all(|state| state.position.abs() < 1e-12 && state.velocity == 0.0));
    world.advance(SimSpan::from_millis(100));
    for (name, begun) in ["upper", "lower"].into_iter().zip(begun) {
        let now = rigid(&world, name);
        close(now.position, begun.position, 1e-9);
        // contact's solves begin with the impulses of before, and end within their tolerance: 1e-8 rad/s measured
        assert!(now.velocity.length() < 1e-7 && now.spin.length() < 1e-7, "{now:?}");
    }
}

#[test]
fn a_slide_carries_what_is_welded_to_it_along_its_own_axis() {
    let (turn, way_m, speed) = (DQuat::from_rotation_z(0.5), 0.2, 0.3);
    let slide = JointKind::Prismatic { axis: turn * DVec3::X, range_m: Some([-0.1, 0.5]), motor: None };
    let base = Rigid::cuboid([0.05; 3]).kinematic().turned(turn).at([1.0, 2.0, 3.0]).rate_hz(1000.0);
    let cart = Rigid::cuboid([0.05; 3]).turned(turn).at([1.0, 2.0, 3.2]).rate_hz(1000.0);
    let load = Rigid::ball(0.02).at([1.0, 2.0, 3.4]).rate_hz(1000.0);
    let scene = arm()
        .add("base", base)
        .add("cart", cart)
        .add("load", load)
        .joint("base", Some("cart"), slide, [1.0, 2.0, 3.1])
        .joint_name("rail")
        .joint("load", Some("cart"), JointKind::Fixed, [1.0, 2.0, 3.3]);
    let world = started(scene);
    world.set_joint_states(&[state(&world, "rail", way_m, speed)]).unwrap();
    world.advance(SimSpan::from_millis(1));
    let way = turn * DVec3::X * (way_m + speed * 1e-3);
    close(rigid(&world, "cart").position, DVec3::new(1.0, 2.0, 3.2) + way, 1e-9);
    close(rigid(&world, "load").position, DVec3::new(1.0, 2.0, 3.4) + way, 1e-9);
    close(rigid(&world, "load").velocity, turn * DVec3::X * speed, 1e-9);
    close(rigid(&world, "base").position, DVec3::new(1.0, 2.0, 3.0), 1e-12);
    close(rigid(&world, "upper").position, DVec3::X * (0.5 * UPPER_M), 1e-12);
}

#[test]
fn the_body_of_the_lowest_number_stays_where_nothing_holds_a_tree() {
    let scene = Scene::builder()
        .gravity([0.0; 3])
        .add("torso", bar(0.2, [0.0; 3]).velocity_m_s([0.1, 0.2, 0.3]))
        .add("thigh", bar(0.2, [0.4, 0.0, 0.0]).velocity_m_s([0.1, 0.2, 0.3]))
        .joint("torso", Some("thigh"), hinge(None), [0.2, 0.0, 0.0])
        .joint_name("hip");
    let world = started(scene);
    let hip = JointState { position: 1.0, ..world.joint_state(world.joint("hip").unwrap()).unwrap() };
    world.set_joint_states(&[hip]).unwrap();
    world.advance(SimSpan::from_millis(1));
    let drift = DVec3::new(0.1, 0.2, 0.3);
    close(rigid(&world, "torso").position, drift * 1e-3, 1e-9);
    let thigh = rigid(&world, "thigh");
    close(thigh.position, DVec3::X * 0.2 + DQuat::from_rotation_y(1.0) * (DVec3::X * 0.2) + drift * 1e-3, 1e-9);
    close(thigh.velocity, drift, 1e-9);
}

/// A parallelogram: two cranks on the world, and a coupler between them.
fn parallelogram() -> World {
    let crank = |x: f64| Rigid::cuboid([0.01, 0.01, 0.1]).at([x, 0.0, 0.1]).rate_hz(1000.0);
    let scene = Scene::builder()
        .gravity([0.0; 3])
        .add("left", crank(0.0))
        .add("right", crank(0.5))
        .add("coupler", bar(0.25, [0.25, 0.0, 0.2]))
        .joint("left", None, hinge(None), [0.0; 3])
        .joint_name("a")
        .joint("right", None, hinge(None), [0.5, 0.0, 0.0])
        .joint_name("b")
        .joint("coupler", Some("left"), hinge(None), [0.0, 0.0, 0.2])
        .joint_name("c")
        .joint("coupler", Some("right"), hinge(None), [0.5, 0.0, 0.2])
        .joint_name("d");
    started(scene)
}

#[test]
fn joints_of_a_loop_are_set_together_or_not_at_all() {
    let world = parallelogram();
    let before = world.hash();
    let refused = world.set_joint_states(&[state(&world, "a", 0.4, 0.0)]);
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("closes a loop of joints") && message.contains("set together"), "{message}");
    assert!(world.joint_states().unwrap().iter().all(|state| state.position.abs() < 1e-12), "nothing was done");
    assert_eq!(world.hash(), before);
    // both cranks turn by as much and the coupler does not
    let set = ["a", "b"].map(|name| state(&world, name, 0.4, 0.0));
    let [c, d] = ["c", "d"].map(|name| state(&world, name, -0.4, 0.0));
    let wrong = JointState { position: -0.3, ..d };
    assert!(matches!(world.set_joint_states(&[set[0], set[1], c, wrong]), Err(WorldError::OpenLoop { .. })));
    // the joint that closes the loop follows
    world.set_joint_states(&[set[0], set[1], c]).unwrap();
    assert!((world.joint_state(d.joint).unwrap().position + 0.4).abs() < 1e-12);
    world.advance(SimSpan::from_millis(1));
    let coupler = rigid(&world, "coupler");
    close(coupler.position, DVec3::X * 0.25 + DQuat::from_rotation_y(-0.4) * (DVec3::Z * 0.2), 1e-9);
    assert!(coupler.rotation.angle_between(DQuat::IDENTITY) < 1e-9);
}

#[test]
fn coordinates_that_a_joint_cannot_have_are_refused_and_move_nothing() {
    let socket = arm().add("ball", Rigid::ball(0.05).at([0.0, 1.0, 0.0])).joint(
        "ball",
        None,
        JointKind::Spherical,
        [0.0, 1.0, 0.0],
    );
    let world = started(socket);
    let refused = |position, velocity| {
        let set =
            world.set_joint_states(&[state(&world, "shoulder", 0.3, 0.0), state(&world, "elbow", position, velocity)]);
        set.unwrap_err().to_string()
    };
    assert_eq!(refused(2.1, 0.0), "the position of joint \"elbow\" is 2.1; expected -1 to 2 rad");
    assert!(refused(f64::NAN, 0.0).contains("expected -1 to 2 rad"));
    assert!(refused(0.0, f64::INFINITY).contains("the velocity of joint \"elbow\" is inf"));
    let shoulder = world.set_joint_states(&[state(&world, "shoulder", f64::NAN, 0.0)]).unwrap_err();
    assert!(matches!(shoulder, WorldError::BadCoordinate { what: "position", .. }), "{shoulder}");
    let unnamed = world.joints().last().unwrap();
    assert_eq!((unnamed.name, unnamed.at.number()), (None, 2));
    let none = world.joint_state(unnamed.at).unwrap_err().to_string();
    assert_eq!(none, "joint 2 has no coordinate: only hinges and slides have one");
    assert_eq!(world.joint_states().unwrap(), [state(&world, "elbow", 0.0, 0.0), state(&world, "shoulder", 0.0, 0.0)]);
    let other = started(arm());
    assert!(matches!(other.set_joint_states(&[state(&world, "elbow", 0.1, 0.0)]), Err(WorldError::Foreign)));
}

/// Two wheels beside each other, the second of which follows the first and leads a rack.
fn gears() -> SceneBuilder {
    let wheel = |x: f64| Rigid::cuboid([0.1; 3]).mass_kg(1.0).at([x, 0.0, 0.0]).rate_hz(500.0);
    let slide = JointKind::Prismatic { axis: DVec3::Z, range_m: Some([-0.3, 0.3]), motor: None };
    let scene = Scene::builder().gravity([0.0; 3]).add("first", wheel(0.0)).add("second", wheel(1.0));
    scene
        .add("rack", wheel(2.0))
        .joint("rack", None, slide, [2.0, 0.0, 0.0])
        .joint_name("rack")
        .mimic("second", 0.1)
        .joint("first", None, hinge(None), [0.0; 3])
        .joint_name("first")
        .joint("second", None, hinge(None), [1.0, 0.0, 0.0])
        .joint_name("second")
        .mimic("first", -2.0)
}

#[test]
fn joints_that_follow_go_along_with_those_that_are_set() {
    let world = started(gears());
    world.set_joint_states(&[state(&world, "first", 0.5, 0.3)]).unwrap();
    let all = world.joint_states().unwrap();
    for (found, (position, velocity)) in all.iter().zip([(-0.1, -0.06), (0.5, 0.3), (-1.0, -0.6)]) {
        assert!((found.position - position).abs() < 1e-12 && (found.velocity - velocity).abs() < 1e-12, "{all:?}");
    }
    // and stay together by their own constraint, in one cluster
    world.advance(SimSpan::from_millis(1000));
    let [rack, first, second] = [0, 1, 2].map(|at| world.joint_states().unwrap()[at]);
    assert!((first.position - 0.8).abs() < 1e-6, "all go on at their rates: {first:?}");
    assert!((second.position + 2.0 * first.position).abs() < 1e-6, "{second:?} of {first:?}");
    assert!((rack.position - 0.1 * second.position).abs() < 1e-6, "{rack:?} of {second:?}");
}

#[test]
fn friction_and_an_armature_of_a_joint_slow_it_down() {
    let (friction, armature, inertia) = (0.01, 0.02, 2.0 / 3.0 * 0.1 * 0.1);
    let wheel = Rigid::cuboid([0.1; 3]).mass_kg(1.0).rate_hz(500.0);
    let scene = Scene::builder().gravity([0.0; 3]).add("wheel", wheel).joint("wheel", None, hinge(None), [0.0; 3]);
    let world = started(scene.joint_name("axle").joint_friction(friction).joint_armature(armature));
    world.set_joint_states(&[state(&world, "axle", 0.0, 1.0)]).unwrap();
    world.advance(SimSpan::from_millis(1000));
    let found = world.joint_states().unwrap()[0].velocity;
    // within a step
    assert!((found - (1.0 - friction / (armature + inertia))).abs() < 2e-3, "{found} rad/s");
    let refused = Scene::builder().add("ball", Rigid::ball(0.1)).joint("ball", None, JointKind::Fixed, [0.0; 3]);
    let refused = refused.joint_friction(0.1).build().unwrap_err().to_string();
    assert!(refused.contains("friction") && refused.contains("0.1"), "{refused}");
}

#[test]
fn coordinates_beyond_half_a_turn_are_read_and_set_again() {
    let wheel = |x: f64| Rigid::cuboid([0.1; 3]).mass_kg(1.0).at([x, 0.0, 0.0]).rate_hz(500.0);
    let scene = Scene::builder().gravity([0.0; 3]).add("first", wheel(0.0)).add("second", wheel(1.0));
    let scene = scene.joint("first", None, hinge(None), [0.0; 3]).joint_name("first");
    let scene = scene.joint("second", None, hinge(None), [1.0, 0.0, 0.0]).joint_name("second").mimic("first", 0.3);
    let world = started(scene);
    world.set_joint_states(&[state(&world, "first", 0.0, 3.0)]).unwrap();
    world.advance(SimSpan::from_millis(3000));
    let read = world.joint_states().unwrap();
    let turned = 9.0 - std::f64::consts::TAU;
    for (found, wanted) in read.iter().zip([turned, 2.7]) {
        assert!((found.position - wanted).abs() < 1e-6, "{read:?}");
    }
    world.advance(SimSpan::from_millis(1000));
    world.set_joint_states(&read).unwrap();
    world.advance(SimSpan::from_millis(100));
    let on = world.joint_states().unwrap();
    // the last step ends within the time that passed
    let moved = [0, 1].map(|joint| on[joint].position - read[joint].position);
    assert!((0.29..0.301).contains(&moved[0]) && (moved[1] - 0.3 * moved[0]).abs() < 1e-6, "{moved:?}");
    assert!((on[0].velocity - 3.0).abs() < 1e-6 && (on[1].velocity - 0.9).abs() < 1e-6, "{on:?}");
    // no turn of the one that leads brings these together
    let apart = JointState { position: read[1].position + 0.5, ..read[1] };
    assert!(matches!(world.set_joint_states(&[read[0], apart]), Err(WorldError::BadCoordinate { .. })));
}

#[test]
fn coordinates_that_part_a_joint_from_the_one_that_it_follows_are_refused() {
    let world = started(gears());
    let set = |states: &[JointState]| world.set_joint_states(states).unwrap_err().to_string();
    let apart = set(&[state(&world, "first", 0.5, 0.0), state(&world, "second", 1.0, 0.0)]);
    assert_eq!(apart, "the position of joint \"second\" is 1; expected -1, as it follows joint \"first\"");
    assert!(set(&[state(&world, "second", 0.4, 0.0)]).contains("expected 0, as it follows joint \"first\""));
    // the rack would go 0.4 m
    assert!(set(&[state(&world, "first", -2.0, 0.0)]).contains("the position of joint \"rack\" is 0.4"));
    assert!(world.joint_states().unwrap().iter().all(|state| state.position == 0.0));
}

#[test]
fn a_joint_that_cannot_follow_is_refused() {
    let refused = |scene: SceneBuilder| scene.build().unwrap_err().to_string();
    let none = refused(gears().mimic("third", 1.0));
    assert_eq!(none, "a joint follows the joint \"third\", and the scene has none of that name");
    let itself = refused(gears().mimic("second", 1.0));
    assert!(
        itself.ends_with("the joint follows joint 2; expected another hinge or slide that does not follow it in turn, by its number from 0"),
        "{itself}"
    );
    let ring = refused(gears().joint("first", None, hinge(None), [0.0; 3]).joint_name("third").mimic("third", 1.0));
    assert!(ring.contains("that does not follow it in turn"), "{ring}");
    assert!(refused(gears().mimic("first", f64::NAN)).contains("ratio to the joint that it follows"));
    let ball = gears().joint("first", None, JointKind::Spherical, [0.0; 3]).mimic("second", 1.0);
    assert!(refused(ball).contains("expected another hinge or slide"));
}

#[test]
fn on_threads_coordinates_are_set_while_time_stands() {
    let world = World::start(&arm().build().unwrap(), ExecutorKind::Threads).unwrap();
    let elbow = [state(&world, "elbow", 0.5, 0.0)];
    world.drive(metachron_runtime::TimelineCommand::Run);
    assert!(matches!(world.set_joint_states(&elbow), Err(WorldError::TimePasses)));
    world.advance(SimSpan::from_millis(5));
    world.set_joint_states(&elbow).unwrap();
    world.advance(SimSpan::from_millis(5));
    let found = world.joint_states().unwrap()[0];
    assert!((found.position - 0.5).abs() < 1e-9, "{found:?}");
}

#[test]
fn a_replay_sets_the_same_coordinates() {
    let path = std::env::temp_dir().join(format!("metachron-joint-states-{}.rec", std::process::id()));
    let scene = arm().build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.record(&path).unwrap();
    world.advance(SimSpan::from_millis(50));
    world.set_joint_states(&[state(&world, "shoulder", 0.3, 1.0)]).unwrap();
    world.advance(SimSpan::from_millis(50));
    world.stop();
    let again = World::replay(&scene, Recording::read(&path).unwrap(), None).unwrap();
    again.advance(SimSpan::from_millis(100));
    assert_eq!(again.hash(), world.hash());
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_world_lists_what_is_in_it_by_name() {
    let world = started(arm().fixed("floor", metachron_geometry::Solid::Plane));
    let names = |world: &World| -> Vec<String> {
        world.all_objects().map(|object| world.name(object).unwrap().to_owned()).collect()
    };
    assert_eq!(names(&world), ["upper", "lower"]);
    let ball = world.add("ball", Rigid::ball(0.1).at([0.0, 5.0, 0.0])).unwrap();
    assert_eq!(names(&world), ["upper", "lower", "ball"]);
    world.remove(ball).unwrap();
    world.advance(SimSpan::from_millis(10));
    assert_eq!(names(&world), ["upper", "lower"]);
    assert_eq!(world.name(ball).unwrap(), "ball", "a name outlives its object");
    assert_eq!(world.name(metachron_world::Touched::Fixed(0)).unwrap(), "floor");
    assert!(matches!(world.name(metachron_world::Touched::Fixed(1)), Err(WorldError::Foreign)));
    let joints: Vec<_> = world.joints().map(|listed| listed.name).collect();
    assert_eq!(joints, [Some("elbow"), Some("shoulder")]);
}
