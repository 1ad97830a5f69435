//! Meshes, trees and groups: their keys in scenes, and their pictures against closed forms.

use crate::adapter::gpu;
use glam::{DQuat, DVec3};
use image::RgbaImage;
use metachron_core::{AgentId, Body, CurveState, Resolution, SimTime, Snapshot};
use metachron_drawable::{Generator, Model, Placement, ProgressiveMesh, TreeSpec, generate, tree};
use metachron_render::{
    Actor, Appearance, Camera, Form, Level, Material, MeshKey, Offscreen, RendererOptions, SceneView, Shading, Size,
    States, Style,
};
use metachron_scene::Source;
use metachron_world::Scene;
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

const SIZE: Size = Size { width: 320, height: 240 };
const OPTIONS: RendererOptions = RendererOptions { samples: 1, shadow_px: 512, shadow_taps: 1, lean: false };
const FOV_RAD: f64 = 0.6;

fn load(text: &str) -> Result<Scene, String> {
    let source = Source::memory("test", text.as_bytes()).expect("short and UTF-8");
    metachron_scene::load(&source, &[]).map_err(|error| {
        let told = error.problems.iter().map(|p| format!("{}; {}; {}", p.message, p.expected, p.text));
        told.collect::<Vec<_>>().join("\n")
    })
}

const HALL: &str = r#"
format = 1
[[object]]
name = "seat"
model = "mesh"
generate = "seat"
triangles = 200
grid = [24, 16, 1]
spacing_m = [0.6, -0.9, 0]
rise_m = [0, 0.15]
[[object]]
name = "oak"
model = "tree"
height_m = 6.0
grid = [20, 30, 1]
spacing_m = [5, 5, 0]
[[group]]
name = "back"
members = ["seat-38*", "oak-7"]
"#;

#[test]
fn a_few_lines_make_rows_of_seats_and_a_wood() {
    let scene = load(HALL).unwrap();
    let seats: Vec<_> = scene.scenery.iter().filter(|s| s.name.starts_with("seat")).collect();
    assert_eq!(seats.len(), 384);
    assert_eq!(scene.scenery.len(), 384 + 2 * 600);
    let last = seats.iter().find(|s| s.name == "seat-383").unwrap();
    assert!(last.at.position.distance(DVec3::new(23.0 * 0.6, -15.0 * 0.9, 15.0 * 0.15)) < 1e-12);
    let shared = seats.iter().all(|s| s.model.is(&seats[0].model));
    assert!(shared && seats[0].model.range().1.abs_diff(200) <= 2, "{:?}", seats[0].model.range());
}

#[test]
fn members_of_a_group_stand_side_by_side_and_a_proxy_stands_for_them() {
    let scene = load(HALL).unwrap();
    let group = &scene.groups[0];
    let members: Vec<&str> = scene.scenery[group.members.clone()].iter().map(|s| s.name.as_str()).collect();
    assert_eq!(members, ["seat-38", "seat-380", "seat-381", "seat-382", "seat-383", "oak-7", "oak-7.leaves"]);
    let all: u32 = scene.scenery[group.members.clone()].iter().map(|s| s.model.range().1).sum();
    let most = group.proxy.model.range().1;
    assert!(most <= all / 20 + 1 && most > all / 30, "{most} of {all}");
}

#[test]
fn wrong_scenery_is_refused_where_it_stands() {
    let mesh = |more: &str| format!("format = 1\n[[object]]\nname = \"a\"\nmodel = \"mesh\"\n{more}\n");
    let cases = [
        (mesh(""), "expected `file` or `generate`"),
        (mesh("file = \"a.obj\"\ngenerate = \"sphere\""), "contradicts `file`"),
        (mesh("file = \"none.glb\""), "none.glb"),
        (mesh("generate = \"cube\""), "cube"),
        (mesh("generate = \"sphere\"\ntriangles = 2"), "a number from 4"),
        (mesh("generate = \"sphere\"\nmass_kg = 2"), "mass_kg"),
        (mesh("generate = \"sphere\"\nscale = -1"), "`scale`"),
        (mesh("seed = 3\nfile = \"x.obj\""), "`seed`"),
        (mesh("generate = \"sphere\"\n[[group]]\nname = \"g\"\nmembers = [\"b\"]"), "does not exist"),
        (mesh("generate = \"sphere\"\n[[group]]\nname = \"a\"\nmembers = [\"a\"]"), "the name of another object"),
        (
            mesh(
                "generate = \"sphere\"\n[[group]]\nname = \"g\"\nmembers = [\"a\"]\n[[group]]\nname = \"h\"\nmembers = [\"a\"]",
            ),
            "another group",
        ),
        ("format = 1\n[[object]]\nname = \"t\"\nmodel = \"tree\"\nheight_m = 0\n".to_owned(), "`height_m`"),
        (
            "format = 1\n[[object]]\nname = \"t\"\nmodel = \"tree\"\nheight_m = 3\nleaves_colour = \"green\"\n"
                .to_owned(),
            "#rrggbb",
        ),
    ];
    for (text, expected) in cases {
        let told = load(&text).expect_err(&text);
        assert!(told.contains(expected), "{text}\n{told}");
    }
}

