//! Reads a sheet, solid or rope of a scene file as a [`SoftSpec`].

use super::object::ModelContext;
use super::rigid::rotation;
use super::{FRICTION, LENGTH, POSITION_MAX_M, ROTATION_MAX_DEG, SPEED_MAX};
use crate::check::{Allowed, Checker, Place, allowed};
use crate::format::{Point, RopeEnd, RopeFile, SheetFile, SheetSide, SoftShapeKind, SolidFile, SolidSide};
use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body};
use metachron_models::soft::Side;
use metachron_models::soft::SoftBody;
use metachron_models::soft::{SoftMatter, SoftShape, SoftSpec};

const YOUNG: Allowed = allowed(1.0..=1e11, "Pa");
const POISSON: Allowed = allowed(0.0..=0.49, "");
const DENSITY: Allowed = allowed(1.0..=1e5, "kg/m³");
const DAMPING_RATE: Allowed = allowed(0.0..=1e4, "1/s");
const SEGMENTS: Allowed = allowed(1.0..=2047.0, "");

/// The keys that all soft bodies share.
struct Shared {
    young_pa: f64,
    poisson: Option<f64>,
    density_kg_m3: Option<f64>,
    damping_per_s: Option<f64>,
    velocity_m_s: Option<Point>,
    friction: Option<f64>,
    held: Vec<Side>,
}

/// Reads a sheet.
pub(super) fn sheet(c: &mut Checker<'_, '_>, file: &SheetFile, context: &ModelContext<'_>) -> SoftSpec {
    let place = context.place;
    let size_m = std::array::from_fn(|i| c.number(place, &format!("size_m.{i}"), file.size_m[i], &LENGTH));
    let segments = std::array::from_fn(|i| segments(c, place, &format!("segments.{i}"), file.segments[i]));
    let thickness_m = c.number(place, "thickness_m", file.thickness_m, &LENGTH);
    let side = |side: &SheetSide| match side {
        SheetSide::Left => Side::Left,
        SheetSide::Right => Side::Right,
        SheetSide::Near => Side::Near,
        SheetSide::Far => Side::Far,
    };
    let shared = Shared {
        young_pa: file.young_pa,
        poisson: file.poisson,
        density_kg_m3: file.density_kg_m3,
        damping_per_s: file.damping_per_s,
        velocity_m_s: file.velocity_m_s,
        friction: file.friction,
        held: file.hold.iter().flatten().map(side).collect(),
    };
    let half = DVec3::new(0.5 * size_m[0], 0.5 * size_m[1], 0.0);
    let pose = pose(c, place, file.position_m, file.rotation_deg, half);
    spec(c, context, SoftShape::Sheet { size_m, thickness_m, segments }, pose, shared)
}

/// Reads a solid; `None` where its dimensions are missing.
pub(super) fn solid(c: &mut Checker<'_, '_>, file: &SolidFile, context: &ModelContext<'_>) -> Option<SoftSpec> {
    let place = context.place;
    let shape = solid_shape(c, place, file)?;
    let side = |side: &SolidSide| match side {
        SolidSide::Left => Side::Left,
        SolidSide::Right => Side::Right,
        SolidSide::Near => Side::Near,
        SolidSide::Far => Side::Far,
        SolidSide::Bottom => Side::Bottom,
        SolidSide::Top => Side::Top,
    };
    let held: Vec<Side> = file.hold.iter().flatten().map(side).collect();
    if file.shape == SoftShapeKind::Ball && !held.is_empty() {
        c.wrong(place, "hold", "names faces, which a ball does not have", "expected no such key for a ball");
    }
    let shared = Shared {
        young_pa: file.young_pa,
        poisson: file.poisson,
        density_kg_m3: file.density_kg_m3,
        damping_per_s: file.damping_per_s,
        velocity_m_s: file.velocity_m_s,
        friction: file.friction,
        held,
    };
    let half = if let SoftShape::Box { size_m, .. } = shape { 0.5 * size_m } else { DVec3::ZERO };
    let pose = pose(c, place, file.position_m, file.rotation_deg, half);
    Some(spec(c, context, shape, pose, shared))
}

fn solid_shape(c: &mut Checker<'_, '_>, place: &Place, file: &SolidFile) -> Option<SoftShape> {
    let cells = std::array::from_fn(|i| segments(c, place, &format!("segments.{i}"), file.segments[i]));
    let is_box = file.shape == SoftShapeKind::Box;
    let name = if is_box { "box" } else { "ball" };
    for (key, is_given, belongs) in
        [("size_m", file.size_m.is_some(), is_box), ("radius_m", file.radius_m.is_some(), !is_box)]
    {
        if is_given && !belongs {
            c.wrong(place, key, format_args!("does not belong to a {name}"), "expected no such key here");
        }
        if !is_given && belongs {
            c.wrong(place, key, "is missing", format!("a {name} needs it: expected `{key}` in this table"));
        }
    }
    if is_box {
        let size = file.size_m?;
        let size = std::array::from_fn(|i| c.number(place, &format!("size_m.{i}"), size[i], &LENGTH));
        return Some(SoftShape::Box { size_m: DVec3::from_array(size), segments: cells });
    }
    let radius_m = c.number(place, "radius_m", file.radius_m?, &LENGTH);
    if cells.iter().any(|n| *n != cells[0] || *n < 2) {
        let expected = "expected the same number, at least 2, three times: a ball has no long side";
        c.wrong(place, "segments", format_args!("is {cells:?}"), expected);
    }
    Some(SoftShape::Ball { radius_m, segments: cells[0] })
}

