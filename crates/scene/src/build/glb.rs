//! Reads binary glTF (.glb) as points and triangles.
//!
//! In: any bytes. Out: the triangles of every mesh that a node of the scene instantiates, placed as the nodes say, z
//! up, and the image of their base colour; or the fault of the file. Never here: lights, skins, external files,
//! decoding of images. No number in the file is trusted, as the file may be hostile (the crate `gltf` panics on an
//! accessor index out of range, so the few tables needed are read here), and points and primitives that many nodes
//! instantiate are counted before they are read.

mod tables;

use super::mesh::{Parts, TRIANGLES_MAX};
use glam::{DMat4, DQuat, DVec3, DVec4, Vec2};
use metachron_geometry::branch;
use tables::{Node, Tables};

/// First bytes of such a file.
pub(super) const MAGIC: &[u8] = b"glTF";
/// Most nodes visited, and most primitives of their meshes: a node that is its own ancestor would never end.
const NODES_MAX: usize = 100_000;
/// Most points of all primitives that nodes instantiate: no triangle needs more than three.
const POINTS_MAX: usize = 3 * TRIANGLES_MAX;
/// Deepest nesting of nodes.
const DEPTH_MAX: usize = 64;
/// Turns glTF's y-up axes to z up.
const UPRIGHT: DMat4 = DMat4::from_cols(DVec4::X, DVec4::Z, DVec4::NEG_Y, DVec4::W);

/// A file in its two parts, tables and data, and the geometry read so far.
struct Reader<'d> {
    tables: Tables,
    data: &'d [u8],
    points: Vec<DVec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    /// For each triangle the number of its node's mesh, in the order of reading.
    objects: Vec<u32>,
    meshes: u32,
    /// For each primitive read its first point, its mesh and its index in that mesh.
    primitives: Vec<(u32, [usize; 2])>,
    nodes: usize,
    /// Number of primitives visited, including points and lines.
    primitives_visited: usize,
}

/// Points, their texture coordinates on the image of [`image`], and triangles of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    let reader = nodes(bytes)?;
    reader.check()?;
    Ok((reader.points, reader.uvs, reader.triangles))
}

/// The points and triangles of a file, however they are connected.
pub(super) fn surface(bytes: &[u8]) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), String> {
    let Reader { points, triangles, .. } = nodes(bytes)?;
    Ok((points, triangles))
}

/// All nodes of a file.
fn nodes(bytes: &[u8]) -> Result<Reader<'_>, String> {
    let (tables, data) = tables::read(bytes)?;
    let roots = tables.scenes.get(tables.scene).ok_or("it has no scene")?.nodes.clone();
    let mut reader = Reader {
        tables,
        data,
        points: Vec::new(),
        uvs: Vec::new(),
        triangles: Vec::new(),
        objects: Vec::new(),
        meshes: 0,
        primitives: Vec::new(),
        nodes: 0,
        primitives_visited: 0,
    };
    for node in roots {
        reader.node(node, UPRIGHT, 0)?;
    }
    Ok(reader)
}

/// The bytes of the one image that all base colours of a file use; `None` where they use none or several.
pub(super) fn image(bytes: &[u8]) -> Result<Option<&[u8]>, String> {
    let (tables, data) = tables::read(bytes)?;
    let primitives = tables.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let painted = primitives.filter_map(|primitive| tables.painted(primitive));
    let mut images: Vec<usize> = painted.map(|on| tables.source(on.index)).collect::<Result<_, _>>()?;
    images.sort_unstable();
    images.dedup();
    let &[only] = &images[..] else { return Ok(None) };
    let image = tables.images.get(only).ok_or_else(|| format!("it refers to image {only}, which does not exist"))?;
    let view = image.buffer_view.ok_or_else(|| format!("its image {only} is stored in another file"))?;
    tables.bytes(view, data).map(Some)
}

