//! Cuts of multiresolution meshes on the GPU: the vertices of each mesh once, the triangles of each cut in use.
//!
//! In: the cuts that a picture uses. Out: draws. Never here: the choice of a cut.
//! Triangles of cuts are stored one after another in one buffer, and so are the end vertices of geomorphs from one cut
//! to a coarser one. A new item is appended; when the buffer is full, all items are dropped and the picture's own are
//! written anew.

use crate::composition::mesh_corner::MeshCorner;
use crate::composition::picture::{MeshKey, Picture};
use metachron_drawable::{Cut, Model, ProgressiveMesh};
use std::collections::HashMap;
use std::hash::Hash;
use std::ops::Range;
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// Least size of a buffer, items.
const ROOM_MIN: u64 = 1 << 14;

/// GPU data made from the models of a picture.
#[derive(Debug, Default)]
pub struct Cuts {
    models: Option<Arc<[Model]>>,
    vertices: HashMap<u32, wgpu::Buffer>,
    triangles: Store<CutKey>,
    edges: Store<CutKey>,
    /// Vertices of a cut at the coarser end of its geomorph.
    geomorphs: Store<GeomorphKey>,
    corners: Vec<[u32; 3]>,
    sides: Vec<[u32; 2]>,
    geomorph_ends: Vec<MeshCorner>,
}

/// A cut of a model, morphing to the cut of `coarser` vertices if given.
#[derive(Debug, Clone, Copy)]
pub struct MorphedCut {
    /// Number of the model.
    pub model: u32,
    /// Its cut.
    pub cut: Cut,
    /// Vertex count of the coarser cut.
    pub coarser: Option<u32>,
}

/// A model and its cut.
type CutKey = (u32, Cut);

/// A model, vertex count of the finer cut, vertex count of the coarser one.
type GeomorphKey = (u32, u32, u32);

/// One buffer of items and the range of each key in it.
#[derive(Debug)]
struct Store<K> {
    buffer: Option<wgpu::Buffer>,
    used: u64,
    ranges: HashMap<K, Range<u32>>,
}

impl<K> Default for Store<K> {
    fn default() -> Self {
        Self { buffer: None, used: 0, ranges: HashMap::new() }
    }
}

/// The items of a store.
#[derive(Debug, Clone, Copy)]
struct Item {
    label: &'static str,
    bytes: u64,
    usage: wgpu::BufferUsages,
}

const INDEX: Item = Item { label: "cuts", bytes: 4, usage: wgpu::BufferUsages::INDEX };
const END: Item = Item { label: "ways", bytes: size_of::<MeshCorner>() as u64, usage: wgpu::BufferUsages::VERTEX };

impl Cuts {
    /// Uploads the items that `picture` needs and that are missing.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) {
        if self.models.as_ref().is_none_or(|models| !Arc::ptr_eq(models, &picture.models)) {
            *self = Self { models: Some(Arc::clone(&picture.models)), ..Self::default() };
        }
        for (model, progressive, _) in cuts(picture) {
            self.vertices.entry(model).or_insert_with(|| {
                let vertices: Vec<MeshCorner> = progressive.vertices().iter().map(MeshCorner::from).collect();
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("model vertices"),
                    contents: bytemuck::cast_slice(&vertices),
                    usage: wgpu::BufferUsages::VERTEX,
                })
            });
        }
        self.triangles.make_room(device, INDEX, cuts(picture).map(|(model, _, cut)| ((model, cut), 3 * cut.triangles)));
        for (model, progressive, cut) in cuts(picture) {
            if self.triangles.ranges.contains_key(&(model, cut)) {
                continue;
            }
            self.corners.clear();
            progressive.resolve(cut, &mut self.corners);
            self.triangles.append(queue, INDEX, (model, cut), bytemuck::cast_slice(&self.corners));
        }
        self.prepare_geomorphs(device, queue, picture);
        if picture.style.wireframe {
            self.prepare_edges(device, queue, picture);
        }
    }

    fn prepare_geomorphs(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) {
        self.geomorphs.make_room(device, END, geomorphs(picture).map(|(key, _)| (key, key.1)));
        for (key, progressive) in geomorphs(picture) {
            if self.geomorphs.ranges.contains_key(&key) {
                continue;
            }
            self.geomorph_ends.clear();
            self.geomorph_ends
                .extend((0..key.1).map(|vertex| MeshCorner::from(&progressive.morphed(vertex, key.2, 1.0))));
            self.geomorphs.append(queue, END, key, bytemuck::cast_slice(&self.geomorph_ends));
        }
    }

    fn prepare_edges(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) {
        self.edges.make_room(device, INDEX, cuts(picture).map(|(model, _, cut)| ((model, cut), 6 * cut.triangles)));
        for (model, progressive, cut) in cuts(picture) {
            if self.edges.ranges.contains_key(&(model, cut)) {
                continue;
            }
            self.corners.clear();
            progressive.resolve(cut, &mut self.corners);
            self.sides.clear();
            self.sides.extend(self.corners.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]));
            self.edges.append(queue, INDEX, (model, cut), bytemuck::cast_slice(&self.sides));
        }
    }

    /// Draws `count` instances of a cut as triangles or as edges; returns the number of draws.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, drawn: MorphedCut, edges: bool, count: u32) -> u32 {
        let MorphedCut { model, cut, coarser } = drawn;
        let store = if edges { &self.edges } else { &self.triangles };
        let (Some(vertices), Some(indices), Some(range)) =
            (self.vertices.get(&model), &store.buffer, store.ranges.get(&(model, cut)))
        else {
            return 0;
        };
        if count == 0 || range.is_empty() {
            return 0;
        }
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_vertex_buffer(
            2,
            coarser.and_then(|c| self.geomorphs.part(END, &(model, cut.vertices, c))).unwrap_or(vertices.slice(..)),
        );
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(range.clone(), 0, 0..count);
        1
    }
}

