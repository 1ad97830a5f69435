//! Kinematic bodies move as poses and keyframes say, and feel the bodies that they carry.

use glam::{DQuat, DVec3};
use metachron_core::{Body, RigidState, SimSpan};
use metachron_runtime::AgentState;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Command, Object, Rigid, Scene, World, WorldError};

const G_M_S2: f64 = 9.81;
const BALL_KG: f64 = 0.3;

/// A ball on a plate, both at rest.
fn carried(plate: Rigid, rate_hz: f64) -> (World, Object, Object) {
    let plate = plate.rate_hz(rate_hz);
    let ball = Rigid::ball(0.05).rate_hz(rate_hz).mass_kg(BALL_KG).restitution(0.0).at([0.05, 0.02, 0.06]);
    let scene = Scene::builder().add("plate", plate.restitution(0.0)).add("ball", ball).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let [plate, ball] = world.objects(["plate", "ball"]).unwrap();
    world.advance(SimSpan::from_millis(500));
    (world, plate, ball)
}

fn plate() -> Rigid {
    Rigid::cuboid([0.2, 0.2, 0.01])
}

fn state(world: &World, object: Object) -> RigidState {
    let Body::Rigid(state) = world.latest(object).unwrap().body else { panic!("a rigid body") };
    state
}

#[test]
fn a_ball_on_a_plate_that_poses_lift_is_as_heavy_as_its_acceleration_says() {
    const LIFT_M_S2: f64 = 2.0;
    for step_ms in [8, 4, 1] {
        let (world, plate, ball) = carried(plate().kinematic(), 1000.0 / step_ms as f64);
        let start = world.time();
        for _ in 0..400 / step_ms {
            let t = world.time().secs_after(start);
            let pose = Command::pose(DVec3::Z * (0.5 * LIFT_M_S2 * t * t), DQuat::IDENTITY);
            world.command(plate, pose.moving(DVec3::Z * (LIFT_M_S2 * t), DVec3::ZERO).for_ms(20)).unwrap();
            world.advance(SimSpan::from_millis(step_ms));
        }
        // v = a t, two steps late at most: a command is heard when the next step begins, and the last step may not be over
        let (v, late_s) = (state(&world, ball).velocity.z, 0.002 * step_ms as f64);
        assert!((LIFT_M_S2 * (0.4 - late_s)..=LIFT_M_S2 * 0.4).contains(&v), "{step_ms} ms: {v} m/s");
        let (force_n, weight_n) = (world.latest(plate).unwrap().contact_wrench.force_n, BALL_KG * (G_M_S2 + LIFT_M_S2));
        assert!((force_n + DVec3::Z * weight_n).length() < 1e-3 * weight_n, "{step_ms} ms: {force_n}, not {weight_n}");
    }
}

#[test]
fn a_pose_without_a_velocity_holds_a_plate_that_feels_the_weight_on_it() {
    for rate_hz in [60.0, 240.0, 1000.0] {
        let (world, plate, ball) = carried(plate().kinematic(), rate_hz);
        world.command(plate, Command::pose(DVec3::ZERO, DQuat::IDENTITY)).unwrap();
        world.advance(SimSpan::from_millis(500));
        let held = state(&world, plate);
        assert_eq!((held.position, held.velocity), (DVec3::ZERO, DVec3::ZERO), "{rate_hz} Hz");
        let wrench = world.latest(plate).unwrap().contact_wrench;
        let weight_n = DVec3::NEG_Z * (BALL_KG * G_M_S2);
        assert!((wrench.force_n - weight_n).length() < 1e-3 * weight_n.length(), "{rate_hz} Hz: {}", wrench.force_n);
        let arm = state(&world, ball).position;
        let torque_n_m = arm.cross(weight_n);
        assert!((wrench.torque_n_m - torque_n_m).length() < 1e-3 * weight_n.length() * 0.05, "{}", wrench.torque_n_m);
    }
}

#[test]
fn keyframes_carry_a_ball_along_and_commands_that_end_let_them_go_on() {
    let led = plate().keyframe(1.0, [0.0; 3], DQuat::IDENTITY).keyframe(3.0, [0.0, 0.0, 0.4], DQuat::IDENTITY);
    let (world, plate, ball) = carried(led, 240.0);
    world.advance(SimSpan::from_millis(3000));
    assert!((state(&world, plate).position.z - 0.4).abs() < 1e-12, "{}", state(&world, plate).position);
    assert!((state(&world, ball).position.z - 0.46).abs() < 1e-4, "{}", state(&world, ball).position);
    world.command(plate, Command::pose(DVec3::Z * 0.5, DQuat::IDENTITY).for_ms(300)).unwrap();
    world.advance(SimSpan::from_millis(200));
    assert!((state(&world, plate).position.z - 0.5).abs() < 1e-12, "{}", state(&world, plate).position);
    world.advance(SimSpan::from_millis(4000));
    // it returns at 4 /s
    assert!((state(&world, plate).position.z - 0.4).abs() < 1e-4, "{}", state(&world, plate).position);
}

