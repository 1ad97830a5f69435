//! `run`: plays a scene and reports the result.
//!
//! In: arguments. Out: a picture, a report, rows of frames, verdicts on goals.
//! Never here: the loop itself.

use super::args::{OutputArgs, PaceWord, RunArgs, StyleWord};
use super::devices::{self, DeviceWish};
use super::exports::ExportPaths;
use super::play::{GoOn, play};
use anyhow::Context;
use clap::ArgMatches;
use clap::parser::ValueSource;
use metachron_console::exit::Exit;
use metachron_console::files::{check_place, check_unread, write_file};
use metachron_console::output::{BadInput, data, message, print_overlaps, warn_priority};
use metachron_console::progress::Bar;
use metachron_export::VtkSeries;
use metachron_render::{Colouring, Style};
use metachron_scene::{Source, load};
use metachron_session::FrameRecord;
use metachron_session::report::{Report, Verdict};
use metachron_world::{Pace, PlacedHost, Scene, is_same_file};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Length of a headless run without a given end, seconds.
const HEADLESS_S: f64 = 10.0;

/// The request for a run.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scene, with the changes by flags, overrides and environment.
    pub scene: Scene,
    /// The source of the scene, so that it can be read again.
    pub source: Source,
    /// Whether only requested output is written.
    pub quiet: bool,
    /// The overrides applied to it, in rising precedence.
    pub overrides: Vec<(String, String)>,
    /// How time passes.
    pub pace: Pace,
    /// Whether a window is requested; where none can be opened the run goes headless.
    pub window: bool,
    /// Whether it looks as at first, and not as it was left.
    #[cfg(feature = "viewer")]
    pub reset_window: bool,
    /// When the run ends by itself; `None`: a window stays open, a headless run takes 10 s.
    pub end: Option<RunLength>,
    /// Width and height of the picture in pixels, or of the window in points, each 1 … 8192; `None`: 1280 × 720, or the
    /// window as it was closed last time.
    pub size: Option<[u32; 2]>,
    /// Style of pictures without a window.
    pub style: Style,
    /// Whether to play the scene again under one very fine common clock; only without a window.
    pub oracle: bool,
    /// Where to write the last picture as PNG; only without a window.
    pub png: Option<PathBuf>,
    /// Where to write the depths of the last frame (PNG, 16 bits); only without a window.
    pub depth: Option<PathBuf>,
    /// The name of the camera; `None`: the scene's first.
    pub camera: Option<String>,
    /// Where to write the film of all frames (YUV4MPEG2); only without a window.
    pub video: Option<PathBuf>,
    /// Where to write its moments for other programs.
    pub exports: ExportPaths,
    /// The devices that lead objects.
    pub devices: Vec<DeviceWish>,
    /// Where to write down the commands to the run.
    pub record: Option<PathBuf>,
    /// The hosts that step it together; none for this process.
    pub hosts: Vec<PlacedHost>,
    /// Where to write it when the requested window could not be opened.
    pub png_without_window: PathBuf,
}

/// When a run ends by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunLength {
    /// After so many frames, at least 1.
    Frames(u64),
    /// After so many simulated seconds, above 0.
    Seconds(f64),
    /// With the recording that is repeated.
    Recording,
}

/// The result of a run.
#[derive(Debug, Clone)]
pub struct Played {
    /// Its report.
    pub report: Report,
    /// Its frames.
    pub frames: Vec<FrameRecord>,
    /// Why a requested window could not be opened.
    pub no_window: Option<String>,
    /// Why the run ended early: the open window was lost, or a file could not be written. The frames until then count.
    pub failure: Option<String>,
    /// The file of the picture.
    pub picture: Option<PathBuf>,
    /// Whether levels were chosen by default prices of drawing, because there was no time to measure the adapter's.
    pub unpriced: bool,
    /// Whether a reference run was asked for.
    pub oracle: bool,
    /// Whether it was interrupted.
    pub interrupted: bool,
}

