//! glTF's binary form (.glb) as points and triangles.
//!
//! In: any bytes. Out: the triangles of every mesh that a node of the scene shows, placed as the nodes say, z up; or what is wrong
//! with the file. Never here: materials, skins, files beside the file. Every number in it is doubted: it may be hostile.

use super::mesh::TRIANGLES_MAX;
use glam::{DMat4, DVec3, DVec4};
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Accessor, Node, Primitive, Semantic};

/// What such a file begins with.
pub(super) const MAGIC: &[u8] = b"glTF";
/// Most nodes that are looked at: one that is its own ancestor would never end.
const NODES_MAX: usize = 100_000;
/// Deepest nesting of nodes.
const DEPTH_MAX: usize = 64;
/// glTF has y up: it becomes z.
const UPRIGHT: DMat4 = DMat4::from_cols(DVec4::X, DVec4::Z, DVec4::NEG_Y, DVec4::W);

#[derive(Default)]
struct Found {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    nodes: usize,
}

/// Points and triangles of a file.
pub(super) fn read(bytes: &[u8]) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), String> {
    let file = gltf::Gltf::from_slice(bytes).map_err(|error| error.to_string())?;
    let data = file.blob.as_deref().unwrap_or_default();
    let scene = file.default_scene().or_else(|| file.scenes().next()).ok_or("it has no scene")?;
    let mut found = Found::default();
    for node in scene.nodes() {
        found.node(&node, UPRIGHT, (data, 0))?;
    }
    Ok((found.points, found.triangles))
}

impl Found {
    fn node(&mut self, node: &Node<'_>, above: DMat4, (data, depth): (&[u8], usize)) -> Result<(), String> {
        self.nodes += 1;
        if self.nodes > NODES_MAX || depth > DEPTH_MAX {
            return Err("its nodes are too many or too deep".to_owned());
        }
        let place = above * matrix(node);
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
            self.primitive(&primitive, place, data)?;
        }
        node.children().try_for_each(|child| self.node(&child, place, (data, depth + 1)))
    }

    fn primitive(&mut self, primitive: &Primitive<'_>, place: DMat4, data: &[u8]) -> Result<(), String> {
        if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let positions = primitive.get(&Semantic::Positions).ok_or("a primitive has no positions")?;
        let first = u32::try_from(self.points.len()).map_err(|_| "too many points")?;
        let points = points(&positions, data)?;
        let count = points.len() as u32;
        let corners = match primitive.indices() {
            Some(accessor) => indices(&accessor, data)?,
            None => (0..count).collect(),
        };
        if let Some(bad) = corners.iter().find(|&&i| i >= count) {
            return Err(format!("a face uses point {bad} of {count}"));
        }
        self.points.extend(points.iter().map(|&p| place.transform_point3(p)));
        let turned = place.determinant() < 0.0;
        let side = |t: [u32; 3]| if turned { [t[0], t[2], t[1]] } else { t };
        self.triangles.extend(triangles(&corners, primitive.mode()).into_iter().map(|t| side(t).map(|i| i + first)));
        if self.triangles.len() > TRIANGLES_MAX {
            return Err(format!("it has more than {TRIANGLES_MAX} triangles"));
        }
        Ok(())
    }
}

fn matrix(node: &Node<'_>) -> DMat4 {
    DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)))
}

fn triangles(corners: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let turned = |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            corners.windows(3).enumerate().map(turned).collect()
        }
        Mode::TriangleFan => corners[1.min(corners.len())..].windows(2).map(|w| [corners[0], w[0], w[1]]).collect(),
        _ => corners.as_chunks::<3>().0.to_vec(),
    }
}

fn points(accessor: &Accessor<'_>, data: &[u8]) -> Result<Vec<DVec3>, String> {
    if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
        return Err("its positions are not three 32-bit floats".to_owned());
    }
    let number = |bytes: &[u8], at: usize| {
        f64::from(f32::from_le_bytes([bytes[4 * at], bytes[4 * at + 1], bytes[4 * at + 2], bytes[4 * at + 3]]))
    };
    let items = items(accessor, data)?;
    Ok(items.map(|bytes| DVec3::new(number(bytes, 0), number(bytes, 1), number(bytes, 2))).collect())
}

fn indices(accessor: &Accessor<'_>, data: &[u8]) -> Result<Vec<u32>, String> {
    if accessor.dimensions() != Dimensions::Scalar {
        return Err("its indices are not single numbers".to_owned());
    }
    let number: fn(&[u8]) -> u32 = match accessor.data_type() {
        DataType::U8 => |bytes| u32::from(bytes[0]),
        DataType::U16 => |bytes| u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        DataType::U32 => |bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        _ => return Err("its indices are not whole numbers".to_owned()),
    };
    Ok(items(accessor, data)?.map(number).collect())
}

/// The bytes of every item of an accessor, checked to lie inside the file.
fn items<'d>(accessor: &Accessor<'_>, data: &'d [u8]) -> Result<impl Iterator<Item = &'d [u8]> + use<'d>, String> {
    let outside = || "its data lies outside the file: it is cut short, or kept in another".to_owned();
    let view = accessor.view().filter(|_| accessor.sparse().is_none());
    let view = view.ok_or("its data is sparse, which is not understood")?;
    if !matches!(view.buffer().source(), Source::Bin) {
        return Err(outside());
    }
    let end = view.offset().checked_add(view.length()).ok_or_else(outside)?;
    let bytes = data.get(view.offset()..end).ok_or_else(outside)?;
    let (size, count) = (accessor.size(), accessor.count());
    let stride = view.stride().unwrap_or(size).max(size);
    let last = count.checked_sub(1).ok_or("it has an empty list")?;
    let reach = last.checked_mul(stride).and_then(|n| n.checked_add(accessor.offset())?.checked_add(size));
    if reach.is_none_or(|reach| reach > bytes.len()) {
        return Err(outside());
    }
    let start = accessor.offset();
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