struct Studio {
    offscreen: Offscreen,
    camera: Camera,
}

impl Studio {
    fn new(eye: DVec3, look_at: DVec3) -> Option<Self> {
        let offscreen = Offscreen::new(gpu()?, SIZE, OPTIONS).expect("a small target");
        Some(Self { offscreen, camera: Camera::looking(eye, look_at, FOV_RAD) })
    }

    fn draw(&mut self, stage: &mut SceneView, levels: &[Level]) -> RgbaImage {
        stage.survey(&self.camera, SIZE);
        let picture = stage.compose(&self.camera, levels, Style::default(), None);
        self.offscreen.render(picture, &self.camera).expect("a picture");
        self.offscreen.read_back().expect("pixels")
    }

    /// The colours of all pixels that the objects cover.
    fn covered(&mut self, stage: &mut SceneView, levels: &[Level]) -> Vec<[u8; 4]> {
        let none: Vec<Level> = levels.iter().map(|level| Level { triangles: 0, ..*level }).collect();
        let (with, without) = (self.draw(stage, levels), self.draw(stage, &none));
        with.pixels().zip(without.pixels()).filter(|(a, b)| a != b).map(|(a, _)| a.0).collect()
    }
}

fn stage(models: &[Model], scale: f64) -> SceneView {
    let appearance = Appearance { colour: [230, 60, 40], material: Material::Skin };
    let at = Placement { position: DVec3::ZERO, rotation: DQuat::IDENTITY, scale };
    let actor =
        |(id, model): (u32, &Model)| Actor { id: AgentId(id), form: Form::Scenery(model.clone(), at), appearance };
    SceneView::new((0..).zip(models).map(actor).collect(), vec![])
}

fn level(triangles: u32, shading: Shading) -> Level {
    Level { triangles, shading, ..Resolution { eps_m: 1.0, n: 3 }.into() }
}

fn ball(triangles: u32) -> Model {
    Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(Generator::Sphere, 0, triangles)).expect("a sphere")))
}

#[test]
fn a_sphere_at_any_count_covers_the_disc_less_what_its_chords_cut_off() {
    let (distance, radius) = (4.0, 0.8);
    let Some(mut studio) = Studio::new(DVec3::NEG_Y * distance, DVec3::ZERO) else { return };
    let mut stage = stage(&[ball(6000)], radius);
    let pixels_per_tan = f64::from(SIZE.height) / (2.0 * (FOV_RAD / 2.0).tan());
    let disc = PI * (pixels_per_tan * (radius / distance).asin().tan()).powi(2);
    let mut before = 0.0;
    for triangles in [24, 60, 200, 1000, 6000] {
        let share = studio.covered(&mut stage, &[level(triangles, Shading::PerPixel)]).len() as f64 / disc;
        // the outline of n equal triangles has about √(1.36 n) corners, k of which cut 6.6/k² off a disc; the order is greedy and
        // the outline no great circle: half as much again and a pixel of the rim are left to it
        let rim = 2.0 * (PI / disc).sqrt();
        let least = 1.0 - 1.5 * 6.6 / (1.36 * f64::from(triangles)) - rim;
        assert!(share > least && share < 1.0 + rim, "{triangles}: {share}, at least {least}");
        assert!(share > before - rim, "{triangles}: {share} after {before}");
        before = share;
    }
}

#[test]
fn flat_shading_has_at_most_one_colour_a_triangle() {
    let Some(mut studio) = Studio::new(DVec3::new(0.5, -4.0, 1.0), DVec3::ZERO) else { return };
    let mut stage = stage(&[ball(2000)], 0.9);
    let mut colours = |shading| studio.covered(&mut stage, &[level(80, shading)]).into_iter().collect::<BTreeSet<_>>();
    let flat = colours(Shading::Flat).len();
    assert!((10..=80).contains(&flat), "{flat}");
    assert!(colours(Shading::Gouraud).len() > 4 * flat);
}

