//! Files of a run for other programs: one moment a frame, the last moment, a trace.
//!
//! In: paths, a world that is played, its frames. Out: an MCAP file, VTK series, binary glTF, a Perfetto trace. Never
//! here: their contents ([`metachron_export`]).

use metachron_console::output::message;
use metachron_export::{
    ExportError, Frame, GlbAnimation, McapFile, MomentWriter, Moments, PerfettoFile, Surface, VtkSeries, write_glb,
};
use metachron_session::FrameRecord;
use metachron_world::{Scene, World};
use std::path::PathBuf;
use std::time::Duration;

/// Where files of a run are written.
#[derive(Debug, Clone, Default)]
pub struct ExportPaths {
    /// A file in MCAP.
    pub mcap: Option<PathBuf>,
    /// A folder for a VTK series.
    pub vtk: Option<PathBuf>,
    /// A file for the last moment, in binary glTF.
    pub glb: Option<PathBuf>,
    /// A file for all moments, in animated binary glTF.
    pub animation: Option<PathBuf>,
    /// A file for a trace of turns, frames and events.
    pub perfetto: Option<PathBuf>,
}

/// The files of a run that is played.
pub(super) struct Exports {
    world: World,
    fixed: Surface,
    target_ms: f64,
    moments: Moments,
    writers: Vec<Box<dyn MomentWriter>>,
    perfetto: Option<PerfettoFile>,
    glb: Option<PathBuf>,
    failed: Option<ExportError>,
}

impl Exports {
    /// Begins the files.
    ///
    /// # Errors
    /// Where one cannot be written.
    pub fn create(paths: &ExportPaths, scene: &Scene, world: &World) -> Result<Self, ExportError> {
        let fixed = Surface::fixed(scene);
        let mut writers: Vec<Box<dyn MomentWriter>> = Vec::new();
        if let Some(path) = &paths.mcap {
            writers.push(Box::new(McapFile::create(path, &fixed)?));
        }
        if let Some(path) = &paths.vtk {
            writers.push(Box::new(VtkSeries::create(path, scene)?));
        }
        if let Some(path) = &paths.animation {
            writers.push(Box::new(GlbAnimation::create(path, &fixed)?));
        }
        let perfetto = paths.perfetto.as_deref().map(|path| PerfettoFile::create(path, world)).transpose()?;
        Ok(Self {
            world: world.clone(),
            fixed,
            target_ms: 1e3 / scene.target.frame_hz,
            moments: Moments::of(world),
            writers,
            perfetto,
            glb: paths.glb.clone(),
            failed: None,
        })
    }

    /// Writes the world as it is now, after this frame; whether all files took it.
    pub fn take(&mut self, frame: &FrameRecord) -> bool {
        if self.failed.is_none() {
            self.failed = self.write(frame).err();
        }
        self.failed.is_none()
    }

    fn write(&mut self, frame: &FrameRecord) -> Result<(), ExportError> {
        if !self.writers.is_empty() {
            let moment = self.moments.take();
            self.writers.iter_mut().try_for_each(|writer| writer.write(&moment))?;
        }
        let Some(perfetto) = &mut self.perfetto else { return Ok(()) };
        perfetto.write(Some(&traced(frame, self.target_ms, self.world.now())))
    }

    /// Completes the files, and writes the last moment.
    ///
    /// # Errors
    /// The first that could not be written.
    pub fn finish(mut self) -> Result<(), ExportError> {
        let mut completed = self.writers.iter_mut().try_for_each(|writer| writer.finish());
        if let Some(perfetto) = &mut self.perfetto {
            completed = completed.and(perfetto.finish());
            if perfetto.is_full() {
                message(&format!("note: the trace ends early: it has {} MiB", PerfettoFile::BYTES_MAX >> 20));
            }
            if perfetto.lost() > 0 {
                message(&format!(
                    "note: the trace lacks {} turns and events, of frames that were too long",
                    perfetto.lost()
                ));
            }
        }
        if let Some(path) = &self.glb {
            completed = completed.and(write_glb(path, &self.moments.take(), &self.fixed));
        }
        self.failed.map_or(completed, Err)
    }
}

/// A frame that has ended at the wall time `now`, as a trace shows it.
fn traced(frame: &FrameRecord, target_ms: f64, now: Duration) -> Frame {
    let span = |ms: f64| Duration::try_from_secs_f64(ms * 1e-3).unwrap_or_default();
    let work = span(frame.frame_ms);
    Frame {
        begun: now.saturating_sub(work),
        work,
        parts: vec![("cull", span(frame.cull_ms)), ("select", span(frame.select_ms)), ("draw", span(frame.draw_ms))],
        counters: vec![
            ("budget spent", frame.frame_ms / target_ms),
            ("triangles", frame.triangles as f64),
            ("eps", frame.eps),
            ("n", frame.n),
        ],
    }
}