/// Reads a rope.
pub(super) fn rope(c: &mut Checker<'_, '_>, file: &RopeFile, context: &ModelContext<'_>) -> SoftSpec {
    let place = context.place;
    if file.path_m.len() < 2 {
        c.wrong(place, "path_m", format_args!("has {} points", file.path_m.len()), "expected at least 2 points");
    }
    let path_m = (0..).zip(&file.path_m).map(|(i, at)| c.point(place, &format!("path_m.{i}"), *at, POSITION_MAX_M));
    let path_m: Vec<DVec3> = path_m.collect();
    let end = |end: &RopeEnd| if *end == RopeEnd::Start { Side::Left } else { Side::Right };
    let shared = Shared {
        young_pa: file.young_pa,
        poisson: None,
        density_kg_m3: file.density_kg_m3,
        damping_per_s: file.damping_per_s,
        velocity_m_s: file.velocity_m_s,
        friction: file.friction,
        held: file.hold.iter().flatten().map(end).collect(),
    };
    let radius_m = c.number(place, "radius_m", file.radius_m, &LENGTH);
    let segments = segments(c, place, "segments", file.segments);
    let pose = Pose { position: DVec3::ZERO, rotation: DQuat::IDENTITY };
    spec(c, context, SoftShape::Rope { path_m, radius_m, segments }, pose, shared)
}

fn segments(c: &mut Checker<'_, '_>, place: &Place, key: &str, count: u32) -> u32 {
    c.number(place, key, f64::from(count), &SEGMENTS) as u32
}

/// Position of the first corner and rotation of a body at the start.
struct Pose {
    position: DVec3,
    rotation: DQuat,
}

/// The pose of a body whose middle is `half` from its first corner in its own axes.
fn pose(
    c: &mut Checker<'_, '_>,
    place: &Place,
    position_m: Option<Point>,
    rotation_deg: Option<Point>,
    half: DVec3,
) -> Pose {
    let position = position_m.map_or(DVec3::ZERO, |at| c.point(place, "position_m", at, POSITION_MAX_M));
    let rotation =
        rotation_deg.map_or(DQuat::IDENTITY, |deg| rotation(c.point(place, "rotation_deg", deg, ROTATION_MAX_DEG)));
    Pose { position: position - rotation * half, rotation }
}

fn spec(c: &mut Checker<'_, '_>, context: &ModelContext<'_>, shape: SoftShape, pose: Pose, shared: Shared) -> SoftSpec {
    let place = context.place;
    let matter = SoftMatter {
        young_pa: c.number(place, "young_pa", shared.young_pa, &YOUNG),
        poisson: c.optional(place, "poisson", shared.poisson, &POISSON).unwrap_or(0.4),
        density_kg_m3: c.optional(place, "density_kg_m3", shared.density_kg_m3, &DENSITY).unwrap_or(1050.0),
        damping_per_s: c.optional(place, "damping_per_s", shared.damping_per_s, &DAMPING_RATE).unwrap_or(0.0),
    };
    SoftSpec {
        shape,
        matter,
        position: pose.position,
        rotation: pose.rotation,
        velocity: shared.velocity_m_s.map_or(DVec3::ZERO, |v| c.point(place, "velocity_m_s", v, SPEED_MAX)),
        held: shared.held,
        friction: c.optional(place, "friction", shared.friction, &FRICTION).unwrap_or(0.3),
        gravity: context.gravity,
        sleep: context.sleep,
    }
}

/// The vertex at a share of a rope's length.
pub(super) fn along(spec: &SoftSpec, share: f64) -> Option<Anchor> {
    let SoftShape::Rope { segments, .. } = spec.shape else { return None };
    Some(Anchor::Vertex((share * f64::from(segments)).round() as u32))
}

/// The vertex nearest to `at`, a point in the body's axes from its middle, metres; `None` where the body cannot be built.
pub(super) fn nearest(spec: &SoftSpec, at: DVec3) -> Option<Anchor> {
    let half = match spec.shape {
        SoftShape::Sheet { size_m: [x, y], .. } => DVec3::new(0.5 * x, 0.5 * y, 0.0),
        SoftShape::Box { size_m, .. } => 0.5 * size_m,
        SoftShape::Ball { .. } | SoftShape::Rope { .. } => DVec3::ZERO,
    };
    let there = spec.position + spec.rotation * (at + half);
    let Body::Soft(start) = SoftBody::new(spec.clone()).ok()?.start() else { return None };
    let near = (0..).zip(&start.positions).min_by(|a, b| {
        let apart = |x: &DVec3| x.distance_squared(there);
        apart(a.1).total_cmp(&apart(b.1))
    });
    near.map(|(vertex, _)| Anchor::Vertex(vertex))
}
