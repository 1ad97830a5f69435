//! Contact and motors in scenes: their effect in a running world, and the messages about wrong keys.

use metachron_core::{Body, ContactPartner, RigidState, SimSpan};
use metachron_scene::{SceneError, Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};

/// Half of a metre over a plane; the tests add keys to the ball, to the plane, and to the scene.
fn read(ball: &str, plane: &str, more: &str) -> Result<Scene, SceneError> {
    let text = format!(
        "format = 1\n[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1\nposition_m = [0, 0, 0.5]\n{ball}\n[[object]]\nname = \"ground\"\nmodel = \"rigid\"\nshape = \"plane\"\n{plane}\n{more}\n"
    );
    load(&Source::memory("contact", text.as_bytes())?, &[])
}

fn after(scene: &Scene, seconds: f64) -> World {
    let world = World::start(scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_secs_f64(seconds).unwrap());
    world
}

fn ball(world: &World) -> RigidState {
    let Body::Rigid(state) = world.latest(world.object("ball").unwrap()).unwrap().body else { panic!("a rigid body") };
    state
}

fn refused(ball: &str, plane: &str, more: &str, words: &[&str]) {
    let error = read(ball, plane, more).expect_err(more);
    let said: Vec<_> = error.problems.iter().map(|p| format!("{} {} {:?}", p.message, p.expected, p.help)).collect();
    let said = said.join("; ");
    for word in words {
        assert!(said.contains(word), "{word:?} is not said: {said}");
    }
}

#[test]
fn objects_of_groups_that_do_not_collide_pass_through_each_other() {
    let ground = "contact = { groups = [\"ground\"] }";
    let lands = read("contact = { groups = [\"balls\"], collides_with = [\"ground\"] }", ground, "").unwrap();
    assert!((ball(&after(&lands, 1.0)).position.z - 0.1).abs() < 1e-3);
    let passes = read("contact = { groups = [\"balls\"], collides_with = [\"balls\"] }", ground, "").unwrap();
    assert!(ball(&after(&passes, 1.0)).position.z < -4.0);
}

#[test]
fn a_group_more_than_a_scene_can_have_is_reported_once() {
    let names = (0..33).map(|k| format!("\"g{k:02}\"")).collect::<Vec<_>>().join(", ");
    let contact = format!("contact = {{ groups = [{names}], collides_with = [\"g32\"] }}");
    let error = read(&contact, "contact = { groups = [\"g32\"] }", "").unwrap_err();
    let said: Vec<_> = error.problems.iter().map(|problem| problem.message.as_str()).collect();
    assert_eq!(said, ["`groups` of `ball` names `g32`, one group more than a scene can have"]);
    refused("contact = { groups = [\"balls\"], collides_with = [\"bals\"] }", "", "", &["did you mean `balls`?"]);
}

#[test]
fn a_sensor_is_told_of_in_the_state_of_what_touched_it() {
    let gate = "[[object]]\nname = \"gate\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [1, 1, 0.05]\nposition_m = [0, 0, 0.2]\nfixed = true\ncontact = { sensor = true }";
    let scene = read("", "", gate).unwrap();
    assert!(scene.overlaps.is_empty(), "nothing is inside of a sensor");
    let world = after(&scene, 1.0);
    // the lower side of the gate is 0.15 m up, the upper side of the ball at rest 0.2 m
    assert!((ball(&world).position.z - 0.1).abs() < 1e-3);
    let state = world.latest(world.object("ball").unwrap()).unwrap();
    let [touch] = state.sensed.as_slice() else { panic!("{:?}", state.sensed) };
    assert_eq!((touch.with, touch.touching, touch.ends + 1), (ContactPartner::Static(1), true, touch.begins));
}

