//! Normals for given triangle meshes and convex hulls.
//!
//! In: points and triangles, texture coordinates. Out: a [`PrimitiveMesh`] whose core is in metres (extents 1, radius 0).
//! Never here: levels; a mesh is drawn unchanged.

use super::topology::places;
use crate::solids::parry_shapes::hull_triangles;
use crate::{CompoundPart, Primitive, PrimitiveMesh, PrimitiveVertex, Rounding, Solid};
use glam::{DVec3, Vec2, Vec3};
use rapier3d::parry::transformation::try_convex_hull;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Edges that turn by more than this stay sharp: the cosine of 40°.
const CREASE_COS: f64 = 0.766;
/// Where more faces than this meet at a point, faces of nearly equal normals are merged for smoothing.
const FACES_MAX: usize = 64;
/// Resolution of normals in that merge: 1/6 of a radian, 10°.
const WAYS: f64 = 6.0;

/// Normals for a triangle mesh: smooth over gentle edges, sharp at creases past 40°.
///
/// Triangles that refer to a missing point or have no area are left out.
#[must_use]
pub fn creased_mesh(points_m: &[DVec3], triangles: &[[u32; 3]]) -> PrimitiveMesh {
    painted_mesh(points_m, &[], triangles)
}

/// The same with texture coordinates for each point; missing and non-finite ones are 0.
///
/// Coincident points count as one for the normals: the texture has seams, the shading has none.
#[must_use]
pub fn painted_mesh(points_m: &[DVec3], uvs: &[Vec2], triangles: &[[u32; 3]]) -> PrimitiveMesh {
    let corner = |i: u32| points_m.get(i as usize).copied();
    let faces: Vec<([u32; 3], DVec3)> = triangles
        .iter()
        .filter_map(|t| {
            let (a, b, c) = (corner(t[0])?, corner(t[1])?, corner(t[2])?);
            let face = (b - a).cross(c - a);
            (face.length_squared() > 0.0).then_some((*t, face))
        })
        .collect();
    let place = places(points_m);
    let mut around: Vec<Vec<Facing>> = vec![Vec::new(); points_m.len()];
    for (t, face) in &faces {
        let facing = Facing { area: *face, way: face.normalize() };
        t.iter().for_each(|&i| around[place[i as usize] as usize].push(facing));
    }
    around.iter_mut().filter(|facing| facing.len() > FACES_MAX).for_each(|facing| *facing = gathered(facing));
    let mut mesh = PrimitiveMesh::default();
    for (t, face) in &faces {
        let first = mesh.vertices.len() as u32;
        let own = face.normalize();
        for &i in t {
            let gentle = around[place[i as usize] as usize].iter().filter(|other| other.way.dot(own) > CREASE_COS);
            let sum: DVec3 = gentle.map(|other| other.area).sum();
            let normal = sum.try_normalize().unwrap_or(own).as_vec3();
            let uv = uvs.get(i as usize).copied().filter(|uv| uv.is_finite()).unwrap_or_default();
            mesh.vertices.push(PrimitiveVertex { core: points_m[i as usize].as_vec3(), normal, uv });
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// Faces at a point with one normal.
#[derive(Debug, Clone, Copy)]
struct Facing {
    /// Twice their area, along their normal.
    area: DVec3,
    /// Their normal.
    way: DVec3,
}

/// Merges faces of nearly equal normals: the time for the normals of a fan stays proportional to its faces.
fn gathered(facing: &[Facing]) -> Vec<Facing> {
    let mut sums: BTreeMap<[i8; 3], DVec3> = BTreeMap::new();
    for face in facing {
        *sums.entry((face.way * WAYS).round().to_array().map(|x| x as i8)).or_default() += face.area;
    }
    sums.into_values().filter_map(|area| Some(Facing { area, way: area.try_normalize()? })).collect()
}

/// The convex hull of points as a mesh with sharp creases; `None` where the points span no volume.
#[must_use]
pub fn hull_mesh(points_m: &[DVec3]) -> Option<PrimitiveMesh> {
    let points: Vec<Vec3> = points_m.iter().map(|p| p.as_vec3()).collect();
    let (points, triangles) = try_convex_hull(&points).ok()?;
    let points: Arc<[DVec3]> = points.iter().map(|p| p.as_dvec3()).collect();
    let mesh = creased_mesh(&points, &triangles);
    (!mesh.triangles.is_empty()).then_some(mesh)
}

/// The level of primitives in the mesh of a compound.
const PART_LEVEL: u8 = 4;

/// All parts of a compound as one mesh.
#[must_use]
pub fn compound_mesh(parts: &[CompoundPart]) -> PrimitiveMesh {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for CompoundPart { solid, position_m, rotation, .. } in parts {
        let first = points.len() as u32;
        let (corners, faces) = surface_of(solid);
        points.extend(corners.into_iter().map(|corner| *position_m + *rotation * corner));
        triangles.extend(faces.into_iter().map(|face| face.map(|corner| first + corner)));
    }
    creased_mesh(&points, &triangles)
}

/// A surface of a solid, in its own axes.
fn surface_of(solid: &Solid) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    if let Some((primitive, Rounding { extents, radius_m })) = Primitive::of(solid, PART_LEVEL) {
        let mesh = primitive.mesh(PART_LEVEL);
        let corner = |v: &PrimitiveVertex| (v.core * extents + v.normal * radius_m).as_dvec3();
        return (mesh.vertices.iter().map(corner).collect(), mesh.triangles.clone());
    }
    match solid {
        Solid::Hull { points_m } => {
            hull_triangles(points_m).map_or_else(|_| Default::default(), |h| (h.points, h.triangles))
        }
        Solid::Mesh { points_m, triangles } => (points_m.to_vec(), triangles.to_vec()),
        _ => Default::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<DVec3> {
        (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1))).collect()
    }

    #[test]
    fn hull_of_a_cube_keeps_its_edges_sharp() {
        let mesh = hull_mesh(&cube()).unwrap();
        assert_eq!(mesh.triangles.len(), 12);
        for v in &mesh.vertices {
            // normals on every face of a cube are along an axis
            assert!((v.normal.abs().max_element() - 1.0).abs() < 1e-6, "{}", v.normal);
        }
    }

    #[test]
    fn points_in_one_plane_have_no_hull() {
        let flat: Vec<_> = cube().into_iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect();
        assert!(hull_mesh(&flat).is_none_or(|mesh| mesh.triangles.len() <= 4));
        assert!(hull_mesh(&[]).is_none());
    }

    #[test]
    fn broken_triangles_are_left_out() {
        let mesh = creased_mesh(&cube(), &[[0, 1, 2], [0, 0, 1], [0, 1, 99]]);
        assert_eq!(mesh.triangles.len(), 1);
    }
    #[test]
    fn a_seam_of_doubled_points_keeps_smooth_normals() {
        // a roof of 20° with its ridge along y, once shared and once doubled
        let height = 0.5 * libm::tan(20.0_f64.to_radians() / 2.0);
        let ridge = [DVec3::new(0.5, 0.0, height), DVec3::new(0.5, 1.0, height)];
        let mut points = vec![DVec3::ZERO, ridge[0], ridge[1], DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
        let faces = [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]];
        let whole = creased_mesh(&points, &faces);
        points.extend(ridge);
        let seamed = creased_mesh(&points, &[faces[0], faces[1], [6, 4, 5], [6, 5, 7]]);
        assert_eq!(whole, seamed);
    }

    #[test]
    fn the_tip_of_a_cone_of_many_faces_has_the_normals_of_one_of_few() {
        let cone = |sides: u32| {
            let angle = |i: u32| std::f64::consts::TAU * f64::from(i % sides) / f64::from(sides);
            let rim = (0..sides).map(|i| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.0));
            let points: Vec<DVec3> = std::iter::once(DVec3::Z).chain(rim).collect();
            let fan: Vec<[u32; 3]> = (0..sides).map(|i| [0, 1 + i, 1 + (i + 1) % sides]).collect();
            creased_mesh(&points, &fan)
        };
        // faces within 40° are smoothed: with 64 faces each is treated individually, with 20,000 they are merged by directions 10° apart
        for (few, many) in [(0, 0), (16, 5000), (40, 12_500)] {
            let [a, b] = [(64, few), (20_000, many)].map(|(sides, face)| cone(sides).vertices[3 * face].normal);
            assert!(a.dot(b) > 0.99, "{a} {b}");
        }
    }
}
