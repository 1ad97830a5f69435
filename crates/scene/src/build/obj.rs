//! Reads OBJ files as points and triangles, line by line.
//!
//! In: any bytes. Out: the triangles of every face, with the texture coordinates of their corners, or the fault of the
//! file, with its line. Never here: materials, normals (they are only counted), curves; lines with other keywords are
//! skipped.
//!
//! A truncated file is recognised by an incomplete line or by faces whose points are missing. A cut at the end of a line, or inside
//! its last number, leaves a valid file.
//! (The crate `tobj` reports no line, takes faces of two corners for lines, and assigns texture coordinates to the wrong points where not
//! all corners have them.)

use super::mesh::{Parts, TRIANGLES_MAX};
use glam::{DVec3, Vec2};
use metachron_geometry::branch;
use std::collections::{BTreeSet, HashMap};

/// Byte order mark that text editors put before UTF-8; skipped.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Index of an attribute that a corner does not have.
const NONE: u32 = u32::MAX;

/// Most corners of one face: the bounding boxes of a fan's slivers all overlap, and the search for the nearest of them takes time that
/// grows faster than their number.
const CORNERS_MAX: usize = 1 << 16;

/// Indices of a corner's point, texture coordinate and normal, from 0.
type Corner = [u32; 3];
/// The lists that the indices of a corner refer to.
const LISTS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The part of a file that has been read.
#[derive(Default)]
struct Reader {
    points: Vec<DVec3>,
    uvs: Vec<Vec2>,
    normals: usize,
    /// Number of objects and groups begun so far.
    object: u32,
    faces: Vec<Face>,
}

/// A triangle of a face.
struct Face {
    corners: [Corner; 3],
    line: u32,
    object: u32,
}

/// Points, their texture coordinates and triangles of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    lines(bytes)?.parts()
}

/// The points and triangles of a file, however they are connected: the points that faces use, or all where there are no faces.
pub(super) fn surface(bytes: &[u8]) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), String> {
    let Reader { points, faces, .. } = lines(bytes)?;
    if faces.is_empty() {
        return Ok((points, Vec::new()));
    }
    let used: BTreeSet<u32> = faces.iter().flat_map(|face| face.corners.map(|[point, ..]| point)).collect();
    let numbers: HashMap<u32, u32> = (0..).zip(&used).map(|(number, point)| (*point, number)).collect();
    let triangles = faces.iter().map(|face| face.corners.map(|[point, ..]| numbers[&point])).collect();
    Ok((used.into_iter().map(|at| points[at as usize]).collect(), triangles))
}

/// All lines of a file, every face of points that there are.
fn lines(bytes: &[u8]) -> Result<Reader, String> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let mut reader = Reader::default();
    let mut pending = Vec::new();
    let last = bytes.split(|b| *b == b'\n').count();
    for (number, line) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let line = line.trim_ascii_end();
        // a backslash at its end continues a line
        if let Some(line) = line.strip_suffix(b"\\") {
            pending.extend_from_slice(line);
            pending.push(b' ');
            continue;
        }
        pending.extend_from_slice(line);
        let cut =
            if number as usize == last { "; it is the last line and incomplete: the file is truncated" } else { "" };
        reader.line(&pending, number).map_err(|why| format!("line {number}: {why}{cut}"))?;
        pending.clear();
    }
    if !pending.is_empty() {
        return Err(format!("line {last} is continued, but nothing follows: the file is truncated"));
    }
    reader.check()?;
    Ok(reader)
}

impl Reader {
    fn line(&mut self, line: &[u8], number: u32) -> Result<(), String> {
        let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut words = words.take_while(|word| !word.starts_with(b"#"));
        match words.next() {
            Some(b"v") => {
                let [x, y, z] = numbers(words, "vertex", 7)?;
                self.points.push(DVec3::new(x, y, z));
            }
            Some(b"vt") => {
                let [u, v] = numbers(words, "texture coordinate", 3)?;
                // images have their first row at the top, OBJ has v = 0 at the bottom
                self.uvs.push(Vec2::new(u as f32, (1.0 - v) as f32));
            }
            Some(b"vn") => {
                let [_, _, _] = numbers(words, "normal", 3)?;
                self.normals += 1;
            }
            Some(b"f") => self.face(words, number)?,
            Some(b"o" | b"g") => self.object += 1,
            _ => {}
        }
        Ok(())
    }

