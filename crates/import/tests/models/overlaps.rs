//! Bodies of one robot that start inside each other, or are next to each other.

use crate::play::overlaps;
use metachron_import::{Imported, Options, model};
use std::path::Path;

fn import(text: &str, srdf: Option<&str>) -> Imported {
    let options = Options { srdf, overlaps: Some(&overlaps), ..Options::default() };
    model(text, Path::new("."), &options).unwrap()
}

/// Names of the pairs that pass through each other, in the order of the scene.
fn apart(imported: &Imported) -> Vec<[String; 2]> {
    let scene: toml::Table = imported.toml.parse().unwrap();
    let couplings = scene.get("coupling").and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let end = |pair: &toml::Value, key: &str| pair[key].as_str().unwrap().to_owned();
    couplings.iter().map(|pair| [end(pair, "a"), end(pair, "b")]).collect()
}

/// A chain of balls of 0.1 m, each on a hinge of the one before, at these places along x.
fn chain(root: &str, places: &[f64]) -> String {
    let ball = |name: usize| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
            <collision><geometry><sphere radius="0.1"/></geometry></collision></link>"#
        )
    };
    let hinge = |(name, from, to): (usize, f64, f64)| {
        format!(
            r#"<joint name="j{name}" type="continuous"><parent link="{}"/><child link="{name}"/>
            <origin xyz="{} 0 0"/></joint>"#,
            name - 1,
            to - from
        )
    };
    let hinges = (1..places.len()).map(|at| hinge((at, places[at - 1], places[at]))).collect::<String>();
    format!("<robot name=\"chain\">{root}{}{hinges}</robot>", (1..places.len()).map(ball).collect::<String>())
}

const HEAVY: &str = r#"<link name="0"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>"#;
const BASE: &str = r#"<link name="0"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>"#;

#[test]
fn links_that_start_inside_each_other_pass_through_each_other_and_are_listed_with_their_depth() {
    // the third ball is 0.15 m from the first, which has 0.2 m to be clear; the fourth touches none but its neighbour
    let imported = import(&chain(HEAVY, &[0.0, 0.3, 0.15, 0.5]), None);
    let [pair] = imported.overlaps.as_slice() else { panic!("{:?}", imported.overlaps) };
    assert_eq!([pair.a.as_str(), pair.b.as_str()], ["0", "2"]);
    assert!((pair.depth_m - 0.05).abs() < 1e-6, "{}", pair.depth_m); // shapes are in single precision
    assert_eq!(apart(&imported), [["0", "2"]]);
    assert!(imported.toml.contains("# they overlap by 50.000 mm at the start\n[[coupling]]\n"), "{}", imported.toml);
    assert!(overlaps(&imported).is_empty());
}

