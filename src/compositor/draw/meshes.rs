//! Meshes on the GPU, made when a level is first drawn and kept.
//!
//! In: levels that a picture uses. Out: vertex and index buffers. Never here: instances.

use super::{MeshKey, Picture};
use glam::Vec3;
use metachron_agents::N_MAX;
use metachron_agents::shape::{PrimitiveMesh, PrimitiveVertex, patch};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// Vertices, triangles and edges of one mesh.
#[derive(Debug)]
pub struct Mesh {
    vertices: wgpu::Buffer,
    triangles: wgpu::Buffer,
    corners: u32,
    edges: wgpu::Buffer,
    ends: u32,
}

impl Mesh {
    fn new(device: &wgpu::Device, vertices: &[u8], triangles: &[[u32; 3]]) -> Self {
        let buffer = |label, contents, usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let edges = edges_of(triangles);
        Self {
            vertices: buffer("mesh vertices", vertices, wgpu::BufferUsages::VERTEX),
            triangles: buffer("mesh triangles", bytemuck::cast_slice(triangles), wgpu::BufferUsages::INDEX),
            corners: 3 * triangles.len() as u32,
            edges: buffer("mesh edges", bytemuck::cast_slice(&edges), wgpu::BufferUsages::INDEX),
            ends: 2 * edges.len() as u32,
        }
    }

    /// Draws `count` instances, as triangles or as edges; the number of draws.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, edges: bool, count: u32) -> u32 {
        let (indices, corners) = if edges { (&self.edges, self.ends) } else { (&self.triangles, self.corners) };
        if corners == 0 || count == 0 {
            return 0;
        }
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..corners, 0, 0..count);
        1
    }
}

/// Every edge of some triangles once.
fn edges_of(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let once: BTreeSet<_> = sides.map(|(a, b)| [a.min(b), a.max(b)]).collect();
    once.into_iter().collect()
}

/// All meshes a renderer has made.
#[derive(Debug, Default)]
pub struct Meshes {
    patches: [Option<Mesh>; N_MAX as usize + 1],
    solids: HashMap<MeshKey, Mesh>,
    given: Option<Arc<[PrimitiveMesh]>>,
}

impl Meshes {
    /// Makes what `picture` needs and is not there yet.
    pub fn prepare(&mut self, device: &wgpu::Device, picture: &Picture) {
        if self.given.as_ref().is_none_or(|given| !Arc::ptr_eq(given, &picture.meshes)) {
            self.solids.retain(|key, _| !matches!(key, MeshKey::Given(_)));
            self.given = Some(Arc::clone(&picture.meshes));
        }
        for tube in &picture.tubes {
            for n in [tube.n, tube.n.min(super::SHADOW_LEVEL)] {
                if let Some(slot @ None) = self.patches.get_mut(usize::from(n)) {
                    *slot = Some(patch_mesh(device, n));
                }
            }
        }
        for run in &picture.solids {
            self.solids.entry(run.mesh).or_insert_with(|| solid_mesh(device, run.mesh, &picture.meshes));
        }
    }

    /// The patch of level `n`.
    pub fn patch(&self, n: u8) -> Option<&Mesh> {
        self.patches.get(usize::from(n))?.as_ref()
    }

    /// The mesh of solids.
    pub fn solid(&self, key: MeshKey) -> Option<&Mesh> {
        self.solids.get(&key)
    }
}

fn patch_mesh(device: &wgpu::Device, n: u8) -> Mesh {
    let vertices: Vec<[f32; 4]> = patch::patch_vertices(n).iter().map(|v| [v.u, v.turn, v.cos, v.sin]).collect();
    let triangles: Vec<[u32; 3]> = patch::patch_triangles(n).iter().map(|t| t.map(u32::from)).collect();
    Mesh::new(device, bytemuck::cast_slice(&vertices), &triangles)
}

fn solid_mesh(device: &wgpu::Device, key: MeshKey, given: &[PrimitiveMesh]) -> Mesh {
    let made;
    let mesh = match key {
        MeshKey::Primitive(primitive, n) => {
            made = primitive.mesh(n);
            &made
        }
        MeshKey::Slab(cells) => {
            made = slab(cells);
            &made
        }
        MeshKey::Given(number) => match given.get(number as usize) {
            Some(mesh) => mesh,
            None => &PrimitiveMesh::default(),
        },
    };
    let vertices: Vec<[[f32; 3]; 2]> = mesh.vertices.iter().map(|v| [v.core.to_array(), v.normal.to_array()]).collect();
    Mesh::new(device, bytemuck::cast_slice(&vertices), &mesh.triangles)
}

/// A box of half extents 1 with flat sides, cut into `cells` along x, y and z.
fn slab(cells: [u8; 3]) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    for axis in 0..3 {
        let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-1.0_f32, 1.0] {
            add_face(&mut mesh, (axis, right, up), side, [cells[right], cells[up]].map(u32::from));
        }
    }
    mesh
}

/// One side of a box of half extents 1: a grid of `columns` × `rows` cells along the axes `right` and `up`.
fn add_face(mesh: &mut PrimitiveMesh, (axis, right, up): (usize, usize, usize), side: f32, [columns, rows]: [u32; 2]) {
    let first = mesh.vertices.len() as u32;
    let mut normal = Vec3::ZERO;
    normal[axis] = side;
    for row in 0..=rows {
        for column in 0..=columns {
            let mut core = normal;
            core[right] = 2.0 * column as f32 / columns as f32 - 1.0;
            core[up] = 2.0 * row as f32 / rows as f32 - 1.0;
            mesh.vertices.push(PrimitiveVertex { core, normal });
        }
    }
    let at = |column: u32, row: u32| first + row * (columns + 1) + column;
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| at(column + i, row + j));
        let turned = |t: [u32; 3]| if side > 0.0 { t } else { [t[0], t[2], t[1]] };
        mesh.triangles.extend([turned([a, b, c]), turned([a, c, d])]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slabs_are_closed_and_face_outward() {
        for cells in [[1, 1, 1], [7, 5, 1], [1, 6, 2]] {
            let mesh = slab(cells);
            let [x, y, z] = cells.map(usize::from);
            assert_eq!(mesh.triangles.len(), 4 * (x * y + y * z + z * x));
            let mut six_volumes = 0.0;
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
                let out = (b.core - a.core).cross(c.core - a.core);
                assert!(out.dot(a.normal) > 0.0, "{cells:?}");
                six_volumes += a.core.dot(b.core.cross(c.core));
            }
            // a closed surface of a cube of side 2 holds 8; a few hundred sums of f32
            assert!((six_volumes / 6.0 - 8.0).abs() < 1e-4, "{cells:?}: {six_volumes}");
        }
    }
}
