//! Reads the keys of a joint: which belong to its kind, and the motion that they leave free.

use super::motor::{HINGE, SLIDE};

use crate::check::{Checker, Place};
use crate::format::{JOINT, JointFile, JointKind as Kind};
use glam::DVec3;
use metachron_models::rigid::Motor;

/// Longest spring or rope, metres.
const LENGTH_MAX_M: f64 = 1e4;
/// An axis shorter than this has no direction.
const AXIS_MIN: f64 = 1e-9;
/// Largest coordinate of an axis.
const AXIS_MAX: f64 = 1e6;

/// The motion that a joint leaves free, as its keys say; axes are unit vectors in the axes of `a`.
#[derive(Debug, Clone, Copy)]
pub(super) enum FreeMotion {
    Fixed,
    Revolute { axis: DVec3, range_rad: Option<[f64; 2]>, motor: Option<Motor> },
    Spherical,
    Prismatic { axis: DVec3, range_m: Option<[f64; 2]>, motor: Option<Motor> },
    Spring { stiffness_n_m: f64, damping_n_s_m: f64, rest_m: Option<f64> },
    Rope { length_m: Option<f64> },
}

/// The keys of each kind that not all kinds have: required ones, then optional ones.
const fn keys_of(kind: Kind) -> (&'static [&'static str], &'static [&'static str]) {
    match kind {
        Kind::Fixed | Kind::Spherical => (&[], &[]),
        Kind::Revolute => (&["axis"], &["range_deg", "motor"]),
        Kind::Prismatic => (&["axis"], &["range_m", "motor"]),
        Kind::Spring => (&["stiffness_n_m"], &["damping_n_s_m", "rest_m"]),
        Kind::Rope => (&[], &["length_m"]),
    }
}

/// Reads the motion that the joint leaves free.
pub(super) fn free_motion(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile) -> Option<FreeMotion> {
    if !check_keys(c, place, file) {
        return None;
    }
    Some(match file.kind {
        Kind::Fixed => FreeMotion::Fixed,
        Kind::Spherical => FreeMotion::Spherical,
        Kind::Revolute => {
            let range = range(c, place, "range_deg", file.range_deg, 180.0);
            let around_start = range.is_none_or(|[least, greatest]| least <= 0.0 && greatest >= 0.0);
            if !around_start {
                c.wrong(
                    place,
                    "range_deg",
                    "does not contain 0, the angle at the start",
                    "expected [least, greatest] with 0 between them",
                );
            }
            let range_rad = range.map(|r| r.map(f64::to_radians));
            let motor = HINGE.read(c, place, file.motor.as_ref(), range_rad);
            FreeMotion::Revolute { axis: axis(c, place, file)?, range_rad, motor }
        }
        Kind::Prismatic => {
            let range_m = range(c, place, "range_m", file.range_m, LENGTH_MAX_M);
            let motor = SLIDE.read(c, place, file.motor.as_ref(), range_m);
            FreeMotion::Prismatic { axis: axis(c, place, file)?, range_m, motor }
        }
        Kind::Spring => FreeMotion::Spring {
            stiffness_n_m: c.number(place, "stiffness_n_m", file.stiffness_n_m?, JOINT),
            damping_n_s_m: c.optional(place, "damping_n_s_m", file.damping_n_s_m, JOINT).unwrap_or(0.0),
            rest_m: file.rest_m.map(|rest| c.number(place, "rest_m", rest, JOINT)),
        },
        Kind::Rope => FreeMotion::Rope { length_m: file.length_m.map(|m| c.number(place, "length_m", m, JOINT)) },
    })
}

/// Reports keys that belong to another kind, and required keys that are missing; returns whether none is missing.
fn check_keys(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile) -> bool {
    let (needs, takes) = keys_of(file.kind);
    let name = file.kind.name();
    let list = needs.iter().chain(takes).map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
    let expected = if list.is_empty() {
        format!("a {name} joint has no keys of its own")
    } else {
        format!("a {name} joint has {list}")
    };
    let given = [
        ("axis", file.axis.is_some()),
        ("range_m", file.range_m.is_some()),
        ("range_deg", file.range_deg.is_some()),
        ("motor", file.motor.is_some()),
        ("stiffness_n_m", file.stiffness_n_m.is_some()),
        ("damping_n_s_m", file.damping_n_s_m.is_some()),
        ("rest_m", file.rest_m.is_some()),
        ("length_m", file.length_m.is_some()),
    ];
    let mut complete = true;
    for (key, is_given) in given {
        if is_given && !needs.contains(&key) && !takes.contains(&key) {
            c.wrong(place, key, format_args!("does not belong to a {name} joint"), expected.clone());
        }
        if !is_given && needs.contains(&key) {
            c.wrong(place, key, "is missing", format!("{expected}: expected `{key}` in this table"));
            complete = false;
        }
    }
    complete
}

fn axis(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile) -> Option<DVec3> {
    let before = c.count();
    let axis = c.point(place, "axis", file.axis?, AXIS_MAX);
    if c.count() == before && axis.length() < AXIS_MIN {
        c.wrong(place, "axis", "has no direction", "expected a vector longer than 0, such as [0, 0, 1]");
    }
    axis.try_normalize()
}

/// A range with both ends within ± `most`, in order.
fn range(c: &mut Checker<'_, '_>, place: &Place, key: &str, given: Option<[f64; 2]>, most: f64) -> Option<[f64; 2]> {
    let [least, greatest] = given?;
    let within = |end: f64| end.abs() <= most;
    if !(within(least) && within(greatest) && least <= greatest) {
        let expected = format!("expected [least, greatest], each up to {most} in magnitude");
        c.wrong(place, key, format_args!("is [{least}, {greatest}]"), expected);
        return None;
    }
    given
}
