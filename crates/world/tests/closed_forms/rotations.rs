//! Quaternions of any length are one rotation wherever they are given, and a quaternion of no rotation is refused.

use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body, SimSpan};
use metachron_geometry::Solid;
use metachron_models::rigid::JointKind;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Cast, Command, Rigid, Scene, SceneBuildError, SceneBuilder, SensorOn, Site, Soft, World};

const HALF_M: [f64; 3] = [0.1, 0.05, 0.02];

fn turn() -> DQuat {
    DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, 0.8)
}

/// A scene in which everything that can be turned is turned by `rotation`.
fn turned(rotation: DQuat) -> SceneBuilder {
    let box_at = |x: f64| Rigid::cuboid(HALF_M).turned(rotation).at([x, 0.0, 1.0]);
    let hinge = JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor: None };
    Scene::builder()
        .fixed_at("ramp", Solid::Box { half_extents_m: DVec3::splat(0.5) }, [0.0, 0.0, -2.0], rotation)
        .add("free", box_at(0.0))
        .add("hinged", box_at(1.0))
        .joint("hinged", None, hinge, [1.1, 0.0, 1.0])
        .joint_name("hinge")
        .add("led", Rigid::cuboid(HALF_M).at([2.0, 0.0, 1.0]).keyframe(0.0, [2.0, 0.0, 1.0], rotation))
        .add("soft", Soft::cuboid([0.2, 0.1, 0.1], [2, 1, 1]).turned(rotation).at([3.0, 0.0, 1.0]))
        .add("caged", Soft::cuboid([0.2; 3], [2; 3]).eps_m((0.1, 0.2)).turned(rotation).at([4.0, 0.0, 1.0]))
        .sensor("imu", SensorOn::ImuAt("free".into(), Site { at_m: None, rotation }))
}

/// The visible part of a world in which all is turned by `rotation`, at its start and by commands.
fn seen(rotation: DQuat) -> Vec<f64> {
    let world = World::start(&turned(rotation).build().unwrap(), ExecutorKind::Lockstep).unwrap();
    let [free, led] = world.objects(["free", "led"]).unwrap();
    let mut seen = Vec::new();
    let mut look = |world: &World| {
        for object in world.all_objects() {
            let state = world.latest(object).unwrap();
            match &state.body {
                Body::Soft(soft) => seen.extend(soft.positions.iter().flat_map(|at| at.to_array())),
                body => {
                    let corner = Anchor::Local(DVec3::from_array(HALF_M));
                    seen.extend(body.point(corner).unwrap().0.to_array());
                }
            }
        }
        seen.extend(world.sensor("imu").unwrap().values);
    };
    world.advance(SimSpan::from_millis(50));
    look(&world);
    world.command(free, Command::teleport(DVec3::new(0.0, 0.0, 3.0), rotation)).unwrap();
    world.command(led, Command::pose(DVec3::new(2.0, 1.0, 1.0), rotation * turn())).unwrap();
    world.advance(SimSpan::from_millis(50));
    look(&world);
    let probe = Solid::Box { half_extents_m: DVec3::from_array(HALF_M) };
    let cast = Cast { solid: &probe, rotation, from_m: DVec3::ZERO, direction: DVec3::NEG_Z, reach_m: 9.0 };
    seen.push(world.cast(&cast).unwrap().unwrap().distance_m);
    seen
}

#[test]
fn a_quaternion_of_any_length_turns_as_one_of_length_one_does() {
    let expected = seen(turn());
    for length in [0.1, 7.0] {
        let found = seen(turn() * length);
        assert_eq!(found.len(), expected.len());
        // a rotation is rounded where it is brought to its length; contact and hinge bring that to their tolerance
        let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-8, "length {length}: {off}");
    }
}

#[test]
fn a_quaternion_that_is_no_rotation_is_refused_wherever_it_is_given() {
    for none in [DQuat::from_array([0.0; 4]), DQuat::from_array([0.0, f64::NAN, 0.0, 1.0])] {
        let build = |builder: SceneBuilder| builder.build().unwrap_err();
        let rigid = build(Scene::builder().add("box", Rigid::cuboid(HALF_M).turned(none)));
        assert_eq!(rigid, SceneBuildError::BadRotation { name: "box".to_owned(), found: none.to_string() });
        let soft = build(Scene::builder().add("jelly", Soft::cuboid([0.1; 3], [1; 3]).turned(none)));
        assert!(matches!(soft, SceneBuildError::BadRotation { .. }), "{soft}");
        let fixed = build(Scene::builder().fixed_at("ramp", Solid::Plane, [0.0; 3], none));
        assert!(
            fixed.to_string().contains("\"ramp\" is turned by") && fixed.to_string().contains("finite and not zero")
        );
        let imu = SensorOn::ImuAt("box".into(), Site { at_m: None, rotation: none });
        let imu = build(Scene::builder().add("box", Rigid::cuboid(HALF_M)).sensor("imu", imu));
        assert!(matches!(imu, SceneBuildError::BadSite { .. }), "{imu}");
        let scene = Scene::builder().add("box", Rigid::cuboid(HALF_M)).add("led", Rigid::cuboid(HALF_M).kinematic());
        let world = World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap();
        let [body, led] = world.objects(["box", "led"]).unwrap();
        for (object, command) in [(body, Command::teleport(DVec3::Z, none)), (led, Command::pose(DVec3::Z, none))] {
            let refused = world.command(object, command).unwrap_err().to_string();
            assert!(refused.contains("finite and not zero"), "{refused}");
        }
        let solid = Solid::Ball { radius_m: 0.1 };
        assert!(world.overlapping(&solid, DVec3::ZERO, none).is_err());
        assert!(world.add("joins", Rigid::cuboid(HALF_M).turned(none)).is_err());
    }
}
