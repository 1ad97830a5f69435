//! Paint on meshes: patterns, images beside a scene and inside a .glb file, and the errors of wrong ones.

use crate::adapter::gpu;
use glam::{DQuat, DVec3};
use image::{ImageFormat, Rgba, RgbaImage};
use metachron_core::{AgentId, Resolution};
use metachron_drawable::{Generator, Model, Pattern, Placement, ProgressiveMesh, Texture, Wrap, generate};
use metachron_render::{
    Actor, Appearance, Camera, Form, Gpu, Level, Material, Offscreen, RendererOptions, SceneView, Shading, Size, Style,
};
use metachron_scene::Source;
use metachron_world::Scene;
use metachron_world::kinds::ShadingKind;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

const SIZE: Size = Size { width: 240, height: 240 };
const OPTIONS: RendererOptions = RendererOptions { samples: 1, shadow_px: 512, shadow_taps: 1, lean: true };

/// A mesh with a texture, seen from −y.
fn draw(gpu: &Gpu, (model, texture): (&Model, &Arc<Texture>), shading: Shading) -> RgbaImage {
    let appearance = Appearance { colour: [255; 3], material: Material::Skin };
    let at = Placement { position: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: 1.0 };
    let mut stage =
        SceneView::new(vec![Actor { id: AgentId(0), form: Form::Scenery(model.clone(), at), appearance }], vec![]);
    stage.paint(AgentId(0), texture);
    let camera = Camera::looking(DVec3::NEG_Y * 5.0, DVec3::ZERO, 0.3);
    stage.survey(&camera, SIZE);
    let level = Level { shading, ..Resolution { eps_m: 1.0, n: 3 }.into() };
    let mut screen = Offscreen::new(gpu.clone(), SIZE, OPTIONS).expect("a small target");
    let picture = stage.compose(&camera, &[level], Style::default(), None);
    screen.render(picture, &camera).expect("a picture");
    screen.read_back().expect("pixels")
}

/// Mean and standard deviation of the green of the middle of a picture.
fn middle(picture: &RgbaImage) -> (f64, f64) {
    let greens = || (80..160).flat_map(|y| (80..160).map(move |x| f64::from(picture.get_pixel(x, y).0[1])));
    let mean = greens().sum::<f64>() / 6400.0;
    (mean, (greens().map(|g| (g - mean).powi(2)).sum::<f64>() / 6400.0).sqrt())
}

#[test]
fn a_pattern_is_seen_where_it_is_drawn_and_only_its_mean_where_it_is_not() {
    let Some(gpu) = gpu() else { return };
    let model = Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(Generator::Sphere, 0, 5000)).expect("a sphere")));
    let texture = Arc::new(Pattern::Checker.texture(0.4));
    let [plain, painted] = [Shading::PerPixel, Shading::Textured].map(|s| middle(&draw(&gpu, (&model, &texture), s)));
    // squares of light 0.73 and 0.08 in turns about their mean; the light on the middle of a ball changes slowly
    assert!(painted.1 > 2.5 * plain.1, "{plain:?} {painted:?}");
    // tones are compressed: the mean of two tones lies below the tone of the mean light
    assert!(painted.0 < plain.0 && painted.0 > 0.7 * plain.0, "{plain:?} {painted:?}");
}

fn png(image: &RgbaImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).expect("a PNG in memory");
    bytes.into_inner()
}

