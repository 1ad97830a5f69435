//! An unstructured grid as a file of VTK (.vtu): points, cells of one kind, data of both.
//!
//! In: points, cells, arrays. Out: a file, whose arrays are appended as they are, each after its length in bytes. Never here: compression.

use super::super::ExportError;
use glam::DVec3;
use metachron_world::OutputFile;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The numbers that VTK gives kinds of cells.
const VERTEX: u8 = 1;
const TRIANGLE: u8 = 5;

/// Cells of one kind.
pub(super) struct Grid {
    kind: u8,
    corners: usize,
    pub points: Vec<DVec3>,
    /// The points of one cell after the other.
    pub cells: Vec<u32>,
    pub of_points: Vec<Array>,
    pub of_cells: Vec<Array>,
}

/// An array of numbers or texts.
pub(super) struct Array {
    kind: &'static str,
    name: &'static str,
    components: u8,
    bytes: Vec<u8>,
}

impl Array {
    pub fn vectors(name: &'static str, values: impl Iterator<Item = DVec3>) -> Self {
        let bytes = values.flat_map(|v| v.to_array()).flat_map(f64::to_le_bytes).collect();
        Self { kind: "Float64", name, components: 3, bytes }
    }

    pub fn numbers(name: &'static str, values: impl Iterator<Item = f64>) -> Self {
        Self { kind: "Float64", name, components: 1, bytes: values.flat_map(f64::to_le_bytes).collect() }
    }

    pub fn integers(name: &'static str, values: impl Iterator<Item = i32>) -> Self {
        Self { kind: "Int32", name, components: 1, bytes: values.flat_map(i32::to_le_bytes).collect() }
    }

    /// Each ends with a zero, so one of its own is none.
    pub fn texts<'a>(name: &'static str, values: impl Iterator<Item = &'a str>) -> Self {
        let bytes = values.flat_map(|text| text.bytes().filter(|byte| *byte != 0).chain([0])).collect();
        Self { kind: "String", name, components: 1, bytes }
    }
}

impl Grid {
    pub fn of_triangles() -> Self {
        Self { kind: TRIANGLE, corners: 3, points: vec![], cells: vec![], of_points: vec![], of_cells: vec![] }
    }

    /// A cell for every point.
    pub fn of_vertices(points: Vec<DVec3>) -> Self {
        let cells = (0..points.len() as u32).collect();
        Self { kind: VERTEX, corners: 1, points, cells, of_points: vec![], of_cells: vec![] }
    }

    pub fn save(&self, path: &Path) -> Result<(), ExportError> {
        let mut file = BufWriter::new(OutputFile::growing(path).map_err(ExportError::at(path))?);
        self.write(&mut file).and_then(|()| file.flush()).map_err(ExportError::at(path))
    }

    fn write(&self, file: &mut impl Write) -> std::io::Result<()> {
        let cells = self.cells.len() / self.corners;
        let integers =
            |values: &mut dyn Iterator<Item = usize>| values.flat_map(|k| (k as i64).to_le_bytes()).collect();
        let array = |kind, name, bytes| Array { kind, name, components: 1, bytes };
        let points = [Array::vectors("Points", self.points.iter().copied())];
        let corners = [
            array("Int64", "connectivity", integers(&mut self.cells.iter().map(|k| *k as usize))),
            array("Int64", "offsets", integers(&mut (1..=cells).map(|k| k * self.corners))),
            array("UInt8", "types", vec![self.kind; cells]),
        ];
        let groups = [
            ("Points", &points[..]),
            ("Cells", &corners),
            ("PointData", &self.of_points),
            ("CellData", &self.of_cells),
        ];
        write!(
            file,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">\n",
            self.points.len(),
        )?;
        let mut offset = 0;
        for (group, arrays) in groups {
            writeln!(file, "<{group}>")?;
            for Array { kind, name, components, bytes } in arrays {
                writeln!(
                    file,
                    "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
                )?;
                offset += 8 + bytes.len();
            }
            writeln!(file, "</{group}>")?;
        }
        write!(file, "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_")?;
        for array in groups.iter().flat_map(|(_, arrays)| *arrays) {
            file.write_all(&(array.bytes.len() as u64).to_le_bytes())?;
            file.write_all(&array.bytes)?;
        }
        write!(file, "\n</AppendedData>\n</VTKFile>\n")
    }
}