#[test]
fn a_motor_turns_what_its_hinge_holds() {
    let hinge = |motor: &str| {
        format!(
            "[[joint]]\nkind = \"revolute\"\na = \"ground\"\nb = \"ball\"\nat_a_m = [0, 0, 0.5]\naxis = [0, 0, 1]\nmotor = {{ {motor} }}"
        )
    };
    let turning = read("", "", &hinge("velocity_rad_s = 2, max_torque_n_m = 0.01")).unwrap();
    // 0.4 · 1 kg · 0.01 m² is spun up by 2.5 rad/s²
    let spin = ball(&after(&turning, 0.4)).spin.z;
    assert!((spin - 1.0).abs() < 0.02, "{spin} rad/s on its way");
    assert!((ball(&after(&turning, 2.0)).spin.z - 2.0).abs() < 1e-3);
    let turned = read("", "", &hinge("position_deg = 90, stiffness_n_m_rad = 4, damping_n_m_s_rad = 0.3")).unwrap();
    let angle = ball(&after(&turned, 3.0)).rotation.to_scaled_axis().z;
    assert!((angle - std::f64::consts::FRAC_PI_2).abs() < 1e-3, "{angle} rad");
}

/// Two balls beside the first one, hinged about z, and one on a slide that starts a decimetre out; `mimic` is that of the slide.
fn wheels(mimic: &str) -> String {
    let body = |name: &str, x: f64| {
        format!(
            "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1\nposition_m = [{x}, 0, 0.5]\n"
        )
    };
    let joint = |kind: &str, a: &str, more: &str| {
        format!("[[joint]]\nname = \"{a}\"\nkind = \"{kind}\"\na = \"{a}\"\nb = \"world\"\naxis = [0, 0, 1]\n{more}\n")
    };
    [
        body("cart", 1.0),
        body("wheel", 2.0),
        joint("prismatic", "cart", &format!("at_b_m = [1, 0, 0.6]\n{mimic}")),
        joint("revolute", "wheel", "motor = { velocity_rad_s = -0.5 }"),
        joint("spherical", "ball", "").replace("axis = [0, 0, 1]\n", ""),
    ]
    .concat()
}

#[test]
fn a_slide_follows_a_hinge_from_where_both_start() {
    let world = after(&read("", "", &wheels("mimic = { joint = \"wheel\", ratio = 0.2 }")).unwrap(), 1.0);
    let position = |name: &str| {
        let state = world.joint_state(world.joint(name).unwrap()).unwrap();
        state.position
    };
    let (cart, wheel) = (position("cart"), position("wheel"));
    assert!((wheel + 0.5).abs() < 1e-3, "{wheel} rad");
    // joints hold to a quarter of the depth of contacts
    assert!((cart - (0.1 + 0.2 * wheel)).abs() < 5e-6, "{cart} m at {wheel} rad");
}

#[test]
fn a_mimic_that_cannot_be_is_told_with_what_was_expected() {
    let mimic = |keys: &str, words: &[&str]| refused("", "", &wheels(&format!("mimic = {{ {keys} }}")), words);
    mimic("joint = \"weel\"", &["names `weel`, which does not exist", "did you mean `wheel`?"]);
    mimic("joint = \"cart\"", &["is the joint itself", "expected another revolute or prismatic joint"]);
    mimic("joint = \"ball\"", &["is neither revolute nor prismatic"]);
    let ring = wheels("mimic = { joint = \"wheel\" }")
        .replace("motor = { velocity_rad_s = -0.5 }", "mimic = { joint = \"cart\" }");
    let error = read("", "", &ring).unwrap_err();
    let said: Vec<_> = error.problems.iter().map(|p| (p.message.as_str(), p.expected.as_str())).collect();
    let (told, wanted) = (
        "`joint` of joint `wheel` is a joint that follows this one in turn",
        "expected a joint that moves by itself, or follows another one",
    );
    assert_eq!(said, [(told, wanted)], "the ring is one problem");
    mimic("joint = \"wheel\", ratio = 1e7", &["`ratio`", "is 10000000", "-1000000 to 1000000"]);
    let ball = "[[joint]]\nkind = \"spherical\"\na = \"ball\"\nb = \"world\"\nmimic = { joint = \"x\" }";
    refused("", "", ball, &["`mimic`", "does not belong to a spherical joint"]);
}

#[test]
fn a_slow_motor_does_not_fall_asleep() {
    let slide = "[[joint]]\nkind = \"prismatic\"\na = \"ground\"\nb = \"ball\"\nat_a_m = [0, 0, 0.5]\naxis = [1, 0, 0]\nmotor = { velocity_m_s = 1e-3 }";
    let world = after(&read("", "", slide).unwrap(), 4.0);
    let way = ball(&world).position.x;
    assert!((way / 4e-3 - 1.0).abs() < 0.01, "{way} m");
}

