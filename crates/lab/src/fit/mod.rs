//! `fit`: the cheapest steps, divisions and integrators that keep a scene's points within a tolerance of its converged answer.
//!
//! In: a scene, a tolerance. Out: a table of present and needed costs, notes on simpler models, and with `--write` the scene.
//! Never here: the search itself ([`metachron_session::fit`]), how a scene is played ([`metachron_session`]).

mod limits;
mod objects;
mod report;
mod simpler;
mod task;
mod to_rope;
mod write_back;

use super::args::FitArgs;
use super::chart::stopper;
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, data, message};
use metachron_console::progress::Bar;
use metachron_scene::{Source, builtin, load};
use metachron_session::fit::{Converged, Found, Search, Setting, Trial, converge};
use objects::Object;
use simpler::Simpler;
use std::path::Path;
use std::sync::atomic::Ordering;
use task::Task;

/// Greatest number of halvings of step and spacing for the converged answer.
const LEVELS_MAX: u32 = 4;
/// Runs reserved for after the search, or for explaining why it failed: CPU before and after, and simpler models.
const AFTER_SEARCH: u32 = 3;
/// The converged answer must be known to this share of the tolerance.
const KNOWN: f64 = 0.2;

/// The result of a fit.
struct Fitted {
    /// Error bound of the converged answer, metres.
    known_m: f64,
    /// The present settings of the scene, and their trial.
    now: (Vec<Setting>, Trial),
    /// The cheapest settings found to hold.
    need: Found,
    /// Measured CPU of each object, seconds per simulated second: with the present and with the needed settings.
    cpu_s: [Vec<f64>; 2],
    /// The simpler model of each object, where one would do.
    simpler: Vec<Option<Simpler>>,
}

/// Fits a scene.
///
/// # Errors
/// Bad input, a file that cannot be written, an adapter that failed.
pub fn command(args: &FitArgs) -> anyhow::Result<Exit> {
    if !(args.tolerance.is_finite() && args.tolerance > 0.0) {
        let what = format!("--tolerance is {} m; expected a length above zero, such as 1e-3", args.tolerance);
        return Err(BadInput(what).into());
    }
    if args.write {
        refuse_built_in(&args.scene)?;
    }
    let source = Source::open(&args.scene)?.within(args.common.limits.limits());
    let scene = load(&source, &args.common.set)?;
    let objects = objects::of(&scene, source.text());
    let stopped = stopper()?;
    let bar = Bar::new("fit", args.common.quiet || args.common.json);
    let mut task = Task::new(args, scene, objects, &stopped, bar)?;
    let fitted = fit(&mut task, args)?;
    task.clear_bar();
    let fitted = match fitted {
        Outcome::Fitted(fitted) => fitted,
        Outcome::OutOfReach(sentence) => {
            message(&format!("error: {}: {sentence}", args.scene));
            return Ok(Exit::Failed);
        }
        Outcome::Interrupted => {
            message("interrupted before any settings within the tolerance were found: nothing was written");
            return Ok(Exit::Interrupted);
        }
    };
    let write = || write_back::write(Path::new(&args.scene), &task, &fitted, source.limits());
    let written = args.write.then(write).transpose()?;
    data(&if args.common.json {
        report::json(args, &task, &fitted, written.is_some())?
    } else {
        report::text(args, &task, &fitted)
    })?;
    if let Some(changes) = written {
        message(&format!("{}: {changes} keys were changed", args.scene));
    }
    if stopped.load(Ordering::Relaxed) {
        message("interrupted: these are the best settings found so far");
        return Ok(Exit::Interrupted);
    }
    Ok(Exit::Ok)
}

/// Refuses scenes that come with the program, which are not files.
fn refuse_built_in(name: &str) -> anyhow::Result<()> {
    if builtin::find(name).is_none() {
        return Ok(());
    }
    let what = format!(
        "`{name}` is a built-in scene and cannot be overwritten: `--write` changes scene files; save it to a file such as {name}.toml and fit that"
    );
    Err(BadInput(what).into())
}

