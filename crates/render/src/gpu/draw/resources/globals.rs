//! The uniforms that every shader of a frame shares, and the light of an environment as shader source.
//!
//! In: a picture and a camera. Out: one uniform block. Never here: the GPU.

use crate::composition::environment::{Environment, EnvironmentLight};
use crate::composition::light_volume::LightColumn;
use crate::composition::picture::{Colouring, FloorDraw, Picture};
use crate::gpu::draw::Target;
use crate::seen::view::{Camera, Size};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// The uniform block, laid out as the shaders' `Globals`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Globals {
    view_projection: [f32; 16],
    light_projection: [f32; 16],
    eye: [f32; 4],
    texel: [f32; 4],
    focus: [f32; 4],
    viewport: [f32; 4],
    floor_point: [f32; 4],
    floor_normal: [f32; 4],
    floor_colour: [f32; 4],
    patch_centre: [f32; 4],
    patch_x: [f32; 4],
    patch_y: [f32; 4],
    view_forward: [f32; 4],
    view_right: [f32; 4],
    view_up: [f32; 4],
    materials: [[f32; 4]; 8],
}

/// Approximate direction of the lamp's long side.
const LAMP_SIDE: DVec3 = DVec3::new(0.79, 0.61, 0.0);

/// Two rows per material, in the order of `Material`: wrap, reflectance, width and gain of the sharp lobe; width and gain of the broad
/// lobe, mirror, metal. Widths are squares of the roughness.
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

/// The constants of an environment's light, as shader source: constants cost a software rasteriser nothing.
pub fn light_source(environment: Environment) -> String {
    let EnvironmentLight { toward, key, sky, ground, lamp, at_camera, far_share, fades } =
        EnvironmentLight::of(environment);
    let lamp_x = (LAMP_SIDE - toward * LAMP_SIDE.dot(toward)).normalize();
    let line = |name, v: DVec3| format!("const {name} = vec3f({:.9}, {:.9}, {:.9});\n", v.x, v.y, v.z);
    [
        line("LIGHT", toward),
        line("LAMP_X", lamp_x),
        line("LAMP_Y", toward.cross(lamp_x)),
        line("KEY", key),
        line("SKY", sky),
        line("GROUND", ground),
        line("LAMP", lamp),
        format!("const FAR_SHARE = {far_share:.9};\nconst AT_CAMERA = {at_camera};\nconst FADES = {fades};\n"),
    ]
    .concat()
}

impl Globals {
    /// The block of one frame.
    pub fn new(picture: &Picture, camera: &Camera, target: Target<'_>, shadow_px: u32) -> Self {
        let Target { size, shown, .. } = target;
        let frame = LightFrame::new(picture, shadow_px);
        let focus = picture.focus_m - picture.origin;
        let radius = picture.focus_radius_m;
        let four = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
        let stripes = f64::from(picture.style.colouring == Colouring::Resolution);
        let pixel = 1.0 / camera.pixels_per_metre(1.0, size);
        let floor = picture.floor.as_ref();
        let colour = floor.map_or([0; 3], |f| f.colour).map(|c| (f64::from(c) / 255.0).powf(2.2));
        let patch = floor.map_or_else(Patch::default, |floor| frame.patch(floor, picture.origin));
        let reach = patch.reach(floor.map_or(focus, |f| f.below(focus)), floor_reach(picture) * radius);
        // half the picture's width and height one metre away
        let half =
            DVec2::new(f64::from(shown.width), f64::from(shown.height)) * (0.5 / camera.pixels_per_metre(1.0, shown));
        Self {
            view_projection: camera.view_projection(shown, picture.origin).to_cols_array(),
            light_projection: frame.projection(picture.origin).as_mat4().to_cols_array(),
            eye: four(camera.eye() - picture.origin, frame.texel_m),
            texel: [1.0 / shadow_px as f32, camera.distance_m as f32, 0.0, 0.0],
            focus: four(focus, radius),
            viewport: DVec4::new(f64::from(size.width), f64::from(size.height), stripes, pixel).as_vec4().to_array(),
            floor_point: four(floor.map_or(DVec3::ZERO, |f| f.point), 0.0),
            floor_normal: four(floor.map_or(DVec3::Z, |f| f.normal), 0.0),
            floor_colour: four(DVec3::from(colour), frame.range_m),
            patch_centre: four(patch.centre, reach),
            patch_x: four(patch.x, 0.0),
            patch_y: four(patch.y, 0.0),
            view_forward: four(camera.forward(), 0.0),
            view_right: four(camera.right() * half.x, 0.0),
            view_up: four(camera.up() * half.y, 0.0),
            materials: MATERIALS,
        }
    }
}

