//! Reads a sheet, solid or rope of a scene file as a [`SoftSpec`].

use super::common::{point, rotation};
use super::mesh::{self, Mesh};
use super::objects::ModelContext;
use super::scenery::{SurfaceSource, surface_source};
use super::soft_mesh;
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::format::{End, OneOrRange, RopeFile, SheetFile, SoftFile, SoftShapeKind, SolidFile};
use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body};
use metachron_drawable::generate_surface;
use metachron_geometry::{Aabb, Cage, Triangles, open_edge, subdivided};
use metachron_models::soft::{MaterialLaw, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec, VERTICES_MAX};
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
/// Reads a sheet; `None` where its shape is missing or cannot be used.
pub(super) fn sheet(
    c: &mut Checker<'_, '_>,
    soft: &SoftFile,
    file: &SheetFile,
    context: &ModelContext<'_>,
) -> Option<BuiltSoft> {
    let place = context.place;
    let is_mesh = file.file.is_some();
    let eps_m = if is_mesh { None } else { one_division(c, place, file.segments.is_some(), file.eps_m) };
    let shape = if is_mesh { soft_mesh::shell(c, file, context) } else { flat_sheet(c, place, file) }?;
    let held = file.hold.clone().unwrap_or_default();
    if let Some(none) = held.iter().find(|side| !side.of(&shape)) {
        let what = format_args!("names `{}`, which a flat sheet does not have", none.name());
        c.wrong(place, "hold", what, "expected `left`, `right`, `near` or `far`");
    }
    let half = if let SoftShape::Sheet { size_m: [x, y], .. } = shape {
        DVec3::new(0.5 * x, 0.5 * y, 0.0)
    } else {
        DVec3::ZERO
    };
    let material = SoftMaterial { poisson: file.poisson.unwrap_or(POISSON_DEFAULT), ..material(soft) };
    let rotation = rotation(file.rotation_deg);
    let position = point(file.position_m) - rotation * half;
    let spec = SoftSpec { position, rotation, material, held, ..spec(context, shape, soft) };
    Some(divided(c, place, spec, eps_m))
}

/// The shape of a flat sheet; `None` where its size is missing, which is reported.
fn flat_sheet(c: &mut Checker<'_, '_>, place: &Place, file: &SheetFile) -> Option<SoftShape> {
    if file.scale.is_some() {
        c.wrong(place, "scale", "has no `file` that it belongs to", "expected no such key here");
    }
    let Some(size_m) = file.size_m else {
        c.wrong(place, "size_m", "is missing", "a sheet needs it, or `file`: expected `size_m` in this table");
        return None;
    };
    Some(SoftShape::Sheet { size_m, thickness_m: file.thickness_m, segments: file.segments.unwrap_or([1; 2]) })
}

/// A soft body and the spacings that it may take; none where its division never changes.
pub(super) struct BuiltSoft {
    pub(super) spec: SoftSpec,
    pub(super) eps_m: Option<(f64, f64)>,
}

/// Reads a solid; `None` where its dimensions are missing.
pub(super) fn solid(
    c: &mut Checker<'_, '_>,
    soft: &SoftFile,
    file: &SolidFile,
    context: &ModelContext<'_>,
) -> Option<BuiltSoft> {
    let place = context.place;
    check_solid_keys(c, place, file);
    let eps_m = file.eps_m.map(OneOrRange::ends);
    let mut shape = solid_shape(c, file, context, eps_m)?;
    let held = file.hold.clone().unwrap_or_default();
    if file.shape == SoftShapeKind::Ball && !held.is_empty() {
        c.wrong(place, "hold", "names faces, which a ball does not have", "expected no such key for a ball");
    }
    let poisson = file.poisson.unwrap_or(POISSON_DEFAULT);
    let law = soft_mesh::law(c, place, file.law, file.exponent, poisson);
    let material = SoftMaterial { poisson, law, ..material(soft) };
    match (&mut shape, &file.regions) {
        (SoftShape::Tetrahedra { mesh, regions }, Some(files)) => {
            *regions = soft_mesh::regions(c, place, files, mesh, &material);
        }
        (_, Some(_)) => {
            c.wrong(place, "regions", "do not belong to this shape", "expected them with a mesh of tetrahedra alone");
        }
        _ => {}
    }
    let half = if let SoftShape::Box { size_m, .. } = shape { 0.5 * size_m } else { DVec3::ZERO };
    let (rotation, self_contact) = (rotation(file.rotation_deg), soft.self_contact.unwrap_or(false));
    let position = point(file.position_m) - rotation * half;
    let eps_touched_m = file.eps_touched_m.filter(|_| eps_m.is_some());
    let spec =
        SoftSpec { position, rotation, material, held, self_contact, eps_touched_m, ..spec(context, shape, soft) };
    Some(BuiltSoft { spec, eps_m })
}