#[test]
fn what_is_of_two_models_or_of_the_world_keeps_its_contact_although_it_overlaps() {
    let ball =
        |name: &str, x: f64| format!(r#"<body name="{name}" pos="{x} 0 0.05"><freejoint/><geom size="0.1"/></body>"#);
    let text = format!(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>{}{}</worldbody></mujoco>"#,
        ball("a", 0.0),
        ball("b", 0.1)
    );
    let imported = import(&text, None);
    assert!(imported.overlaps.is_empty() && apart(&imported).is_empty(), "{}", imported.toml);
    assert_eq!(overlaps(&imported).len(), 3);
}

#[test]
fn a_link_passes_through_the_fixed_base_that_it_hangs_on_and_others_collide_with_it() {
    let imported = import(&chain(BASE, &[0.0, 0.5, 1.0]), None);
    assert_eq!(apart(&imported), [["0", "1"]]);
    // through one of the scene's own: couplings are between objects that can move
    assert!(imported.toml.contains("name = \"0\"\nmodel = \"rigid\"\nkinematic = true\n"), "{}", imported.toml);
}

#[test]
fn pairs_of_an_srdf_do_not_collide_and_links_that_the_robot_has_not_are_none() {
    let srdf = r#"<robot name="chain"><group name="arm"><link name="1"/></group>
        <disable_collisions link1="3" link2="1" reason="Never"/><disable_collisions link1="3" link2="tool"/></robot>"#;
    assert_eq!(apart(&import(&chain(HEAVY, &[0.0, 1.0, 2.0, 3.0]), Some(srdf))), [["3", "1"]]);
    let more = r#"<robot><virtual_joint name="v"/><disable_collisions link1="3" link2="tool" reason="Never"/>
        <disable_default_collisions link="1"/><group name="arm"/></robot>"#;
    assert_eq!(
        crate::play::left_out(&import(&chain(HEAVY, &[0.0, 1.0]), Some(more))),
        [
            "line 1 of `the SRDF file`: virtual_joint `v`: is left out",
            "line 2 of `the SRDF file`: disable_default_collisions: is left out",
            "line 1 of `the SRDF file`: disable_collisions: names `3`, and there is no such link",
            "line 2 of `the SRDF file`: group `arm`: is left out",
        ]
    );
    let options = Options { srdf: Some("<robot><disable_collisions/></robot>"), ..Options::default() };
    let error = model(&chain(HEAVY, &[0.0, 1.0]), Path::new("."), &options).unwrap_err().to_string();
    assert_eq!(error, "line 1 of `the SRDF file`: disable_collisions: has no `link1`");
}

#[test]
fn bodies_of_several_links_pass_through_each_other_where_all_of_their_links_do() {
    // `0` and `tool` hang on `1` by joints, and `plate` is fixed to `0`
    let link = |name: &str, at: f64| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
            <collision><origin xyz="{at} 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>"#
        )
    };
    let joint = |kind: &str, parent: &str, child: &str| {
        format!(
            r#"<joint name="{child} on {parent}" type="{kind}"><parent link="{parent}"/><child link="{child}"/></joint>"#
        )
    };
    let links: String =
        [("1", 0.0), ("0", 1.0), ("plate", 2.0), ("tool", 3.0)].map(|(name, at)| link(name, at)).concat();
    let joints =
        [joint("continuous", "1", "0"), joint("fixed", "0", "plate"), joint("continuous", "1", "tool")].concat();
    let robot = format!("<robot name=\"r\">{links}{joints}</robot>");
    let pair = |other: &str| format!(r#"<disable_collisions link1="tool" link2="{other}" reason="Never"/>"#);
    let of = |pairs: &str| apart(&import(&robot, Some(&format!("<robot>{pairs}</robot>"))));
    assert!(of(&pair("0")).is_empty(), "the plate and the tool collide");
    assert_eq!(of(&(pair("0") + &pair("plate"))), [["tool", "0"]]);
}

#[test]
fn an_exclude_with_a_body_that_never_moves_is_in_the_scene() {
    let text = r#"<mujoco><worldbody><body name="post"><geom size="0.1"/>
        <body name="arm"><joint/><geom size="0.1" pos="0 0 1"/></body></body></worldbody>
        <contact><exclude body1="post" body2="arm"/></contact></mujoco>"#;
    assert_eq!(apart(&import(text, None)), [["post", "arm"]]);
    let world = text.replace("body1=\"post\"", "body1=\"world\"");
    let noted = crate::play::left_out(&import(&world, None));
    assert!(noted[0].ends_with("exclude: is left out: scenes exclude bodies from each other, not from the world"));
    // a plane is always fixed
    assert!(apart(&import(&text.replace("size=\"0.1\"/>\n", "type=\"plane\" size=\"1 1 1\"/>\n"), None)).is_empty());
    // without it they collide, as MuJoCo's filter of parents is not for parts of the world
    assert!(apart(&import(&text.replace("exclude", "pair"), None)).is_empty());
}

#[test]
fn a_robot_collides_with_the_base_of_another() {
    // both bases are welded to the world, with masses of their own
    let robot = |name: &str, x: f64| {
        format!(
            r#"<body name="{name}" pos="{x} 0 0"><freejoint/><geom size="0.1"/>
            <body name="{name} arm"><joint/><geom size="0.1" pos="0 0 1"/></body></body>"#
        )
    };
    let text = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", robot("a", 0.0), robot("b", 1.0));
    for srdf in [None, Some("<robot/>")] {
        let options = Options { fixed_base: true, srdf, ..Options::default() };
        let imported = model(&text, Path::new("."), &options).unwrap();
        assert!(apart(&imported).is_empty(), "{}", imported.toml);
        let noted = ["line 1: mujoco: the SRDF file is not read: it is one of a URDF robot"];
        assert_eq!(crate::play::left_out(&imported), &noted[..srdf.iter().count()]);
    }
}