/// The progress of a headless run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Share done, 0 … 1; `None` where the run has no end.
    pub done: Option<f64>,
    /// Simulated seconds.
    pub sim_s: f64,
    /// Work of the last frame, milliseconds.
    pub frame_ms: f64,
}

impl Request {
    /// Whether a file is wanted that only an adapter makes; `png`: a picture is.
    pub const fn draws(&self, png: bool) -> bool {
        png || self.depth.is_some() || self.video.is_some()
    }

    /// When a headless run ends.
    #[must_use]
    pub fn headless_end(&self) -> RunLength {
        self.end.unwrap_or(RunLength::Seconds(HEADLESS_S))
    }
}

/// Runs a scene, on the hosts that `place` gives it to, if any.
pub(super) fn command(
    args: &RunArgs,
    matches: Option<&ArgMatches>,
    place: impl FnOnce(&mut Request) -> anyhow::Result<()>,
) -> anyhow::Result<Exit> {
    check_inputs(args)?;
    let mut request = request(args, matches)?;
    place(&mut request)?;
    if !args.output.quiet {
        print_overlaps(&request.scene);
        warn_priority(&request.scene);
    }
    finish(&args.output, &|go_on| play(&request, go_on), &request.scene.name)
}

/// Plays with a bar that shows how far it is, writes the outputs that were asked for, and judges.
pub(super) fn finish(
    output: &OutputArgs,
    play: &dyn Fn(GoOn<'_>) -> anyhow::Result<Played>,
    name: &str,
) -> anyhow::Result<Exit> {
    let bar = Bar::new(name, output.quiet);
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stopped);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("Ctrl-C cannot be caught")?;
    let played = play(&mut |step| {
        if let Some(done) = step.done {
            bar.show(done, step.sim_s, step.frame_ms);
        }
        !stopped.load(Ordering::Relaxed)
    })?;
    drop(bar);
    write_all(output, &played)?;
    match &played.failure {
        Some(why) => Err(anyhow::anyhow!("{why}")),
        None => judge(output, &played),
    }
}

/// The request given by the arguments. Precedence: flags, `--set`, environment, scene, defaults.
fn request(args: &RunArgs, matches: Option<&ArgMatches>) -> anyhow::Result<Request> {
    let flags = [
        ("target_fps", "target.frame_hz", args.target_fps.map(|f| f.to_string())),
        ("policy", "target.policy", args.policy.as_deref().map(quoted)),
        ("law", "target.law", args.law.as_deref().map(quoted)),
        ("executor", "executor", args.executor.as_deref().map(quoted)),
        ("seed", "machine.seed", args.seed.map(|n| n.to_string())),
    ];
    let from_environment =
        |id: &str| matches.and_then(|m| m.value_source(id)).is_some_and(|s| s == ValueSource::EnvVariable);
    let given = |environment: bool| {
        let of_this_kind = flags.iter().filter(move |(id, ..)| from_environment(id) == environment);
        of_this_kind.filter_map(|(_, key, value)| Some(((*key).to_owned(), value.clone()?)))
    };
    let gains = args.gains.as_deref().map(metachron_console::gains::overrides).transpose()?.unwrap_or_default();
    let overrides: Vec<_> = given(true).chain(gains).chain(args.set.iter().cloned()).chain(given(false)).collect();
    let source = Source::open(&args.scene)?.within(args.limits.limits());
    let scene = load(&source, &overrides)?;
    check_read(&args.output, args.record.as_deref(), &source)?;
    let end = args.frames.map(RunLength::Frames).or(args.seconds.map(RunLength::Seconds));
    Ok(Request {
        pace: match args.pace {
            PaceWord::RealTime => Pace::RealTime,
            PaceWord::Free => Pace::Free,
        },
        window: !args.headless,
        #[cfg(feature = "viewer")]
        reset_window: args.reset_window,
        end,
        oracle: args.oracle,
        devices: args.device.clone(),
        record: args.record.clone(),
        ..Request::of(scene, source, overrides, &args.output, args.size)
    })
}

