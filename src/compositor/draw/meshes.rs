//! Meshes on the GPU, made when a level is first drawn and kept.
//!
//! In: levels that a picture uses. Out: vertex and index buffers. Never here: instances.

use super::{MeshKey, Picture};
use metachron_agents::N_MAX;
use metachron_agents::shape::{PrimitiveMesh, patch};
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
        MeshKey::Given(number) => match given.get(number as usize) {
            Some(mesh) => mesh,
            None => &PrimitiveMesh::default(),
        },
    };
    let vertices: Vec<[[f32; 3]; 2]> = mesh.vertices.iter().map(|v| [v.core.to_array(), v.normal.to_array()]).collect();
    Mesh::new(device, bytemuck::cast_slice(&vertices), &mesh.triangles)
}
