//! Models that no one means, which end with an error or a list.

use crate::play::{advance, left_out, read_from, start};
use metachron_import::{ImportError, Imported, Options, mjcf, model};
use std::path::Path;

fn import(text: &str) -> Result<Imported, ImportError> {
    mjcf(text, Path::new("."))
}

#[test]
fn a_body_that_is_held_to_itself_is_refused() {
    for (kind, anchor) in [("weld", ""), ("connect", "anchor=\"0 0 0\"")] {
        let error = import(&format!(
            "<mujoco><worldbody><body name=\"a\"><freejoint/><geom size=\"0.1\"/></body></worldbody>
            <equality><{kind} body1=\"a\" body2=\"a\" {anchor}/></equality></mujoco>"
        ));
        let expected = format!("line 2: equality, {kind}: holds a body to itself; expected two bodies");
        assert_eq!(error.unwrap_err().to_string(), expected);
    }
}

#[test]
fn many_loops_of_bodies_without_mass_end() {
    let bodies: String = (0..80).map(|i| format!("<body name=\"{i}\"><joint/>")).collect();
    let connect = |i: usize| format!("<connect body1=\"{i}\" body2=\"{}\" anchor=\"0 0 0\"/>", i - 2);
    let text = format!(
        "<mujoco><worldbody>{bodies}{}</worldbody><equality>{}</equality></mujoco>",
        "</body>".repeat(80),
        (2..80).map(connect).collect::<String>()
    );
    let error = import(&text).unwrap_err().to_string();
    assert!(error.starts_with("line 1: body `0`: has no mass"), "{error}");
}

#[test]
fn moments_beyond_all_numbers_are_refused_large_ones_stay_and_ones_of_rounding_are_raised() {
    let text = |moment: &str| {
        format!(
            "<mujoco><worldbody><body name=\"a\"><freejoint/>
            <inertial mass=\"1\" diaginertia=\"{moment} {moment} {moment}\"/></body></worldbody></mujoco>"
        )
    };
    let error = import(&text("1e308")).unwrap_err().to_string();
    let expected = "line 1: body `a`: has moments of inertia that no body can have; expected some with a finite sum";
    assert_eq!(error, expected);
    assert_eq!(left_out(&import(&text("1e200")).unwrap()), [""; 0]);
    // 2/5 m r² of a ball of 1 kg and 1 cm
    let raised = "line 1: body `a`: has moments of inertia that no body has: 4.000e-5 kg·m² is added to each";
    assert_eq!(left_out(&import(&text("1e-120")).unwrap()), [raised]);
}

#[test]
fn what_holds_a_body_without_mass_holds_the_one_that_it_is_part_of() {
    // a flange without mass on a body that would fall, held to a post or to that body itself
    let text = |other: &str| {
        format!(
            r#"<mujoco><worldbody><body name="post"><geom size="0.1"/></body>
            <body name="arm" pos="1 0 0"><freejoint/><geom size="0.1"/><body name="flange" pos="0 0 1"/></body></worldbody>
            <equality><weld body1="flange" body2="{other}"/></equality></mujoco>"#
        )
    };
    let held = import(&text("post")).unwrap();
    assert_eq!(left_out(&held), [""; 0]);
    let world = start(&held, &[], 500.0);
    advance(&world, 0.5);
    let metachron_core::Body::Rigid(state) = world.latest(world.object("arm").unwrap()).unwrap().body else {
        panic!("a rigid body")
    };
    // it would fall by more than a metre; the error of a weld after the steps is microns
    assert!(state.position.distance(glam::DVec3::X) < 1e-4, "{}", state.position);
    assert_eq!(
        left_out(&import(&text("arm")).unwrap()),
        ["line 3: equality, weld: is left out: both of its ends are on one body"]
    );
}

/// The parts that are left out of a model with one mesh.
fn noted_of(file: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(file), bytes).unwrap();
    let text = format!(
        r#"<mujoco><asset><mesh name="m" file="{file}" scale="1 1 2"/></asset><worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>"#
    );
    left_out(&model(&text, read_from(folder.path()), &Options::default()).unwrap()).join("\n")
}

/// A Collada file with as many instances of four points as `instances`, and the attributes of its accessor.
fn dae(points: &str, accessor: &str, instances: usize) -> String {
    format!(
        r##"<COLLADA><geometry id="g"><mesh><source id="s"><float_array>{points}</float_array><accessor {accessor}/></source>
        <vertices><input semantic="POSITION" source="#s"/></vertices></mesh></geometry><visual_scene><node>{}</node>
        </visual_scene></COLLADA>"##,
        r##"<instance_geometry url="#g"/>"##.repeat(instances)
    )
}

