//! A series of VTK files for ParaView: one of all surfaces at each moment, and an index of them with their times.
//!
//! In: moments. Out: `series.pvd`, `000000.vtu` …, `fixed.vtu`, `objects.csv` in a folder. Never here: compression, partitions.

use super::moment::ObjectMoment;
use super::surface::Surface;
use super::{ExportError, Moment, MomentWriter};
use metachron_core::AgentId;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The number that VTK gives a triangle among its cells.
const VTK_TRIANGLE: u8 = 5;
/// The index of a series, the names of its objects, and its solids that never move.
const INDEX: &str = "series.pvd";
const NAMES: &str = "objects.csv";
const FIXED: &str = "fixed.vtu";
/// The ending of the files of surfaces.
const SURFACES: &str = ".vtu";
const INDEX_HEAD: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
const INDEX_FOOT: &str = "</Collection>\n</VTKFile>\n";

/// A folder of files that ParaView opens by `series.pvd`.
///
/// Points have `velocity` (m/s); triangles have `object` (the number of their agent, by which `objects.csv` names it), `eps_m` (the spacing
/// that it is simulated at, metres, NaN where it has none) and `residual_m` (its estimate of its own error, metres).
/// The index is complete after every moment, so that a run that was cut short opens as far as it went.
#[derive(Debug)]
pub struct VtkSeries {
    folder: PathBuf,
    index: File,
    names: BufWriter<File>,
    named: BTreeSet<AgentId>,
    moments: u64,
}

impl VtkSeries {
    /// Files of every series except the files of its moments, which are called by their numbers,
    /// [`VtkSeries::MOMENT_DIGITS`] digits or more.
    pub const FILES: [&str; 3] = [INDEX, NAMES, FIXED];
    /// Digits of the number of a moment, at least.
    pub const MOMENT_DIGITS: usize = 6;

    /// Whether a series may begin in this folder: it does not exist, or holds nothing that would be overwritten. Nothing is made.
    ///
    /// # Errors
    /// [`ExportError::Taken`] names a file that would be overwritten; [`ExportError::File`] where it or its parent is
    /// no folder.
    pub fn check(folder: &Path) -> Result<(), ExportError> {
        let entries = match std::fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(ExportError::at(folder)(error)),
        };
        for entry in entries {
            let name = entry.map_err(ExportError::at(folder))?.file_name();
            if is_of_a_series(&name.to_string_lossy()) {
                return Err(ExportError::Taken { path: folder.join(name) });
            }
        }
        Ok(())
    }

    /// Begins a series in a folder, which is made where it does not exist; `fixed` are the solids that never move.
    ///
    /// # Errors
    /// The errors of [`VtkSeries::check`]; [`ExportError::File`] where the folder cannot be made or written.
    pub fn create(folder: &Path, fixed: &Surface) -> Result<Self, ExportError> {
        Self::check(folder)?;
        std::fs::create_dir_all(folder).map_err(ExportError::at(folder))?;
        let path = folder.join(INDEX);
        let mut index = File::create(&path).map_err(ExportError::at(&path))?;
        index.write_all(format!("{INDEX_HEAD}{INDEX_FOOT}").as_bytes()).map_err(ExportError::at(&path))?;
        let names = folder.join(NAMES);
        let mut names = BufWriter::new(File::create(&names).map_err(ExportError::at(&names))?);
        writeln!(names, "object,name").map_err(ExportError::at(folder))?;
        let path = folder.join(FIXED);
        write_file(&path, &[Part { object: -1, eps_m: f64::NAN, residual_m: 0.0, surface: fixed }])?;
        Ok(Self { folder: folder.to_owned(), index, names, named: BTreeSet::new(), moments: 0 })
    }

    /// Adds a file to the index, in the place of its end.
    fn enter(&mut self, time_s: f64, file: &str) -> std::io::Result<()> {
        let entry = format!("<DataSet timestep=\"{time_s}\" part=\"0\" file=\"{file}\"/>\n{INDEX_FOOT}");
        self.index.seek(SeekFrom::End(-(INDEX_FOOT.len() as i64)))?;
        self.index.write_all(entry.as_bytes())
    }

    fn name(&mut self, object: &ObjectMoment) -> std::io::Result<()> {
        if self.named.insert(object.id) {
            writeln!(self.names, "{},\"{}\"", object.id.0, object.name.replace('"', "\"\""))?;
        }
        Ok(())
    }
}

