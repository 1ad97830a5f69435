//! A moment as one binary glTF file (.glb), which Blender, three.js, game engines and viewers of operating systems open.
//!
//! In: a moment, the solids that never move. Out: a node for each object with its mesh, normals and base colour, under one that turns our z up
//! to glTF's y up; metres. Never here: animation (`animation.rs`), textures, compression.
//! Format: glTF 2.0 (Khronos Group 2017), sections 3.6 to 3.9 and 4.4.

mod animation;
mod corners;

pub use animation::GlbAnimation;

use super::surface::Surface;
use super::{ExportError, Moment, colour};
use corners::Corners;
use glam::DVec3;
use metachron_core::Body;
use metachron_geometry::{Triangles, is_closed, welded};
use metachron_world::OutputFile;
use serde_json::{Value, json};
use std::path::Path;

/// Our axes in glTF's, by columns: x stays, y becomes −z, z becomes y.
const UPRIGHT: [i32; 16] = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1];
/// The names that glTF has for numbers and for the contents of a view of the buffer.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Writes a moment as a file, in place of one that exists once it is whole; `fixed` are the solids that never move.
///
/// # Errors
/// [`ExportError::File`].
pub fn write_glb(path: &Path, moment: &Moment, fixed: &Surface) -> Result<(), ExportError> {
    let bytes = glb(moment, fixed).map_err(ExportError::at(path))?;
    OutputFile::write(path, bytes).map_err(ExportError::at(path))
}

/// A moment as the bytes of a file. A rigid body's points are in its own axes, and its node says where it is; a
/// deformable's points are in world axes.
///
/// # Errors
/// More than the 4 GiB that a file may have.
pub fn glb(moment: &Moment, fixed: &Surface) -> std::io::Result<Vec<u8>> {
    let mut file = Glb::default();
    let mut nodes: Vec<_> = file.fixed(fixed).into_iter().collect();
    for object in &moment.objects {
        let mut node = json!({ "name": *object.name, "extras": { "object": object.id.0 } });
        let placed = match &object.state.body {
            Body::Rigid(body) => {
                node["translation"] = json!(body.position.to_array());
                node["rotation"] = json!(body.rotation.normalize().to_array());
                Some(object.surface.in_axes_of(body.position, body.rotation))
            }
            _ => None,
        };
        let surface = placed.as_ref().unwrap_or(&object.surface);
        if !surface.triangles.is_empty() {
            node["mesh"] = json!(file.mesh(&object.name, surface, colour::of_name(&object.name), &[]));
        }
        nodes.push(node);
    }
    file.bytes(nodes, moment.time.as_secs_f64())
}

/// The tables of a file so far.
#[derive(Default)]
struct Glb {
    data: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

impl Glb {
    /// The node of the solids that never move; `None` where there are none.
    fn fixed(&mut self, fixed: &Surface) -> Option<Value> {
        let name = "fixed";
        let is_there = !fixed.triangles.is_empty();
        is_there.then(|| json!({ "name": name, "mesh": self.mesh(name, fixed, colour::OF_FIXED, &[]) }))
    }

    /// Adds a mesh with a colour of its own, and morph targets where its points are elsewhere; its number.
    fn mesh(&mut self, name: &str, surface: &Surface, colour: [f64; 3], targets: &[Vec<DVec3>]) -> usize {
        let corners = Corners::of(surface);
        let (points, normals) = (corners.points(&surface.points), corners.normals(surface, &surface.points));
        let attributes = self.attributes(&points, &normals);
        let index = self.view(corners.indices.iter().flat_map(|x| x.to_le_bytes()), Some(INDICES));
        let index = self.accessor(json!({ "bufferView": index, "componentType": UNSIGNED_INT, "count": corners.indices.len(), "type": "SCALAR" }));
        let offsets = |from: &[[f32; 3]], to: Vec<[f32; 3]>| {
            to.iter().zip(from).map(|(to, from)| [0, 1, 2].map(|k| to[k] - from[k])).collect::<Vec<_>>()
        };
        let targets: Vec<_> = targets
            .iter()
            .map(|to| {
                let moved = offsets(&points, corners.points(to));
                self.attributes(&moved, &offsets(&normals, corners.normals(surface, to)))
            })
            .collect();
        let whole = Triangles { points: surface.points.clone(), triangles: surface.triangles.clone() };
        let [r, g, b] = colour.map(|part| ((part + 0.055) / 1.055).powf(2.4)); // sRGB to linear light
        self.materials.push(json!({
            "name": name,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7 },
            "doubleSided": !is_closed(&welded(&whole)),
        }));
        let mut part = json!({ "attributes": attributes, "indices": index, "material": self.materials.len() - 1 });
        // lists that are empty are no glTF
        if !targets.is_empty() {
            part["targets"] = json!(targets);
        }
        self.meshes.push(json!({ "name": name, "primitives": [part] }));
        self.meshes.len() - 1
    }