    /// A polygon as a fan of triangles about its first corner.
    fn face<'w>(&mut self, words: impl Iterator<Item = &'w [u8]>, line: u32) -> Result<(), String> {
        let counts = [self.points.len(), self.uvs.len(), self.normals];
        let corners = words.map(|word| corner(word, counts)).collect::<Result<Vec<Corner>, String>>()?;
        if corners.len() < 3 {
            return Err(format!("a face has {} corners; expected three or more", corners.len()));
        }
        if corners.len() > CORNERS_MAX {
            return Err(format!("a face has {} corners, more than {CORNERS_MAX}", corners.len()));
        }
        if self.faces.len() + corners.len() - 2 > TRIANGLES_MAX {
            return Err(format!("the file has more than {TRIANGLES_MAX} triangles"));
        }
        let object = self.object;
        let fan = corners[1..].windows(2).map(|w| Face { corners: [corners[0], w[0], w[1]], line, object });
        self.faces.extend(fan);
        Ok(())
    }

    /// Checks that everything that corners refer to exists, also if it is defined further down.
    fn check(&self) -> Result<(), String> {
        let counts = [self.points.len(), self.uvs.len(), self.normals];
        for face in &self.faces {
            for (list, &index) in face.corners.iter().flat_map(|corner| (0..).zip(corner)) {
                if index != NONE && index as usize >= counts[list] {
                    let (what, number, count) = (LISTS[list], index + 1, counts[list]);
                    return Err(format!("line {}: a face uses {what} {number}, but there are {count}", face.line));
                }
            }
        }
        Ok(())
    }

    /// Makes one point for each distinct pair of a position and a texture coordinate.
    fn parts(&self) -> Result<Parts, String> {
        let mut known = HashMap::new();
        let (mut used, mut triangles) = (Vec::new(), Vec::with_capacity(self.faces.len()));
        for face in &self.faces {
            triangles.push(face.corners.map(|[point, place, _]| {
                *known.entry([point, place]).or_insert_with(|| {
                    used.push((point, place));
                    used.len() as u32 - 1
                })
            }));
        }
        let points: Vec<DVec3> = used.iter().map(|(point, _)| self.points[*point as usize]).collect();
        let place = |(_, place): &(u32, u32)| self.uvs.get(*place as usize).copied().unwrap_or_default();
        let uvs = if self.uvs.is_empty() { Vec::new() } else { used.iter().map(place).collect() };
        if let Some(found) = branch(&points, &triangles, |t| self.faces[t].object) {
            let [a, b] = found.corners.map(|corner| used[corner as usize].0 + 1);
            let (line, sharing) = (self.faces[found.triangle].line, found.sharing);
            return Err(format!(
                "line {line}: it is not manifold: {sharing} triangles share the edge from vertex {a} to vertex {b}, and only two can"
            ));
        }
        Ok((points, uvs, triangles))
    }
}

/// The first `N` numbers of a line that must have at least `N` and at most `most`.
fn numbers<'w, const N: usize>(
    words: impl Iterator<Item = &'w [u8]>,
    what: &str,
    most: usize,
) -> Result<[f64; N], String> {
    let parse = |word: &[u8]| std::str::from_utf8(word).ok()?.parse().ok().filter(|x: &f64| x.is_finite());
    let number = |word: &'w [u8]| parse(word).ok_or_else(|| format!("`{}` is not a finite number", shown(word)));
    let numbers = words.map(number).collect::<Result<Vec<f64>, String>>()?;
    if !(N..=most).contains(&numbers.len()) {
        let expected = if N == most { N.to_string() } else { format!("{N} to {most}") };
        return Err(format!("a {what} has {} numbers; expected {expected}", numbers.len()));
    }
    Ok(std::array::from_fn(|i| numbers[i]))
}

/// A corner such as `3`, `3/1`, `3//2`, `3/1/2`, or counted back from the newest: `-1/-1`.
fn corner(word: &[u8], counts: [usize; 3]) -> Result<Corner, String> {
    let wrong = || format!("`{}` is not a corner of a face", shown(word));
    let mut corner = [NONE; 3];
    for (list, text) in word.split(|b| *b == b'/').enumerate() {
        let slot = corner.get_mut(list).ok_or_else(wrong)?;
        if text.is_empty() && list > 0 {
            continue;
        }
        let number: i64 = std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).ok_or_else(wrong)?;
        let index = if number < 0 { number.checked_add(counts[list] as i64) } else { number.checked_sub(1) };
        let index = index.and_then(|index| u32::try_from(index).ok()).filter(|index| *index != NONE);
        *slot = index.ok_or_else(|| {
            format!("a face uses {} {number}, but there are {}, numbered from 1", LISTS[list], counts[list])
        })?;
    }
    Ok(corner)
}

