//! Reads the keys of a joint: which belong to its kind, and the motion that they leave free.

use super::motor::{HINGE, SLIDE};

use crate::check::{Checker, Place};
use crate::format::{JointFile, JointKind as Kind};
use glam::DVec3;
use metachron_models::rigid::JointKind;

/// An axis shorter than this has no direction.
const AXIS_MIN: f64 = 1e-9;
/// The keys that not all kinds have.
const OWN: [&str; 13] = [
    "axis",
    "range_m",
    "range_deg",
    "motor",
    "friction_n_m",
    "friction_n",
    "armature_kg_m2",
    "armature_kg",
    "mimic",
    "stiffness_n_m",
    "damping_n_s_m",
    "rest_m",
    "length_m",
];

/// The keys of each kind that not all kinds have: required ones, then optional ones.
const fn keys_of(kind: Kind) -> (&'static [&'static str], &'static [&'static str]) {
    match kind {
        Kind::Fixed => (&[], &[]),
        Kind::Spherical => (&[], &["friction_n_m", "armature_kg_m2"]),
        Kind::Revolute => (&["axis"], &["range_deg", "motor", "friction_n_m", "armature_kg_m2", "mimic"]),
        Kind::Prismatic => (&["axis"], &["range_m", "motor", "friction_n", "armature_kg", "mimic"]),
        Kind::Spring => (&["stiffness_n_m"], &["damping_n_s_m", "rest_m"]),
        Kind::Rope => (&[], &["length_m"]),
    }
}

/// Reads the motion that the joint leaves free, its axis in the axes of `a`; `apart_m` is how far its anchors are apart at the start.
pub(super) fn free_motion(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile, apart_m: f64) -> Option<JointKind> {
    Some(match file.kind {
        Kind::Fixed => JointKind::Fixed,
        Kind::Spherical => JointKind::Spherical,
        Kind::Revolute => {
            let range = range(c, place, "range_deg", file.range_deg);
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
            JointKind::Revolute { axis: axis(c, place, file)?, range_rad, motor }
        }
        Kind::Prismatic => {
            let range_m = range(c, place, "range_m", file.range_m);
            let motor = SLIDE.read(c, place, file.motor.as_ref(), range_m);
            JointKind::Prismatic { axis: axis(c, place, file)?, range_m, motor }
        }
        Kind::Spring => JointKind::Spring {
            stiffness_n_m: file.stiffness_n_m?,
            damping_n_s_m: file.damping_n_s_m.unwrap_or(0.0),
            rest_m: file.rest_m.unwrap_or(apart_m),
        },
        Kind::Rope => JointKind::Rope { length_m: file.length_m.unwrap_or(apart_m) },
    })
}

/// Reports keys that belong to another kind, and required keys that are missing; returns whether none is missing.
pub(super) fn check_keys(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile) -> bool {
    let (needs, takes) = keys_of(file.kind);
    let name = c.written(place, "kind");
    let list = needs.iter().chain(takes).map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
    let expected = if list.is_empty() {
        format!("a {name} joint has no keys of its own")
    } else {
        format!("a {name} joint has {list}")
    };
    let foreign: Vec<_> = OWN.into_iter().filter(|key| !needs.contains(key) && !takes.contains(key)).collect();
    c.refuse(place, &foreign, format_args!("does not belong to a {name} joint"), &expected);
    let given = c.given(place, needs);
    for key in needs.iter().filter(|key| !given.contains(key)) {
        c.wrong(place, key, "is missing", format!("{expected}: expected `{key}` in this table"));
    }
    given.len() == needs.len()
}

/// Whether a joint of this kind has one travel, and can follow another or lead it.
const fn travels(kind: Kind) -> bool {
    matches!(kind, Kind::Revolute | Kind::Prismatic)
}

/// The number of the joint that a joint follows.
pub(super) fn followed(c: &mut Checker<'_, '_>, place: &Place, own: usize, files: &[JointFile]) -> Option<u32> {
    let mimic = files[own].mimic.as_ref().filter(|_| travels(files[own].kind))?;
    let place = place.table("mimic");
    let names = files.iter().filter_map(|file| file.name.as_deref());
    if !c.reference(&place, "joint", &mimic.joint, names) {
        return None;
    }
    let at = files.iter().position(|file| file.name.as_ref() == Some(&mimic.joint))?;
    let what = match &files[at] {
        _ if at == own => "is the joint itself",
        leads if !travels(leads.kind) => "is neither revolute nor prismatic",
        _ => return Some(at as u32),
    };
    c.wrong(&place, "joint", what, "expected another revolute or prismatic joint");
    None
}

fn axis(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile) -> Option<DVec3> {
    let axis = DVec3::from(file.axis?);
    if axis.length() < AXIS_MIN {
        c.wrong(place, "axis", "has no direction", "expected a vector longer than 0, such as [0, 0, 1]");
    }
    axis.try_normalize()
}

/// A range with its ends in order.
fn range(c: &mut Checker<'_, '_>, place: &Place, key: &str, given: Option<[f64; 2]>) -> Option<[f64; 2]> {
    let [least, greatest] = given?;
    if least > greatest {
        c.wrong(place, key, format_args!("is [{least}, {greatest}]"), "expected [least, greatest]");
        return None;
    }
    given
}