impl Request {
    /// The request for outputs of a scene that was read: without a window, an end of its own, devices and a recording.
    pub(super) fn of(
        scene: Scene,
        source: Source,
        overrides: Vec<(String, String)>,
        output: &OutputArgs,
        size: Option<[u32; 2]>,
    ) -> Self {
        Self {
            png_without_window: format!("metachron-{}.png", stem(&scene.name)).into(),
            scene,
            source,
            quiet: output.quiet,
            overrides,
            pace: Pace::RealTime,
            window: false,
            #[cfg(feature = "viewer")]
            reset_window: false,
            end: None,
            size,
            style: style(&output.style),
            oracle: false,
            png: output.png.clone(),
            depth: output.depth.clone(),
            camera: output.camera.clone(),
            video: output.video.clone(),
            exports: output.exports(),
            devices: Vec::new(),
            record: None,
            hosts: Vec::new(),
        }
    }
}

/// The style given by words; of two colourings the last counts.
fn style(words: &[StyleWord]) -> Style {
    words.iter().fold(Style::default(), |style, word| match word {
        StyleWord::Wireframe => Style { wireframe: true, ..style },
        StyleWord::Forces => Style { forces: true, ..style },
        StyleWord::Resolution => Style { colouring: Colouring::Resolution, ..style },
        StyleWord::Age => Style { colouring: Colouring::Age, ..style },
        StyleWord::Depth => Style { colouring: Colouring::Depth, ..style },
        StyleWord::Detail => Style { colouring: Colouring::Detail, ..style },
    })
}

fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