impl FloorDraw {
    /// The point of the floor nearest to `point`.
    fn below(&self, point: DVec3) -> DVec3 {
        point - self.normal * (point - self.point).dot(self.normal)
    }
}

/// Beyond this many radii of the focus the floor is as dark as the room behind it, or has faded into the horizon of the open sky; the shaders
/// use the same numbers.
const FLOOR_REACH: f64 = 2.8;
const FLOOR_REACH_OPEN: f64 = 300.0;

/// How far the floor of a picture reaches, radii of the focus.
fn floor_reach(picture: &Picture) -> f64 {
    if EnvironmentLight::of(picture.environment).fades { FLOOR_REACH } else { FLOOR_REACH_OPEN }
}

/// Whether every pixel that nothing else covers shows the floor before it has faded into the room.
///
/// The visible part of a plane is convex if all four corners show it, and so is the disc that has not faded.
pub fn floor_fills(picture: &Picture, camera: &Camera, size: Size) -> bool {
    let Some(floor) = &picture.floor else { return false };
    let centre = floor.below(picture.focus_m - picture.origin);
    let (width, height) = (f64::from(size.width), f64::from(size.height));
    [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)].into_iter().all(|(x, y)| {
        let ray = camera.ray(DVec2::new(x, y), size);
        let eye = ray.origin - picture.origin;
        let along = (floor.point - eye).dot(floor.normal) / ray.direction.dot(floor.normal);
        along > 0.0 && (eye + ray.direction * along).distance(centre) < floor_reach(picture) * picture.focus_radius_m
    })
}

/// The column of light, aligned to the texels of a shadow map.
struct LightFrame {
    column: LightColumn,
    /// The centre of the map in world axes: across the light in whole texels, so that shadow edges do not crawl.
    middle: DVec3,
    texel_m: f64,
    /// Range of the depths, metres.
    range_m: f64,
}

impl LightFrame {
    fn new(picture: &Picture, shadow_px: u32) -> Self {
        let column = LightColumn::of(picture);
        let texel_m = 2.0 * column.half_m / f64::from(shadow_px);
        let snapped = |axis: DVec3| axis * ((column.middle.dot(axis) / texel_m).round() * texel_m);
        let along = column.light * column.middle.dot(column.light);
        let middle = snapped(column.right) + snapped(column.up) + along;
        Self { column, middle, texel_m, range_m: column.reach_m.0 + column.reach_m.1 }
    }

    /// From positions relative to `origin` to the shadow map's texture coordinates and depths.
    fn projection(&self, origin: DVec3) -> DMat4 {
        let (middle, column) = (self.middle - origin, &self.column);
        let row = |axis: DVec3, scale: f64, offset: f64| (axis * scale).extend(offset - axis.dot(middle) * scale);
        let scale = 0.5 / column.half_m;
        DMat4::from_cols(
            row(column.right, scale, 0.5),
            row(column.up, -scale, 0.5),
            row(column.light, -1.0 / self.range_m, column.reach_m.0 / self.range_m),
            DVec4::W,
        )
        .transpose()
    }

    /// The column's section with the floor; at grazing light it is taken along the floor's normal instead, as it would grow without bound.
    fn patch(&self, floor: &FloorDraw, origin: DVec3) -> Patch {
        let LightColumn { light, right, up, half_m, .. } = self.column;
        let slope = light.dot(floor.normal);
        let along = if slope > GRAZING { light / slope } else { floor.normal };
        let slide = |v: DVec3| v - along * v.dot(floor.normal);
        let centre = self.middle - origin;
        Patch {
            centre: centre - along * (centre - floor.point).dot(floor.normal),
            x: slide(right) * (2.0 * half_m),
            y: slide(-up) * (2.0 * half_m),
        }
    }
}

