//! Reads a sheet, solid or rope of a scene file as a [`SoftSpec`].

use super::common::rotation;
use super::mesh::{self, Mesh};
use super::objects::ModelContext;
use super::scenery::{SurfaceSource, surface_source};
use super::soft_mesh;
use super::{POSITION_MAX_M, ROTATION_MAX_DEG, SPEED_MAX};
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::format::{
    OneOrRange, Point, RopeEnd, RopeFile, SOFT, SheetFile, SheetSide, SoftShapeKind, SolidFile, SolidSide,
};
use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body};
use metachron_drawable::generate_surface;
use metachron_geometry::{Aabb, Cage, Triangles, open_edge, subdivided};
use metachron_models::soft::MATTER;
use metachron_models::soft::Side;
use metachron_models::soft::SoftBody;
use metachron_models::soft::{MaterialLaw, SoftMatter, SoftShape, SoftSpec, VERTICES_MAX};
use std::sync::Arc;

const POISSON_DEFAULT: f64 = 0.4;
/// Most triangles into which a coarse surface is divided, to be as fine as its finest cage; a cage of more has too many vertices.
const SKIN_TRIANGLES_MAX: usize = 200_000;
/// The diagonal of a cell, in its edges: no edge of a surface from a file is longer.
const CELL_DIAGONAL: f64 = 1.732_050_807_568_877_2;
/// Triangles of a generated surface that stands for a finer one of its shape.
const COARSE_TRIANGLES: u32 = 500;
const TOO_FINE: &str = "expected a larger finest ε";
/// A soft solid from a file is hardly longer than this, metres: a file with no scale that is was drawn in millimetres.
const LARGE_M: f64 = 10.0;
/// The keys that all soft bodies share.
struct Shared {
    young_pa: f64,
    poisson: Option<f64>,
    density_kg_m3: Option<f64>,
    damping_per_s: Option<f64>,
    damping_s: Option<f64>,
    self_contact: bool,
    velocity_m_s: Option<Point>,
    friction: Option<f64>,
    held: Vec<Side>,
    law: MaterialLaw,
}

/// Reads a sheet; `None` where its shape is missing or cannot be used.
pub(super) fn sheet(c: &mut Checker<'_, '_>, file: &SheetFile, context: &ModelContext<'_>) -> Option<BuiltSoft> {
    let place = context.place;
    let is_mesh = file.file.is_some();
    let eps_m = if is_mesh { None } else { one_division(c, place, file.segments.is_some(), file.eps_m) };
    let shape = if is_mesh { soft_mesh::shell(c, file, context) } else { flat_sheet(c, place, file) }?;
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
        damping_s: file.damping_s,
        self_contact: file.self_contact.unwrap_or(true),
        velocity_m_s: file.velocity_m_s,
        friction: file.friction,
        held: file.hold.iter().flatten().map(side).collect(),
        law: MaterialLaw::default(),
    };
    let half = if let SoftShape::Sheet { size_m: [x, y], .. } = shape {
        DVec3::new(0.5 * x, 0.5 * y, 0.0)
    } else {
        DVec3::ZERO
    };
    let pose = pose(c, place, file.position_m, file.rotation_deg, half);
    let spec = spec(c, context, shape, pose, shared);
    Some(divided(c, place, spec, eps_m))
}

/// The shape of a flat sheet; `None` where its size is missing, which is reported.
fn flat_sheet(c: &mut Checker<'_, '_>, place: &Place, file: &SheetFile) -> Option<SoftShape> {
    if file.scale.is_some() {
        c.wrong(place, "scale", "has no `file` that it belongs to", "expected no such key here");
    }
    let thickness_m = c.number(place, "thickness_m", file.thickness_m, SOFT);
    let Some(size_m) = file.size_m else {
        c.wrong(place, "size_m", "is missing", "a sheet needs it, or `file`: expected `size_m` in this table");
        return None;
    };
    let size_m = std::array::from_fn(|i| c.number(place, &format!("size_m.{i}"), size_m[i], SOFT));
    let given = file.segments.unwrap_or([1; 2]);
    let segments = std::array::from_fn(|i| segments(c, place, &format!("segments.{i}"), given[i]));
    Some(SoftShape::Sheet { size_m, thickness_m, segments })
}

/// A soft body and the spacings that it may take; none where its division never changes.
pub(super) struct BuiltSoft {
    pub(super) spec: SoftSpec,
    pub(super) eps_m: Option<(f64, f64)>,
}

