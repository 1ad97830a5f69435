//! Reads the meshes that soft bodies take from files as they are: solids of tetrahedra, sheets of open surfaces; and
//! their materials.
//!
//! In: the bytes of a file. Out: shapes of soft bodies, every fault reported with its key. Never here: closed surfaces in cages ([`super::soft`]).

use super::mesh;
use super::objects::ModelContext;
use super::soft::too_large;
use super::tetrahedra;
use crate::check::{Checker, Place};
use crate::demand::Cost;
use crate::format::{LawKind, RegionFile, SheetFile, SolidFile};
use metachron_core::NumberRange;
use metachron_geometry::{Aabb, Tetrahedra, Triangles, branch, opposed, pieces, welded};
use metachron_models::soft::{MaterialLaw, RegionMaterial, SoftMaterial, SoftShape, VERTICES_MAX};
use std::sync::Arc;

/// The law that the keys of a scene name, for this Poisson's ratio; keys that do not belong together are reported.
pub(super) fn law(
    c: &mut Checker<'_, '_>,
    place: &Place,
    kind: Option<LawKind>,
    exponent: Option<f64>,
    poisson: f64,
) -> MaterialLaw {
    match (kind, exponent) {
        (Some(LawKind::Ogden), Some(exponent)) => {
            let size = c.number(place, "exponent", exponent.abs(), NumberRange::new(1.0, 20.0, "or its negative"));
            // λ + 2 μ/a > 0: else it would push back less the more it is compressed
            let least = 1.0 / (size + 2.0);
            if exponent < 0.0 && poisson <= least {
                let what = format!("is {exponent} with a Poisson's ratio of {poisson}");
                c.wrong(place, "exponent", what, format!("expected a ratio above {least:.3} for a negative exponent"));
            }
            MaterialLaw::Ogden { exponent: size.copysign(exponent) }
        }
        (Some(LawKind::Ogden), None) => {
            c.wrong(place, "exponent", "is missing", "the law `ogden` needs it: expected 1 to 20, or -20 to -1");
            MaterialLaw::default()
        }
        (_, Some(_)) => {
            c.wrong(place, "exponent", "has no law that it belongs to", "expected `law = \"ogden\"` beside it");
            MaterialLaw::default()
        }
        (Some(LawKind::NeoHookean), None) => MaterialLaw::NeoHookean,
        (Some(LawKind::Corotational) | None, None) => MaterialLaw::Corotational,
    }
}

/// The tetrahedra of the file of a solid, where it is such a file; `Some(None)` where it cannot be used, which is reported.
pub(super) fn tetrahedra_of(
    c: &mut Checker<'_, '_>,
    file: &SolidFile,
    context: &ModelContext<'_>,
) -> Option<Option<SoftShape>> {
    let (place, name) = (context.place, file.file.as_deref()?);
    let head = match context.source.head(name) {
        Ok(head) => head,
        Err(why) => {
            c.wrong(place, "file", format!("cannot be used: {name}: {why}"), "expected a mesh beside the scene");
            return Some(None);
        }
    };
    if !tetrahedra::is_volume(name, &head.start) {
        return None;
    }
    let what = format_args!("does not belong to {name}: a mesh of tetrahedra is taken as it is");
    let expected = "expected no such key, or a closed surface of triangles as the file";
    c.refuse(place, &["eps_m", "generate", "seed", "triangles"], what, expected);
    let scale = file.scale.unwrap_or(1.0);
    if !c.may_make(place, "file", Cost::soft_of_file(&head)) {
        return Some(None);
    }
    let read = context.source.sibling(name).and_then(|bytes| tetrahedra::read(&bytes));
    let read = read.and_then(|mesh| solid(mesh, scale, file.scale.is_none()));
    Some(match read {
        Ok(mesh) => Some(SoftShape::Tetrahedra { mesh: Arc::new(mesh), regions: Vec::new() }),
        Err(why) => {
            c.wrong(place, "file", format!("cannot be used: {name}: {why}"), "expected one solid of tetrahedra");
            None
        }
    })
}

/// The mesh in metres, where it is one solid.
fn solid(mut mesh: Tetrahedra, scale: f64, scale_is_missing: bool) -> Result<Tetrahedra, String> {
    mesh.points.iter_mut().for_each(|point| *point *= scale);
    mesh.check().map_err(|fault| fault.to_string())?;
    few_enough(mesh.points.len())?;
    let Aabb { low, high } = Aabb::of(&mesh.points);
    mesh::within(low.abs().max(high.abs()).max_element() / scale, scale)?;
    too_large((high - low).max_element(), scale_is_missing)?;
    Ok(mesh)
}

