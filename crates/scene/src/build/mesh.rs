//! Reads files of triangles: OBJ by [`super::obj`], STL by [`super::stl`], and binary glTF by [`super::glb`].
//!
//! In: any bytes. Out: a surface with valid indices, within bounds and manifold, or the fault of the file. Meshes for
//! drawing and for contact are both read here. Never here: the file system.
//!
//! Manifold is judged by positions, not by indices: a seam of points that are doubled for their texture coordinates or normals is no
//! rim, and hides no branch. It is judged object by object (of an OBJ file `o` and `g`, of glTF the mesh of a node): boxes side by side
//! are no branch. Open rims are sound; a face that is there twice counts twice; one without an area does not count.

use super::{POSITION_MAX_M, glb, obj, stl};
use glam::{DVec3, Vec2};
use metachron_geometry::Triangles;

/// Most triangles of a mesh: past it a body would not step in real time.
pub(super) const TRIANGLES_MAX: usize = 1_000_000;

/// A triangle mesh.
#[derive(Debug)]
pub(super) struct Mesh {
    /// In the file's own unit.
    pub(super) points: Vec<DVec3>,
    /// Texture coordinates of each point, from the top left; empty where the mesh has none.
    pub(super) uvs: Vec<Vec2>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Points, their texture coordinates (empty if there are none) and triangles.
pub(super) type Parts = (Vec<DVec3>, Vec<Vec2>, Vec<[u32; 3]>);

/// Reads a file of any of the formats, recognised by its bytes; `scale` is the factor that its coordinates will be multiplied by.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<Mesh, String> {
    let (points, uvs, triangles) = match bytes {
        [] => return Err("it is empty".to_owned()),
        _ if bytes.starts_with(glb::MAGIC) => glb::read(bytes)?,
        _ if stl::is_stl(bytes) => stl::read(bytes)?,
        _ => obj::read(text(bytes)?)?,
    };
    check(&points, &triangles)?;
    check_points(&points, scale)?;
    Ok(Mesh { points, uvs, triangles })
}

/// The points of a file, of which a hull is made.
pub(super) fn hull_points(bytes: &[u8], scale: f64) -> Result<Vec<DVec3>, String> {
    let points = surface(bytes)?.points;
    check_points(&points, scale)?;
    Ok(points)
}

/// The points and triangles of an STL, OBJ or .glb file in its own unit, no matter how its triangles are connected; of an OBJ file without faces its
/// points alone.
///
/// # Errors
/// The fault of the file.
pub fn surface(bytes: &[u8]) -> Result<Triangles, String> {
    let (points, triangles) = match bytes {
        [] => return Err("it is empty".to_owned()),
        _ if bytes.starts_with(glb::MAGIC) => glb::surface(bytes)?,
        _ if stl::is_stl(bytes) => stl::read(bytes).map(|(points, _, triangles)| (points, triangles))?,
        _ => obj::surface(text(bytes)?)?,
    };
    Ok(Triangles { points, triangles })
}

/// Reads a file as [`read`] does: its triangles in metres.
pub fn triangles(bytes: &[u8], scale: f64) -> Result<Triangles, String> {
    let Mesh { points, triangles, .. } = read(bytes, scale)?;
    Ok(Triangles { points: points.iter().map(|point| *point * scale).collect(), triangles })
}

/// Checks that a mesh whose coordinates go up to `reach` in its own unit stays within the bounds of a scene.
pub(super) fn within(reach: f64, scale: f64) -> Result<(), String> {
    let metres = reach * scale;
    if metres <= POSITION_MAX_M {
        return Ok(());
    }
    Err(format!("it extends {metres:.3e} m from its origin, more than {POSITION_MAX_M:.0} m"))
}

/// Refuses bytes that cannot be text.
fn text(bytes: &[u8]) -> Result<&[u8], String> {
    if bytes.trim_ascii_start().starts_with(b"{") {
        return Err("it is not an OBJ file; if it is glTF in text form, expected the binary form, .glb".to_owned());
    }
    match bytes.iter().position(|byte| *byte == 0) {
        None => Ok(bytes),
        Some(at) => Err(format!(
            "it is neither a .glb file, which begins with `glTF`, nor an OBJ file, which is text: byte {at} is 0, nor an STL file: {}",
            stl::unlike(bytes)
        )),
    }
}

/// Checks that points are finite and within the bounds of a scene.
fn check_points(points: &[DVec3], scale: f64) -> Result<(), String> {
    if let Some(bad) = points.iter().position(|p| !p.is_finite()) {
        return Err(format!("point {} is not finite", bad + 1));
    }
    let far = |point: &DVec3| point.abs().max_element();
    let Some(point) = points.iter().max_by(|a, b| far(a).total_cmp(&far(b))) else { return Ok(()) };
    let at = point.to_array().map(|x| format!("{x:.3e}")).join(", ");
    within(far(point), scale).map_err(|why| format!("{why}: a point of it is at ({at})"))
}

