//! Worlds built in code against closed forms, on every executor.

use glam::{DQuat, DVec3};
use metachron_core::{Body, ContactPartner, SimSpan, Snapshot};
use metachron_geometry::{CollisionGroups, CompoundPart, ContactTraits, Obstacle, Solid};
use metachron_models::rigid::{JointKind, Motor, MotorGoal};
use metachron_runtime::Command;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Part, Rigid, Scene, SceneBuildError, Soft, Tube, World, WorldError, static_solid};

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

fn span(seconds: f64) -> SimSpan {
    SimSpan::from_secs_f64(seconds).unwrap()
}

fn height_m(state: &Snapshot) -> f64 {
    let Body::Rigid(body) = &state.body else { panic!("a rigid body") };
    body.position.z
}

fn falling_ball() -> Scene {
    Scene::builder().add("ball", Rigid::ball(0.02).at([0.0, 0.0, 10.0]).rate_hz(500.0)).build().unwrap()
}

#[test]
fn a_falling_ball_is_where_its_own_time_puts_it_on_every_executor() {
    for executor in EXECUTORS {
        let world = World::start(&falling_ball(), executor).unwrap();
        let ball = world.object("ball").unwrap();
        world.advance(span(0.2));
        let state = world.latest(ball).unwrap();
        let t = state.time.as_secs_f64();
        assert!(t >= 0.199, "{executor:?}: {t} s");
        let expected = 10.0 - 0.5 * 9.81 * t * t;
        // flight is exact in f64: tens of roundings at 10 m
        assert!((height_m(&state) - expected).abs() < 1e-12, "{executor:?}: {} for {expected}", height_m(&state));
        let before = world.time();
        std::thread::sleep(std::time::Duration::from_millis(20));
        assert_eq!(before, world.time(), "{executor:?}: time stands between two advances");
        assert_eq!(world.stop().len(), 1);
    }
}

#[test]
fn a_ball_comes_to_rest_on_the_floor_it_was_given() {
    let scene = Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("ball", Rigid::ball(0.05).mass_kg(0.2).restitution(0.0).at([0.0, 0.0, 0.2]))
        .build();
    let world = World::start(&scene.unwrap(), ExecutorKind::Lockstep).unwrap();
    world.advance(span(2.0));
    let height = height_m(&world.latest(world.object("ball").unwrap()).unwrap());
    assert!((height - 0.05).abs() < 1e-4, "{height} m"); // the allowed overlap of a body at rest
}

#[test]
fn a_clamped_tube_sags_as_a_beam_does() {
    let (radius, length, young) = (0.01, 0.2, 1e7);
    let path = [[0.0; 3], [length, 0.0, 0.0]];
    let tube = Tube::along(&path).radius_m(radius).young_pa(young).clamp([true, false]).damping_per_s(30.0);
    let world = World::start(&Scene::builder().add("beam", tube).build().unwrap(), ExecutorKind::Lockstep).unwrap();
    world.advance(span(3.0));
    let state = world.latest(world.object("beam").unwrap()).unwrap();
    let (tip, _) = state.body.probe(1.0).unwrap();
    let (area, second) = (std::f64::consts::PI * radius * radius, std::f64::consts::FRAC_PI_4 * radius.powi(4));
    let sag = 1050.0 * area * 9.81 * length.powi(4) / (8.0 * young * second);
    // Euler and Bernoulli, 1.3 % of the length: shear and large deflection add a few per cent
    assert!((-tip.z / sag - 1.0).abs() < 0.05, "{} for {sag} m", -tip.z);
}

#[test]
fn two_lockstep_worlds_reach_the_same_bits_however_time_is_divided() {
    let run = |parts: u32| {
        let world = World::start(&falling_ball(), ExecutorKind::Lockstep).unwrap();
        (0..parts).for_each(|_| world.advance(span(0.5 / f64::from(parts))));
        world.hash()
    };
    assert_eq!(run(1), run(2));
    assert_ne!(run(1), World::start(&falling_ball(), ExecutorKind::Lockstep).unwrap().hash());
}

#[test]
fn clones_share_one_world_and_a_stopped_world_keeps_its_state() {
    let world = World::start(&falling_ball(), ExecutorKind::Lockstep).unwrap();
    let other = world.clone();
    world.advance(span(0.1));
    assert_eq!(world.hash(), other.hash());
    other.stop();
    let stopped = world.hash();
    world.advance(span(0.1));
    assert_eq!(world.hash(), stopped);
}

