//! Output streams: data to standard output, messages to standard error.

use super::exit::Exit;
use anyhow::Context;
use metachron_runtime::ask_priority;
use metachron_scene::SceneError;
use metachron_world::kinds::{ExecutorKind, PriorityKind};
use metachron_world::{Moved, Overlap, Scene};
use std::io::{ErrorKind, Write};

/// Writes data to standard output. A reader that has closed the pipe (`| head`) is no error.
pub fn data(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}

/// Writes a message for people to standard error; a failure to write it is ignored.
pub fn message(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// More overlaps than this are counted, not listed.
const OVERLAPS_LISTED: usize = 10;

/// Reports agents that start inside each other or inside fixed solids, which is no error: deformables are moved to start elsewhere,
/// other agents separate without a jump.
pub fn print_overlaps(scene: &Scene) {
    let overlaps = &scene.overlaps;
    for overlap in overlaps.iter().take(OVERLAPS_LISTED) {
        let Overlap { a, b, depth_m } = overlap;
        message(&format!("note: `{a}` and `{b}` overlap by {:.3} mm at the start", depth_m * 1e3));
    }
    if overlaps.len() > OVERLAPS_LISTED {
        message(&format!("note: {} more pairs overlap at the start", overlaps.len() - OVERLAPS_LISTED));
    }
    for Moved { object, by_m } in scene.moved.iter().take(OVERLAPS_LISTED) {
        let [x, y, z] = (*by_m * 1e3).to_array();
        message(&format!(
            "note: `{object}` starts ({x:.3}, {y:.3}, {z:.3}) mm from its place in the scene, where it overlaps nothing"
        ));
    }
    if scene.moved.len() > OVERLAPS_LISTED {
        message(&format!(
            "note: {} more objects are moved out of overlaps at the start",
            scene.moved.len() - OVERLAPS_LISTED
        ));
    }
}

/// Reports that the system refuses the priority that a scene requests; the run goes on without it.
pub fn warn_priority(scene: &Scene) {
    let asked = scene.priority == PriorityKind::Realtime && scene.executor != ExecutorKind::Lockstep;
    if asked && let Err(refused) = ask_priority(PriorityKind::Realtime) {
        message(&format!("note: {refused}"));
    }
}

/// Reports an error; returns how the program ends.
pub fn report_error(error: &anyhow::Error) -> Exit {
    if let Some(bad) = error.downcast_ref::<SceneError>() {
        message(&rendered(bad));
        return Exit::BadInput;
    }
    message(&format!("error: {error:#}"));
    if error.is::<BadInput>() { Exit::BadInput } else { Exit::Failed }
}

/// The problems of a scene, with the lines underlined; colours and width follow the terminal.
pub fn rendered(error: &SceneError) -> String {
    let handler = miette::MietteHandlerOpts::new().build();
    format!("{:?}", Rendered { error, handler: &handler })
}

struct Rendered<'a> {
    error: &'a SceneError,
    handler: &'a miette::MietteHandler,
}

impl std::fmt::Debug for Rendered<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        miette::ReportHandler::debug(self.handler, self.error, f)
    }
}

/// An input that cannot be used, found after the arguments were read.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadInput(pub String);
