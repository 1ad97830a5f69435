//! Readings of sensors against closed forms of mechanics.

use glam::{DMat3, DQuat, DVec3};
use metachron_contact::joint::{JointKind, Motor, MotorGoal};
use metachron_core::{Anchor, Body, SimSpan};
use metachron_geometry::Solid;
use metachron_models::rigid::GivenInertia;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Command, Rigid, Scene, SceneBuildError, SensorOn, Site, World, WorldError};

const G_M_S2: f64 = 9.81;

fn values(world: &World, sensor: &str) -> Vec<f64> {
    world.sensor(sensor).unwrap().values
}

/// An arm of 0.5 kg that hangs 0.2 m beside a hinge about y, which a stiff motor holds.
fn arm() -> World {
    let goal = MotorGoal::Spring { position: 0.0, velocity: 0.0, stiffness: 500.0, damping: 20.0 };
    let motor = Some(Motor { goal, max_effort: f64::INFINITY });
    let hinge = JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor };
    let mount = Rigid::cuboid([0.05; 3]).mass_kg(1.0).kinematic();
    let scene = Scene::builder()
        .add("mount", mount)
        .add("arm", Rigid::cuboid([0.1, 0.02, 0.02]).mass_kg(0.5).at([0.2, 0.0, 0.0]))
        .joint("mount", Some("arm"), hinge, [0.0; 3])
        .joint_name("elbow")
        .sensor("angle", SensorOn::JointPosition("elbow".into()))
        .sensor("rate", SensorOn::JointVelocity("elbow".into()))
        .sensor("torque", SensorOn::JointEffort("elbow".into()))
        .sensor("tip", SensorOn::Pose("arm".into(), [0.1, 0.0, 0.0]))
        .sensor("imu", SensorOn::Imu("arm".into()));
    World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap()
}

#[test]
fn a_held_hinge_reads_its_sag_and_the_torque_of_what_hangs_on_it() {
    let world = arm();
    world.advance(SimSpan::from_millis(3000));
    // about +y the weight at +x turns forwards, so the motor gives back −m g l; its spring sags by that over its stiffness
    let torque = 0.5 * G_M_S2 * 0.2;
    let (angle, read) = (values(&world, "angle")[0], values(&world, "torque")[0]);
    assert!((read + torque).abs() < 1e-3 * torque, "{read} instead of {}", -torque);
    assert!((angle - torque / 500.0).abs() < 1e-3 * torque / 500.0, "{angle}");
    assert!(values(&world, "rate")[0].abs() < 1e-6);
    let tip = values(&world, "tip");
    let (place, rotation) = (DVec3::from_slice(&tip[..3]), DQuat::from_slice(&tip[3..]));
    let turned = DQuat::from_rotation_y(angle);
    assert!(rotation.angle_between(turned) < 1e-5 && place.distance(turned * (DVec3::X * 0.3)) < 1e-5, "{place}");
    // an accelerometer at rest reads g upwards, in its own axes
    let imu = values(&world, "imu");
    let felt = turned.conjugate() * (DVec3::Z * G_M_S2);
    assert!(DVec3::from_slice(&imu[..3]).distance(felt) < 1e-3, "{imu:?}");
    assert!(DVec3::from_slice(&imu[3..]).length() < 1e-5, "{imu:?}");
}

#[test]
fn a_motor_by_name_drives_its_joint_and_the_sensors_see_it() {
    let world = arm();
    let elbow = world.joint("elbow").unwrap();
    assert_eq!((elbow.body(), elbow.number()), (world.object("mount").unwrap(), 0));
    let spin = Motor { goal: MotorGoal::Velocity(2.0), max_effort: f64::INFINITY };
    world.command(elbow.body(), elbow.motor(spin)).unwrap();
    world.advance(SimSpan::from_millis(500));
    assert!((values(&world, "rate")[0] - 2.0).abs() < 1e-6, "{:?}", values(&world, "rate"));
    // it has turned for half a second, less the step in which it was told
    assert!((values(&world, "angle")[0] - 1.0).abs() < 0.02, "{:?}", values(&world, "angle"));
    // gyroscope, and the centripetal acceleration of its middle, besides gravity
    let imu = values(&world, "imu");
    assert!((imu[4] - 2.0).abs() < 1e-6, "{imu:?}");
    let angle = values(&world, "angle")[0];
    let along = -0.2 * 4.0 - G_M_S2 * angle.sin();
    assert!((imu[0] - along).abs() < 0.05, "{imu:?} instead of {along} along the arm");
}

#[test]
fn contact_sensors_tell_one_partner_from_all() {
    let cube = |z: f64| Rigid::cuboid([0.1; 3]).mass_kg(2.0).restitution(0.0).at([0.0, 0.0, z]);
    let scene = Scene::builder()
        .fixed("floor", Solid::Plane)
        .add("lower", cube(0.1))
        .add("upper", cube(0.3))
        .sensor("all", SensorOn::ContactForce("lower".into()))
        .sensor("floor", SensorOn::ContactBetween("lower".into(), "floor".into()))
        .sensor("upper", SensorOn::ContactBetween("lower".into(), "upper".into()))
        .sensor("fall", SensorOn::Imu("upper".into()));
    let world = World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(1500));
    let weight_n = 2.0 * G_M_S2;
    for (sensor, weights) in [("all", 1.0), ("floor", 2.0), ("upper", -1.0)] {
        let force_n = DVec3::from_slice(&values(&world, sensor));
        assert!(force_n.distance(DVec3::Z * weights * weight_n) < 1e-2 * weight_n, "{sensor}: {force_n}");
    }
    // in free fall an accelerometer reads nothing
    let upper = world.object("upper").unwrap();
    world.command(upper, Command::teleport(DVec3::Z * 2.0, DQuat::IDENTITY)).unwrap();
    world.advance(SimSpan::from_millis(100));
    assert!(DVec3::from_slice(&values(&world, "fall")[..3]).length() < 1e-9, "{:?}", values(&world, "fall"));
}

