//! Benchmark of a GPU adapter: drawing times of pictures of many equal balls, by triangles, covered pixels and shading (FS93, §4; RH05,
//! §4.1).
//!
//! In: an adapter. Out: measured pictures. Never here: a fit, a file. The benchmark takes one to three seconds on a software rasteriser
//! (CPU); no picture is begun after three seconds, the rest is left for the next run.
//!
//! All pictures are drawn once, then all once more in another order, and so on: a machine that is slower for a while
//! slows no kind of picture more than another, and the median of a picture's times does not see it.

use super::draw::RendererOptions;
use super::offscreen::{Gpu, GpuError, Offscreen};
use crate::composition::picture::Style;
use crate::seen::level::{Level, Shading};
use crate::seen::view::{Camera, Size};
use crate::states::scene_view::{Actor, Appearance, Form, Material, SceneView, States};
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Resolution, SimTime};
use metachron_drawable::{Generator, Model, Pattern, PieceKind, Placement, ProgressiveMesh, TreeSpec, generate, tree};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// One measured picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Pixels of the picture as drawn.
    pub picture_px: f64,
    /// Pixels that it was enlarged to; 0 for one that was not.
    pub enlarged_px: f64,
    /// Objects in it.
    pub objects: u32,
    /// Triangles per object.
    pub polygons: f64,
    /// Pixels that each object covers.
    pub pixels: f64,
    /// Shading of the objects.
    pub shading: Shading,
    /// The pieces that are drawn as strokes instead of shaded triangles: leaves as points, boughs as lines.
    pub strokes: Option<PieceKind>,
    /// Median of its drawing times, seconds.
    pub seconds: f64,
}

/// Pictures without an object, to measure the cost of the picture and its pixels alone.
const EMPTY: [Size; 3] =
    [Size { width: 320, height: 180 }, Size { width: 640, height: 360 }, Size { width: 960, height: 540 }];
/// A picture without an object, to measure the cost of enlarging: its size when shown, and its scale.
const ENLARGED: (Size, f64) = (Size { width: 960, height: 540 }, 0.5);
/// Pictures of balls.
const SIZE: Size = Size { width: 640, height: 360 };
/// Balls along the side of a square (few where they are large), and the most pixels that each may cover without overlapping the next.
const SQUARES: [(u32, f64); 4] = [(6, 2e3), (4, 4.4e3), (2, 17e3), (1, 60e3)];
/// Radius of a ball, and the distance between centres of neighbours, metres.
const RADIUS_M: f64 = 0.05;
const APART_M: f64 = 0.12;
/// Triangles of a ball.
const TRIANGLES: [u32; 4] = [8, 32, 128, 512];
/// Fewest pixels that a ball covers: for one area per triangle, the triangle counts that are drawn begin there …
const LEAST_PX: f64 = 100.0;
/// … and are this many.
const NUMBERS: usize = 2;
/// No picture is begun later than this after the first; the pictures measured until then are returned.
const LONGEST: Duration = Duration::from_secs(3);
/// Drawings of a picture in a round, after a first one, which makes meshes and buffers …
const DRAWINGS: usize = 2;
/// … and most rounds.
const ROUNDS: usize = 4;

/// Equal trees of which the leaves are drawn as points, or the boughs as lines: triangles of each tree's strokes, and pixels that it covers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trees {
    kind: PieceKind,
    triangles: u32,
    pixels: f64,
}

/// Triangles of a tree's strokes, and the pixels that it covers: few of both, many of one, many of both.
const STROKE_TRIANGLES: [u32; 3] = [16, 64, 256];
const STROKE_PX: [f64; 3] = [500.0, 2e3, 17e3];
/// The tree: as many leaves, and boughs, as there are triangles of the most strokes.
const TREE: TreeSpec = TreeSpec { seed: 1, height_m: 2.0 * RADIUS_M, branches: 128, leaves: 256, prefix: false };

/// Equal balls: shading, requested triangles and covered pixels of each.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Balls {
    shading: Shading,
    triangles: u32,
    pixels: f64,
}

/// A picture to draw: of this size without an object, at a scale, or balls.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TestPicture {
    Empty(Size, f64),
    Balls(Balls),
    Trees(Trees),
}

