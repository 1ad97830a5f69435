//! `bench`: how much load one machine carries, as CSV, JSON, SVG and PNG in a folder and a table on standard output.
//!
//! In: what to measure, which folder. Out: files, a table. Never here: what is measured (each subject is a file).

pub(super) mod agents;
pub(super) mod contact;
mod pile;
mod render;
pub(super) mod rig;
mod rod;
mod scenes;
mod select;
mod shown;
mod soft;
mod subject;

use super::args::{BenchArgs, BenchSubject};
use metachron_console::exit::Exit;

/// Runs a benchmark.
///
/// # Errors
/// Bad input, a file that cannot be written, an adapter that failed.
pub fn command(args: &BenchArgs) -> anyhow::Result<Exit> {
    match args.subject {
        BenchSubject::Agents => subject::run::<shown::Agents>(args),
        BenchSubject::Rod => subject::run::<rod::Rod>(args),
        BenchSubject::Scenes => subject::run::<scenes::Scenes>(args),
        BenchSubject::Select => subject::run::<select::Select>(args),
        BenchSubject::Pile => subject::run::<pile::Pile>(args),
        BenchSubject::Contact => subject::run::<contact::Contact>(args),
        BenchSubject::Soft => subject::run::<soft::Soft>(args),
        BenchSubject::Render => subject::run::<render::Render>(args),
    }
}
