//! `replay`: repeats a recorded run and reports on it.
//!
//! In: arguments. Out: the outputs of `run`, of the run that was recorded, or where the two differ.
//! Never here: how a recording is repeated ([`metachron_world::World::replay`]).

use super::args::ReplayArgs;
use super::play::{GoOn, headless};
use super::run::{Request, RunLength, check_outputs, check_read, finish};
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, message};
use metachron_core::{SimSpan, SimTime};
use metachron_scene::{Source, load};
use metachron_session::Session;
use metachron_world::{RecordError, Recording};
use std::path::Path;

/// Repeats a recording.
pub(super) fn command(args: &ReplayArgs) -> anyhow::Result<Exit> {
    check_outputs(&args.output, Some(("the recording", args.recording.as_path())), None)?;
    let recording = Recording::read(&args.recording).map_err(bad_file)?;
    let path = args.recording.display();
    let scene = recording.scene().ok_or_else(|| {
        let why = "it was recorded by a program that has built its scene, which only that program can start";
        BadInput(format!("{path}: {why} (World::replay)"))
    })?;
    let source = Source::recorded(&scene.name, &scene.text, scene.folder.as_deref().map(Path::new))?;
    let source = source.within(args.limits.limits());
    let overrides = scene.overrides.clone();
    if !recording.is_complete() {
        let what = if recording.is_damaged() { "is damaged" } else { "was cut short" };
        let left_out = match recording.lost_bytes() {
            0 => String::new(),
            lost => format!("; {lost} bytes are left out"),
        };
        message(&format!("warning: {path} {what}: it is repeated to its last whole chunk{left_out}"));
    }
    let scene = load(&source, &overrides)?;
    check_read(&args.output, None, &source)?;
    // the recording says how time passed
    let request =
        Request { end: Some(RunLength::Recording), ..Request::of(scene, source, overrides, &args.output, args.size) };
    let until = args.until.and_then(SimSpan::from_secs_f64).map(|span| SimTime::ZERO + span);
    let play = |go_on: GoOn<'_>| {
        let session = Session::replay(request.scene.clone(), recording.clone(), until)?;
        headless(session, &request, request.png.clone(), go_on)
    };
    finish(&args.output, &play, &request.scene.name)
}

/// A file that is no recording is bad input; one that cannot be read is a failure.
fn bad_file(error: RecordError) -> anyhow::Error {
    match error {
        RecordError::BadFile { .. } => BadInput(error.to_string()).into(),
        other => other.into(),
    }
}