fn check(points: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), String> {
    if triangles.is_empty() {
        return Err(
            "it has no faces: no triangles of an STL or .glb file, no line of an OBJ file that begins with `f`"
                .to_owned(),
        );
    }
    if triangles.len() > TRIANGLES_MAX {
        return Err(format!("it has {} triangles, more than {TRIANGLES_MAX}", triangles.len()));
    }
    let count = points.len();
    if let Some(bad) = triangles.iter().position(|t| t.iter().any(|i| *i as usize >= count)) {
        return Err(format!("face {} uses a point that does not exist", bad + 1));
    }
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        (b - a).cross(c - a) != DVec3::ZERO
    };
    if !triangles.iter().any(area) {
        return Err(format!("none of its {} triangles has an area", triangles.len()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_drawable::{Generator, generate};
    use metachron_geometry::PrimitiveVertex;
    use proptest::prelude::*;

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

    #[test]
    fn a_hull_takes_the_points_of_faces_that_make_no_surface() {
        // a fourth face on the edge from the first vertex to the third, and a vertex that is on no face
        let text = format!("{TETRAHEDRON}v 9 9 9\nv 1 1 0\nf 1 3 6\n");
        assert!(read(text.as_bytes(), 1.0).unwrap_err().contains("not manifold"));
        let mut corners = hull_points(text.as_bytes(), 1.0).unwrap();
        corners.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
        assert_eq!(corners, [DVec3::ZERO, DVec3::Z, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 0.0)]);
        assert_eq!(hull_points(b"v 0 0 0\nv 1 0 0\n", 1.0).unwrap().len(), 2);
        assert!(hull_points(b"v 1e30 0 0\n", 1.0).unwrap_err().contains("extends"));
    }

    #[test]
    fn a_tetrahedron_is_read() {
        let mesh = read(TETRAHEDRON.as_bytes(), 1.0).unwrap();
        assert_eq!((mesh.points.len(), mesh.triangles.len(), mesh.uvs.len()), (4, 4, 0));
        assert!(mesh.points.contains(&DVec3::X));
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

    #[test]
    fn every_mesh_that_comes_with_the_program_is_accepted() {
        for text in [include_str!("../../../../scenes/bracket.obj"), include_str!("../../../../scenes/crystal.obj")] {
            assert_eq!(message(text), "");
        }
        for kind in Generator::ALL {
            let mesh = generate(kind, 1, 500);
            let point = |v: &PrimitiveVertex| format!("v {} {} {}\n", v.core.x, v.core.y, v.core.z);
            let face = |t: &[u32; 3]| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
            let text: String = mesh.vertices.iter().map(point).chain(mesh.triangles.iter().map(face)).collect();
            assert_eq!(message(text), "", "{kind:?}");
        }
    }

    /// Why a file is refused; empty if it is read.
    fn message(bytes: impl AsRef<[u8]>) -> String {
        read(bytes.as_ref(), 1.0).err().unwrap_or_default()
    }

    #[test]
    fn a_file_that_is_no_mesh_is_refused_with_the_accepted_formats() {
        assert_eq!(message(""), "it is empty");
        let rubbish: Vec<u8> = (0..=255).collect();
        for bytes in [&rubbish[..], b"FTlg\x02\0\0\0", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"] {
            let message = message(bytes);
            assert!(message.contains("neither a .glb file") && message.contains("nor an OBJ file"), "{message}");
        }
        assert!(message("{\"asset\":{\"version\":\"2.0\"}}").contains("expected the binary form"));
        assert!(message("hello world\n").contains("no faces"));
        // bytes that are not UTF-8 are harmless in text that is not read
        assert!(read(&[b"# Gr\xf6\xdfe\n", TETRAHEDRON.as_bytes()].concat(), 1.0).is_ok());
    }

    #[test]
    fn a_mesh_stays_within_the_bounds_of_a_scene_after_its_scale() {
        let far = TETRAHEDRON.replace("v 1 0 0", "v 2e5 0 0");
        let why = message(&far);
        assert!(
            why.contains("2.000e5 m") && why.contains("100000 m") && why.contains("(2.000e5, 0.000e0, 0.000e0)"),
            "{why}"
        );
        assert!(read(far.as_bytes(), 0.4).is_ok());
        assert!(read(TETRAHEDRON.as_bytes(), 1.1e5).is_err());
        for huge in ["1e38", "-1e300", "1e154"] {
            assert!(message(TETRAHEDRON.replace("v 1 0 0", &format!("v {huge} 0 0"))).contains("it extends"), "{huge}");
        }
    }

    #[test]
    fn a_file_without_area_is_refused() {
        assert!(message("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").contains("none of its 1 triangles has an area"));
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