/// All pictures: balls whose triangles cover the least and the greatest area come first.
fn test_pictures(areas_px: &[f64]) -> Vec<TestPicture> {
    let of = |area_px| {
        numbers(area_px).flat_map(|(triangles, pixels)| {
            Shading::PRICED.map(|shading| TestPicture::Balls(Balls { shading, triangles, pixels }))
        })
    };
    let empty = EMPTY.map(|size| (size, 1.0)).into_iter().chain([ENLARGED]);
    let trees = [PieceKind::Leaf, PieceKind::Bough].into_iter().flat_map(|kind| {
        let at = move |triangles| STROKE_PX.map(|pixels| TestPicture::Trees(Trees { kind, triangles, pixels }));
        STROKE_TRIANGLES.into_iter().flat_map(at)
    });
    let balls = ends_first(areas_px).flat_map(of);
    empty.map(|(size, scale)| TestPicture::Empty(size, scale)).chain(trees).chain(balls).collect()
}

/// The numbers below `count` in an order that depends on the round alone (Fisher and Yates; a multiplicative generator).
fn order(count: usize, round: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..count).collect();
    let mut state = 2 * round as u64 + 1;
    for left in (2..=count).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        all.swap(left - 1, (state >> 33) as usize % left);
    }
    all
}

/// The fraction of all pictures still to be measured when `known` are done, 0 … 1.
#[must_use]
pub fn benchmark_left(areas_px: &[f64], known: usize) -> f64 {
    let all = test_pictures(areas_px).len();
    all.saturating_sub(known) as f64 / all.max(1) as f64
}

/// Draws all pictures after the first `known`, or as many as there is time for.
///
/// # Errors
/// As [`Offscreen::new`] and [`Offscreen::render`].
pub fn benchmark(gpu: &Gpu, options: RendererOptions, areas_px: &[f64], known: usize) -> Result<Vec<Drawn>, GpuError> {
    let Ok(ball) = ProgressiveMesh::new(&generate(Generator::Sphere, 0, TRIANGLES[TRIANGLES.len() - 1])) else {
        return Ok(Vec::new());
    };
    let ball = Arc::new(ball);
    let trees = tree(&TREE).map(|foliage| Model::Foliage(Arc::new(foliage)));
    let mut screen = Offscreen::new(gpu.clone(), SIZE, options)?;
    // shaders are compiled at their first use, which must not count as drawing time
    for shading in Shading::PRICED {
        measure(&mut screen, &ball, Balls { shading, triangles: TRIANGLES[0], pixels: SQUARES[0].1 })?;
    }
    for kind in [PieceKind::Leaf, PieceKind::Bough] {
        measure_trees(&mut screen, &trees, Trees { kind, triangles: STROKE_TRIANGLES[0], pixels: STROKE_PX[0] })?;
    }
    let begun = Instant::now();
    let wanted: Vec<_> = test_pictures(areas_px).into_iter().skip(known).collect();
    let mut measured: Vec<Option<Timed>> = vec![None; wanted.len()];
    'rounds: for round in 0..ROUNDS {
        // the first round goes from the most telling pictures on: it may be all that there is time for
        let first = || (0..wanted.len()).collect();
        for at in if round == 0 { first() } else { order(wanted.len(), round) } {
            if begun.elapsed() > LONGEST {
                break 'rounds;
            }
            let timed = match wanted[at] {
                TestPicture::Balls(wanted) => measure(&mut screen, &ball, wanted)?,
                TestPicture::Trees(wanted) => measure_trees(&mut screen, &trees, wanted)?,
                TestPicture::Empty(size, scale) => {
                    screen = screen.resized(size)?;
                    let timed = empty(&mut screen, scale)?;
                    screen = screen.resized(SIZE)?;
                    timed
                }
            };
            match &mut measured[at] {
                Some(before) => before.times_s.extend(timed.times_s),
                unmeasured => *unmeasured = Some(timed),
            }
        }
    }
    Ok(measured.into_iter().map_while(|timed| timed.map(Timed::median)).collect())
}

/// A picture, and the times that it took.
#[derive(Debug, Clone)]
struct Timed {
    /// The picture; its time is not known yet.
    drawn: Drawn,
    times_s: Vec<f64>,
}

impl Timed {
    /// The picture with the middle of its times.
    fn median(mut self) -> Drawn {
        self.times_s.sort_by(f64::total_cmp);
        Drawn { seconds: self.times_s[self.times_s.len() / 2], ..self.drawn }
    }
}

/// A picture without an object.
fn empty(screen: &mut Offscreen, scale: f64) -> Result<Timed, GpuError> {
    let mut nothing = SceneView::new(Vec::new(), Vec::new());
    nothing.set_scale(scale);
    let times_s = times(screen, &mut nothing, 1.0, &[])?;
    let (shown, shading) = (screen.size(), Shading::PerPixel);
    let (picture_px, enlarged_px) = (shown.scaled(scale).pixels(), if scale < 1.0 { shown.pixels() } else { 0.0 });
    let (objects, strokes) = (0, None);
    let drawn = Drawn { picture_px, enlarged_px, objects, polygons: 0.0, pixels: 0.0, shading, strokes, seconds: 0.0 };
    Ok(Timed { drawn, times_s })
}

