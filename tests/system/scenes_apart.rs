//! Scenes that start agents inside each other: deformables begin elsewhere, and nobody gains energy.

use crate::play::{Folder, agent, metachron, number, point};
use serde_json::Value;

const BOX: &str = "model = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.05, 0.05, 0.05]\nposition_m = [0, 0, 0.05]";

/// A stiff hose of radius 1 cm along the x axis at 5 cm; it would spring back if it were bent out of anything.
fn hose(name: &str, keys: &str) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nmodel = \"tube\"\npath_m = [[-0.2, 0, 0.05], [0.2, 0, 0.05]]\nradius_m = 0.01\n\
         wall_m = 0.002\nyoung_pa = 1.0e7\ndensity_kg_m3 = 1050.0\ndamping_per_s = 0.0\nsleep = false\n{keys}\n"
    )
}

fn object(name: &str, keys: &str) -> String {
    format!("[[object]]\nname = \"{name}\"\n{keys}\n")
}

fn solid(keys: &str) -> String {
    let size = "size_m = [0.1, 0.1, 0.06]\nsegments = [5, 5, 3]\nyoung_pa = 1.0e5\ndensity_kg_m3 = 1000.0";
    object("liver", &format!("model = \"solid\"\nshape = \"box\"\n{size}\nsleep = false\n{keys}"))
}

/// Plays a second of weightlessness.
fn play(objects: &str) -> Value {
    Folder::with(&format!("[world]\ngravity_m_s2 = [0, 0, 0]\n{objects}")).lockstep(&["--seconds", "1"])
}

#[test]
fn what_bends_starts_beside_what_it_would_be_inside_of_and_nobody_gains_energy() {
    let free = |keys: &str| object("box", &format!("{BOX}\nmass_kg = 0.5\nsleep = false\n{keys}"));
    let fixed = object("box", &format!("{BOX}\nfixed = true"));
    let above = "position_m = [0.02, 0.01, 0.1]";
    // the shortest ways out: half a box and a radius; of two tubes a width; of a solid on a box the height that they share
    let cases = [
        (format!("{}{}", hose("hose", "rate_hz = 240"), free("rate_hz = 60")), "hose", [0.0, 0.0, 0.06]),
        (format!("{}{}", hose("hose", "rate_hz = 60"), free("rate_hz = 240")), "hose", [0.0, 0.0, 0.06]),
        (format!("{}{fixed}", hose("hose", "")), "hose", [0.0, 0.0, 0.06]),
        (format!("{}{}", hose("hose", "pin = [\"start\"]"), free("")), "box", [0.0, 0.0, 0.06]),
        (format!("{}{}", hose("one", "rate_hz = 240"), hose("two", "rate_hz = 60")), "two", [0.0, 0.0, 0.02]),
        (format!("{}{fixed}", solid(above)), "liver", [0.0, 0.0, 0.03]),
        (format!("{}{}", solid(above), free("rate_hz = 60")), "liver", [0.0, 0.0, 0.03]),
    ];
    for (objects, mover, by_m) in cases {
        let report = play(&objects);
        assert!(!report["overlaps"].as_array().unwrap().is_empty(), "{objects}");
        let moved = report["moved"].as_array().unwrap();
        assert_eq!((moved.len(), moved[0]["object"].as_str()), (1, Some(mover)), "{moved:?}\n{objects}");
        // a gap of a hundredth of a millimetre is left
        let off = point(&moved[0], "/by_m").iter().zip(by_m).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(off < 1e-4, "{moved:?}\n{objects}");
        for agent in report["agents"].as_array().unwrap() {
            assert!(number(agent, "/energy_j").abs() < 1e-9, "{agent}\n{objects}");
        }
        assert!(report["couplings"].as_array().unwrap().iter().all(|c| number(c, "/impulse_n_s") < 1e-9), "{objects}");
    }
}

#[test]
fn a_thing_is_moved_clear_of_everything_and_not_only_of_what_it_was_inside() {
    let shelf = object(
        "shelf",
        "model = \"rigid\"\nshape = \"box\"\nhalf_extents_m = [0.3, 0.3, 0.01]\nposition_m = [0, 0, 0.12]\nfixed = true",
    );
    let floor = object("floor", "model = \"rigid\"\nshape = \"plane\"\nfixed = true");
    let fixed = object("box", &format!("{BOX}\nfixed = true"));
    let report = play(&format!("{}{fixed}{shelf}{floor}", hose("hose", "")));
    // neither up against the shelf nor down through the floor: aside
    let by_m = point(&report["moved"][0], "/by_m");
    assert!((by_m[1].abs() - 0.06).abs() < 1e-4 && by_m[0] == 0.0 && by_m[2] == 0.0, "{by_m:?}");
    assert!(number(agent(&report, "hose"), "/energy_j").abs() < 1e-9);
}

