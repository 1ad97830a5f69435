//! Damping, scaled gravity and locked axes of rigid bodies against closed forms.

use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body, RigidState, SimSpan};
use metachron_geometry::Solid;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Command, Rigid, Scene, SceneBuilder, World};

const G_M_S2: f64 = 9.81;

fn started(builder: SceneBuilder) -> World {
    World::start(&builder.build().unwrap(), ExecutorKind::Lockstep).unwrap()
}

fn state(world: &World, name: &str) -> (RigidState, f64) {
    let state = world.latest(world.object(name).unwrap()).unwrap();
    let Body::Rigid(body) = state.body else { panic!("a rigid body") };
    (body, state.time.as_secs_f64())
}

#[test]
fn a_damped_body_falls_and_turns_as_its_rates_say_at_any_step() {
    for rate_hz in [30.0, 240.0, 1000.0] {
        let body =
            Rigid::ball(0.1).damping_per_s(3.0, 5.0).gravity_scale(0.5).velocity_m_s([1.0, 0.0, 0.0]).rate_hz(rate_hz);
        let world = started(Scene::builder().add("body", body));
        let object = world.object("body").unwrap();
        world.command(object, Command::velocity(DVec3::X, DVec3::Z * 4.0)).unwrap();
        world.advance(SimSpan::from_millis(1000));
        let (body, t) = state(&world, "body");
        // steps are whole nanoseconds
        let left = |rate: f64| (-rate * t).exp();
        assert!((body.velocity.x - left(3.0)).abs() < 1e-7, "{rate_hz} Hz: {}", body.velocity);
        assert!((body.spin.z - 4.0 * left(5.0)).abs() < 1e-7, "{rate_hz} Hz: {}", body.spin);
        let last = -0.5 * G_M_S2 / 3.0;
        assert!((body.velocity.z - last * (1.0 - left(3.0))).abs() < 1e-7, "{rate_hz} Hz: {}", body.velocity);
    }
}

#[test]
fn a_locked_body_moves_along_its_free_axes_alone() {
    let body = Rigid::cuboid([0.1, 0.2, 0.3]).mass_kg(2.0).turned(DQuat::from_rotation_x(0.4));
    let body = body.lock_translation([false, true, true]).lock_rotation([true, true, false]);
    let world = started(Scene::builder().add("body", body));
    let object = world.object("body").unwrap();
    let push = Command::force(Anchor::Local(DVec3::new(0.0, 0.1, 0.0)), DVec3::new(3.0, 5.0, 7.0));
    world.command(object, push.for_ms(500)).unwrap();
    world.advance(SimSpan::from_millis(800));
    let (body, _) = state(&world, "body");
    assert!((body.velocity.x - 3.0 * 0.5 / 2.0).abs() < 1e-6, "{}", body.velocity);
    assert_eq!((body.velocity.y, body.velocity.z, body.position.y, body.position.z), (0.0, 0.0, 0.0, 0.0));
    assert!(body.spin.truncate().length() < 1e-12 && body.spin.z.abs() > 0.1, "{}", body.spin);
}

#[test]
fn what_lies_on_a_body_that_cannot_move_along_z_does_not_press_it_down() {
    let shelf = Rigid::cuboid([0.2, 0.2, 0.02]).mass_kg(0.5).at([0.0, 0.0, 1.0]).lock_translation([false, false, true]);
    let shelf = shelf.lock_rotation([true; 3]);
    let load = Rigid::cuboid([0.05; 3]).mass_kg(3.0).at([0.1, 0.0, 1.0701]).restitution(0.0);
    let world = started(Scene::builder().add("shelf", shelf).add("load", load));
    world.advance(SimSpan::from_millis(1000));
    let ((shelf, _), (load, _)) = (state(&world, "shelf"), state(&world, "load"));
    assert_eq!((shelf.position.z, shelf.rotation), (1.0, DQuat::IDENTITY));
    assert!((load.position.z - 1.07).abs() < 1e-4 && load.velocity.length() < 1e-3, "{}", load.position);
    // along x the two go together: momentum is kept
    let object = world.object("load").unwrap();
    world.command(object, Command::impulse(Anchor::Local(DVec3::ZERO), DVec3::X * 0.35)).unwrap();
    world.advance(SimSpan::from_millis(500));
    let ((shelf, _), (load, _)) = (state(&world, "shelf"), state(&world, "load"));
    assert!(
        (0.5 * shelf.velocity.x + 3.0 * load.velocity.x - 0.35).abs() < 1e-6,
        "{} {}",
        shelf.velocity,
        load.velocity
    );
    assert!((shelf.velocity.x - 0.1).abs() < 1e-3, "friction takes it along: {}", shelf.velocity);
}

#[test]
fn a_box_that_cannot_turn_slides_down_a_slope_upright() {
    const SLOPE_RAD: f64 = 0.4;
    let lean = DQuat::from_rotation_y(SLOPE_RAD);
    let body = Rigid::cuboid([0.05, 0.05, 0.1]).friction(0.0).restitution(0.0).lock_rotation([true; 3]);
    // it stands on its lower edge
    let reach = 0.05 * SLOPE_RAD.sin() + 0.1 * SLOPE_RAD.cos();
    let up = lean * (DVec3::Z * (reach + 1e-4));
    let scene = Scene::builder().fixed_at("slope", Solid::Plane, [0.0; 3], lean).add("body", body.at(up.to_array()));
    let world = started(scene);
    world.advance(SimSpan::from_millis(500));
    let (before, t0) = state(&world, "body");
    world.advance(SimSpan::from_millis(400));
    let (body, t1) = state(&world, "body");
    assert_eq!(body.rotation, DQuat::IDENTITY);
    let downhill = lean * DVec3::X;
    let m_s2 = (body.velocity - before.velocity).dot(downhill) / (t1 - t0);
    assert!((m_s2 - G_M_S2 * SLOPE_RAD.sin()).abs() < 1e-3 * G_M_S2, "{m_s2}");
}
