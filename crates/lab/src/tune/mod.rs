//! `tune`: finds feedback gains for a scene, explains them and writes them to a file.
//!
//! In: a scene, a machine (declared, or the one present with `--live`). Out: a table, a fragment of TOML that `run --gains` and a scene
//! take, a figure. Never here: how gains are judged ([`metachron_lod::tune`] does), the experiment's frames ([`metachron_session`] draws them).

mod agents;
mod checked;
mod figures;
mod report;
mod trials;

use super::args::TuneArgs;
use super::chart::stopper;
use anyhow::Context;
use metachron_console::exit::Exit;
use metachron_console::files::{check_output_path, check_unread, write_file};
use metachron_console::gains;
use metachron_console::output::{BadInput, data, message};
use metachron_console::progress::Bar;
use metachron_lod::tune::{
    Candidate, Extent, Family, Origin, Plant, Search, Tuning, Verdict, explain, judge, refusal, search, tune,
};
use metachron_render::{Gpu, Offscreen, RendererOptions, Size};
use metachron_scene::{Source, load};
use metachron_session::{Drawing, Experiment, Session, experiment};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Pace, Scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use trials::Trials;

/// Frames of the experiment, in full and with `--quick`.
const FRAMES: [u64; 2] = [360, 150];

/// A plant, and the scene and machine on which it was identified.
struct Identified {
    scene: Scene,
    plant: Plant,
    /// Size of its pictures, and whether they were drawn.
    size: Size,
    live: bool,
    target_hz: f64,
    machine: String,
}

/// Tunes a scene, or explains given gains.
///
/// # Errors
/// Bad input, a file that cannot be written, an adapter that failed.
pub fn command(args: &TuneArgs) -> anyhow::Result<Exit> {
    let source = Source::open(&args.scene)?.within(args.common.limits.limits());
    let scene = scene(args, &source)?;
    let given = args.analyse.as_deref().map(|text| gains::parse(text, scene.target.frame_hz)).transpose()?;
    let fragment =
        args.gains.clone().unwrap_or_else(|| PathBuf::from(format!("{}.gains.toml", file_stem(&args.scene))));
    if given.is_none() {
        check_output_path(&fragment, "--gains", args.force)?;
        let read = source.files();
        check_unread("--gains", &fragment, "the scene", read.iter().map(|file| &*file.path))?;
    }
    let stopped = stopper()?;
    let Some(identified) = identify(args, scene, &stopped)? else { return Ok(Exit::Interrupted) };
    match given {
        Some(candidate) => analyse(args, &identified, candidate),
        None => find(args, &identified, &fragment, &stopped),
    }
}

