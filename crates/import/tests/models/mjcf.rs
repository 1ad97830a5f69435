//! MJCF models.

use crate::play::{advance, centre, left_out, position, start};
use metachron_import::{Folders, ImportError, Imported, Options, mjcf, model};
use std::path::Path;

fn import(text: &str) -> Result<Imported, ImportError> {
    mjcf(text, Path::new("."))
}

fn at_key(text: &str, key: &str) -> Result<Imported, ImportError> {
    model(text, Path::new("."), &Options { key: Some(key), ..Options::default() })
}

/// MuJoCo's answers for `arm.xml` (`reference.py`).
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
    // joints move by up to a quarter of a radian or metre; steps of first order err by half as much at half the step:
    // at 0.5 ms by 2.1e-4, as MuJoCo's do (`reference.py`)
    assert!(fine < 3e-4, "{coarse} {fine}");
    assert!(fine < 0.55 * coarse, "{coarse} {fine}");
}

#[test]
fn a_servo_without_damping_swings_on_where_steps_resolve_it_and_is_still_where_they_do_not() {
    // a moment of 0.02 kg m² on a servo of this many turns a second
    let amplitude_in_the_tenth_second = |hz: f64| {
        let kp = 0.02 * (std::f64::consts::TAU * hz).powi(2);
        let text = format!(
            r#"<mujoco><option gravity="0 0 0"/><worldbody><body name="wheel"><joint name="axle"/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/></body></worldbody>
            <actuator><position joint="axle" kp="{kp}"/></actuator>
            <keyframe><key name="turned" qpos="0.1"/></keyframe></mujoco>"#
        );
        let imported = at_key(&text, "turned").unwrap();
        let world = start(&imported, &["axle"], 100.0);
        advance(&world, 9.0);
        let last = (0..50).map(|_| {
            advance(&world, 0.02);
            (position(&world, "axle") + 0.1).abs()
        });
        last.fold(0.0, f64::max)
    };
    let (resolved, stiff) = (amplitude_in_the_tenth_second(1.0), amplitude_in_the_tenth_second(1000.0));
    // eq. 22b of clusters.md: exp(−h² ω² · h ω² t/2) = 0.992 at ω = 2π, where an implicit step leaves 0.14
    assert!((0.097..0.1005).contains(&resolved), "{resolved}");
    assert!(stiff < 1e-6, "{stiff}");
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
            // a step of first order errs by ω h/2 = 1e-3, the lent mass by as much, the other angle by its square
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

/// A folder with files of these names.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

/// Where the files of a model are, which are read from the disk.
fn several(folder: &Path) -> Folders<'_> {
    Folders { read: Some(&|path| std::fs::read(path)), ..Folders::from(folder) }
}

