//! Turns a tube's table into that of a rope with the same course, weight, stiffness and look.
//!
//! In: the table, the rope. Out: the table with other keys. Never here: whether a rope would do.

use super::write_back::{rounded, set};
use metachron_models::soft::{Side, SoftShape};
use metachron_world::{Member, Spec};
use toml_edit::{Array, Table, Value};

/// Keys that only tubes have.
const TUBE_KEYS: [&str; 20] = [
    "straight",
    "twist_deg",
    "wall_m",
    "poisson",
    "shear_factor",
    "ea_n",
    "ga_n",
    "ei_n_m2",
    "gj_n_m2",
    "mass_per_length_kg_m",
    "eps_m",
    "picture_eps_m",
    "integrator",
    "substeps",
    "clamp",
    "pin",
    "attach",
    "peristalsis",
    "pressure_pa",
    "self_contact",
];
/// The look of a tube whose table does not name one.
const MATERIAL: &str = "tissue";

/// Turns the table of a tube into that of the rope `member`; returns the number of changed keys.
pub(super) fn put(table: &mut Table, member: &Member) -> usize {
    let Spec::Soft(spec) = &member.spec else { return 0 };
    let SoftShape::Rope { path_m, segments, .. } = &spec.shape else { return 0 };
    let mut changes = TUBE_KEYS.iter().filter(|key| table.remove(key).is_some()).count();
    changes += set(table, "model", "rope".into());
    let course = table.get("path_m").and_then(|path| path.as_array()).map_or(0, Array::len);
    if course > 2 {
        // a tube runs smoothly through its points, a rope straight from one to the next
        let point = |at: &glam::DVec3| Value::from_iter(at.to_array().map(nanometres));
        changes += set(table, "path_m", path_m.iter().map(point).collect::<Array>().into());
    }
    changes += set(table, "segments", i64::from(*segments).into());
    changes += set(table, "young_pa", rounded(spec.material.young_pa).into());
    changes += set(table, "density_kg_m3", rounded(spec.material.density_kg_m3).into());
    changes += set(table, "friction", spec.friction.into());
    if !spec.held.is_empty() {
        let end = |side: &Side| if *side == Side::Left { "start" } else { "end" };
        changes += set(table, "hold", spec.held.iter().map(end).collect::<Array>().into());
    }
    if !table.contains_key("material") {
        changes += set(table, "material", MATERIAL.into());
    }
    changes
}

/// A coordinate rounded to the nanometre.
fn nanometres(metres: f64) -> f64 {
    format!("{metres:.9}").parse().unwrap_or(metres)
}
