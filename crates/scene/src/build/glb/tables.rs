//! Reads the JSON tables of a .glb file, and the lists of numbers that they describe.
//!
//! In: any bytes. Out: tables, points, texture coordinates, corners, the bytes of an image; all checked to lie inside the file.
//! Never here: the hierarchy of nodes, building triangles.

use glam::{DVec3, Vec2};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// Message for data that is not in the file.
const OUTSIDE: &str = "its data is outside the file: the file is truncated, or the data is in another file";
/// Prefixes of extensions that change nothing of the data read here: material properties, lights.
const UNREAD: [&str; 2] = ["KHR_materials_", "KHR_lights_"];

/// The tables of the file's text, as far as triangles need them.
#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Tables {
    pub(super) scene: usize,
    pub(super) scenes: Vec<Root>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<View>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<TextureEntry>,
    pub(super) images: Vec<Image>,
    pub(super) extensions_required: Vec<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Root {
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub(super) mesh: Option<usize>,
    pub(super) children: Vec<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: [f64; 3],
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) mode: Option<u32>,
    pub(super) material: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) pbr_metallic_roughness: Roughness,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Roughness {
    pub(super) base_color_texture: Option<TextureUse>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureUse {
    pub(super) index: usize,
    #[serde(default)]
    pub(super) tex_coord: usize,
}

#[derive(Deserialize)]
pub(super) struct TextureEntry {
    pub(super) source: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub(super) buffer_view: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Buffer {
    pub(super) uri: Option<IgnoredAny>,
}

/// Splits a file into its tables and its data; refuses required extensions that are not understood.
pub(super) fn read(bytes: &[u8]) -> Result<(Tables, &[u8]), String> {
    let (text, data) = parts(bytes)?;
    let tables: Tables = serde_json::from_slice(text).map_err(|error| format!("its JSON is invalid: {error}"))?;
    let needed = |name: &&String| !UNREAD.iter().any(|start| name.starts_with(start));
    if let Some(name) = tables.extensions_required.iter().find(needed) {
        return Err(format!("it requires the extension `{name}`, which is not supported"));
    }
    Ok((tables, data))
}

/// The text and the data of a file; the data is empty where there is none.
fn parts(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let short = || "the file is truncated".to_owned();
    let (version, length) = (word(4).ok_or_else(short)?, word(8).ok_or_else(short)? as usize);
    if version != 2 {
        return Err(format!("its glTF version is {version}; expected 2"));
    }
    let whole = bytes.get(..length).ok_or_else(short)?;
    let (mut text, mut data, mut at): (Option<&[u8]>, &[u8], usize) = (None, &[], 12);
    while at + 8 <= whole.len() {
        let size = word(at).ok_or_else(short)? as usize;
        let body = whole.get(at + 8..).and_then(|rest| rest.get(..size)).ok_or_else(short)?;
        match &whole[at + 4..at + 8] {
            b"JSON" if text.is_none() => text = Some(body),
            b"BIN\0" if data.is_empty() => data = body,
            _ => {}
        }
        at += 8 + size;
    }
    Ok((text.ok_or("it has no JSON chunk")?, data))
}

impl Tables {
    /// The texture of a primitive's base colour, if it has one.
    pub(super) fn painted(&self, primitive: &Primitive) -> Option<&TextureUse> {
        self.materials.get(primitive.material?)?.pbr_metallic_roughness.base_color_texture.as_ref()
    }

    /// The image of a texture.
    pub(super) fn source(&self, texture: usize) -> Result<usize, String> {
        let entry = self
            .textures
            .get(texture)
            .ok_or_else(|| format!("it refers to texture {texture}, which does not exist"))?;
        entry.source.ok_or_else(|| format!("its texture {texture} has no image of a supported format"))
    }

    /// The number of items that an accessor declares.
    pub(super) fn count(&self, accessor: usize) -> Result<usize, String> {
        crate::build::glb::tables::accessor(self, accessor).map(|accessor| accessor.count)
    }

    /// The bytes of a view, checked to lie inside the file.
    pub(super) fn bytes<'d>(&self, view: usize, data: &'d [u8]) -> Result<&'d [u8], String> {
        let outside = || OUTSIDE.to_owned();
        let view = self.buffer_views.get(view).ok_or_else(outside)?;
        // only the first buffer can be in the file
        if view.buffer != 0 || self.buffers.first().is_none_or(|buffer| buffer.uri.is_some()) {
            return Err(outside());
        }
        let end = view.byte_offset.checked_add(view.byte_length).ok_or_else(outside)?;
        data.get(view.byte_offset..end).ok_or_else(outside)
    }
}

