//! The camera: an orbit about a target with z up, its projection, rays and frustum.
//!
//! In: drags and keys as numbers. Out: matrices, rays, pixels. Never here: the GPU, input devices, scenes.
//! Depth is reversed and without a far plane, which spreads the floating-point precision evenly over depth.

use glam::{DMat4, DVec2, DVec3, DVec4, Mat4};
use std::f64::consts::TAU;

/// A picture's size in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Size {
    /// Whether it has no pixels.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// The size at `scale` times the width and height, rounded; a side that there is keeps a pixel.
    #[must_use]
    pub fn scaled(self, scale: f64) -> Self {
        // a cast of floats saturates
        let side = |pixels: u32| ((f64::from(pixels) * scale).round() as u32).max(pixels.min(1));
        Self { width: side(self.width), height: side(self.height) }
    }

    fn aspect(self) -> f64 {
        f64::from(self.width.max(1)) / f64::from(self.height.max(1))
    }
}

/// A half line in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start, metres.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

/// A camera on a sphere about its target; z is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The target, metres.
    pub target_m: DVec3,
    /// Distance of the eye from the target, metres; clamped to 1 cm … 10 km.
    pub distance_m: f64,
    /// Direction of the eye from the target, about z from x, radians.
    pub yaw_rad: f64,
    /// Elevation of the eye above the horizon, radians; clamped to ± a right angle less a degree.
    pub pitch_rad: f64,
    /// Vertical field of view, radians, 0.01 … 3.
    pub fov_y_rad: f64,
}

/// Least and greatest distance of the eye from its target, metres.
pub const DISTANCE_M: (f64, f64) = (0.01, 1e4);
/// A turn by more than this between two frames counts as a jump: an eighth of a turn, radians.
const JUMP_RAD: f64 = TAU / 8.0;
/// The steepest view: a view straight up or down has no horizon to keep level.
pub const PITCH_MAX_RAD: f64 = 1.553;
/// Distance of the near plane, as a fraction of the distance to the target.
const NEAR_SHARE: f64 = 0.01;

impl Camera {
    /// A camera at `eye_m` that looks at `target_m`; `fov_y_rad` is the vertical field of view.
    /// An eye at its target is moved 1 m along x.
    #[must_use]
    pub fn looking(eye_m: DVec3, target_m: DVec3, fov_y_rad: f64) -> Self {
        let arm = eye_m - target_m;
        let distance = arm.length();
        let arm = if distance > 0.0 && distance.is_finite() { arm / distance } else { DVec3::X };
        Self {
            target_m,
            distance_m: if distance > 0.0 { distance.clamp(DISTANCE_M.0, DISTANCE_M.1) } else { 1.0 },
            yaw_rad: arm.y.atan2(arm.x),
            pitch_rad: arm.z.asin().clamp(-PITCH_MAX_RAD, PITCH_MAX_RAD),
            fov_y_rad: fov_y_rad.clamp(0.01, 3.0),
        }
    }

    /// Extrapolates the motion from `before` to this camera by `times` that change, turning about its target as it did.
    /// A camera that jumped (by more than half its distance, or an eighth of a turn) is returned unchanged.
    #[must_use]
    pub fn extrapolated(&self, before: &Self, times: f64) -> Self {
        let way = self.target_m - before.target_m;
        let turned = libm::remainder(self.yaw_rad - before.yaw_rad, TAU);
        let tilted = self.pitch_rad - before.pitch_rad;
        let nearer = self.distance_m - before.distance_m;
        if self.has_jumped(before) || !(times > 0.0 && times.is_finite()) {
            return *self;
        }
        Self {
            target_m: self.target_m + way * times,
            distance_m: (self.distance_m + nearer * times).clamp(DISTANCE_M.0, DISTANCE_M.1),
            yaw_rad: self.yaw_rad + turned * times,
            pitch_rad: (self.pitch_rad + tilted * times).clamp(-PITCH_MAX_RAD, PITCH_MAX_RAD),
            fov_y_rad: self.fov_y_rad,
        }
    }

