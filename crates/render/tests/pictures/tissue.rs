//! Soft bodies of tissue: mottled and veined as tubes are, with a texture that keeps to their matter.

use crate::adapter::gpu;
use glam::DVec3;
use image::RgbaImage;
use metachron_core::{AgentId, Body, Resolution, SimTime, Snapshot, SoftState};
use metachron_drawable::{Generator, generate_surface};
use metachron_geometry::{CollisionShape, ShapeKind, SurfaceShape};
use metachron_render::{
    Actor, Appearance, Camera, Environment, Form, Gpu, Level, Material, Offscreen, RendererOptions, SceneView, Shading,
    Size, SkinForm, States, Style,
};
use std::sync::Arc;

const SIZE: Size = Size { width: 160, height: 160 };

/// A soft ball of a material, moved from where it is at rest.
fn draw(gpu: &Gpu, material: Material, shading: Shading, moved: DVec3) -> RgbaImage {
    draw_part(gpu, Level { shading, ..Resolution { eps_m: 0.01, n: 3 }.into() }, (material, moved), |_| true)
}

/// The same without the triangles at whose middles `is_left` is not true.
fn draw_part(
    gpu: &Gpu,
    level: Level,
    (material, moved): (Material, DVec3),
    is_left: impl Fn(DVec3) -> bool,
) -> RgbaImage {
    let made = generate_surface(Generator::Sphere, 0, 3000);
    let surface = SurfaceShape {
        vertices: (0..made.points.len() as u32).collect(),
        edges: [].into(),
        triangles: made.triangles.into(),
        fans: Arc::default(),
        radius_m: 0.0,
        edge_m: 0.1,
        closed: true,
    };
    let middle = |corners: &&[u32; 3]| corners.iter().map(|at| made.points[*at as usize]).sum::<DVec3>() / 3.0;
    let left = surface.triangles.iter().filter(|corners| is_left(middle(corners))).copied().collect();
    let carved = SurfaceShape { triangles: left, ..surface.clone() };
    let form = Form::Skin(SkinForm::new(surface, &made.points));
    let appearance = Appearance { colour: [150, 60, 55], material };
    let mut stage = SceneView::new(vec![Actor { id: AgentId(0), form, appearance }], vec![]);
    stage.set_shape(AgentId(0), &CollisionShape::new(ShapeKind::Surface(carved), 0.0));
    stage.set_environment(Environment::Endoscope);
    let positions: Vec<DVec3> = made.points.iter().map(|p| *p + moved).collect();
    let body = Body::Soft(SoftState { velocities: vec![DVec3::ZERO; positions.len()], positions, nodes: None });
    stage.set_snapshot(AgentId(0), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
    stage.pose(SimTime::ZERO, States::Latest);
    let camera = Camera::looking(moved + DVec3::new(0.6, -3.0, 1.0), moved, 0.6);
    stage.survey(&camera, SIZE);
    let options = RendererOptions { samples: 1, shadow_px: 256, shadow_taps: 1, lean: true };
    let mut offscreen = Offscreen::new(gpu.clone(), SIZE, options).expect("a small target");
    offscreen.render(stage.compose(&camera, &[level], Style::default(), None), &camera).expect("a picture");
    offscreen.read_back().expect("pixels")
}

/// Mean difference of the red of neighbouring pixels in the middle of a picture, in steps of 1/255.
fn roughness(image: &RgbaImage) -> f64 {
    let red = |x: u32, y: u32| f64::from(image.get_pixel(x, y).0[0]);
    let pixels = (50..110).flat_map(|y| (50..110).map(move |x| (x, y)));
    pixels.map(|(x, y)| (red(x + 1, y) - red(x, y)).abs()).sum::<f64>() / 3600.0
}

#[test]
fn a_soft_body_of_tissue_is_mottled_where_it_is_textured_and_plastic_is_smooth() {
    let Some(gpu) = gpu() else { return };
    let roughness_of = |material, shading| roughness(&draw(&gpu, material, shading, DVec3::ZERO));
    for shading in [Shading::Textured, Shading::Shadowed] {
        let [tissue, plastic] = [Material::Tissue, Material::Plastic].map(|material| roughness_of(material, shading));
        // plastic differs by the slope of its light alone; measured 2.6 times as much
        assert!(tissue > 2.0 * plastic, "{shading:?}: {tissue}, {plastic}");
    }
    let [tissue, plastic] =
        [Material::Tissue, Material::Plastic].map(|material| roughness_of(material, Shading::PerPixel));
    assert!(tissue < 1.3 * plastic, "without its texture: {tissue}, {plastic}");
}

#[test]
fn the_texture_of_a_soft_body_moves_with_it() {
    let Some(gpu) = gpu() else { return };
    let [here, there] =
        [DVec3::ZERO, DVec3::new(3.0, -2.0, 1.0)].map(|moved| draw(&gpu, Material::Tissue, Shading::Textured, moved));
    let worst = here.as_raw().iter().zip(there.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
    // positions are relative to whole metres: the same numbers
    assert!(worst.is_some_and(|worst| worst <= 2), "{worst:?}");
}

#[test]
fn a_body_from_which_matter_was_taken_is_drawn_without_its_triangles() {
    let Some(gpu) = gpu() else { return };
    let level = Level { shading: Shading::PerPixel, ..Resolution { eps_m: 0.01, n: 0 }.into() };
    let drawn = |least_m: f64| draw_part(&gpu, level, (Material::Plastic, DVec3::ZERO), |middle| middle.z > least_m);
    let [whole, upper, none] = [-2.0, 0.0, 2.0].map(drawn);
    let same = |a: &RgbaImage, b: &RgbaImage, y: u32| (60..100).all(|x| a.get_pixel(x, y) == b.get_pixel(x, y));
    // the camera looks a little from above: the upper half is above the middle, below it there is nothing but the
    // background
    assert!(same(&whole, &upper, 50) && !same(&whole, &none, 50), "the upper half");
    assert!(same(&upper, &none, 135) && !same(&whole, &none, 135), "the lower half");
}
