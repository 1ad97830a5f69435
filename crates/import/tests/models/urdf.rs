//! URDF robots.

use crate::play::{advance, left_out, position, start};
use metachron_import::{Folders, ImportError, Imported, urdf};
use metachron_world::World;
use std::path::Path;

fn import(text: &str) -> Result<Imported, ImportError> {
    urdf(text, Path::new("."))
}

/// Two rods on hinges about y, the first turned by `tilt` where its joint is at zero.
fn double_pendulum(tilt: [f64; 2]) -> String {
    let rod = |name: &str| {
        format!(
            r#"<link name="{name}"><inertial><origin xyz="0 0 -0.2"/><mass value="1.5"/>
            <inertia ixx="0.03" iyy="0.02" izz="0.015" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
        )
    };
    let hinge = |name: &str, parent: &str, child: &str, z: f64, tilt: f64| {
        format!(
            r#"<joint name="{name}" type="continuous"><origin xyz="0 0 {z}" rpy="0 {tilt} 0"/>
            <parent link="{parent}"/><child link="{child}"/><axis xyz="0 1 0"/></joint>"#
        )
    };
    let parts = [
        r#"<robot name="pendulum"><link name="ceiling"/>"#.to_owned(),
        hinge("shoulder", "ceiling", "upper", 2.0, tilt[0]),
        hinge("elbow", "upper", "lower", -0.5, tilt[1]),
        rod("upper"),
        rod("lower"),
        "</robot>".to_owned(),
    ];
    parts.concat()
}

/// The squares of the angular frequencies of the double pendulum's small oscillations, and the ratio of its relative angles in each:
/// M θ̈ + K θ = 0 in the angles against the vertical, with m = 1.5 kg, l = 0.5 m, centres c = 0.2 m below the hinges, moments 0.02 kg·m².
fn modes() -> [(f64, f64); 2] {
    let (m, l, c, i, g) = (1.5_f64, 0.5, 0.2, 0.02, 9.81);
    let [a, b, d] = [i + m * c * c + m * l * l, m * l * c, i + m * c * c];
    let [p, q] = [g * (m * c + m * l), g * m * c];
    // (a d − b²) w² − (a q + d p) w + p q = 0
    let (x, y, z) = (a * d - b * b, a * q + d * p, p * q);
    [-1.0, 1.0].map(|sign| {
        let w = (y + sign * (y * y - 4.0 * x * z).sqrt()) / (2.0 * x);
        (w, (p - w * a) / (w * b) - 1.0)
    })
}

#[test]
fn a_double_pendulum_has_the_frequencies_of_its_closed_form() {
    for (w2, ratio) in modes() {
        let amplitude: f64 = 0.01;
        let robot = double_pendulum([amplitude, ratio * amplitude]);
        let imported = import(&robot).unwrap();
        assert_eq!(left_out(&imported), [""; 0]);
        swings(&imported, w2, amplitude, ratio);
    }
}

/// Checks the angles of a double pendulum after a quarter, a half and a whole period, which are whole steps: the first is A cos(ω t), counted from
/// the start, and the second `ratio` times that. Returns the world at the end.
fn swings(imported: &Imported, w2: f64, amplitude: f64, ratio: f64) -> World {
    let period = std::f64::consts::TAU / w2.sqrt();
    let world = start(imported, &["shoulder", "elbow"], 3200.0 / period);
    let mut at = 0.0;
    for share in [0.25, 0.5, 1.0] {
        advance(&world, (share - at) * period);
        at = share;
        let expected = amplitude * ((std::f64::consts::TAU * share).cos() - 1.0);
        for (joint, scale) in [("shoulder", 1.0), ("elbow", ratio)] {
            let wrong = (position(&world, joint) - scale * expected).abs();
            // a step of first order errs by ω h/2 = 1e-3 of the amplitude, of the pair of angles the larger one's
            assert!(
                wrong < 2e-3 * amplitude * ratio.abs().max(1.0),
                "{joint}, ω² = {w2}, ratio {ratio}, {share}: {wrong}"
            );
        }
    }
    world
}

