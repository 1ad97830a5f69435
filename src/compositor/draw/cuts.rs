//! Cuts of multiresolution meshes on the GPU: the vertices of each mesh once, the triangles of each cut in use.
//!
//! In: the cuts that a picture uses. Out: draws. Never here: which cut is right.
//! Triangles of cuts stand one after another in one buffer. A new cut is found and appended; when the buffer is full, what the
//! picture does not use is forgotten, and the rest is written anew.

use super::super::picture::{MeshKey, Picture};
use metachron_agents::shape::{Cut, Model, Tom};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// Bytes of an index.
const INDEX: u64 = 4;
/// Least size of the buffer, indices.
const ROOM_MIN: u64 = 1 << 14;

/// What was made of the models of a picture.
#[derive(Debug, Default)]
pub struct Cuts {
    models: Option<Arc<[Model]>>,
    vertices: HashMap<u32, wgpu::Buffer>,
    triangles: Store,
    edges: Store,
    corners: Vec<[u32; 3]>,
    ends: Vec<[u32; 2]>,
}

/// One buffer of indices and who has which of them.
#[derive(Debug, Default)]
struct Store {
    buffer: Option<wgpu::Buffer>,
    used: u64,
    slots: HashMap<(u32, Cut), Range<u32>>,
}

impl Cuts {
    /// Makes what `picture` needs and is not there yet.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) {
        if self.models.as_ref().is_none_or(|models| !Arc::ptr_eq(models, &picture.models)) {
            *self = Self { models: Some(Arc::clone(&picture.models)), ..Self::default() };
        }
        for (model, tom, _) in cuts(picture) {
            self.vertices.entry(model).or_insert_with(|| {
                let vertices: Vec<[[f32; 3]; 2]> =
                    tom.vertices().iter().map(|v| [v.core.to_array(), v.normal.to_array()]).collect();
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("model vertices"),
                    contents: bytemuck::cast_slice(&vertices),
                    usage: wgpu::BufferUsages::VERTEX,
                })
            });
        }
        self.triangles.make_room(device, picture, 3);
        for (model, tom, cut) in cuts(picture) {
            if self.triangles.slots.contains_key(&(model, cut)) {
                continue;
            }
            self.corners.clear();
            tom.resolve(cut, &mut self.corners);
            self.triangles.append(queue, (model, cut), bytemuck::cast_slice(&self.corners));
        }
        if picture.style.wireframe {
            self.prepare_edges(device, queue, picture);
        }
    }

    fn prepare_edges(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) {
        self.edges.make_room(device, picture, 6);
        for (model, tom, cut) in cuts(picture) {
            if self.edges.slots.contains_key(&(model, cut)) {
                continue;
            }
            self.corners.clear();
            tom.resolve(cut, &mut self.corners);
            self.ends.clear();
            self.ends.extend(self.corners.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]));
            self.edges.append(queue, (model, cut), bytemuck::cast_slice(&self.ends));
        }
    }

    /// Draws `count` instances of a cut, as triangles or as edges; the number of draws.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, key: (u32, Cut), edges: bool, count: u32) -> u32 {
        let store = if edges { &self.edges } else { &self.triangles };
        let (Some(vertices), Some(indices), Some(slot)) =
            (self.vertices.get(&key.0), &store.buffer, store.slots.get(&key))
        else {
            return 0;
        };
        if count == 0 || slot.is_empty() {
            return 0;
        }
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(slot.clone(), 0, 0..count);
        1
    }
}

impl Store {
    /// Sees to it that every cut of `picture` fits, each triangle as so many indices; forgets all where it must.
    fn make_room(&mut self, device: &wgpu::Device, picture: &Picture, each: u64) {
        let indices = |cut: Cut| each * u64::from(cut.triangles);
        let new = |(model, _, cut): &(u32, &Tom, Cut)| !self.slots.contains_key(&(*model, *cut));
        let wanted: u64 = cuts(picture).filter(new).map(|(_, _, cut)| indices(cut)).sum();
        let room = self.buffer.as_ref().map_or(0, |buffer| buffer.size() / INDEX);
        if self.used + wanted <= room {
            return;
        }
        self.slots.clear();
        self.used = 0;
        // twice what one picture needs, so that not every picture of a moving eye begins anew
        let all: u64 = 2 * cuts(picture).map(|(_, _, cut)| indices(cut)).sum::<u64>();
        if all > room {
            self.buffer = Some(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("cuts"),
                size: all.next_power_of_two().max(ROOM_MIN) * INDEX,
                usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
        }
    }

    fn append(&mut self, queue: &wgpu::Queue, key: (u32, Cut), indices: &[u32]) {
        let Some(buffer) = &self.buffer else { return };
        queue.write_buffer(buffer, self.used * INDEX, bytemuck::cast_slice(indices));
        let end = self.used + indices.len() as u64;
        self.slots.insert(key, self.used as u32..end as u32);
        self.used = end;
    }
}

/// Every cut of a picture with its mesh; runs of one cut in two shadings name it twice.
fn cuts(picture: &Picture) -> impl Iterator<Item = (u32, &Tom, Cut)> {
    picture.solids.iter().filter_map(|run| match run.mesh {
        MeshKey::Cut(model, cut) => match picture.models.get(model as usize) {
            Some(Model::Mesh(tom)) => Some((model, &**tom, cut)),
            _ => None,
        },
        _ => None,
    })
}
