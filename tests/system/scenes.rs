//! The built-in scenes as physics: the promises of their descriptions hold, in virtual time.

use crate::play::{Folder, lockstep, number, point};
use std::fs::read_to_string;
use std::path::Path;

/// The bodies that lie in the tray of the tube scene.
const BODIES: [&str; 3] = ["marble", "swab", "vial"];

#[test]
fn the_grasper_of_the_yard_finds_the_hose_again_where_it_dropped_it() {
    // by the scene's keyframes it is shut from 3 s to 7 s, and every 9 s
    for (seconds, holds) in [("13", true), ("17", false), ("22", true)] {
        let report = lockstep("yard", &["--seconds", seconds]);
        let grasp = report["couplings"].as_array().unwrap().iter().find(|c| c["kind"] == "grasp").unwrap().clone();
        assert_eq!(number(&grasp, "/contacts"), f64::from(u8::from(holds)), "at {seconds} s: {grasp}");
        assert!(number(&grasp, "/force_max_n") > 0.05, "at {seconds} s: {grasp}");
    }
}

#[test]
fn the_rigid_bodies_of_the_tube_scene_lie_still_where_they_were_put() {
    let scene = read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tube.toml")).unwrap();
    let probe = |name: &&str| format!("[[probe]]\nobject = \"{name}\"\n");
    let text = scene.replacen("format = 1", "", 1) + &BODIES.iter().map(probe).collect::<String>();
    let place = |seconds| {
        let report = Folder::with(&text).lockstep(&["--seconds", seconds]);
        let probes = report["probes"].as_array().unwrap();
        BODIES.map(|name| point(probes.iter().find(|p| p["object"] == name).unwrap(), "/position_m"))
    };
    for (start, end) in place("0.02").into_iter().zip(place("1")) {
        let moved_m = (0..3).map(|axis| (end[axis] - start[axis]).powi(2)).sum::<f64>().sqrt();
        // they are put half a millimetre above the tray and settle
        assert!(moved_m < 2e-3, "{moved_m} m");
    }
}

#[test]
fn the_pendulum_swings_through_and_up_again() {
    let report = lockstep("pendulum", &["--seconds", "1"]);
    let tip = report["probes"][0]["samples"].as_array().unwrap();
    let lowest_m = tip.iter().map(|s| number(s, "/3")).fold(f64::INFINITY, f64::min);
    let beyond = tip.iter().filter(|s| number(s, "/1") < 0.0);
    let back_m = beyond.map(|s| number(s, "/3")).fold(f64::NEG_INFINITY, f64::max);
    // 0.6 m below a pin at 0.85 m; the other side is at most as high as the start
    assert!(lowest_m < 0.45 && back_m > 0.5 && back_m < 0.9, "lowest {lowest_m} m, on the other side {back_m} m");
}
