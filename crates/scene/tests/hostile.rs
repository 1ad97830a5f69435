//! Scenes that ask for too much, or for files that are not theirs: each is refused at a line of it before anything is
//! made.
#![cfg(target_os = "linux")]

use metachron_scene::{Limits, SceneError, Source, load};
use std::fs::{File, read_to_string, write};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::Instant;

/// The most memory that a refusal may take: a mesh of a million triangles, as the largest of them name, takes 430 MiB.
const REFUSAL_MIB: f64 = 50.0;
/// Of scenes whose numbers are all within their ranges.
const LIMIT_BYTES: u64 = 512 << 20;

/// The memory of this process, MiB: its present memory (`VmRSS`), or the most that it has held (`VmHWM`).
fn memory_mib(which: &str) -> f64 {
    let status = read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(which)).unwrap();
    line.trim_matches([':', ' ', '\t', 'k', 'B']).parse::<f64>().unwrap() / 1024.0
}

#[derive(Clone)]
struct Hostile {
    text: String,
    /// A word of the first problem.
    says: &'static str,
}

fn hostile(says: &'static str, text: String) -> Hostile {
    Hostile { text: format!("format = 1\n{text}"), says }
}

fn object(name: &str, keys: &str) -> String {
    format!("[[object]]\nname = \"{name}\"\n{keys}\n")
}

/// More triangles than any mesh may have, and the copies of most grids.
const HUGE: &str = "triangles = 4000000000";
const MANY: &str = "grid = [100, 100, 1]\nspacing_m = [1, 1, 1]";

fn mesh(name: &str, kind: &str, keys: &str) -> String {
    object(name, &format!("model = \"mesh\"\ngenerate = \"{kind}\"\n{keys}"))
}

/// Scenes of meshes that are too large, one at a time or together.
fn of_meshes() -> Vec<Hostile> {
    let (seen, touched) = ("a number from 4 to 1000000", "a number from 4 to 100000");
    let rigid = |shape: &str, keys: &str| object("m", &format!("model = \"rigid\"\nshape = \"{shape}\"\n{keys}"));
    let liver = |keys: &str| {
        object("m", &format!("model = \"solid\"\nshape = \"mesh\"\ngenerate = \"liver\"\nyoung_pa = 1e4\n{keys}"))
    };
    let cavity = |seed| mesh(&format!("m{seed}"), "cavity", &format!("triangles = 1000000\nseed = {seed}"));
    let tree = |seed: u32, leaves: u32| {
        let keys = format!("model = \"tree\"\nheight_m = 5\nseed = {seed}\nbranches = 100000\nleaves = {leaves}");
        object(&format!("t{seed}"), &keys)
    };
    let part = format!("[[object.part]]\nshape = \"mesh\"\ngenerate = \"blob\"\n{HUGE}\n");
    let group = "[[group]]\nname = \"g\"\nmembers = [\"m\"]\n[group.proxy]\ngenerate = \"blob\"";
    vec![
        hostile(seen, mesh("m", "terrain", HUGE)),
        hostile(seen, mesh("m", "sphere", "triangles = 4294967295")),
        hostile(seen, mesh("m", "liver", "triangles = 1000001")),
        hostile("memory", (0..10).map(cavity).collect()),
        hostile("at most 10000", mesh("m", "strut", &format!("dome_m = 1\n{MANY}"))),
        hostile(seen, format!("{}{group}\n{HUGE}\n", mesh("m", "sphere", ""))),
        hostile(touched, rigid("mesh", &format!("generate = \"terrain\"\n{HUGE}"))),
        hostile(touched, rigid("hull", &format!("generate = \"terrain\"\n{HUGE}"))),
        hostile(touched, rigid("compound", &part.repeat(16))),
        hostile("memory", rigid("mesh", &format!("fixed = true\ngenerate = \"torus\"\ntriangles = 100000\n{MANY}"))),
        hostile(touched, liver(&format!("scale = 0.1\neps_m = 0.02\n{HUGE}"))),
        hostile("too fine", liver("eps_m = 1e-6\ntriangles = 100000")),
        hostile("memory", liver(&format!("scale = 0.1\neps_m = 0.01\ntriangles = 100000\n{MANY}"))),
        hostile("1 to 100000", tree(1, 4_000_000_000)),
        hostile("memory", (0..20).map(|seed| tree(seed, 100_000)).collect()),
    ]
}

/// Scenes of too many bodies, and of bodies that are divided too finely.
fn of_bodies() -> Vec<Hostile> {
    let balls = |name: &str, grid: &str| {
        let keys = "model = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nspacing_m = [1, 1, 1]";
        object(name, &format!("{keys}\ngrid = {grid}"))
    };
    let tube = |path: &str, keys: &str| {
        let matter = "radius_m = 0.01\nyoung_pa = 1e6\ndensity_kg_m3 = 1e3";
        object("t", &format!("model = \"tube\"\npath_m = [{path}]\n{matter}\n{keys}"))
    };
    let soft = |model: &str, keys: &str| object("s", &format!("model = \"{model}\"\nyoung_pa = 1e4\n{keys}"));
    let line = "[0, 0, 0], [1, 0, 0]";
    let long_path = (0..20_000).map(|i| format!("[{i}, 0, 0]")).collect::<Vec<_>>().join(",");
    vec![
        hostile("at most 10000", balls("b", "[1000, 1000, 1000]")),
        hostile("at most 10000", balls("b", "[4294967295, 4294967295, 4294967295]")),
        hostile("at most 10000", (0..500).map(|i| balls(&format!("b{i}"), "[100, 100, 1]")).collect()),
        hostile("memory", tube(line, &format!("segments = 4096\n{MANY}"))),
        hostile("memory", tube(&long_path, &format!("segments = 10\n{MANY}"))),
        hostile("2 to 4096", tube(line, "segments = 4000000000")),
        hostile("memory", soft("solid", "shape = \"box\"\nsize_m = [1, 1, 1]\nsegments = [2047, 2047, 2047]")),
        hostile("too fine", soft("solid", "shape = \"box\"\nsize_m = [1e4, 1e4, 1e4]\neps_m = 1e-6")),
        hostile("too fine", soft("solid", "shape = \"ball\"\nradius_m = 1\neps_m = 1e-5")),
        hostile("memory", soft("sheet", "size_m = [1, 1]\nthickness_m = 1e-3\nsegments = [2047, 2047]")),
        hostile("memory", soft("sheet", &format!("size_m = [1, 1]\nthickness_m = 1e-3\nsegments = [90, 90]\n{MANY}"))),
        hostile("too fine", soft("rope", &format!("path_m = [{line}]\nradius_m = 0.01\neps_m = 1e-6"))),
    ]
}

