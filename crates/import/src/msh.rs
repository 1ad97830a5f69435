//! MuJoCo's binary meshes (.msh): counts, points, normals, texture coordinates, faces; all little-endian.
//!
//! In: bytes. Out: triangles in the file's unit. Never here: normals, texture coordinates.

use glam::DVec3;
use metachron_geometry::Triangles;

/// Reads a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Triangles, String> {
    let words: Vec<[u8; 4]> = bytes.as_chunks::<4>().0.to_vec();
    let count = |at: usize| {
        let count = words.get(at).and_then(|word| usize::try_from(i32::from_le_bytes(*word)).ok());
        count.ok_or("it has no counts that a .msh file of MuJoCo begins with".to_owned())
    };
    let [points, normals, places, faces] = [count(0)?, count(1)?, count(2)?, count(3)?];
    let first_face = 4 + 3 * points + 3 * normals + 2 * places;
    if words.len() != first_face + 3 * faces || !bytes.len().is_multiple_of(4) {
        let wanted = 4 * (first_face + 3 * faces);
        return Err(format!("its counts make {wanted} bytes, and it has {}", bytes.len()));
    }
    let number = |at: usize| f64::from(f32::from_le_bytes(words[at]));
    let corner = |at: usize| u32::from_le_bytes(words[at]);
    let points: Vec<DVec3> = (0..points).map(|i| DVec3::from_array([0, 1, 2].map(|k| number(4 + 3 * i + k)))).collect();
    let triangles: Vec<[u32; 3]> = (0..faces).map(|i| [0, 1, 2].map(|k| corner(first_face + 3 * i + k))).collect();
    match triangles.iter().flatten().find(|corner| **corner as usize >= points.len()) {
        Some(corner) => Err(format!("a face uses point {corner} of {}", points.len())),
        None => Ok(Triangles { points, triangles }),
    }
}
