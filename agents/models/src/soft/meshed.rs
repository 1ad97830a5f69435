//! Division of a soft body as a mesh gives it: tetrahedra of a solid, triangles of a sheet.
//!
//! In: a mesh and its materials. Out: a [`FeMesh`]. Never here: the elements themselves, files.

use super::fe_mesh::{FeMesh, edges_of};
use super::grid::Side;
use super::material::Law;
use super::membrane::Membrane;
use super::shell_bending::{ShellBending, ShellMaterial};
use super::spec::{RegionMaterial, SoftMaterial, SoftSpec};
use super::tetrahedron::Tetrahedron;
use glam::{DVec2, DVec3};
use metachron_geometry::{Aabb, Tetrahedra, Triangles};
use std::collections::HashMap;

impl FeMesh {
    /// The tetrahedra of a mesh.
    pub fn tetrahedral(mesh: &Tetrahedra, regions: &[RegionMaterial], spec: &SoftSpec) -> Self {
        let mut division = Self::of_points(&mesh.points);
        let materials: Vec<SoftMaterial> =
            std::iter::once(spec.material).chain(regions.iter().map(|region| region.material)).collect();
        division.laws = materials.iter().map(Law::of).collect();
        for (at, corners) in mesh.corners.iter().enumerate() {
            let of_region = |number: &i64| regions.iter().position(|region| region.region == *number);
            let material = mesh.regions.get(at).and_then(of_region).map_or(0, |region| region + 1);
            let places = corners.map(|corner| mesh.points[corner as usize]);
            let element = Tetrahedron::new(*corners, places, material, materials[material].density_kg_m3);
            corners.iter().zip(element.mass_kg).for_each(|(corner, mass)| division.mass_kg[*corner as usize] += mass);
            division.tetrahedra.push(element);
        }
        division.triangles = mesh.boundary();
        let pairs = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, d, b], [c, d, a]];
        let inner: Vec<[u32; 3]> = mesh.corners.iter().flat_map(|corners| pairs(*corners)).collect();
        division.edges = edges_of(&division.triangles);
        division.stretched = edges_of(&inner);
        division.hold(&spec.held);
        division
    }

    /// A sheet of the triangles of a mesh.
    pub fn shell(surface: &Triangles, thickness_m: f64, spec: &SoftSpec) -> Self {
        let mut division = Self::of_points(&surface.points);
        division.radius_m = 0.5 * thickness_m;
        division.triangles.clone_from(&surface.triangles);
        for corners in &surface.triangles {
            let element = Membrane::new(*corners, flattened(&surface.points, *corners), thickness_m, &spec.material);
            corners.iter().zip(element.mass_kg()).for_each(|(at, mass)| division.mass_kg[*at as usize] += mass);
            division.membranes.push(element);
        }
        division.bend_shell(thickness_m, &spec.material);
        division.edges = edges_of(&division.triangles);
        division.hold(&spec.held);
        division
    }

    /// Lists how the triangles of a shell bend with those across their sides.
    pub fn bend_shell(&mut self, thickness_m: f64, material: &SoftMaterial) {
        let bent = ShellMaterial::new(material, thickness_m);
        // the corner across each side of a triangle, in the direction of the neighbour
        let mut across: HashMap<[u32; 2], u32> = HashMap::with_capacity(3 * self.triangles.len());
        for [a, b, c] in &self.triangles {
            across.extend([([*b, *a], *c), ([*c, *b], *a), ([*a, *c], *b)]);
        }
        let over = |[a, b, c]: [u32; 3]| [[b, c], [c, a], [a, b]].map(|side| across.get(&side).copied());
        let all = self.triangles.iter().map(|corners| ShellBending::new(*corners, over(*corners), &self.rest, &bent));
        self.shells = all.collect();
    }

    fn of_points(points: &[DVec3]) -> Self {
        let mut division = Self::default();
        division.rest = points.to_vec();
        division.mass_kg = vec![0.0; points.len()];
        division.held = vec![false; points.len()];
        division
    }

    /// Holds the vertices at sides of the box around it: those nearer to it than half a mean edge.
    fn hold(&mut self, sides: &[Side]) {
        let lengths = self.edges.iter().map(|[a, b]| self.rest[*a as usize].distance(self.rest[*b as usize]));
        let near_m = 0.5 * lengths.sum::<f64>() / self.edges.len().max(1) as f64;
        let Aabb { low, high } = Aabb::of(&self.rest);
        for side in sides {
            let (axis, last) = side.place();
            let from = if last { high[axis] } else { low[axis] };
            let at_side = |point: &DVec3| (point[axis] - from).abs() <= near_m;
            self.held.iter_mut().zip(&self.rest).for_each(|(held, point)| *held |= at_side(point));
        }
    }
}

/// The corners of a triangle in its own plane.
fn flattened(points: &[DVec3], corners: [u32; 3]) -> [DVec2; 3] {
    let [a, b, c] = corners.map(|corner| points[corner as usize]);
    let along = (b - a).normalize();
    let across = ((c - a) - along * (c - a).dot(along)).normalize();
    [a, b, c].map(|point| DVec2::new((point - a).dot(along), (point - a).dot(across)))
}