    /// Whether it is elsewhere than a motion from `before` could have brought it within a frame.
    #[must_use]
    pub fn has_jumped(&self, before: &Self) -> bool {
        let turned = libm::remainder(self.yaw_rad - before.yaw_rad, TAU).abs();
        let tilted = (self.pitch_rad - before.pitch_rad).abs();
        let nearer = (self.distance_m - before.distance_m).abs();
        let way = (self.target_m - before.target_m).length().max(nearer);
        way > 0.5 * self.distance_m || turned.max(tilted) > JUMP_RAD
    }

    /// A point in the camera's axes, metres: to the right, to the top, forward.
    pub(crate) fn seen(&self, point_m: DVec3) -> DVec3 {
        let from_eye = point_m - self.eye();
        DVec3::new(from_eye.dot(self.right()), from_eye.dot(self.up()), from_eye.dot(self.forward()))
    }

    /// From the target to the eye, a unit vector.
    fn arm(&self) -> DVec3 {
        let (sin, cos) = self.pitch_rad.sin_cos();
        DVec3::new(cos * self.yaw_rad.cos(), cos * self.yaw_rad.sin(), sin)
    }

    /// Position of the eye, metres.
    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.target_m + self.arm() * self.distance_m
    }

    /// The direction of view, a unit vector.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        -self.arm()
    }

    /// To the right of the picture, a unit vector.
    #[must_use]
    pub fn right(&self) -> DVec3 {
        DVec3::new(-self.yaw_rad.sin(), self.yaw_rad.cos(), 0.0)
    }

    /// To the top of the picture, a unit vector.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        self.right().cross(self.forward())
    }

    /// Distance of the near plane, metres.
    #[must_use]
    pub fn near_m(&self) -> f64 {
        (self.distance_m * NEAR_SHARE).min(0.1)
    }

    /// Turns the eye about the target for a drag by `pixels` over a picture of `size`: the full height is half a turn.
    pub fn orbit(&mut self, pixels: DVec2, size: Size) {
        let turn = std::f64::consts::PI / f64::from(size.height.max(1));
        self.yaw_rad = (self.yaw_rad - pixels.x * turn).rem_euclid(std::f64::consts::TAU);
        self.pitch_rad = (self.pitch_rad + pixels.y * turn).clamp(-PITCH_MAX_RAD, PITCH_MAX_RAD);
    }

    /// Moves eye and target so that the point under the pointer, at the target's distance, stays under it.
    pub fn pan(&mut self, pixels: DVec2, size: Size) {
        let scale = 1.0 / self.pixels_per_metre(self.distance_m, size);
        self.target_m += (self.up() * pixels.y - self.right() * pixels.x) * scale;
    }

    /// Moves the eye nearer (`factor` < 1) or away (> 1). A factor that is not above zero is ignored.
    pub fn zoom(&mut self, factor: f64) {
        if factor > 0.0 && factor.is_finite() {
            self.distance_m = (self.distance_m * factor).clamp(DISTANCE_M.0, DISTANCE_M.1);
        }
    }

    /// Moves eye and target by `step_m`: x to the right, y forward, z up the picture, metres.
    pub fn fly(&mut self, step_m: DVec3) {
        self.target_m += self.right() * step_m.x + self.forward() * step_m.y + self.up() * step_m.z;
    }

    /// Targets a ball of `radius_m` about `centre_m` so that it fills the picture.
    pub fn show(&mut self, centre_m: DVec3, radius_m: f64, size: Size) {
        let half = 0.5 * self.fov_y_rad;
        let half = half.min((half.tan() * size.aspect()).atan());
        self.target_m = centre_m;
        self.distance_m = (radius_m / half.sin()).clamp(DISTANCE_M.0, DISTANCE_M.1);
    }

    /// Pixels per metre across the view at `depth_m` in front of the eye.
    #[must_use]
    pub fn pixels_per_metre(&self, depth_m: f64, size: Size) -> f64 {
        f64::from(size.height) / (2.0 * (0.5 * self.fov_y_rad).tan() * depth_m.max(self.near_m()))
    }

    /// From world axes relative to `origin` to clip space, depth reversed.
    #[must_use]
    pub fn view_projection(&self, size: Size, origin: DVec3) -> Mat4 {
        self.matrix(size, origin).as_mat4()
    }

    fn matrix(&self, size: Size, origin: DVec3) -> DMat4 {
        let eye = self.eye() - origin;
        let view = glam::dcamera::rh::view::look_to_mat4(eye, self.forward(), self.up());
        glam::dcamera::rh::proj::directx::perspective_infinite_reverse(self.fov_y_rad, size.aspect(), self.near_m())
            * view
    }

    /// The pixel of a point, from the picture's upper left corner, and its depth in metres; `None` if nearer than the near plane or behind.
    #[must_use]
    pub fn project(&self, point_m: DVec3, size: Size) -> Option<(DVec2, f64)> {
        let depth = (point_m - self.eye()).dot(self.forward());
        if depth < self.near_m() {
            return None;
        }
        let clip: DVec4 = self.matrix(size, DVec3::ZERO) * point_m.extend(1.0);
        let ndc = clip.truncate() / clip.w;
        let half = DVec2::new(f64::from(size.width), f64::from(size.height)) * 0.5;
        Some((DVec2::new(1.0 + ndc.x, 1.0 - ndc.y) * half, depth))
    }

    /// The ray from the eye through a pixel, counted from the picture's upper left corner.
    #[must_use]
    pub fn ray(&self, pixel: DVec2, size: Size) -> Ray {
        let half = DVec2::new(f64::from(size.width.max(1)), f64::from(size.height.max(1))) * 0.5;
        let tan = (0.5 * self.fov_y_rad).tan();
        let (x, y) = ((pixel.x / half.x - 1.0) * tan * size.aspect(), (1.0 - pixel.y / half.y) * tan);
        let direction = (self.forward() + self.right() * x + self.up() * y).normalize();
        Ray { origin: self.eye(), direction }
    }

    /// The view volume of a picture of this size.
    #[must_use]
    pub fn frustum(&self, size: Size) -> Frustum {
        let tan_y = (0.5 * self.fov_y_rad).tan();
        let tan_x = tan_y * size.aspect();
        let (forward, side) = (self.forward(), |across: DVec3, tan: f64| (across, tan, (1.0 + tan * tan).sqrt()));
        let sides = [side(self.right(), tan_x), side(self.up(), tan_y)];
        Frustum { eye: self.eye(), forward, near_m: self.near_m(), sides }
    }
}