#[test]
fn an_invalid_scene_is_refused_with_the_name_of_the_object() {
    let twice = Scene::builder().fixed("a", Solid::Plane).add("a", Rigid::ball(0.1)).build();
    assert_eq!(twice.unwrap_err(), SceneBuildError::SameName { name: "a".to_owned() });
    for rate_hz in [0.0, f64::NAN, -1.0, f64::INFINITY, 1e9] {
        let scene = Scene::builder().add("b", Rigid::ball(0.1).rate_hz(rate_hz)).build();
        assert!(matches!(scene, Err(SceneBuildError::BadRate { .. })), "{rate_hz}");
    }
    for tube in [Tube::along(&[]), Tube::along(&[[0.0; 3]; 2]), Tube::along(&[[0.0; 3], [1.0, 0.0, 0.0]]).wall_m(1.0)] {
        assert!(matches!(Scene::builder().add("t", tube).build(), Err(SceneBuildError::BadObject { .. })));
    }
    let world = World::start(&falling_ball(), ExecutorKind::Lockstep).unwrap();
    assert!(matches!(world.object("bal"), Err(WorldError::NoObject { .. })));
}

#[test]
fn a_pressure_that_a_program_sets_widens_a_tube_on_every_executor() {
    let (radius_m, wall_m, young_pa) = (0.01, 1e-3, 1e6);
    let tube = || {
        let path = [[0.0; 3], [0.1, 0.0, 0.0]];
        Tube::along(&path).radius_m(radius_m).wall_m(wall_m).young_pa(young_pa).clamp([true, true])
    };
    for executor in EXECUTORS {
        let world = World::start(&Scene::builder().add("hose", tube()).build().unwrap(), executor).unwrap();
        let hose = world.object("hose").unwrap();
        let radius = || {
            let Body::Curve(curve) = &world.latest(hose).unwrap().body else { panic!("a tube is a curve") };
            curve.radii_m[0]
        };
        world.advance(span(0.1));
        assert_eq!(radius(), radius_m);
        let pressure_pa = 5000.0;
        world.command(hose, Command::pressure(pressure_pa)).unwrap();
        world.advance(span(0.2));
        // of a prescribed wall: p r² (1 − ν/2)/(E t)
        let poisson = 0.45;
        let wanted_m = pressure_pa * radius_m * radius_m * (1.0 - 0.5 * poisson) / (young_pa * wall_m);
        assert!(((radius() - radius_m) / wanted_m - 1.0).abs() < 1e-9, "{executor:?}: {} m", radius() - radius_m);
        assert!(world.command(hose, Command::pressure(f64::NAN)).is_err());
    }
}

#[test]
fn a_sensor_a_motor_and_groups_are_said_in_code_as_in_scenes() {
    let sensor = ContactTraits { is_sensor: true, ..ContactTraits::NONE };
    let ghost =
        ContactTraits { groups: CollisionGroups { member_of: 0b01, collides_with: 0b01 }, ..ContactTraits::NONE };
    let grounded =
        ContactTraits { groups: CollisionGroups { member_of: 0b10, collides_with: 0b10 }, ..ContactTraits::NONE };
    let still =
        |name: &str, solid, z: f64, traits| Obstacle { position: DVec3::Z * z, traits, ..Obstacle::new(name, solid) };
    let motor = Some(Motor { goal: MotorGoal::Velocity(2.0), max_effort: f64::INFINITY });
    let hinge = JointKind::Revolute { axis: DVec3::Z, range_rad: None, motor };
    let gate = Solid::Box { half_extents_m: DVec3::splat(0.1) };
    let builder = Scene::builder()
        .obstacle(still("floor", Solid::Plane, 0.0, grounded))
        .obstacle(still("gate", gate, 0.3, sensor))
        .add("ghost", Rigid::ball(0.05).at([0.0, 0.0, 0.6]).contact(ghost))
        .add("wheel", Rigid::ball(0.05).at([2.0, 0.0, 1.0]));
    // the motor turns the world by 2 rad/s against the wheel, body `a`: the wheel turns by −2 rad/s
    let scene = builder.clone().joint("wheel", None, hinge, [2.0, 0.0, 1.0]).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(span(1.0));
    let state = world.latest(world.object("ghost").unwrap()).unwrap();
    assert!(height_m(&state) < -3.0, "it falls through the floor: {} m", height_m(&state));
    let [touch] = state.sensed.as_slice() else { panic!("{:?}", state.sensed) };
    assert_eq!((touch.with, touch.begins, touch.ends), (ContactPartner::Static(1), 1, 1));
    let Body::Rigid(wheel) = &world.latest(world.object("wheel").unwrap()).unwrap().body.clone() else {
        panic!("a rigid body")
    };
    assert!((wheel.spin.z + 2.0).abs() < 1e-3, "{}", wheel.spin);
    assert_eq!(wheel.position, DVec3::new(2.0, 0.0, 1.0).with_z(wheel.position.z));
    let nobody = builder.clone().joint("wheel", Some("nobody"), hinge, [0.0; 3]).build().unwrap_err();
    assert_eq!(nobody, SceneBuildError::NoBody { name: "nobody".to_owned() });
    let endless = JointKind::Rope { length_m: f64::NAN };
    assert!(matches!(builder.joint("wheel", None, endless, [0.0; 3]).build(), Err(SceneBuildError::BadJoint { .. })));
}

