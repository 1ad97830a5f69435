//! Reads files of tetrahedra: gmsh (.msh) by [`msh`], legacy VTK by [`vtk`], VTK's XML (.vtu) by [`vtu`].
//!
//! In: any bytes. Out: a mesh in the file's own unit with the region of each tetrahedron, or what is wrong with the file and where.
//! Never here: whether the mesh makes a solid ([`Tetrahedra::check`]), the file system.

mod cells;
mod msh;
mod vtk;
mod vtu;
mod words;

use glam::DVec3;
use metachron_geometry::Tetrahedra;

/// Most points and most tetrahedra of a file.
const COUNT_MAX: usize = 4_000_000;

/// Whether the bytes are in one of the formats.
pub(super) fn is_volume(bytes: &[u8]) -> bool {
    msh::is_msh(bytes) || vtk::is_vtk(bytes) || vtu::is_vtu(bytes)
}

/// Reads a file of any of the formats, recognised by its bytes.
pub(super) fn read(bytes: &[u8]) -> Result<Tetrahedra, String> {
    if msh::is_msh(bytes) {
        return msh::read(bytes).map_err(|why| format!("as a gmsh file: {why}"));
    }
    if vtk::is_vtk(bytes) {
        return vtk::read(bytes).map_err(|why| format!("as a legacy VTK file: {why}"));
    }
    vtu::read(bytes).map_err(|why| format!("as a VTK XML file: {why}"))
}

/// A number of things that a file says it has.
fn counted(what: &str, count: u64) -> Result<usize, String> {
    match usize::try_from(count) {
        Ok(count) if count <= COUNT_MAX => Ok(count),
        _ => Err(format!("it says that it has {count} {what}, more than {COUNT_MAX}")),
    }
}

/// Points of a flat list of coordinates.
fn points(coordinates: &[f64]) -> Vec<DVec3> {
    coordinates.chunks_exact(3).map(DVec3::from_slice).collect()
}

#[cfg(test)]
mod tests;
