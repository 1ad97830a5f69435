//! Reads target, camera, machine and probes of a scene file.

use super::Names;
use super::objects::NamedObject;
use crate::check::{Checker, Place};
use crate::diagnostic::{Problem, did_you_mean};
use crate::format::{CameraFile, CameraFiles, CameraKeyFile, MODELS, Point, ProbeFile, model_named};
use glam::DVec3;
use metachron_core::SimSpan;
use metachron_core::kinds::PolicyKind;
use metachron_world::{Camera, FACTOR, Load, Machine, NamedCamera, PRESETS, Probe, Target, View};

/// Default vertical angle of view, degrees.
const FOV_DEFAULT_DEG: f64 = 40.0;
/// An eye nearer than this to the point it looks at has no direction, metres.
const EYE_NEAREST_M: f64 = 1e-6;

/// Reports a share of a lag that has no bound, and factors that the policy does not know.
pub(crate) fn check_target(c: &mut Checker<'_, '_>, target: &Target) {
    let place = c.place("target");
    if target.lag_ms.is_none() {
        c.refuse(&place, &["optimiser_share"], "has no effect alone", "expected `lag_ms` beside it");
    }
    let Target { policy, focus, motion, hysteresis, .. } = *target;
    let weighs = policy.predicts() && policy != PolicyKind::RobinHood;
    for (key, value, counts) in
        [("focus", focus, weighs), ("motion", motion, weighs), ("hysteresis", hysteresis, policy.has_hysteresis())]
    {
        if !counts && value.is_some_and(|value| value > 0.0) {
            let what = format_args!("has no effect under `policy = \"{}\"`", policy.name());
            c.wrong(&place, key, what, format!("expected no `{key}`, or another policy"));
        }
    }
}

/// Reads the cameras of the scene, which have different names.
pub(crate) fn cameras(c: &mut Checker<'_, '_>, files: &CameraFiles) -> Vec<NamedCamera> {
    let files = match files {
        CameraFiles::One(file) => {
            let name = file.name.clone().unwrap_or_else(|| "camera".to_owned());
            let place = c.place("camera");
            return camera(c, &place, file).map(|camera| NamedCamera { name, camera }).into_iter().collect();
        }
        CameraFiles::Several(files) => files,
    };
    let mut cameras: Vec<NamedCamera> = Vec::with_capacity(files.len());
    for (at, file) in files.iter().enumerate() {
        let place = c.place(&format!("camera.{at}"));
        let name = file.name.clone().unwrap_or_else(|| format!("camera {}", at + 1));
        if cameras.iter().any(|other| other.name == name) {
            c.wrong(&place, "name", format_args!("is \"{name}\" twice"), "expected another name for each camera");
        }
        cameras.extend(camera(c, &place, file).map(|camera| NamedCamera { name, camera }));
    }
    cameras
}

fn camera(c: &mut Checker<'_, '_>, place: &Place, file: &CameraFile) -> Option<Camera> {
    let fov_deg = file.fov_deg.unwrap_or(FOV_DEFAULT_DEG);
    if let Some(keys) = &file.keyframe {
        let foreign = ["eye_m", "look_at_m", "period_s"];
        c.refuse(place, &foreign, "contradicts `keyframe`", "expected it in the keyframes only");
        let keys = camera_keys(c, place, keys, fov_deg);
        return Some(Camera::Path { keys, repeat: file.repeat.unwrap_or(false), even: file.even.unwrap_or(false) });
    }
    let expected = "expected `[[camera.keyframe]]` tables beside it";
    c.refuse(place, &["repeat", "even"], "has no effect without a path", expected);
    let Some(eye) = file.eye_m else {
        c.wrong(place, "eye_m", "is missing", "expected `eye_m` or `[[camera.keyframe]]` tables");
        return None;
    };
    let start = view(c, place, [eye, file.look_at_m.unwrap_or_default()], fov_deg);
    Some(match file.period_s {
        None => Camera::Still(start),
        Some(period_s) if (0.1..=1e5).contains(&period_s.abs()) => Camera::Orbit { start, period_s },
        Some(period_s) => {
            let expected = "expected 0.1 to 100000 s, or -100000 to -0.1 s for the other direction";
            c.wrong(place, "period_s", format_args!("is {period_s}"), expected);
            Camera::Still(start)
        }
    })
}