#[test]
fn a_static_solid_is_as_rough_as_a_body_may_be() {
    for (friction, restitution) in [(-1.0, 0.0), (f64::NAN, 0.0), (0.5, 1.5)] {
        let floor = Obstacle { friction, restitution, ..static_solid("floor", Solid::Plane) };
        let error = Scene::builder().obstacle(floor).build().unwrap_err().to_string();
        assert!(error.contains("\"floor\"") && error.contains("expected a number from 0 to"), "{error}");
    }
}

#[test]
fn parts_and_spacings_out_of_range_are_refused_with_what_is_expected() {
    let part = |x: f64, density: f64| {
        let ball = Solid::Ball { radius_m: 0.1 };
        CompoundPart { density, ..CompoundPart::new(ball, DVec3::X * x, DQuat::IDENTITY) }
    };
    let sheet = Soft::sheet([0.5, 0.5], 0.01, [4, 4]);
    let parts: [(Part, &str); 5] = [
        (Rigid::compound([]).into(), "has 0 parts"),
        (Rigid::compound([part(0.0, 1e308)]).into(), "expected 1e-9 to 1e9"),
        (Rigid::compound([part(0.0, 1e-320)]).into(), "expected 1e-9 to 1e9"),
        (Rigid::compound([part(1e30, 1.0)]).into(), "expected within 1000000 m"),
        (sheet.eps_m((0.1, 0.01)).into(), "no finer than the finest"),
    ];
    for (part, expected) in parts {
        let said = Scene::builder().add("a", part).build().expect_err(expected).to_string();
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn a_scene_that_no_world_can_start_is_not_built_and_its_object_is_named() {
    let line = [[0.0; 3], [1.0, 0.0, 0.0]];
    let rope = || Soft::rope(&line, 0.01, 8);
    let parts: [(Part, &str); 16] = [
        (Rigid::ball(-0.1).into(), "radius"),
        (Rigid::ball(f64::NAN).into(), "NaN"),
        (Rigid::ball(0.1).mass_kg(0.0).into(), "mass_kg is 0; expected a number from 0.000000001 to 1000000000 kg"),
        (Rigid::ball(0.1).mass_kg(f64::NAN).into(), "mass_kg is NaN"),
        (Rigid::ball(0.1).at([f64::NAN, 0.0, 0.0]).into(), "position"),
        (Rigid::ball(0.1).velocity_m_s([0.0, f64::INFINITY, 0.0]).into(), "velocity"),
        (Rigid::ball(0.1).restitution(1.1).into(), "restitution is 1.1; expected a number from 0 to 1"),
        (Rigid::new(Solid::Plane).into(), "a plane cannot be a moving body"),
        (Rigid::ball(0.1).kinematic().friction(f64::NAN).into(), "friction is NaN"),
        (Soft::cuboid([0.1; 3], [2; 3]).poisson(0.5).into(), "poisson is 0.5; expected a number from 0 to 0.499"),
        (Soft::cuboid([0.1; 3], [2; 3]).young_pa(f64::NAN).into(), "young_pa is NaN"),
        (rope().at([f64::NAN, 0.0, 0.0]).into(), "position"),
        (Soft::rope(&line[..1], 0.01, 8).into(), "at least two different points"),
        (Tube::along(&line[..1]).into(), "has 1 points; expected at least 2"),
        (Tube::along(&line).young_pa(f64::NAN).into(), "young_pa is NaN"),
        (Tube::along(&line).wall_m(0.02).into(), "wall_m is 0.02"),
    ];
    for (part, expected) in parts {
        let scene = Scene::builder().fixed("floor", Solid::Plane).add("odd one", part.clone());
        let error = scene.build().expect_err(expected);
        assert!(matches!(&error, SceneBuildError::BadObject { name, .. } if name == "odd one"), "{error:?}");
        assert!(error.to_string().contains("\"odd one\"") && error.to_string().contains(expected), "{error}");
        let world = World::start(&Scene::builder().build().unwrap(), ExecutorKind::Lockstep).unwrap();
        assert!(world.add("odd one", part).unwrap_err().to_string().contains(expected), "{expected}");
    }
    let falling = Scene::builder().gravity([0.0, 0.0, f64::NAN]).add("ball", Rigid::ball(0.1)).build();
    assert!(falling.unwrap_err().to_string().contains("gravity"));
    let hollow = Scene::builder().fixed("floor", Solid::Ball { radius_m: -1.0 }).build();
    assert!(hollow.unwrap_err().to_string().contains("\"floor\""));
    for depth_m in [0.0, f64::NAN] {
        let deep = Scene::builder().contact_depth_m(depth_m).build();
        assert!(matches!(deep, Err(SceneBuildError::BadContact { .. })));
    }
}