    /// Adds points and normals, or how far they are moved.
    fn attributes(&mut self, points: &[[f32; 3]], normals: &[[f32; 3]]) -> Value {
        let bounds = |pick: fn(f32, f32) -> f32| {
            let all = points.iter().copied().reduce(|a, b| [0, 1, 2].map(|k| pick(a[k], b[k])));
            all.unwrap_or_default()
        };
        let (low, high) = (bounds(f32::min), bounds(f32::max));
        let position = self.floats(points.as_flattened(), "VEC3", Some(VERTICES));
        (self.accessors[position]["min"], self.accessors[position]["max"]) = (json!(low), json!(high));
        json!({ "POSITION": position, "NORMAL": self.floats(normals.as_flattened(), "VEC3", Some(VERTICES)) })
    }

    /// Adds numbers of a kind, such as `VEC3`; the number of their accessor.
    fn floats(&mut self, values: &[f32], kind: &str, target: Option<u32>) -> usize {
        let components = match kind {
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 1,
        };
        let view = self.view(values.iter().flat_map(|x| x.to_le_bytes()), target);
        let count = values.len() / components;
        self.accessor(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": kind }))
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds bytes, whole words of four; the number of their view.
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> usize {
        let start = self.data.len();
        self.data.extend(bytes);
        let length = self.data.len() - start;
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length }));
        let number = self.views.len() - 1;
        if let Some(target) = target {
            self.views[number]["target"] = json!(target);
        }
        number
    }

    /// The file: header, tables, data.
    fn bytes(self, nodes: Vec<Value>, time_s: f64) -> std::io::Result<Vec<u8>> {
        let root = nodes.len();
        let children: Vec<usize> = (0..root).collect();
        let mut above = json!({ "name": "metachron", "matrix": UPRIGHT });
        if !children.is_empty() {
            above["children"] = json!(children);
        }
        let mut tables = json!({
            "asset": { "version": "2.0", "generator": concat!("metachron ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [root], "extras": { "time_s": time_s } }],
            "nodes": nodes.into_iter().chain([above]).collect::<Vec<_>>(),
        });
        if !self.data.is_empty() {
            tables["buffers"] = json!([{ "byteLength": self.data.len() }]);
        }
        if !self.channels.is_empty() {
            tables["animations"] = json!([{ "name": "run", "samplers": self.samplers, "channels": self.channels }]);
        }
        let lists = [self.views, self.accessors, self.materials, self.meshes];
        for (name, list) in ["bufferViews", "accessors", "materials", "meshes"].into_iter().zip(lists) {
            if !list.is_empty() {
                tables[name] = Value::Array(list);
            }
        }
        let mut text = tables.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunks: Vec<(&[u8], &[u8])> = match self.data.is_empty() {
            true => vec![(b"JSON", &text)],
            false => vec![(b"JSON", &text), (b"BIN\0", &self.data)],
        };
        let length = |bytes: usize| u32::try_from(bytes).map_err(std::io::Error::other).map(u32::to_le_bytes);
        let whole = 12 + chunks.iter().map(|(_, chunk)| 8 + chunk.len()).sum::<usize>();
        let mut file = Vec::with_capacity(whole);
        file.extend(b"glTF");
        file.extend(2_u32.to_le_bytes());
        file.extend(length(whole)?);
        for (kind, chunk) in chunks {
            file.extend(length(chunk.len())?);
            file.extend(kind);
            file.extend(chunk);
        }
        Ok(file)
    }
}
