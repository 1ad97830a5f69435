//! Corners of triangles: a point has one for every side of an edge, each with a normal.
//!
//! In: a surface. Out: its corners; their points and normals, also after its points have moved. Never here: files.

use super::super::surface::Surface;
use glam::DVec3;
use std::collections::BTreeMap;

/// The cosine of the greatest angle between triangles that share a normal: wider ones meet in an edge.
const SMOOTH_COS: f64 = 0.7;

/// The corners of a surface.
pub(super) struct Corners {
    all: Vec<Corner>,
    /// The corners of each triangle.
    pub indices: Vec<u32>,
}

struct Corner {
    point: u32,
    /// The triangles whose mean normal by area it has.
    triangles: Vec<usize>,
}

impl Corners {
    /// At a point, triangles that meet smoothly share a corner.
    pub fn of(surface: &Surface) -> Self {
        let areas = doubled_areas(surface, &surface.points);
        let mut around = vec![Vec::new(); surface.points.len()];
        for (k, triangle) in surface.triangles.iter().enumerate() {
            triangle.iter().for_each(|p| around[*p as usize].push(k));
        }
        let (mut into, mut known) = (Self { all: vec![], indices: vec![] }, BTreeMap::new());
        for (triangle, area) in surface.triangles.iter().zip(&areas) {
            let own = area.normalize_or_zero();
            for point in triangle {
                let mut near = around[*point as usize].clone();
                near.retain(|k| areas[*k].normalize_or_zero().dot(own) >= SMOOTH_COS);
                let place = *known.entry((*point, normal(&near, &areas).map(f32::to_bits))).or_insert_with(|| {
                    into.all.push(Corner { point: *point, triangles: near });
                    into.all.len() as u32 - 1
                });
                into.indices.push(place);
            }
        }
        into
    }

    /// Where the corners are, of the surface's points.
    pub fn points(&self, points: &[DVec3]) -> Vec<[f32; 3]> {
        self.all.iter().map(|corner| points[corner.point as usize].as_vec3().to_array()).collect()
    }

    /// Their normals where the points of the surface are these.
    pub fn normals(&self, surface: &Surface, points: &[DVec3]) -> Vec<[f32; 3]> {
        let areas = doubled_areas(surface, points);
        self.all.iter().map(|corner| normal(&corner.triangles, &areas)).collect()
    }
}

fn normal(triangles: &[usize], areas: &[DVec3]) -> [f32; 3] {
    triangles.iter().map(|k| areas[*k]).sum::<DVec3>().normalize_or(DVec3::Z).as_vec3().to_array()
}

/// Along the normals of the triangles, each as long as twice the area.
fn doubled_areas(surface: &Surface, points: &[DVec3]) -> Vec<DVec3> {
    let corner = |t: &[u32; 3]| t.map(|p| points[p as usize]);
    surface.triangles.iter().map(corner).map(|[a, b, c]| (b - a).cross(c - a)).collect()
}