/// The outcomes of a fit.
enum Outcome {
    Fitted(Fitted),
    /// No settings hold the tolerance: the best reached, and its limit.
    OutOfReach(String),
    Interrupted,
}

/// Finds the converged answer, settings that hold, and the cheapest of these.
fn fit(task: &mut Task<'_>, args: &FitArgs) -> anyhow::Result<Outcome> {
    let tolerance_m = args.tolerance;
    let now = task.settings();
    let found = converge(LEVELS_MAX, KNOWN * tolerance_m, &mut |level| task.reference(level));
    task.failure()?;
    let Some(answer) = found else {
        return Ok(if task.left() <= 1 { too_few_runs(task, args) } else { ended(task, |task| task.lost()) });
    };
    let room_m = tolerance_m - answer.error_m;
    let present = task.attempt(&now, &answer.paths);
    task.failure()?;
    let Some(present) = present else { return Ok(too_few_runs(task, args)) };
    let mut best = f64::INFINITY;
    let start = start(task, &answer, room_m, &mut best);
    task.failure()?;
    if task.left() < AFTER_SEARCH {
        return Ok(too_few_runs(task, args));
    }
    let Some((settings, trial)) = start else {
        return Ok(ended(task, |task| limits::explain(task, &answer, tolerance_m, best)));
    };
    let choices = task.choices();
    let trials_max = task.left() - AFTER_SEARCH;
    let mut attempt = |settings: &[Setting]| task.attempt(settings, &answer.paths);
    let mut need =
        Search { choices: &choices, tolerance_m: room_m, trials_max, attempt: &mut attempt }.run(settings, trial);
    task.failure()?;
    let paid_s = task.cpu(&now);
    let simpler = simpler::find(task, &mut need, &simpler::Limits { answer: &answer, room_m, trials_max });
    let cpu_s = [paid_s, task.cpu(&need.settings)];
    task.failure()?;
    Ok(Outcome::Fitted(Fitted { known_m: answer.error_m, now: (now, present), need, cpu_s, simpler }))
}

/// The outcome without an answer: the reason, unless the user interrupted.
fn ended<'a>(task: &mut Task<'a>, explain: impl FnOnce(&mut Task<'a>) -> String) -> Outcome {
    if task.is_stopped() { Outcome::Interrupted } else { Outcome::OutOfReach(explain(task)) }
}

/// The outcome where the runs were used up before anything was found.
fn too_few_runs(task: &mut Task<'_>, args: &FitArgs) -> Outcome {
    let what =
        "runs are too few to find the converged answer and settings within the tolerance: allow more with --runs";
    ended(task, |_| format!("{} {what}", args.runs))
}

/// The coarsest settings that hold by halving alone: as in the scene, with a method of second order, or ever finer.
fn start(task: &mut Task<'_>, answer: &Converged, room_m: f64, best: &mut f64) -> Option<(Vec<Setting>, Trial)> {
    for level in 0..=answer.level {
        for second in [false, true] {
            let settings = task.refined(level, second);
            let trial = task.attempt(&settings, &answer.paths)?;
            *best = best.min(trial.error_m);
            if trial.error_m <= room_m {
                return Some((settings, trial));
            }
        }
    }
    None
}

/// A length with a suitable unit.
fn length(metres: f64) -> String {
    match metres {
        m if !m.is_finite() => "no".to_owned(),
        m if m < 1e-6 => format!("{:.3} nm", m * 1e9),
        m if m < 1e-3 => format!("{:.3} µm", m * 1e6),
        m if m < 1.0 => format!("{:.3} mm", m * 1e3),
        m => format!("{m:.3} m"),
    }
}

/// The objects' names, as a list in text.
fn names(objects: &[Object]) -> String {
    objects.iter().map(|object| format!("`{}`", object.name)).collect::<Vec<_>>().join(", ")
}
