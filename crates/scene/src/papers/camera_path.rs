//! The path of a camera through a scene, as keyframes of its file.
//!
//! In: stops with a position and a direction. Out: a `[camera]` table. Never here: the scene.

use glam::DVec3;

/// Consecutive views that differ by more than this get others between them, so that the point looked at never passes through the eye,
/// degrees.
const TURN_MOST: f64 = 45.0;
/// Distance from the eye to the point that it looks at, metres.
const AHEAD_M: f64 = 10.0;

/// Position and direction of the camera at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    /// Seconds from the start.
    pub at_s: f64,
    /// Position, metres.
    pub eye_m: DVec3,
    /// Yaw about z from x, degrees; 360 more is a full turn on the way there.
    pub yaw_deg: f64,
    /// Pitch above the horizon, degrees.
    pub pitch_deg: f64,
}

/// A path, linear from stop to stop.
#[derive(Debug, Clone)]
pub(super) struct CameraPath {
    pub stops: Vec<Stop>,
    pub fov_deg: f64,
}

/// Makes a stop.
pub(super) const fn stop(at_s: f64, [x, y, z]: [f64; 3], yaw_deg: f64, pitch_deg: f64) -> Stop {
    Stop { at_s, eye_m: DVec3::new(x, y, z), yaw_deg, pitch_deg }
}

impl CameraPath {
    /// The `[camera]` table.
    pub(super) fn text(&self) -> String {
        let mut text = format!("[camera]\nfov_deg = {:?}\neven = true\nrepeat = true\nkeyframe = [\n", self.fov_deg);
        for pair in self.stops.windows(2) {
            let turns = ((pair[1].yaw_deg - pair[0].yaw_deg).abs() / TURN_MOST).ceil().max(1.0);
            (0..turns as u32).for_each(|k| text += &key(&pair[0], &pair[1], f64::from(k) / turns));
        }
        if let Some(last) = self.stops.last() {
            text += &key(last, last, 0.0);
        }
        text + "]\n"
    }
}

fn key(from: &Stop, to: &Stop, part: f64) -> String {
    let between = |a: f64, b: f64| a + (b - a) * part;
    let (yaw, pitch) = (between(from.yaw_deg, to.yaw_deg), between(from.pitch_deg, to.pitch_deg));
    let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
    let ahead = DVec3::new(libm::cos(yaw) * libm::cos(pitch), libm::sin(yaw) * libm::cos(pitch), libm::sin(pitch));
    let eye = from.eye_m.lerp(to.eye_m, part);
    let at_s = between(from.at_s, to.at_s);
    format!(
        "    {{ at_s = {:?}, eye_m = {}, look_at_m = {} }},\n",
        rounded(at_s),
        point(eye),
        point(eye + AHEAD_M * ahead)
    )
}

/// A point as TOML, to a millimetre.
pub(super) fn point(at: DVec3) -> String {
    format!("{:?}", at.to_array().map(rounded))
}

/// To a thousandth; never −0.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3 + 0.0
}