/// The scene's name as a part of a file's name.
fn file_stem(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| "scene".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Draws the experiment and fits the plant; `None` where it was stopped.
fn identify(args: &TuneArgs, scene: Scene, stopped: &AtomicBool) -> anyhow::Result<Option<Identified>> {
    let target_hz = scene.target.frame_hz;
    let [width, height] = args.size.unwrap_or([1280, 720]);
    let size = Size { width, height };
    let session = Session::open(scene.clone(), Pace::RealTime)?;
    let drawing = if args.live { live(size)? } else { Drawing::Nothing };
    let plan = Experiment { frames: FRAMES[usize::from(args.quick)], size, drawing };
    let bar = Bar::new("experiment", args.common.quiet || args.common.json);
    let done = experiment(session, plan, &mut |share| {
        bar.set(share, "drawing frames at many resolutions".to_owned());
        !stopped.load(Ordering::Relaxed)
    })?;
    drop(bar);
    if done.interrupted {
        message("interrupted before the identification experiment ended: nothing was written");
        return Ok(None);
    }
    let plant = Plant::identify(&done.observed).map_err(|why| BadInput(format!("{}: {why}", scene.name)))?;
    let machine = done.adapter.unwrap_or_else(|| format!("the declared machine `{}`", scene.machine.preset));
    Ok(Some(Identified { scene, plant, size, live: args.live, target_hz, machine }))
}

/// The scene with the changes by the arguments; in virtual time except with `--live`.
fn scene(args: &TuneArgs, source: &Source) -> anyhow::Result<Scene> {
    let executor = if args.live { ExecutorKind::Threads } else { ExecutorKind::Lockstep };
    let flags = [
        ("executor", Some(format!("\"{}\"", executor.name()))),
        ("target.frame_hz", args.target_fps.map(|f| f.to_string())),
        ("machine.seed", args.seed.map(|n| n.to_string())),
    ];
    let flags = flags.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
    let overrides: Vec<_> = args.common.set.iter().cloned().chain(flags).collect();
    Ok(load(source, &overrides)?)
}

fn live(size: Size) -> anyhow::Result<Drawing> {
    let gpu = Gpu::headless()?;
    let options = RendererOptions::for_adapter(&gpu.info);
    Ok(Drawing::Every(Box::new(Offscreen::new(gpu, size, options)?)))
}

fn extent(args: &TuneArgs) -> Extent {
    if args.quick { Extent::QUICK } else { Extent::FULL }
}

/// Explains given gains.
fn analyse(args: &TuneArgs, on: &Identified, candidate: Candidate) -> anyhow::Result<Exit> {
    let explanation = explain(&on.plant, candidate, on.target_hz);
    let verdict = judge(&on.plant, candidate, on.target_hz, extent(args));
    data(&if args.common.json {
        report::analysis_json(on, &explanation, &verdict)?
    } else {
        report::analysis(on, &explanation, &verdict)
    })?;
    Ok(Exit::Ok)
}

/// Finds gains, reports them and writes them to files.
fn find(args: &TuneArgs, on: &Identified, fragment: &Path, stopped: &AtomicBool) -> anyhow::Result<Exit> {
    refuse_out_of_reach(on)?;
    let folder = &args.out;
    std::fs::create_dir_all(folder)
        .map_err(|why| BadInput(format!("the folder {} cannot be written: {why}", folder.display())))?;
    let mut trials = Trials::open(args, on, fragment)?;
    let tuned = look_for_gains(args, on, &mut trials, stopped)?;
    let agents = agents::tune(args, &on.scene, stopped)?;
    write_file(fragment, gains::fragment(tuned.law, agents.gains(), &report::comment(on, &tuned)))?;
    trials.close(!tuned.interrupted)?;
    let mut files = vec![fragment.to_owned()];
    let mut checked = Vec::new();
    // after an interrupt the user does not wait for figures
    if !tuned.interrupted {
        files.extend(figures::write(folder, &file_stem(&on.scene.name), on, &tuned)?);
        checked = checked::check(args, on, &tuned, stopped)?;
    }
    data(&if args.common.json {
        report::json(on, &report::Found { tuned: &tuned, agents: &agents, checked: &checked, files: &files })?
    } else {
        report::text(on, &report::Found { tuned: &tuned, agents: &agents, checked: &checked, files: &files })
    })?;
    if tuned.interrupted {
        message("interrupted: the best gains so far were written; the same command with --force goes on from here");
        return Ok(Exit::Interrupted);
    }
    Ok(Exit::Ok)
}

/// Refuses a target that no resolution can reach: it has no gains.
fn refuse_out_of_reach(on: &Identified) -> anyhow::Result<()> {
    refusal(&on.plant, on.target_hz).map_or(Ok(()), |why| Err(BadInput(format!("{}: {why}", on.scene.name)).into()))
}

/// Searches every family, from the laws for comparison.
fn look_for_gains(
    args: &TuneArgs,
    on: &Identified,
    trials: &mut Trials,
    stopped: &AtomicBool,
) -> anyhow::Result<Tuning> {
    let one = |family: Family, starts: &[Candidate]| {
        let bar = Bar::new(origin_name(Origin::Found(family)), args.common.quiet || args.common.json);
        let mut go_on = |share: f64, best: &Verdict| {
            bar.set(share, format!("best so far {}: {:.3}", gains::gains_text(best.candidate), best.objective));
            !stopped.load(Ordering::Relaxed)
        };
        let on_plant = |candidate| judge(&on.plant, candidate, on.target_hz, extent(args));
        let mut judge = |candidate| trials.verdict(candidate, || on_plant(candidate));
        search(&mut Search { judge: &mut judge, go_on: &mut go_on }, family, starts)
    };
    tune(&on.plant, on.target_hz, one).context("no candidate could be evaluated")
}

/// The name of a row of the table.
const fn origin_name(origin: Origin) -> &'static str {
    match origin {
        Origin::Found(Family::Corrected) => "corrected, found",
        Origin::Found(Family::Pi) => "PI, found",
        Origin::Found(Family::Printed) => "printed, found",
        Origin::Found(Family::Adaptive) => "adaptive, found",
        Origin::Default => "corrected, default gains",
        Origin::Printed => "printed, α = 1e-4",
        Origin::Normalised => "normalised, α = k/f₀",
        Origin::Relay => "relay (Ziegler-Nichols)",
    }
}
