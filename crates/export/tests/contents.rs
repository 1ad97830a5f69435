//! Contacts, joints and events in files are what statics and kinematics say.

use glam::DVec3;
use mcap::MessageStream;
use metachron_contact::joint::{JointKind, Motor, MotorGoal};
use metachron_core::SimSpan;
use metachron_export::{McapFile, MomentWriter, Moments, Surface, VtkSeries};
use metachron_geometry::Solid;
use metachron_world::{Rigid, Scene, World, kinds::ExecutorKind};
use serde_json::Value;
use std::path::Path;

const GRAVITY: f64 = 9.81;
const BOX_KG: f64 = 0.5;
const HEIGHT_M: f64 = 0.5;
const RADIUS_M: f64 = 0.05;
const ARM_KG: f64 = 0.3;
const ARM_M: f64 = 0.2;
const SPIN_RAD_S: f64 = 0.4;

/// A box at rest on the floor, a ball that falls beside it, and an arm that a motor turns from lying to hanging.
fn scene() -> Scene {
    let at_rest = Rigid::cuboid([0.1, 0.1, 0.05]).mass_kg(BOX_KG).at([0.0, 0.0, 0.05]).rate_hz(1000.0);
    let ball = Rigid::ball(RADIUS_M).at([1.0, 0.0, HEIGHT_M + RADIUS_M]).rate_hz(1000.0);
    let arm = Rigid::cuboid([ARM_M, 0.01, 0.01]).mass_kg(ARM_KG).at([2.0 + ARM_M, 0.0, 2.0]).rate_hz(1000.0);
    let motor = Some(Motor { goal: MotorGoal::Velocity(-SPIN_RAD_S), max_effort: f64::INFINITY });
    let hinge = JointKind::Revolute { axis: DVec3::Y, range_rad: None, motor };
    let parts = Scene::builder().fixed("floor", Solid::Plane).add("box", at_rest).add("ball", ball).add("arm", arm);
    parts.joint("arm", None, hinge, [2.0, 0.0, 2.0]).joint_name("shoulder").build().unwrap()
}

/// Plays a second at 20 moments a second.
fn export(into: &mut dyn MomentWriter) {
    let world = World::start(&scene(), ExecutorKind::Lockstep).unwrap();
    let mut moments = Moments::of(&world);
    for _ in 0..20 {
        world.advance(SimSpan::from_millis(50));
        into.write(&moments.take()).unwrap();
    }
    into.finish().unwrap();
}

/// The messages of a channel with their times in seconds.
fn messages(path: &Path, topic: &str) -> Vec<(f64, Value)> {
    let bytes = std::fs::read(path).unwrap();
    let all = MessageStream::new(&bytes).unwrap().map(Result::unwrap).filter(|one| one.channel.topic == topic);
    all.map(|one| (one.log_time as f64 * 1e-9, serde_json::from_slice(&one.data).unwrap())).collect()
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_array(["x", "y", "z"].map(|axis| value[axis].as_f64().unwrap()))
}

#[test]
fn contacts_in_mcap_bear_the_weight_of_what_rests() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    export(&mut McapFile::create(&path, &Surface::fixed(&scene())).unwrap());
    let contacts = messages(&path, "/contacts");
    assert_eq!(contacts.len(), 20);
    for (time_s, message) in &contacts[5..] {
        let of_box: Vec<_> =
            message["contacts"].as_array().unwrap().iter().filter(|one| one["object"] == "box").collect();
        let force: DVec3 = of_box.iter().map(|one| vector(&one["force"])).sum();
        assert!((force - DVec3::Z * BOX_KG * GRAVITY).length() < 1e-3 * BOX_KG * GRAVITY, "{force} at {time_s} s");
        for contact in of_box {
            let (point, normal) = (vector(&contact["point"]), vector(&contact["normal"]));
            assert_eq!(contact["with"], "floor");
            assert!(normal.distance(DVec3::Z) < 1e-6 && point.z.abs() < 1e-3, "{normal} {point}");
            assert!(point.x.abs() < 0.11 && point.y.abs() < 0.11, "{point}");
        }
    }
}

