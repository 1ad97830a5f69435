//! The memory that a scene is estimated to take, against the memory of its world, each in a process of its own.
#![cfg(target_os = "linux")]

use metachron_core::SimSpan;
use metachron_scene::{Limits, Source, load};
use metachron_world::World;
use metachron_world::kinds::ExecutorKind;
use std::process::Command;

/// The variable with the text of the scene that a process of its own measures, and the test that does.
const SCENE: &str = "METACHRON_MEASURED_SCENE";
const MEASURES: &str = "the_scene_of_the_variable_is_measured";

/// The most memory that this process has held, bytes.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().strip_suffix("kB").unwrap().trim().parse::<u64>().unwrap() << 10
}

#[test]
fn the_scene_of_the_variable_is_measured() {
    let Ok(text) = std::env::var(SCENE) else { return };
    let before_bytes = peak_bytes();
    let scene = load(&Source::memory("measured", text.as_bytes()).unwrap(), &[]).unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    world.advance(SimSpan::from_millis(20));
    println!("took {} bytes", peak_bytes() - before_bytes);
}

/// The number after `before` in a text.
fn number_after(text: &str, before: &str) -> f64 {
    let rest = text.split(before).nth(1).unwrap_or_else(|| panic!("no `{before}` in {text}"));
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

fn used_mib(text: &str) -> f64 {
    let this = std::env::current_exe().unwrap();
    let measured = Command::new(this).args(["--exact", MEASURES, "--nocapture"]).env(SCENE, text).output().unwrap();
    number_after(&String::from_utf8(measured.stdout).unwrap(), "took ") / 1_048_576.0
}

/// The estimate, as the refusal of a scene without any memory says it.
fn estimated_mib(text: &str) -> f64 {
    let nothing = Limits { memory_bytes: 0, ..Limits::default() };
    let source = Source::memory("measured", text.as_bytes()).unwrap().within(nothing);
    let message = load(&source, &[]).unwrap_err().problems.remove(0).message;
    number_after(&message, ", of ")
}

#[test]
fn a_scene_takes_as_much_memory_as_is_estimated_within_a_fifth() {
    let mesh = "model = \"mesh\"\ngenerate = \"terrain\"\ntriangles = 50000";
    let tree = "model = \"tree\"\nheight_m = 5\nbranches = 20000\nleaves = 40000";
    let ball = "model = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1";
    let surface = "model = \"rigid\"\nshape = \"mesh\"\ngenerate = \"sphere\"\ntriangles = 20000";
    let tube = "model = \"tube\"\npath_m = [[0, 0, 1], [1, 0, 1]]\nradius_m = 0.01\nyoung_pa = 1e6\ndensity_kg_m3 = 1e3\nsegments = 500";
    let solid = "model = \"solid\"\nshape = \"box\"\nsize_m = [0.1, 0.1, 0.1]\nsegments = [10, 10, 10]\nyoung_pa = 1e4";
    let liver = "model = \"solid\"\nshape = \"mesh\"\ngenerate = \"liver\"\nscale = 0.1\neps_m = 0.02\nyoung_pa = 1e4";
    let sheet = "model = \"sheet\"\nsize_m = [0.1, 0.1]\nthickness_m = 1e-3\nsegments = [30, 30]\nyoung_pa = 1e4";
    let rope = "model = \"rope\"\npath_m = [[0, 0, 1], [1, 0, 1]]\nradius_m = 0.01\nsegments = 500\nyoung_pa = 1e6";
    for (object, copies) in [
        (mesh, 1),
        (tree, 1),
        (ball, 1000),
        (&format!("{surface}\nfixed = true"), 4),
        (surface, 4),
        (tube, 10),
        (solid, 4),
        (liver, 10),
        (sheet, 4),
        (rope, 10),
    ] {
        let grid = format!("grid = [1, {copies}, 1]\nspacing_m = [9, 9, 9]\n");
        let text = format!("format = 1\n[[object]]\nname = \"it\"\n{object}\n{grid}");
        let (estimated, used) = (estimated_mib(&text), used_mib(&text));
        // the estimate's promise, of scenes that take some times as much as one of nothing
        assert!((estimated / used - 1.0).abs() < 0.2, "{estimated} MiB estimated, {used} MiB used: {object}");
    }
}
