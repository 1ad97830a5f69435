//! Light and shadow against Lambert's law: a lit surface that nothing shades has no dark speckles, whatever the angle of the light.

use crate::adapter::gpu;
use glam::{DQuat, DVec2, DVec3};
use image::RgbaImage;
use metachron_core::{AgentId, Body, Resolution, RigidState, SimTime, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use metachron_render::{
    Actor, Appearance, Camera, Environment, EnvironmentLight, Form, Gpu, Level, Material, Offscreen, RendererOptions,
    SceneView, Shading, Size, States, StaticObject, Style,
};
use std::sync::Arc;

const SIZE: Size = Size { width: 320, height: 320 };
/// Colour of ball and slab, sRGB, and their material.
const LOOK: Appearance = Appearance { colour: [180, 180, 180], material: Material::Skin };
/// Its wrap: light that went in comes out past the terminator.
const WRAP: f64 = 0.34;
const RADIUS_M: f64 = 0.5;

/// Drawn as on a processor and as on a graphics card.
const QUALITIES: [RendererOptions; 2] =
    [RendererOptions { samples: 1, shadow_px: 512, shadow_taps: 1, lean: true }, RendererOptions::STILL];

/// With one comparison of the shadow map a pixel, and with a soft rim.
fn draw(gpu: &Gpu, stage: &mut SceneView, camera: &Camera, options: RendererOptions) -> [RgbaImage; 2] {
    stage.set_environment(Environment::Sky);
    stage.pose(SimTime::ZERO, States::Latest);
    stage.survey(camera, SIZE);
    let mut offscreen = Offscreen::new(gpu.clone(), SIZE, options).expect("a small target");
    let level = Level::from(Resolution { eps_m: 0.01, n: 6 });
    [level.shading, Shading::Shadowed].map(|shading| {
        let level = Level { shading, ..level };
        offscreen.render(stage.compose(camera, &[level], Style::default(), None), camera).expect("a picture");
        offscreen.read_back().expect("pixels")
    })
}

/// The green of a matt surface under the sun, by Lambert's law with wrapped light and the light from all around, 0 … 255.
fn lambert(n: DVec3) -> f64 {
    let light = EnvironmentLight::of(Environment::Sky);
    let linear = |c: f64| c * c * (c * 0.305306 + 0.682171) + c * 0.0125229;
    let albedo = linear(f64::from(LOOK.colour[1]) / 255.0);
    let cos = n.dot(light.toward);
    let faced = cos.clamp(0.0, 1.0);
    let bleed = 0.42 * (((cos + WRAP) / (1.0 + WRAP)).clamp(0.0, 1.0) - faced);
    let x = (albedo * (light.key.y * (faced + bleed) * 0.42 + light.ambient(n).y) * 0.92 - 0.004).max(0.0);
    255.0 * (x * (6.2 * x + 0.5)) / (x * (6.2 * x + 1.7) + 0.06)
}

/// How much darker a pixel is than the median of its neighbours, which are dark by themselves only in larger places.
fn speckle(image: &RgbaImage, x: u32, y: u32) -> f64 {
    let green = |dx: u32, dy: u32| image.get_pixel(x + dx - 1, y + dy - 1).0[1];
    let mut around: Vec<u8> = (0..9).map(|i| green(i % 3, i / 3)).collect();
    around.sort_unstable();
    f64::from(around[4]) - f64::from(green(1, 1))
}

/// The largest distance from Lambert's law, in steps of 1/255 below it, and the darkest speckle, over the pixels whose normals `at` gives;
/// and how many pixels these are.
fn worst(image: &RgbaImage, at: impl Fn(DVec2) -> Option<DVec3>) -> (f64, f64, u32) {
    let (mut below, mut speckled, mut count) = (0.0_f64, 0.0_f64, 0);
    for (x, y) in (1..SIZE.height - 1).flat_map(|y| (1..SIZE.width - 1).map(move |x| (x, y))) {
        let Some(n) = at(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)) else { continue };
        below = below.max(lambert(n) - f64::from(image.get_pixel(x, y).0[1]));
        speckled = speckled.max(speckle(image, x, y));
        count += 1;
    }
    (below, speckled, count)
}

