//! The ranges of keys, each said once: reading checks values against them, and the JSON Schema says them.
//!
//! In: the ranges of specifications, and those of keys that mean the same in every table. Out: a transform of a table's schema.
//! Never here: ranges that depend on other keys.

use metachron_contact::detect::{DEPTH_RANGE_M, LEAST_STEPS_RANGE};
use metachron_core::{N_MAX, NumberRange, Ranges, gains};
use metachron_geometry::FRICTION;
use metachron_models::soft::{LENGTH, SEGMENTS};
use metachron_world::RENDER_SCALE;
use schemars::Schema;
use serde_json::{Value, json};

/// Largest coordinate of a place, metres.
pub const POSITION_MAX_M: f64 = 1e5;

/// A number within `most` of zero.
const fn around(most: f64, unit: &'static str) -> NumberRange {
    NumberRange::new(-most, most, unit)
}

const POSITION: NumberRange = around(POSITION_MAX_M, "m");
const FAR: NumberRange = around(1e4, "m");
const SPEED: NumberRange = around(1e4, "");
const STIFFNESS: NumberRange = NumberRange::new(1e-6, 1e9, "N/m");
const DAMPING: NumberRange = NumberRange::new(0.0, 1e7, "N·s/m");
const EFFORT: NumberRange = NumberRange::new(1e-9, 1e9, "N·m or N");
const RESISTS: NumberRange = NumberRange::new(0.0, 1e9, "");
const FORCE: NumberRange = NumberRange::new(1e-6, 1e9, "N");
/// Fractions and shares.
pub const SHARE: NumberRange = NumberRange::new(0.0, 1.0, "");
const PER_PIECE: NumberRange = NumberRange::new(0.0, 1e6, "ns");
const COST: NumberRange = NumberRange::new(0.0, 1e6, "µs");
const PIECES: NumberRange = NumberRange::new(1.0, 1e5, "");