/// The beginning of a word, for messages.
fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(word).chars().take(32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    /// The error for a file of this text; empty if it is read.
    fn message(text: &str) -> String {
        read(text.as_bytes()).err().unwrap_or_default()
    }

    #[test]
    fn texture_coordinates_start_at_the_top_left_and_a_seam_doubles_points() {
        let text = format!("{SQUARE}vt 0.25 0\nvt 1 0.5\nvt 0 1 0\nf 1/1 2/2 3/3\nf 1/3 3/3 4\n");
        let (points, uvs, triangles) = read(text.as_bytes()).unwrap();
        assert_eq!(triangles, [[0, 1, 2], [3, 2, 4]]);
        assert_eq!((points[0], points[3]), (DVec3::ZERO, DVec3::ZERO));
        let places = [(0.25, 1.0), (1.0, 0.5), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)];
        assert_eq!(uvs, places.map(|(u, v)| Vec2::new(u, v)));
    }

    #[test]
    fn polygons_are_fans_and_numbers_count_back_and_ahead_and_lines_go_on() {
        let plain = read(format!("{SQUARE}f 1 2 3 4\n").as_bytes()).unwrap();
        assert_eq!(plain.2, [[0, 1, 2], [0, 2, 3]]);
        for text in [
            format!("{SQUARE}f -4 -3 -2 -1"),
            format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3//-1 4//1 # a square\r\n"),
            format!("{SQUARE}f 1 2 \\\n3 4\ns off\nusemtl none\n"),
            format!("f 1 2 3 4\no square\n{SQUARE}"),
            format!("\u{feff}{SQUARE}f 1 2 3 4\n"),
        ] {
            assert_eq!(read(text.as_bytes()).unwrap(), plain, "{text}");
        }
    }

    #[test]
    fn a_wrong_line_is_reported_with_its_number() {
        for (more, why) in [
            ("f 1 2", "line 5: a face has 2 corners; expected three or more; it is the last line and incomplete"),
            ("f 1 2\n", "line 5: a face has 2 corners; expected three or more"),
            ("f", "line 5: a face has 0 corners"),
            ("v 0 0", "line 5: a vertex has 2 numbers; expected 3 to 7; it is the last line and incomplete"),
            ("v 0 0 -", "line 5: `-` is not a finite number; it is the last line"),
            ("v 0 nan 0\n", "line 5: `nan` is not a finite number"),
            ("vt 1\n", "line 5: a texture coordinate has 1 numbers; expected 2 to 3"),
            ("vn 1 0\n", "line 5: a normal has 2 numbers; expected 3"),
            ("f 1 2 3 \\", "line 5 is continued, but nothing follows"),
            ("f 1 2 9\n", "line 5: a face uses vertex 9, but there are 4"),
            ("f 1 2 0\n", "line 5: a face uses vertex 0, but there are 4, numbered from 1"),
            ("f 1 2 -5\n", "line 5: a face uses vertex -5"),
            ("f 1 2 99999999999999999999\n", "line 5: `99999999999999999999` is not a corner"),
            ("f 1/1 2/1 3/1\n", "line 5: a face uses texture coordinate 1, but there are 0"),
            ("f 1//2 2//1 3//1\n", "line 5: a face uses normal 2, but there are 0"),
            ("f a b c\n", "line 5: `a` is not a corner of a face"),
            ("f 1/2/3/4 2 3\n", "`1/2/3/4` is not a corner"),
        ] {
            let message = message(&format!("{SQUARE}{more}"));
            assert!(message.starts_with(why) || message.contains(why) && why.starts_with('`'), "{more}: {message}");
            assert_eq!(message.contains("truncated"), !more.ends_with('\n'), "{more}: {message}");
        }
        let wide = format!("{SQUARE}f {}\n", "1 2 3 ".repeat(30_000));
        assert_eq!(message(&wide), "line 5: a face has 90000 corners, more than 65536");
    }

    #[test]
    fn an_edge_of_more_than_two_triangles_is_refused_with_its_line_and_vertices() {
        let star = |edge: fn(usize) -> String| {
            let rim: String = (0..200).map(|i| format!("v {} {} 0\n", (i as f64).cos(), (i as f64).sin())).collect();
            (0..200).fold(rim, |text, i| text + &edge(i))
        };
        let shared =
            star(|i| if i == 0 { "v 0 0 0\nv 0 0 1\nf 201 202 1\n".into() } else { format!("f 201 202 {}\n", i + 1) });
        let why = "200 triangles share the edge from vertex 201 to vertex 202, and only two can";
        assert_eq!(message(&shared), format!("line 205: it is not manifold: {why}"));
        // each face on two vertices of its own at the same positions
        let doubled = star(|i| format!("v 0 0 0\nv 0 0 1\nf -2 -1 {}\n", i + 1));
        assert!(message(&doubled).contains("line 209: it is not manifold: 200 triangles"), "{}", message(&doubled));
        // pages that are separate objects merely touch
        assert_eq!(message(&star(|i| format!("g page {i}\nv 0 0 0\nv 0 0 1\nf -2 -1 {}\n", i + 1))), "");
        // a duplicate face, and faces without area
        assert!(message(&format!("{SQUARE}f 1 2 3\nf 1 3 4\nf 2 3 1\n")).contains("line 7: it is not manifold: 3"));
        assert_eq!(message(&format!("{SQUARE}f 1 2 3\nf 1 3 4\nf 1 1 3\nf 1 3 3\n")), "");
    }
}