/// Reports keys that belong to another shape, and missing keys.
fn check_solid_keys(c: &mut Checker<'_, '_>, place: &Place, file: &SolidFile) {
    let (name, needed, foreign): (_, Option<&str>, &[&str]) = match file.shape {
        SoftShapeKind::Box => ("box", Some("size_m"), &["radius_m", "file", "generate", "seed", "triangles", "scale"]),
        SoftShapeKind::Ball => {
            ("ball", Some("radius_m"), &["size_m", "file", "generate", "seed", "triangles", "scale"])
        }
        SoftShapeKind::Mesh => ("mesh", None, &["size_m", "radius_m", "segments"]),
    };
    c.refuse(place, foreign, format_args!("does not belong to a {name}"), "expected no such key here");
    for key in needed.into_iter().filter(|key| c.given(place, &[key]).is_empty()).collect::<Vec<_>>() {
        c.wrong(place, key, "is missing", format!("a {name} needs it: expected `{key}` in this table"));
    }
    match (file.segments, file.eps_m) {
        (Some(_), Some(_)) => c.wrong(place, "segments", "contradicts `eps_m`", "expected one of them"),
        (None, None) if name != "mesh" => c.wrong(place, "segments", "is missing", "expected `segments` or `eps_m`"),
        _ => {}
    }
    if file.eps_m.is_none() {
        let what = "has no cage whose cells it would halve";
        c.refuse(place, &["eps_touched_m"], what, "expected `eps_m`, or no such key here");
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
        let finest_m = SoftSpec::finest_m(range_m, file.eps_touched_m);
        let surface = subdivided(&surface, CELL_DIAGONAL * finest_m, SKIN_TRIANGLES_MAX);
        return Some(SoftShape::Embedded { surface: Arc::new(surface), eps_m: range_m.0, range_m });
    }
    // so is the skin of a box or ball with an ε as fine as its finest cells
    let finest_m = eps_m.map(|range| SoftSpec::finest_m(range, file.eps_touched_m));
    let fitted = |size: f64| finest_m.map(|finest_m| (size / finest_m).ceil().clamp(1.0, 2047.0) as u32);
    let lattice = if file.shape == SoftShapeKind::Box {
        let size = file.size_m?;
        let segments = file.segments.or_else(|| Some([fitted(size[0])?, fitted(size[1])?, fitted(size[2])?]))?;
        SoftShape::Box { size_m: size.into(), segments }
    } else {
        let radius_m = file.radius_m?;
        let cells: [u32; 3] = file.segments.or_else(|| Some([fitted(2.0 * radius_m)?.max(2); 3]))?;
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
    let scale = file.scale.unwrap_or(1.0);
    let (key, read) = match surface_source(c, place, file.file.as_deref(), file.generate)? {
        SurfaceSource::File(name) if !c.may_read(place, "file", context.source.head(name), Cost::soft_of_file) => {
            return None;
        }
        SurfaceSource::File(name) => ("file", context.source.sibling(name).and_then(|bytes| mesh::read(&bytes, scale))),
        SurfaceSource::Generated(kind) => {
            let triangles = file.triangles.unwrap_or(4000);
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
pub(super) fn rope(c: &mut Checker<'_, '_>, soft: &SoftFile, file: &RopeFile, context: &ModelContext<'_>) -> BuiltSoft {
    let path_m = file.path_m.iter().map(|at| DVec3::from(*at)).collect();
    let end = |end: &End| if *end == End::Start { Side::Left } else { Side::Right };
    let held = file.hold.iter().flatten().map(end).collect();
    let eps_m = one_division(c, context.place, file.segments.is_some(), file.eps_m);
    let shape = SoftShape::Rope { path_m, radius_m: file.radius_m, segments: file.segments.unwrap_or(1) };
    divided(c, context.place, SoftSpec { held, ..spec(context, shape, soft) }, eps_m)
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
    eps_m.map(OneOrRange::ends)
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

/// The material of a soft body, as far as all have it.
fn material(soft: &SoftFile) -> SoftMaterial {
    SoftMaterial {
        young_pa: soft.young_pa,
        poisson: POISSON_DEFAULT,
        density_kg_m3: soft.density_kg_m3.unwrap_or(1050.0),
        damping_per_s: soft.damping_per_s.unwrap_or(0.0),
        damping_s: soft.damping_s.unwrap_or(0.0),
        law: MaterialLaw::default(),
    }
}

/// A soft body in its own axes.
fn spec(context: &ModelContext<'_>, shape: SoftShape, soft: &SoftFile) -> SoftSpec {
    SoftSpec {
        shape,
        nodes: None,
        eps_touched_m: None,
        material: material(soft),
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        velocity: point(soft.velocity_m_s),
        held: Vec::new(),
        friction: soft.friction.unwrap_or(0.3),
        traits: context.traits,
        gravity: context.gravity,
        self_contact: soft.self_contact.unwrap_or(true),
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
