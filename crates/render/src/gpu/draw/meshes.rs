//! Meshes on the GPU, made when a level is first drawn and cached.
//!
//! In: levels that a picture uses. Out: vertex and index buffers. Never here: instances.

use crate::composition::mesh_corner::MeshCorner;
use crate::composition::picture::{MeshKey, Picture};
use glam::Vec3;
use metachron_core::N_MAX;
use metachron_drawable::{Foliage, Model, PieceKind, Stroke};
use metachron_geometry::{PrimitiveMesh, PrimitiveVertex, patch};
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
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

    /// The vertex buffer.
    pub fn vertices(&self) -> wgpu::BufferSlice<'_> {
        self.vertices.slice(..)
    }

    /// Draws `count` instances, as triangles or as edges; returns the number of draws.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, edges: bool, count: u32) -> u32 {
        self.draw_part(pass, edges, 0..u32::MAX, count)
    }

    /// Draws some of its triangles (all edges, if edges are requested) for `count` instances; returns the number of draws.
    pub fn draw_part(&self, pass: &mut wgpu::RenderPass<'_>, edges: bool, triangles: Range<u32>, count: u32) -> u32 {
        let corner = |triangle: u32| self.corners.min(triangle.saturating_mul(3));
        let part = corner(triangles.start)..corner(triangles.end);
        let (indices, corners) = if edges { (&self.edges, 0..self.ends) } else { (&self.triangles, part) };
        if corners.is_empty() || count == 0 {
            return 0;
        }
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(corners, 0, 0..count);
        1
    }
}

/// Every edge of the triangles once.
fn edges_of(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let once: BTreeSet<_> = sides.map(|(a, b)| [a.min(b), a.max(b)]).collect();
    once.into_iter().collect()
}

/// Foliage on the GPU.
#[derive(Debug)]
struct FoliageMeshes {
    kind: PieceKind,
    /// All pieces in full; leaves turn to the camera too.
    full: Mesh,
    strokes: Mesh,
}

/// All meshes a renderer has made.
#[derive(Debug, Default)]
pub struct Meshes {
    patches: [Option<Mesh>; N_MAX as usize + 1],
    solids: HashMap<MeshKey, Mesh>,
    custom: Option<Arc<[PrimitiveMesh]>>,
    /// Foliage by model.
    foliage: HashMap<u32, FoliageMeshes>,
    models: Option<Arc<[Model]>>,
}

impl Meshes {
    /// Makes the meshes that `picture` needs and that are missing.
    pub fn prepare(&mut self, device: &wgpu::Device, picture: &Picture) {
        if self.custom.as_ref().is_none_or(|custom| !Arc::ptr_eq(custom, &picture.meshes)) {
            self.solids.retain(|key, _| !matches!(key, MeshKey::Custom(_)));
            self.custom = Some(Arc::clone(&picture.meshes));
        }
        for tube in &picture.tubes {
            for n in [tube.n, tube.n.min(super::passes::SHADOW_LEVEL)] {
                if let Some(slot @ None) = self.patches.get_mut(usize::from(n)) {
                    *slot = Some(patch_mesh(device, n));
                }
            }
        }
        if self.models.as_ref().is_none_or(|models| !Arc::ptr_eq(models, &picture.models)) {
            self.foliage.clear();
            self.models = Some(Arc::clone(&picture.models));
        }
        for run in &picture.solids {
            match run.kind.mesh {
                MeshKey::Cut(..) | MeshKey::Geomorph(..) => {}
                MeshKey::Pieces(model, _) | MeshKey::Strokes(model, ..) => self.make_foliage(device, picture, model),
                key => {
                    self.solids.entry(key).or_insert_with(|| solid_mesh(device, key, &picture.meshes));
                }
            }
        }
    }

    fn make_foliage(&mut self, device: &wgpu::Device, picture: &Picture, model: u32) {
        let Some(Model::Foliage(foliage)) = picture.models.get(model as usize) else { return };
        self.foliage.entry(model).or_insert_with(|| FoliageMeshes::new(device, foliage));
    }

    /// The pieces of foliage in full.
    pub fn pieces(&self, model: u32) -> Option<&Mesh> {
        self.foliage.get(&model).map(|foliage| &foliage.full)
    }

    /// The strokes of foliage.
    pub fn strokes(&self, model: u32) -> Option<&Mesh> {
        self.foliage.get(&model).map(|foliage| &foliage.strokes)
    }

    /// Whether a mesh consists of pieces that turn to the camera: points, lines, leaves.
    pub fn turns(&self, key: MeshKey) -> bool {
        match key {
            MeshKey::Strokes(..) => true,
            MeshKey::Pieces(model, _) => self.foliage.get(&model).is_some_and(|f| f.kind == PieceKind::Leaf),
            _ => false,
        }
    }

