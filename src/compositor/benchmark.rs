//! A benchmark of an adapter: what pictures of many equal balls take, by triangles, the pixels that each covers, and shading (FS93, §4;
//! RH05, §4.1).
//!
//! In: an adapter. Out: measured pictures. Never here: a fit, a file. It takes one or two seconds where a processor draws, and no
//! picture is begun after three.

use super::draw::RendererOptions;
use super::gather::{Actor, Form, Look, Material, Stage, States};
use super::level::{Level, Shading};
use super::offscreen::{Gpu, GpuError, Offscreen};
use super::picture::Style;
use super::view::{Camera, Size};
use glam::{DQuat, DVec3};
use metachron_agents::shape::{Generator, Model, Pattern, Placement, Tom, generate};
use metachron_agents::{AgentId, Resolution, SimTime};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// One measured picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Pixels of the picture.
    pub picture_px: f64,
    /// Objects in it.
    pub objects: u32,
    /// Triangles of each.
    pub polygons: f64,
    /// Pixels that each covers.
    pub pixels: f64,
    /// How they are shaded.
    pub shading: Shading,
    /// The median of a few drawings of it, seconds.
    pub seconds: f64,
}

/// Pictures without an object, for what a picture and its pixels cost.
const EMPTY: [Size; 3] =
    [Size { width: 320, height: 180 }, Size { width: 640, height: 360 }, Size { width: 960, height: 540 }];
/// Pictures of balls.
const SIZE: Size = Size { width: 640, height: 360 };
/// Balls along the side of a square, few where they are large, and the most pixels that each may then cover beside the others.
const SQUARES: [(u32, f64); 4] = [(6, 2e3), (4, 4.4e3), (2, 17e3), (1, 60e3)];
/// Radius of a ball, and from one to the next, metres.
const RADIUS_M: f64 = 0.05;
const APART_M: f64 = 0.12;
/// Triangles of a ball.
const TRIANGLES: [u32; 4] = [8, 32, 128, 512];
/// Of one area a triangle, the fewest pixels that a ball covers: the numbers of triangles that are drawn begin there …
const LEAST_PX: f64 = 100.0;
/// … and are so many.
const NUMBERS: usize = 2;
/// No picture is begun this long after the start, shaders and all: what was measured until then is given.
const LONGEST: Duration = Duration::from_secs(3);
/// Drawings of each picture after the first, which makes meshes and buffers …
const DRAWINGS: usize = 5;
/// … or as many as fit into this time: the fiftieth part of the whole, and there are about fifty pictures.
const PICTURE: Duration = Duration::from_millis(60);
const SHADINGS: [Shading; 4] = [Shading::Flat, Shading::Gouraud, Shading::PerPixel, Shading::Textured];

/// Draws all pictures, or as many as there is time for: of each shading, balls whose triangles cover so many pixels each, the least
/// and the greatest area first.
///
/// # Errors
/// As [`Offscreen::new`] and [`Offscreen::render`].
pub fn benchmark(gpu: &Gpu, options: RendererOptions, areas_px: &[f64]) -> Result<Vec<Drawn>, GpuError> {
    let Ok(ball) = Tom::new(&generate(Generator::Sphere, 0, TRIANGLES[TRIANGLES.len() - 1])) else {
        return Ok(Vec::new());
    };
    let (ball, begun) = (Arc::new(ball), Instant::now());
    let mut drawn = Vec::new();
    for size in EMPTY {
        let mut screen = Offscreen::new(gpu.clone(), size, options)?;
        let seconds = median(&mut screen, &mut Stage::new(Vec::new(), Vec::new()), 1.0, &[])?;
        let (objects, polygons, pixels) = (0, 0.0, 0.0);
        drawn.push(Drawn { picture_px: size.pixels(), objects, polygons, pixels, shading: Shading::PerPixel, seconds });
    }
    let mut screen = Offscreen::new(gpu.clone(), SIZE, options)?;
    // shaders are compiled where they are first drawn with: that is no part of what drawing takes
    for shading in SHADINGS {
        measure(&mut screen, &ball, (shading, TRIANGLES[0], SQUARES[0].1))?;
    }
    for area_px in ends_first(areas_px) {
        for (triangles, pixels) in numbers(area_px) {
            for shading in SHADINGS {
                if begun.elapsed() > LONGEST {
                    return Ok(drawn);
                }
                drawn.push(measure(&mut screen, &ball, (shading, triangles, pixels))?);
            }
        }
    }
    Ok(drawn)
}

/// The first, the last, the second, the last but one and so on: what is measured until time runs out spans the whole.
fn ends_first(sorted: &[f64]) -> impl Iterator<Item = f64> {
    let last = sorted.len().saturating_sub(1);
    (0..sorted.len()).map(move |k| sorted[if k % 2 == 0 { k / 2 } else { last - k / 2 }])
}