/// Cosine of the angle between light and a floor's normal below which light counts as grazing.
const GRAZING: f64 = 0.15;

/// The part of the floor that shadows can fall on: a parallelogram by its centre and sides, metres.
#[derive(Default)]
struct Patch {
    centre: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Patch {
    /// The factor by which it must grow to hold all of the floor that has not faded, at least 1.
    fn reach(&self, floor_centre: DVec3, floor_m: f64) -> f64 {
        let inscribed = 0.5 * self.x.cross(self.y).length() / self.x.length().max(self.y.length());
        let wanted = floor_m + self.centre.distance(floor_centre);
        let reach = wanted / inscribed;
        if reach > 1.01 && reach.is_finite() { reach } else { 1.01 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::light_volume::REACH;

    fn picture() -> Picture {
        let focus_m = DVec3::new(3.2, -1.0, 0.4);
        Picture {
            focus_m,
            origin: DVec3::new(3.0, -1.0, 0.0),
            focus_radius_m: 0.7,
            shadowed_m: (focus_m - DVec3::new(0.3, 0.2, 0.1), focus_m + DVec3::new(0.3, 0.2, 0.1)),
            floor: Some(FloorDraw { point: DVec3::ZERO, normal: DVec3::Z, colour: [0; 3] }),
            ..Picture::default()
        }
    }

    #[test]
    fn the_shadow_map_holds_the_box_of_all_that_casts() {
        let picture = picture();
        let frame = LightFrame::new(&picture, 1024);
        let projection = frame.projection(picture.origin);
        let at = projection.transform_point3(picture.focus_m - picture.origin);
        // snapped to whole texels: off by at most half a texel
        assert!((at.x - 0.5).abs() <= 0.5 / 1024.0 + 1e-12 && (at.y - 0.5).abs() <= 0.5 / 1024.0 + 1e-12, "{at}");
        assert!((at.z - REACH.0 / (REACH.0 + REACH.1)).abs() < 1e-12, "{at}");
        let nearer = projection.transform_point3(picture.focus_m - picture.origin + frame.column.light * 0.7);
        assert!(nearer.z < at.z);
        let (low, high) = picture.shadowed_m;
        for i in 0..8 {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let at = projection.transform_point3(DVec3::new(pick(0), pick(1), pick(2)) - picture.origin);
            // again half a texel of snapping
            assert!((at.truncate() - 0.5).abs().max_element() <= 0.5 + 0.5 / 1024.0, "{at}");
        }
    }

    #[test]
    fn the_floors_patch_is_what_the_shadow_map_cuts_out_of_it() {
        let picture = picture();
        let frame = LightFrame::new(&picture, 512);
        let floor = picture.floor.unwrap();
        let patch = frame.patch(&floor, picture.origin);
        let projection = frame.projection(picture.origin);
        for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            let corner = patch.centre + patch.x * x + patch.y * y;
            assert!((corner - floor.point).dot(floor.normal).abs() < 1e-12, "{corner}"); // f64, sizes of a metre
            let at = projection.transform_point3(corner).truncate();
            assert!((at - DVec2::new(0.5 + x, 0.5 + y)).length() < 1e-12, "{at}");
        }
    }

    #[test]
    fn the_floor_fills_the_view_from_above_and_not_over_its_edge() {
        let (picture, size) = (picture(), Size { width: 1280, height: 720 });
        let from = |eye: DVec3| Camera::looking(picture.focus_m + eye, picture.focus_m, 0.6);
        assert!(floor_fills(&picture, &from(DVec3::new(0.1, -0.5, 1.0)), size));
        assert!(!floor_fills(&picture, &from(DVec3::new(0.0, -1.5, 0.1)), size)); // the horizon is in view
        assert!(!floor_fills(&picture, &from(DVec3::new(0.0, -0.5, 20.0)), size)); // the floor's end is in view too
    }
}
