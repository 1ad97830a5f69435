//! Runs as files that other programs open: MCAP (Foxglove, Lichtblick, Rerun) and VTK series (ParaView).
//!
//! In: [`Moment`]s of a world, which hold every object's newest state and its surface. Out: files.
//! Never here: running a world, choosing the moments, drawing.

mod error;
mod foxglove;
mod moment;
mod surface;
mod vtk;

pub use error::ExportError;
pub use foxglove::McapFile;
pub use moment::{Moment, Moments, ObjectMoment};
pub use surface::Surface;
pub use vtk::VtkSeries;

/// The page of the crate: its code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;

/// What takes the moments of a run, in rising order of time.
pub trait MomentWriter {
    /// Takes one moment.
    ///
    /// # Errors
    /// [`ExportError`] where a file cannot be written.
    fn write(&mut self, moment: &Moment) -> Result<(), ExportError>;

    /// Completes the files. Without it they hold what was written up to about a second before.
    ///
    /// # Errors
    /// [`ExportError`] where a file cannot be written.
    fn finish(&mut self) -> Result<(), ExportError>;
}