impl Reader<'_> {
    fn node(&mut self, number: usize, above: DMat4, depth: usize) -> Result<(), String> {
        self.nodes += 1;
        if self.nodes > NODES_MAX || depth > DEPTH_MAX {
            return Err("its nodes are too many or nested too deeply".to_owned());
        }
        let node =
            self.tables.nodes.get(number).ok_or_else(|| format!("it refers to node {number}, which does not exist"))?;
        let place = above * node.matrix();
        if node.children.len() > NODES_MAX {
            return Err(format!("its node {number} has more than {NODES_MAX} children"));
        }
        let (mesh, children) = (node.mesh, node.children.clone());
        if let Some(mesh) = mesh {
            self.mesh(mesh, place)?;
        }
        children.into_iter().try_for_each(|child| self.node(child, place, depth + 1))
    }

    fn mesh(&mut self, number: usize, place: DMat4) -> Result<(), String> {
        let mesh = self
            .tables
            .meshes
            .get(number)
            .ok_or_else(|| format!("it refers to mesh {number}, which does not exist"))?;
        self.primitives_visited += mesh.primitives.len();
        if self.primitives_visited > NODES_MAX {
            return Err(format!("the meshes that its nodes instantiate have more than {NODES_MAX} primitives"));
        }
        self.meshes += 1;
        (0..mesh.primitives.len()).try_for_each(|part| self.primitive([number, part], place))
    }

    /// Reads one primitive of a mesh: triangles, strips and fans; points and lines are skipped.
    fn primitive(&mut self, [number, part]: [usize; 2], place: DMat4) -> Result<(), String> {
        let primitive = &self.tables.meshes[number].primitives[part];
        let Some(mode @ 4..=6) = Some(primitive.mode.unwrap_or(4)) else { return Ok(()) };
        let positions = *primitive.attributes.get("POSITION").ok_or("a primitive has no positions")?;
        let first = self.points.len();
        if first.saturating_add(self.tables.count(positions)?) > POINTS_MAX {
            return Err(format!("the meshes that its nodes instantiate have more than {POINTS_MAX} points"));
        }
        let points = tables::points(&self.tables, positions, self.data)?;
        let (first, count) = (first as u32, points.len() as u32);
        let corners = match primitive.indices {
            Some(accessor) => tables::indices(&self.tables, accessor, self.data)?,
            None => (0..count).collect(),
        };
        if let Some(bad) = corners.iter().find(|&&i| i >= count) {
            return Err(format!("a face uses point {bad} of {count}"));
        }
        if mode == 4 && !corners.len().is_multiple_of(3) || corners.len() < 3 {
            let (count, expected) = (corners.len(), if mode == 4 { "a multiple of three" } else { "three or more" });
            return Err(format!("primitive {part} of mesh {number} has {count} corners; expected {expected}"));
        }
        let more = if mode == 4 { corners.len() / 3 } else { corners.len() - 2 };
        if self.triangles.len() + more > TRIANGLES_MAX {
            return Err(format!("it has more than {TRIANGLES_MAX} triangles"));
        }
        let coordinates = self.tables.painted(primitive).map_or(0, |on| on.tex_coord);
        if let Some(&accessor) = primitive.attributes.get(&format!("TEXCOORD_{coordinates}")) {
            let uvs = tables::uvs(&self.tables, accessor, self.data)?;
            self.uvs.extend(uvs.into_iter().take(points.len()));
        }
        self.primitives.push((first, [number, part]));
        self.points.extend(points.iter().map(|&p| place.transform_point3(p)));
        self.uvs.resize(self.points.len(), Vec2::ZERO);
        let turned = place.determinant() < 0.0;
        let side = |t: [u32; 3]| if turned { [t[0], t[2], t[1]] } else { t };
        self.triangles.extend(triangles(&corners, mode).into_iter().map(|t| side(t).map(|i| i + first)));
        self.objects.resize(self.triangles.len(), self.meshes);
        Ok(())
    }

    /// Checks that no edge in the mesh of a node, all its primitives together, has more than two triangles.
    fn check(&self) -> Result<(), String> {
        let Some(found) = branch(&self.points, &self.triangles, |t| self.objects[t]) else { return Ok(()) };
        let named = |corner: u32| {
            let at = self.primitives.partition_point(|(first, _)| *first <= corner) - 1;
            let (first, [mesh, part]) = self.primitives[at];
            format!("vertex {} of primitive {part} of mesh {mesh}", corner - first)
        };
        let ([a, b], sharing) = (found.corners.map(named), found.sharing);
        Err(format!("it is not manifold: {sharing} triangles share the edge from {a} to {b}, and only two can"))
    }
}

