//! Camera paths: keys with a position and a direction, linear between them.
//!
//! In: keys and a frame. Out: a camera. Never here: what it sees.

use glam::DVec3;
use metachron_render::Camera;

/// Position and direction of the eye at a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Key {
    pub(crate) frame: usize,
    pub(crate) eye_m: [f64; 3],
    /// About z from x, degrees; 360 more adds a whole turn before this key.
    pub(super) yaw_deg: f64,
    /// Above the horizon, degrees.
    pub(super) pitch_deg: f64,
}

/// A path through a scene, and the vertical field of view along it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Path {
    pub(crate) keys: Vec<Key>,
    pub(crate) fov_y_deg: f64,
}

/// A key in one line.
pub(crate) const fn key(frame: usize, eye_m: [f64; 3], yaw_deg: f64, pitch_deg: f64) -> Key {
    Key { frame, eye_m, yaw_deg, pitch_deg }
}

impl Path {
    /// The camera at a frame; before the first key and after the last it does not move.
    pub(crate) fn camera(&self, frame: usize) -> Camera {
        let after = self.keys.partition_point(|k| k.frame <= frame);
        let from = self.keys[after.saturating_sub(1)];
        let to = self.keys[after.min(self.keys.len() - 1)];
        let span = to.frame.saturating_sub(from.frame);
        // exact at a key: a camera that does not move must not jitter by rounding
        let part = if span > 0 { frame.saturating_sub(from.frame) as f64 / span as f64 } else { 0.0 };
        let between = |a: f64, b: f64| a + (b - a) * part;
        let (yaw, pitch) = (between(from.yaw_deg, to.yaw_deg), between(from.pitch_deg, to.pitch_deg));
        let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
        let ahead = DVec3::new(libm::cos(yaw) * libm::cos(pitch), libm::sin(yaw) * libm::cos(pitch), libm::sin(pitch));
        let eye = DVec3::from(from.eye_m).lerp(DVec3::from(to.eye_m), part);
        Camera::looking(eye, eye + ahead, self.fov_y_deg.to_radians())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn camera_turns_evenly_between_keys_and_stands_still_at_the_ends() {
        let path =
            Path { keys: vec![key(10, [0.0; 3], 0.0, 0.0), key(16, [6.0, 0.0, 0.0], 180.0, 0.0)], fov_y_deg: 60.0 };
        assert!(path.camera(0).forward().distance(DVec3::X) < 1e-12);
        assert!(path.camera(13).forward().distance(DVec3::Y) < 1e-12);
        assert!(path.camera(13).eye().distance(DVec3::X * 3.0) < 1e-12);
        assert!(path.camera(99).forward().distance(-DVec3::X) < 1e-12);
    }
}
