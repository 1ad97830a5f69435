//! The JSON Schema of scene files, from the types that read them.
//!
//! In: nothing. Out: one schema (draft 2020-12). Never here: rules between keys, not all of which a schema can express.

use super::build::AGENTS_MAX;
use super::format::ranges::say_everywhere;
use super::format::{
    CommonFile, MODELS, MeshFile, OLD_NAMES, RigidFile, RopeFile, SceneFile, SheetFile, SoftFile, SolidFile,
    SolidShapeFile, SyntheticFile, ToolFile, TreeFile, TubeFile,
};
use metachron_models::synthetic::SyntheticSpec;
use schemars::{JsonSchema, SchemaGenerator};
use serde_json::{Map, Value, json};

/// The JSON Schema of a scene file.
#[must_use]
pub fn json_schema() -> Value {
    let mut generator = SchemaGenerator::default();
    let objects = [
        object::<(), TubeFile>(&mut generator),
        object::<SolidShapeFile, RigidFile>(&mut generator),
        object::<SoftFile, SheetFile>(&mut generator),
        object::<SoftFile, SolidFile>(&mut generator),
        object::<SoftFile, RopeFile>(&mut generator),
        object::<(), ToolFile>(&mut generator),
        object::<SyntheticSpec, SyntheticFile>(&mut generator),
        object::<(), MeshFile>(&mut generator),
        object::<(), TreeFile>(&mut generator),
    ];
    let mut root = generator.root_schema_for::<SceneFile>().to_value();
    // made above; the root generator drops definitions that it does not use itself
    let definitions = generator.take_definitions(true);
    root["title"] = json!("metachron scene");
    let properties = &mut root["properties"];
    properties["object"] = json!({
        "description": format!("The objects; at most {AGENTS_MAX} that move."),
        "type": "array",
        "items": { "oneOf": MODELS.map(|m| json!({ "$ref": format!("#/$defs/{m}") })) },
    });
    for (name, definition) in definitions {
        root["$defs"][name] = definition;
    }
    for (name, object) in MODELS.into_iter().zip(objects) {
        root["$defs"][name] = with_model(object, name);
    }
    say_everywhere(&mut root);
    drop_null(&mut root);
    root
}

/// Removes `null` from every choice: an optional field is left out in TOML, which has no null.
fn drop_null(schema: &mut Value) {
    let is_null = |v: &Value| *v == json!("null") || *v == json!({ "type": "null" });
    if let Value::Object(table) = schema {
        if let Some(Value::Array(kinds)) = table.get_mut("type") {
            kinds.retain(|kind| !is_null(kind));
            if let [kind] = kinds.as_slice() {
                table["type"] = kind.clone();
            }
        }
        if let Some(Value::Array(choices)) = table.get_mut("anyOf") {
            choices.retain(|choice| !is_null(choice));
            if let [Value::Object(only)] = choices.as_slice() {
                let only = only.clone();
                table.remove("anyOf");
                table.extend(only);
            }
        }
        table.values_mut().for_each(drop_null);
    } else if let Value::Array(list) = schema {
        list.iter_mut().for_each(drop_null);
    }
}

/// A model's table, which is read as two types, with the keys that all models share.
fn object<S: JsonSchema, T: JsonSchema>(generator: &mut SchemaGenerator) -> Value {
    let mut parts = [CommonFile::json_schema(generator), S::json_schema(generator), T::json_schema(generator)];
    let (mut properties, mut required) = (Map::new(), Vec::new());
    for part in &mut parts {
        properties.extend(part.remove("properties").as_ref().and_then(Value::as_object).cloned().unwrap_or_default());
        required.extend(part.remove("required").as_ref().and_then(Value::as_array).cloned().unwrap_or_default());
    }
    let [.., own] = parts;
    let mut own = own.to_value();
    (own["properties"], own["required"]) = (Value::Object(properties), Value::Array(required));
    own
}

fn with_model(mut object: Value, model: &str) -> Value {
    let old_names = OLD_NAMES.iter().filter(|(_, now)| *now == model).map(|(old, _)| *old);
    let names: Vec<_> = std::iter::once(model).chain(old_names).collect();
    object["properties"]["model"] =
        if let [only] = names[..] { json!({ "const": only }) } else { json!({ "enum": names }) };
    if let Some(required) = object["required"].as_array_mut() {
        required.push(json!("model"));
    }
    object
}
