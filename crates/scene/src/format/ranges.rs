//! The ranges of keys, beside the tables that have them: reading checks values against them, and the JSON Schema says them.
//!
//! In: [`Ranges`] by key. Out: a transform of a table's schema. Never here: ranges that depend on other keys.

use metachron_core::{NumberRange, Ranges};
use schemars::Schema;
use serde_json::{Value, json};

/// Sizes of solids, rigid or soft.
pub use metachron_models::soft::LENGTH;

/// Scales of meshes: metres per unit of the file.
pub const SCALE: NumberRange = NumberRange::new(1e-6, 1e6, "");
/// Coulomb friction coefficients of surfaces.
pub const FRICTION: NumberRange = NumberRange::new(0.0, 10.0, "");
/// Densities of tubes and rigid objects.
pub const DENSITY: NumberRange = NumberRange::new(1e-3, 1e6, "kg/m³");
/// Stiffness of springs of couplings and joints.
pub const STIFFNESS: NumberRange = NumberRange::new(1e-6, 1e9, "N/m");
/// Damping of the same springs.
pub const DAMPING: NumberRange = NumberRange::new(0.0, 1e7, "N·s/m");
/// Mass-proportional damping of deformable objects.
pub const DAMPING_RATE: NumberRange = NumberRange::new(0.0, 1e4, "1/s");
/// Forces above which couplings and joints yield and tear.
pub const TEARING: NumberRange = NumberRange::new(1e-6, 1e9, "N");
/// Lengths of springs at rest.
pub const REST: NumberRange = NumberRange::new(0.0, 1e4, "m");
/// Times of keyframes and loads.
pub const TIME: NumberRange = NumberRange::new(0.0, 1e6, "s");
/// Triangles of generated surfaces that are touched.
pub const TRIANGLES: NumberRange = NumberRange::new(4.0, 1e5, "");
/// Fractions and shares.
pub const SHARE: NumberRange = NumberRange::new(0.0, 1.0, "");

/// Says the ranges in the schema of a table: as `minimum` and `maximum`, and at the end of the first clause of a description.
pub fn within(list: Ranges) -> impl Fn(&mut Schema) {
    move |schema| {
        let Some(Value::Object(keys)) = schema.get_mut("properties") else { return };
        for (key, range) in list.0 {
            if let Some(key) = keys.get_mut(*key) {
                describe(key, *range);
            }
        }
    }
}

fn describe(key: &mut Value, range: NumberRange) {
    bound(key, range);
    let Some(Value::String(text)) = key.get_mut("description") else { return };
    let marks = [". ", ": ", "; "].into_iter().filter_map(|mark| text.find(mark));
    let end = marks.min().unwrap_or(text.trim_end_matches('.').len());
    text.insert_str(end, &format!(", {} … {}", short(range.least), short(range.greatest)));
}

/// Bounds a number, or the numbers of a list.
fn bound(key: &mut Value, NumberRange { least, greatest, .. }: NumberRange) {
    let kind = key["type"].to_string();
    if kind.contains("array") {
        bound(&mut key["items"], NumberRange::new(least, greatest, ""));
    } else if kind.contains("integer") {
        (key["minimum"], key["maximum"]) = (json!(least as i64), json!(greatest as i64));
    } else if kind.contains("number") {
        (key["minimum"], key["maximum"]) = (json!(least), json!(greatest));
    }
}

/// A number in full from 0.001 to 9999, otherwise as briefly as it can be written.
fn short(value: f64) -> String {
    let [plain, power] = [value.to_string(), format!("{value:e}")];
    if (1e-3..1e4).contains(&value.abs()) || plain.len() <= power.len() { plain } else { power }
}
