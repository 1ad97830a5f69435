//! Cells of VTK: which are taken, which are left out, which cannot be used; and the numbers of regions.
//!
//! In: connectivity, kinds, cell data. Out: tetrahedra. Never here: how a file writes them.

use super::points;
use metachron_geometry::Tetrahedra;

/// Cells of VTK by name: cells without a volume are left out, and any other cell is not computed with.
const TETRAHEDRON: u64 = 10;
const WITHOUT_VOLUME: [u64; 13] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23];
const QUADRATIC_TETRAHEDRON: u64 = 24;
/// Names of cell data that say a region, in the order in which they are looked for.
const REGIONS: [&str; 5] = ["region", "gmsh:physical", "medit:ref", "material", "CellEntityIds"];

/// Numbers for each cell.
pub(super) struct CellData {
    pub name: String,
    /// How many numbers a cell has.
    pub width: usize,
    pub values: Vec<f64>,
}

/// An unstructured grid.
#[derive(Default)]
pub(super) struct Grid {
    pub coordinates: Vec<f64>,
    /// Points of all cells, one after the other.
    pub connectivity: Vec<u64>,
    /// Where the points of each cell begin, and where the last ones end.
    pub offsets: Vec<u64>,
    /// The kind of each cell.
    pub kinds: Vec<u64>,
    pub data: Vec<CellData>,
}

impl Grid {
    /// The tetrahedra among the cells.
    pub fn tetrahedra(&self) -> Result<Tetrahedra, String> {
        if self.offsets.len() != self.kinds.len() + 1 {
            let (cells, kinds) = (self.offsets.len().saturating_sub(1), self.kinds.len());
            return Err(format!("it has {cells} cells, and says of {kinds} what they are"));
        }
        let numbers = REGIONS.iter().find_map(|name| self.data.iter().find(|data| data.name == *name));
        if let Some(CellData { name, width, values }) = numbers {
            let (found, cells) = (values.len(), self.kinds.len());
            if *width != 1 || found != cells {
                return Err(format!(
                    "its `{name}` has {found} numbers, {width} a cell: expected one for each of {cells} cells"
                ));
            }
        }
        let mut mesh = Tetrahedra { points: points(&self.coordinates), ..Tetrahedra::default() };
        for (cell, (&kind, ends)) in self.kinds.iter().zip(self.offsets.windows(2)).enumerate() {
            if WITHOUT_VOLUME.contains(&kind) {
                continue;
            }
            if kind == QUADRATIC_TETRAHEDRON {
                return Err(format!("cell {} is a tetrahedron of second order: expected first order", cell + 1));
            }
            if kind != TETRAHEDRON {
                return Err(format!("cell {} is of VTK's kind {kind}: expected tetrahedra (10)", cell + 1));
            }
            let ends = ends[0] as usize..ends[1] as usize;
            let corners = self.connectivity.get(ends).unwrap_or_default();
            let corners: [u64; 4] =
                corners.try_into().map_err(|_| format!("cell {} is a tetrahedron without four points", cell + 1))?;
            // a number too large for a point is no point of the mesh either
            mesh.corners.push(corners.map(|corner| u32::try_from(corner).unwrap_or(u32::MAX)));
            if let Some(numbers) = numbers {
                let number = numbers.values[cell];
                if !(number.abs() < 9e15 && number.fract() == 0.0) {
                    return Err(format!("cell {} has the region {number}: expected a whole number", cell + 1));
                }
                mesh.regions.push(number as i64);
            }
        }
        Ok(mesh)
    }
}