/// How a camera moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMotion {
    /// Where it was, and where it is.
    pub cameras: [Camera; 2],
    /// Time in between, seconds, > 0.
    pub seconds: f64,
}

impl CameraMotion {
    /// The motion from `before` to `now` in so many seconds; `None` where it rests or has jumped, and of no time.
    #[must_use]
    pub fn between(before: Camera, now: Camera, seconds: f64) -> Option<Self> {
        let moves = before != now && !now.has_jumped(&before) && seconds > 0.0 && seconds.is_finite();
        moves.then_some(Self { cameras: [before, now], seconds })
    }

    /// Velocity of a resting point in the camera's axes (right, top, forward), m/s.
    pub(crate) fn drift(&self, point_m: DVec3) -> DVec3 {
        let [before, now] = self.cameras.map(|camera| camera.seen(point_m));
        (now - before) / self.seconds
    }
}

/// The view volume of a camera.
#[derive(Debug, Clone, Copy)]
pub struct Frustum {
    eye: DVec3,
    forward: DVec3,
    near_m: f64,
    /// Right and up: the direction, the tangent of half the angle of view in it, and one over that angle's cosine.
    sides: [(DVec3, f64, f64); 2],
}

impl Frustum {
    /// Whether a ball may be visible: it is not wholly outside any side of the view.
    #[must_use]
    pub fn sees(&self, centre_m: DVec3, radius_m: f64) -> bool {
        let from_eye = centre_m - self.eye;
        let depth = from_eye.dot(self.forward);
        let beside =
            |&(across, tan, secant): &(DVec3, f64, f64)| from_eye.dot(across).abs() - depth * tan > radius_m * secant;
        depth + radius_m > self.near_m && !self.sides.iter().any(beside)
    }

    /// Position of the eye, metres.
    pub(crate) fn eye(&self) -> DVec3 {
        self.eye
    }

    /// The direction of view, a unit vector, and the distance of the near plane, metres.
    pub(crate) fn near(&self) -> (DVec3, f64) {
        (self.forward, self.near_m)
    }

