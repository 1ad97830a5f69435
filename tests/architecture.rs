//! The map of the code is tested: `docs/ARCHITECTURE.md`, the module docs, the dependency arrows and the citation keys.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const SOURCE_ROOTS: [&str; 3] = ["agents/src", "budget/src", "src"];

/// Who may know whom: text that starts a path to the room on the right must not stand in the room on the left.
const FORBIDDEN: [(&str, &[&str]); 9] = [
    ("agents/src", &["metachron_budget", "metachron::", "std::time", "std::thread", "std::fs", "wgpu", "egui"]),
    ("budget/src", &["metachron_agents", "metachron::", "std::", "rapier3d", "glam"]),
    ("src/scene", &["crate::runtime", "crate::control", "crate::compositor", "crate::cli", "crate::frame"]),
    ("src/runtime", &["crate::scene", "crate::control", "crate::compositor", "crate::cli", "crate::frame", "wgpu"]),
    ("src/control", &["crate::scene", "crate::runtime", "crate::compositor", "crate::cli", "crate::frame", "wgpu"]),
    ("src/tune", &["crate::scene", "crate::runtime", "crate::compositor", "crate::cli", "crate::frame", "wgpu"]),
    (
        "src/fit",
        &["crate::scene", "crate::runtime", "crate::control", "crate::compositor", "crate::cli", "crate::frame"],
    ),
    ("src/compositor", &["crate::scene", "crate::runtime", "crate::control", "crate::cli", "crate::frame"]),
    ("src/frame", &["crate::cli"]),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn files_below(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = fs::read_dir(folder) else { return found };
    for path in entries.map(|e| e.unwrap().path()) {
        if path.is_dir() {
            found.extend(files_below(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn relative(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/")
}

fn sources() -> Vec<(String, String)> {
    SOURCE_ROOTS
        .iter()
        .flat_map(|r| files_below(&root().join(r), "rs"))
        .map(|path| (relative(&path), fs::read_to_string(&path).unwrap()))
        .collect()
}

/// The first cell of every table row that is a path in backquotes.
fn rows_of_the_map() -> BTreeSet<String> {
    let map = fs::read_to_string(root().join("docs/ARCHITECTURE.md")).unwrap();
    map.lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(path, _)| path.to_owned())
        .filter(|path| path.ends_with(".rs"))
        .collect()
}

#[test]
fn every_source_file_has_its_row_in_the_map_and_every_row_its_file() {
    let rows = rows_of_the_map();
    let files: BTreeSet<String> = sources().into_iter().map(|(path, _)| path).collect();
    let missing: Vec<_> = files.difference(&rows).collect();
    let gone: Vec<_> = rows.difference(&files).collect();
    assert!(missing.is_empty(), "without a row in docs/ARCHITECTURE.md: {missing:#?}");
    assert!(gone.is_empty(), "rows in docs/ARCHITECTURE.md without a file: {gone:#?}");
}

#[test]
fn every_source_file_opens_by_saying_what_it_is() {
    let silent: Vec<_> = sources().into_iter().filter(|(_, text)| !text.starts_with("//! ")).map(|(p, _)| p).collect();
    assert!(silent.is_empty(), "no module doc on the first line: {silent:#?}");
}

#[test]
fn no_room_knows_a_room_it_must_not() {
    let mut broken = Vec::new();
    for (path, text) in sources() {
        for (room, strangers) in FORBIDDEN {
            // tests read reference files; what they stand beside must not
            let is_test = path.contains("/tests/") || path.ends_with("tests.rs");
            if is_test || (path != format!("{room}.rs") && !path.starts_with(&format!("{room}/"))) {
                continue;
            }
            for (number, line) in text.lines().enumerate().filter(|(_, l)| !l.trim_start().starts_with("//")) {
                for stranger in strangers.iter().filter(|s| line.contains(*s)) {
                    broken.push(format!("{path}:{}: {room} must not know {stranger}", number + 1));
                }
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn unsafe_code_and_silenced_lints_stay_out() {
    let mut found = Vec::new();
    for (path, text) in sources() {
        for (number, line) in text.lines().enumerate() {
            let code = line.trim_start();
            if code.starts_with("#[allow") || code.starts_with("#![allow") || code.contains("unsafe {") {
                found.push(format!("{path}:{}: {code}", number + 1));
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
    for manifest in ["Cargo.toml", "agents/Cargo.toml", "budget/Cargo.toml"] {
        let text = fs::read_to_string(root().join(manifest)).unwrap();
        assert!(text.contains("[lints]\nworkspace = true"), "{manifest} must take the workspace's lints");
    }
}

/// Keys cited as `(KEY99)`, `(KEY99, eq. 1)`: two to six capitals and two digits.
fn cited_keys(text: &str) -> BTreeSet<String> {
    text.match_indices('(')
        .filter_map(|(at, _)| {
            let rest = &text[at + 1..];
            let capitals = rest.bytes().take_while(u8::is_ascii_uppercase).count();
            let digits = rest.bytes().skip(capitals).take_while(u8::is_ascii_digit).count();
            let end = capitals + digits;
            let closes = matches!(rest.as_bytes().get(end), Some(b',' | b')' | b';'));
            ((2..=6).contains(&capitals) && digits == 2 && closes).then(|| rest[..end].to_owned())
        })
        .collect()
}

#[test]
fn every_cited_key_is_in_the_references() {
    let references = fs::read_to_string(root().join("docs/references.md")).unwrap();
    let mut texts: Vec<_> = sources();
    texts.extend(
        files_below(&root().join("docs"), "md").into_iter().map(|p| (relative(&p), fs::read_to_string(&p).unwrap())),
    );
    let mut missing = Vec::new();
    for (path, text) in texts {
        for key in cited_keys(&text) {
            if !references.contains(&format!("**{key}**")) {
                missing.push(format!("{path}: ({key})"));
            }
        }
    }
    assert!(missing.is_empty(), "cited but not in docs/references.md: {missing:#?}");
}

#[test]
fn citation_keys_are_found_where_they_stand() {
    let keys = cited_keys("after (MMC16, eq. 18), as (GDC04) says; not (eq. 4), not (A1), not f(X12 + 1)");
    assert_eq!(keys.into_iter().collect::<Vec<_>>(), ["GDC04", "MMC16"]);
}
