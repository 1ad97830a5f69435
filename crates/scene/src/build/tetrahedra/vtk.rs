//! Reads legacy VTK files of unstructured grids, text and binary, of versions up to 5.1.
//!
//! In: bytes. Out: tetrahedra and their regions. Never here: fields of points, other data sets.

use super::cells::{CellData, Grid};
use super::words::Words;
use super::{NUMBERS_MAX, counted, whole};
use metachron_geometry::Tetrahedra;

pub(super) fn is_vtk(bytes: &[u8]) -> bool {
    bytes.starts_with(b"# vtk DataFile")
}

/// How a file writes its numbers.
struct Reader<'a> {
    words: Words<'a>,
    is_binary: bool,
}

pub(super) fn read(bytes: &[u8]) -> Result<Tetrahedra, String> {
    let mut words = Words::new(bytes);
    let version = words.rest_of_line();
    let version: f64 = version.rsplit(' ').next().and_then(|word| word.parse().ok()).unwrap_or(0.0);
    words.rest_of_line();
    let is_binary = match words.word() {
        Some("ASCII") => false,
        Some("BINARY") => true,
        _ => return Err(words.wrong("expected ASCII or BINARY")),
    };
    let mut reader = Reader { words, is_binary };
    reader.grid(version)?.tetrahedra()
}