impl<K: Copy + Eq + Hash> Store<K> {
    /// Ensures that everything in `used`, each with its number of items, fits; drops all items where it does not.
    fn make_room(&mut self, device: &wgpu::Device, item: Item, used: impl Iterator<Item = (K, u32)> + Clone) {
        let sum = |some: &mut dyn Iterator<Item = (K, u32)>| some.map(|(_, items)| u64::from(items)).sum::<u64>();
        let wanted = sum(&mut used.clone().filter(|(key, _)| !self.ranges.contains_key(key)));
        let room = self.buffer.as_ref().map_or(0, |buffer| buffer.size() / item.bytes);
        if self.used + wanted <= room {
            return;
        }
        self.ranges.clear();
        self.used = 0;
        // twice the need of one picture, so that a moving camera does not force a rewrite with every picture
        let all = 2 * sum(&mut used.clone());
        if all > room {
            self.buffer = Some(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(item.label),
                size: all.next_power_of_two().max(ROOM_MIN) * item.bytes,
                usage: item.usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
    }

    fn append(&mut self, queue: &wgpu::Queue, item: Item, key: K, bytes: &[u8]) {
        let Some(buffer) = &self.buffer else { return };
        queue.write_buffer(buffer, self.used * item.bytes, bytes);
        let end = self.used + bytes.len() as u64 / item.bytes;
        self.ranges.insert(key, self.used as u32..end as u32);
        self.used = end;
    }

    /// The part of the buffer that belongs to a key.
    fn part(&self, item: Item, key: &K) -> Option<wgpu::BufferSlice<'_>> {
        let range = self.ranges.get(key)?;
        let [from, to] = [range.start, range.end].map(|at| u64::from(at) * item.bytes);
        Some(self.buffer.as_ref()?.slice(from..to))
    }
}

/// Every cut of a picture with its mesh; a cut drawn in two shadings occurs twice.
fn cuts(picture: &Picture) -> impl Iterator<Item = (u32, &ProgressiveMesh, Cut)> + Clone {
    picture.solids.iter().filter_map(|run| match run.kind.mesh {
        MeshKey::Cut(model, cut) | MeshKey::Geomorph(model, cut, _) => {
            Some((model, progressive_mesh(picture, model)?, cut))
        }
        _ => None,
    })
}

/// Every geomorph of a picture with its mesh.
fn geomorphs(picture: &Picture) -> impl Iterator<Item = (GeomorphKey, &ProgressiveMesh)> + Clone {
    picture.solids.iter().filter_map(|run| match run.kind.mesh {
        MeshKey::Geomorph(model, cut, coarser) => {
            Some(((model, cut.vertices, coarser), progressive_mesh(picture, model)?))
        }
        _ => None,
    })
}

fn progressive_mesh(picture: &Picture, model: u32) -> Option<&ProgressiveMesh> {
    match picture.models.get(model as usize)? {
        Model::Mesh(progressive) => Some(progressive),
        Model::Foliage(_) => None,
    }
}