#[test]
fn joints_stop_at_their_limits_and_start_within_them() {
    let robot = double_pendulum([0.0, 0.0]).replace(
        r#"type="continuous"><origin xyz="0 0 2""#,
        r#"type="revolute"><limit lower="0.3" upper="0.8" effort="1" velocity="1"/><origin xyz="0 0 2""#,
    );
    let imported = import(&robot).unwrap();
    assert_eq!(
        left_out(&imported),
        [
            "line 1: joint `shoulder`: starts at 0.3, the end of its limits that is nearest to zero",
            "line 1: joint `shoulder`, limit: `effort` is left out",
            "line 1: joint `shoulder`, limit: `velocity` is left out",
        ]
    );
    let world = start(&imported, &["shoulder", "elbow"], 500.0);
    let mut least: f64 = 0.0;
    for _ in 0..20 {
        advance(&world, 0.05);
        least = least.min(position(&world, "shoulder"));
    }
    // it would swing to −0.6: it hangs on its lower limit instead
    assert!(least > -2e-3, "{least}");
}

#[test]
fn dampers_brakes_and_slides_are_in_the_scene() {
    // a carriage of 2 kg on an upright slide: with a damper it falls at m g / d, and dry friction above its weight holds it
    let robot = |dynamics: &str| {
        format!(
            r#"<robot name="lift"><link name="world"/><link name="carriage">
            <inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
            <collision><origin rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.1" length="0.4"/></geometry></collision></link>
            <joint name="rail" type="prismatic"><parent link="world"/><child link="carriage"/><axis xyz="0 0 2"/>
            <limit lower="-100" upper="1"/>{dynamics}</joint></robot>"#
        )
    };
    let fallen = |dynamics: &str| {
        let imported = import(&robot(dynamics)).unwrap();
        let world = start(&imported, &["rail"], 500.0);
        advance(&world, 1.0);
        let before = position(&world, "rail");
        advance(&world, 1.0);
        position(&world, "rail") - before
    };
    // after a second the rest of the start is e⁻²⁰
    assert!((fallen(r#"<dynamics damping="40"/>"#) + 2.0 * 9.81 / 40.0).abs() < 1e-4);
    assert!(fallen(r#"<dynamics friction="25"/>"#).abs() < 1e-6);
    // both: at rest as friction holds it, and beyond what friction takes the damper's speed
    assert!(fallen(r#"<dynamics damping="40" friction="25"/>"#).abs() < 1e-6);
    let speed_m_s = (2.0 * 9.81 - 5.0) / 40.0;
    assert!((fallen(r#"<dynamics damping="40" friction="5"/>"#) + speed_m_s).abs() < 1e-4);
}

#[test]
fn links_that_are_fixed_and_links_without_mass_are_part_of_what_they_are_on() {
    let robot = r#"<robot name="cart">
        <link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
        <link name="plate"><collision><geometry><box size="2 2 0.2"/></geometry></collision></link>
        <link name="rim"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
            <collision><geometry><sphere radius="0.25"/></geometry></collision></link>
        <link name="cup"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
            <visual><geometry><sphere radius="0.5"/></geometry><material name="red"/></visual></link>
        <joint name="a" type="fixed"><origin xyz="0 0 1"/><parent link="base"/><child link="plate"/></joint>
        <joint name="b" type="fixed"><origin xyz="0 -3 0"/><parent link="plate"/><child link="rim"/></joint>
        <joint name="c" type="continuous"><origin xyz="0 6 0"/><parent link="rim"/><child link="cup"/></joint>
        <material name="red"><color rgba="1 0 0 1"/></material>
        <gazebo/></robot>"#;
    let imported = import(robot).unwrap();
    let listed = ["line 4: link `rim`: is part of `base`, to which it is fixed", "line 12: gazebo: is left out"];
    assert_eq!(left_out(&imported), listed);
    // two masses of 1 kg, 3 m apart along y and 1 m along z: by parallel axes about the middle, 1.5 m and 0.5 m away from each
    let expected = r##"format = 1
description = "cart, imported"

[[object]]
name = "base"
model = "rigid"
shape = "compound"
mass_kg = 2.0
centre_of_mass_m = [0.0, -1.5, 0.5]
inertia_kg_m2 = [7.0, 2.5, 6.5, 0.0, 0.0, 1.5]

[[object.part]]
shape = "box"
half_extents_m = [1.0, 1.0, 0.1]
position_m = [0.0, 0.0, 1.0]

[[object.part]]
shape = "ball"
radius_m = 0.25
position_m = [0.0, -3.0, 1.0]

[[object]]
name = "cup"
model = "rigid"
shape = "ball"
radius_m = 0.5
position_m = [0.0, 3.0, 1.0]
mass_kg = 1.0
centre_of_mass_m = [0.0, 0.0, 0.0]
inertia_kg_m2 = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
colour = "#ff0000"
contact = { collides_with = [] }

[[joint]]
name = "c"
kind = "revolute"
a = "base"
b = "cup"
at_a_m = [0.0, 3.0, 1.0]
axis = [1.0, 0.0, 0.0]
"##;
    assert_eq!(imported.toml, expected);
}

#[test]
fn meshes_are_named_from_the_folder_of_the_scene_and_others_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let meshes = folder.path().join("robot/meshes");
    std::fs::create_dir_all(&meshes).unwrap();
    std::fs::write(meshes.join("a.stl"), "").unwrap();
    let urdfs = folder.path().join("robot/urdf");
    std::fs::create_dir_all(&urdfs).unwrap();
    let robot = |mesh: &str| {
        format!(
            r#"<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
            <collision><geometry><mesh {mesh}/></geometry></collision></link></robot>"#
        )
    };
    let imported =
        urdf(&robot(r#"filename="package://robot/meshes/a.stl" scale="0.5 0.5 0.5""#), urdfs.as_path()).unwrap();
    assert!(imported.toml.contains("shape = \"hull\"\nfile = \"../meshes/a.stl\"\nscale = 0.5\n"), "{}", imported.toml);
    let elsewhere = Folders { scene: Path::new(""), ..Folders::from(urdfs.as_path()) };
    let imported = urdf(&robot(r#"filename="../meshes/a.stl""#), elsewhere).unwrap();
    assert!(
        imported.toml.contains("file = \"../") && imported.toml.contains("robot/meshes/a.stl\""),
        "{}",
        imported.toml
    );
    let noted = urdf(&robot(r#"filename="../meshes/a.stl" scale="1 -1 1""#), urdfs.as_path()).unwrap();
    assert!(left_out(&noted)[0].ends_with("`../meshes/a.stl` is left out: no file is read here"));
    let noted = urdf(&robot(r#"filename="a.ply""#), urdfs.as_path()).unwrap();
    assert!(left_out(&noted)[0].ends_with("`a.ply` is left out: expected a .glb, .stl, .obj, .dae or MuJoCo's .msh"));
    let error = urdf(&robot(r#"filename="b.stl""#), urdfs.as_path()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 2: link `a`, collision, geometry, mesh: names `b.stl`, and there is no such file; expected it beside the model"
    );
}

#[test]
fn what_no_scene_can_have_is_refused_with_line_element_and_reason() {
    let link = |name: &str| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>"#
        )
    };
    let joint = |kind: &str, parent: &str, child: &str| {
        format!(r#"<joint name="j" type="{kind}"><parent link="{parent}"/><child link="{child}"/></joint>"#)
    };
    let two = link("a") + "\n" + &link("b");
    for (text, expected) in [
        ("<robot><link".to_owned(), "line 1: the file: is not XML"),
        ("<sdf/>".to_owned(), "line 1: sdf: is not the root of a robot"),
        (format!("<robot>{}</robot>", two.replace("\"b\"", "\"a\"")), "line 2: link `a`: is there twice"),
        (
            format!("<robot>{}</robot>", two.replace("value=\"1\"", "value=\"-1\"")),
            "line 1: link `a`, inertial, mass: `value` is -1",
        ),
        (
            format!("<robot>{}</robot>", two.replace("ixx=\"1\"", "ixx=\"one\"")),
            "line 1: link `a`, inertial, inertia: `ixx` is `one`",
        ),
        (format!("<robot>{two}\n{}</robot>", joint("revolute", "a", "b")), "line 3: joint `j`: has no `limit`"),
        (format!("<robot>{two}\n{}</robot>", joint("planar", "a", "b")), "line 3: joint `j`: is of the type `planar`"),
        (format!("<robot>{two}\n{}</robot>", joint("fixed", "a", "c")), "line 3: joint `j`: has the child `c`"),
        (
            format!("<robot>{two}\n{}</robot>", joint("fixed", "a", "b") + &joint("fixed", "b", "a")),
            "line 1: link `a`: hangs on itself",
        ),
    ] {
        let error = import(&text).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}\nis not {expected}");
    }
}

#[test]
fn a_link_without_mass_at_the_end_of_a_chain_is_part_of_what_it_is_on() {
    let heavy = r#"<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>"#;
    let hinge = |parent: &str, child: &str| {
        format!(
            r#"<joint name="to {child}" type="continuous"><parent link="{parent}"/><child link="{child}"/></joint>"#
        )
    };
    let robot = format!(
        "<robot><link name=\"hand\">{heavy}</link>\n<link name=\"finger\"/>\n<link name=\"tip\"/>{}{}</robot>",
        hinge("hand", "finger"),
        hinge("finger", "tip")
    );
    let imported = import(&robot).unwrap();
    assert_eq!(
        left_out(&imported),
        [
            "line 2: link `finger`: has no mass, and carries none: joint `to finger` is fixed",
            "line 3: link `tip`: has no mass, and carries none: joint `to tip` is fixed",
        ]
    );
    let scene = crate::play::scene(&imported, &[], 500.0);
    assert_eq!((scene.agents.len(), scene.joints.len()), (1, 0));
}

/// The double pendulum whose elbow follows its shoulder.
fn mimicking(tilt: [f64; 2], keys: &str) -> String {
    double_pendulum(tilt).replace(r#"<child link="lower"/>"#, &format!(r#"<child link="lower"/><mimic {keys}/>"#))
}

#[test]
fn a_pendulum_whose_elbow_follows_its_shoulder_has_the_frequency_of_its_closed_form() {
    for ratio in [1.0, -0.6, 2.5] {
        // of one freedom φ, with both angles against the vertical φ and (1 + r) φ
        let (m, l, c, i, g) = (1.5_f64, 0.5, 0.2, 0.02, 9.81);
        let [a, b, d] = [i + m * c * c + m * l * l, m * l * c, i + m * c * c];
        let [p, q] = [g * (m * c + m * l), g * m * c];
        let both = 1.0 + ratio;
        let w2 = (p + q * both * both) / (a + 2.0 * b * both + d * both * both);
        let amplitude: f64 = 0.01;
        let robot = mimicking([amplitude, ratio * amplitude], &format!(r#"joint="shoulder" multiplier="{ratio}""#));
        let imported = import(&robot).unwrap();
        assert_eq!(left_out(&imported), [""; 0]);
        let world = swings(&imported, w2, amplitude, ratio);
        let [shoulder, elbow] = ["shoulder", "elbow"].map(|joint| position(&world, joint));
        assert!((elbow - ratio * shoulder).abs() < 1e-7, "ratio {ratio}: {elbow} of {shoulder}");
    }
}

#[test]
fn a_joint_starts_where_the_one_that_it_follows_leads_it() {
    // both rods are level to start with: the shoulder stands at the end of its limits, and the elbow follows it from an offset
    let robot = mimicking([0.0; 2], r#"joint="shoulder" multiplier="2" offset="-0.6""#).replace(
        r#"type="continuous"><origin xyz="0 0 2""#,
        r#"type="revolute"><limit lower="0.4" upper="0.8"/><origin xyz="0 0 2""#,
    );
    let imported = import(&robot).unwrap();
    let listed = ["line 1: joint `shoulder`: starts at 0.4, the end of its limits that is nearest to zero"];
    assert_eq!(left_out(&imported), listed);
    let scene = crate::play::scene(&imported, &[], 500.0);
    // 0.2 rad against the upper rod
    let angle = crate::play::body(&scene, "lower").rotation.to_scaled_axis().y;
    assert!((angle - (0.4 + 2.0 * 0.4 - 0.6)).abs() < 1e-9, "{angle} rad");
    // as far as its own limits let it
    let elbow = r#"type="continuous"><origin xyz="0 0 -0.5""#;
    let limited = r#"type="revolute"><limit lower="-1" upper="0.1"/><origin xyz="0 0 -0.5""#;
    let listed = left_out(&import(&robot.replace(elbow, limited)).unwrap());
    assert!(listed[0].contains("joint `elbow`: starts at 0.1 and follows `shoulder` from there"), "{listed:?}");
}

#[test]
fn a_joint_that_can_follow_nothing_moves_by_itself_and_is_listed() {
    for (keys, why) in [
        (r#"joint="hip""#, "names `hip`, and there is no joint of that name"),
        (r#"joint="elbow""#, "names `elbow`, and it follows itself"),
    ] {
        let listed = left_out(&import(&mimicking([0.0; 2], keys)).unwrap());
        assert_eq!(listed, [format!("line 3: joint `elbow`, mimic: is left out: it {why}")]);
    }
    let ring = mimicking([0.0; 2], r#"joint="shoulder""#)
        .replace(r#"<child link="upper"/>"#, r#"<child link="upper"/><mimic joint="elbow"/>"#);
    let listed = left_out(&import(&ring).unwrap());
    assert_eq!(listed.len(), 1, "{listed:?}");
    assert!(listed[0].ends_with("joint `elbow`, mimic: is left out: it names `shoulder`, and it follows itself"));
    let refused = import(&mimicking([0.0; 2], r#"joint="shoulder" multiplier="1e9""#)).unwrap_err().to_string();
    assert!(refused.contains("joint `elbow`, mimic: `multiplier` is 1000000000; expected"), "{refused}");
}

#[test]
fn moments_that_no_body_has_are_those_of_the_link_that_has_them() {
    let link = |name: &str, moment: &str| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="{moment}" iyy="0.01" izz="0.01"/></inertial></link>"#
        )
    };
    let weld = r#"<joint name="weld" type="fixed"><parent link="good"/><child link="bad"/></joint>"#;
    let robot = format!("<robot>{}\n{}{weld}</robot>", link("good", "0.01"), link("bad", "-0.05"));
    let imported = import(&robot).unwrap();
    let listed = left_out(&imported);
    assert_eq!(listed.len(), 2, "{listed:?}");
    assert!(listed[0].starts_with("line 2: link `bad`: has moments of inertia that no body has"), "{listed:?}");
    let spec = crate::play::body(&crate::play::scene(&imported, &[], 500.0), "good");
    assert!((spec.mass_kg - 2.0).abs() < 1e-12);
}

#[test]
fn numbers_that_no_scene_has_are_those_of_the_robot() {
    for (dynamics, expected) in [
        (r#"friction="1e10""#, "joint `elbow`, dynamics: `friction` is 10000000000; expected 0 to 1000000000"),
        (r#"damping="2e7""#, "joint `elbow`, dynamics: `damping` is 20000000; expected 0 to 10000000"),
        (r#"damping="-1""#, "joint `elbow`, dynamics: `damping` is -1; expected 0 to 10000000"),
    ] {
        let robot = double_pendulum([0.0; 2])
            .replace(r#"<child link="lower"/>"#, &format!(r#"<child link="lower"/><dynamics {dynamics}/>"#));
        let refused = import(&robot).unwrap_err().to_string();
        assert!(refused.ends_with(expected), "{refused}");
    }
}
