//! The structure of the code is tested: module docs, arrows between crates, promises of absence, import cycles, citation keys.

mod imports;
mod names;

use imports::{CrateFiles, ring};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The crates, and the crates of this workspace that each may depend on.
const ARROWS: [(&str, &[&str]); 19] = [
    ("agents/core", &[]),
    ("agents/geometry", &["core"]),
    ("agents/contact", &["core", "geometry"]),
    ("agents/models", &["core", "geometry", "contact"]),
    ("crates/runtime", &["core", "geometry", "contact"]),
    ("crates/drawable", &["core", "geometry"]),
    ("crates/world", &["core", "geometry", "contact", "models", "runtime", "drawable"]),
    ("crates/scene", &["core", "geometry", "drawable", "contact", "models", "world"]),
    ("crates/devices", &["core", "geometry", "contact", "models", "runtime", "world"]),
    ("crates/export", &["core", "geometry", "runtime", "world"]),
    ("crates/bevy", &["core", "runtime", "world", "export"]),
    ("crates/hosts", &["core", "contact", "runtime", "world"]),
    ("crates/import", &["core", "geometry"]),
    ("crates/lod", &["core"]),
    ("crates/render", &["core", "geometry", "drawable"]),
    (
        "crates/session",
        &["core", "geometry", "drawable", "contact", "models", "runtime", "world", "devices", "scene", "lod", "render"],
    ),
    ("crates/viewer", &["core", "contact", "runtime", "world", "scene", "lod", "render", "session"]),
    ("crates/console", &["core", "runtime", "world", "scene", "lod"]),
    (
        "crates/lab",
        &[
            "core", "geometry", "drawable", "contact", "models", "runtime", "world", "scene", "lod", "render",
            "session", "console",
        ],
    ),
];

/// Text on the right must not stand in the code of the folder on the left.
const ABSENT: [(&str, &[&str]); 11] = [
    ("agents", &["std::time", "std::thread", "std::fs", "std::net", "wgpu", "egui"]),
    // who learns of the network is `crates/hosts` alone
    ("crates/world", &["zenoh", "std::net"]),
    ("crates/drawable", &["std::time", "std::thread", "std::fs", "wgpu", "egui"]),
    ("crates/runtime", &["std::fs::", "wgpu", "egui"]),
    ("crates/world", &["toml::", "std::fs", "std::thread", "wgpu", "egui"]),
    ("crates/scene", &["std::thread", "wgpu", "egui"]),
    ("crates/bevy", &["std::fs", "std::thread", "wgpu", "winit"]),
    ("crates/hosts", &["std::fs", "wgpu", "egui", "metachron_models"]),
    ("crates/import", &["std::fs", "std::thread", "wgpu", "egui"]),
    ("crates/render", &["egui", "winit", "std::thread"]),
    ("crates/session", &["egui", "std::thread::spawn"]),
];

/// Where a crate that otherwise knows no file has one: files that the program writes, and those of its own that it reads again.
const OWN_FILES: [&str; 4] = [
    // certificates and their keys
    "crates/hosts/src/identity.rs",
    "crates/world/src/history/checkpoint.rs",
    "crates/world/src/history/output_file.rs",
    "crates/world/src/history/recording.rs",
];

/// Modules of the numbers that need neither the standard library nor a type of the engine.
const NO_STD: [&str; 7] = ["adaptive", "cost", "grisoni", "hysteresis", "log_law", "select", "share"];

/// The files of the greatest ring in which files of a crate use each other: ceilings, which only fall.
const RINGS: [(&str, usize); 20] = [
    ("agents/core", 0),
    ("agents/geometry", 5),
    ("agents/contact", 2),
    ("agents/models", 5),
    ("crates/drawable", 3),
    ("crates/runtime", 3),
    ("crates/world", 6),
    ("crates/scene", 6),
    ("crates/devices", 0),
    ("crates/export", 0),
    ("crates/bevy", 5),
    ("crates/hosts", 0),
    ("crates/import", 3),
    ("crates/lod", 5),
    ("crates/render", 7),
    ("crates/session", 3),
    ("crates/viewer", 2),
    ("crates/console", 0),
    ("crates/lab", 7),
    (".", 2),
];

/// Most production lines of Rust in all crates and the Python module: neither blank, comment nor test code. Work that needs
/// more raises it beforehand, in a commit that names what the lines are for.
const LINES_MAX: usize = 111_000;

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

/// Every source file of every crate, with its text.
fn sources() -> Vec<(String, String)> {
    let folders = ARROWS.iter().map(|(folder, _)| format!("{folder}/src")).chain(["src".to_owned()]);
    folders
        .flat_map(|r| files_below(&root().join(r), "rs"))
        .map(|path| (relative(&path), fs::read_to_string(&path).unwrap()))
        .collect()
}