/// The materials of the regions of a solid of tetrahedra with the material `matter`.
pub(super) fn regions(
    c: &mut Checker<'_, '_>,
    place: &Place,
    files: &[RegionFile],
    mesh: &Tetrahedra,
    material: &SoftMaterial,
) -> Vec<RegionMaterial> {
    let mut regions: Vec<RegionMaterial> = vec![];
    for (at, file) in files.iter().enumerate() {
        let here = place.entry("regions", at);
        let region = file.region;
        if !mesh.regions.contains(&region) {
            let mut known: Vec<String> = mesh.regions.iter().map(i64::to_string).collect();
            known.sort();
            known.dedup();
            known.truncate(10);
            let expected = if known.is_empty() {
                "the mesh has no regions".to_owned()
            } else {
                format!("expected one of the regions of the mesh: {}", known.join(", "))
            };
            c.wrong(&here, "region", format!("is {region}, which no tetrahedron has"), expected);
        }
        if regions.iter().any(|known| known.region == region) {
            c.wrong(&here, "region", format!("is {region}, which has a material already"), "expected each region once");
        }
        let poisson = file.poisson.unwrap_or(material.poisson);
        let own = law(c, &here, file.law, file.exponent, poisson);
        let law = if file.law.is_some() { own } else { material.law };
        let material = SoftMaterial {
            young_pa: file.young_pa,
            poisson,
            density_kg_m3: file.density_kg_m3.unwrap_or(material.density_kg_m3),
            law,
            ..*material
        };
        regions.push(RegionMaterial { region, material });
    }
    regions
}

/// The shape of a sheet that is a mesh; `None` where it cannot be used, which is reported.
pub(super) fn shell(c: &mut Checker<'_, '_>, file: &SheetFile, context: &ModelContext<'_>) -> Option<SoftShape> {
    let (place, name) = (context.place, file.file.as_deref()?);
    let keys = ["size_m", "segments", "eps_m"];
    c.refuse(place, &keys, "contradicts `file`", "expected one of them: a mesh is taken as it is");
    let (scale, thickness_m) = (file.scale.unwrap_or(1.0), file.thickness_m);
    if !c.may_read(place, "file", context.source.head(name), Cost::sheet_of_file) {
        return None;
    }
    let read = context.source.sibling(name).and_then(|bytes| mesh::read(&bytes, scale));
    match read.and_then(|mesh| sheet(&mesh, scale, file.scale.is_none())) {
        Ok(surface) => Some(SoftShape::Shell { surface: Arc::new(surface), thickness_m }),
        Err(why) => {
            let expected = "expected one surface of triangles, open or closed: STL, .glb or OBJ";
            c.wrong(place, "file", format!("cannot be used: {name}: {why}"), expected);
            None
        }
    }
}

/// The surface of a mesh in metres, where it can be a sheet of one piece.
fn sheet(mesh: &mesh::Mesh, scale: f64, scale_is_missing: bool) -> Result<Triangles, String> {
    let surface = manifold(mesh, scale)?;
    if let Some(triangle) = opposed(&surface) {
        return Err(format!(
            "triangle {}: it faces the other way than a neighbour: turn one of them round",
            triangle + 1
        ));
    }
    one_piece(&surface, "sheet")?;
    few_enough(surface.points.len())?;
    let Aabb { low, high } = Aabb::of(&surface.points);
    too_large((high - low).max_element(), scale_is_missing)?;
    Ok(surface)
}

/// The surface of a mesh in metres with one point for all that coincide, where at most two triangles share an edge.
pub(super) fn manifold(mesh: &mesh::Mesh, scale: f64) -> Result<Triangles, String> {
    let points = mesh.points.iter().map(|point| *point * scale).collect();
    let surface = welded(&Triangles { points, triangles: mesh.triangles.clone() });
    let Some(found) = branch(&surface.points, &surface.triangles, |_| 0) else { return Ok(surface) };
    let (number, sharing) = (found.triangle + 1, found.sharing);
    Err(format!("triangle {number}: it is not manifold: {sharing} triangles share one of its edges"))
}

/// Refuses a surface in several pieces; `what` it would be is one.
pub(super) fn one_piece(surface: &Triangles, what: &str) -> Result<(), String> {
    match pieces(surface) {
        0 | 1 => Ok(()),
        found => Err(format!(
            "it has {found} separate pieces, and a {what} is one: make each an object, and leave out what is within another"
        )),
    }
}

/// Refuses more points than a soft body may have.
fn few_enough(points: usize) -> Result<(), String> {
    if points as u64 <= VERTICES_MAX {
        Ok(())
    } else {
        Err(format!("it has {points} points, more than {VERTICES_MAX}"))
    }
}
