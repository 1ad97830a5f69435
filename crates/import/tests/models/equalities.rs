//! Equalities of MJCF models: bodies that share a point or a pose, joints that follow others.

use crate::play::{advance, centre, left_out, position, start};
use metachron_import::{ImportError, Imported, mjcf};
use std::path::Path;

fn import(text: &str) -> Result<Imported, ImportError> {
    mjcf(text, Path::new("."))
}

#[test]
fn bodies_that_share_a_point_or_a_pose_are_joined() {
    // a ball that starts beside its anchor, one welded to a post, and a chain whose end is held where it starts
    let text = r#"<mujoco><default><geom contype="0" conaffinity="0"/></default><worldbody>
        <body name="post" pos="0 0 2"><geom size="0.1"/></body>
        <body name="bob" pos="0.5 0 2"><freejoint/><geom size="0.1"/></body>
        <body name="held" pos="2 0 2"><freejoint/><geom size="0.1"/></body>
        <body name="upper" pos="5 0 2"><joint axis="0 1 0"/><geom size="0.1" pos="0.5 0 0"/>
        <body name="lower" pos="1 0 0"><joint axis="0 1 0"/><geom size="0.1" pos="0.5 0 0"/></body></body></worldbody>
        <equality><connect body1="bob" body2="post" anchor="-0.5 0 0"/><weld body1="post" body2="held"/>
        <connect body1="lower" anchor="1 0 0"/><weld body1="held" active="false"/><tendon tendon1="a" tendon2="b"/></equality>
        </mujoco>"#;
    let imported = import(text).unwrap();
    assert_eq!(
        left_out(&imported),
        ["line 8: equality, tendon: is left out: scenes have joints between two bodies, and joints that follow joints"]
    );
    let world = start(&imported, &[], 1000.0);
    // from the level a pendulum of a point takes K(1/√2) √(l/g) to its lowest, where a ball has 2/5 r² more than l²
    let (l, r) = (0.5_f64, 0.1_f64);
    advance(&world, 1.854_074_677 * ((l * l + 0.4 * r * r) / (l * 9.81)).sqrt());
    assert!(centre(&world, "bob").distance(glam::DVec3::new(0.0, 0.0, 1.5)) < 5e-3, "{}", centre(&world, "bob"));
    assert!(centre(&world, "held").distance(glam::DVec3::new(2.0, 0.0, 2.0)) < 1e-6);
    // both rods are stretched, and held at both ends
    assert!(centre(&world, "lower").distance(glam::DVec3::new(6.5, 0.0, 2.0)) < 0.05);
    let none = r#"<mujoco><equality><connect body1="none" anchor="0 0 0"/></equality></mujoco>"#;
    let error = import(none).unwrap_err().to_string();
    assert_eq!(error, "line 1: equality, connect: names `none`, and there is no such body");
}

/// Two wheels with a spring on the first, and an equality between them.
fn wheels(equality: &str) -> String {
    format!(
        r#"<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody>
        <body name="a"><joint name="first" stiffness="3" springref="0.5" ref="0.1"/><inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/></body>
        <body name="b"><joint name="second"/><inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.01"/></body>
        <body name="c"><joint name="ball" type="ball"/><inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.01"/></body>
        </worldbody><equality>
{equality}</equality></mujoco>"#
    )
}

#[test]
fn a_joint_that_an_equality_ties_to_another_goes_with_it() {
    let ratio = -1.5_f64;
    let text = wheels(&format!(r#"<joint joint1="second" joint2="first" polycoef="0 {ratio}"/>"#));
    let imported = import(&text).unwrap();
    assert_eq!(left_out(&imported), [""; 0]);
    // a spring that rests 0.4 rad away swings both inertias
    let omega = (3.0 / (0.02 + ratio * ratio * 0.01)).sqrt();
    let world = start(&imported, &["first", "second"], 2000.0);
    for quarter in 1..=4 {
        let time = f64::from(quarter) * 0.1;
        advance(&world, 0.1);
        let expected = 0.4 * (1.0 - (omega * time).cos());
        let [first, second] = ["first", "second"].map(|joint| position(&world, joint));
        // a step of first order errs by ω h/2 = 2.5e-3 of the amplitude
        assert!((first - expected).abs() < 4e-3 * 0.4, "{first} for {expected}");
        assert!((second - ratio * first).abs() < 1e-7, "{second} of {first}");
    }
}

#[test]
fn an_equality_that_no_joint_of_a_scene_can_keep_is_listed_or_refused() {
    let listed = |equality: &str| left_out(&import(&wheels(equality)).unwrap());
    assert_eq!(
        listed(r#"<joint joint1="first"/>"#),
        ["line 6: equality, joint: is left out: it holds one joint; expected `joint2`, which that one follows"]
    );
    assert_eq!(
        listed(r#"<joint joint1="first" joint2="second" polycoef="0.2 1 0.5 0 0"/>"#),
        [
            "line 6: equality, joint: has no powers above the first: a joint of a scene follows another by a ratio",
            "line 6: equality, joint: holds its joints as they start, -0.2 from where the file does",
        ]
    );
    let twice = r#"<joint joint1="first" joint2="second"/><joint joint1="first" joint2="second"/>"#;
    assert!(listed(twice)[0].ends_with("a joint of a scene follows one other, and this one does already"));
    let ring = r#"<joint joint1="first" joint2="second"/><joint joint1="second" joint2="first"/>"#;
    assert_eq!(listed(ring), ["line 6: equality, joint: is left out: `first` follows `second` already"]);
    for (equality, why) in [
        (r#"<joint joint1="first" joint2="third"/>"#, "names `third`, and there is no hinge or slide of that name"),
        (r#"<joint joint1="first" joint2="ball"/>"#, "names `ball`, and there is no hinge or slide of that name"),
        (r#"<joint joint1="first" joint2="first"/>"#, "ties a joint to itself; expected two joints"),
        (
            r#"<joint joint1="first" joint2="second" polycoef="0 1e8"/>"#,
            "`polycoef` has the ratio 100000000; expected -1000000 to 1000000",
        ),
        (
            r#"<joint joint1="first" joint2="second" polycoef="0 1 0 0 0 0 7"/>"#,
            "`polycoef` has 7 numbers; expected 5 at most",
        ),
    ] {
        let refused = import(&wheels(equality)).unwrap_err().to_string();
        assert!(refused.ends_with(why), "{refused}");
    }
}