#[test]
fn collada_files_of_many_instances_are_read_once_and_bounded() {
    let four = "0 0 0 1 0 0 0 1 0 0 0 1";
    assert_eq!(noted_of("a.dae", dae(four, r#"count="4" stride="3""#, 1).as_bytes()), "");
    // a large array as often as the budget has room for: each time anew, it would take minutes
    let large = format!("{four} ") + &"0.1 0.1 0.1 ".repeat(100_000);
    let noted = noted_of("a.dae", dae(&large, "", 20_000).as_bytes());
    assert!(noted.ends_with("`a.dae`: it has more than 3000000 points"), "{noted}");
    for accessor in
        [r#"stride="2""#, r#"offset="13""#, r#"count="5" stride="3""#, r#"count="18446744073709551615" stride="9""#]
    {
        let noted = noted_of("a.dae", dae(four, accessor, 1).as_bytes());
        assert!(noted.contains("`a.dae`: its positions from ") && noted.ends_with("are not in 12 numbers"), "{noted}");
    }
}

#[test]
fn a_control_is_within_its_range_at_the_start() {
    let text = r#"<mujoco><compiler angle="radian"/><worldbody><body><joint name="hinge"/><geom size="0.1"/></body></worldbody>
        <actuator><position joint="hinge" kp="5" ctrlrange="-1 1"/><motor joint="hinge" ctrlrange="-1 1"/>
        <motor joint="hinge" ctrlrange="2 3"/></actuator></mujoco>"#;
    let imported = import(text).unwrap();
    let what = "is commanded 2 and not 0, the end of its `ctrlrange`: programs command joints without one";
    let acts = "is left out: it acts without a program, too, and scenes have servos of joints alone";
    assert_eq!(
        left_out(&imported),
        [
            format!("line 3: actuator, motor: {what}"),
            format!("line 3: actuator, motor: {acts}"),
            "line 2: actuator, motor: is left out: it gives what a program commands".to_owned(),
        ]
    );
    let servo = import(&text.replace("kp=\"5\" ctrlrange=\"-1 1\"", "kp=\"5\" ctrlrange=\"0.5 1\"")).unwrap();
    assert!(servo.toml.contains("position_deg = 28.64"), "{}", servo.toml); // half a radian
}

#[test]
fn equalities_between_sites_are_not_said_to_couple_joints_and_those_at_a_keyframe_are_listed() {
    let text = r#"<mujoco><worldbody><body name="a"><freejoint/><geom size="0.1"/></body></worldbody>
        <equality><weld body1="a"/><weld site1="s" site2="t"/></equality>
        <keyframe><key name="k" qpos="1 0 0 1 0 0 0"/></keyframe></mujoco>"#;
    let sites =
        "line 2: equality, weld: is left out: it is between sites; expected `body1`, and of `connect` an `anchor`";
    assert_eq!(left_out(&import(text).unwrap())[0], sites);
    let keyed = model(text, Path::new("."), &Options { key: Some("k"), ..Options::default() }).unwrap();
    let held = "line 2: equality, weld: holds its bodies as they start, not as they are without the keyframe";
    assert_eq!(left_out(&keyed)[..2], [held, sites]);
}

#[test]
fn points_that_no_scene_has_are_listed_with_their_file() {
    let binary = |x: f32| {
        let counts = [3, 0, 0, 0_i32].into_iter().flat_map(i32::to_le_bytes);
        let numbers = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, x];
        counts.chain(numbers.into_iter().flat_map(f32::to_le_bytes)).collect::<Vec<u8>>()
    };
    let text = |x: &str| dae(&format!("0 0 0 1 0 0 {x} 1 0"), "", 1).into_bytes();
    let (none, far) = ("point 3 is not finite", "point 3 is more than 100000 m from its origin");
    for (file, bytes, why) in [
        ("a.msh", binary(f32::NAN), none),
        ("a.msh", binary(6e4), far), // the file is stretched to twice that
        ("a.dae", text("inf"), none),
        ("a.dae", text("1e300"), far),
    ] {
        let noted = noted_of(file, &bytes);
        assert!(noted.ends_with(&format!("`{file}`: {why}")), "{noted}");
    }
    let cut = noted_of("a.stl", b"solid a\nfacet normal 0 0 1\n");
    assert!(cut.ends_with("`a.stl`: its text has no vertex: it is cut short, or no STL file"), "{cut}");
}

#[test]
fn a_file_that_cannot_be_read_is_read_once_and_files_that_nothing_names_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.msh"), "no mesh").unwrap();
    let reads = std::cell::Cell::new(0);
    let read = |path: &Path| {
        reads.set(reads.get() + 1);
        std::fs::read(path)
    };
    let folders = metachron_import::Folders { read: Some(&read), ..read_from(folder.path()) };
    let geom = r#"<geom type="mesh" mesh="a"/><geom type="mesh" mesh="b"/>"#.repeat(10);
    // one body is touched by its ball alone: its ellipsoid is left out
    let text = format!(
        r#"<mujoco><asset><mesh file="a.msh"/><mesh name="b" file="./a.msh"/></asset><worldbody>{geom}
        <body name="c"><freejoint/><inertial mass="1" diaginertia="1 1 1"/><geom size="0.1"/>
        <geom type="ellipsoid" size="1 2 3" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#
    );
    let imported = model(&text, folders, &Options::default()).unwrap();
    assert_eq!((imported.left_out.len(), reads.get(), imported.files.len()), (21, 1, 0), "{:?}", left_out(&imported));
}

#[test]
fn no_new_mesh_has_the_path_of_one_that_the_scene_names() {
    let folder = tempfile::tempdir().unwrap();
    for place in ["meshes", "other"] {
        std::fs::create_dir(folder.path().join(place)).unwrap();
        let file = folder.path().join(place).join("a.obj");
        std::fs::write(file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n").unwrap();
    }
    let paths = |first: &str, second: &str| {
        let text = format!(
            r#"<mujoco><asset><mesh name="own" file="meshes/a.obj"/><mesh name="new" file="meshes/a.obj" scale="1 1 2"/>
            <mesh name="other" file="other/a.obj" scale="1 1 2"/>
            </asset><worldbody><geom type="mesh" mesh="{first}"/><geom type="mesh" mesh="{second}"/></worldbody></mujoco>"#
        );
        let imported = model(&text, read_from(folder.path()), &Options::default()).unwrap();
        (imported.files[0].path.clone(), left_out(&imported).join("\n"))
    };
    for [first, second] in [["own", "new"], ["new", "own"], ["own", "other"]] {
        assert_eq!(paths(first, second), ("meshes/a-2.obj".to_owned(), String::new()), "{first} {second}");
    }
    let (path, noted) = paths("other", "own");
    assert!(path == "meshes/a.obj" && noted.contains("a new mesh would be written over it"), "{path} {noted}");
}
