//! Joints, couplings, grids and faults as users write them: the scenes that load, and the text of errors.

use glam::DVec3;
use metachron_contact::Law;
use metachron_core::Anchor;
use metachron_models::rigid::JointKind;
use metachron_scene::{SceneError, Source, load};
use metachron_world::couplings::CouplingKind;
use metachron_world::{Scene, Spec};

/// Two boxes side by side, a tube, two tools, an agent without matter and a post; the tests add ties.
const YARD: &str = r#"format = 1
object = [
    { name = "left", model = "rigid", shape = "box", half_extents_m = [0.5, 0.5, 0.5] },
    { name = "right", model = "rigid", shape = "box", half_extents_m = [0.5, 0.5, 0.5], position_m = [1.0, 0.0, 0.0], rotation_deg = [0, 0, 90] },
    { name = "hose", model = "tube", path_m = [[0, 0, 3], [2, 0, 3]], radius_m = 0.02, young_pa = 1e6, density_kg_m3 = 1000 },
    { name = "tool", model = "instrument", keyframe = [{ tip_m = [0, 0, 4] }] },
    { name = "hand", model = "instrument", keyframe = [{ tip_m = [0, 1, 4] }] },
    { name = "ghost", model = "synthetic", cost_us = 1 },
    { name = "post", model = "rigid", shape = "ball", radius_m = 0.1, fixed = true, position_m = [0, 0, 2] },
]
"#;

fn read(text: &str) -> Result<Scene, SceneError> {
    load(&Source::memory("test.toml", text.as_bytes())?, &[])
}

fn with(ties: &str) -> Scene {
    read(&format!("{YARD}{ties}\n")).unwrap_or_else(|e| panic!("{ties}: {:?}", miette::Report::new(e)))
}

/// The only problem of the yard with these ties: its line counted from the ties' first, its text, and its messages.
fn refusal(ties: &str) -> (usize, String, String) {
    let error = read(&format!("{YARD}{ties}\n")).expect_err(ties);
    assert_eq!(error.problems.len(), 1, "{ties}: {:#?}", error.problems);
    let p = &error.problems[0];
    let said = format!("{}; {}; {}", p.message, p.expected, p.help.clone().unwrap_or_default());
    (p.line - YARD.lines().count(), p.text.clone(), said)
}

/// Asserts that a joint with these keys is refused with `text` underlined and all of `words` said.
fn joint_refused(keys: &str, text: &str, words: &[&str]) {
    said(&format!("joint = [{{ {keys} }}]"), text, words);
}

fn coupling_refused(keys: &str, text: &str, words: &[&str]) {
    said(&format!("coupling = [{{ {keys} }}]"), text, words);
}

fn said(ties: &str, text: &str, words: &[&str]) {
    let (line, shown, said) = refusal(ties);
    assert_eq!((line, shown.as_str()), (1, text), "{ties}: {said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is not said of {ties}: {said}");
    }
}