#[test]
fn a_model_in_several_files_is_the_model_in_one() {
    let (defaults, body) = (r#"<geom density="500"/>"#, r#"<body name="a"><freejoint/><geom size="0.1"/></body>"#);
    let whole = format!("<mujoco><default>{defaults}</default><worldbody>{body}</worldbody></mujoco>");
    let files = [
        ("common.xml", r#"<mujoco><default><include file="parts/defaults.xml"/></default></mujoco>"#),
        ("parts/defaults.xml", &format!("<mujocoinclude>{defaults}</mujocoinclude>")),
        ("parts/body.xml", &format!("<mujocoinclude>\n{body}\n<body name=\"b\"><light/></body></mujocoinclude>")),
    ];
    let folder = folder(&files);
    let text =
        r#"<mujoco><include file="common.xml"/><worldbody><include file="parts/body.xml"/></worldbody></mujoco>"#;
    let parts = mjcf(text, several(folder.path())).unwrap();
    assert_eq!(parts.toml, import(&whole).unwrap().toml);
    assert_eq!(left_out(&parts), ["line 3 of `parts/body.xml`: body `b`, light: is left out"]);
}

#[test]
fn what_cannot_be_included_is_refused_with_file_line_and_element() {
    let files = [
        ("a.xml", "<mujoco>\n<include file=\"b.xml\"/></mujoco>"),
        ("b.xml", "<mujoco>\n\n<include file=\"a.xml\"/></mujoco>"),
        ("broken.xml", "<mujoco>\n<"),
        ("wrong.xml", "<mujoco>\n<body name=\"a\"><joint axis=\"0 0 0\"/><geom size=\"1\"/></body></mujoco>"),
    ];
    let folder = folder(&files);
    for (name, expected) in [
        ("./a.xml", "line 3 of `b.xml`: include: names `a.xml`, which is included already"),
        ("broken.xml", "line 2 of `broken.xml`: the file: is not XML"),
        ("none.xml", "line 1: worldbody, include: names `none.xml`, which cannot be read beside the model"),
        ("wrong.xml", "line 2 of `wrong.xml`: body `a`, joint: `axis` has no direction"),
    ] {
        let text = format!("<mujoco><worldbody><include file=\"{name}\"/></worldbody></mujoco>");
        let error = mjcf(&text, several(folder.path())).expect_err(name).to_string();
        assert!(error.starts_with(expected), "{error}\nis not {expected}");
    }
    let error = mjcf("<mujoco><include file=\"a.xml\"/></mujoco>", folder.path()).unwrap_err().to_string();
    assert!(error.ends_with("`a.xml`, and no included file is read here; expected a model in one file"), "{error}");
}

#[test]
fn tendons_between_two_sites_are_ropes_and_springs() {
    // a ball on a rope of 0.5 m, and one on a spring whose length at rest is that of the file, 0.3 m
    let ball = |name: &str, z: f64| {
        let geom = r#"<geom size="0.05" mass="2" contype="0" conaffinity="0"/>"#;
        format!(
            "<body name=\"{name}\" pos=\"1 0 {z}\"><freejoint/>{geom}<site name=\"on {name}\" pos=\"0 0 0.1\"/></body>"
        )
    };
    let text = format!(
        r#"<mujoco><default><tendon damping="40"/></default><worldbody><site name="top" pos="1 0 2"/>
        <site name="unused"/>{}{}</worldbody><tendon>
        <spatial name="rope" damping="0" range="0 0.5"><site site="top"/><site site="on hung"/></spatial>
        <spatial name="spring" stiffness="100" width="0.01"><site site="top"/><site site="on sprung"/></spatial>
        <spatial name="short" limited="true" range="0 0.1" damping="0"><site site="top"/><site site="on hung"/></spatial>
        <spatial name="bent"><site site="top"/><site site="on hung"/><site site="on sprung"/></spatial>
        <fixed name="geared"><joint joint="none" coef="1"/></fixed></tendon></mujoco>"#,
        ball("hung", 1.7),
        ball("sprung", 1.6)
    );
    let imported = import(&text).unwrap();
    assert_eq!(
        left_out(&imported),
        [
            "line 5: spatial `short`: is left out: its ends start 0.2000 m apart, and it is at most 0.1 m long",
            "line 6: spatial `bent`: is left out: scenes have ropes and springs between two points alone",
            "line 7: fixed `geared`: is left out: it couples joints, and scenes have no such coupling",
            "line 2: site `unused`: is left out",
            "line 4: spatial `spring`: `width` is left out",
        ]
    );
    let world = start(&imported, &[], 500.0);
    advance(&world, 6.0);
    let height = |name: &str| centre(&world, name).z;
    // 0.1 m below their sites: where the rope is long, and where 100 N/m bear 2 kg
    assert!((height("hung") - (2.0 - 0.5 - 0.1)).abs() < 1e-3, "{}", height("hung"));
    assert!((height("sprung") - (2.0 - 0.3 - 2.0 * 9.81 / 100.0 - 0.1)).abs() < 1e-3, "{}", height("sprung"));
}

#[test]
fn a_tendon_that_gives_no_length_rests_where_joints_are_at_their_springs() {
    // the file has the slide at 0.25 m, 1 m above the site of the world; its spring is at 0.75 m
    let text = r#"<mujoco><worldbody><site name="ground"/><body name="post" pos="0 0 1">
        <joint type="slide" ref="0.25" springref="0.75"/><geom size="0.1"/><site name="top"/></body></worldbody>
        <tendon><spatial stiffness="10"><site site="ground"/><site site="top"/></spatial></tendon></mujoco>"#;
    assert!(import(text).unwrap().toml.contains("\nrest_m = 1.5\n"));
}

/// A hinge at a height of 1 m with a servo, a slide and a ball joint below it, and a body that is free.
const KEYED: &str = r#"<mujoco><compiler angle="degree"/><option gravity="0 0 0"/>
    <default><geom size="0.05" contype="0" conaffinity="0"/></default><worldbody>
    <body name="arm" pos="0 0 1"><joint name="hinge" axis="0 1 0" ref="10" range="-90 90"/><geom pos="0.5 0 0"/>
    <body name="drawer" pos="0.5 0 0"><joint name="slide" type="slide" axis="1 0 0"/><geom/>
    <body name="hand" pos="0.1 0 0"><joint type="ball"/><geom pos="0 0.2 0"/></body></body></body>
    <body name="free"><freejoint/><geom/></body></worldbody>
    <actuator><motor joint="slide"/><position joint="hinge" kp="50" kv="5"/></actuator>
    <keyframe><key name="home" qpos="0.6745329251994329 0.2 0.7071067811865476 0 0 0.7071067811865476 1 2 3 0 1 0 0"
    ctrl="0 0.6745329251994329"/><key name="short" qpos="1 2"/></keyframe></mujoco>"#;

#[test]
fn a_keyframe_is_where_the_model_starts_and_what_its_servos_hold() {
    let imported = at_key(KEYED, "home").unwrap();
    let world = start(&imported, &["hinge"], 500.0);
    // 0.5 rad from where the file has it, which is at 10 degrees
    let (sin, cos) = 0.5_f64.sin_cos();
    let along = |x: f64, y: f64| glam::DVec3::new(x * cos, y, 1.0 - x * sin);
    let expected = [
        ("arm", along(0.5, 0.0)),
        ("drawer", along(0.7, 0.0)),
        // a quarter turn about z takes y to -x
        ("hand", along(0.8 - 0.2, 0.0)),
        ("free", glam::DVec3::new(1.0, 2.0, 3.0)),
    ];
    for at_s in [0.0, 1.0] {
        advance(&world, at_s);
        for (name, at) in expected {
            let found = centre(&world, name);
            assert!(found.distance(at) < 1e-6, "{name} at {at_s} s: {found} is not {at}");
        }
        assert!(position(&world, "hinge").abs() < 1e-6);
    }
    for (key, expected) in [
        ("short", "line 9: key `short`: `qpos` has 2 numbers; expected 13"),
        ("none", "line 1: mujoco: has no keyframe `none`"),
    ] {
        let error = at_key(KEYED, key).expect_err(key).to_string();
        assert_eq!(error, expected);
    }
}

#[test]
fn flags_turn_gravity_and_contacts_off() {
    let height = |flags: &str| {
        let text = format!(
            r#"<mujoco><option><flag {flags}/></option><worldbody><geom type="plane" size="1 1 1"/>
            <body name="a" pos="0 0 0.1"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#
        );
        let imported = import(&text).unwrap();
        assert_eq!(left_out(&imported), [""; 0]);
        let world = start(&imported, &[], 500.0);
        advance(&world, 1.0);
        centre(&world, "a").z
    };
    assert_eq!(height(r#"gravity="disable" contact="disable""#), 0.1);
    // steps of first order err by g h/2 in a second
    assert!((height(r#"contact="disable""#) - (0.1 - 9.81 / 2.0)).abs() < 0.02);
    assert!((height(r#"gravity="enable""#) - 0.1).abs() < 1e-4);
}

#[test]
fn a_flag_turns_all_off_that_bounds_or_holds() {
    let toml = |flags: &str| {
        let text = format!(
            r#"<mujoco><option><flag {flags}/></option><worldbody><site name="s"/><body name="a"><joint range="-9 9" frictionloss="1"/>
            <geom size="0.1"/><site name="t"/></body></worldbody><equality><weld body1="a"/></equality>
            <tendon><spatial range="0 1"><site site="s"/><site site="t"/></spatial></tendon></mujoco>"#
        );
        import(&text).unwrap().toml
    };
    let bounds = ["range_deg", "friction_n_m", "kind = \"fixed\"", "kind = \"rope\"", "collides_with = []"];
    let (all, none) = (toml(r#"warmstart="enable""#), toml(r#"constraint="disable""#));
    assert!(bounds[..4].iter().all(|bound| all.contains(bound)) && !all.contains(bounds[4]), "{all}");
    assert!(!bounds[..4].iter().any(|bound| none.contains(bound)) && none.contains(bounds[4]), "{none}");
    let rubs = |flags: &str| toml(flags).contains("friction_n_m");
    assert!(rubs(r#"limit="disable""#) && !rubs(r#"frictionloss="disable""#));
}

#[test]
fn the_friction_and_armature_of_a_ball_are_those_of_its_joint() {
    let ball = r#"<joint type="ball" frictionloss="0.2" armature="0.3" damping="0.1"/>"#;
    let text = format!(r#"<mujoco><worldbody><body name="a">{ball}<geom size="0.1"/></body></worldbody></mujoco>"#);
    let imported = import(&text).unwrap();
    assert_eq!(left_out(&imported), ["line 1: body `a`, joint: `damping` is left out"]);
    let joint = "kind = \"spherical\"";
    let has = [joint, "friction_n_m = 0.2", "armature_kg_m2 = 0.3"].map(|words| imported.toml.contains(words));
    assert_eq!(has, [true; 3], "{}", imported.toml);
    crate::play::scene(&imported, &[], 500.0);
}

#[test]
fn what_changes_the_motion_comes_first_and_zeros_change_none() {
    let text = r#"<mujoco><option timestep="0.01" density="1.2" viscosity="0"/><worldbody><light/><body name="a">
        <joint name="hinge" armature="0.1" frictionloss="2" damping="3"/>
        <joint name="slide" type="slide" armature="0" frictionloss="0" margin="0"/>
        <geom size="0.1" rgba="1 0 0 1" user="1" margin="0" solref="0.1 1"/></body></worldbody>
        <actuator><motor joint="hinge" gear="5"/><muscle joint="hinge"/></actuator></mujoco>"#;
    let imported = import(text).unwrap();
    let lists = |changes: bool| {
        let of = imported.left_out.iter().filter(move |entry| entry.changes_motion == changes);
        of.map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(
        lists(true),
        [
            "line 1: option: `density` is left out: nothing surrounds the bodies of a scene",
            "line 1: body `a`: has no mass, and moves: a thousandth of that of `a` is added",
            "line 4: body `a`, geom: `solref` is left out",
            "line 5: actuator, muscle: is left out: it acts without a program, too, and scenes have servos of joints alone",
        ]
    );
    assert_eq!(
        lists(false),
        [
            "line 1: option: `timestep` is left out",
            "line 1: worldbody, light: is left out",
            "line 4: body `a`, geom: `user` is left out",
            "line 5: actuator, motor: is left out: it gives what a program commands",
        ]
    );
    assert!(imported.left_out.iter().map(|entry| !entry.changes_motion).is_sorted());
    let joint =
        ["friction_n_m = 2.0", "armature_kg_m2 = 0.1", "motor = { velocity_rad_s = 0.0, damping_n_m_s_rad = 3.0 }"];
    assert!(joint.iter().all(|key| imported.toml.contains(key)), "{}", imported.toml);
}

#[test]
fn an_armature_is_inertia_about_its_joint_as_in_mujoco() {
    // of 2 kg on an upright slide with an armature of 3 kg: it falls by g 2/(2 + 3)
    let text = r#"<mujoco><worldbody><body name="box"><joint name="lift" type="slide" axis="0 0 1" armature="3"/>
        <geom type="box" size="0.1 0.1 0.1" mass="2"/></body></worldbody></mujoco>"#;
    let world = start(&import(text).unwrap(), &["lift"], 500.0);
    advance(&world, 1.0);
    // steps of first order err by a h/2 in a second
    let a_m_s2 = 9.81 * 2.0 / 5.0;
    let fallen_m = -position(&world, "lift");
    assert!((fallen_m - 0.5 * a_m_s2 * (1.0 + 1.0 / 500.0)).abs() < 1e-5, "{fallen_m} m");
}

#[test]
fn a_general_actuator_with_an_affine_bias_is_a_servo_and_shares_its_joint_with_a_spring() {
    // 30 (0.4 − q) − 2 q' of the actuator, whose bias of 3 is 0.1 rad more, and 10 (−0.2 − q) of the joint: rest at (30 · 0.5 − 10 · 0.2)/40
    let text = r#"<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody><body name="arm">
        <joint name="hinge" stiffness="10" springref="-0.2" damping="3"/><geom size="0.1"/></body></worldbody>
        <actuator><general joint="hinge" biastype="affine" gainprm="30" biasprm="3 -30 -2"/></actuator>
        <keyframe><key name="k" qpos="0" ctrl="0.4"/></keyframe></mujoco>"#;
    let imported = at_key(text, "k").unwrap();
    assert_eq!(left_out(&imported), [""; 0]);
    let world = start(&imported, &["hinge"], 500.0);
    advance(&world, 4.0);
    // it rests where the change of a step would be below the tolerance of solves
    assert!((position(&world, "hinge") - 0.325).abs() < 1e-4, "{}", position(&world, "hinge"));
}

#[test]
fn a_base_is_fixed_on_demand() {
    let text = r#"<mujoco><worldbody><body name="base" pos="0 0 1"><freejoint/><geom size="0.1"/>
        <body name="arm"><joint axis="0 1 0"/><geom size="0.1" pos="0.5 0 0"/></body></body>
        <body name="ball" pos="5 0 1"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;
    let imported = model(text, Path::new("."), &Options { fixed_base: true, ..Options::default() }).unwrap();
    let world = start(&imported, &[], 500.0);
    advance(&world, 0.5);
    let fallen = |name: &str| 1.0 - centre(&world, name).z;
    assert!(fallen("base").abs() < 1e-6 && fallen("ball") > 1.0 && fallen("arm") > 0.3, "{}", fallen("arm"));
}

#[test]
fn a_fixed_body_that_nothing_touches_is_part_of_the_body_that_it_is_on() {
    // seen alone, without a geom, and touched with another friction
    let inertial = r#"<inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/>"#;
    let text = format!(
        r#"<mujoco><worldbody><body name="base"><freejoint/>{inertial}<geom size="0.1" friction="0.7"/>
        <body name="seen">{inertial}<geom size="0.1" contype="0" conaffinity="0" friction="0.2"/></body>
        <body name="bare">{inertial}</body>
        <body name="rough">{inertial}<geom size="0.1" friction="0.9"/></body></body></worldbody></mujoco>"#
    );
    let scene = crate::play::scene(&import(&text).unwrap(), &[], 500.0);
    let names: Vec<&str> = scene.agents.iter().map(|agent| agent.name.as_str()).collect();
    assert_eq!(names, ["base", "rough"]);
    assert!((crate::play::body(&scene, "base").mass_kg - 3.0).abs() < 1e-12);
}
