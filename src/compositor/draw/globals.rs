//! The numbers every shader of a frame shares, and the light.
//!
//! In: a picture and a camera. Out: one uniform block. Never here: the GPU.

use super::super::picture::{Colouring, Picture};
use super::super::view::{Camera, Size};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4};

/// The uniform block, laid out as the shaders' `Globals`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Globals {
    view_projection: [f32; 16],
    light_projection: [f32; 16],
    eye: [f32; 4],
    light: [f32; 4],
    focus: [f32; 4],
    viewport: [f32; 4],
    floor_point: [f32; 4],
    floor_normal: [f32; 4],
    floor_colour: [f32; 4],
    lamp_x: [f32; 4],
    lamp_y: [f32; 4],
    materials: [[f32; 4]; 8],
}

/// Towards the key light: over the left shoulder of who stands at −y.
const LIGHT: DVec3 = DVec3::new(-0.36, -0.30, 0.883);

/// Direction of the lamp's long side, roughly.
const LAMP_SIDE: DVec3 = DVec3::new(0.79, 0.61, 0.0);

/// How far the shadow's depths reach towards the light and away from it, in radii of the focus: shafts stand high.
const REACH: (f64, f64) = (2.5, 1.5);

/// Two rows a material, in the order of `Material`: wrap, reflectance, width and gain of the sharp lobe; width and gain of the
/// broad lobe, mirror, metal. Widths are squares of the roughness.
const MATERIALS: [[f32; 4]; 8] = [
    [0.38, 0.055, 0.0025, 34.0],
    [0.0500, 3.0, 1.25, 0.0],
    [0.00, 0.600, 0.0100, 2.2],
    [0.1000, 0.6, 1.50, 1.0],
    [0.10, 0.042, 0.0120, 12.0],
    [0.0900, 2.2, 0.65, 0.0],
    [0.34, 0.030, 0.0300, 2.5],
    [0.1800, 1.6, 0.20, 0.0],
];

impl Globals {
    /// The block of one frame.
    pub fn new(picture: &Picture, camera: &Camera, size: Size, shadow_px: u32) -> Self {
        let light = LIGHT.normalize();
        let focus = picture.focus_m - picture.origin;
        let radius = picture.focus_radius_m;
        let texel_m = 2.0 * radius / f64::from(shadow_px);
        let projection = light_projection(light, picture.focus_m, picture.origin, (radius, texel_m));
        let four = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
        let stripes = f64::from(picture.style.colouring == Colouring::Resolution);
        let lamp_x = (LAMP_SIDE - light * LAMP_SIDE.dot(light)).normalize();
        let floor = picture.floor.as_ref();
        let colour = floor.map_or([0; 3], |f| f.colour).map(|c| (f64::from(c) / 255.0).powf(2.2));
        Self {
            view_projection: camera.view_projection(size, picture.origin).to_cols_array(),
            light_projection: projection.as_mat4().to_cols_array(),
            eye: four(camera.eye() - picture.origin, texel_m),
            light: four(light, 1.0 / f64::from(shadow_px)),
            focus: four(focus, radius),
            viewport: DVec4::new(f64::from(size.width), f64::from(size.height), stripes, 0.0).as_vec4().to_array(),
            floor_point: four(floor.map_or(DVec3::ZERO, |f| f.point), 0.0),
            floor_normal: four(floor.map_or(DVec3::Z, |f| f.normal), 0.0),
            floor_colour: four(DVec3::from(colour), (REACH.0 + REACH.1) * radius),
            lamp_x: four(lamp_x, 0.0),
            lamp_y: four(light.cross(lamp_x), 0.0),
            materials: MATERIALS,
        }
    }
}

/// From positions relative to `origin` to the shadow map's texture coordinates and depths.
///
/// The map's centre moves in whole texels, so that shadows do not crawl when the focus moves.
fn light_projection(light: DVec3, focus_m: DVec3, origin: DVec3, (radius, texel_m): (f64, f64)) -> DMat4 {
    let right = DVec3::Z.cross(light).normalize();
    let up = light.cross(right);
    let snapped = |axis: DVec3| (focus_m.dot(axis) / texel_m).round() * texel_m - origin.dot(axis);
    let (x, y, z) = (snapped(right), snapped(up), (focus_m - origin).dot(light));
    let range = (REACH.0 + REACH.1) * radius;
    let row = |axis: DVec3, scale: f64, offset: f64| (axis * scale).extend(offset);
    let half = 0.5 / radius;
    DMat4::from_cols(
        row(right, half, 0.5 - x * half),
        row(up, -half, 0.5 + y * half),
        row(light, -1.0 / range, (z + REACH.0 * radius) / range),
        DVec4::W,
    )
    .transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_focus_lies_in_the_middle_of_the_shadow_map() {
        let (focus, origin, radius) = (DVec3::new(3.2, -1.0, 0.4), DVec3::new(3.0, -1.0, 0.0), 0.7);
        let texel = 2.0 * radius / 1024.0;
        let projection = light_projection(LIGHT.normalize(), focus, origin, (radius, texel));
        let at = projection.transform_point3(focus - origin);
        // snapped to whole texels: at most half a texel off
        assert!((at.x - 0.5).abs() <= 0.5 / 1024.0 + 1e-12 && (at.y - 0.5).abs() <= 0.5 / 1024.0 + 1e-12, "{at}");
        assert!((at.z - REACH.0 / (REACH.0 + REACH.1)).abs() < 1e-12, "{at}");
        let nearer = projection.transform_point3(focus - origin + LIGHT.normalize() * radius);
        assert!(nearer.z < at.z);
    }
}