/// The ranges of keys, whatever table they stand in.
const KEYS: Ranges = Ranges(&[
    // places and motions
    ("position_m", POSITION),
    ("rotation_deg", around(1e6, "degrees")),
    ("velocity_m_s", SPEED),
    ("spin_rad_s", SPEED),
    ("path_m", POSITION),
    ("tip_m", POSITION),
    ("pivot_m", POSITION),
    ("eye_m", POSITION),
    ("look_at_m", POSITION),
    ("from_m", POSITION),
    ("to_m", POSITION),
    ("corners_m", POSITION),
    ("swing_m", POSITION),
    ("at_m", POSITION),
    ("at_a_m", POSITION),
    ("at_b_m", POSITION),
    ("centre_of_mass_m", POSITION),
    ("axis", around(1e6, "")),
    ("at_s", NumberRange::new(0.0, 1e6, "s")),
    ("gravity_m_s2", around(1e4, "m/s²")),
    ("gravity_scale", around(1000.0, "")),
    // sizes
    ("radius_m", LENGTH),
    ("half_extents_m", LENGTH),
    ("half_height_m", LENGTH),
    ("size_m", LENGTH),
    ("thickness_m", LENGTH),
    ("eps_m", LENGTH),
    ("eps_touched_m", LENGTH),
    ("segments", SEGMENTS),
    ("length_m", LENGTH),
    ("rest_m", NumberRange::new(0.0, 1e4, "m")),
    ("scale", NumberRange::new(1e-6, 1e6, "")),
    ("hull_within_m", NumberRange::new(0.0, 0.1, "m")),
    ("walls_m", NumberRange::new(1e-3, 100.0, "m")),
    ("texture_m", NumberRange::new(1e-3, 1e3, "m")),
    ("dome_m", NumberRange::new(1e-3, 1e4, "m")),
    ("height_m", NumberRange::new(0.01, 1e3, "m")),
    ("spin_radius_m", NumberRange::new(0.0, 10.0, "m")),
    // matter
    ("density_kg_m3", NumberRange::new(1e-3, 1e6, "kg/m³")),
    ("friction", FRICTION),
    ("damping_per_s", NumberRange::new(0.0, 1e4, "1/s")),
    ("exponent", around(20.0, "")),
    // attachments, joints and motors
    ("stiffness_n_m", STIFFNESS),
    ("damping_n_s_m", DAMPING),
    ("tears_above_n", FORCE),
    ("yields_above_n", FORCE),
    ("range_m", FAR),
    ("range_deg", around(180.0, "degrees")),
    ("position_deg", around(180.0, "degrees")),
    ("velocity_rad_s", SPEED),
    ("max_torque_n_m", EFFORT),
    ("max_force_n", EFFORT),
    ("friction_n_m", RESISTS),
    ("friction_n", RESISTS),
    ("armature_kg_m2", RESISTS),
    ("armature_kg", RESISTS),
    ("ratio", around(1e6, "")),
    ("stiffness_n_m_rad", STIFFNESS),
    ("damping_n_m_s_rad", DAMPING),
    // springs along a tube, and its peristalsis
    ("from", SHARE),
    ("to", SHARE),
    ("stiffness_n_m2", NumberRange::new(0.0, 1e9, "N/m²")),
    ("slack_m", NumberRange::new(0.0, 100.0, "m")),
    ("damping_n_s_m2", NumberRange::new(0.0, 1e6, "N·s/m²")),
    ("amplitude", NumberRange::new(0.0, 0.95, "")),
    ("wavelength_m", NumberRange::new(1e-4, 100.0, "m")),
    ("speed_m_s", around(100.0, "m/s")),
    // tools
    ("jaw", SHARE),
    // declared agents
    ("cost_us", COST),
    ("cost_order", NumberRange::new(0.0, 4.0, "")),
    ("error_m", NumberRange::new(0.0, 1e3, "m")),
    ("error_order", NumberRange::new(0.0, 8.0, "")),
    // all objects, and copies of them
    ("rate_hz", NumberRange::new(1.0, 1e5, "Hz")),
    ("dt_ms", NumberRange::new(0.01, 1000.0, "ms")),
    ("tolerance_m", NumberRange::new(1e-9, 1e3, "m")),
    ("n", NumberRange::new(0.0, N_MAX as f64, "")),
    ("importance", NumberRange::new(1e-3, 1e3, "")),
    ("jitter", NumberRange::new(0.0, 0.5, "")),
    ("loss", NumberRange::new(0.0, 0.9, "")),
    ("spacing_m", FAR),
    ("rise_m", FAR),
    ("scatter_m", NumberRange::new(0.0, 1e4, "m")),
    ("scatter_deg", NumberRange::new(0.0, 180.0, "degrees")),
    // pictures
    ("triangles", NumberRange::new(4.0, 1e5, "")),
    ("least_triangles", NumberRange::new(1.0, 1e6, "")),
    ("swing_hz", NumberRange::new(1e-4, 100.0, "Hz")),
    ("branches", PIECES),
    ("leaves", PIECES),
    ("leaves_importance", NumberRange::new(1e-3, 1.0, "")),
    ("levels", PIECES),
    ("fov_deg", NumberRange::new(1.0, 150.0, "degrees")),
    // the scene
    ("stall_s", NumberRange::new(1e-3, 3600.0, "s")),
    ("contact_depth_m", NumberRange::new(*DEPTH_RANGE_M.start(), *DEPTH_RANGE_M.end(), "m")),
    ("contact_least_steps", NumberRange::new(*LEAST_STEPS_RANGE.start() as f64, *LEAST_STEPS_RANGE.end() as f64, "")),
    ("at", SHARE),
    ("at_a", around(POSITION_MAX_M, "m")),
    ("at_b", around(POSITION_MAX_M, "m")),
    ("every_ms", NumberRange::new(0.01, 1e6, "ms")),
    ("frame_hz", NumberRange::new(1.0, 1000.0, "Hz")),
    ("alpha", gains::ALPHA),
    ("beta", gains::BETA),
    ("kappa", gains::KAPPA),
    ("lead", gains::LEAD),
    ("margin", gains::MARGIN),
    ("agent_refine", gains::REFINE),
    ("agent_yield", gains::YIELD),
    ("lag_ms", NumberRange::new(1.0, 1000.0, "ms")),
    ("optimiser_share", NumberRange::new(1e-3, 0.5, "")),
    ("focus", SHARE),
    ("motion", SHARE),
    ("hysteresis", SHARE),
    ("render_scale", NumberRange::new(RENDER_SCALE.0, RENDER_SCALE.1, "")),
    // the declared machine
    ("cores", NumberRange::new(1.0, 4096.0, "")),
    ("draw_setup_ms", NumberRange::new(0.0, 1e4, "ms")),
    ("draw_object_us", COST),
    ("draw_triangle_us", NumberRange::new(0.0, 1e4, "µs")),
    ("draw_pixel_ns", PER_PIECE),
    ("draw_enlarge_ns", PER_PIECE),
    ("draw_serial", SHARE),
    ("cull_object_ns", PER_PIECE),
    ("choose_object_ns", PER_PIECE),
    ("noise", SHARE),
    ("wander", SHARE),
    ("spikes", SHARE),
    ("factor", NumberRange::new(0.01, 100.0, "")),
    ("object_us", COST),
    ("triangle_us", NumberRange::new(0.0, 1e4, "µs")),
    ("vertex_us", NumberRange::new(0.0, 1e4, "µs")),
    ("pixel_ns", PER_PIECE),
    ("base_us", NumberRange::new(0.0, 1e9, "µs")),
    ("unit_us", NumberRange::new(0.0, 1e9, "µs")),
]);

