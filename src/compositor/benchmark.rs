//! A benchmark of an adapter: what pictures of many equal balls take, by triangles, pixels and shading (FS93, §4).
//!
//! In: an adapter. Out: measured pictures. Never here: a fit, a file. It takes about a second where a processor draws.

use super::draw::RendererOptions;
use super::gather::{Actor, Form, Look, Material, Stage, States};
use super::level::{Level, Shading};
use super::offscreen::{Gpu, GpuError, Offscreen};
use super::picture::Style;
use super::view::{Camera, Size};
use glam::{DQuat, DVec3};
use metachron_agents::shape::{Generator, Model, Pattern, Placement, Primitive, Solid, Tom, generate};
use metachron_agents::{AgentId, Body, Resolution, RigidState, SimTime, Snapshot};
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
    /// The least of a few drawings of it, seconds.
    pub seconds: f64,
}

/// Pictures without an object, for what a picture and its pixels cost.
const EMPTY: [Size; 3] =
    [Size { width: 320, height: 180 }, Size { width: 640, height: 360 }, Size { width: 960, height: 540 }];
/// Pictures of balls.
const SIZE: Size = Size { width: 640, height: 360 };
/// Balls along each side of a square.
const SIDE: u32 = 6;
/// Radius of a ball, and from one to the next, metres.
const RADIUS_M: f64 = 0.05;
const APART_M: f64 = 0.12;
/// Levels and distances: few and many triangles on few and many pixels.
const LEVELS: [u8; 4] = [0, 2, 4, 5];
const DISTANCES_M: [f64; 3] = [1.4, 2.8, 8.0];
/// On a machine that is busy with other things the benchmark is given up after this long: what it says then is not the adapter's.
const LONGEST: Duration = Duration::from_secs(3);
/// Drawings of each picture; the least is the work when nobody disturbs it.
const DRAWINGS: usize = 3;

/// Draws all pictures, or as many as there is time for.
///
/// # Errors
/// As [`Offscreen::new`] and [`Offscreen::render`].
pub fn benchmark(gpu: &Gpu, options: RendererOptions) -> Result<Vec<Drawn>, GpuError> {
    let (mut drawn, begun) = (Vec::new(), Instant::now());
    for size in EMPTY {
        let mut screen = Offscreen::new(gpu.clone(), size, options)?;
        let seconds = least(&mut screen, &mut Stage::new(Vec::new(), Vec::new()), DISTANCES_M[0], &[])?;
        let (objects, polygons, pixels) = (0, 0.0, 0.0);
        drawn.push(Drawn { picture_px: size.pixels(), objects, polygons, pixels, shading: Shading::PerPixel, seconds });
    }
    let mut screen = Offscreen::new(gpu.clone(), SIZE, options)?;
    let (mut plain, mut painted) = (balls(), painted_balls());
    for shading in [Shading::Flat, Shading::Gouraud, Shading::PerPixel, Shading::Textured] {
        let stage = if shading == Shading::Textured { &mut painted } else { &mut plain };
        for n in LEVELS {
            for distance_m in DISTANCES_M {
                if begun.elapsed() > LONGEST {
                    return Ok(drawn);
                }
                drawn.push(measure(&mut screen, stage, (shading, n, distance_m))?);
            }
        }
    }
    Ok(drawn)
}

fn measure(
    screen: &mut Offscreen,
    stage: &mut Stage,
    (shading, n, distance_m): (Shading, u8, f64),
) -> Result<Drawn, GpuError> {
    let triangles = Primitive::Ball.triangles(n);
    let level = Level { shading, triangles, ..Resolution { eps_m: 1.0, n }.into() };
    let seconds = least(screen, stage, distance_m, &[level; (SIDE * SIDE) as usize])?;
    let mut seen = Vec::new();
    stage.survey(&camera(distance_m), SIZE, &mut seen);
    let pixels = seen.iter().map(|seen| seen.pixels).sum::<f64>() / f64::from(SIDE * SIDE);
    let polygons = f64::from(triangles);
    Ok(Drawn { picture_px: SIZE.pixels(), objects: SIDE * SIDE, polygons, pixels, shading, seconds })
}

fn least(screen: &mut Offscreen, stage: &mut Stage, distance_m: f64, levels: &[Level]) -> Result<f64, GpuError> {
    let (camera, mut least, mut seen) = (camera(distance_m), f64::INFINITY, Vec::new());
    // the first drawing makes meshes and buffers
    for drawing in 0..=DRAWINGS {
        let started = Instant::now();
        stage.survey(&camera, screen.size(), &mut seen);
        screen.render(stage.compose(&camera, levels, Style::default(), None), &camera)?;
        let took = started.elapsed().as_secs_f64();
        least = if drawing == 0 { least } else { least.min(took) };
    }
    Ok(least)
}

fn camera(distance_m: f64) -> Camera {
    Camera::looking(DVec3::new(0.0, -distance_m, 0.0), DVec3::ZERO, 0.6)
}

/// A square of balls across the view.
fn balls() -> Stage {
    let look = Look { colour: [200, 120, 100], material: Material::Plastic };
    let form = Form::Solid(Solid::Ball { radius_m: RADIUS_M });
    let actor = |id| Actor { id: AgentId(id), form: form.clone(), look };
    let mut stage = Stage::new((0..SIDE * SIDE).map(actor).collect(), Vec::new());
    for id in 0..SIDE * SIDE {
        let body = Body::Rigid(RigidState { position: place(id), ..RigidState::default() });
        stage.see(AgentId(id), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
    }
    stage.pose(SimTime::ZERO, States::Latest);
    stage
}

/// The same of meshes with a pattern on them.
fn painted_balls() -> Stage {
    let look = Look { colour: [200, 120, 100], material: Material::Plastic };
    let most = LEVELS.map(|n| Primitive::Ball.triangles(n)).into_iter().max().unwrap_or_default();
    let Ok(tom) = Tom::new(&generate(Generator::Sphere, 0, most)) else { return Stage::default() };
    let model = Model::Mesh(Arc::new(tom));
    let actor = |id| {
        let at = Placement { position: place(id), rotation: DQuat::IDENTITY, scale: RADIUS_M };
        Actor { id: AgentId(id), form: Form::Scenery(model.clone(), at), look }
    };
    let mut stage = Stage::new((0..SIDE * SIDE).map(actor).collect(), Vec::new());
    let texture = Arc::new(Pattern::Checker.texture(RADIUS_M as f32));
    (0..SIDE * SIDE).for_each(|id| stage.paint(AgentId(id), &texture));
    stage
}

/// Where a ball of the square is, metres.
fn place(id: u32) -> DVec3 {
    let along = |i: u32| (f64::from(i) - 0.5 * f64::from(SIDE - 1)) * APART_M;
    DVec3::new(along(id % SIDE), 0.0, along(id / SIDE))
}