/// Numbers of triangles that cover so many pixels each, and what balls of them cover.
fn numbers(area_px: f64) -> impl Iterator<Item = (u32, f64)> {
    let covers = TRIANGLES.into_iter().map(move |triangles| (triangles, area_px * f64::from(triangles)));
    covers.filter(|(_, pixels)| (LEAST_PX..=SQUARES[SQUARES.len() - 1].1).contains(pixels)).take(NUMBERS)
}

fn measure(
    screen: &mut Offscreen,
    ball: &Arc<Tom>,
    (shading, triangles, pixels): (Shading, u32, f64),
) -> Result<Drawn, GpuError> {
    let (side, _) = SQUARES.into_iter().find(|(_, most)| pixels <= *most).unwrap_or(SQUARES[SQUARES.len() - 1]);
    let mut stage = balls(ball, side, shading == Shading::Textured);
    let cut = ball.cut(triangles).triangles;
    let level = Level { shading, triangles: cut, ..Resolution { eps_m: 1.0, n: 0 }.into() };
    // at a metre, and from there as the square of the distance
    let distance_m = (seen_pixels(&mut stage, 1.0) / (pixels / f64::from(triangles) * f64::from(cut))).sqrt();
    let seconds = median(screen, &mut stage, distance_m, &vec![level; (side * side) as usize])?;
    let pixels = seen_pixels(&mut stage, distance_m);
    let polygons = f64::from(cut);
    Ok(Drawn { picture_px: SIZE.pixels(), objects: side * side, polygons, pixels, shading, seconds })
}

/// Pixels that the first ball covers.
fn seen_pixels(stage: &mut Stage, distance_m: f64) -> f64 {
    stage.survey(&camera(distance_m), SIZE);
    stage.seen().first().map_or(0.0, |seen| seen.pixels)
}

fn median(screen: &mut Offscreen, stage: &mut Stage, distance_m: f64, levels: &[Level]) -> Result<f64, GpuError> {
    let (camera, mut times) = (camera(distance_m), Vec::with_capacity(DRAWINGS));
    let mut draw = || -> Result<f64, GpuError> {
        let started = Instant::now();
        stage.survey(&camera, screen.size());
        screen.render(stage.compose(&camera, levels, Style::default(), None), &camera)?;
        Ok(started.elapsed().as_secs_f64())
    };
    draw()?;
    let begun = Instant::now();
    while times.is_empty() || times.len() < DRAWINGS && begun.elapsed() < PICTURE {
        times.push(draw()?);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

fn camera(distance_m: f64) -> Camera {
    Camera::looking(DVec3::new(0.0, -distance_m, 0.0), DVec3::ZERO, 0.6)
}

/// A square of balls across the view, with a pattern on them or without.
fn balls(ball: &Arc<Tom>, side: u32, painted: bool) -> Stage {
    let look = Look { colour: [200, 120, 100], material: Material::Plastic };
    let model = Model::Mesh(Arc::clone(ball));
    let actor = |id| {
        let at = Placement { position: place(id, side), rotation: DQuat::IDENTITY, scale: RADIUS_M };
        Actor { id: AgentId(id), form: Form::Scenery(model.clone(), at), look }
    };
    let mut stage = Stage::new((0..side * side).map(actor).collect(), Vec::new());
    if painted {
        let texture = Arc::new(Pattern::Checker.texture(RADIUS_M as f32));
        (0..side * side).for_each(|id| stage.paint(AgentId(id), &texture));
    }
    stage.pose(SimTime::ZERO, States::Latest);
    stage
}

/// Where a ball of the square is, metres.
fn place(id: u32, side: u32) -> DVec3 {
    let along = |i: u32| (f64::from(i) - 0.5 * f64::from(side - 1)) * APART_M;
    DVec3::new(along(id % side), 0.0, along(id / side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_gone_through_from_both_ends() {
        assert_eq!(ends_first(&[1.0, 2.0, 3.0, 4.0, 5.0]).collect::<Vec<_>>(), [1.0, 5.0, 2.0, 4.0, 3.0]);
        assert_eq!(ends_first(&[1.0, 2.0]).collect::<Vec<_>>(), [1.0, 2.0]);
        assert_eq!(ends_first(&[]).count(), 0);
    }

    #[test]
    fn every_area_is_drawn_with_balls_that_stand_beside_each_other() {
        for area_px in [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0] {
            let all: Vec<_> = numbers(area_px).collect();
            assert!(!all.is_empty() && (all.len() == NUMBERS || area_px > 2000.0), "{area_px}: {all:?}");
            for (triangles, pixels) in all {
                assert!((pixels / f64::from(triangles) / area_px - 1.0).abs() < 1e-12);
                let (side, most) = SQUARES.into_iter().find(|(_, most)| pixels <= *most).unwrap();
                // balls are 1/1.2 of their places wide, and the places fill no more than the height of the picture
                let wide_px = 2.0 * (most / std::f64::consts::PI).sqrt() * APART_M / (2.0 * RADIUS_M);
                assert!(wide_px * f64::from(side) < 1.02 * f64::from(SIZE.height) + 0.2 * wide_px, "{side} of {most}");
            }
        }
    }
}