/// Positions.
pub(super) fn points(tables: &Tables, number: usize, data: &[u8]) -> Result<Vec<DVec3>, String> {
    let accessor = accessor(tables, number)?;
    if (accessor.component_type, accessor.kind.as_str()) != (5126, "VEC3") {
        return Err("its positions are not three 32-bit floats".to_owned());
    }
    let number = |b: &[u8], at: usize| f64::from(f32::from_le_bytes([b[at], b[at + 1], b[at + 2], b[at + 3]]));
    let items = items(tables, accessor, data, 12)?;
    Ok(items.map(|bytes| DVec3::new(number(bytes, 0), number(bytes, 4), number(bytes, 8))).collect())
}

/// Texture coordinates: floats, or integers as shares of the greatest integer of their type.
pub(super) fn uvs(tables: &Tables, number: usize, data: &[u8]) -> Result<Vec<Vec2>, String> {
    let accessor = accessor(tables, number)?;
    let (size, number): (usize, fn(&[u8]) -> f32) = match (accessor.component_type, accessor.kind.as_str()) {
        (5126, "VEC2") => (4, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        (5121, "VEC2") => (1, |b| f32::from(b[0]) / 255.0),
        (5123, "VEC2") => (2, |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65_535.0),
        _ => return Err("its texture coordinates are not two numbers".to_owned()),
    };
    let items = items(tables, accessor, data, 2 * size)?;
    Ok(items.map(|bytes| Vec2::new(number(bytes), number(&bytes[size..]))).collect())
}

/// Corners of triangles.
pub(super) fn indices(tables: &Tables, number: usize, data: &[u8]) -> Result<Vec<u32>, String> {
    let accessor = accessor(tables, number)?;
    let (size, number): (usize, fn(&[u8]) -> u32) = match (accessor.component_type, accessor.kind.as_str()) {
        (5121, "SCALAR") => (1, |b| u32::from(b[0])),
        (5123, "SCALAR") => (2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
        (5125, "SCALAR") => (4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        _ => return Err("its indices are not single whole numbers".to_owned()),
    };
    Ok(items(tables, accessor, data, size)?.map(number).collect())
}

fn accessor(tables: &Tables, number: usize) -> Result<&Accessor, String> {
    tables.accessors.get(number).ok_or_else(|| format!("it refers to accessor {number}, which does not exist"))
}

/// The bytes of every item of an accessor, checked to lie inside the file.
fn items<'d>(
    tables: &Tables,
    accessor: &Accessor,
    data: &'d [u8],
    size: usize,
) -> Result<impl Iterator<Item = &'d [u8]> + use<'d>, String> {
    let view = accessor.buffer_view.filter(|_| accessor.sparse.is_none());
    let view = view.ok_or("it has a sparse accessor, which is not supported")?;
    let bytes = tables.bytes(view, data)?;
    let (start, count) = (accessor.byte_offset, accessor.count);
    let stride = tables.buffer_views[view].byte_stride.unwrap_or(size).max(size);
    let last = count.checked_sub(1).ok_or("it has an empty accessor")?;
    let reach = last.checked_mul(stride).and_then(|n| n.checked_add(start)?.checked_add(size));
    if reach.is_none_or(|reach| reach > bytes.len()) {
        return Err(OUTSIDE.to_owned());
    }
    Ok((0..count).map(move |i| &bytes[start + i * stride..start + i * stride + size]))
}