/// Reads a solid; `None` where its dimensions are missing.
pub(super) fn solid(c: &mut Checker<'_, '_>, file: &SolidFile, context: &ModelContext<'_>) -> Option<BuiltSoft> {
    let place = context.place;
    check_solid_keys(c, place, file);
    let eps_m = file.eps_m.map(|eps| c.ends(place, "eps_m", eps, SOFT));
    let shape = solid_shape(c, file, context, eps_m)?;
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
        damping_s: file.damping_s,
        self_contact: file.self_contact.unwrap_or(false),
        velocity_m_s: file.velocity_m_s,
        friction: file.friction,
        held,
        law: soft_mesh::law(c, place, file.law, file.exponent, file.poisson.unwrap_or(POISSON_DEFAULT)),
    };
    let half = if let SoftShape::Box { size_m, .. } = shape { 0.5 * size_m } else { DVec3::ZERO };
    let pose = pose(c, place, file.position_m, file.rotation_deg, half);
    let mut spec = spec(c, context, shape, pose, shared);
    let matter = spec.matter;
    match (&mut spec.shape, &file.regions) {
        (SoftShape::Tetrahedra { mesh, regions }, Some(files)) => {
            *regions = soft_mesh::regions(c, place, files, mesh, &matter);
        }
        (_, Some(_)) => {
            c.wrong(place, "regions", "do not belong to this shape", "expected them with a mesh of tetrahedra alone");
        }
        _ => {}
    }
    Some(BuiltSoft { spec, eps_m })
}

/// Reports keys that belong to another shape, and missing keys.
fn check_solid_keys(c: &mut Checker<'_, '_>, place: &Place, file: &SolidFile) {
    let [is_box, is_ball, is_mesh] =
        [SoftShapeKind::Box, SoftShapeKind::Ball, SoftShapeKind::Mesh].map(|shape| file.shape == shape);
    let name = if is_box {
        "box"
    } else if is_ball {
        "ball"
    } else {
        "mesh"
    };
    for (key, is_given, belongs) in [
        ("size_m", file.size_m.is_some(), is_box),
        ("radius_m", file.radius_m.is_some(), is_ball),
        ("segments", file.segments.is_some(), !is_mesh),
        ("file", file.file.is_some(), is_mesh),
        ("generate", file.generate.is_some(), is_mesh),
        ("seed", file.seed.is_some(), is_mesh),
        ("triangles", file.triangles.is_some(), is_mesh),
        ("scale", file.scale.is_some(), is_mesh),
    ] {
        if is_given && !belongs {
            c.wrong(place, key, format_args!("does not belong to a {name}"), "expected no such key here");
        }
    }
    for (key, is_missing) in
        [("size_m", is_box && file.size_m.is_none()), ("radius_m", is_ball && file.radius_m.is_none())]
    {
        if is_missing {
            c.wrong(place, key, "is missing", format!("a {name} needs it: expected `{key}` in this table"));
        }
    }
    match (file.segments, file.eps_m) {
        (Some(_), Some(_)) => c.wrong(place, "segments", "contradicts `eps_m`", "expected one of them"),
        (None, None) if !is_mesh => c.wrong(place, "segments", "is missing", "expected `segments` or `eps_m`"),
        _ => {}
    }
}

/// The shape of a solid; `None` where a key that it needs is missing, which is reported.
fn solid_shape(
    c: &mut Checker<'_, '_>,
    file: &SolidFile,
    context: &ModelContext<'_>,
    eps_m: Option<(f64, f64)>,
) -> Option<SoftShape> {
    let place = context.place;
    if file.shape == SoftShapeKind::Mesh {
        if let Some(shape) = soft_mesh::tetrahedra_of(c, file, context) {
            return shape;
        }
        if eps_m.is_none() {
            let expected = "a mesh of triangles needs it: expected `eps_m` in this table";
            c.wrong(place, "eps_m", "is missing", expected);
        }
        let (surface, range_m) = (closed_surface(c, file, context)?, eps_m?);
        // a surface between its points bends with the cage, and would go through bodies that its points alone touch
        let surface = subdivided(&surface, CELL_DIAGONAL * range_m.0, SKIN_TRIANGLES_MAX);
        return Some(SoftShape::Embedded { surface: Arc::new(surface), eps_m: range_m.0, range_m });
    }
    // so is the skin of a box or ball with an ε as fine as its finest cage
    let fitted = |size: f64| eps_m.map(|range| (size / range.0).ceil().clamp(1.0, 2047.0) as u32);
    let given =
        file.segments.map(|cells| std::array::from_fn(|i| segments(c, place, &format!("segments.{i}"), cells[i])));
    let lattice = if file.shape == SoftShapeKind::Box {
        let size = file.size_m?;
        let size = std::array::from_fn(|i| c.number(place, &format!("size_m.{i}"), size[i], SOFT));
        let segments = given.or_else(|| Some([fitted(size[0])?, fitted(size[1])?, fitted(size[2])?]))?;
        SoftShape::Box { size_m: DVec3::from_array(size), segments }
    } else {
        let radius_m = c.number(place, "radius_m", file.radius_m?, SOFT);
        let cells: [u32; 3] = given.or_else(|| Some([fitted(2.0 * radius_m)?.max(2); 3]))?;
        if cells.iter().any(|n| *n != cells[0] || *n < 2) {
            let expected = "expected the same number, at least 2, three times: a ball has no long side";
            c.wrong(place, "segments", format_args!("is {cells:?}"), expected);
        }
        SoftShape::Ball { radius_m, segments: cells[0] }
    };
    let Some(range) = eps_m else { return Some(lattice) };
    // the cage of a box has the nodes of its lattice, that of a ball half of them
    let fits = lattice.vertices() <= 2 * VERTICES_MAX;
    let embedded = fits.then(|| lattice.embedded(range)).flatten();
    if embedded.is_none() {
        c.wrong(place, "eps_m", "is too fine for its size", TOO_FINE);
    }
    embedded
}

