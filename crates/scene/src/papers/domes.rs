//! The domes of (MB97, §8): 8 spheres of 120 struts each, and a coarse sphere that replaces each from afar.
//!
//! In: nothing. Out: the scene's text. A strut has 4 to 24 triangles, so the cheapest picture without groups has the paper's 3840.
//! As in the paper the domes turn about their own axes and swing towards the viewer and away; here the camera circles them too.

use super::camera_path::{CameraPath, Stop, point};
use super::head;
use glam::DVec3;
use std::f64::consts::TAU;

/// Number of domes along x and y, and their spacing, metres.
const GRID: [u32; 2] = [2, 4];
const APART_M: [f64; 2] = [5.0, 3.4];
const FIRST_M: DVec3 = DVec3::new(-2.5, -5.1, 0.0);
/// How fast the domes turn, rad/s, and how far and how often they swing along x, towards the first place of the camera and away.
const SPIN_RAD_S: f64 = 0.5;
const SWING_M: f64 = 2.0;
const SWING_HZ: f64 = 0.125;
/// Path of the camera: seconds of one turn, number of stops, mean distance and its amplitude, metres.
const ROUND_S: f64 = 24.0;
const STOPS: u32 = 36;
const FAR_M: (f64, f64) = (13.0, 4.0);

pub(super) fn text() -> String {
    let mut text = head(
        "8 domes of 120 struts: 3840 triangles at their coarsest, and a coarse ball for each from afar (MB97).",
        "domes of struts, each of which may be drawn as one ball",
        &path(),
    );
    let [x, y] = GRID;
    text += &format!(
        r##"
[[object]]
name = "dome"
model = "mesh"
generate = "bar"
triangles = 24
least_triangles = 4
dome_m = 1.0
position_m = {}
grid = [{x}, {y}, 1]
spacing_m = [{:?}, {:?}, 0.0]
colour = "#c7b58a"
motion = {{ spin_rad_s = [0.0, 0.0, {SPIN_RAD_S:?}], swing_m = [{SWING_M:?}, 0.0, 0.0], swing_hz = {SWING_HZ:?} }}
"##,
        point(FIRST_M),
        APART_M[0],
        APART_M[1]
    );
    (0..x * y).for_each(|dome| text += &group(dome));
    text
}

fn group(dome: u32) -> String {
    let steps = DVec3::new(f64::from(dome % GRID[0]), f64::from(dome / GRID[0]), 0.0);
    let centre = FIRST_M + steps * DVec3::new(APART_M[0], APART_M[1], 0.0);
    format!(
        r#"
[[group]]
name = "ball-{dome}"
members = ["dome-{dome}-*"]
proxy = {{ generate = "sphere", triangles = 20, position_m = {} }}
"#,
        point(centre)
    )
}

fn path() -> CameraPath {
    let at = |k: u32| {
        let part = f64::from(k) / f64::from(STOPS);
        let (angle, far) = (TAU * part, FAR_M.0 + FAR_M.1 * libm::sin(3.0 * TAU * part));
        let eye_m = DVec3::new(-far * libm::cos(angle), -far * libm::sin(angle), 2.0);
        Stop { at_s: ROUND_S * part, eye_m, yaw_deg: 360.0 * part, pitch_deg: -8.0 }
    };
    CameraPath { stops: (0..=STOPS).map(at).collect(), fov_deg: 50.0 }
}
