//! Runs as files that other programs open: MCAP (Foxglove, Lichtblick, Rerun), VTK series (ParaView), binary glTF of one
//! moment or animated, a trace of turns (Perfetto).
//!
//! In: [`Moment`]s of a world, which hold every object's newest state and its surface, contacts, joints and events; its turns. Out: files.
//! Never here: running a world, choosing the moments, drawing.

mod colour;
mod error;
mod foxglove;
mod glb;
mod moment;
mod perfetto;
mod surface;
mod vtk;

pub use error::ExportError;
pub use foxglove::McapFile;
pub use glb::{GlbAnimation, glb, write_glb};
pub use moment::{ContactMoment, JointMoment, Moment, Moments, ObjectMoment};
pub use perfetto::{Frame, PerfettoFile};
pub use surface::Surface;
pub use vtk::VtkSeries;

/// The page of the crate: its code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;

/// A writer that takes the moments of a run, in rising order of time.
pub trait MomentWriter {
    /// Takes one moment.
    ///
    /// # Errors
    /// [`ExportError`] where a file cannot be written.
    fn write(&mut self, moment: &Moment) -> Result<(), ExportError>;

    /// Completes the files. Without it they hold the moments up to about a second before.
    ///
    /// # Errors
    /// [`ExportError`] where a file cannot be written.
    fn finish(&mut self) -> Result<(), ExportError>;
}
