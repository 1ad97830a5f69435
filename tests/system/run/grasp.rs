//! Rigid bodies in the jaws of an instrument, through scene file, runtime and report.

use crate::play::{Folder, agent, metachron, number, point};
use serde_json::Value;

/// A tool that comes down over `tip` open until 0.5 s, shuts, lifts by 0.2 m until 2 s, and opens at `open_s`.
fn tool(grasps: &str, (tip, rate_hz): ([f64; 3], u32), open_s: u32) -> String {
    let [x, y, z] = tip;
    let key =
        |at_s: f64, up: f64, jaw: u32| format!("{{ at_s = {at_s}, tip_m = [{x}, {y}, {}], jaw = {jaw} }}", z + up);
    let keys = [(0.5, 0.0, 1), (0.8, 0.0, 0), (1.0, 0.0, 0), (2.0, 0.2, 0), (f64::from(open_s), 0.2, 0)];
    let keys: Vec<_> = keys.into_iter().map(|(at_s, up, jaw)| key(at_s, up, jaw)).collect();
    format!(
        "[[object]]\nname = \"tool\"\nmodel = \"instrument\"\ngrasps = [{grasps}]\nrate_hz = {rate_hz}\nstiffness_n_m = 2000\n\
         damping_n_s_m = 28\nkeyframe = [{{ tip_m = [{x}, {y}, {}], rotation_deg = [180, 0, 0], jaw = 1 }}, {}, {}]\n",
        z + 0.05,
        keys.join(", "),
        key(f64::from(open_s) + 0.2, 0.2, 1),
    )
}

/// Where the cube of [`cube`] is lifted to: by 0.2 m, less its weight over the stiffness of the jaws and of the drive that carries them.
const LIFTED_M: f64 = 0.22 - 0.981 / 2000.0 - 0.981 / 1e4;

/// The jaws close on it where it lies, up to so deep in the floor.
const DEPTH_M: f64 = 2e-5;

const FLOOR: &str = "[[object]]\nname = \"floor\"\nmodel = \"rigid\"\nshape = \"plane\"\n";

/// A cube of 4 cm and 0.1 kg on the floor.
fn cube(rate_hz: u32) -> String {
    format!(
        "[[object]]\nname = \"cube\"\nmodel = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.02, 0.02, 0.02]\n\
         position_m = [0, 0, 0.02]\nmass_kg = 0.1\nrate_hz = {rate_hz}\n[[probe]]\nobject = \"cube\"\n{FLOOR}"
    )
}

fn coupling<'r>(report: &'r Value, [a, b]: [&str; 2], kind: &str) -> &'r Value {
    let found =
        report["couplings"].as_array().unwrap().iter().find(|c| c["a"] == a && c["b"] == b && c["kind"] == kind);
    found.unwrap_or_else(|| panic!("no {kind} of {a} and {b}: {}", report["couplings"]))
}

#[test]
fn a_cube_that_a_scene_lets_a_tool_grasp_is_lifted_weighed_and_let_go() {
    for rates in [(240, 240), (60, 600), (600, 60)] {
        let tool = |open_s| tool("\"cube\"", ([0.0, 0.0, 0.04], rates.1), open_s);
        let scene = |open_s| Folder::with(&(cube(rates.0) + &tool(open_s)));
        let report = scene(9).lockstep(&["--seconds", "4"]);
        let grasp = coupling(&report, ["tool", "cube"], "grasp");
        let force_n = number(grasp, "/force_n");
        assert!(number(grasp, "/contacts") == 1.0 && (force_n - 0.981).abs() < 0.01 * 0.981, "{rates:?}: {grasp}");
        let [x, y, z] = point(&report, "/probes/0/position_m");
        assert!(x.hypot(y) < 1e-4 && (z - LIFTED_M).abs() < DEPTH_M, "{rates:?}: [{x}, {y}, {z}]");
        assert!(number(agent(&report, "cube"), "/steps") > 3.0 * f64::from(rates.0), "each keeps its own clock");

        let scene = scene(3);
        assert_eq!(metachron(&["check", scene.scene()]).status.code(), Some(0));
        let report = scene.lockstep(&["--seconds", "5"]);
        let grasp = coupling(&report, ["tool", "cube"], "grasp");
        assert_eq!((number(grasp, "/contacts"), number(grasp, "/force_n")), (0.0, 0.0), "{rates:?}: {grasp}");
        let [x, y, z] = point(&report, "/probes/0/position_m");
        assert!(x.hypot(y) < 1e-3 && (z - 0.02).abs() < 1e-3, "{rates:?}: it fell to [{x}, {y}, {z}]");
    }
}

#[test]
fn a_tool_lifts_a_cube_that_it_passes_through() {
    for off in ["[[coupling]]\na = \"tool\"\nb = \"cube\"\nlaw = \"off\"\n", "[world]\ncontacts = false\n"] {
        for rates in [(240, 240), (60, 600), (600, 60)] {
            // the tip goes to the cube's middle, and takes it there
            let tool = tool("\"cube\"", ([0.0, 0.0, 0.02], rates.1), 9);
            let report = Folder::with(&format!("{off}{}{tool}", cube(rates.0))).lockstep(&["--seconds", "4"]);
            let force_n = number(coupling(&report, ["tool", "cube"], "grasp"), "/force_n");
            assert!((force_n - 0.981).abs() < 0.01 * 0.981, "{off}{rates:?}: {force_n} N");
            let [x, y, z] = point(&report, "/probes/0/position_m");
            assert!(x.hypot(y) < 1e-5 && (z - LIFTED_M).abs() < DEPTH_M, "{off}{rates:?}: [{x}, {y}, {z}]");
        }
    }
}
