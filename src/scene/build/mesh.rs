//! Files of triangles as points and triangles: OBJ, and glTF's binary form by [`super::glb`].
//!
//! In: any bytes. Out: a mesh with sound corner numbers, or what is wrong with the file. Never here: the file system.

use super::glb;
use glam::{DVec3, Vec2};
use std::io::Cursor;
use std::sync::Arc;
use tobj::{LoadError, LoadOptions};

/// Most triangles of a mesh: past it a body would not step in real time.
pub(super) const TRIANGLES_MAX: usize = 1_000_000;

/// A triangle mesh.
#[derive(Debug)]
pub(super) struct Mesh {
    pub(super) points_m: Arc<[DVec3]>,
    /// The place of each point on the file's texture; empty where it has none.
    pub(super) uvs: Vec<Vec2>,
    pub(super) triangles: Arc<[[u32; 3]]>,
}

/// Reads a file of either kind, told apart by its first bytes; coordinates are multiplied by `scale`.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<Mesh, String> {
    let (mut points, uvs, triangles) = if bytes.starts_with(glb::MAGIC) { glb::read(bytes)? } else { read_obj(bytes)? };
    points.iter_mut().for_each(|point| *point *= scale);
    check(&points, &triangles)?;
    Ok(Mesh { points_m: points.into(), uvs, triangles: triangles.into() })
}

/// Points, their places on a texture (none, if empty) and triangles.
pub(super) type Parts = (Vec<DVec3>, Vec<Vec2>, Vec<[u32; 3]>);

/// Points and triangles of an OBJ file.
fn read_obj(bytes: &[u8]) -> Result<Parts, String> {
    let options = LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..LoadOptions::default() };
    let no_materials = |_: &std::path::Path| Err(LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials).map_err(|e| e.to_string())?;
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for model in models {
        let base = u32::try_from(points.len()).map_err(|_| "too many points".to_owned())?;
        points.extend(model.mesh.positions.as_chunks::<3>().0.iter().map(|p| DVec3::from(p.map(f64::from))));
        triangles.extend(model.mesh.indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| i.saturating_add(base))));
    }
    Ok((points, Vec::new(), triangles))
}

fn check(points: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), String> {
    if triangles.is_empty() {
        return Err("it has no faces".to_owned());
    }
    if triangles.len() > TRIANGLES_MAX {
        return Err(format!("it has {} triangles, more than {TRIANGLES_MAX}", triangles.len()));
    }
    if let Some(bad) = points.iter().position(|p| !p.is_finite()) {
        return Err(format!("point {} is not finite", bad + 1));
    }
    let count = points.len();
    if let Some(bad) = triangles.iter().position(|t| t.iter().any(|i| *i as usize >= count)) {
        return Err(format!("face {} uses a point that does not exist", bad + 1));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

    #[test]
    fn a_tetrahedron_is_read_and_scaled() {
        let mesh = read(TETRAHEDRON.as_bytes(), 2.0).unwrap();
        assert_eq!(mesh.points_m.len(), 4);
        assert_eq!(mesh.triangles.len(), 4);
        assert!(mesh.points_m.contains(&(DVec3::X * 2.0)));
    }

    #[test]
    fn a_file_without_faces_or_with_faces_without_points_is_refused() {
        for bad in [
            "",
            "v 0 0 0\n",
            "f 1 2 3\n",
            "v 0 0 0\nf 1 2 9\n",
            "v nan 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\n",
            "v 0 0\nf 1 1 1\n",
        ] {
            assert!(read(bad.as_bytes(), 1.0).is_err(), "{bad:?}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes, 1.0);
        }

        #[test]
        fn no_damaged_file_makes_the_reader_panic(at in 0..TETRAHEDRON.len(), with in "[ -~\n]{0,4}") {
            let damaged = format!("{}{with}{}", &TETRAHEDRON[..at], &TETRAHEDRON[(at + 1).min(TETRAHEDRON.len())..]);
            let _ = read(damaged.as_bytes(), 1.0);
        }
    }
}