/// The first, the last, the second, the last but one and so on: the pictures measured until time runs out span the whole range.
fn ends_first(sorted: &[f64]) -> impl Iterator<Item = f64> {
    let last = sorted.len().saturating_sub(1);
    (0..sorted.len()).map(move |k| sorted[if k % 2 == 0 { k / 2 } else { last - k / 2 }])
}

/// Triangle counts of balls whose triangles cover `area_px` each, and the pixels that such a ball covers.
fn numbers(area_px: f64) -> impl Iterator<Item = (u32, f64)> {
    let covers = TRIANGLES.into_iter().map(move |triangles| (triangles, area_px * f64::from(triangles)));
    covers.filter(|(_, pixels)| (LEAST_PX..=SQUARES[SQUARES.len() - 1].1).contains(pixels)).take(NUMBERS)
}

fn measure(screen: &mut Offscreen, ball: &Arc<ProgressiveMesh>, wanted: Balls) -> Result<Timed, GpuError> {
    let Balls { shading, triangles, pixels } = wanted;
    let (side, _) = SQUARES.into_iter().find(|(_, most)| pixels <= *most).unwrap_or(SQUARES[SQUARES.len() - 1]);
    let mut scene_view = balls(ball, side, shading == Shading::Textured);
    let cut = ball.cut(triangles).triangles;
    let level = Level { shading, triangles: cut, ..Resolution { eps_m: 1.0, n: 0 }.into() };
    // covered pixels are measured at 1 m; from there they fall with the square of the distance
    let distance_m = (seen_pixels(&mut scene_view, 1.0) / (pixels / f64::from(triangles) * f64::from(cut))).sqrt();
    let times_s = times(screen, &mut scene_view, distance_m, &vec![level; (side * side) as usize])?;
    let pixels = seen_pixels(&mut scene_view, distance_m);
    let polygons = f64::from(cut);
    let (picture_px, enlarged_px, objects, strokes) = (SIZE.pixels(), 0.0, side * side, None);
    let drawn = Drawn { picture_px, enlarged_px, objects, polygons, pixels, shading, strokes, seconds: 0.0 };
    Ok(Timed { drawn, times_s })
}

/// As [`measure`], of trees: `trees` has the boughs, then the leaves.
fn measure_trees(screen: &mut Offscreen, trees: &[Model; 2], wanted: Trees) -> Result<Timed, GpuError> {
    let Trees { kind, triangles, pixels } = wanted;
    let (side, _) = SQUARES.into_iter().find(|(_, most)| pixels <= *most).unwrap_or(SQUARES[SQUARES.len() - 1]);
    let model = &trees[usize::from(kind == PieceKind::Leaf)];
    // a tree's own height is a ball's width
    let mut scene_view = square(side, |at| Placement { position: at, rotation: DQuat::IDENTITY, scale: 1.0 }, model);
    let level = Level { shading: Shading::PerPixel, triangles, ..Resolution { eps_m: 1.0, n: 0 }.into() };
    let distance_m = (seen_pixels(&mut scene_view, 1.0) / pixels).sqrt();
    let times_s = times(screen, &mut scene_view, distance_m, &vec![level; (side * side) as usize])?;
    let pixels = seen_pixels(&mut scene_view, distance_m);
    let (picture_px, polygons, strokes) = (SIZE.pixels(), f64::from(triangles), Some(kind));
    let (enlarged_px, objects, shading) = (0.0, side * side, Shading::PerPixel);
    let drawn = Drawn { picture_px, enlarged_px, objects, polygons, pixels, shading, strokes, seconds: 0.0 };
    Ok(Timed { drawn, times_s })
}

/// Pixels that the first ball covers.
fn seen_pixels(scene_view: &mut SceneView, distance_m: f64) -> f64 {
    scene_view.survey(&camera(distance_m), SIZE);
    scene_view.seen().first().map_or(0.0, |seen| seen.pixels)
}

/// Times of [`DRAWINGS`] pictures, seconds, after one that makes their meshes and textures.
fn times(
    screen: &mut Offscreen,
    scene_view: &mut SceneView,
    distance_m: f64,
    levels: &[Level],
) -> Result<Vec<f64>, GpuError> {
    let camera = camera(distance_m);
    let mut draw = || -> Result<f64, GpuError> {
        let started = Instant::now();
        scene_view.survey(&camera, screen.size());
        screen.render(scene_view.compose(&camera, levels, Style::default(), None), &camera)?;
        Ok(started.elapsed().as_secs_f64())
    };
    draw()?;
    (0..DRAWINGS).map(|_| draw()).collect()
}

