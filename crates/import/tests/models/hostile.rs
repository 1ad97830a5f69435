//! Models that no one means, which end with an error or a list.

use crate::play::{advance, left_out, start};
use metachron_import::{ImportError, Imported, mjcf};
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
fn moments_beyond_all_numbers_are_refused_and_large_and_small_ones_stay() {
    let text = |moment: &str| {
        format!(
            "<mujoco><worldbody><body name=\"a\"><freejoint/>
            <inertial mass=\"1\" diaginertia=\"{moment} {moment} {moment}\"/></body></worldbody></mujoco>"
        )
    };
    let error = import(&text("1e308")).unwrap_err().to_string();
    let expected = "line 1: body `a`: has moments of inertia that no body can have; expected some with a finite sum";
    assert_eq!(error, expected);
    for moment in ["1e200", "1e-120"] {
        assert_eq!(left_out(&import(&text(moment)).unwrap()), [""; 0]);
    }
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
    // it would fall by more than a metre; what steps leave of a weld is microns
    assert!(state.position.distance(glam::DVec3::X) < 1e-4, "{}", state.position);
    assert_eq!(
        left_out(&import(&text("arm")).unwrap()),
        ["line 3: equality, weld: is left out: both of its ends are on one body"]
    );
}