impl Node {
    fn matrix(&self) -> DMat4 {
        if let Some(matrix) = &self.matrix {
            return DMat4::from_cols_array(matrix);
        }
        let rotation = self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
        let scale = self.scale.map_or(DVec3::ONE, DVec3::from);
        // glam asserts a unit quaternion where its assertions are on
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
        let points = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]];
        let corners: [u16; 12] = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        let mut data: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        data.extend(corners.iter().flat_map(|i| i.to_le_bytes()));
        packed(json, &data)
    }

    fn packed(json: &str, data: &[u8]) -> Vec<u8> {
        let mut text = json.as_bytes().to_vec();
        text.resize(text.len().next_multiple_of(4), b' ');
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
    fn a_tetrahedron_is_read_placed_and_set_upright() {
        let mesh = read(&tetrahedron(), 1.0).unwrap();
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (4, 4));
        // x 5 from the node; y is up in the file, z here
        assert!(mesh.points.contains(&glam::DVec3::new(5.0, 0.0, 2.0)), "{:?}", mesh.points);
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.points[i as usize] - mesh.points[0]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume - 1.0 / 3.0).abs() < 1e-12, "{volume}"); // faces outward
    }

    #[test]
    fn data_outside_the_file_is_refused() {
        for bad in [json(48 + 24, 5, 12), json(48 + 24, 4, 1000), json(48 + 24, 4, 4_000_000_000), json(9000, 4, 12)] {
            let message = read(&file(&bad), 1.0).err();
            // a buffer that claims more bytes than the file has is reported only where a read passes its end
            assert!(message.is_some() || bad == json(9000, 4, 12), "{bad}");
        }
        let whole = tetrahedron();
        for cut in [5, 11, 12, 19, 30, whole.len() - 30, whole.len() - 1] {
            assert!(read(&whole[..cut], 1.0).is_err(), "cut at {cut}");
        }
        let ring = json(72, 4, 12).replace("\"translation\":[5,0,0]", "\"children\":[0]");
        assert!(read(&file(&ring), 1.0).is_err());
    }

    /// The error for the tetrahedron with `from` replaced by `to` in its text; empty if it is read.
    fn message(from: &str, to: &str) -> String {
        let text = json(48 + 24, 4, 12);
        assert!(text.contains(from), "{from}");
        read(&file(&text.replace(from, to)), 1.0).err().unwrap_or_default()
    }

    #[test]
    fn an_extension_that_is_required_is_refused_by_its_name_if_it_changes_triangles() {
        let with = |names: &str| message("\"scene\":0", &format!("\"scene\":0,\"extensionsRequired\":[{names}]"));
        assert!(
            with("\"KHR_materials_unlit\",\"KHR_draco_mesh_compression\"").contains("`KHR_draco_mesh_compression`")
        );
        assert_eq!(with("\"KHR_materials_unlit\""), "");
    }

    #[test]
    fn corners_that_make_no_triangles_are_refused() {
        assert!(message("\"count\":12", "\"count\":11").contains("primitive 0 of mesh 0 has 11 corners"));
        let short = json(48 + 24, 4, 2).replace("\"indices\":1}", "\"indices\":1,\"mode\":6}");
        assert!(read(&file(&short), 1.0).unwrap_err().contains("expected three or more"));
    }

    #[test]
    fn a_mesh_that_branches_is_refused_and_meshes_that_touch_are_not() {
        let primitive = r#"{"attributes":{"POSITION":0},"indices":1}"#;
        let repeated = message(primitive, &format!("{primitive},{primitive}"));
        let edge = "4 triangles share the edge from vertex 0 of primitive 1 of mesh 0 to vertex";
        assert!(repeated.contains("not manifold") && repeated.contains(edge), "{repeated}");
        assert_eq!(message("\"nodes\":[0]", "\"nodes\":[0,0]"), "");
    }

    #[test]
    fn points_and_primitives_that_many_nodes_show_are_counted_before_they_are_read() {
        // the tetrahedron's four points as 30 000, shown by 101 nodes: 3 030 000 points for 404 triangles
        let points = 30_000_usize;
        let text = json(12 * points + 24, points, 12)
            .replace("\"byteLength\":48},", &format!("\"byteLength\":{}}},", 12 * points))
            .replace("\"byteOffset\":48", &format!("\"byteOffset\":{}", 12 * points));
        let shown = |times: usize| {
            let nodes = vec!["0"; times].join(",");
            let mut data = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]].to_vec();
            data.resize(points, [0.0; 3]);
            let mut data: Vec<u8> = data.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
            data.extend([0_u16, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3].iter().flat_map(|i| i.to_le_bytes()));
            let text = text.replace("[{\"nodes\":[0]}]", &format!("[{{\"nodes\":[{nodes}]}}]"));
            read(&packed(&text, &data), 1.0).err().unwrap_or_default()
        };
        assert_eq!(shown(2), "");
        assert_eq!(shown(101), "the meshes that its nodes instantiate have more than 3000000 points");
        let line = r#"{"attributes":{},"mode":1}"#;
        let lines = format!("{line},").repeat(60_000) + line;
        let text = json(72, 4, 12).replace("\"primitives\":[", &format!("\"primitives\":[{lines},"));
        let twice = text.replace("[{\"nodes\":[0]}]", "[{\"nodes\":[0,0]}]");
        assert_eq!(read(&file(&text), 1.0).err(), None);
        assert!(read(&file(&twice), 1.0).unwrap_err().contains("more than 100000 primitives"));
    }

    #[test]
    fn a_node_that_blows_its_mesh_up_past_the_bounds_of_a_scene_is_refused() {
        let why = message("\"translation\":[5,0,0]", "\"scale\":[1e30,1e30,1e30]");
        assert!(why.contains("it extends 2.000e30 m"), "{why}");
        assert!(message("\"translation\":[5,0,0]", "\"scale\":[0,0,0]").contains("has an area"));
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