/// The closed surface of a file or a generator, metres; `None` where there is none, which is reported.
fn closed_surface(c: &mut Checker<'_, '_>, file: &SolidFile, context: &ModelContext<'_>) -> Option<Triangles> {
    let place = context.place;
    let scale = c.optional(place, "scale", file.scale, SOFT).unwrap_or(1.0);
    let count = file.triangles.map(|n| c.number(place, "triangles", f64::from(n), SOFT) as u32);
    let (key, read) = match surface_source(c, place, file.file.as_deref(), file.generate)? {
        SurfaceSource::File(name) if !c.may_read(place, "file", context.source.head(name), Cost::soft_of_file) => {
            return None;
        }
        SurfaceSource::File(name) => ("file", context.source.sibling(name).and_then(|bytes| mesh::read(&bytes, scale))),
        SurfaceSource::Generated(kind) => {
            let triangles = count.unwrap_or(4000);
            let seed = u64::from(file.seed.unwrap_or(0));
            if c.is_draft() {
                let coarse = generate_surface(kind, seed, triangles.min(COARSE_TRIANGLES));
                draft_cage(c, place, &coarse, &WantedCage { scale, triangles, eps_m: file.eps_m?.ends().0 });
                return None;
            }
            let made = generate_surface(kind, seed, triangles);
            ("generate", Ok(Mesh { points: made.points, uvs: vec![], triangles: made.triangles }))
        }
    };
    let name = file.file.as_deref().unwrap_or("its surface");
    let checked = read.and_then(|mesh| solid_inside(&mesh, scale, file.scale.is_none()));
    checked
        .map_err(|why| {
            let expected = "expected one closed surface, triangles outward: STL, .glb or OBJ";
            c.wrong(place, key, format_args!("cannot be used: {name}: {why}"), expected);
        })
        .ok()
}

/// The skin and the cage that a table asks for.
struct WantedCage {
    scale: f64,
    triangles: u32,
    /// The finest.
    eps_m: f64,
}

/// Notes in a draft the memory of a generated surface and of its cage, whose nodes a `coarse` surface of the same shape
/// tells.
fn draft_cage(c: &mut Checker<'_, '_>, place: &Place, coarse: &Triangles, wanted: &WantedCage) {
    // the cage of the coarse surface may have a few more
    let cage = Cage::new(coarse, wanted.eps_m / wanted.scale, 2 * VERTICES_MAX as usize);
    let Some(cage) = cage else { return c.wrong(place, "eps_m", "is too fine for its size", TOO_FINE) };
    c.may_make(place, "triangles", Cost::skin(u64::from(wanted.triangles), cage.nodes_m().len() as u64));
}

/// The surface of a mesh in metres, where it encloses a solid of one piece; otherwise its fault.
fn solid_inside(mesh: &Mesh, scale: f64, scale_is_missing: bool) -> Result<Triangles, String> {
    let surface = soft_mesh::manifold(mesh, scale)?;
    if let Some(open) = open_edge(&surface) {
        let at = |i: u32| surface.points[i as usize].to_array().map(|x| format!("{x:.4}")).join(", ");
        return Err(format!(
            "it is not closed: triangle {} has no neighbour over the edge from ({}) to ({}) m",
            open.triangle + 1,
            at(open.corners[0]),
            at(open.corners[1])
        ));
    }
    soft_mesh::one_piece(&surface, "solid")?;
    let volume_m3 = surface.volume_m3();
    if volume_m3 < 0.0 {
        return Err("its triangles face inwards: turn them round".to_owned());
    }
    let Aabb { low, high } = Aabb::of(&surface.points);
    let size_m = (high - low).max_element();
    if volume_m3 < 1e-9 * size_m.powi(3) {
        return Err(format!("it encloses {volume_m3:.1e} m³, which is nothing for its length of {size_m:.3} m"));
    }
    too_large(size_m, scale_is_missing)?;
    Ok(surface)
}

