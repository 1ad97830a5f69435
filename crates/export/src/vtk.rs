//! A series of VTK files for ParaView: at each moment one of all surfaces, one of all objects as points and one of all contacts, and indices of
//! them with their times.
//!
//! In: moments. Out: `series.pvd`, `000000.vtu` …, `objects.pvd`, `contacts.pvd` and their files, `fixed.vtu`, `objects.csv` in a folder.
//! Never here: the words of VTK's files (`grid.rs`), compression, partitions.

mod grid;

use super::moment::{ContactMoment, ObjectMoment};
use super::surface::Surface;
use super::{ExportError, Moment, MomentWriter};
use glam::DVec3;
use grid::{Array, Grid};
use metachron_core::{AgentId, Body, ContactPartner};
use metachron_world::{OutputFile, Scene, Stresses};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The indices of surfaces, of objects and of contacts.
const INDICES: [&str; 3] = ["series.pvd", "objects.pvd", "contacts.pvd"];
/// The beginnings of the names of their files.
const PREFIXES: [&str; 3] = ["", "objects", "contacts"];
/// The names of the objects, and the solids that never move.
const NAMES: &str = "objects.csv";
const FIXED: &str = "fixed.vtu";
/// The ending of the files of moments.
const ENDING: &str = ".vtu";
const INDEX_HEAD: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
const INDEX_FOOT: &str = "</Collection>\n</VTKFile>\n";

/// A folder of files that ParaView opens by `series.pvd`.
///
/// Points have `velocity` (m/s) and `von_mises_pa` (the stress of elastic forces in soft bodies and tubes, there the greatest in the section; NaN
/// elsewhere, in objects that joined later and where cells were removed); triangles have `object` (the number of their agent, by which `objects.csv` names it), `eps_m` (the spacing
/// that it is simulated at, metres, NaN where it has none) and `residual_m` (its estimate of its own error, metres).
/// `objects.pvd` has a point in the middle of every object, with its `name`, its number as `object`, its `velocity` (m/s), the sum of its contact
/// forces as `contact_force` (N) and its `energy_j`. `contacts.pvd` has a point where every contact bears most, with the names `object_name` and
/// `with_name`, the numbers `object` and `with` (−1 of a static solid), the `normal` towards the object, the `contact_force` on it (N: the mean of
/// its last step) and `depth_m`; a contact whose place is not known is left out.
/// The indices are complete after every moment, so that a run that was cut short opens as far as it went.
#[derive(Debug)]
pub struct VtkSeries {
    folder: PathBuf,
    indices: [OutputFile; 3],
    names: BufWriter<OutputFile>,
    named: BTreeSet<AgentId>,
    moments: u64,
    stresses: Stresses,
}

impl VtkSeries {
    /// Files of every series except the files of its moments, whose names end in their numbers,
    /// [`VtkSeries::MOMENT_DIGITS`] digits or more.
    pub const FILES: [&str; 5] = [INDICES[0], INDICES[1], INDICES[2], NAMES, FIXED];
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

    /// Begins a series of a world of this scene in a folder, which is made where it does not exist.
    ///
    /// # Errors
    /// The errors of [`VtkSeries::check`]; [`ExportError::File`] where the folder cannot be made or written.
    pub fn create(folder: &Path, scene: &Scene) -> Result<Self, ExportError> {
        Self::check(folder)?;
        std::fs::create_dir_all(folder).map_err(ExportError::at(folder))?;
        let index = |name: &str| {
            let path = folder.join(name);
            let mut index = OutputFile::growing(&path).map_err(ExportError::at(&path))?;
            index.write_all(format!("{INDEX_HEAD}{INDEX_FOOT}").as_bytes()).map_err(ExportError::at(&path))?;
            Ok(index)
        };
        let [surfaces, objects, contacts] = INDICES.map(index);
        let indices = [surfaces?, objects?, contacts?];
        let names = folder.join(NAMES);
        let mut names = BufWriter::new(OutputFile::growing(&names).map_err(ExportError::at(&names))?);
        writeln!(names, "object,name").map_err(ExportError::at(folder))?;
        let fixed = Surface::fixed(scene);
        surfaces_of(&[Part { object: -1, eps_m: f64::NAN, residual_m: 0.0, surface: &fixed, stresses_pa: None }])
            .save(&folder.join(FIXED))?;
        Ok(Self {
            folder: folder.to_owned(),
            indices,
            names,
            named: BTreeSet::new(),
            moments: 0,
            stresses: Stresses::of(scene),
        })
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
        let parts = moment.objects.iter().map(|object| Part {
            object: number(object.id),
            eps_m: object.state.resolution.map_or(f64::NAN, |resolution| resolution.eps_m),
            residual_m: object.state.residual_m,
            surface: &object.surface,
            stresses_pa: self.stresses.von_mises_pa(object.id, &object.state),
        });
        let grids = [surfaces_of(&parts.collect::<Vec<_>>()), objects_of(moment), contacts_of(&moment.contacts)];
        for ((grid, prefix), index) in grids.iter().zip(PREFIXES).zip(&mut self.indices) {
            let file = format!("{prefix}{:0width$}{ENDING}", self.moments, width = Self::MOMENT_DIGITS);
            grid.save(&self.folder.join(&file))?;
            enter(index, moment.time.as_secs_f64(), &file).map_err(ExportError::at(&self.folder))?;
        }
        moment.objects.iter().try_for_each(|object| self.name(object)).map_err(ExportError::at(&self.folder))?;
        self.names.flush().map_err(ExportError::at(&self.folder))?;
        self.moments += 1;
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ExportError> {
        self.names.flush().map_err(ExportError::at(&self.folder))
    }
}

/// Adds a file to an index, in the place of its end.
fn enter(index: &mut OutputFile, time_s: f64, file: &str) -> std::io::Result<()> {
    let entry = format!("<DataSet timestep=\"{time_s}\" part=\"0\" file=\"{file}\"/>\n{INDEX_FOOT}");
    index.seek(SeekFrom::End(-(INDEX_FOOT.len() as i64)))?;
    index.write_all(entry.as_bytes())
}

/// Whether a series may have a file of this name.
fn is_of_a_series(name: &str) -> bool {
    let is_number =
        |number: &str| number.len() >= VtkSeries::MOMENT_DIGITS && number.bytes().all(|digit| digit.is_ascii_digit());
    let is_moment = |stem: &str| PREFIXES.iter().any(|prefix| stem.strip_prefix(prefix).is_some_and(is_number));
    VtkSeries::FILES.contains(&name) || name.strip_suffix(ENDING).is_some_and(is_moment)
}

fn number(id: AgentId) -> i32 {
    id.0.cast_signed()
}

/// The triangles of one object, and the values that all of them share.
struct Part<'a> {
    object: i32,
    eps_m: f64,
    residual_m: f64,
    surface: &'a Surface,
    /// At the vertices or nodes of the object.
    stresses_pa: Option<Vec<f64>>,
}