fn view(c: &mut Checker<'_, '_>, place: &Place, points: [Point; 2], fov_deg: f64) -> View {
    let [eye_m, look_at_m] = points.map(DVec3::from);
    if eye_m.distance(look_at_m) < EYE_NEAREST_M {
        c.wrong(place, "eye_m", "is the same point as `look_at_m`", "expected a point away from `look_at_m`");
    }
    View { eye_m, look_at_m, fov_deg }
}

/// The views of a path, each with its time in seconds.
fn camera_keys(c: &mut Checker<'_, '_>, place: &Place, files: &[CameraKeyFile], fov_deg: f64) -> Vec<(f64, View)> {
    let mut keys: Vec<(f64, View)> = Vec::with_capacity(files.len());
    for (i, file) in files.iter().enumerate() {
        let place = place.entry("keyframe", i);
        if let Some((before, _)) = keys.last().filter(|(before, _)| *before >= file.at_s) {
            let expected = format!("expected a time after the keyframe before, {before} s");
            c.wrong(&place, "at_s", format_args!("is {}", file.at_s), expected);
        }
        let fov_deg = file.fov_deg.unwrap_or(fov_deg);
        keys.push((file.at_s, view(c, &place, [file.eye_m, file.look_at_m], fov_deg)));
    }
    keys
}

/// The values that the scene declares for its machine.
pub(crate) fn machine(c: &mut Checker<'_, '_>, mut machine: Machine) -> Machine {
    let place = c.place("machine");
    if machine.preset.is_empty() {
        machine.preset = PRESETS[0].to_owned();
    }
    if !PRESETS.contains(&machine.preset.as_str()) {
        c.reference(&place, "preset", &machine.preset, PRESETS.into_iter());
    }
    check_load(c, &place, "load", &machine.load);
    check_load(c, &place, "step_load", &machine.step_load);
    machine.step = machine.step.into_iter().map(|(model, cost)| (known_model(c, &model), cost)).collect();
    machine
}

/// Additional load of the machine begins at rising times.
fn check_load(c: &mut Checker<'_, '_>, place: &Place, key: &str, entries: &[Load]) {
    for (i, pair) in entries.windows(2).enumerate().filter(|(_, pair)| pair[0].at_s >= pair[1].at_s) {
        let expected = format!("expected a time after the entry before, {} s", pair[0].at_s);
        c.wrong(&place.entry(key, i + 1), "at_s", format_args!("is {}", pair[1].at_s), expected);
    }
}

/// The present name of a model whose steps have a price, or of the factor of contacts.
fn known_model(c: &mut Checker<'_, '_>, model: &str) -> String {
    let known = if model == FACTOR { Some(FACTOR) } else { model_named(model) };
    if known.is_none() {
        let span = c.document().locate(&format!("machine.step.{model}"));
        let list = MODELS.map(|m| format!("`{m}`")).join(", ");
        let problem = Problem::new(span, format!("`{model}` in `[machine.step]` is no model, nor `{FACTOR}`"));
        c.push(problem.expecting(format!("expected one of {list}, `{FACTOR}`")).helped(did_you_mean(model, MODELS)));
    }
    known.unwrap_or(model).to_owned()
}

/// The points whose state is reported.
pub(crate) fn probes(c: &mut Checker<'_, '_>, files: &[ProbeFile], names: &Names) -> Vec<Probe> {
    (0..).zip(files).filter_map(|(i, file)| probe(c, i, file, names)).collect()
}

fn probe(c: &mut Checker<'_, '_>, number: usize, file: &ProbeFile, names: &Names) -> Option<Probe> {
    let place = c.place(&format!("probe.{number}"));
    let named = names.get(&file.object);
    let agent = named.and_then(NamedObject::agent);
    if named.is_none() {
        c.reference(&place, "object", &file.object, names.agents());
    } else if agent.is_none() {
        let what = format_args!("names `{}`, which is fixed", file.object);
        c.wrong(&place, "object", what, "expected an object that moves");
    }
    Some(Probe {
        agent: agent?,
        object: file.object.clone(),
        at: file.at.unwrap_or(1.0),
        every: file.every_ms.and_then(|ms| SimSpan::from_secs_f64(ms * 1e-3)),
    })
}