fn is_test(path: &str) -> bool {
    path.contains("/tests/") || path.ends_with("tests.rs")
}

#[test]
fn every_source_file_opens_by_saying_what_it_is() {
    let silent: Vec<_> = sources().into_iter().filter(|(_, text)| !text.starts_with("//! ")).map(|(p, _)| p).collect();
    assert!(silent.is_empty(), "no module doc on the first line: {silent:#?}");
}

#[test]
fn every_crate_depends_on_those_below_it_alone_and_says_what_it_is() {
    let folders: BTreeSet<String> = ["agents", "crates"]
        .iter()
        .flat_map(|group| fs::read_dir(root().join(group)).unwrap())
        .map(|entry| relative(&entry.unwrap().path()))
        .collect();
    let known: BTreeSet<String> = ARROWS.iter().map(|(folder, _)| (*folder).to_owned()).collect();
    assert_eq!(folders, known, "crates without a row of arrows, or rows without a crate");
    let mut wrong = Vec::new();
    for (folder, allowed) in ARROWS {
        let text = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let (_, rest) = text.split_once("\n[dependencies]\n").expect("dependencies");
        let dependencies = rest.split("\n[").next().unwrap();
        for line in dependencies.lines() {
            let Some(name) = line.strip_prefix("metachron-") else { continue };
            let name = name.split(['.', ' ', '=']).next().unwrap();
            if !allowed.contains(&name) {
                wrong.push(format!("{folder} must not depend on metachron-{name}"));
            }
        }
        for key in ["description = ", "keywords = ", "categories = ", "[lints]\nworkspace = true"] {
            if !text.contains(key) {
                wrong.push(format!("{folder}/Cargo.toml lacks `{key}`"));
            }
        }
        if !root().join(folder).join("README.md").is_file() {
            wrong.push(format!("{folder} lacks a README.md"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// `.ci/run` looks for zenoh in the tree of dependencies; here is why it finds none.
#[test]
fn the_network_comes_by_its_own_feature_alone() {
    let text = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let (_, features) = text.split_once("\n[features]\n").unwrap();
    let (features, rest) = features.split_once("\n[").unwrap();
    let with_hosts: Vec<_> = features.lines().filter(|line| !line.starts_with('#') && line.contains("hosts")).collect();
    assert_eq!(with_hosts, ["hosts = [\"dep:metachron-hosts\"]"]);
    assert!(rest.contains("\nmetachron-hosts = { workspace = true, optional = true }\n"), "an optional dependency");
    assert!(text.contains("exclude = [\"crates/bevy\", \"crates/hosts\"]"), "a member is built by every command");
}

#[test]
fn crates_keep_their_promises_of_absence() {
    let mut broken = Vec::new();
    for (path, text) in sources() {
        let numbers = NO_STD.iter().any(|m| path.starts_with(&format!("crates/lod/src/{m}")));
        let of_numbers: &[&str] = if numbers { &["std::", "metachron_core", "glam"] } else { &[] };
        let absent = ABSENT.iter().filter(|(folder, _)| path.starts_with(&format!("{folder}/")));
        let absent: Vec<_> = absent.flat_map(|(_, words)| words.iter()).chain(of_numbers).collect();
        // tests read reference files and start threads; the code that they test must not
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        for (number, line) in
            code.lines().enumerate().filter(|(_, l)| !is_test(&path) && !l.trim_start().starts_with("//"))
        {
            let is_own_file = |word: &str| word == "std::fs" && OWN_FILES.contains(&path.as_str());
            for word in absent.iter().filter(|word| line.contains(**word) && !is_own_file(word)) {
                broken.push(format!("{path}:{}: {word}", number + 1));
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
}

#[test]
fn rings_of_files_that_use_each_other_do_not_grow() {
    for (folder, most) in RINGS {
        let files = CrateFiles::read(folder);
        let arrows = files.arrows();
        let rings = arrows.keys().map(|file| ring(file, &arrows));
        let greatest = rings.max_by_key(BTreeSet::len).unwrap_or_default();
        assert_eq!(
            greatest.len(),
            most,
            "{folder}: a ring that grew is to be cut, a smaller one lowers its ceiling: {greatest:#?}"
        );
    }
}

/// The rooms of a cluster's steps: a file uses none of a later one.
const CONTACT_ROOMS: [&str; 7] = ["solve", "member", "detect", "constraint", "impact", "step", "remote"];

#[test]
fn rooms_of_contact_use_those_before_them_alone() {
    let files = CrateFiles::read("agents/contact");
    let room =
        |file: &str| CONTACT_ROOMS.iter().position(|room| file.starts_with(&format!("agents/contact/src/{room}/")));
    let arrows = files.arrows();
    let pairs = arrows.iter().flat_map(|(from, to)| to.iter().map(move |to| (*from, *to)));
    let upward: Vec<_> = pairs.filter(|(from, to)| room(from).zip(room(to)).is_some_and(|(a, b)| a < b)).collect();
    assert!(upward.is_empty(), "{upward:#?}");
    let entered = arrows.keys().filter_map(|file| room(file)).collect::<BTreeSet<_>>();
    assert_eq!(entered.len(), CONTACT_ROOMS.len(), "a room has no file");
}

/// Lines of a text that are neither blank nor comments that begin with `comment`; of Rust, those before its tests.
fn production_lines(text: &str, comment: &str) -> usize {
    let is_tests = |at: &usize| {
        let module = text[*at..].lines().nth(1).unwrap_or_default();
        module.starts_with("mod ") && module.ends_with('{')
    };
    let tests = text.match_indices("#[cfg(test)]\n").map(|(at, _)| at).find(is_tests).unwrap_or(text.len());
    let code = text[..tests].lines().map(str::trim);
    code.filter(|line| !line.is_empty() && !line.starts_with(comment)).count()
}

#[test]
fn production_code_keeps_to_its_lines() {
    let folders = ARROWS.iter().map(|(folder, _)| (*folder, format!("{folder}/src"), "rs", "//"));
    let folders = folders.chain([
        ("the command", "src".to_owned(), "rs", "//"),
        ("python, Rust", "python/src".to_owned(), "rs", "//"),
        ("python, Python", "python/package".to_owned(), "py", "#"),
        ("shaders", "crates".to_owned(), "wgsl", "//"),
    ]);
    let mut rust = 0;
    for (name, folder, extension, comment) in folders {
        let files = files_below(&root().join(folder), extension).into_iter().filter(|file| !is_test(&relative(file)));
        let lines: usize = files.map(|file| production_lines(&fs::read_to_string(file).unwrap(), comment)).sum();
        println!("{lines:>7}  {name}");
        rust += if extension == "rs" { lines } else { 0 };
    }
    println!("{rust:>7}  Rust in all");
    assert!(rust <= LINES_MAX, "{rust} lines of {LINES_MAX}: less of others, or a ceiling raised with its reason");
}

#[test]
fn comments_blank_lines_and_tests_are_no_production_code() {
    let text = "//! Doc.\n\nfn a() {\n    // why\n}\n#[cfg(test)]\nmod tests {\n    fn b() {}\n}\n";
    assert_eq!(production_lines(text, "//"), 2);
    assert_eq!(production_lines("#[cfg(test)]\nmod tests;\nfn b() {}\n", "//"), 3);
    assert_eq!(production_lines("# why\nx = 1\n", "#"), 1);
}

/// Crates whose folders have a dozen files at most, each folder named by the question that it answers.
const IN_ROOMS: [&str; 8] = [
    "agents/geometry",
    "agents/contact",
    "crates/runtime",
    "crates/world",
    "crates/drawable",
    "crates/render",
    "crates/lod",
    "crates/lab",
];

#[test]
fn folders_have_a_dozen_files_at_most() {
    let files = IN_ROOMS.iter().flat_map(|folder| files_below(&root().join(folder), "rs"));
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for file in files {
        *counts.entry(relative(file.parent().unwrap())).or_default() += 1;
    }
    let crowded: Vec<_> = counts.iter().filter(|(_, count)| **count > 12).collect();
    assert!(counts.len() > IN_ROOMS.len() && crowded.is_empty(), "{crowded:#?}");
}

#[test]
fn the_map_fits_on_a_page() {
    let map = fs::read_to_string(root().join("docs/ARCHITECTURE.md")).unwrap();
    let lines = map.lines().count();
    assert!(lines <= 80, "{lines} lines");
    for (folder, _) in ARROWS {
        assert!(map.contains(folder), "{folder} is not on the map");
    }
}

#[test]
fn every_page_is_in_the_book() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let pages = files_below(&root().join("docs"), "md").into_iter().map(|page| relative(&page));
    // decisions are listed by the page that leads to them
    let pages = pages.filter(|page| !page.starts_with("docs/decisions/0") && !page.ends_with("SUMMARY.md"));
    let is_missing = |page: &String| !summary.contains(&format!("({})", page.trim_start_matches("docs/")));
    let missing: Vec<_> = pages.filter(is_missing).collect();
    assert!(missing.is_empty(), "not in docs/SUMMARY.md: {missing:#?}");
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
