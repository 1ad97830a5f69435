//! An agent is simulated as finely as somebody can see it, and comes back without a jump.

use crate::play::{Folder, lockstep};
use serde_json::Value;

/// A soft tube that hangs from two pins; the camera looks at it, at `away` between 1 and 6 s, and at it again.
fn hanging(away: &str) -> String {
    format!(
        "[target]\nframe_hz = 30.0\n[camera]\n\
         keyframe = [\n\
           {{ at_s = 0, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n{{ at_s = 1, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n\
           {{ at_s = 1.1, {away} }},\n{{ at_s = 6, {away} }},\n\
           {{ at_s = 6.1, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n{{ at_s = 10, eye_m = [0, -1.5, 0], look_at_m = [0, 0, 0] }},\n\
         ]\n\
         [[object]]\nname = \"hose\"\nmodel = \"tube\"\npath_m = [[-0.4, 0, 0], [0, 0, -0.2], [0.4, 0, 0]]\n\
         radius_m = 0.012\nwall_m = 0.003\nyoung_pa = 5.0e5\ndensity_kg_m3 = 1050.0\nself_contact = false\nsleep = false\n\
         damping_per_s = 8.0\npin = [\"start\", \"end\"]\nrate_hz = 100.0\neps_m = [0.01, 0.1]\nn = [0, 2]\n\
         [[probe]]\nobject = \"hose\"\nat = 0.5\nevery_ms = 10.0\n"
    )
}

fn play(away: &str, seconds: &str) -> Value {
    let folder = Folder::with(&hanging(away));
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
    assert_eq!(eps_m(&play(BEHIND, "1.5")), 0.01, "a glance aside changes nothing");
    assert_eq!(eps_m(&play(BEHIND, "5")), 0.1);
    let back = play(BEHIND, "9");
    assert_eq!(eps_m(&back), 0.01);
    // from a tenth of a metre to a hundredth and back: the middle moves by less than the finer of the two
    assert!(leap_m(&back, 0.9) < 0.01, "{}", leap_m(&back, 0.9));
}

#[test]
fn far_away_a_tube_is_as_fine_as_a_pixel_is_wide() {
    // 720 rows over 40 degrees, 60 m away less the radius of the ball around it
    let pixel_m = |depth_m: f64| depth_m * 2.0 * (20.0_f64).to_radians().tan() / 720.0;
    let eps_m = eps_m(&play(FAR, "5"));
    assert!(eps_m < pixel_m(60.0) && eps_m > pixel_m(59.0), "{eps_m}, {}", pixel_m(60.0));
}