    /// Unit normals, inwards, of its sides: planes through the eye.
    pub(crate) fn sides(&self) -> [DVec3; 4] {
        let [(right, tan_x, secant_x), (up, tan_y, secant_y)] = self.sides;
        let side = |across: DVec3, tan: f64, secant: f64| (self.forward * tan + across) / secant;
        [
            side(right, tan_x, secant_x),
            side(-right, tan_x, secant_x),
            side(up, tan_y, secant_y),
            side(-up, tan_y, secant_y),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { width: 1280, height: 720 };

    fn camera() -> Camera {
        Camera::looking(DVec3::new(1.0, -2.0, 1.5), DVec3::new(0.1, 0.2, 0.3), 0.8)
    }

    #[test]
    fn camera_looks_from_its_eye_at_its_target() {
        let camera = camera();
        assert!((camera.eye() - DVec3::new(1.0, -2.0, 1.5)).length() < 1e-12);
        let (pixel, depth) = camera.project(camera.target_m, SIZE).unwrap();
        assert!((pixel - DVec2::new(640.0, 360.0)).length() < 1e-9);
        assert!((depth - camera.distance_m).abs() < 1e-12);
    }

    #[test]
    fn a_ray_through_a_projected_point_passes_through_the_point() {
        let camera = camera();
        let point = DVec3::new(0.4, 0.1, -0.2);
        let ray = camera.ray(camera.project(point, SIZE).unwrap().0, SIZE);
        let off = (point - ray.origin).cross(ray.direction).length();
        assert!(off < 1e-12, "{off}");
    }

    #[test]
    fn a_camera_in_steady_motion_is_extrapolated_exactly() {
        // once around in 7 s while the distance shrinks and the target drifts
        let at = |s: f64| Camera {
            target_m: DVec3::new(0.1 * s, 0.0, 1.0),
            distance_m: 3.0 - 0.2 * s,
            yaw_rad: libm::remainder(TAU * s / 7.0, TAU),
            ..camera()
        };
        for s in [0.5, 3.49, 3.51, 6.0] {
            let seen = at(s).extrapolated(&at(s - 0.02), 1.5);
            assert!((seen.eye() - at(s + 0.03).eye()).length() < 1e-9, "{s}");
        }
        let cut = Camera { yaw_rad: at(1.0).yaw_rad + 2.0, ..at(1.0) };
        assert_eq!(cut.extrapolated(&at(0.98), 1.5), cut);
        assert_eq!(at(1.0).extrapolated(&at(0.98), f64::NAN), at(1.0));
    }

    #[test]
    fn panning_keeps_the_point_under_the_pointer() {
        let mut camera = camera();
        let (point, drag) = (camera.target_m, DVec2::new(50.0, -20.0));
        camera.pan(drag, SIZE);
        let moved = camera.project(point, SIZE).unwrap().0 - DVec2::new(640.0, 360.0);
        assert!((moved - drag).length() < 1e-9, "{moved}");
    }

    #[test]
    fn a_framed_object_is_visible_and_one_behind_the_camera_is_not() {
        let mut camera = camera();
        camera.show(DVec3::ZERO, 0.5, SIZE);
        assert!(camera.frustum(SIZE).sees(DVec3::ZERO, 0.5));
        let side = camera.right() * (3.0 * camera.distance_m);
        let view = camera.frustum(SIZE);
        assert!(!view.sees(side, 0.5) && view.sees(side, 4.0 * camera.distance_m));
        assert!(!view.sees(camera.eye() - camera.forward(), 0.5));
        let top = camera.project(camera.up() * 0.5, SIZE).unwrap().0;
        assert!(top.y > 0.0 && top.y < 60.0, "{top}");
    }

    #[test]
    fn a_camera_stays_finite_under_any_drag_or_zoom() {
        let mut camera = camera();
        for pixels in [1e9, -1e9, 0.0] {
            camera.orbit(DVec2::splat(pixels), SIZE);
            camera.zoom(pixels);
            camera.orbit(DVec2::ONE, Size { width: 0, height: 0 });
        }
        assert!(
            camera.eye().is_finite() && camera.view_projection(Size { width: 0, height: 0 }, DVec3::ZERO).is_finite()
        );
    }
}
