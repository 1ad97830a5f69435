//! Every built-in scene, 60 frames in lockstep: the bits of its last state and its whole report stay as they were recorded.
//!
//! The file says nothing about whether they are right; other tests do. It lets structure and names change safely: a
//! commit that only moves or renames leaves `tests/reference/golden.json` as it is, and one that changes it says old,
//! new and why. `METACHRON_RECORD=1 cargo test --test system golden` writes it anew.

use crate::play::{lockstep, metachron};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

const FRAMES: &str = "60";
/// Keys of a report whose values are measured, whatever the executor.
const MEASURED: [&str; 1] = ["cpu_s"];

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/golden.json")
}

/// The report without measured times.
fn declared(report: Value) -> Value {
    match report {
        Value::Object(map) => {
            let kept = map.into_iter().filter(|(key, _)| !MEASURED.contains(&key.as_str()));
            Value::Object(kept.map(|(key, value)| (key, declared(value))).collect())
        }
        Value::Array(list) => Value::Array(list.into_iter().map(declared).collect()),
        other => other,
    }
}

/// FNV-1a, 64 bits.
fn hash(text: &str) -> String {
    let fold = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", text.bytes().fold(0xcbf2_9ce4_8422_2325, fold))
}

fn entry(scene: &str) -> Value {
    let report = lockstep(scene, &["--frames", FRAMES]);
    let state = report["state_hash"].clone();
    json!({ "state": state, "report": hash(&declared(report).to_string()) })
}

/// The names of the built-in scenes, as the program lists them.
fn scenes() -> Vec<String> {
    let listed = metachron(&["list"]);
    let text = String::from_utf8(listed.stdout).unwrap();
    text.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

#[test]
fn golden_built_in_scenes_keep_their_bits_and_reports() {
    let scenes = scenes();
    assert_eq!(scenes.len(), 18, "{scenes:?}");
    let (left, right) = scenes.split_at(scenes.len() / 2);
    let play = |names: &[String]| names.iter().map(|name| (name.clone(), entry(name))).collect::<Vec<_>>();
    let (mut now, rest) = std::thread::scope(|threads| {
        let other = threads.spawn(|| play(right));
        (play(left), other.join().unwrap())
    });
    now.extend(rest);
    let now = Value::Object(now.into_iter().collect::<Map<_, _>>());
    if std::env::var_os("METACHRON_RECORD").is_some() {
        let text = serde_json::to_string_pretty(&now).unwrap() + "\n";
        std::fs::write(file(), text).unwrap();
        return;
    }
    let recorded: Value = serde_json::from_str(&std::fs::read_to_string(file()).unwrap()).unwrap();
    assert_eq!(now, recorded, "left: this build; right: tests/reference/golden.json");
}

#[test]
fn golden_reports_lose_only_what_was_measured() {
    let report = json!({ "cpu_s": 1.5, "agents": [{ "steps": 3, "cpu_s": 2.0 }] });
    assert_eq!(declared(report), json!({ "agents": [{ "steps": 3 }] }));
}
