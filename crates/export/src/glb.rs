//! A moment as one binary glTF file (.glb), which Blender, three.js, game engines and viewers of operating systems open.
//!
//! In: a moment, the solids that never move. Out: a node for each object with its mesh, normals and base colour, under one that turns our z up
//! to glTF's y up; metres. Never here: animation, textures, compression.
//! Format: glTF 2.0 (Khronos Group 2017), sections 3.6 to 3.9 and 4.4.

use super::surface::Surface;
use super::{ExportError, Moment, colour};
use glam::DVec3;
use metachron_core::Body;
use metachron_geometry::{Triangles, is_closed, welded};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// The cosine of the greatest angle between triangles that share a normal: wider ones meet in an edge.
const SMOOTH_COS: f64 = 0.7;
/// Our axes in glTF's, by columns: x stays, y becomes −z, z becomes y.
const UPRIGHT: [i32; 16] = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1];
/// The names that glTF has for numbers and for the contents of a view of the buffer.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Writes a moment as a file, over one that exists; `fixed` are the solids that never move.
///
/// # Errors
/// [`ExportError::File`].
pub fn write_glb(path: &Path, moment: &Moment, fixed: &Surface) -> Result<(), ExportError> {
    let bytes = glb(moment, fixed).map_err(ExportError::at(path))?;
    std::fs::write(path, bytes).map_err(ExportError::at(path))
}

/// A moment as the bytes of a file. A rigid body's points are in its own axes, and its node says where it is; a
/// deformable's points are in world axes.
///
/// # Errors
/// More than the 4 GiB that a file may have.
pub fn glb(moment: &Moment, fixed: &Surface) -> std::io::Result<Vec<u8>> {
    let mut file = Glb::default();
    let name = "fixed";
    let mut nodes = vec![];
    if !fixed.triangles.is_empty() {
        nodes.push(json!({ "name": name, "mesh": file.mesh(name, fixed, colour::OF_FIXED) }));
    }
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
            node["mesh"] = json!(file.mesh(&object.name, surface, colour::of_name(&object.name)));
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
}

/// Corners of triangles: a point has one for every side of an edge.
struct Corners {
    points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

impl Glb {
    /// Adds a mesh with a colour of its own; its number.
    fn mesh(&mut self, name: &str, surface: &Surface, colour: [f64; 3]) -> usize {
        let Corners { points, normals, indices } = Corners::of(surface);
        let bounds = |pick: fn(f32, f32) -> f32| {
            let all = points.iter().copied().reduce(|a, b| [0, 1, 2].map(|k| pick(a[k], b[k])));
            all.unwrap_or_default()
        };
        let (low, high) = (bounds(f32::min), bounds(f32::max));
        let position = self.view(points.iter().flatten().flat_map(|x| x.to_le_bytes()), VERTICES);
        let normal = self.view(normals.iter().flatten().flat_map(|x| x.to_le_bytes()), VERTICES);
        let index = self.view(indices.iter().flat_map(|x| x.to_le_bytes()), INDICES);
        let first = self.accessors.len();
        self.accessors.extend([
            json!({ "bufferView": position, "componentType": FLOAT, "count": points.len(), "type": "VEC3", "min": low, "max": high }),
            json!({ "bufferView": normal, "componentType": FLOAT, "count": normals.len(), "type": "VEC3" }),
            json!({ "bufferView": index, "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR" }),
        ]);
        let whole = Triangles { points: surface.points.clone(), triangles: surface.triangles.clone() };
        let [r, g, b] = colour.map(|part| ((part + 0.055) / 1.055).powf(2.4)); // sRGB to linear light
        self.materials.push(json!({
            "name": name,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7 },
            "doubleSided": !is_closed(&welded(&whole)),
        }));
        self.meshes.push(json!({
            "name": name,
            "primitives": [{
                "attributes": { "POSITION": first, "NORMAL": first + 1 },
                "indices": first + 2,
                "material": self.materials.len() - 1,
            }],
        }));
        self.meshes.len() - 1
    }

    /// Adds bytes, whole words of four; the number of their view.
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: u32) -> usize {
        let start = self.data.len();
        self.data.extend(bytes);
        let length = self.data.len() - start;
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": target }));
        self.views.len() - 1
    }

    /// The file: header, tables, data.
    fn bytes(self, nodes: Vec<Value>, time_s: f64) -> std::io::Result<Vec<u8>> {
        let root = nodes.len();
        let children: Vec<usize> = (0..root).collect();
        let mut above = json!({ "name": "metachron", "matrix": UPRIGHT });
        // lists that are empty are no glTF
        if !children.is_empty() {
            above["children"] = json!(children);
        }
        let mut tables = json!({
            "asset": { "version": "2.0", "generator": concat!("metachron ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [root], "extras": { "time_s": time_s } }],
            "nodes": nodes.into_iter().chain([above]).collect::<Vec<_>>(),
        });
        if !self.meshes.is_empty() {
            tables["buffers"] = json!([{ "byteLength": self.data.len() }]);
            let lists = [self.views, self.accessors, self.materials, self.meshes];
            for (name, list) in ["bufferViews", "accessors", "materials", "meshes"].into_iter().zip(lists) {
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

impl Corners {
    /// The corners of a surface: at a point, triangles that meet smoothly share one, whose normal is the mean of theirs by area.
    fn of(surface: &Surface) -> Self {
        let corner = |t: &[u32; 3]| t.map(|p| surface.points[p as usize]);
        let areas: Vec<DVec3> = surface.triangles.iter().map(|t| doubled_area(corner(t))).collect();
        let mut around = vec![Vec::new(); surface.points.len()];
        for (k, triangle) in surface.triangles.iter().enumerate() {
            triangle.iter().for_each(|p| around[*p as usize].push(k));
        }
        let (mut into, mut known) = (Self { points: vec![], normals: vec![], indices: vec![] }, BTreeMap::new());
        for (triangle, area) in surface.triangles.iter().zip(&areas) {
            let own = area.normalize_or_zero();
            for point in triangle {
                let near = around[*point as usize].iter().map(|k| areas[*k]);
                let smooth = near.filter(|other| other.normalize_or_zero().dot(own) >= SMOOTH_COS);
                let normal = smooth.sum::<DVec3>().normalize_or(DVec3::Z).as_vec3().to_array();
                let place = *known.entry((*point, normal.map(f32::to_bits))).or_insert_with(|| {
                    into.points.push(surface.points[*point as usize].as_vec3().to_array());
                    into.normals.push(normal);
                    into.points.len() as u32 - 1
                });
                into.indices.push(place);
            }
        }
        into
    }
}

/// Along a triangle's normal, as long as twice its area.
fn doubled_area([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