fn surfaces_of(parts: &[Part<'_>]) -> Grid {
    let mut grid = Grid::of_triangles();
    for Part { surface, .. } in parts {
        let first = grid.points.len() as u32;
        grid.points.extend(&surface.points);
        grid.cells.extend(surface.triangles.iter().flatten().map(|corner| corner + first));
    }
    let stresses = parts.iter().flat_map(|Part { surface, stresses_pa, .. }| {
        let of_point = move |point: usize| stresses_pa.as_ref()?.get(*surface.follows.get(point)? as usize).copied();
        (0..surface.points.len()).map(move |point| of_point(point).unwrap_or(f64::NAN))
    });
    let velocities = parts.iter().flat_map(|part| part.surface.velocities.iter().copied());
    let of_cells = || parts.iter().flat_map(|part| std::iter::repeat_n(part, part.surface.triangles.len()));
    grid.of_points = vec![Array::vectors("velocity", velocities), Array::numbers("von_mises_pa", stresses)];
    grid.of_cells = vec![
        Array::integers("object", of_cells().map(|part| part.object)),
        Array::numbers("eps_m", of_cells().map(|part| part.eps_m)),
        Array::numbers("residual_m", of_cells().map(|part| part.residual_m)),
    ];
    grid
}

/// A point in the middle of every object that has a place.
fn objects_of(moment: &Moment) -> Grid {
    let middle = |object: &ObjectMoment| match &object.state.body {
        Body::Rigid(body) => Some([body.position, body.velocity]),
        _ => object.surface.middle(),
    };
    let placed: Vec<_> = moment.objects.iter().filter_map(|object| Some((object, middle(object)?))).collect();
    let mut forces_n: BTreeMap<AgentId, DVec3> = BTreeMap::new();
    for ContactMoment { object, state, .. } in &moment.contacts {
        *forces_n.entry(*object).or_default() += state.force_n;
        if let ContactPartner::Agent(with) = state.with {
            *forces_n.entry(with).or_default() -= state.force_n;
        }
    }
    let objects = || placed.iter().map(|(object, _)| *object);
    let mut grid = Grid::of_vertices(placed.iter().map(|(_, [position, _])| *position).collect());
    grid.of_points = vec![
        Array::texts("name", objects().map(|object| &*object.name)),
        Array::integers("object", objects().map(|object| number(object.id))),
        Array::vectors("velocity", placed.iter().map(|(_, [_, velocity])| *velocity)),
        Array::vectors("contact_force", objects().map(|object| forces_n.get(&object.id).copied().unwrap_or_default())),
        Array::numbers("energy_j", objects().map(|object| object.state.energy_j)),
    ];
    grid
}

fn contacts_of(contacts: &[ContactMoment]) -> Grid {
    let placed = || contacts.iter().filter(|contact| contact.state.point_m.is_finite());
    let with = |contact: &ContactMoment| match contact.state.with {
        ContactPartner::Agent(id) => number(id),
        ContactPartner::Static(_) => -1,
    };
    let mut grid = Grid::of_vertices(placed().map(|contact| contact.state.point_m).collect());
    grid.of_points = vec![
        Array::texts("object_name", placed().map(|contact| &*contact.names[0])),
        Array::texts("with_name", placed().map(|contact| &*contact.names[1])),
        Array::integers("object", placed().map(|contact| number(contact.object))),
        Array::integers("with", placed().map(with)),
        Array::vectors("normal", placed().map(|contact| contact.state.normal)),
        Array::vectors("contact_force", placed().map(|contact| contact.state.force_n)),
        Array::numbers("depth_m", placed().map(|contact| contact.state.depth_m)),
    ];
    grid
}
