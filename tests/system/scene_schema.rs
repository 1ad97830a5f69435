//! The schema of scenes for editors: it accepts the scenes that load.

use crate::scene::TUBE;
use metachron_core::NumberRange;
use metachron_geometry::RESTITUTION;
use metachron_models::{rigid, soft};
use metachron_scene::json_schema;

/// Whether `value` keeps the parts of JSON Schema that ours uses; says where it does not.
fn keeps(schema: &serde_json::Value, root: &serde_json::Value, value: &serde_json::Value) -> Result<(), String> {
    use serde_json::Value;
    if let Some(name) = schema.get("$ref").and_then(Value::as_str) {
        let found = root.pointer(name.trim_start_matches('#')).ok_or(format!("no {name}"))?;
        return keeps(found, root, value);
    }
    for choice in ["anyOf", "oneOf"] {
        if let Some(list) = schema.get(choice).and_then(Value::as_array) {
            let all: Vec<_> = list.iter().map(|s| keeps(s, root, value)).collect();
            let sound = all.iter().filter(|r| r.is_ok()).count();
            if sound == 0 || (choice == "oneOf" && sound > 1) {
                return Err(format!("{sound} of {choice} for {value}: {all:?}"));
            }
        }
    }
    if schema.get("const").is_some_and(|c| c != value) {
        return Err(format!("{value} is not {}", schema["const"]));
    }
    if schema.get("enum").and_then(Value::as_array).is_some_and(|e| !e.contains(value)) {
        return Err(format!("{value} is not one of {}", schema["enum"]));
    }
    let kinds: Vec<&str> = match schema.get("type") {
        Some(Value::String(kind)) => vec![kind],
        Some(Value::Array(kinds)) => kinds.iter().filter_map(Value::as_str).collect(),
        _ => vec![],
    };
    let is = |kind: &&str| match *kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64(),
        "number" => value.is_number(),
        _ => value.is_null(),
    };
    if !kinds.is_empty() && !kinds.iter().any(is) {
        return Err(format!("{value} is no {kinds:?}"));
    }
    if let Some(table) = value.as_object() {
        let properties = schema.get("properties").and_then(Value::as_object);
        for (key, inner) in table {
            match properties.and_then(|p| p.get(key)) {
                Some(schema) => keeps(schema, root, inner).map_err(|e| format!("{key}: {e}"))?,
                None if schema["additionalProperties"] == false => return Err(format!("unknown key {key}")),
                None => {}
            }
        }
        let required = schema.get("required").and_then(Value::as_array);
        if let Some(missing) = required.into_iter().flatten().find(|k| !table.contains_key(k.as_str().unwrap())) {
            return Err(format!("{missing} is missing"));
        }
    }
    if let (Some(items), Some(list)) = (schema.get("items"), value.as_array()) {
        list.iter().try_for_each(|item| keeps(items, root, item))?;
    }
    Ok(())
}

#[test]
fn the_schema_accepts_every_built_in_scene_and_refuses_what_the_program_refuses() {
    let schema = json_schema();
    for scene in &metachron::scenes::ALL {
        let value: serde_json::Value = toml::from_str(scene.text).unwrap();
        keeps(&schema, &schema, &value).unwrap_or_else(|e| panic!("{}: {e}", scene.name));
    }
    for bad in ["radus_m = 0.1", "model = \"blob\"", "n = \"x\""] {
        let key = bad.split(' ').next().unwrap();
        let lines = TUBE.lines().filter(|l| !l.starts_with(&format!("{key} "))).collect::<Vec<_>>().join("\n");
        let value: serde_json::Value = toml::from_str(&format!("{lines}\n{bad}\n")).unwrap();
        assert!(keeps(&schema, &schema, &value).is_err(), "{bad}");
    }
}

#[test]
fn the_schema_explains_every_key() {
    let schema = json_schema();
    let objects = schema["properties"]["object"]["description"].as_str().unwrap();
    assert!(objects.contains("at most 10000"), "{objects}");
    for model in metachron_scene::format::MODELS {
        for (key, inner) in schema["$defs"][model]["properties"].as_object().unwrap() {
            assert!(key == "model" || inner["description"].is_string(), "{model}.{key}");
        }
    }
}

#[test]
fn the_schema_bounds_a_number_by_the_range_of_the_models_specification() {
    let schema = json_schema();
    for model in ["sheet", "solid", "rope"] {
        let keys = &schema["$defs"][model]["properties"];
        for (name, range) in soft::MATERIAL.0.iter().filter(|(name, _)| keys.get(name).is_some()) {
            let bounds = [&keys[name]["minimum"], &keys[name]["maximum"]].map(serde_json::Value::as_f64);
            assert_eq!(bounds, [Some(range.least), Some(range.greatest)], "{model}.{name}");
        }
    }
    let poisson = schema["$defs"]["solid"]["properties"]["poisson"]["description"].as_str().unwrap();
    assert!(poisson.starts_with("Poisson's ratio, 0 … 0.499. Default 0.4."), "{poisson}");
}

/// The ranges in a line of text, as `0 ... 0.499`.
fn ranges_in(line: &str) -> Vec<(f64, f64)> {
    let words: Vec<&str> = line.split([' ', ';', ',', '"']).filter(|word| !word.is_empty()).collect();
    let around = words.windows(3).filter(|words| words[1] == "...");
    around.map(|words| (words[0].parse().unwrap(), words[2].trim_end_matches('.').parse().unwrap())).collect()
}

#[test]
fn the_documentation_of_pythons_parts_has_the_ranges_of_the_models() {
    let text = std::fs::read_to_string("python/package/metachron/parts.py").unwrap();
    let material = |name: &str| soft::MATERIAL.get(name).unwrap();
    let fields: [(&str, &str, &[NumberRange]); 6] = [
        ("_Placed", "restitution", &[RESTITUTION]),
        ("_Moving", "mass", &[rigid::MASS]),
        ("_Soft", "young", &[material("young_pa")]),
        ("_Soft", "poisson", &[material("poisson")]),
        ("_Soft", "density", &[material("density_kg_m3")]),
        ("_Soft", "damping", &[material("damping_per_s"), material("damping_s")]),
    ];
    for (class, field, ranges) in fields {
        let (_, body) = text.split_once(&format!("class {class}")).expect(class);
        let (_, after) = body.split_once(&format!("\n    {field}: ")).expect(field);
        let wanted: Vec<_> = ranges.iter().map(|range| (range.least, range.greatest)).collect();
        assert_eq!(ranges_in(after.lines().nth(1).unwrap()), wanted, "{class}.{field}");
    }
}