#[test]
fn joints_in_mcap_turn_as_their_motor_and_bear_what_hangs_on_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    export(&mut McapFile::create(&path, &Surface::fixed(&scene())).unwrap());
    let states = messages(&path, "/joint_states");
    assert_eq!(states.len(), 20);
    for (time_s, message) in &states[1..] {
        let [joint] = &message["joints"].as_array().unwrap()[..] else { panic!("one joint: {message}") };
        assert_eq!(joint["name"], "shoulder");
        let [position, velocity, effort] = ["position", "velocity", "effort"].map(|of| joint[of].as_f64().unwrap());
        let turned = SPIN_RAD_S * time_s;
        assert!((velocity + SPIN_RAD_S).abs() < 1e-6, "{velocity} rad/s");
        // its own time is at most a step behind
        assert!((position + turned).abs() < 1.1e-3 * SPIN_RAD_S, "{position} rad at {time_s} s");
        let moment_n_m = ARM_KG * GRAVITY * ARM_M * turned.cos();
        assert!((effort - moment_n_m).abs() < 2e-3 * moment_n_m, "{effort} of {moment_n_m} N m");
    }
}

#[test]
fn events_in_mcap_tell_when_the_ball_lands() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    export(&mut McapFile::create(&path, &Surface::fixed(&scene())).unwrap());
    let events = messages(&path, "/events");
    let landed = events.iter().find(|(_, one)| one["name"] == "ball" && one["event"] == "contact_began").unwrap();
    assert!((landed.0 - (2.0 * HEIGHT_M / GRAVITY).sqrt()).abs() < 3e-3, "{} s", landed.0);
    assert_eq!((&landed.1["with"], &landed.1["level"]), (&Value::from("floor"), &Value::from(2)));
    assert!(landed.1["message"].as_str().unwrap().contains("\"ball\" begins to touch \"floor\""), "{}", landed.1);
    assert!(events.iter().any(|(_, one)| one["name"] == "box" && one["event"] == "contact_began"));
}

/// An array of a file of VTK: the bytes after its length, where its declaration says.
fn array(bytes: &[u8], name: &str) -> Vec<u8> {
    let start = bytes.windows(2).position(|two| two == b"\n_").unwrap() + 2;
    let text = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let line = text.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap_or_else(|| panic!("{name}"));
    let offset: usize = line.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let at = start + offset;
    let length = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    bytes[at + 8..at + 8 + length].to_vec()
}

fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|word| f64::from_le_bytes(word.try_into().unwrap())).collect()
}

fn texts(bytes: &[u8]) -> Vec<String> {
    let all = String::from_utf8(bytes.to_vec()).unwrap();
    all.split_terminator('\0').map(str::to_owned).collect()
}

#[test]
fn a_vtk_series_has_names_and_the_forces_of_contacts() {
    let folder = tempfile::tempdir().unwrap();
    export(&mut VtkSeries::create(folder.path(), &scene()).unwrap());
    for index in ["series.pvd", "objects.pvd", "contacts.pvd"] {
        let text = std::fs::read_to_string(folder.path().join(index)).unwrap();
        assert_eq!(text.matches("<DataSet").count(), 20, "{index}");
    }
    let objects = std::fs::read(folder.path().join("objects000019.vtu")).unwrap();
    assert_eq!(texts(&array(&objects, "name")), ["box", "ball", "arm"]);
    let weight_n = BOX_KG * GRAVITY;
    let on_box = DVec3::from_slice(&numbers(&array(&objects, "contact_force"))[..3]);
    assert!((on_box - DVec3::Z * weight_n).length() < 1e-3 * weight_n, "{on_box}");
    let at = DVec3::from_slice(&numbers(&array(&objects, "Points"))[..3]);
    assert!(at.distance(DVec3::Z * 0.05) < 1e-3, "{at}");
    let contacts = std::fs::read(folder.path().join("contacts000019.vtu")).unwrap();
    let names = texts(&array(&contacts, "object_name"));
    assert_eq!(texts(&array(&contacts, "with_name"))[0], "floor");
    let forces = numbers(&array(&contacts, "contact_force"));
    let of_box = names.iter().zip(forces.chunks_exact(3)).filter(|(name, _)| *name == "box");
    let force: DVec3 = of_box.map(|(_, force)| DVec3::from_slice(force)).sum();
    assert!((force - DVec3::Z * weight_n).length() < 1e-3 * weight_n, "{force}");
}
