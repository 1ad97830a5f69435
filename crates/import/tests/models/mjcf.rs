//! MJCF models.

use crate::play::{advance, left_out, position, start};
use metachron_import::{ImportError, Imported, mjcf};
use std::path::Path;

fn import(text: &str) -> Result<Imported, ImportError> {
    mjcf(text, Path::new("."))
}

/// What MuJoCo makes of `arm.xml` (`reference.py`).
#[derive(Debug)]
struct Reference {
    joints: Vec<String>,
    moments: Vec<Moment>,
}

#[derive(Debug)]
struct Moment {
    at_s: f64,
    positions: Vec<f64>,
}

fn reference() -> Reference {
    let json: serde_json::Value = serde_json::from_str(include_str!("arm.json")).unwrap();
    let list = |value: &serde_json::Value| value.as_array().unwrap().clone();
    let moment = |value: &serde_json::Value| Moment {
        at_s: value["at_s"].as_f64().unwrap(),
        positions: list(&value["positions"]).iter().map(|q| q.as_f64().unwrap()).collect(),
    };
    Reference {
        joints: list(&json["joints"]).iter().map(|name| name.as_str().unwrap().to_owned()).collect(),
        moments: list(&json["moments"]).iter().map(moment).collect(),
    }
}

#[test]
fn an_arm_with_springs_dampers_and_a_servo_moves_as_in_mujoco() {
    let reference = reference();
    let imported = import(include_str!("arm.xml")).unwrap();
    assert_eq!(left_out(&imported), [""; 0]);
    let joints: Vec<&str> = reference.joints.iter().map(String::as_str).collect();
    let worst = |rate_hz: f64| {
        let world = start(&imported, &joints, rate_hz);
        let (mut worst, mut at_s) = (0.0_f64, 0.0);
        for moment in &reference.moments {
            advance(&world, moment.at_s - at_s);
            at_s = moment.at_s;
            for (joint, expected) in joints.iter().zip(&moment.positions) {
                worst = worst.max((position(&world, joint) - expected).abs());
            }
        }
        worst
    };
    let (coarse, fine) = (worst(1000.0), worst(2000.0));
    // joints move by up to a radian; a step of first order errs by half as much at half the step
    assert!(fine < 5e-3, "{coarse} {fine}");
    assert!(fine < 0.65 * coarse, "{coarse} {fine}");
}

#[test]
fn a_body_on_two_hinges_has_the_frequencies_of_its_closed_form() {
    // its moments about the hinges are 0.02 + m c² and 0.03 + m c², with m = 1.5 kg, c = 0.2 m
    let tilt = [0.01_f64, -0.008];
    let text = format!(
        r#"<mujoco><compiler angle="radian" eulerseq="xyz"/><worldbody><body name="bob" euler="{} {} 0">
        <joint name="roll" axis="1 0 0"/><joint name="pitch" axis="0 1 0"/>
        <inertial pos="0 0 -0.2" mass="1.5" diaginertia="0.02 0.03 0.01"/></body></worldbody></mujoco>"#,
        tilt[0], tilt[1]
    );
    let imported = import(&text).unwrap();
    assert_eq!(
        left_out(&imported),
        ["line 1: body `bob`: has no mass, and moves: a thousandth of that of `bob` is added"]
    );
    for (joint, tilt, moment) in [("roll", tilt[0], 0.02), ("pitch", tilt[1], 0.03)] {
        let period = std::f64::consts::TAU / (1.5 * 9.81 * 0.2 / (moment + 1.5 * 0.2 * 0.2_f64)).sqrt();
        let world = start(&imported, &[joint], 3200.0 / period);
        let mut at = 0.0;
        for share in [0.25, 0.5, 1.0] {
            advance(&world, (share - at) * period);
            at = share;
            let wrong = (position(&world, joint) - tilt * ((std::f64::consts::TAU * share).cos() - 1.0)).abs();
            // a step of first order errs by ω h/2 = 1e-3, what is added to the mass by as much, the other angle by its square
            assert!(wrong < 3e-3 * tilt.abs(), "{joint} {share}: {wrong}");
        }
    }
}

#[test]
fn masses_of_geoms_are_those_of_mujoco() {
    let reference: serde_json::Value = serde_json::from_str(include_str!("arm.json")).unwrap();
    let scene = crate::play::scene(&import(include_str!("arm.xml")).unwrap(), &[], 500.0);
    for agent in &scene.agents {
        let metachron_world::Spec::Rigid(body) = &agent.spec else { panic!("{} is not rigid", agent.name) };
        let expected = reference["masses_kg"][&agent.name].as_f64().unwrap();
        assert!((body.mass_kg - expected).abs() < 1e-8, "{}: {} is not {expected}", agent.name, body.mass_kg);
    }
    assert_eq!((scene.agents.len(), scene.obstacles.len()), (4, 1));
}

#[test]
fn masks_become_groups_and_what_does_not_move_is_fixed() {
    let text = r#"<mujoco><default><geom contype="1" conaffinity="0"/></default><worldbody>
        <geom name="floor" type="plane" size="1 1 1" contype="1" conaffinity="1"/>
        <body name="table"><geom type="box" size="1 1 1"/></body>
        <body name="a"><freejoint/><geom size="0.1"/></body>
        <body name="b"><freejoint/><geom size="0.1"/><light/></body>
        </worldbody><contact><exclude body1="a" body2="b"/></contact><keyframe/></mujoco>"#;
    let imported = import(text).unwrap();
    assert_eq!(left_out(&imported), ["line 5: body `b`, light: is left out", "line 6: keyframe: is left out"]);
    let toml = &imported.toml;
    assert!(toml.contains("groups = [\"1-0\"], collides_with = [\"1-1\"]"), "{toml}");
    assert!(toml.contains("groups = [\"1-1\"], collides_with = [\"1-0\", \"1-1\"]"), "{toml}");
    assert!(toml.contains("[[coupling]]\na = \"a\"\nb = \"b\"\nlaw = \"off\"\n"), "{toml}");
    let scene = crate::play::scene(&imported, &[], 500.0);
    assert_eq!((scene.agents.len(), scene.obstacles.len(), scene.joints.len()), (2, 2, 0));
}

#[test]
fn what_no_scene_can_have_is_refused_with_line_element_and_reason() {
    for (inside, expected) in [
        (r#"<body name="a"><joint type="screw"/></body>"#, "line 2: body `a`, joint: is of the type `screw`"),
        (r#"<body name="a"><joint axis="0 0 0"/></body>"#, "line 2: body `a`, joint: `axis` has no direction"),
        (r#"<body name="a"><joint/><geom class="c" size="1"/></body>"#, "line 2: body `a`, geom: is of the class `c`"),
        (r#"<body name="a"><joint/><geom type="capsule" size="1"/></body>"#, "line 2: body `a`, geom: `size` has 0"),
        (r#"<body name="a"><joint/><geom type="mesh" mesh="m"/></body>"#, "line 2: body `a`, geom: names the mesh `m`"),
        (r#"<body name="a"><joint/><inertial mass="-1"/></body>"#, "line 2: body `a`, inertial: `mass` is -1"),
        (r#"<body name="a"><joint/></body>"#, "line 2: body `a`: has no mass"),
        (r#"<body name="a"><joint/><freejoint/><geom size="1"/></body>"#, "line 2: body `a`, freejoint: lets its body"),
    ] {
        let error = import(&format!("<mujoco><worldbody>\n{inside}</worldbody></mujoco>")).map(|done| done.toml);
        let error = error.expect_err(inside).to_string();
        assert!(error.starts_with(expected), "{error}\nis not {expected}");
    }
}