#[test]
fn rules_of_pairs_and_a_radius_of_spin_reach_the_ground() {
    let text = |ball: &str, plane: &str| {
        format!(
            "format = 1\n[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nmass_kg = 1\nfriction = 0.2\nposition_m = [0, 0, 0.1]\nspin_rad_s = [0, 0, 10]\n{ball}\n[[object]]\nname = \"ground\"\nmodel = \"rigid\"\nshape = \"plane\"\nfriction = 0.8\n{plane}"
        )
    };
    for (rule, friction) in [("", 0.4), (", friction_rule = \"max\"", 0.8), (", friction_rule = \"min\"", 0.2)] {
        let text =
            text("contact = { friction_rule = \"average\" }", &format!("contact = {{ spin_radius_m = 0.02{rule} }}"));
        let text = if rule.is_empty() { text.replace("contact = { friction_rule = \"average\" }", "") } else { text };
        let scene = Source::memory("spin", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        let spin = ball(&after(&scene, 0.2)).spin.z;
        let wanted = 10.0 - friction * 0.02 * 9.81 / (0.4 * 0.01) * 0.2;
        assert!((spin - wanted).abs() < 0.15, "{rule}: {spin} rad/s, {wanted} wanted");
    }
}

#[test]
fn a_wrong_key_of_contact_or_of_a_motor_is_told_with_what_was_expected() {
    refused(
        "contact = { collides_with = [\"grond\"] }",
        "contact = { groups = [\"ground\"] }",
        "",
        &["`collides_with` of `ball` names `grond`", "ground"],
    );
    refused("contact = { groups = [] }", "", "", &["`groups` of `ball` is empty"]);
    refused(
        "contact = { grid = [2, 1, 1] }",
        "",
        "",
        &[
            "no key `grid`",
            "keys of this table: collides_with, friction_rule, groups, restitution_rule, sensor, spin_radius_m\")",
        ],
    );
    let many: Vec<String> = (10..43).map(|i| format!("\"g{i}\"")).collect();
    let error = read(&format!("contact = {{ groups = [{}] }}", many.join(", ")), "", "").unwrap_err();
    assert_eq!(error.problems.len(), 1, "the one too many, once: {:?}", error.problems);
    assert!(error.problems[0].message.contains("`g42`, one group more"));
    refused("contact = { friction_rule = \"sum\" }", "", "", &["sum", "geometric-mean"]);
    refused("contact = { spin_radius_m = -1 }", "", "", &["`spin_radius_m` of `ball` is -1", "0 to 10"]);
    let mesh = "[[object]]\nname = \"sky\"\nmodel = \"mesh\"\ngenerate = \"sphere\"\ncontact = { sensor = true }";
    refused("", "", mesh, &["`contact` of `sky` has no effect"]);
    let hinge = |motor: &str| {
        format!(
            "[[joint]]\nkind = \"revolute\"\na = \"ball\"\nb = \"world\"\naxis = [0, 0, 1]\nrange_deg = [-10, 10]\nmotor = {{ {motor} }}"
        )
    };
    refused(
        "",
        "",
        &hinge("velocity_m_s = 1"),
        &["`velocity_m_s`", "does not belong to the motor of a revolute joint"],
    );
    refused("", "", &hinge("max_torque_n_m = 1"), &["`velocity_rad_s`", "is missing"]);
    refused("", "", &hinge("position_deg = 5"), &["`stiffness_n_m_rad`", "is missing"]);
    refused(
        "",
        "",
        &hinge("position_deg = 20, stiffness_n_m_rad = 1"),
        &["`position_deg`", "outside of the joint's range"],
    );
    let fixed = "[[joint]]\nkind = \"fixed\"\na = \"ball\"\nb = \"world\"\nmotor = { velocity_rad_s = 1 }";
    refused("", "", fixed, &["`motor`", "does not belong to a fixed joint"]);
    let other = "[[object]]\nname = \"bob\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [2, 0, 1]\ncontact = { groups = [\"bobs\"] }\n[[coupling]]\na = \"ball\"\nb = \"bob\"\nlaw = \"ledger\"";
    refused("contact = { groups = [\"balls\"], collides_with = [\"balls\"] }", "", other, &["by their groups"]);
    refused("contact = { sensor = true }", "", other, &["only senses"]);
}
