//! Reads STL files, binary or text, as points and triangles.
//!
//! In: any bytes. Out: triangles over points, one for all corners that coincide. Never here: colours, the normals of the file.

use super::mesh::{Parts, TRIANGLES_MAX};
use glam::DVec3;
use std::collections::HashMap;

/// Bytes of the header of a binary file, and of each triangle of it.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Whether the bytes are an STL file: at least as many as its header says, or text of facets.
pub(super) fn is_stl(bytes: &[u8]) -> bool {
    is_text(bytes) || binary(bytes).is_some()
}

fn is_text(bytes: &[u8]) -> bool {
    let begins = |word: &[u8]| bytes.trim_ascii_start().get(..word.len()).is_some_and(|s| s.eq_ignore_ascii_case(word));
    begins(b"solid") && bytes.windows(5).take(1000).any(|word| word.eq_ignore_ascii_case(b"facet"))
}

/// The triangles of a binary file, each with its normal before it; bytes after them have no meaning.
fn binary(bytes: &[u8]) -> Option<&[u8]> {
    let length = counted(bytes).filter(|count| *count > 0)?.checked_mul(TRIANGLE)?;
    bytes.get(HEADER..HEADER.checked_add(length)?)
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

/// The triangles of a file. As other programs do, it looks at corners alone: normals may be missing or none, names and `endsolid` too.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    // a binary file may begin with the word of a text
    let corners = match binary(bytes) {
        Some(triangles) => triangles.chunks_exact(TRIANGLE).flat_map(corners).collect(),
        None => corners_of_text(bytes)?,
    };
    if corners.len() / 3 > TRIANGLES_MAX {
        return Err(format!("it has {} triangles, more than {TRIANGLES_MAX}", corners.len() / 3));
    }
    let (mut known, mut points) = (HashMap::new(), Vec::new());
    let mut number = |corner: [f32; 3]| {
        // + 0.0 makes -0 the same place as 0
        *known.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            points.push(DVec3::from_array(corner.map(f64::from)));
            points.len() as u32 - 1
        })
    };
    let triangles = corners.chunks_exact(3).map(|t| [number(t[0]), number(t[1]), number(t[2])]).collect();
    Ok((points, vec![], triangles))
}

/// The corners of a triangle of a binary file, after its normal.
fn corners(triangle: &[u8]) -> impl Iterator<Item = [f32; 3]> {
    let number = |at: usize| f32::from_le_bytes(std::array::from_fn(|byte| triangle[at + byte]));
    (1..4).map(move |corner| std::array::from_fn(|axis| number(12 * corner + 4 * axis)))
}

fn corners_of_text(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let mut corners = Vec::new();
    for (number, line) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        if !words.next().is_some_and(|word| word.eq_ignore_ascii_case(b"vertex")) {
            continue;
        }
        let parsed = words.map(|word| std::str::from_utf8(word).ok()?.parse::<f32>().ok()).collect::<Option<Vec<_>>>();
        let corner = parsed.and_then(|all| <[f32; 3]>::try_from(all).ok());
        corners.push(corner.ok_or_else(|| format!("line {number}: a vertex has no three numbers"))?);
    }
    match corners.len() {
        0 => Err("its text has no vertex: it is cut short, or no STL file".to_owned()),
        count if count % 3 == 0 => Ok(corners),
        _ => Err("its last facet has no three corners".to_owned()),
    }
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

    #[test]
    fn text_is_read_without_normals_names_and_ends_as_other_programs_read_it() {
        let plain = read(TEXT.as_bytes()).unwrap();
        for other in [
            TEXT.replace("solid a", "solid"),
            TEXT.replace("endsolid a\n", ""),
            TEXT.replace("normal 0 0 1", "normal nan nan -nan(ind)"),
            TEXT.replace(" normal 0 0 1", ""),
            TEXT.to_uppercase(),
            TEXT.replace('\n', "\r\n"),
        ] {
            assert!(is_stl(other.as_bytes()), "{other}");
            assert_eq!(read(other.as_bytes()).unwrap(), plain, "{other}");
        }
        for (other, why) in [
            (TEXT.replace("vertex 0 1 0\n", ""), "its last facet has no three corners"),
            ("solid a\nfacet normal 0 0 1\n".to_owned(), "its text has no vertex: it is cut short, or no STL file"),
            (TEXT.replace("vertex 0 1 0", "vertex 0 1"), "line 6: a vertex has no three numbers"),
        ] {
            assert_eq!(read(other.as_bytes()).unwrap_err(), why);
        }
    }

    #[test]
    fn a_binary_file_may_begin_as_a_text_have_normals_that_are_none_and_bytes_at_its_end() {
        let plain = read(&binary(2)).unwrap();
        let mut other = binary(2);
        other[..12].copy_from_slice(b"solid facet ");
        other[HEADER..HEADER + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        other.extend([0; 7]);
        assert!(is_stl(&other));
        assert_eq!(read(&other).unwrap(), plain);
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