/// The scene's name as part of a file name.
pub(super) fn stem(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| "scene".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Refuses runs that are impossible as asked, and outputs that cannot be written: before the run rather than after.
fn check_inputs(args: &RunArgs) -> anyhow::Result<()> {
    if args.oracle && !args.headless {
        let why = "--oracle runs the scene twice without a window; add --headless";
        return Err(BadInput(why.to_owned()).into());
    }
    if args.pace == PaceWord::Free && !args.headless {
        let why = "--pace free lets time wait for agents, which a window does not; add --headless";
        return Err(BadInput(why.to_owned()).into());
    }
    if args.pace == PaceWord::Free && !args.device.is_empty() {
        let why = "--pace free lets time wait for agents, and a hand at a device does not; leave one of the two out";
        return Err(BadInput(why.to_owned()).into());
    }
    check_windowless(&args.output, args.headless)?;
    devices::check(&args.device)?;
    check_outputs(&args.output, args.gains.as_deref().map(|gains| ("--gains", gains)), args.record.as_deref())
}

/// Refuses files that only a run without a window writes.
pub(super) fn check_windowless(output: &OutputArgs, headless: bool) -> anyhow::Result<()> {
    let files = [
        ("--png", &output.png),
        ("--depth", &output.depth),
        ("--video", &output.video),
        ("--mcap", &output.mcap),
        ("--vtk", &output.vtk),
        ("--glb", &output.glb),
        ("--animation", &output.animation),
        ("--perfetto", &output.perfetto),
    ];
    if let Some((flag, _)) = files.iter().find(|(_, path)| path.is_some() && !headless) {
        return Err(BadInput(format!("{flag} needs a run without a window; add --headless")).into());
    }
    Ok(())
}

/// The files that a run writes, by their flags.
fn files(args: &OutputArgs, record: Option<&Path>) -> Vec<(&'static str, PathBuf)> {
    let single = [
        ("--report", args.report.as_deref().filter(|path| *path != Path::new("-"))),
        ("--png", args.png.as_deref()),
        ("--depth", args.depth.as_deref()),
        ("--video", args.video.as_deref()),
        ("--mcap", args.mcap.as_deref()),
        ("--glb", args.glb.as_deref()),
        ("--animation", args.animation.as_deref()),
        ("--perfetto", args.perfetto.as_deref()),
        ("--frames-csv", args.frames_csv.as_deref()),
        ("--record", record),
    ];
    let series = args.vtk.iter().flat_map(|folder| VtkSeries::FILES.map(|name| ("--vtk", folder.join(name))));
    single.into_iter().filter_map(|(flag, path)| Some((flag, path?.to_owned()))).chain(series).collect()
}

/// Refuses an output that would overwrite a file that the scene was read from.
pub(super) fn check_read(args: &OutputArgs, record: Option<&Path>, source: &Source) -> anyhow::Result<()> {
    let read = source.files();
    let unread =
        |(flag, path): &(&str, PathBuf)| check_unread(flag, path, "the scene", read.iter().map(|file| &*file.path));
    files(args, record).iter().try_for_each(unread)
}

/// Refuses two outputs on standard output, files in missing folders, and an output that would overwrite another one or `input`.
pub(super) fn check_outputs(
    args: &OutputArgs,
    input: Option<(&str, &Path)>,
    record: Option<&Path>,
) -> anyhow::Result<()> {
    if args.json && args.report.as_deref() == Some(Path::new("-")) {
        return Err(BadInput("--json and --report - both print the report; choose one".to_owned()).into());
    }
    if args.vtk.as_deref() == Some(Path::new("-")) {
        return Err(BadInput("--vtk - would be a folder called -; name another".to_owned()).into());
    }
    args.vtk.as_deref().map_or(Ok(()), check_series)?;
    let files = files(args, record);
    if let Some((flag, _)) = files.iter().find(|(_, path)| path == Path::new("-")) {
        let why = "would write to standard output, which only the report may use; name a file";
        return Err(BadInput(format!("{flag} - {why}")).into());
    }
    files.iter().filter(|(flag, _)| *flag != "--vtk").try_for_each(|(_, path)| check_place(path))?;
    let outputs = files.iter().map(|(flag, path)| (*flag, path.as_path()));
    check_distinct(&input.into_iter().chain(outputs).collect::<Vec<_>>())?;
    check_extension(args)
}

/// Refuses a folder for a series that holds files of its names, or cannot be one.
fn check_series(folder: &Path) -> anyhow::Result<()> {
    let there = folder.ancestors().find(|path| path.exists());
    if let Some(file) = there.filter(|path| !path.is_dir()) {
        return Err(BadInput(format!("{} is a file; --vtk expects a folder", file.display())).into());
    }
    VtkSeries::check(folder).map_err(|error| BadInput(error.to_string()).into())
}

/// Refuses a picture, film or mesh whose file has the ending of something else.
fn check_extension(args: &OutputArgs) -> anyhow::Result<()> {
    let outputs = [
        ("--png", &args.png, "PNG picture", "png"),
        ("--depth", &args.depth, "PNG picture", "png"),
        ("--video", &args.video, "YUV4MPEG2 film", "y4m"),
        ("--glb", &args.glb, "binary glTF", "glb"),
        ("--animation", &args.animation, "binary glTF", "glb"),
    ];
    for (flag, path, what, ending) in outputs {
        let other = |path: &&PathBuf| path.extension().is_some_and(|found| !found.eq_ignore_ascii_case(ending));
        if let Some(path) = path.as_ref().filter(other) {
            let found = path.extension().unwrap_or_default().display();
            let why = format!("{flag} {} would be a {what} in a .{found} file", path.display());
            return Err(BadInput(format!("{why}; name one that ends in .{ending}")).into());
        }
    }
    Ok(())
}

/// Refuses an output that would overwrite another one, or an input, by a link too.
fn check_distinct(files: &[(&str, &Path)]) -> anyhow::Result<()> {
    for (k, (what, path)) in files.iter().enumerate() {
        if let Some((other, _)) = files[..k].iter().find(|(_, other)| is_same_file(path, other)) {
            let why =
                format!("{what} {} would overwrite {other}, which is the same file; name another", path.display());
            return Err(BadInput(why).into());
        }
    }
    Ok(())
}

fn write_all(args: &OutputArgs, played: &Played) -> anyhow::Result<()> {
    let report = serde_json::to_string_pretty(&played.report)? + "\n";
    // a demo without a display still leaves a report
    let fallback = played.no_window.as_ref().map(|_| format!("metachron-{}.json", stem(&played.report.scene)).into());
    match args.report.as_ref().or(fallback.as_ref()) {
        Some(path) if path == Path::new("-") => data(&report)?,
        Some(path) => {
            write_file(path, &report)?;
            if !args.quiet {
                message(&format!("report: {}", path.display()));
            }
        }
        None => {}
    }
    if let Some(path) = &args.frames_csv {
        write_frames(path, &played.frames)?;
    }
    if !args.quiet {
        print_notes(played);
    }
    if args.json {
        data(&report)?;
    } else if !args.quiet && args.report.as_deref() != Some(Path::new("-")) {
        data(&played.report.summary_text())?;
    }
    Ok(())
}

/// Prints notes in addition to the report.
fn print_notes(played: &Played) {
    if let Some(why) = &played.no_window {
        message(&format!("ran without a window: {why}"));
    }
    played.report.notes.iter().for_each(|note| message(&format!("note: {note}")));
    if played.unpriced {
        message("note: the cost of drawing could not be measured within three seconds: default prices were used");
    }
    if played.oracle && played.interrupted {
        message(&match &played.report.oracle {
            Some(oracle) => {
                format!("interrupted: only the first {:.2} s, which both runs completed, are compared", oracle.sim_s)
            }
            None => "interrupted: the reference run did not start, so nothing is compared".to_owned(),
        });
    }
    if let Some(path) = &played.picture {
        message(&format!("picture: {}", path.display()));
    }
}

fn write_frames(path: &Path, frames: &[FrameRecord]) -> anyhow::Result<()> {
    let mut rows = csv::Writer::from_writer(Vec::new());
    frames.iter().try_for_each(|frame| rows.serialize(frame))?;
    write_file(path, rows.into_inner()?)
}

fn judge(args: &OutputArgs, played: &Played) -> anyhow::Result<Exit> {
    let mut missed = false;
    for goal in &args.fail_on {
        match goal.judge(&played.report).map_err(|e| BadInput(e.to_string()))? {
            Verdict::Kept => {}
            Verdict::Missed(value) => {
                message(&format!("goal missed: {goal} holds, the value is {value}"));
                missed = true;
            }
            Verdict::NotMeasured => {
                message(&format!("goal missed: {goal} cannot be evaluated, the value was not measured in this run"));
                missed = true;
            }
        }
    }
    Ok(match (played.interrupted, missed) {
        (true, _) => Exit::Interrupted,
        (false, true) => Exit::GoalMissed,
        (false, false) => Exit::Ok,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::{Cli, Command};
    use clap::{CommandFactory, FromArgMatches};

    fn requested(arguments: &[&str]) -> Request {
        crate::scenes::provide();
        let all = ["metachron", "run"].iter().chain(arguments);
        let matches = Cli::command().get_matches_from(all);
        let Command::Run(args) = Cli::from_arg_matches(&matches).unwrap().command else { panic!("run was asked for") };
        request(&args, matches.subcommand_matches("run")).unwrap()
    }

    #[test]
    fn flags_override_set_and_set_overrides_the_scene() {
        let hz = |arguments: &[&str]| requested(arguments).scene.target.frame_hz;
        assert_eq!(hz(&["tube"]), 30.0);
        assert_eq!(hz(&["tube", "--set", "target.frame_hz=45"]), 45.0);
        assert_eq!(hz(&["tube", "--target-fps", "50", "--set", "target.frame_hz=45"]), 50.0);
    }

    #[test]
    fn a_run_request_has_the_values_of_its_flags() {
        let request = requested(&[
            "pendulum",
            "--headless",
            "--frames",
            "7",
            "--size",
            "64x32",
            "--executor",
            "lockstep",
            "--seed",
            "9",
        ]);
        assert_eq!(request.scene.executor.name(), "lockstep");
        assert_eq!(request.scene.machine.seed, Some(9));
        assert_eq!(
            (request.headless_end(), request.size, request.window),
            (RunLength::Frames(7), Some([64, 32]), false)
        );
        assert_eq!(requested(&[]).headless_end(), RunLength::Seconds(10.0));
    }
}