#[test]
fn a_tube_of_flat_shading_has_at_most_one_colour_a_triangle() {
    let Some(mut studio) = Studio::new(DVec3::new(0.5, -3.0, 1.0), DVec3::new(0.5, 0.0, 0.0)) else { return };
    let appearance = Appearance { colour: [230, 60, 40], material: Material::Tissue };
    let mut stage = SceneView::new(vec![Actor { id: AgentId(0), form: Form::Tube, appearance }], vec![]);
    let arc_m: Vec<f64> = (0..=20).map(|i| f64::from(i) * 0.05).collect();
    let body = Body::Curve(CurveState {
        positions: arc_m.iter().map(|&s| DVec3::new(s, 0.0, 0.2 * (5.0 * s).sin())).collect(),
        velocities: vec![DVec3::ZERO; 21],
        frames: vec![DQuat::from_rotation_arc(DVec3::Z, DVec3::X); 20],
        radii_m: vec![0.1; 21],
        flattening_m: vec![],
        arc_m,
    });
    stage.set_snapshot(AgentId(0), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
    stage.pose(SimTime::ZERO, States::Latest);
    let at = Resolution { eps_m: 0.25, n: 2 };
    let mut colours = |shading| {
        let levels = [Level { shading, ..at.into() }];
        studio.covered(&mut stage, &levels).into_iter().collect::<BTreeSet<_>>().len() as u64
    };
    let (flat, gouraud, fine) = (colours(Shading::Flat), colours(Shading::Gouraud), colours(Shading::PerPixel));
    // 4 intervals of 48 triangles and two balls at the ends
    let triangles = stage.compose(&studio.camera, &[at.into()], Style::default(), None).triangles();
    assert!(flat > 20 && flat <= triangles && gouraud > 4 * flat && fine > 4 * flat, "{flat} {gouraud} {fine}");
}

/// Mean absolute difference of two pictures over all channels of all pixels.
fn difference(a: &RgbaImage, b: &RgbaImage) -> f64 {
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(x, y)| u64::from(x.abs_diff(*y))).sum();
    sum as f64 / a.as_raw().len() as f64
}

#[test]
fn a_change_of_level_that_glides_is_seen_less_from_frame_to_frame_and_ends_at_the_plain_level() {
    let Some(mut studio) = Studio::new(DVec3::new(0.5, -4.0, 1.0), DVec3::ZERO) else { return };
    let bumps = Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(Generator::Blob, 5, 4000)).expect("a blob")));
    // a second mesh that stays: the first may be drawn with a twentieth of both beyond the triangles that were asked
    // for
    let crowd = Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(Generator::Terrain, 5, 40_000)).expect("hills")));
    let mut stage = stage(&[bumps, crowd], 0.9);
    let levels = |triangles| [level(triangles, Shading::PerPixel), level(40_000, Shading::PerPixel)];
    for (from, to) in [(120, 900), (900, 120)] {
        let (before, after) = (studio.draw(&mut stage, &levels(from)), studio.draw(&mut stage, &levels(to)));
        let jump = difference(&before, &after);
        studio.draw(&mut stage, &levels(from));
        stage.set_geomorph_frames(6);
        let mut frames = vec![before];
        frames.extend((0..6).map(|_| studio.draw(&mut stage, &levels(to))));
        stage.set_geomorph_frames(0);
        let steps: Vec<f64> = frames.windows(2).map(|pair| difference(&pair[0], &pair[1])).collect();
        // six equal steps of the way, of which outlines and lights of a few pixels make more than a sixth
        assert!(steps.iter().all(|step| *step < 0.5 * jump), "{from} to {to}: {steps:?} of {jump}");
        assert_eq!(frames[6], after, "{from} to {to}");
    }
}

#[test]
fn shadings_agree_where_triangles_are_small() {
    let Some(mut studio) = Studio::new(DVec3::new(0.5, -4.0, 1.0), DVec3::ZERO) else { return };
    let mut stage = stage(&[ball(40_000)], 0.9);
    let mut mean = |shading| {
        let covered = studio.covered(&mut stage, &[level(40_000, shading)]);
        covered.iter().flat_map(|c| &c[..3]).map(|&x| f64::from(x)).sum::<f64>() / (3 * covered.len()) as f64
    };
    let fine = mean(Shading::PerPixel);
    for shading in [Shading::Flat, Shading::Gouraud] {
        // a triangle is a few pixels: the pictures differ by where its colour is taken
        assert!((mean(shading) / fine - 1.0).abs() < 0.02, "{shading:?}: {} and {fine}", mean(shading));
    }
}