fn camera(distance_m: f64) -> Camera {
    Camera::looking(DVec3::new(0.0, -distance_m, 0.0), DVec3::ZERO, 0.6)
}

/// A square of balls across the view, with or without a pattern on them.
fn balls(ball: &Arc<ProgressiveMesh>, side: u32, painted: bool) -> SceneView {
    let model = Model::Mesh(Arc::clone(ball));
    let mut scene_view =
        square(side, |at| Placement { position: at, rotation: DQuat::IDENTITY, scale: RADIUS_M }, &model);
    if painted {
        let texture = Arc::new(Pattern::Checker.texture(RADIUS_M as f32));
        (0..side * side).for_each(|id| scene_view.paint(AgentId(id), &texture));
    }
    scene_view.pose(SimTime::ZERO, States::Latest);
    scene_view
}

/// A square of one model, each copy at its own place.
fn square(side: u32, placed: impl Fn(DVec3) -> Placement, model: &Model) -> SceneView {
    let appearance = Appearance { colour: [200, 120, 100], material: Material::Plastic };
    let actor = |id| Actor { id: AgentId(id), form: Form::Scenery(model.clone(), placed(place(id, side))), appearance };
    let mut scene_view = SceneView::new((0..side * side).map(actor).collect(), Vec::new());
    scene_view.pose(SimTime::ZERO, States::Latest);
    scene_view
}

/// Position of a ball in the square, metres.
fn place(id: u32, side: u32) -> DVec3 {
    let along = |i: u32| (f64::from(i) - 0.5 * f64::from(side - 1)) * APART_M;
    DVec3::new(along(id % side), 0.0, along(id / side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_measurements_are_not_drawn_again() {
        let areas = [1.0, 16.0, 256.0];
        let all = test_pictures(&areas);
        assert_eq!(all[..3], EMPTY.map(|size| TestPicture::Empty(size, 1.0)));
        assert_eq!(all[3], TestPicture::Empty(ENLARGED.0, ENLARGED.1));
        assert!(all.len() > 38 && all[4..22].iter().all(|wanted| matches!(wanted, TestPicture::Trees(..))));
        assert!(all[22..].iter().all(|wanted| matches!(wanted, TestPicture::Balls(..))));
        assert_eq!([0, all.len(), 2 * all.len()].map(|known| benchmark_left(&areas, known)), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn every_round_has_all_pictures_in_an_order_of_its_own() {
        let rounds: Vec<_> = (1..4).map(|round| order(55, round)).collect();
        for (k, round) in rounds.iter().enumerate() {
            let mut sorted = round.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..55).collect::<Vec<_>>());
            // pictures that follow each other in one round do not in another
            let pairs = |of: &[usize]| of.windows(2).map(|pair| (pair[0], pair[1])).collect::<Vec<_>>();
            let same =
                rounds[..k].iter().flat_map(|other| pairs(other)).filter(|pair| pairs(round).contains(pair)).count();
            assert!(same < 6, "{same} pairs of round {k}");
        }
    }

    #[test]
    fn areas_are_measured_from_both_ends() {
        assert_eq!(ends_first(&[1.0, 2.0, 3.0, 4.0, 5.0]).collect::<Vec<_>>(), [1.0, 5.0, 2.0, 4.0, 3.0]);
        assert_eq!(ends_first(&[1.0, 2.0]).collect::<Vec<_>>(), [1.0, 2.0]);
        assert_eq!(ends_first(&[]).count(), 0);
    }

    #[test]
    fn every_area_is_drawn_with_balls_that_do_not_overlap() {
        for area_px in [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0] {
            let all: Vec<_> = numbers(area_px).collect();
            assert!(!all.is_empty() && (all.len() == NUMBERS || area_px > 2000.0), "{area_px}: {all:?}");
            for (triangles, pixels) in all {
                assert!((pixels / f64::from(triangles) / area_px - 1.0).abs() < 1e-12);
                let (side, most) = SQUARES.into_iter().find(|(_, most)| pixels <= *most).unwrap();
                // a ball is 1/1.2 as wide as its cell, and the cells fill no more than the height of the picture
                let wide_px = 2.0 * (most / std::f64::consts::PI).sqrt() * APART_M / (2.0 * RADIUS_M);
                assert!(wide_px * f64::from(side) < 1.02 * f64::from(SIZE.height) + 0.2 * wide_px, "{side} of {most}");
            }
        }
    }
}
