//! Reads files of tetrahedra: gmsh (.msh) by [`msh`], legacy VTK by [`vtk`], VTK's XML (.vtu) by [`vtu`].
//!
//! In: any bytes. Out: a mesh in the file's own unit with the region of each tetrahedron, or the fault of the file and
//! where.
//! Never here: whether the mesh makes a solid ([`Tetrahedra::check`]), the file system.

mod cells;
mod msh;
mod vtk;
mod vtu;
mod words;

use glam::DVec3;
use metachron_geometry::Tetrahedra;

/// Most points and most cells of a file, and most numbers of an array.
const COUNT_MAX: usize = 4_000_000;
const NUMBERS_MAX: usize = 4 * COUNT_MAX;
/// Byte order mark that text editors put before UTF-8; skipped.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Whether a file is meant to be in one of the formats, by its bytes or its name.
pub(super) fn is_volume(name: &str, bytes: &[u8]) -> bool {
    let named = [".msh", ".vtk", ".vtu"].iter().any(|end| name.to_ascii_lowercase().ends_with(end));
    named || msh::is_msh(bytes) || vtk::is_vtk(bytes) || vtu::is_vtu(bytes)
}

/// Reads a file of any of the formats, recognised by its bytes.
pub(super) fn read(bytes: &[u8]) -> Result<Tetrahedra, String> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    if bytes.is_empty() {
        return Err("it is empty".to_owned());
    }
    if msh::is_msh(bytes) {
        return msh::read(bytes).map_err(|why| format!("as a gmsh file: {why}"));
    }
    if vtk::is_vtk(bytes) {
        return vtk::read(bytes).map_err(|why| format!("as a legacy VTK file: {why}"));
    }
    if vtu::is_vtu(bytes) {
        return vtu::read(bytes).map_err(|why| format!("as a VTK XML file: {why}"));
    }
    Err("it begins neither as a gmsh file (`$MeshFormat`) nor as a VTK file (`# vtk DataFile` or `<VTKFile`)"
        .to_owned())
}

/// A number of things that a file says it has.
fn counted(what: &str, count: u64) -> Result<usize, String> {
    match usize::try_from(count) {
        Ok(count) if count <= COUNT_MAX => Ok(count),
        _ => Err(format!("it says that it has {count} {what}, more than {COUNT_MAX}")),
    }
}

/// Numbers that must be whole.
fn whole(what: &str, values: &[f64]) -> Result<Vec<u64>, String> {
    let of = |(at, value): (usize, &f64)| {
        let is_whole = (0.0..9e15).contains(value) && value.fract() == 0.0;
        let wrong = || format!("number {} of its {what} is {value}: expected a whole number, 0 or above", at + 1);
        if is_whole { Ok(*value as u64) } else { Err(wrong()) }
    };
    values.iter().enumerate().map(of).collect()
}

/// Points of a flat list of coordinates.
fn points(coordinates: &[f64]) -> Vec<DVec3> {
    coordinates.chunks_exact(3).map(DVec3::from_slice).collect()
}

#[cfg(test)]
mod tests;
