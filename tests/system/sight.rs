//! An agent is simulated as finely as somebody can see it, and comes back without a jump.

use crate::play::{Folder, agent, lockstep, number};
use serde_json::Value;

/// A soft tube that hangs from two pins.
const HOSE: &str = "name = \"hose\"\nmodel = \"tube\"\npath_m = [[-0.4, 0, 0], [0, 0, -0.2], [0.4, 0, 0]]\n\
    radius_m = 0.012\nwall_m = 0.003\nyoung_pa = 5.0e5\nself_contact = false\npin = [\"start\", \"end\"]\n";
/// A rope along the same path, and a sheet, which hang from two of their sides.
const ROPE: &str = "name = \"rope\"\nmodel = \"rope\"\npath_m = [[-0.4, 0, 0], [0, 0, -0.2], [0.4, 0, 0]]\n\
    radius_m = 0.005\nyoung_pa = 1.0e6\nhold = [\"start\", \"end\"]\n";
const SHEET: &str = "name = \"sheet\"\nmodel = \"sheet\"\nsize_m = [0.8, 0.03]\nthickness_m = 0.002\n\
    young_pa = 2.0e5\nhold = [\"left\", \"right\"]\n";

/// An object that the camera looks at, at `away` between 1 and 6 s, and at it again.
fn hanging(object: &str, away: &str) -> String {
    let name = object.split('"').nth(1).expect("an object has a name");
    format!(
        "[target]\nframe_hz = 30.0\n[camera]\n\
         keyframe = [\n\
           {{ at_s = 0, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n{{ at_s = 1, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n\
           {{ at_s = 1.1, {away} }},\n{{ at_s = 6, {away} }},\n\
           {{ at_s = 6.1, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n{{ at_s = 10, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n\
         ]\n\
         [[object]]\n{object}density_kg_m3 = 1050.0\nsleep = false\ndamping_per_s = 8.0\nrate_hz = 100.0\neps_m = [0.01, 0.1]\n\
         n = [0, 2]\n\
         [[probe]]\nobject = \"{name}\"\nat = 0.5\nevery_ms = 10.0\n"
    )
}

fn play(object: &str, away: &str, seconds: &str) -> Value {
    let folder = Folder::with(&hanging(object, away));
    lockstep(folder.scene(), &["--seconds", seconds])
}

/// ε of the simulation at the end, metres.
fn eps_m(report: &Value) -> f64 {
    report["agents"][0]["eps_m"].as_f64().expect("a tube has one")
}

/// The farthest that the probe goes between two samples after `from_s`, metres.
fn leap_m(report: &Value, from_s: f64) -> f64 {
    let samples: Vec<[f64; 4]> = serde_json::from_value(report["probes"][0]["samples"].clone()).expect("samples");
    let later = samples.windows(2).filter(|pair| pair[0][0] >= from_s);
    later.map(|pair| (1..4).map(|k| pair[1][k] - pair[0][k]).fold(0.0, f64::hypot)).fold(0.0, f64::max)
}

const BEHIND: &str = "eye_m = [0, -1.5, 0], look_at_m = [0, -3, 0]";
const FAR: &str = "eye_m = [0, -60, 0], look_at_m = [0, 0, 0]";

#[test]
fn out_of_sight_a_tube_is_at_its_coarsest_and_it_comes_back_as_fine_as_before_without_a_jump() {
    assert_eq!(eps_m(&play(HOSE, BEHIND, "1.5")), 0.01, "a glance aside changes nothing");
    assert_eq!(eps_m(&play(HOSE, BEHIND, "5")), 0.1);
    let back = play(HOSE, BEHIND, "9");
    assert_eq!(eps_m(&back), 0.01);
    // from a tenth of a metre to a hundredth and back: the middle moves by less than the finer of the two
    assert!(leap_m(&back, 0.9) < 0.01, "{}", leap_m(&back, 0.9));
}

#[test]
fn far_away_a_tube_is_as_fine_as_a_pixel_is_wide() {
    // 720 rows over 40 degrees, 60 m away less the radius of the ball around it
    let pixel_m = |depth_m: f64| depth_m * 2.0 * (20.0_f64).to_radians().tan() / 720.0;
    let eps_m = eps_m(&play(HOSE, FAR, "5"));
    assert!(eps_m < pixel_m(60.0) && eps_m > pixel_m(59.0), "{eps_m}, {}", pixel_m(60.0));
}