    /// The patch of level `n`.
    pub fn patch(&self, n: u8) -> Option<&Mesh> {
        self.patches.get(usize::from(n))?.as_ref()
    }

    /// The mesh of a kind of solid.
    pub fn solid(&self, key: MeshKey) -> Option<&Mesh> {
        self.solids.get(&key)
    }
}

fn patch_mesh(device: &wgpu::Device, n: u8) -> Mesh {
    let vertices: Vec<[f32; 4]> = patch::patch_vertices(n).iter().map(|v| [v.u, v.turn, v.cos, v.sin]).collect();
    let triangles: Vec<[u32; 3]> = patch::patch_triangles(n).iter().map(|t| t.map(u32::from)).collect();
    Mesh::new(device, bytemuck::cast_slice(&vertices), &triangles)
}

fn solid_mesh(device: &wgpu::Device, key: MeshKey, custom: &[PrimitiveMesh]) -> Mesh {
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
        MeshKey::Custom(number) => match custom.get(number as usize) {
            Some(mesh) => mesh,
            None => &PrimitiveMesh::default(),
        },
        MeshKey::Cut(..) | MeshKey::Geomorph(..) | MeshKey::Pieces(..) | MeshKey::Strokes(..) => {
            &PrimitiveMesh::default()
        }
    };
    primitive_mesh(device, mesh)
}

/// The mesh of one stroke: its corners by the shader's numbers, and its triangles.
struct StrokeShape {
    corners: &'static [u8],
    triangles: &'static [[u32; 3]],
}

const POINT: StrokeShape = StrokeShape { corners: &[0, 1, 2], triangles: &[[0, 1, 2]] };
const LINE: StrokeShape = StrokeShape { corners: &[4, 5, 6, 7], triangles: &[[0, 1, 2], [0, 2, 3]] };
const LEAF: StrokeShape = StrokeShape { corners: &[8, 9, 10, 11], triangles: &[[0, 1, 2], [0, 2, 3]] };

impl FoliageMeshes {
    fn new(device: &wgpu::Device, foliage: &Foliage) -> Self {
        let kind = foliage.kind();
        let (full, point_or_line) = match kind {
            PieceKind::Bough => (primitive_mesh(device, foliage.mesh()), &LINE),
            PieceKind::Leaf => (strokes_mesh(device, foliage.strokes(), &LEAF), &POINT),
        };
        Self { kind, full, strokes: strokes_mesh(device, foliage.strokes(), point_or_line) }
    }
}

fn strokes_mesh(device: &wgpu::Device, strokes: &[Stroke], shape: &StrokeShape) -> Mesh {
    let corner = |s: &Stroke, c: u8| [s.from.extend(s.radius_m).to_array(), s.way.extend(f32::from(c)).to_array()];
    let vertices: Vec<[[f32; 4]; 2]> =
        strokes.iter().flat_map(|stroke| shape.corners.iter().map(move |&c| corner(stroke, c))).collect();
    let stride = shape.corners.len() as u32;
    let face = |i: u32| shape.triangles.iter().map(move |t| t.map(|c| i * stride + c));
    let triangles: Vec<[u32; 3]> = (0..strokes.len() as u32).flat_map(face).collect();
    Mesh::new(device, bytemuck::cast_slice(&vertices), &triangles)
}

fn primitive_mesh(device: &wgpu::Device, mesh: &PrimitiveMesh) -> Mesh {
    let vertices: Vec<MeshCorner> = mesh.vertices.iter().map(MeshCorner::from).collect();
    Mesh::new(device, bytemuck::cast_slice(&vertices), &mesh.triangles)
}

/// A box of half extents 1 with flat sides, cut into `cells` along x, y and z.
fn slab(cells: [u8; 3]) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    for axis in 0..3 {
        let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-1.0_f32, 1.0] {
            add_face(&mut mesh, axis, side, [cells[right], cells[up]].map(u32::from));
        }
    }
    mesh
}

/// One side of a box of half extents 1, across an axis: a grid of `columns` × `rows` cells along the next two axes.
fn add_face(mesh: &mut PrimitiveMesh, axis: usize, side: f32, [columns, rows]: [u32; 2]) {
    let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
    let first = mesh.vertices.len() as u32;
    let mut normal = Vec3::ZERO;
    normal[axis] = side;
    for row in 0..=rows {
        for column in 0..=columns {
            let mut core = normal;
            core[right] = 2.0 * column as f32 / columns as f32 - 1.0;
            core[up] = 2.0 * row as f32 / rows as f32 - 1.0;
            mesh.vertices.push(PrimitiveVertex::bare(core, normal));
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
            // a cube of side 2 has a volume of 8; tolerance for a few hundred sums of f32
            assert!((six_volumes / 6.0 - 8.0).abs() < 1e-4, "{cells:?}: {six_volumes}");
        }
    }
}
