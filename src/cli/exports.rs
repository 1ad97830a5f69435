//! Files of a run for other programs, one moment a frame.
//!
//! In: paths, a world that is played. Out: an MCAP file, a VTK series. Never here: what is in them ([`metachron_export`]).

use metachron_console::output::BadInput;
use metachron_export::{ExportError, McapFile, MomentWriter, Moments, Surface, VtkSeries};
use metachron_world::{Scene, World};
use std::path::PathBuf;

/// Where the moments of a run are written.
#[derive(Debug, Clone, Default)]
pub struct ExportPaths {
    /// A file in MCAP.
    pub mcap: Option<PathBuf>,
    /// A folder for a VTK series.
    pub vtk: Option<PathBuf>,
}

/// The files of a run that is played.
pub(super) struct Exports {
    world: World,
    moments: Moments,
    writers: Vec<Box<dyn MomentWriter>>,
    failed: Option<ExportError>,
}

impl Exports {
    /// Begins the files.
    ///
    /// # Errors
    /// Where one cannot be written; a folder that holds a series already is bad input.
    pub fn create(paths: &ExportPaths, scene: &Scene, world: &World) -> anyhow::Result<Self> {
        let mut writers: Vec<Box<dyn MomentWriter>> = Vec::new();
        if let Some(path) = &paths.mcap {
            writers.push(Box::new(McapFile::create(path, &Surface::fixed(scene))?));
        }
        if let Some(path) = &paths.vtk {
            let series = VtkSeries::create(path, &Surface::fixed(scene)).map_err(|error| match error {
                ExportError::Taken { .. } => anyhow::Error::from(BadInput(error.to_string())),
                other => other.into(),
            })?;
            writers.push(Box::new(series));
        }
        Ok(Self { world: world.clone(), moments: Moments::default(), writers, failed: None })
    }

    /// Writes the world as it is now; whether all files took it.
    pub fn take(&mut self) -> bool {
        if !self.writers.is_empty() && self.failed.is_none() {
            let moment = self.moments.take(&self.world);
            self.failed = self.writers.iter_mut().try_for_each(|writer| writer.write(&moment)).err();
        }
        self.failed.is_none()
    }

    /// Completes the files.
    ///
    /// # Errors
    /// The first that could not be written.
    pub fn finish(mut self) -> Result<(), ExportError> {
        let completed = self.writers.iter_mut().try_for_each(|writer| writer.finish());
        self.failed.map_or(completed, Err)
    }
}