fn obstacle(solid: Solid, position: DVec3, rotation: DQuat) -> Obstacle {
    Obstacle { position, rotation, ..Obstacle::new("still", solid) }
}

#[test]
fn a_ball_is_as_bright_as_lambert_s_law_up_to_its_terminator() {
    let Some(gpu) = gpu() else { return };
    let light = EnvironmentLight::of(Environment::Sky).toward;
    // half of the visible part of it is lit: from across the light
    let camera = Camera::looking(light.cross(DVec3::Z).normalize() * 3.0, DVec3::ZERO, 0.4);
    for (options, far_m) in QUALITIES.into_iter().flat_map(|options| [(options, 0.0), (options, 8.0)]) {
        // a ball far away makes the texels of the shadow map large: 16 across the ball's radius on a processor
        let (solid, position) = (Solid::Ball { radius_m: 0.05 }, camera.forward() * far_m);
        let far = StaticObject {
            obstacle: obstacle(solid, position, DQuat::IDENTITY),
            appearance: LOOK,
            throws_shadow: true,
        };
        let actor = Actor { id: AgentId(0), form: Form::Solid(Solid::Ball { radius_m: RADIUS_M }), appearance: LOOK };
        let mut stage = SceneView::new(vec![actor], vec![far]);
        let body = Body::Rigid(RigidState::default());
        stage.set_snapshot(AgentId(0), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
        let images = draw(&gpu, &mut stage, &camera, options);
        let normal = |pixel: DVec2| {
            let ray = camera.ray(pixel, SIZE);
            let along = -ray.origin.dot(ray.direction);
            let nearest = ray.origin + ray.direction * along;
            let inside = RADIUS_M * RADIUS_M - nearest.length_squared();
            let n = (nearest - ray.direction * inside.max(0.0).sqrt()) / RADIUS_M;
            // not at the rim, where a pixel is partly of the background, nor past the terminator
            (inside > 0.0 && n.dot(-ray.direction) > 0.3 && n.dot(light) > 0.03).then_some(n)
        };
        for image in &images {
            let (below, speckled, count) = worst(image, normal);
            assert!(count > 10_000, "{count} pixels");
            // the film of water adds light and takes none
            assert!(below < 4.0 && speckled < 4.0, "{options:?}: {below} below Lambert, speckles of {speckled}");
        }
    }
}

#[test]
fn a_plane_under_a_low_light_is_evenly_lit() {
    let Some(gpu) = gpu() else { return };
    let light = EnvironmentLight::of(Environment::Sky).toward;
    for height in [0.06_f64, 0.2, 0.6] {
        let level = light.cross(DVec3::Z).normalize();
        // the plane's normal is so far above the light's horizon
        let n = light * height + light.cross(level).normalize() * (1.0 - height * height).sqrt();
        let rotation = DQuat::from_rotation_arc(DVec3::Z, n);
        let camera = Camera::looking(n * 3.0 + level * 0.7, DVec3::ZERO, 0.3);
        for options in QUALITIES {
            let solid = Solid::Box { half_extents_m: DVec3::new(1.0, 1.0, 0.05) };
            let slab =
                StaticObject { obstacle: obstacle(solid, n * -0.05, rotation), appearance: LOOK, throws_shadow: true };
            for image in draw(&gpu, &mut SceneView::new(vec![], vec![slab]), &camera, options) {
                let (below, speckled, count) = worst(&image, |_| Some(n));
                assert!(count > 100_000, "it fills the picture");
                assert!(below < 4.0 && speckled < 4.0, "{height}, {options:?}: {below} below, speckles of {speckled}");
            }
        }
    }
}
