//! Schemas of the messages in MCAP files, in the words of JSON Schema: those of Foxglove, and ours beside them.
//!
//! Out: schemas. Never here: messages.

use serde_json::{Value, json};

/// The levels of a log of Foxglove.
pub(super) const INFO: u8 = 2;
pub(super) const WARNING: u8 = 3;
pub(super) const ERROR: u8 = 4;

fn object_of(properties: &Value) -> Value {
    json!({ "type": "object", "properties": properties })
}

fn time() -> Value {
    object_of(&json!({ "sec": { "type": "integer" }, "nsec": { "type": "integer" } }))
}

fn vector() -> Value {
    object_of(&json!({ "x": { "type": "number" }, "y": { "type": "number" }, "z": { "type": "number" } }))
}

fn rotation() -> Value {
    let number = json!({ "type": "number" });
    object_of(&json!({ "x": number, "y": number, "z": number, "w": number }))
}

pub(super) fn transform() -> Value {
    object_of(&json!({
        "timestamp": time(),
        "parent_frame_id": { "type": "string" },
        "child_frame_id": { "type": "string" },
        "translation": vector(),
        "rotation": rotation(),
    }))
}

pub(super) fn state() -> Value {
    object_of(&json!({
        "name": { "type": "string" },
        "time": { "type": "number", "description": "the object's own time, seconds" },
        "snapshot": { "type": "object", "description": "its published state; metres, kilograms, seconds, newtons, joules" },
    }))
}

/// Foxglove's schema of scenes; lists that stay empty are declared as lists of anything.
pub(super) fn scene() -> Value {
    let any = list(json!({}));
    let number = json!({ "type": "number" });
    let colour = object_of(&json!({ "r": number, "g": number, "b": number, "a": number }));
    let triangles = object_of(&json!({
        "pose": object_of(&json!({ "position": vector(), "orientation": rotation() })),
        "points": list(vector()),
        "color": colour,
        "colors": list(colour.clone()),
        "indices": list(json!({ "type": "integer" })),
    }));
    let entity = object_of(&json!({
        "timestamp": time(),
        "frame_id": { "type": "string" },
        "id": { "type": "string" },
        "lifetime": time(),
        "frame_locked": { "type": "boolean" },
        "metadata": any, "arrows": any, "cubes": any, "spheres": any, "cylinders": any, "lines": any,
        "triangles": list(triangles),
        "texts": any, "models": any,
    }));
    let deletion = object_of(&json!({
        "timestamp": time(),
        "type": { "type": "integer" },
        "id": { "type": "string" },
    }));
    object_of(&json!({ "deletions": list(deletion), "entities": list(entity) }))
}

fn list(items: Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn text() -> Value {
    json!({ "type": "string" })
}

/// A number; its unit and meaning.
fn number(description: &str) -> Value {
    json!({ "type": "number", "description": description })
}

pub(super) fn contacts() -> Value {
    let described = |mut schema: Value, description: &str| {
        schema["description"] = json!(description);
        schema
    };
    let contact = object_of(&json!({
        "object": described(text(), "the object on which the force acts"),
        "with": described(text(), "the object or static solid that it touches"),
        "point": described(vector(), "the place that bears most, metres; null where that is not known"),
        "normal": described(vector(), "the normal there, towards the object, of length 1"),
        "force": described(vector(), "the force on the object, world axes, newtons: the mean of its last step"),
        "depth": number("the deepest overlap, metres"),
    }));
    object_of(&json!({ "timestamp": time(), "contacts": list(contact) }))
}

pub(super) fn joint_states() -> Value {
    let joint = object_of(&json!({
        "name": text(),
        "position": number("rad or m"),
        "velocity": number("rad/s or m/s"),
        "effort": number("N·m or N, of its motor and stops"),
    }));
    object_of(&json!({ "timestamp": time(), "joints": list(joint) }))
}

pub(super) fn log() -> Value {
    let integer = json!({ "type": "integer" });
    object_of(&json!({
        "timestamp": time(), "level": integer, "message": text(), "name": text(), "file": text(), "line": integer,
        "event": text(), "with": text(),
    }))
}