/// A lopsided body with an IMU at a site, that floats.
struct Floating {
    world: World,
    site: Site,
    /// From the centre of mass to the site, metres, in the axes of the body.
    arm_m: DVec3,
}

/// The reading of an IMU, in the axes of its site.
struct Imu {
    specific_force_m_s2: DVec3,
    spin: DVec3,
}

fn floating(rate_hz: f64) -> Floating {
    let com_m = DVec3::new(0.02, -0.01, 0.0);
    let about_com_kg_m2 = DMat3::from_diagonal(DVec3::new(0.01, 0.02, 0.025));
    let site = Site { at_m: Some(DVec3::new(0.15, 0.08, 0.03)), rotation: DQuat::from_rotation_y(0.7) };
    let body = Rigid::cuboid([0.2, 0.1, 0.05]).mass_kg(2.0).inertia(GivenInertia { com_m, about_com_kg_m2 });
    let scene = Scene::builder()
        .gravity([0.0; 3])
        .add("body", body.rate_hz(rate_hz))
        .sensor("imu", SensorOn::ImuAt("body".into(), site));
    let world = World::start(&scene.build().unwrap(), ExecutorKind::Lockstep).unwrap();
    Floating { world, site, arm_m: site.at_m.unwrap() - com_m }
}

impl Floating {
    fn read(&self) -> Imu {
        let read = values(&self.world, "imu");
        Imu { specific_force_m_s2: DVec3::from_slice(&read[..3]), spin: DVec3::from_slice(&read[3..]) }
    }

    /// The reading at the site of a body that turns about its own z, rad/s and rad/s².
    fn closed_form(&self, spin: f64, angular_acceleration: f64) -> Imu {
        let (spin, angular, to_site) =
            (DVec3::Z * spin, DVec3::Z * angular_acceleration, self.site.rotation.conjugate());
        let there = angular.cross(self.arm_m) + spin.cross(spin.cross(self.arm_m));
        Imu { specific_force_m_s2: to_site * there, spin: to_site * spin }
    }
}

fn check_imu(read: &Imu, expected: &Imu, tolerance_m_s2: f64) {
    let (a, b) = (read.specific_force_m_s2, expected.specific_force_m_s2);
    assert!(a.distance(b) < tolerance_m_s2, "{a} m/s² of {b} m/s²");
    assert!(read.spin.distance(expected.spin) < 1e-9, "{} rad/s of {} rad/s", read.spin, expected.spin);
}

#[test]
fn a_site_on_a_body_that_spins_steadily_feels_its_centripetal_acceleration() {
    let floating = floating(240.0);
    let world = &floating.world;
    world.command(world.object("body").unwrap(), Command::velocity(DVec3::X, DVec3::Z * 5.0)).unwrap();
    world.advance(SimSpan::from_millis(300));
    check_imu(&floating.read(), &floating.closed_form(5.0, 0.0), 1e-9);
}

#[test]
fn a_site_on_a_body_that_spins_up_feels_the_tangential_acceleration_too() {
    let floating = floating(1000.0);
    let world = &floating.world;
    let body = world.object("body").unwrap();
    let torque = Command::torque(Anchor::Local(DVec3::ZERO), DVec3::Z * 0.05);
    world.command(body, torque).unwrap();
    world.advance(SimSpan::from_millis(500));
    // α = τ / I, and the spin is its integral
    let Body::Rigid(state) = world.latest(body).unwrap().body else { panic!("rigid") };
    assert!((state.spin.z - 1.0).abs() < 5e-3, "{}", state.spin);
    check_imu(&floating.read(), &floating.closed_form(state.spin.z, 0.05 / 0.025), 1e-6);
}

#[test]
fn names_that_there_are_not_are_told_with_those_that_there_are() {
    let world = arm();
    let text = |error: WorldError| error.to_string();
    assert!(text(world.joint("knee").unwrap_err()).contains("[elbow]"));
    assert!(text(world.joint("").unwrap_err()).contains("no joint"));
    assert!(text(world.sensor("nose").unwrap_err()).contains("angle, rate"));
    let with = |on| Scene::builder().add("ball", Rigid::ball(0.1)).sensor("s", on).build().unwrap_err();
    for on in [SensorOn::Imu("bat".into()), SensorOn::JointPosition("bat".into()), SensorOn::ContactForce("bat".into())]
    {
        let error = with(on);
        assert!(matches!(error, SceneBuildError::NoMount { .. }) && error.to_string().contains("\"bat\""), "{error}");
    }
    let nowhere = Site { at_m: Some(DVec3::NAN), ..Site::default() };
    let error = with(SensorOn::ImuAt("ball".into(), nowhere)).to_string();
    assert!(error.contains("\"s\"") && error.contains("finite"), "{error}");
}