#[test]
fn out_of_sight_a_rope_and_a_sheet_are_at_their_coarsest_and_come_back_without_a_jump() {
    for object in [ROPE, SHEET] {
        // the largest cell that fits the length and is no longer than 0.1 m
        assert!((0.09..=0.1).contains(&eps_m(&play(object, BEHIND, "5"))));
        let back = play(object, BEHIND, "9");
        assert!((eps_m(&back) - 0.01).abs() < 1e-3, "{}", eps_m(&back));
        assert!(leap_m(&back, 0.9) < 0.01, "{}", leap_m(&back, 0.9));
    }
}

#[test]
fn a_rope_and_a_sheet_are_as_coarse_as_a_tolerance_allows() {
    for object in [ROPE, SHEET] {
        let [tight, loose] = [2e-4, 1e-2].map(|tolerance_m: f64| {
            let held = format!("{object}tolerance_m = {tolerance_m}\ndt_ms = [1, 10]\n");
            let report = play(&held, "eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0]", "8");
            (eps_m(&report), report["agents"][0]["residual_m"].as_f64().expect("an error of its own"))
        });
        assert!(tight.0 < 0.7 * loose.0, "{tight:?} {loose:?}");
        assert!(tight.1 < 2e-4 && loose.1 < 1e-2, "{tight:?} {loose:?}");
    }
}

/// Three balls that drift slowly, a group or not, and a fourth that is not in the group, so far from the first; where time is short a group
/// is drawn as its impostor.
fn drifting(group: &str, apart_m: f64) -> Value {
    let ball = |name: &str, x: f64| {
        format!(
            "[[object]]\nname = \"{name}\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.2\nsleep = false\nposition_m = [{x}, 0, 0]\n\
             velocity_m_s = [0, 0, 0.05]\ndt_ms = [5, 50]\n"
        )
    };
    let text = format!(
        "[target]\nframe_hz = 30.0\npolicy = \"hierarchical\"\n[world]\ngravity_m_s2 = [0, 0, 0]\n\
         [machine]\ndraw_setup_ms = 0.1\ndraw_pixel_ns = 0.0\ndraw_object_us = 0.0\ndraw_triangle_us = 1000.0\nnoise = 0.0\n\
         [camera]\nkeyframe = [\n{{ at_s = 0, {FAR} }},\n{{ at_s = 9, {FAR} }},\n]\n{}{}{}{}{group}",
        ball("a", 0.0),
        ball("b", 2.0),
        ball("c", 4.0),
        ball("outside", -apart_m),
    );
    Folder::with(&text).lockstep(&["--seconds", "3"])
}

const GROUP: &str = "[[group]]\nname = \"all\"\nmembers = [\"a\", \"b\", \"c\"]\nproxy = { generate = \"sphere\", triangles = 12, scale = 2 }\n";

#[test]
fn what_is_drawn_as_one_far_away_is_simulated_as_often_as_that_shows_unless_it_may_touch_what_is_not() {
    let steps_ms = |report: &Value| ["a", "b", "c", "outside"].map(|name| number(agent(report, name), "/dt_ms"));
    assert_eq!(steps_ms(&drifting("", 5.0)), [5.0; 4]);
    // 12 triangles on 200 pixels, over which a ball takes ten seconds: the longest step that the scene allows
    assert_eq!(steps_ms(&drifting(GROUP, 5.0)), [50.0, 50.0, 50.0, 5.0]);
    assert_eq!(steps_ms(&drifting(GROUP, 0.401)), [5.0; 4]);
}

/// Walks, and frames a second at which time is short in them.
const WALKS: [(&str, &str); 3] = [("walkthrough", "60"), ("grove", "100"), ("auditorium", "100")];

fn budget(scene: &str, frame_hz: &str, seconds: &str, more: [&str; 2]) -> Value {
    let target = format!("target.frame_hz={frame_hz}");
    lockstep(scene, &[&["--seconds", seconds, "--set", &target], &more[..]].concat())["budget"].clone()
}

#[test]
fn the_motion_of_the_camera_counts_in_a_walk() {
    for (scene, frame_hz) in &WALKS[1..] {
        let triangles = |motion: &str| {
            let found = budget(scene, frame_hz, "8", ["--set", motion]);
            found["primitives"]["triangles"].as_f64().expect("frames were drawn")
        };
        assert_ne!(triangles("target.motion=0"), triangles("target.motion=1"), "{scene}");
    }
}

#[test]
fn no_policy_lets_levels_come_and_go_in_a_walk() {
    let policies =
        ["greedy", "greedy-incremental", "hierarchical", "robin-hood", "convex", "marginal-stop", "adaptive"];
    for (scene, frame_hz) in WALKS {
        for policy in policies {
            let found = budget(scene, frame_hz, "6", ["--policy", policy]);
            let share = found["reversals"].as_f64().expect("objects were in view");
            assert!(share <= 0.005, "{scene}, {policy}: {share}");
        }
    }
}