#[test]
fn what_is_held_stays_where_the_scene_puts_it() {
    let post = object("post", &format!("{BOX}\nfixed = true"));
    let folder = Folder::with(&format!("{}{post}", hose("hose", "clamp = [\"start\"]")));
    let rows: Value = serde_json::from_slice(&metachron(&["check", "--json", folder.scene()]).stdout).unwrap();
    let content = &rows[0]["content"];
    assert!(content["moved"].as_array().unwrap().is_empty(), "{rows}");
    assert_eq!(
        (content["overlaps"][0]["a"].as_str(), content["overlaps"][0]["b"].as_str()),
        (Some("hose"), Some("post"))
    );
}

#[test]
fn who_is_moved_is_told() {
    let post = object("post", &format!("{BOX}\nfixed = true"));
    let folder = Folder::with(&format!("{}{post}", hose("hose", "")));
    let check = metachron(&["check", folder.scene()]);
    let said = String::from_utf8_lossy(&check.stderr);
    assert!(
        said.contains("`hose` and `post` overlap by") && said.contains("`hose` starts (0.000, 0.000, 60.0"),
        "{said}"
    );
}

/// A light box on a floor, and a tool with its tip at `tip_m` in it that points down, after two seconds.
fn pierced(mass_kg: f64, rates: (f64, f64), (tip_m, force_n): ([f64; 3], f64)) -> Value {
    let floor = object("floor", "model = \"rigid\"\nshape = \"plane\"\nfixed = true");
    let light = object("box", &format!("{BOX}\nmass_kg = {mass_kg}\nrate_hz = {}", rates.0));
    let script = format!("keyframe = [{{ tip_m = {tip_m:?}, rotation_deg = [180, 0, 0], jaw = 0.0 }}]");
    let drive = format!("model = \"instrument\"\nrate_hz = {}\nmax_force_n = {force_n}\n", rates.1);
    let tool = object("tool", &format!("{drive}{script}"));
    let probes = ["box", "tool"].map(|name| format!("[[probe]]\nobject = \"{name}\"\n")).concat();
    Folder::with(&format!("{floor}{light}{tool}{probes}")).lockstep(&["--seconds", "2"])
}

#[test]
fn a_tool_that_starts_deep_in_a_light_box_is_drawn_back_and_throws_nothing() {
    for (rates, mass_kg, tip_m, force_n) in [
        ((240.0, 240.0), 0.2, [0.01, 0.0, 0.05], 50.0),
        ((600.0, 60.0), 0.05, [0.01, 0.0, 0.05], 50.0),
        ((60.0, 600.0), 0.2, [0.0, 0.02, 0.03], 500.0),
        ((10.0, 1000.0), 0.05, [0.0, 0.02, 0.08], 5.0),
    ] {
        let report = pierced(mass_kg, rates, (tip_m, force_n));
        let moved = &report["moved"].as_array().unwrap()[..];
        let [moved] = moved else { panic!("{moved:?}") };
        // along its shaft, until its jaws, 5 mm beyond the tip, stand on the top
        let back_m = point(moved, "/by_m")[2];
        assert!(moved["object"] == "tool" && (back_m - (0.105 - tip_m[2])).abs() < 1e-3, "{rates:?}: {moved}");
        let [at, tip] = [0, 1].map(|k| point(&report, &format!("/probes/{k}/position_m")));
        println!("{rates:?} {mass_kg} kg: box at {at:?}, tip at {tip:?}");
        let off_m = at.iter().zip([0.0, 0.0, 0.05]).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(off_m < 1e-3, "{rates:?} {mass_kg} kg: the box is {off_m} m aside");
        assert!((tip[2] - 0.105).abs() < 1e-3, "{rates:?} {mass_kg} kg: the tip is at {tip:?}");
    }
}

#[test]
fn a_rope_that_starts_on_a_tool_starts_beside_it_and_what_is_grasped_stays() {
    let rope = "model = \"rope\"\npath_m = [[-0.1, 0, 0.003], [0.1, 0, 0.003]]\nradius_m = 0.005\nsegments = 11\nyoung_pa = 1.0e6\ndensity_kg_m3 = 1000.0\nsleep = false";
    let tool = |keys: &str| {
        let script = "keyframe = [{ tip_m = [0, 0.1, 0], rotation_deg = [-90, 0, 0], jaw = 0.0 }]";
        object("tool", &format!("model = \"instrument\"\n{script}\n{keys}"))
    };
    let report = play(&format!("{}{}", object("rope", rope), tool("")));
    let moved = &report["moved"].as_array().unwrap()[..];
    let [moved] = moved else { panic!("{moved:?}") };
    // the shaft is 5 mm across
    let up_m = point(moved, "/by_m")[2];
    assert!(moved["object"] == "rope" && (up_m - 0.0045).abs() < 5e-4, "{moved}");
    assert!(number(agent(&report, "rope"), "/energy_j").abs() < 1e-9);
    let grasped = play(&format!("{}{}", object("rope", rope), tool("grasps = [\"rope\"]")));
    assert!(grasped["moved"].as_array().unwrap().is_empty(), "{}", grasped["moved"]);
}