impl MomentWriter for VtkSeries {
    fn write(&mut self, moment: &Moment) -> Result<(), ExportError> {
        let file = format!("{:0width$}{SURFACES}", self.moments, width = Self::MOMENT_DIGITS);
        let parts = moment.objects.iter().map(|object| Part {
            object: object.id.0.cast_signed(),
            eps_m: object.state.resolution.map_or(f64::NAN, |resolution| resolution.eps_m),
            residual_m: object.state.residual_m,
            surface: &object.surface,
        });
        write_file(&self.folder.join(&file), &parts.collect::<Vec<_>>())?;
        moment.objects.iter().try_for_each(|object| self.name(object)).map_err(ExportError::at(&self.folder))?;
        self.names.flush().map_err(ExportError::at(&self.folder))?;
        self.enter(moment.time.as_secs_f64(), &file).map_err(ExportError::at(&self.folder))?;
        self.moments += 1;
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        self.names.flush().map_err(ExportError::at(&self.folder))
    }
}

/// Whether a series may have a file of this name.
fn is_of_a_series(name: &str) -> bool {
    let is_moment =
        |number: &str| number.len() >= VtkSeries::MOMENT_DIGITS && number.bytes().all(|digit| digit.is_ascii_digit());
    VtkSeries::FILES.contains(&name) || name.strip_suffix(SURFACES).is_some_and(is_moment)
}

/// The triangles of one object, and the values that all of them share.
struct Part<'a> {
    object: i32,
    eps_m: f64,
    residual_m: f64,
    surface: &'a Surface,
}

fn write_file(path: &Path, parts: &[Part<'_>]) -> Result<(), ExportError> {
    let mut file = BufWriter::new(File::create(path).map_err(ExportError::at(path))?);
    write_parts(&mut file, parts).and_then(|()| file.flush()).map_err(ExportError::at(path))
}

/// An unstructured grid of triangles; arrays are appended as they are, each after its length in bytes.
fn write_parts(file: &mut impl Write, parts: &[Part<'_>]) -> std::io::Result<()> {
    let points: usize = parts.iter().map(|part| part.surface.points.len()).sum();
    let triangles: usize = parts.iter().map(|part| part.surface.triangles.len()).sum();
    let arrays = arrays(parts);
    let mut offset = 0;
    let mut declared = arrays.iter().map(|array| {
        let Array { kind, name, components, bytes } = array;
        let line = format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>\n"
        );
        offset += 8 + bytes.len();
        line
    });
    let mut next = |count: usize| declared.by_ref().take(count).collect::<String>();
    write!(
        file,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{triangles}\">\n\
         <Points>\n{}</Points>\n<Cells>\n{}</Cells>\n<PointData>\n{}</PointData>\n<CellData>\n{}</CellData>\n\
         </Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_",
        next(1),
        next(3),
        next(1),
        next(3),
    )?;
    for array in &arrays {
        file.write_all(&(array.bytes.len() as u64).to_le_bytes())?;
        file.write_all(&array.bytes)?;
    }
    write!(file, "\n</AppendedData>\n</VTKFile>\n")
}

struct Array {
    kind: &'static str,
    name: &'static str,
    components: u8,
    bytes: Vec<u8>,
}

/// Points, three arrays of cells, one of points' data, three of cells' data: in the order in which they are declared.
fn arrays(parts: &[Part<'_>]) -> [Array; 8] {
    let vectors = |of: fn(&Surface) -> &[glam::DVec3]| {
        let all = parts.iter().flat_map(|part| of(part.surface)).flat_map(|v| v.to_array());
        all.flat_map(f64::to_le_bytes).collect()
    };
    let mut corners = Vec::new();
    let mut first = 0;
    for part in parts {
        let shifted = part.surface.triangles.iter().flatten().map(|corner| i64::from(*corner) + first);
        corners.extend(shifted.flat_map(i64::to_le_bytes));
        first += part.surface.points.len() as i64;
    }
    let triangles = corners.len() / 24;
    let ends = (1..=triangles as i64).flat_map(|k| (3 * k).to_le_bytes()).collect();
    let of_cells = |value: fn(&Part<'_>) -> f64| {
        let all = parts.iter().flat_map(|part| std::iter::repeat_n(value(part), part.surface.triangles.len()));
        all.flat_map(f64::to_le_bytes).collect()
    };
    let objects = parts.iter().flat_map(|part| std::iter::repeat_n(part.object, part.surface.triangles.len()));
    let array = |kind, name, components, bytes| Array { kind, name, components, bytes };
    [
        array("Float64", "Points", 3, vectors(|surface| &surface.points)),
        array("Int64", "connectivity", 1, corners),
        array("Int64", "offsets", 1, ends),
        array("UInt8", "types", 1, vec![VTK_TRIANGLE; triangles]),
        array("Float64", "velocity", 3, vectors(|surface| &surface.velocities)),
        array("Int32", "object", 1, objects.flat_map(i32::to_le_bytes).collect()),
        array("Float64", "eps_m", 1, of_cells(|part| part.eps_m)),
        array("Float64", "residual_m", 1, of_cells(|part| part.residual_m)),
    ]
}
