//! Meshes as they are given: normals for triangle meshes and convex hulls.
//!
//! In: points and triangles, places on a texture. Out: a [`PrimitiveMesh`] whose core is in metres (extents 1, radius 0).
//! Never here: levels; a mesh is drawn as it is.

use super::{PrimitiveMesh, PrimitiveVertex};
use glam::{DVec3, Vec2, Vec3};
use rapier3d::parry::transformation::try_convex_hull;
use std::sync::Arc;

/// Edges that turn by more than this stay sharp: the cosine of 40°.
const CREASE_COS: f64 = 0.766;

/// Normals for a triangle mesh: smooth over gentle edges, sharp at creases past 40°.
///
/// Triangles that name a missing point or have no area are left out.
#[must_use]
pub fn creased_mesh(points_m: &[DVec3], triangles: &[[u32; 3]]) -> PrimitiveMesh {
    painted_mesh(points_m, &[], triangles)
}

/// The same with the place of each point on a texture; missing ones are 0, and so are those that are no number.
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
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); points_m.len()];
    for (number, (t, _)) in faces.iter().enumerate() {
        t.iter().for_each(|&i| around[i as usize].push(number));
    }
    let mut mesh = PrimitiveMesh::default();
    for (t, face) in &faces {
        let first = mesh.vertices.len() as u32;
        let own = face.normalize();
        for &i in t {
            let gentle = |&&other: &&usize| faces[other].1.normalize().dot(own) > CREASE_COS;
            let sum: DVec3 = around[i as usize].iter().filter(gentle).map(|&other| faces[other].1).sum();
            let normal = sum.try_normalize().unwrap_or(own).as_vec3();
            let uv = uvs.get(i as usize).copied().filter(|uv| uv.is_finite()).unwrap_or_default();
            mesh.vertices.push(PrimitiveVertex { core: points_m[i as usize].as_vec3(), normal, uv });
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
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
            // on every face of a cube the normal is an axis
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
}
