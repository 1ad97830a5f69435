//! When a simpler model would do.
//!
//! In: a scene at the settings that were found. Out: sentences. Never here: any change of the scene.

use super::length;
use super::task::Task;
use crate::fit::{Converged, Found, Path, Setting, farthest_m};
use crate::frame::{Played, slacken};
use crate::scene::Spec;

/// What moves by less than this share of the tolerance does not move.
const STILL: f64 = 0.01;
/// A rope is tried with the steps of the tube, and with steps so many times shorter.
const SHORTER: [f64; 2] = [1.0, 4.0];

/// One sentence for every object that a simpler model would do for.
pub(super) fn notes(task: &mut Task<'_>, answer: &Converged, need: &Found, room_m: f64) -> Vec<String> {
    let Some(played) = task.play(&need.settings) else { return Vec::new() };
    let mut notes = Vec::new();
    for object in 0..task.objects.len() {
        let paths = paths(task, &played, object);
        let still = !paths.is_empty() && paths.iter().all(|path| path.extent_m() <= STILL * room_m);
        let note = if still {
            Some(resting(task, object))
        } else {
            flying(task, &played, (object, room_m)).or_else(|| roping(task, answer, (object, room_m), &need.settings))
        };
        notes.extend(note);
    }
    notes
}

/// The paths of an object's points.
fn paths(task: &Task<'_>, played: &Played, object: usize) -> Vec<Path> {
    let agents = &task.objects[object].agents;
    let all = task.points.iter().zip(&played.paths).skip(task.held);
    all.filter(|(point, _)| agents.contains(&point.agent)).map(|(_, path)| path.clone()).collect()
}

/// What to say of what does not move.
fn resting(task: &Task<'_>, object: usize) -> String {
    let (name, seconds) = (&task.objects[object].name, task.seconds);
    match task.member(object).spec {
        Spec::Rigid(_) => format!("`{name}` does not move in {seconds} s: with `fixed = true` it needs no agent"),
        _ => format!("`{name}` does not move in {seconds} s: a fixed object of its shape needs no agent"),
    }
}

/// What to say of a body that nothing touches.
fn flying(task: &Task<'_>, played: &Played, (object, room_m): (usize, f64)) -> Option<String> {
    let Spec::Rigid(spec) = &task.member(object).spec else { return None };
    let agents = &task.objects[object].agents;
    let paired = played.pairs.iter().any(|(a, b)| agents.contains(a) || agents.contains(b));
    let jointed = spec.joints.iter().any(|joint| agents.iter().any(|agent| joint.holds(*agent)));
    let flies = paths(task, played, object).iter().all(|path| path.from_flight_m(spec.gravity) <= STILL * room_m);
    (!paired && !jointed && flies).then(|| {
        let (name, seconds) = (&task.objects[object].name, task.seconds);
        format!(
            "nothing touches `{name}` in {seconds} s: it needs no contact solver, and its flight is exact at any step"
        )
    })
}

/// What to say of a tube that does no more than a rope.
fn roping(
    task: &mut Task<'_>,
    answer: &Converged,
    (object, room_m): (usize, f64),
    settings: &[Setting],
) -> Option<String> {
    if !matches!(task.member(object).spec, Spec::Tube(_)) {
        return None;
    }
    for shorter in SHORTER {
        let mut settings = settings.to_vec();
        settings[object].dt_s /= shorter;
        let mut scene = task.scene_at(&settings);
        let agents = task.objects[object].agents.clone();
        if !agents.iter().all(|agent| slacken(&mut scene, *agent)) {
            return None;
        }
        let played = task.play_scene(&scene)?;
        let error_m = farthest_m(&played.paths[..task.held], &answer.paths);
        if played.parked.is_none() && error_m <= room_m {
            let Setting { dt_s, pieces, .. } = settings[object];
            let cost_s: f64 = agents.iter().map(|agent| played.costs_s[agent.0 as usize]).sum();
            return Some(format!(
                "`{}` neither twists nor bends stiffly enough to matter: `model = \"rope\"` with {pieces} segments and {:.3} ms errs by {} and costs {:.3} ms a second",
                task.objects[object].name,
                dt_s * 1e3,
                length(error_m),
                cost_s * 1e3
            ));
        }
    }
    None
}