/// Says the ranges of a specification in the schema of its table.
pub fn within(own: Ranges) -> impl Fn(&mut Schema) {
    move |schema| say(own, schema.get_mut("properties"))
}

/// Says the ranges that keys have in every table in a schema and all schemas in it, but for keys that have one.
pub fn say_everywhere(schema: &mut Value) {
    match schema {
        Value::Object(table) => {
            say(KEYS, table.get_mut("properties"));
            table.values_mut().for_each(say_everywhere);
        }
        Value::Array(list) => list.iter_mut().for_each(say_everywhere),
        _ => {}
    }
}

/// Says ranges as `minimum`, `maximum` and `x-unit` of keys, and at the end of the first clause of their descriptions.
fn say(ranges: Ranges, keys: Option<&mut Value>) {
    for (name, key) in keys.and_then(Value::as_object_mut).into_iter().flatten() {
        if let Some(range) = ranges.get(name).filter(|range| bound(key, *range)) {
            describe(key, range);
        }
    }
}

fn describe(key: &mut Value, range: NumberRange) {
    let Some(Value::String(text)) = key.get_mut("description") else { return };
    let marks = [". ", ": ", "; "].into_iter().filter_map(|mark| text.find(mark));
    let end = marks.min().unwrap_or(text.trim_end_matches('.').len());
    text.insert_str(end, &format!(", {} … {}", short(range.least), short(range.greatest)));
}

/// Bounds a number, or the numbers of a list, or of each form that a value may have; `false` where there is none, or it has a range.
fn bound(key: &mut Value, range: NumberRange) -> bool {
    if key.get("x-unit").is_some() {
        return false;
    }
    if let Some(Value::Array(forms)) = key.get_mut("anyOf") {
        return forms.iter_mut().fold(false, |any, form| bound(form, range) | any);
    }
    let kind = key["type"].to_string();
    if kind.contains("array") {
        return key.get_mut("items").is_some_and(|items| bound(items, range));
    }
    (key["minimum"], key["maximum"]) = match kind {
        kind if kind.contains("integer") => (json!(range.least as i64), json!(range.greatest as i64)),
        kind if kind.contains("number") => (json!(range.least), json!(range.greatest)),
        _ => return false,
    };
    key["x-unit"] = json!(range.unit);
    true
}

/// A number in full from 0.001 to 9999, otherwise as briefly as it can be written.
fn short(value: f64) -> String {
    let [plain, power] = [value.to_string(), format!("{value:e}")];
    if (1e-3..1e4).contains(&value.abs()) || plain.len() <= power.len() { plain } else { power }
}