/// Refuses a surface that is so long without a scale that it must be in millimetres.
pub(super) fn too_large(size_m: f64, scale_is_missing: bool) -> Result<(), String> {
    if scale_is_missing && size_m > LARGE_M {
        return Err(format!("it is {size_m:.1} m long: if its unit is the millimetre, set `scale = 0.001`"));
    }
    Ok(())
}

/// Reads a rope.
pub(super) fn rope(c: &mut Checker<'_, '_>, file: &RopeFile, context: &ModelContext<'_>) -> BuiltSoft {
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
        damping_s: file.damping_s,
        self_contact: file.self_contact.unwrap_or(true),
        velocity_m_s: file.velocity_m_s,
        friction: file.friction,
        held: file.hold.iter().flatten().map(end).collect(),
        law: MaterialLaw::default(),
    };
    let radius_m = c.number(place, "radius_m", file.radius_m, SOFT);
    let eps_m = one_division(c, place, file.segments.is_some(), file.eps_m);
    let segments = segments(c, place, "segments", file.segments.unwrap_or(1));
    let pose = Pose { position: DVec3::ZERO, rotation: DQuat::IDENTITY };
    let spec = spec(c, context, SoftShape::Rope { path_m, radius_m, segments }, pose, shared);
    divided(c, place, spec, eps_m)
}

/// The range of ε of a sheet or a rope; none of one with segments. It has either, or that is reported.
fn one_division(
    c: &mut Checker<'_, '_>,
    place: &Place,
    has_segments: bool,
    eps_m: Option<OneOrRange<f64>>,
) -> Option<(f64, f64)> {
    match (has_segments, eps_m) {
        (true, Some(_)) => c.wrong(place, "segments", "contradicts `eps_m`", "expected one of them"),
        (false, None) => c.wrong(place, "segments", "is missing", "expected `segments` or `eps_m`"),
        _ => {}
    }
    let before = c.count();
    let range = eps_m.map(|eps| c.ends(place, "eps_m", eps, SOFT));
    // a range that was reported says nothing of one that would fit
    range.filter(|_| c.count() == before)
}

/// Gives a sheet or a rope with a range of ε the lattice of its finest as its skin, and nodes that start there.
fn divided(c: &mut Checker<'_, '_>, place: &Place, spec: SoftSpec, eps_m: Option<(f64, f64)>) -> BuiltSoft {
    let Some(range_m) = eps_m else { return BuiltSoft { spec, eps_m } };
    // a path without a length has no lattice, and is refused for that
    if matches!(&spec.shape, SoftShape::Rope { path_m, .. } if path_m.windows(2).all(|pair| pair[0] == pair[1])) {
        return BuiltSoft { spec, eps_m: None };
    }
    let Some(spec) = spec.clone().spaced(range_m) else {
        let expected = format!("expected a larger finest ε: at most {VERTICES_MAX} vertices, 2047 cells along an axis");
        c.wrong(place, "eps_m", "is too fine for its size", expected);
        return BuiltSoft { spec, eps_m };
    };
    BuiltSoft { spec, eps_m }
}

fn segments(c: &mut Checker<'_, '_>, place: &Place, key: &str, count: u32) -> u32 {
    c.number(place, key, f64::from(count), SOFT) as u32
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
        young_pa: c.number(place, "young_pa", shared.young_pa, MATTER),
        poisson: c.optional(place, "poisson", shared.poisson, MATTER).unwrap_or(POISSON_DEFAULT),
        density_kg_m3: c.optional(place, "density_kg_m3", shared.density_kg_m3, MATTER).unwrap_or(1050.0),
        damping_per_s: c.optional(place, "damping_per_s", shared.damping_per_s, MATTER).unwrap_or(0.0),
        damping_s: c.optional(place, "damping_s", shared.damping_s, MATTER).unwrap_or(0.0),
        law: shared.law,
    };
    SoftSpec {
        shape,
        nodes: None,
        matter,
        position: pose.position,
        rotation: pose.rotation,
        velocity: shared.velocity_m_s.map_or(DVec3::ZERO, |v| c.point(place, "velocity_m_s", v, SPEED_MAX)),
        held: shared.held,
        friction: c.optional(place, "friction", shared.friction, SOFT).unwrap_or(0.3),
        traits: context.traits,
        gravity: context.gravity,
        self_contact: shared.self_contact,
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
        _ => DVec3::ZERO,
    };
    let there = spec.position + spec.rotation * (at + half);
    let Body::Soft(start) = SoftBody::new(spec.clone()).ok()?.start() else { return None };
    let near = (0..).zip(&start.positions).min_by(|a, b| {
        let apart = |x: &DVec3| x.distance_squared(there);
        apart(a.1).total_cmp(&apart(b.1))
    });
    near.map(|(vertex, _)| Anchor::Vertex(vertex))
}
