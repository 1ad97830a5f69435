//! glTF's binary form (.glb) as points and triangles.
//!
//! In: any bytes. Out: the triangles of every mesh that a node of the scene shows, placed as the nodes say, z up, and the image that is
//! painted on them; or what is wrong with the file. Never here: light, skins, files beside the file, what an image's bytes mean. Every number in it is doubted: it may be hostile
//! (the crate `gltf` panics on a number of an accessor that is not there, so the few tables needed are read here).

use super::mesh::{Parts, TRIANGLES_MAX};
use glam::{DMat4, DQuat, DVec3, DVec4, Vec2};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// What such a file begins with.
pub(super) const MAGIC: &[u8] = b"glTF";
/// Most nodes that are looked at: one that is its own ancestor would never end.
const NODES_MAX: usize = 100_000;
/// Deepest nesting of nodes.
const DEPTH_MAX: usize = 64;
/// What is said of data that is not in the file.
const OUTSIDE: &str = "its data lies outside the file: it is cut short, or kept in another";
/// glTF has y up: it becomes z.
const UPRIGHT: DMat4 = DMat4::from_cols(DVec4::X, DVec4::Z, DVec4::NEG_Y, DVec4::W);

/// The tables of the file's text, as far as triangles need them.
#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Tables {
    scene: usize,
    scenes: Vec<Root>,
    nodes: Vec<Node>,
    meshes: Vec<Mesh>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    buffers: Vec<Buffer>,
    materials: Vec<Material>,
    textures: Vec<TextureEntry>,
    images: Vec<Image>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Root {
    nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Node {
    mesh: Option<usize>,
    children: Vec<usize>,
    matrix: Option<[f64; 16]>,
    translation: [f64; 3],
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: BTreeMap<String, usize>,
    indices: Option<usize>,
    mode: Option<u32>,
    material: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Material {
    pbr_metallic_roughness: Roughness,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Roughness {
    base_color_texture: Option<TextureUse>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct TextureUse {
    index: usize,
    #[serde(default)]
    tex_coord: usize,
}

#[derive(Deserialize)]
struct TextureEntry {
    source: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Image {
    buffer_view: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: String,
    sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<IgnoredAny>,
}

/// A file in its two parts, and what was found in it.
struct Reader<'d> {
    tables: Tables,
    data: &'d [u8],
    points: Vec<DVec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    nodes: usize,
}

/// Points, their places on the image of [`image`], and triangles of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    let (text, data) = parts(bytes)?;
    let tables: Tables = serde_json::from_slice(text).map_err(|error| format!("its text is wrong: {error}"))?;
    let roots = tables.scenes.get(tables.scene).ok_or("it has no scene")?.nodes.clone();
    let mut reader = Reader { tables, data, points: Vec::new(), uvs: Vec::new(), triangles: Vec::new(), nodes: 0 };
    for node in roots {
        reader.node(node, UPRIGHT, 0)?;
    }
    Ok((reader.points, reader.uvs, reader.triangles))
}

/// The bytes of the one image that all base colours of a file come from; `None` where they come from none or several.
pub(super) fn image(bytes: &[u8]) -> Result<Option<&[u8]>, String> {
    let (text, data) = parts(bytes)?;
    let tables: Tables = serde_json::from_slice(text).map_err(|error| format!("its text is wrong: {error}"))?;
    let primitives = tables.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let painted = primitives.filter_map(|primitive| tables.painted(primitive));
    let mut images: Vec<usize> = painted.map(|on| tables.source(on.index)).collect::<Result<_, _>>()?;
    images.sort_unstable();
    images.dedup();
    let &[only] = &images[..] else { return Ok(None) };
    let image = tables.images.get(only).ok_or_else(|| format!("it names image {only}, which is not there"))?;
    let view = image.buffer_view.ok_or_else(|| format!("its image {only} is kept in another file"))?;
    tables.bytes(view, data).map(Some)
}

/// The text and the data of a file; the data is empty where there is none.
fn parts(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let short = || "it is cut short".to_owned();
    let (version, length) = (word(4).ok_or_else(short)?, word(8).ok_or_else(short)? as usize);
    if version != 2 {
        return Err(format!("it is of version {version}; expected 2"));
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
    Ok((text.ok_or("it has no text")?, data))
}

impl Tables {
    /// What the base colour of a primitive comes from, if from an image.
    fn painted(&self, primitive: &Primitive) -> Option<&TextureUse> {
        self.materials.get(primitive.material?)?.pbr_metallic_roughness.base_color_texture.as_ref()
    }

    /// The image of a texture.
    fn source(&self, texture: usize) -> Result<usize, String> {
        let entry =
            self.textures.get(texture).ok_or_else(|| format!("it names texture {texture}, which is not there"))?;
        entry.source.ok_or_else(|| format!("its texture {texture} has no image that is understood"))
    }

    /// The bytes of a view, checked to lie inside the file.
    fn bytes<'d>(&self, view: usize, data: &'d [u8]) -> Result<&'d [u8], String> {
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

impl Reader<'_> {
    fn node(&mut self, number: usize, above: DMat4, depth: usize) -> Result<(), String> {
        self.nodes += 1;
        if self.nodes > NODES_MAX || depth > DEPTH_MAX {
            return Err("its nodes are too many or too deep".to_owned());
        }
        let node =
            self.tables.nodes.get(number).ok_or_else(|| format!("it names node {number}, which is not there"))?;
        let place = above * node.matrix();
        let (mesh, children) = (node.mesh, node.children.clone());
        if let Some(mesh) = mesh {
            self.mesh(mesh, place)?;
        }
        children.into_iter().try_for_each(|child| self.node(child, place, depth + 1))
    }

    fn mesh(&mut self, number: usize, place: DMat4) -> Result<(), String> {
        let mesh =
            self.tables.meshes.get(number).ok_or_else(|| format!("it names mesh {number}, which is not there"))?;
        for primitive in &mesh.primitives {
            // triangles, strips and fans; points and lines are left out
            let Some(mode @ 4..=6) = Some(primitive.mode.unwrap_or(4)) else { continue };
            let positions = primitive.attributes.get("POSITION").ok_or("a primitive has no positions")?;
            let first = u32::try_from(self.points.len()).map_err(|_| "too many points")?;
            let points = points(&self.tables, *positions, self.data)?;
            let count = points.len() as u32;
            let corners = match primitive.indices {
                Some(accessor) => indices(&self.tables, accessor, self.data)?,
                None => (0..count).collect(),
            };
            if let Some(bad) = corners.iter().find(|&&i| i >= count) {
                return Err(format!("a face uses point {bad} of {count}"));
            }
            self.points.extend(points.iter().map(|&p| place.transform_point3(p)));
            let coordinates = self.tables.painted(primitive).map_or(0, |on| on.tex_coord);
            if let Some(&accessor) = primitive.attributes.get(&format!("TEXCOORD_{coordinates}")) {
                let uvs = uvs(&self.tables, accessor, self.data)?;
                self.uvs.extend(uvs.into_iter().take(points.len()));
            }
            self.uvs.resize(self.points.len(), Vec2::ZERO);
            let turned = place.determinant() < 0.0;
            let side = |t: [u32; 3]| if turned { [t[0], t[2], t[1]] } else { t };
            self.triangles.extend(triangles(&corners, mode).into_iter().map(|t| side(t).map(|i| i + first)));
            if self.triangles.len() > TRIANGLES_MAX {
                return Err(format!("it has more than {TRIANGLES_MAX} triangles"));
            }
        }
        Ok(())
    }
}

impl Node {
    fn matrix(&self) -> DMat4 {
        if let Some(matrix) = &self.matrix {
            return DMat4::from_cols_array(matrix);
        }
        let rotation = self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
        let scale = self.scale.map_or(DVec3::ONE, DVec3::from);
        // glam asks for a unit quaternion where its assertions are on
        let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
        DMat4::from_scale_rotation_translation(scale, rotation, self.translation.into())
    }
}

fn triangles(corners: &[u32], mode: u32) -> Vec<[u32; 3]> {
    match mode {
        5 => {
            let turned = |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            corners.windows(3).enumerate().map(turned).collect()
        }
        6 => corners[1.min(corners.len())..].windows(2).map(|w| [corners[0], w[0], w[1]]).collect(),
        _ => corners.as_chunks::<3>().0.to_vec(),
    }
}

fn points(tables: &Tables, number: usize, data: &[u8]) -> Result<Vec<DVec3>, String> {
    let accessor = accessor(tables, number)?;
    if (accessor.component_type, accessor.kind.as_str()) != (5126, "VEC3") {
        return Err("its positions are not three 32-bit floats".to_owned());
    }
    let number = |b: &[u8], at: usize| f64::from(f32::from_le_bytes([b[at], b[at + 1], b[at + 2], b[at + 3]]));
    let items = items(tables, accessor, (data, 12))?;
    Ok(items.map(|bytes| DVec3::new(number(bytes, 0), number(bytes, 4), number(bytes, 8))).collect())
}

/// Places on a texture: floats, or parts of the greatest whole number.
fn uvs(tables: &Tables, number: usize, data: &[u8]) -> Result<Vec<Vec2>, String> {
    let accessor = accessor(tables, number)?;
    let (size, number): (usize, fn(&[u8]) -> f32) = match (accessor.component_type, accessor.kind.as_str()) {
        (5126, "VEC2") => (4, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        (5121, "VEC2") => (1, |b| f32::from(b[0]) / 255.0),
        (5123, "VEC2") => (2, |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65_535.0),
        _ => return Err("its places on a texture are not two numbers".to_owned()),
    };
    let items = items(tables, accessor, (data, 2 * size))?;
    Ok(items.map(|bytes| Vec2::new(number(bytes), number(&bytes[size..]))).collect())
}

fn indices(tables: &Tables, number: usize, data: &[u8]) -> Result<Vec<u32>, String> {
    let accessor = accessor(tables, number)?;
    let (size, number): (usize, fn(&[u8]) -> u32) = match (accessor.component_type, accessor.kind.as_str()) {
        (5121, "SCALAR") => (1, |b| u32::from(b[0])),
        (5123, "SCALAR") => (2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
        (5125, "SCALAR") => (4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        _ => return Err("its indices are not single whole numbers".to_owned()),
    };
    Ok(items(tables, accessor, (data, size))?.map(number).collect())
}

fn accessor(tables: &Tables, number: usize) -> Result<&Accessor, String> {
    tables.accessors.get(number).ok_or_else(|| format!("it names accessor {number}, which is not there"))
}

/// The bytes of every item of an accessor, checked to lie inside the file.
fn items<'d>(
    tables: &Tables,
    accessor: &Accessor,
    (data, size): (&'d [u8], usize),
) -> Result<impl Iterator<Item = &'d [u8]> + use<'d>, String> {
    let view = accessor.buffer_view.filter(|_| accessor.sparse.is_none());
    let view = view.ok_or("its data is sparse, which is not understood")?;
    let bytes = tables.bytes(view, data)?;
    let (start, count) = (accessor.byte_offset, accessor.count);
    let stride = tables.buffer_views[view].byte_stride.unwrap_or(size).max(size);
    let last = count.checked_sub(1).ok_or("it has an empty list")?;
    let reach = last.checked_mul(stride).and_then(|n| n.checked_add(start)?.checked_add(size));
    if reach.is_none_or(|reach| reach > bytes.len()) {
        return Err(OUTSIDE.to_owned());
    }
    Ok((0..count).map(move |i| &bytes[start + i * stride..start + i * stride + size]))
}

#[cfg(test)]
mod tests {
    use super::super::mesh::read;
    use proptest::prelude::*;

    /// A tetrahedron 2 high along +y, moved by 5 along x, as a file.
    fn tetrahedron() -> Vec<u8> {
        file(&json(48 + 24, 4, 12))
    }

    fn json(bytes: usize, points: usize, corners: usize) -> String {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "nodes":[{{"mesh":0,"translation":[5,0,0]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "buffers":[{{"byteLength":{bytes}}}],
            "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":{points},"type":"VEC3","min":[0,0,0],"max":[1,2,1]}},
            {{"bufferView":1,"componentType":5123,"count":{corners},"type":"SCALAR"}}]}}"#
        )
    }

    fn file(json: &str) -> Vec<u8> {
        let mut text = json.as_bytes().to_vec();
        text.resize(text.len().next_multiple_of(4), b' ');
        let points = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]];
        let corners: [u16; 12] = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        let mut data: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        data.extend(corners.iter().flat_map(|i| i.to_le_bytes()));
        let mut bytes = b"glTF".to_vec();
        let length = 12 + 8 + text.len() + 8 + data.len();
        for (word, body) in [(2_u32, &[][..]), (length as u32, &[]), (text.len() as u32, b"JSON"), (0, &text)] {
            if body.is_empty() || body == b"JSON" {
                bytes.extend(word.to_le_bytes());
            }
            bytes.extend(body);
        }
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(data);
        bytes
    }

    #[test]
    fn a_tetrahedron_is_read_placed_scaled_and_set_upright() {
        let mesh = read(&tetrahedron(), 10.0).unwrap();
        assert_eq!((mesh.points_m.len(), mesh.triangles.len()), (4, 4));
        // x 5 from the node; what was up along y is up along z
        assert!(mesh.points_m.contains(&glam::DVec3::new(50.0, 0.0, 20.0)), "{:?}", mesh.points_m);
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.points_m[i as usize] - mesh.points_m[0]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume - 1000.0 / 3.0).abs() < 1e-9, "{volume}"); // faces outward
    }

    #[test]
    fn what_lies_outside_the_file_is_refused() {
        for bad in [json(48 + 24, 5, 12), json(48 + 24, 4, 1000), json(48 + 24, 4, 4_000_000_000), json(9000, 4, 12)] {
            let told = read(&file(&bad), 1.0).err();
            // a longer buffer than is there is told of only where something is read past its end
            assert!(told.is_some() || bad == json(9000, 4, 12), "{bad}");
        }
        let whole = tetrahedron();
        for cut in [5, 11, 12, 19, 30, whole.len() - 30, whole.len() - 1] {
            assert!(read(&whole[..cut], 1.0).is_err(), "cut at {cut}");
        }
        let ring = json(72, 4, 12).replace("\"translation\":[5,0,0]", "\"children\":[0]");
        assert!(read(&file(&ring), 1.0).is_err());
    }

    proptest! {
        #[test]
        fn no_damage_makes_the_reader_panic(at in 0..600_usize, with in proptest::collection::vec(any::<u8>(), 1..6)) {
            let mut bytes = tetrahedron();
            let at = at % bytes.len();
            let end = (at + with.len()).min(bytes.len());
            bytes.splice(at..end, with);
            let _ = read(&bytes, 1.0);
        }

        #[test]
        fn no_number_in_the_text_makes_the_reader_panic(which in 0..30_usize, number in any::<i64>()) {
            let text = json(72, 4, 12);
            let digits: Vec<_> = text.match_indices(|c: char| c.is_ascii_digit()).collect();
            let (at, _) = digits[which % digits.len()];
            let _ = read(&file(&format!("{}{number}{}", &text[..at], &text[at + 1..])), 1.0);
        }
    }
}
