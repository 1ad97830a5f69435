//! Finds objects for which a simpler model would do.
//!
//! In: a scene at the settings found. Out: a word and a sentence for every object for which one would do; tubes that are
//! cheaper as ropes become ropes. Never here: any other change of the scene.

use super::length;
use super::task::{Task, is_free};
use metachron_session::Played;
use metachron_session::fit::{Choice, Converged, Found, Path, Search, Setting};
use metachron_world::Spec;

/// A point that moves by less than this share of the tolerance does not move.
const STILL: f64 = 0.01;
/// A rope is tried with the step of the tube divided by each of these.
const SHORTER: [f64; 3] = [1.0, 2.0, 4.0];
/// The most pieces of a rope.
const PIECES_MAX: u32 = 2047;

/// The note on an object.
pub(super) struct Simpler {
    /// A word for the table.
    pub(super) word: &'static str,
    /// The full sentence.
    pub(super) note: String,
}

/// Limits of a search for ropes: the answer, the allowed distance of points from it, and the greatest number of trials in all.
pub(super) struct Limits<'a> {
    pub(super) answer: &'a Converged,
    pub(super) room_m: f64,
    pub(super) trials_max: u32,
}

/// The simpler model of each object, where one would do; `need` is updated where a tube becomes a rope.
pub(super) fn find(task: &mut Task<'_>, need: &mut Found, limits: &Limits<'_>) -> Vec<Option<Simpler>> {
    let Some(played) = task.play(&need.settings) else { return Vec::new() };
    let plain = |object: usize| {
        own_control(task, object)
            .or_else(|| resting(task, &played, object, limits.room_m))
            .or_else(|| flying(task, &played, object, limits.room_m))
    };
    let mut simpler: Vec<_> = (0..task.objects.len()).map(plain).collect();
    for (object, note_of) in simpler.iter_mut().enumerate() {
        if note_of.is_none() {
            *note_of = slack(task, object, need, limits);
        }
    }
    simpler
}

/// The paths of an object's points.
fn paths(task: &Task<'_>, played: &Played, object: usize) -> Vec<Path> {
    let agents = &task.objects[object].agents;
    let all = task.points.iter().zip(&played.paths).skip(task.held);
    all.filter(|(point, _)| agents.contains(&point.agent)).map(|(_, path)| path.clone()).collect()
}

/// The note on an object whose settings may not be chosen.
fn own_control(task: &Task<'_>, object: usize) -> Option<Simpler> {
    let tolerance_m = task.member(object).tolerance_m?;
    let (name, held) = (&task.objects[object].name, length(tolerance_m));
    let note = format!("`{name}` controls its own error to {held}: its steps and segments are not chosen by fit");
    Some(Simpler { word: "own control", note })
}

/// The note on an object that does not move.
fn resting(task: &Task<'_>, played: &Played, object: usize, room_m: f64) -> Option<Simpler> {
    let paths = paths(task, played, object);
    let still = !paths.is_empty() && paths.iter().all(|path| path.extent_m() <= STILL * room_m);
    let (name, seconds) = (&task.objects[object].name, task.seconds);
    let note = match task.member(object).spec {
        Spec::Rigid(_) => format!("`{name}` does not move in {seconds} s: with `fixed = true` it needs no agent"),
        _ => format!("`{name}` does not move in {seconds} s: a fixed object of its shape needs no agent"),
    };
    still.then_some(Simpler { word: "fixed: no agent", note })
}

/// The note on a body that nothing touches.
fn flying(task: &Task<'_>, played: &Played, object: usize, room_m: f64) -> Option<Simpler> {
    let Spec::Rigid(spec) = &task.member(object).spec else { return None };
    if spec.led.is_some() {
        return None;
    }
    let agents = &task.objects[object].agents;
    let paired = played.pairs.iter().any(|(a, b)| agents.contains(a) || agents.contains(b));
    let jointed = task.scene.joints.iter().any(|joint| agents.iter().any(|agent| joint.holds(*agent)));
    let flies = paths(task, played, object).iter().all(|path| path.from_flight_m(spec.gravity) <= STILL * room_m);
    let (name, seconds) = (&task.objects[object].name, task.seconds);
    let note = format!(
        "`{name}` touches nothing in {seconds} s: it needs no contact solver, and its free flight is exact at any step"
    );
    (!paired && !jointed && flies).then_some(Simpler { word: "flight: no solver", note })
}

/// Tries a tube as a rope, and keeps the rope where it is cheaper; returns a note where a rope would do.
fn slack(task: &mut Task<'_>, object: usize, need: &mut Found, limits: &Limits<'_>) -> Option<Simpler> {
    if !matches!(task.member(object).spec, Spec::Tube(_)) || !is_free(task.member(object)) {
        return None;
    }
    let tubes = task.scene.clone();
    let rope = if task.slacken(object) { as_rope(task, object, need, limits) } else { None };
    let Some(rope) = rope else {
        task.scene = tubes;
        return None;
    };
    let cheaper = rope.trial.cost_s() < need.trial.cost_s();
    let Setting { dt_s, pieces, .. } = rope.settings[object];
    let [as_rope_ms, as_tube_ms] = [&rope, &*need].map(|found| found.trial.costs_s[object] * 1e3);
    let note = format!(
        "torsion and bending of `{}` have no effect here: `model = \"rope\"` with {pieces} segments and {:.3} ms costs {as_rope_ms:.3} ms per second, the tube {as_tube_ms:.3} ms{}",
        task.objects[object].name,
        dt_s * 1e3,
        if cheaper { "" } else { ", so it stays a tube" },
    );
    if cheaper {
        *need = rope;
    } else {
        task.scene = tubes;
        need.tried = rope.tried;
    }
    Some(Simpler { word: "rope", note })
}

/// The cheapest rope that holds, with all other settings unchanged.
fn as_rope(task: &mut Task<'_>, object: usize, need: &Found, limits: &Limits<'_>) -> Option<Found> {
    let (mut tried, mut start) = (need.tried, None);
    for shorter in SHORTER {
        let mut settings = need.settings.clone();
        let Setting { dt_s, pieces, .. } = settings[object];
        settings[object] = Setting { dt_s: dt_s / shorter, pieces: pieces.min(PIECES_MAX), method: 0 };
        let trial = task.attempt(&settings, &limits.answer.paths)?;
        tried += 1;
        if trial.error_m <= limits.room_m {
            start = Some((settings, trial));
            break;
        }
    }
    let (settings, trial) = start?;
    let mut choices = task.choices();
    for (other, choice) in choices.iter_mut().enumerate().filter(|(other, _)| *other != object) {
        let Setting { dt_s, pieces, .. } = settings[other];
        *choice = Choice { dt_max_s: dt_s, pieces_min: pieces, methods: Vec::new() };
    }
    let mut attempt = |settings: &[Setting]| task.attempt(settings, &limits.answer.paths);
    let (tolerance_m, trials_max) = (limits.room_m, limits.trials_max.saturating_sub(tried));
    let search = Search { choices: &choices, tolerance_m, trials_max, attempt: &mut attempt };
    let found = search.run(settings, trial);
    Some(Found { tried: tried + found.tried, cut_short: need.cut_short || found.cut_short, ..found })
}