#[test]
fn a_tree_of_points_and_lines_covers_about_what_the_whole_tree_does() {
    let Some(mut studio) = Studio::new(DVec3::new(0.0, -30.0, 4.0), DVec3::new(0.0, 0.0, 2.5)) else { return };
    let spec = TreeSpec { seed: 3, height_m: 5.0, branches: 62, leaves: 240, prefix: false };
    let parts = tree(&spec).map(|foliage| Model::Foliage(Arc::new(foliage)));
    let mut stage = stage(&parts, 1.0);
    let mut covered = |trunk, leaves| {
        studio.covered(&mut stage, &[level(trunk, Shading::PerPixel), level(leaves, Shading::PerPixel)]).len() as f64
    };
    let whole = covered(620, 480);
    assert!(whole > 300.0, "{whole}");
    for (trunk, leaves) in [(124, 240), (124, 60), (60, 20)] {
        let share = covered(trunk, leaves) / whole;
        // few large points overlap less
        assert!((0.7..1.4).contains(&share), "{trunk} and {leaves}: {share}");
    }
    // from strokes alone to all in full in twelve steps, near enough for lines of two pixels
    let steps: Vec<f64> = (0..=12).map(|k| covered(124 + 496 * k / 12, 240 + 20 * k) / whole).collect();
    let most = steps.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(most < 0.05, "{steps:?}");
}

#[test]
fn thick_boughs_and_thin_ones_are_drawn_at_once_each_by_its_width() {
    let spec = TreeSpec { seed: 3, height_m: 5.0, branches: 62, leaves: 240, prefix: false };
    let parts = tree(&spec).map(|foliage| Model::Foliage(Arc::new(foliage)));
    let mut stage = stage(&parts[..1], 1.0);
    let mut runs = |distance: f64| {
        let camera = Camera::looking(DVec3::new(0.0, -distance, 2.0), DVec3::new(0.0, 0.0, 2.0), FOV_RAD);
        stage.survey(&camera, Size { width: 1280, height: 960 });
        let picture = stage.compose(&camera, &[level(230, Shading::PerPixel)], Style::default(), None);
        picture.solids.iter().fold((0, 0), |(full, lines), run| match run.kind.mesh {
            MeshKey::Pieces(_, triangles) => (full + triangles, lines),
            MeshKey::Strokes(_, _, triangles) => (full, lines + triangles),
            _ => (full, lines),
        })
    };
    // (230 - 2 · 62)/8 boughs in full, and near by the boughs of more than 20 pixels, which leave fewer lines to the
    // others
    let all = [40.0, 14.0, 12.0, 10.0, 9.0, 8.0, 7.0].map(&mut runs);
    assert_eq!(all[0], (130, 98));
    assert!(all.iter().all(|(full, lines)| full + lines <= 230) && all.is_sorted_by_key(|(full, _)| *full), "{all:?}");
    assert!(all.iter().any(|(full, lines)| *full > 130 && *lines > 0), "{all:?}");
}

#[test]
fn copies_of_a_mesh_at_one_count_are_one_draw() {
    let scene = load(HALL).unwrap();
    let appearance = Appearance { colour: [200; 3], material: Material::Plastic };
    let actors = scene.scenery.iter().enumerate().map(|(id, it)| Actor {
        id: AgentId(id as u32),
        form: Form::Scenery(it.model.clone(), it.at),
        appearance,
    });
    let mut stage = SceneView::new(actors.collect(), vec![]);
    let camera = Camera::looking(DVec3::new(-60.0, -60.0, 60.0), DVec3::new(50.0, 70.0, 0.0), 1.4);
    stage.survey(&camera, SIZE);
    let levels: Vec<Level> = scene.scenery.iter().map(|_| level(100, Shading::PerPixel)).collect();
    let picture = stage.compose(&camera, &levels, Style::default(), None);
    assert_eq!(picture.solids.len(), 3, "{:?}", picture.solids); // seats, trunks, leaves
    assert!(picture.instances.len() > 1000);
}