impl Reader<'_> {
    fn grid(&mut self, version: f64) -> Result<Grid, String> {
        let mut grid = Grid::default();
        let (mut cells, mut of_cells) = (0, false);
        while let Some(word) = self.words.word() {
            match word.to_ascii_uppercase().as_str() {
                "DATASET" => self.data_set()?,
                "POINTS" => {
                    let count = self.count("points")?;
                    grid.coordinates = self.array(3 * count)?;
                }
                "CELLS" if version >= 5.0 => self.cells_5(&mut grid)?,
                "CELLS" => self.cells(&mut grid)?,
                "CELL_TYPES" => {
                    let count = self.count("cells")?;
                    grid.kinds = whole("cell types", &self.numbers("int", count)?)?;
                }
                "CELL_DATA" => (cells, of_cells) = (self.count("cells")?, true),
                "POINT_DATA" => (cells, of_cells) = (self.count("points")?, false),
                "METADATA" => self.skip_metadata(),
                "LOOKUP_TABLE" => self.table()?,
                "FIELD" => {
                    self.words.word();
                    for _ in 0..self.count("arrays")? {
                        let name = self.name();
                        let (width, count) = (self.count("components")?, self.count("values")?);
                        let values = self.array(width.saturating_mul(count))?;
                        if of_cells {
                            grid.data.push(CellData { name, width, values });
                        }
                    }
                }
                "SCALARS" => {
                    let name = self.words.word().unwrap_or_default().to_owned();
                    let values = self.scalars(cells)?;
                    if of_cells {
                        let width = values.len() / cells.max(1);
                        grid.data.push(CellData { name, width, values });
                    }
                }
                other @ ("VECTORS" | "NORMALS" | "TENSORS") => {
                    self.words.word();
                    let width = if other == "TENSORS" { 9 } else { 3 };
                    self.array(width * cells)?;
                }
                other => return Err(self.words.wrong(format_args!("cannot read `{other}`"))),
            }
        }
        Ok(grid)
    }

    /// Goes past VTK's information about an array, which ends at an empty line.
    fn skip_metadata(&mut self) {
        self.words.rest_of_line();
        while !self.words.rest_of_line().is_empty() {}
    }

    /// The name of an array of a field; metadata of the array before may stand in front of it.
    fn name(&mut self) -> String {
        let name = self.words.word().unwrap_or_default();
        if name != "METADATA" {
            return name.to_owned();
        }
        self.skip_metadata();
        self.words.word().unwrap_or_default().to_owned()
    }

    fn data_set(&mut self) -> Result<(), String> {
        let kind = self.words.word().unwrap_or_default();
        let is_known = kind.eq_ignore_ascii_case("UNSTRUCTURED_GRID");
        let wrong = || self.words.wrong(format_args!("the data set is {kind}: expected UNSTRUCTURED_GRID"));
        if is_known { Ok(()) } else { Err(wrong()) }
    }

    fn count(&mut self, what: &str) -> Result<usize, String> {
        let count = self.words.number(format_args!("a number of {what}"))?;
        counted(what, count)
    }

    /// A type and so many numbers of it.
    fn array(&mut self, count: usize) -> Result<Vec<f64>, String> {
        let kind = self.words.word().unwrap_or_default().to_owned();
        self.numbers(&kind, count)
    }

    /// So many numbers of a type. Binary ones begin after the end of the line, the most significant byte first.
    fn numbers(&mut self, kind: &str, count: usize) -> Result<Vec<f64>, String> {
        if count > NUMBERS_MAX {
            return Err(self.words.wrong(format_args!("an array has {count} numbers, more than {NUMBERS_MAX}")));
        }
        if !self.is_binary {
            return (0..count).map(|_| self.words.number("a number")).collect();
        }
        self.words.rest_of_line();
        let kind = kind.to_ascii_lowercase();
        macro_rules! read {
            ($type:ty) => {{
                const WIDTH: usize = size_of::<$type>();
                let bytes = self.words.bytes(count.saturating_mul(WIDTH))?;
                let (values, _) = bytes.as_chunks::<WIDTH>();
                Ok(values.iter().map(|bytes| <$type>::from_be_bytes(*bytes) as f64).collect())
            }};
        }
        match kind.as_str() {
            "double" => read!(f64),
            "float" => read!(f32),
            "vtktypeint64" | "vtkidtype" | "long" => read!(i64),
            "unsigned_long" | "vtktypeuint64" => read!(u64),
            "int" | "vtktypeint32" => read!(i32),
            "unsigned_int" | "vtktypeuint32" => read!(u32),
            "short" | "vtktypeint16" => read!(i16),
            "unsigned_short" | "vtktypeuint16" => read!(u16),
            "char" | "vtktypeint8" => read!(i8),
            "unsigned_char" | "vtktypeuint8" => read!(u8),
            other => Err(self.words.wrong(format_args!("cannot read numbers of the type `{other}`"))),
        }
    }

    fn scalars(&mut self, count: usize) -> Result<Vec<f64>, String> {
        let kind = self.words.word().unwrap_or_default().to_owned();
        let rest = self.words.rest_of_line();
        let width = if rest.is_empty() { 1 } else { rest.parse().unwrap_or(1) };
        if self.words.word() != Some("LOOKUP_TABLE") {
            return Err(self.words.wrong("expected LOOKUP_TABLE"));
        }
        self.words.word();
        self.numbers(&kind, count.saturating_mul(width))
    }

    /// A table of colours, which is left out.
    fn table(&mut self) -> Result<(), String> {
        self.words.word();
        let count = 4 * self.count("colours")?;
        self.numbers(if self.is_binary { "unsigned_char" } else { "float" }, count).map(|_| ())
    }

    /// Cells as files before version 5 have them: each its number of points and its points.
    fn cells(&mut self, grid: &mut Grid) -> Result<(), String> {
        let (count, size) = (self.count("cells")?, self.count("numbers of cells")?);
        let numbers = whole("cells", &self.numbers("int", size)?)?;
        let mut at = 0;
        grid.offsets.push(0);
        for cell in 0..count {
            let width = numbers.get(at).copied().unwrap_or(u64::MAX);
            let left = numbers.len().saturating_sub(at + 1);
            let points = (width <= left as u64).then(|| &numbers[at + 1..at + 1 + width as usize]);
            let points = points.ok_or_else(|| format!("cell {} has not as many points as it says", cell + 1))?;
            grid.connectivity.extend_from_slice(points);
            grid.offsets.push(grid.connectivity.len() as u64);
            at += 1 + points.len();
        }
        Ok(())
    }

    /// Cells as files of version 5 have them: where each begins, and then all points.
    fn cells_5(&mut self, grid: &mut Grid) -> Result<(), String> {
        let (offsets, points) = (self.count("offsets of cells")?, self.count("points of cells")?);
        for (word, count) in [("OFFSETS", offsets), ("CONNECTIVITY", points)] {
            if self.words.word() != Some(word) {
                return Err(self.words.wrong(format_args!("expected {word}")));
            }
            let numbers = whole(&word.to_ascii_lowercase(), &self.array(count)?)?;
            if word == "OFFSETS" { grid.offsets = numbers } else { grid.connectivity = numbers }
        }
        Ok(())
    }
}
