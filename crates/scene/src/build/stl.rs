//! Reads STL files, binary or text, as points and triangles.
//!
//! In: any bytes. Out: triangles over points, one for all corners that coincide. Never here: colours, the normals of the file.

use super::mesh::{Parts, TRIANGLES_MAX};
use glam::DVec3;
use std::io::Cursor;

/// Bytes of the header of a binary file, and of each triangle of it.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Whether the bytes are an STL file: of the length that its header says, or text of facets.
pub(super) fn is_stl(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    let is_text = text.starts_with(b"solid") && text.windows(5).take(1000).any(|word| word == b"facet");
    is_text || counted(bytes).is_some_and(|count| bytes.len() == HEADER + TRIANGLE * count)
}

/// Why bytes that are not text are no STL file.
pub(super) fn unlike(bytes: &[u8]) -> String {
    let length = bytes.len();
    match counted(bytes) {
        None => format!("it has {length} bytes, fewer than the header's {HEADER}"),
        Some(count) => {
            let wanted = HEADER + TRIANGLE * count;
            format!("its header says {count} triangles, which are {wanted} bytes, and it has {length}")
        }
    }
}

/// The number of triangles that the header of a binary file says.
fn counted(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes(count.try_into().ok()?) as usize)
}

/// The triangles of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    let mut cursor = Cursor::new(bytes);
    let mesh = stl_io::read_stl(&mut cursor).map_err(|why| format!("it is no readable STL file: {why}"))?;
    if mesh.faces.len() > TRIANGLES_MAX {
        return Err(format!("it has {} triangles, more than {TRIANGLES_MAX}", mesh.faces.len()));
    }
    let points = mesh.vertices.iter().map(|v| DVec3::from_array([v[0], v[1], v[2]].map(f64::from))).collect();
    let triangles = mesh.faces.iter().map(|face| face.vertices.map(|corner| corner as u32)).collect();
    Ok((points, vec![], triangles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn binary(count: u32) -> Vec<u8> {
        let mut bytes = vec![b' '; HEADER - 4];
        bytes.extend(count.to_le_bytes());
        for triangle in 0..count {
            let corners = [[0.0_f32; 3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, triangle as f32]];
            bytes.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    const TEXT: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

    #[test]
    fn what_is_cut_short_is_told_by_how_much() {
        assert_eq!(unlike(&binary(2)[..150]), "its header says 2 triangles, which are 184 bytes, and it has 150");
        assert_eq!(unlike(&[0; 5]), "it has 5 bytes, fewer than the header's 84");
    }

    #[test]
    fn both_forms_are_read_and_share_points() {
        let (points, _, triangles) = read(&binary(2)).unwrap();
        assert_eq!((points.len(), triangles), (4, vec![[0, 1, 2], [0, 1, 3]]));
        assert!(is_stl(&binary(2)) && is_stl(TEXT.as_bytes()) && !is_stl(&binary(2)[..150]) && !is_stl(b"v 0 0 0"));
        assert_eq!(read(TEXT.as_bytes()).unwrap().2, [[0, 1, 2]]);
    }

    proptest! {
        #[test]
        fn no_damaged_file_makes_the_reader_panic(at in 0..TEXT.len(), with in "[ -~\n]{0,4}", cut in 0..184_usize) {
            let damaged = format!("{}{with}{}", &TEXT[..at], &TEXT[(at + 1).min(TEXT.len())..]);
            let _ = (is_stl(damaged.as_bytes()), read(damaged.as_bytes()));
            let _ = (is_stl(&binary(2)[..cut]), read(&binary(2)[..cut]));
        }
    }
}
