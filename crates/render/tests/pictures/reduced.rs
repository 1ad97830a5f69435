//! Pictures drawn with fewer pixels and enlarged, compared with pictures of every pixel.

use crate::adapter::gpu;
use crate::stage;
use image::RgbaImage;
use metachron_render::{Camera, Gpu, Level, Offscreen, RendererOptions, SceneView, Size, Style};

const SIZE: Size = Size { width: 320, height: 180 };
const FULL: RendererOptions = RendererOptions { samples: 1, shadow_px: 1024, shadow_taps: 4, lean: false };

/// Pictures of a stage at these scales, drawn one after the other by one renderer.
fn drawn<const N: usize>(gpu: &Gpu, stage: &mut SceneView, scene: Scene<'_>, scales: [f64; N]) -> [RgbaImage; N] {
    let mut offscreen = Offscreen::new(gpu.clone(), scene.size, scene.options).expect("a small target");
    scales.map(|scale| {
        stage.set_scale(scale);
        let picture = stage.compose(scene.camera, scene.levels, Style::default(), None);
        offscreen.render(picture, scene.camera).expect("a picture");
        offscreen.read_back().expect("pixels")
    })
}

/// A scene, and how it is drawn.
#[derive(Clone, Copy)]
struct Scene<'a> {
    camera: &'a Camera,
    levels: &'a [Level],
    size: Size,
    options: RendererOptions,
}

fn difference(a: &RgbaImage, b: &RgbaImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: f64 = a.as_raw().iter().zip(b.as_raw()).map(|(x, y)| f64::from(x.abs_diff(*y))).sum();
    sum / a.as_raw().len() as f64
}

#[test]
fn a_smooth_gradient_stays_what_it_is_at_any_scale_and_size() {
    let Some(gpu) = gpu() else { return };
    let (_, camera) = stage::still_life();
    for lean in [false, true] {
        for size in [SIZE, Size { width: 333, height: 187 }] {
            // nothing but the room
            let mut room = SceneView::new(Vec::new(), Vec::new());
            let scene = Scene { camera: &camera, levels: &[], size, options: RendererOptions { lean, ..FULL } };
            let [full, half, least] = drawn(&gpu, &mut room, scene, [1.0, 0.5, 0.35]);
            assert!(full.pixels().any(|p| p != full.get_pixel(0, 0)), "there is a gradient");
            for small in [half, least] {
                let worst = full.as_raw().iter().zip(small.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
                // both are rounded to a step of 1/255, as are the values between which is interpolated
                assert!(worst <= Some(2), "lean {lean}, {size:?}: {worst:?}");
            }
        }
    }
}

#[test]
fn an_enlarged_picture_is_nearer_the_more_pixels_are_drawn_and_the_cubic_is_nearer_than_lines() {
    let Some(gpu) = gpu() else { return };
    let (mut stage, camera) = stage::still_life();
    let levels = stage::level(0.01, 4);
    let mut errors = |lean| {
        let options = RendererOptions { lean, ..FULL };
        let scene = Scene { camera: &camera, levels: &levels, size: SIZE, options };
        let [full, ninety, half, least, again] = drawn(&gpu, &mut stage, scene, [1.0, 0.9, 0.5, 0.35, 1.0]);
        assert_eq!(full, again, "every pixel after fewer is as before");
        [ninety, half, least].map(|small| difference(&small, &full))
    };
    let (cubic, lines) = (errors(false), errors(true));
    for [ninety, half, least] in [cubic, lines] {
        assert!(ninety < half && half < least && least < 8.0, "{ninety} {half} {least}");
    }
    assert!(cubic[1] < lines[1], "{cubic:?} {lines:?}");
}