#[test]
fn a_hinge_without_a_second_anchor_holds_both_objects_at_the_same_point() {
    let scene = with(
        r#"joint = [{ kind = "revolute", a = "left", b = "right", at_a_m = [0.5, 0, 0], axis = [0, 0, 2], range_deg = [-90, 0] }]"#,
    );
    let joint = scene.joints[0];
    let JointKind::Revolute { axis, range_rad: Some([least, greatest]), .. } = joint.kind else { panic!("{joint:?}") };
    assert_eq!((axis, greatest), (DVec3::Z, 0.0));
    assert!((least + std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    // half a metre before the right box, whose axes are turned by 90 degrees about z
    assert!(joint.anchor_b_m.distance(DVec3::new(0.0, 0.5, 0.0)) < 1e-15, "{}", joint.anchor_b_m);
    assert!((joint.rest * DVec3::X).distance(DVec3::Y) < 1e-15);
    assert!(!joint.collide);
}

#[test]
fn a_joint_to_a_fixed_object_is_a_joint_to_the_world_whichever_comes_first() {
    let first = with(
        r#"joint = [{ kind = "revolute", a = "left", b = "post", at_a_m = [0, 0, 2], axis = [1, 0, 0], range_deg = [0, 30] }]"#,
    );
    let second =
        with(r#"joint = [{ kind = "revolute", a = "post", b = "left", axis = [1, 0, 0], range_deg = [0, 30] }]"#);
    let (first, second) = (first.joints[0], second.joints[0]);
    assert_eq!((first.b, second.b), (None, None));
    assert_eq!((first.anchor_a_m, first.anchor_b_m), (second.anchor_a_m, second.anchor_b_m));
    assert_eq!(first.anchor_b_m, DVec3::new(0.0, 0.0, 2.0));
    // the post's turn against the box about x is the box's against the post about -x
    let axis = |kind| if let JointKind::Revolute { axis, .. } = kind { axis } else { panic!("{kind:?}") };
    assert_eq!((axis(first.kind), axis(second.kind)), (DVec3::X, -DVec3::X));
}

#[test]
fn springs_and_ropes_are_as_long_as_they_start_where_nothing_is_said() {
    let scene = with(
        r#"joint = [
        { kind = "spring", a = "left", b = "right", stiffness_n_m = 100 },
        { kind = "rope", a = "left", b = "world", at_b_m = [0, 0, 3] },
    ]"#,
    );
    assert!(matches!(scene.joints[0].kind, JointKind::Spring { rest_m: 1.0, damping_n_s_m: 0.0, .. }));
    assert!(matches!(scene.joints[1].kind, JointKind::Rope { length_m: 3.0 }));
    assert!(scene.joints.iter().all(|j| j.collide));
}

#[test]
fn a_joint_names_two_rigid_objects() {
    joint_refused(
        r#"kind = "fixed", a = "lefd", b = "right""#,
        "\"lefd\"",
        &["does not exist", "did you mean `left`?"],
    );
    joint_refused(r#"kind = "fixed", a = "left", b = "left""#, "\"left\"", &["another object"]);
    joint_refused(r#"kind = "fixed", a = "left", b = "hose""#, "\"hose\"", &["is a tube", "[[coupling]]", "attach"]);
    joint_refused(r#"kind = "fixed", a = "tool", b = "left""#, "\"tool\"", &["is a tool", "attach"]);
    joint_refused(r#"kind = "fixed", a = "left", b = "ghost""#, "\"ghost\"", &["without a body"]);
    joint_refused(r#"kind = "fixed", a = "world", b = "left""#, "\"world\"", &["the world is written as `b`"]);
    joint_refused(r#"kind = "fixed", a = "post", b = "world""#, "\"world\"", &["is fixed, and so is `a`"]);
    joint_refused(r#"kind = "weld", a = "left", b = "right""#, "\"weld\"", &["`fixed`", "`rope`"]);
}

#[test]
fn a_joint_takes_the_keys_of_its_kind_alone() {
    let pair = r#"a = "left", b = "right""#;
    joint_refused(
        &format!(r#"kind = "fixed", {pair}, axis = [0, 0, 1]"#),
        "[0, 0, 1]",
        &["does not belong to a fixed joint"],
    );
    joint_refused(&format!(r#"kind = "revolute", {pair}, axis = [0, 0, 0]"#), "[0, 0, 0]", &["has no direction"]);
    joint_refused(&format!(r#"kind = "spring", {pair}, stiffness_n_m = 0"#), "0", &["`stiffness_n_m`", "0.000001"]);
    joint_refused(
        &format!(r#"kind = "spring", {pair}, stiffness_n_m = 1, damping_n_s_m = -1"#),
        "-1",
        &["`damping_n_s_m`"],
    );
    joint_refused(&format!(r#"kind = "rope", {pair}, length_m = -1"#), "-1", &["`length_m`"]);
    let whole = |keys: &str| format!("{{ {keys} }}");
    let spring = format!(r#"kind = "spring", {pair}"#);
    joint_refused(&spring, &whole(&spring), &["`stiffness_n_m`", "is missing"]);
    let hinge = format!(r#"kind = "revolute", {pair}"#);
    joint_refused(&hinge, &whole(&hinge), &["`axis`", "is missing"]);
    let rope = r#"kind = "rope", a = "left", b = "world""#;
    joint_refused(rope, &whole(rope), &["`at_b_m`", "is missing"]);
}

#[test]
fn a_joint_holds_where_the_objects_start() {
    let pair = r#"a = "left", b = "right""#;
    joint_refused(
        &format!(r#"kind = "fixed", {pair}, at_b_m = [0, 0.6, 0]"#),
        "[0, 0.6, 0]",
        &["is 0.4000 m away from", "within 0.001 m"],
    );
    joint_refused(
        &format!(r#"kind = "spherical", {pair}, at_b_m = [0, 1, 0.01]"#),
        "[0, 1, 0.01]",
        &["is 0.0100 m away from"],
    );
    joint_refused(
        &format!(r#"kind = "prismatic", {pair}, axis = [0, 0, 1], at_b_m = [0, 0, 0]"#),
        "[0, 0, 0]",
        &["1.0000 m off the axis"],
    );
    joint_refused(
        &format!(r#"kind = "prismatic", {pair}, axis = [1, 0, 0], at_b_m = [0, 0, 0], range_m = [0, 0.5]"#),
        "[0, 0.5]",
        &["start at 1.0000 m"],
    );
    joint_refused(
        &format!(r#"kind = "prismatic", {pair}, axis = [1, 0, 0], range_m = [0.2, 0.5]"#),
        "[0.2, 0.5]",
        &["start at 0.0000 m"],
    );
    joint_refused(
        &format!(r#"kind = "revolute", {pair}, axis = [1, 0, 0], range_deg = [-400, 0]"#),
        "[-400, 0]",
        &["180"],
    );
    joint_refused(&format!(r#"kind = "rope", {pair}, length_m = 0.5"#), "0.5", &["start 1.0000 m apart"]);
    with(&format!(
        r#"joint = [{{ kind = "prismatic", {pair}, axis = [1, 0, 0], at_b_m = [0, 0, 0], range_m = [0, 1.5] }}]"#
    ));
}

#[test]
fn joints_of_one_pair_must_leave_something_free_together() {
    let both = |one: &str, two: &str| {
        format!("joint = [\n{{ a = \"left\", b = \"right\", {one} }},\n{{ a = \"right\", b = \"left\", {two} }},\n]")
    };
    let refused = |one: &str, two: &str, word: &str| {
        let (line, _, said) = refusal(&both(one, two));
        assert_eq!(line, 3, "{said}");
        assert!(said.contains(word), "{word} is not in {said}");
    };
    let fixed = r#"kind = "fixed""#;
    let hinge = |axis: &str, at: &str| format!(r#"kind = "revolute", axis = {axis}, at_a_m = {at}"#);
    let slide = r#"kind = "prismatic", axis = [1, 0, 0]"#;
    refused(fixed, fixed, "connects already");
    refused(fixed, &hinge("[0, 0, 1]", "[0, 0, 0]"), "contradicts the fixed joint");
    refused(&hinge("[0, 0, 1]", "[0, 0, 0]"), &hinge("[0, 1, 0]", "[0, 0, 0]"), "rotates about another axis");
    // parallel axes, one metre apart: the right box's origin is not the left one's
    refused(&hinge("[0, 0, 1]", "[0, 0, 0]"), &hinge("[0, 0, 1]", "[0, 0, 0]"), "rotates about another axis");
    refused(slide, &hinge("[0, 0, 1]", "[0, 0, 0]"), "one rotates, the other slides");
    refused(&hinge("[0, 0, 1]", "[0, 0, 0]"), r#"kind = "spherical""#, "off the axis");
    // one line through both origins: the right box's -y axis is the world's x
    with(&both(&hinge("[1, 0, 0]", "[0, 0, 0]"), &hinge("[0, 1, 0]", "[0, 0, 0]")));
    with(&both(&hinge("[1, 0, 0]", "[0, 0, 0]"), r#"kind = "spherical""#));
}

#[test]
fn couplings_name_laws_and_points_of_both_objects() {
    let scene = with(
        r#"coupling = [
        { a = "left", b = "right", law = "tlm", stiffness_n_m = 50, damping_n_s_m = 2 },
        { a = "hose", b = "right", kind = "attach", at_a = 0.25, at_b = [0, 0, 0.5], stiffness_n_m = 10, rest_m = 0.5 },
        { a = "tool", b = "hose", law = "off" },
    ]"#,
    );
    assert_eq!(scene.couplings[0].law, Law::Tlm { stiffness_n_m: 50.0, damping_n_s_m: 2.0 });
    let CouplingKind::Attach { at_a: Anchor::Arc(arc_m), at_b: Anchor::Local(local), rest_m, .. } =
        scene.couplings[1].kind
    else {
        panic!("{:?}", scene.couplings[1])
    };
    // a quarter of two metres; a straight skeleton is measured to rounding
    assert!((arc_m - 0.5).abs() < 1e-9 && local == DVec3::new(0.0, 0.0, 0.5) && rest_m == 0.5, "{arc_m} {local}");
    assert_eq!((scene.couplings[1].law, scene.couplings[2].law), (Law::Cluster, Law::Off));
}

#[test]
fn a_coupling_that_cannot_be_says_why() {
    let pair = r#"a = "left", b = "right""#;
    coupling_refused(r#"a = "left", b = "rigth""#, "\"rigth\"", &["did you mean `right`?"]);
    coupling_refused(r#"a = "left", b = "left""#, "\"left\"", &["another object"]);
    coupling_refused(r#"a = "tool", b = "hand", law = "off""#, "\"hand\"", &["is a tool, as `a` is"]);
    coupling_refused(r#"a = "left", b = "post""#, "\"post\"", &["which is fixed"]);
    coupling_refused(r#"a = "ghost", b = "left""#, "\"ghost\"", &["without a body"]);
    coupling_refused(&format!(r#"{pair}, law = "spring""#), "\"spring\"", &["`ledger`", "`tlm`"]);
    coupling_refused(&format!(r#"{pair}, stiffness_n_m = 5"#), "5", &["does not belong to contact"]);
    let ledger = format!(r#"{pair}, law = "ledger""#);
    coupling_refused(&format!("{ledger}, stiffness_n_m = 5"), "5", &["does not belong to contact by `ledger`"]);
    for law in ["penalty", "penalty-extrapolated"] {
        let penalty = format!(r#"{pair}, law = "{law}", stiffness_n_m = 5"#);
        coupling_refused(&penalty, &format!("\"{law}\""), &["stay in the laboratory"]);
    }
    coupling_refused(&format!(r#"{pair}, law = "tlm", stiffness_n_m = -5"#), "-5", &["`stiffness_n_m`", "N/m"]);
    coupling_refused(&format!(r#"{pair}, at_a = 0.5"#), "0.5", &["`at_a`", "does not belong"]);
    let attach = r#"a = "hose", b = "left", kind = "attach", stiffness_n_m = 5"#;
    coupling_refused(&format!("{attach}, at_a = 1.5, at_b = [0, 0, 0]"), "1.5", &["from 0 to 1"]);
    coupling_refused(&format!("{attach}, at_a = [0, 0, 0], at_b = [0, 0, 0]"), "[0, 0, 0]", &["is a tube", "0 … 1"]);
    coupling_refused(&format!("{attach}, at_a = 0.5, at_b = 0.5"), "0.5", &["[x, y, z]"]);
    coupling_refused(&format!("{attach}, at_a = \"end\", at_b = [0, 0, 0]"), "\"end\"", &["a number from 0 to 1"]);
    coupling_refused(&format!("{attach}, at_a = 1, at_b = [0, 0, 0], law = \"off\""), "\"off\"", &["attaches nothing"]);
    let tlm = format!(r#"{pair}, law = "tlm""#);
    coupling_refused(&tlm, &format!("{{ {tlm} }}"), &["`stiffness_n_m`", "is missing"]);
    let twice = format!("coupling = [\n{{ {pair}, law = \"off\" }},\n{{ a = \"right\", b = \"left\" }},\n]");
    let (line, text, said) = refusal(&twice);
    assert_eq!((line, text.as_str()), (3, "\"left\""), "{said}");
    assert!(said.contains("one contact law for a pair"), "{said}");
}

#[test]
fn a_grid_makes_numbered_objects_that_others_can_name() {
    let scene = read(
        "format = 1\nprobe = [{ object = \"box-7\" }]\njoint = [{ kind = \"fixed\", a = \"box-1\", b = \"box-0\" }]\n[[object]]\nname = \"box\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n\
         position_m = [1, 0, 0]\ngrid = [2, 2, 2]\nspacing_m = [1, 2, 3]\n",
    )
    .unwrap();
    let at = |k: usize| if let Spec::Rigid(body) = &scene.agents[k].spec { body.position } else { panic!("{k}") };
    assert_eq!((scene.agents.len(), scene.agents[7].name.as_str(), scene.agents[7].id.0), (8, "box-7", 7));
    assert_eq!((at(0), at(1), at(7)), (DVec3::X, DVec3::new(2.0, 0.0, 0.0), DVec3::new(2.0, 2.0, 3.0)));
    assert_eq!(scene.probes[0].agent, scene.agents[7].id);
    assert_eq!((scene.joints[0].a, scene.joints[0].b), (scene.agents[1].id, Some(scene.agents[0].id)));
}

#[test]
fn scattered_objects_stay_within_the_distance_and_follow_the_seed() {
    let places = |seed: u32| {
        let text = format!(
            "format = 1\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\ngrid = [5, 5, 4]\nspacing_m = [1, 1, 1]\nscatter_m = 0.25\nscatter_seed = {seed}\n"
        );
        let scene = read(&text).unwrap();
        scene
            .agents
            .iter()
            .map(|m| if let Spec::Rigid(b) = &m.spec { b.position } else { panic!("{}", m.name) })
            .collect::<Vec<_>>()
    };
    let one = places(1);
    assert_eq!(one, places(1));
    assert_ne!(one, places(2));
    assert!(one.iter().all(|p| (*p - p.round()).abs().max_element() <= 0.25));
}

#[test]
fn a_grid_that_cannot_be_says_why() {
    let refused = |keys: &str, text: &str, word: &str| {
        let scene = format!(
            "format = 1\n[[object]]\nname = \"b\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\n{keys}\n"
        );
        let error = read(&scene).expect_err(keys);
        let p = &error.problems[0];
        let said = format!("{}; {}", p.message, p.expected);
        assert_eq!((error.problems.len(), p.text.as_str()), (1, text), "{said}");
        assert!(scene.lines().nth(p.line - 1).is_some_and(|line| line.ends_with(text)), "line {}: {said}", p.line);
        assert!(said.contains(word), "{word} is not in {said}");
    };
    refused(
        "spacing_m = [1, 1, 1]\ngrid = [110, 10, 10]",
        "[110, 10, 10]",
        "makes 11000 objects; expected at most 10000",
    );
    refused("spacing_m = [1, 1, 1]\ngrid = [0, 10, 10]", "[0, 10, 10]", "1 … 1000");
    refused(
        "spacing_m = [1, 1, 1]\ngrid = [4294967295, 4294967295, 1]",
        "[4294967295, 4294967295, 1]",
        "at most 10000",
    );
    refused("scatter_m = 0.1", "0.1", "without a grid");
    refused("spacing_m = [1, 1, 1]\ngrid = [2, 1, 1]\nscatter_m = -1", "-1", "`scatter_m`");
    refused(
        "spacing_m = [1, 1, 1]\ngrid = [2, 1, 1]\nfriction = -0.5",
        "-0.5",
        "`friction` of `b` is -0.5; expected a number from 0 to 10",
    );
    refused("spacing_m = [1, 1, 1]\ngrid = [2, 1, 1]\nmass_kg = 0", "0", "`mass_kg` of `b` is 0");
    let taken = "format = 1\nobject = [\n{ name = \"b-1\", model = \"synthetic\", cost_us = 1 },\n{ name = \"b\", model = \"rigid\", shape = \"ball\", radius_m = 1, grid = [2, 1, 1], spacing_m = [3, 3, 3] },\n]\n";
    assert!(read(taken).unwrap_err().problems[0].message.contains("`b-1`, the name of another object"));
    let ghost = "format = 1\nobject = [{ name = \"g\", model = \"synthetic\", cost_us = 1, grid = [2, 1, 1], spacing_m = [1, 1, 1] }]\n";
    assert!(read(ghost).unwrap_err().problems[0].expected.contains("expected no `grid`"));
}

#[test]
fn faults_are_the_objects_own_and_else_the_worlds() {
    let scene = read(
        "format = 1\n[world.faults]\njitter = 0.2\nloss = 0.1\nseed = 3\n[[object]]\nname = \"a\"\nmodel = \"synthetic\"\ncost_us = 1\n\
         [[object]]\nname = \"b\"\nmodel = \"synthetic\"\ncost_us = 1\nfaults = { loss = 0.0, seed = 4 }\n",
    )
    .unwrap();
    let faults = |k: usize| (scene.agents[k].faults.jitter, scene.agents[k].faults.loss, scene.agents[k].faults.seed);
    assert_eq!((faults(0), faults(1)), ((0.2, 0.1, 3), (0.2, 0.0, 4)));
    for (keys, word) in [("jitter = 0.6", "`jitter`"), ("loss = 1.0", "`loss`"), ("jitter = nan", "from 0 to 0.5")] {
        let error = read(&format!("format = 1\n[world.faults]\n{keys}\n")).unwrap_err();
        let p = &error.problems[0];
        assert!(p.line == 3 && format!("{} {}", p.message, p.expected).contains(word), "{p:?}");
    }
}