/// Scenes of long lists, long words and deep nesting.
fn of_text() -> Vec<Hostile> {
    vec![
        hostile("at most 100", "[[camera]]\neye_m = [1, 0, 0]\n".repeat(5000)),
        hostile("at most 1000", "[[probe]]\nobject = \"x\"\n".repeat(20_000)),
        hostile("recurs", format!("x = {}\n", "[".repeat(100_000))),
        hostile("printable", mesh(&"n".repeat(1_000_000), "sphere", "triangles = 1000000")),
        hostile("does not exist", (0..20_000).map(|i| object(&format!("o{i}"), "model = \"x\"")).collect()),
    ]
}

/// Scenes of files: of others, and such that say they are large.
fn of_files(folder: &Path) -> Vec<Hostile> {
    let inside = folder.join("scene");
    std::fs::create_dir_all(inside.join("a")).unwrap();
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    write(folder.join("other.obj"), tetrahedron).unwrap();
    symlink(folder.join("other.obj"), inside.join("link.obj")).unwrap();
    symlink(folder, inside.join("folder")).unwrap();
    symlink("/dev/zero", inside.join("zero.obj")).unwrap();
    File::create(inside.join("long.obj")).unwrap().set_len(1 << 30).unwrap();
    let stl = [&[0; 80][..], &1_300_000_u32.to_le_bytes()].concat();
    write(inside.join("m.stl"), stl).unwrap();
    File::options().write(true).open(inside.join("m.stl")).unwrap().set_len(84 + 50 * 1_300_000).unwrap();
    write(inside.join("m.msh"), "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4000000000\n1 0 0 0\n").unwrap();
    let seen = |file: &str| object("m", &format!("model = \"mesh\"\nfile = \"{file}\""));
    let touched = |file: &str| object("m", &format!("model = \"rigid\"\nshape = \"hull\"\nfile = \"{file}\""));
    let soft =
        |file: &str| object("m", &format!("model = \"solid\"\nshape = \"mesh\"\nyoung_pa = 1e4\nfile = \"{file}\""));
    vec![
        hostile("outside", seen("../other.obj")),
        hostile("outside", touched("a/../../other.obj")),
        hostile("outside", soft("../../../../../../etc/passwd")),
        hostile("outside", seen("link.obj")),
        hostile("outside", touched("folder/other.obj")),
        hostile("outside", seen("zero.obj")),
        hostile("relative", seen("/etc/passwd")),
        hostile("outside", object("m", "model = \"mesh\"\ngenerate = \"sphere\"\ntexture = \"../picture.png\"")),
        hostile("more than", seen("long.obj")),
        hostile("memory", seen("m.stl")),
        hostile("4000000000", soft("m.msh")),
    ]
}

fn refusal(source: Source) -> SceneError {
    let limits = Limits { memory_bytes: LIMIT_BYTES, ..Limits::default() };
    load(&source.within(limits), &[]).expect_err("a hostile scene")
}

#[test]
fn hostile_scenes_are_refused_at_their_lines_before_anything_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let all = [of_meshes(), of_bodies(), of_text(), of_files(folder.path())].concat();
    assert!(all.len() >= 40);
    let path = folder.path().join("scene/s.toml");
    for Hostile { text, says } in &all {
        write(&path, text).unwrap();
        write("/proc/self/clear_refs", "5").unwrap(); // the peak begins anew
        let (held_mib, begun) = (memory_mib("VmRSS"), Instant::now());
        let error = refusal(Source::open(path.to_str().unwrap()).unwrap());
        let (took, taken_mib) = (begun.elapsed(), memory_mib("VmHWM") - held_mib);
        let first = &error.problems[0];
        let (start, said) = (&text[..text.len().min(160)], format!("{}; {}", first.message, first.expected));
        println!("{:6.1} ms, {taken_mib:5.1} MiB: {said}", took.as_secs_f64() * 1e3);
        assert!(said.contains(says) && first.line > 0, "{said} has no `{says}`, line {}: {start}", first.line);
        assert!(taken_mib < REFUSAL_MIB, "{taken_mib} MiB for {said}: {start}");
    }
}

#[test]
fn a_file_outside_of_its_folder_is_read_where_that_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let files = of_files(folder.path());
    let path = folder.path().join("scene/s.toml");
    let allowed = Limits { allow_outside: true, ..Limits::default() };
    for Hostile { text, .. } in
        files.iter().filter(|file| file.text.contains("other.obj") || file.text.contains("link"))
    {
        write(&path, text).unwrap();
        let source = Source::open(path.to_str().unwrap()).unwrap().within(allowed);
        assert!(load(&source, &[]).is_ok(), "{text}");
        assert_eq!(source.files_outside().len(), 1, "{text}");
    }
}
