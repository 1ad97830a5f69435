//! Scenes that start agents inside each other: what bends begins elsewhere, and nobody gains energy.

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