/// A square of side 2 in glTF's x and y that faces its +z, with an image on it: the file.
fn glb(image: &[u8]) -> Vec<u8> {
    let points = [[-1.0_f32, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let places = [[0.0_f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let corners: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut data: Vec<u8> =
        points.iter().flatten().chain(places.iter().flatten()).flat_map(|x| x.to_le_bytes()).collect();
    data.extend(corners.iter().flat_map(|i| i.to_le_bytes()));
    data.extend_from_slice(image);
    let (whole, length) = (data.len(), image.len());
    data.resize(whole.next_multiple_of(4), 0);
    let mut text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"bufferView":3,"mimeType":"image/png"}}],
        "buffers":[{{"byteLength":{whole}}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
        {{"buffer":0,"byteOffset":80,"byteLength":12}},{{"buffer":0,"byteOffset":92,"byteLength":{length}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
        {{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}]}}"#
    )
    .into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    for word in [2, (28 + text.len() + data.len()) as u32, text.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(&text);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(&data);
    bytes
}

fn load(folder: &Path, object: &str) -> Result<Scene, String> {
    let path = folder.join("scene.toml");
    let text = format!("format = 1\n[[object]]\nname = \"a\"\nmodel = \"mesh\"\n{object}\n");
    std::fs::write(&path, text).expect("a folder of our own");
    let source = Source::open(&path.to_string_lossy()).expect("the file just written");
    metachron_scene::load(&source, &[]).map_err(|error| {
        let told = error.problems.iter().map(|p| format!("{}; {}", p.message, p.expected));
        told.collect::<Vec<_>>().join("\n")
    })
}

/// Red on the left, blue on the right, darker above.
fn quarters() -> RgbaImage {
    RgbaImage::from_fn(64, 64, |x, y| {
        let strength = if y < 32 { 120 } else { 240 };
        if x < 32 { Rgba([strength, 0, 0, 255]) } else { Rgba([0, 0, strength, 255]) }
    })
}

/// Draws a scene's only mesh, a square of side 2 that faces −y, and looks for [`quarters`] on it.
fn shows_quarters(scene: &Scene) {
    let it = &scene.scenery[0];
    assert_eq!((it.appearance.shading, it.appearance.colour), (ShadingKind::Any, [255; 3]));
    let (Some(gpu), Some(texture)) = (gpu(), &it.texture) else { return };
    let picture = draw(&gpu, (&it.model, texture), Shading::Textured);
    let [low_left, low_right, high_left] = [(60, 180), (180, 180), (60, 60)].map(|(x, y)| picture.get_pixel(x, y).0);
    assert!(low_left[0] > 2 * low_left[2] && low_right[2] > 2 * low_right[0], "{low_left:?} {low_right:?}");
    assert!(high_left[0] > 2 * high_left[2] && high_left[0] < low_left[0], "{high_left:?} {low_left:?}");
}

#[test]
fn the_image_inside_a_glb_lies_as_its_corners_say() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("quad.glb"), glb(&png(&quarters()))).expect("a folder of our own");
    // glTF's +z, which the square faces, is −y here: towards the eye
    shows_quarters(&load(folder.path(), "file = \"quad.glb\"").unwrap());
}

#[test]
fn an_image_beside_an_obj_file_lies_as_its_corners_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let square = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.path().join("quad.obj"), square).expect("a folder of our own");
    std::fs::write(folder.path().join("quad.png"), png(&quarters())).expect("a folder of our own");
    let object = "file = \"quad.obj\"\ntexture = \"quad.png\"";
    shows_quarters(&load(folder.path(), object).unwrap());
    let wrap = |object: &str| load(folder.path(), object).unwrap().scenery[0].texture.as_ref().map(|t| t.wrap());
    assert_eq!(wrap(object), Some(Wrap::Corners));
    // a size asks for it to be laid onto the sides
    assert_eq!(wrap(&format!("{object}\ntexture_m = 0.5")), Some(Wrap::Sides(0.5)));
    assert_eq!(wrap("generate = \"sphere\"\ntexture = \"quad.png\""), Some(Wrap::Sides(1.0)));
}

#[test]
fn textures_are_shared_and_wrong_ones_refused_where_they_stand() {
    let folder = tempfile::tempdir().expect("a folder");
    let two = "generate = \"sphere\"\ntexture = \"books\"\ngrid = [2, 1, 1]\nspacing_m = [3, 0, 0]";
    let scene = load(folder.path(), two).unwrap();
    let [a, b] = [0, 1].map(|i| scene.scenery[i].texture.clone().expect("books"));
    assert!(Arc::ptr_eq(&a, &b));
    std::fs::write(folder.path().join("bad.glb"), glb(b"no image at all")).expect("a folder of our own");
    std::fs::write(folder.path().join("bad.png"), b"\x89PNG\r\n\x1a\nand then nothing").expect("a folder of our own");
    for (object, told) in [
        ("generate = \"sphere\"\ntexture = \"none.png\"", "none.png"),
        ("generate = \"sphere\"\ntexture = \"bad.png\"", "bad.png"),
        ("generate = \"sphere\"\ntexture = \"chequer\"", "`checker`"),
        ("file = \"bad.glb\"", "PNG and JPEG are supported"),
        ("generate = \"sphere\"\ntexture_m = 2", "`texture`"),
        ("generate = \"sphere\"\ntexture = \"books\"\ntexture_m = 0", "`texture_m`"),
        ("generate = \"sphere\"\nshading = \"textured\"", "expected `texture`"),
    ] {
        let said = load(folder.path(), object).expect_err(object);
        assert!(said.contains(told), "{object}\n{said}");
    }
    let other = "generate = \"sphere\"\nshading = \"flat\"\ntexture = \"planks\"\ncolour = \"#804020\"";
    let appearance = load(folder.path(), other).unwrap().scenery[0].appearance;
    assert_eq!((appearance.shading, appearance.colour), (ShadingKind::Flat, [0x80, 0x40, 0x20]));
}