#[test]
fn what_leads_a_kinematic_body_is_told_apart_from_what_moves_others() {
    let (world, plate, ball) = carried(plate().kinematic(), 240.0);
    let refused = |object, command| world.command(object, command).unwrap_err();
    let force = Command::force(metachron_core::Anchor::Local(DVec3::ZERO), DVec3::X);
    let pose = |at: DVec3| Command::pose(at, DQuat::IDENTITY);
    for error in [refused(plate, force), refused(plate, force.taken_back()), refused(ball, pose(DVec3::ZERO))] {
        assert!(matches!(error, WorldError::NotTaken(_)), "{error}");
    }
    let error = refused(plate, pose(DVec3::NAN));
    assert!(matches!(&error, WorldError::Refused { reason, .. } if reason.contains("finite")), "{error}");
}

#[test]
fn a_pose_out_of_range_is_refused_with_what_is_wrong() {
    let scene = Scene::builder().add("plate", plate().kinematic()).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let plate = world.object("plate").unwrap();
    let (place, turn) = (DVec3::Z, DQuat::IDENTITY);
    for (pose, wanted) in [
        (Command::pose(DVec3::X * 2e6, turn), "the position is 2e6 m; expected a finite number from -1e6 to 1e6 m"),
        (
            Command::pose(place, turn).moving(DVec3::X * f64::INFINITY, DVec3::ZERO),
            "the velocity is inf m/s; expected a finite number",
        ),
        (
            Command::pose(place, turn).moving(DVec3::ZERO, DVec3::X * 1e200),
            "the spin is 1e200 rad/s; expected a finite number from -1e6 to 1e6 rad/s",
        ),
        (
            Command::pose(place, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
            "a rotation must be a quaternion that is finite and not zero",
        ),
    ] {
        let said = world.command(plate, pose).expect_err(wanted).to_string();
        assert!(said.contains(wanted), "{said}");
    }
    world.advance(SimSpan::from_millis(20));
    assert_eq!(world.agents()[0].state(), AgentState::Resting, "it goes on, and nothing leads it");
}

#[test]
fn a_plate_that_is_turned_by_a_command_wakes_what_sleeps_on_it_and_lets_it_roll() {
    let (world, plate, ball) = carried(plate().kinematic(), 240.0);
    world.advance(SimSpan::from_millis(1500));
    assert!(world.latest(ball).unwrap().at_rest, "it sleeps on the plate");
    let tilt = 0.1_f64;
    world.command(plate, Command::pose(DVec3::ZERO, DQuat::from_rotation_y(tilt))).unwrap();
    world.advance(SimSpan::from_millis(100));
    let before = state(&world, ball).velocity;
    world.advance(SimSpan::from_millis(300));
    // a ball rolls down a slope with 5/7 g sin α
    let rolled_m_s2 = (state(&world, ball).velocity - before).length() / 0.3;
    let expected = 5.0 / 7.0 * G_M_S2 * tilt.sin();
    assert!((rolled_m_s2 - expected).abs() < 0.02 * expected, "{rolled_m_s2} instead of {expected}");
}

#[test]
fn a_checkpoint_has_the_pose_that_leads_a_body() {
    let (world, plate, _) = carried(plate().kinematic(), 240.0);
    let moving = Command::pose(DVec3::ZERO, DQuat::IDENTITY).moving(DVec3::Z * 0.1, DVec3::X * 0.2);
    world.command(plate, moving.for_ms(700)).unwrap();
    world.advance(SimSpan::from_millis(100));
    let mark = world.checkpoint().unwrap();
    world.advance(SimSpan::from_millis(900));
    let hash = world.hash();
    world.restore(&mark).unwrap();
    world.advance(SimSpan::from_millis(900));
    assert_eq!(hash, world.hash());
}
#[test]
fn what_is_led_at_any_speed_meets_what_is_in_its_way_from_its_second_step_on() {
    // in its first step nobody has heard of its speed; a ball a foot away is seen anyway
    for (far_m, speed_m_s) in [(0.3, 3000.0), (10.0, 1000.0)] {
        let plate = Rigid::cuboid([0.02, 0.3, 0.3]).kinematic().at([-far_m, 0.0, 0.0]);
        let scene = Scene::builder().gravity([0.0; 3]).add("plate", plate).add("ball", Rigid::ball(0.05));
        let world = World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap();
        let [plate, ball] = world.objects(["plate", "ball"]).unwrap();
        let led = Command::pose(DVec3::X * -far_m, DQuat::IDENTITY).moving(DVec3::X * speed_m_s, DVec3::ZERO);
        world.command(plate, led).unwrap();
        world.advance(SimSpan::from_millis(40));
        let speed = state(&world, ball).velocity.x;
        assert!(speed > 0.99 * speed_m_s, "{speed} m/s");
    }
}
