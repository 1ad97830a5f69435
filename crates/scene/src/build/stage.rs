//! Reads target, camera, machine and probes of a scene file.

use super::{Names, POSITION_MAX_M};
use crate::check::{Checker, Place};
use crate::diagnostic::{Problem, did_you_mean};
use crate::format::{
    CAMERA, COST, CameraFile, CameraFiles, CameraKeyFile, LOAD, LoadFile, MACHINE, MODELS, MachineFile, PROBE, Point,
    ProbeFile, STEP_COST, ShadingCostFile, TARGET, TargetFile, model_named,
};
use glam::DVec3;
use metachron_core::SimSpan;
use metachron_core::kinds::PolicyKind;
use metachron_world::{
    Camera, FACTOR, Factors, Gains, Machine, NamedCamera, ObjectCost, Probe, RENDER_SCALE, Target, View,
};

/// Default share of the lag that is reserved for choosing levels: the most that (GB99) needed.
const OPTIMISER_SHARE: f64 = 0.05;
/// Default frames per second.
const FRAME_DEFAULT_HZ: f64 = 60.0;
/// Default vertical angle of view, degrees.
const FOV_DEFAULT_DEG: f64 = 40.0;
/// Most keyframes of a camera.
const KEYFRAMES_MAX: usize = 10_000;
/// Most entries of a machine's load.
const LOADS_MAX: usize = 1000;
/// Most probes.
const PROBES_MAX: usize = 1000;
/// The machines that a scene can name.
const PRESETS: [&str; 2] = ["two-cores-software", "workstation"];
/// An eye nearer than this to the point it looks at has no direction, metres.
const EYE_NEAREST_M: f64 = 1e-6;

/// The target frame rate and how it is held.
pub(crate) fn target(c: &mut Checker<'_, '_>, file: Option<&TargetFile>) -> Target {
    let place = Place::new("target", "of `[target]`");
    let frame_hz = file.and_then(|f| f.frame_hz);
    let mut gain = |key: &str, value: Option<f64>| c.optional(&place, key, value, TARGET);
    let given = file.map_or_else(Gains::default, |f| Gains {
        alpha: gain("alpha", f.alpha),
        beta: gain("beta", f.beta),
        kappa: gain("kappa", f.kappa),
        lead: gain("lead", f.lead),
        margin: gain("margin", f.margin),
        agent_refine: gain("agent_refine", f.agent_refine),
        agent_yield: gain("agent_yield", f.agent_yield),
    });
    let factors = file.map_or_else(Factors::default, |f| Factors {
        focus: gain("focus", f.focus),
        motion: gain("motion", f.motion),
        hysteresis: gain("hysteresis", f.hysteresis),
    });
    let policy = file.and_then(|f| f.policy).unwrap_or_default();
    let weighs = policy.predicts() && policy != PolicyKind::RobinHood;
    let Factors { focus, motion, hysteresis } = factors;
    for (key, value, counts) in
        [("focus", focus, weighs), ("motion", motion, weighs), ("hysteresis", hysteresis, policy.has_hysteresis())]
    {
        if !counts && value.is_some_and(|value| value > 0.0) {
            let what = format!("has no effect under `policy = \"{}\"`", policy.name());
            c.wrong(&place, key, what, format!("expected no `{key}`, or another policy"));
        }
    }
    let scales = file.and_then(|f| f.render_scale).map(|scales| c.ends(&place, "render_scale", scales, TARGET));
    Target {
        lag: lag(c, &place, file),
        frame_hz: c.optional(&place, "frame_hz", frame_hz, TARGET).unwrap_or(FRAME_DEFAULT_HZ),
        policy,
        value: file.and_then(|f| f.value).unwrap_or_default(),
        law: file.and_then(|f| f.law).unwrap_or_default(),
        gains: given,
        raise: file.and_then(|f| f.raise).unwrap_or_default(),
        may_vanish: file.and_then(|f| f.may_vanish).unwrap_or_default(),
        factors,
        render_scale: scales.unwrap_or(RENDER_SCALE),
    }
}

/// The greatest lag in seconds and the optimiser's share of it.
fn lag(c: &mut Checker<'_, '_>, place: &Place, file: Option<&TargetFile>) -> Option<(f64, f64)> {
    let share = file.and_then(|f| f.optimiser_share);
    let part = c.optional(place, "optimiser_share", share, TARGET).unwrap_or(OPTIMISER_SHARE);
    let Some(lag_ms) = file.and_then(|f| f.lag_ms) else {
        if share.is_some() {
            c.wrong(place, "optimiser_share", "has no effect alone", "expected `lag_ms` beside it");
        }
        return None;
    };
    Some((c.number(place, "lag_ms", lag_ms, TARGET) * 1e-3, part))
}

/// Most cameras of a scene.
const CAMERAS_MAX: usize = 100;

/// Reads the cameras of the scene, which have different names.
pub(crate) fn cameras(c: &mut Checker<'_, '_>, files: &CameraFiles) -> Vec<NamedCamera> {
    let place = Place::new("camera", "of `[camera]`");
    let files = match files {
        CameraFiles::One(file) => {
            let name = file.name.clone().unwrap_or_else(|| "camera".to_owned());
            return camera(c, &place, file).map(|camera| NamedCamera { name, camera }).into_iter().collect();
        }
        CameraFiles::Several(files) => files,
    };
    if files.len() > CAMERAS_MAX {
        let what = format!("has {} entries", files.len());
        c.wrong(&Place::new("", ""), "camera", what, format!("expected at most {CAMERAS_MAX}"));
        return Vec::new();
    }
    let mut cameras: Vec<NamedCamera> = Vec::with_capacity(files.len());
    for (at, file) in files.iter().enumerate() {
        let place = Place::new("", "").entry("camera", at);
        let name = file.name.clone().unwrap_or_else(|| format!("camera {}", at + 1));
        if cameras.iter().any(|other| other.name == name) {
            c.wrong(&place, "name", format_args!("is \"{name}\" twice"), "expected another name for each camera");
        }
        cameras.extend(camera(c, &place, file).map(|camera| NamedCamera { name, camera }));
    }
    cameras
}

fn camera(c: &mut Checker<'_, '_>, place: &Place, file: &CameraFile) -> Option<Camera> {
    let fov_deg = c.optional(place, "fov_deg", file.fov_deg, CAMERA).unwrap_or(FOV_DEFAULT_DEG);
    if let Some(keys) = &file.keyframe {
        for (key, given) in [
            ("eye_m", file.eye_m.is_some()),
            ("look_at_m", file.look_at_m.is_some()),
            ("period_s", file.period_s.is_some()),
        ] {
            if given {
                c.wrong(place, key, "contradicts `keyframe`", "expected it in the keyframes only");
            }
        }
        let keys = camera_keys(c, place, keys, fov_deg)?;
        return Some(Camera::Path { keys, repeat: file.repeat.unwrap_or(false), even: file.even.unwrap_or(false) });
    }
    for (key, given) in [("repeat", file.repeat.is_some()), ("even", file.even.is_some())] {
        if given {
            c.wrong(place, key, "has no effect without a path", "expected `[[camera.keyframe]]` tables beside it");
        }
    }
    let Some(eye) = file.eye_m else {
        c.wrong(place, "eye_m", "is missing", "expected `eye_m` or `[[camera.keyframe]]` tables");
        return None;
    };
    let start = view(c, place, eye, file.look_at_m.unwrap_or_default(), fov_deg);
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

fn view(c: &mut Checker<'_, '_>, place: &Place, eye: Point, look_at: Point, fov_deg: f64) -> View {
    let eye_m = c.point(place, "eye_m", eye, POSITION_MAX_M);
    let look_at_m = c.point(place, "look_at_m", look_at, POSITION_MAX_M);
    if eye_m.distance(look_at_m) < EYE_NEAREST_M && eye_m.is_finite() {
        c.wrong(place, "eye_m", "is the same point as `look_at_m`", "expected a point away from `look_at_m`");
        return View { eye_m: look_at_m + DVec3::ONE, look_at_m, fov_deg };
    }
    View { eye_m, look_at_m, fov_deg }
}

/// The views of a path, each with its time in seconds.
fn camera_keys(
    c: &mut Checker<'_, '_>,
    place: &Place,
    files: &[CameraKeyFile],
    fov_deg: f64,
) -> Option<Vec<(f64, View)>> {
    if !(2..=KEYFRAMES_MAX).contains(&files.len()) {
        c.wrong(
            place,
            "keyframe",
            format_args!("has {} entries", files.len()),
            format!("expected 2 … {KEYFRAMES_MAX}"),
        );
        return None;
    }
    let mut keys: Vec<(f64, View)> = Vec::with_capacity(files.len());
    for (i, file) in files.iter().enumerate() {
        let place = place.entry("keyframe", i);
        let at_s = c.number(&place, "at_s", file.at_s, CAMERA);
        let fov = c.optional(&place, "fov_deg", file.fov_deg, CAMERA).unwrap_or(fov_deg);
        if let Some((before, _)) = keys.last().filter(|(before, _)| *before >= at_s) {
            let expected = format!("expected a time after the keyframe before, {before} s");
            c.wrong(&place, "at_s", format_args!("is {at_s}"), expected);
        }
        keys.push((at_s, view(c, &place, file.eye_m, file.look_at_m, fov)));
    }
    Some(keys)
}

/// The values that the scene declares for its machine.
pub(crate) fn machine(c: &mut Checker<'_, '_>, file: Option<&MachineFile>) -> Machine {
    let default = MachineFile::default();
    let file = file.unwrap_or(&default);
    let place = Place::new("machine", "of `[machine]`");
    let preset = file.preset.clone().unwrap_or_else(|| PRESETS[0].to_owned());
    if !PRESETS.contains(&preset.as_str()) {
        c.reference(&place, "preset", &preset, PRESETS.into_iter());
    }
    let mut number = |key: &str, value: Option<f64>| c.optional(&place, key, value, MACHINE);
    let cores = number("cores", file.cores.map(f64::from)).map(|n| n as u32);
    let draw_setup_ms = number("draw_setup_ms", file.draw_setup_ms);
    let draw_object_us = number("draw_object_us", file.draw_object_us);
    let draw_triangle_us = number("draw_triangle_us", file.draw_triangle_us);
    let draw_pixel_ns = number("draw_pixel_ns", file.draw_pixel_ns);
    let draw_enlarge_ns = number("draw_enlarge_ns", file.draw_enlarge_ns);
    let cull_object_ns = number("cull_object_ns", file.cull_object_ns);
    let choose_object_ns = number("choose_object_ns", file.choose_object_ns);
    let noise = number("noise", file.noise);
    let wander = number("wander", file.wander);
    let spikes = number("spikes", file.spikes);
    let seed = file.seed.map(u64::from);
    let steps = step_prices(c, &place.table("step"), file);
    let table = place.table("shading");
    let of = file.shading.unwrap_or_default();
    let named = [("flat", of.flat), ("gouraud", of.gouraud), ("per-pixel", of.per_pixel), ("textured", of.textured)];
    let shading = named.map(|(name, file)| object_cost(c, &table.table(name), file));
    let strokes = [("points", of.points), ("lines", of.lines)];
    let strokes = strokes.map(|(name, file)| object_cost(c, &table.table(name), file));
    let step_load = load(c, &place, "step_load", &file.step_load);
    let load = load(c, &place, "load", &file.load);
    Machine {
        preset,
        cores,
        steps,
        draw_setup_ms,
        draw_object_us,
        draw_triangle_us,
        draw_pixel_ns,
        draw_enlarge_ns,
        graphics_card: file.graphics_card,
        cull_object_ns,
        choose_object_ns,
        shading,
        strokes,
        noise,
        wander,
        spikes,
        load,
        step_load,
        seed,
    }
}

/// Reads additional load of the machine, as (seconds, factor).
fn load(c: &mut Checker<'_, '_>, place: &Place, key: &str, entries: &[LoadFile]) -> Vec<(f64, f64)> {
    if entries.len() > LOADS_MAX {
        let expected = format!("expected at most {LOADS_MAX}");
        c.wrong(place, key, format_args!("has {} entries", entries.len()), expected);
        return Vec::new();
    }
    let mut steps: Vec<(f64, f64)> = Vec::with_capacity(entries.len());
    for (i, entry) in entries.iter().enumerate() {
        let place = place.entry(key, i);
        let at_s = c.number(&place, "at_s", entry.at_s, LOAD);
        if let Some((before, _)) = steps.last().filter(|(before, _)| *before >= at_s) {
            let expected = format!("expected a time after the entry before, {before} s");
            c.wrong(&place, "at_s", format_args!("is {at_s}"), expected);
        }
        steps.push((at_s, c.number(&place, "factor", entry.factor, LOAD)));
    }
    steps
}

/// Cost of objects that are drawn in one way, as far as the scene gives it.
fn object_cost(c: &mut Checker<'_, '_>, place: &Place, file: Option<ShadingCostFile>) -> ObjectCost {
    let file = file.unwrap_or_default();
    let mut number = |key: &str, value: Option<f64>| c.optional(place, key, value, COST);
    ObjectCost {
        object_us: number("object_us", file.object_us),
        triangle_us: number("triangle_us", file.triangle_us),
        vertex_us: number("vertex_us", file.vertex_us),
        pixel_ns: number("pixel_ns", file.pixel_ns),
    }
}

fn step_prices(c: &mut Checker<'_, '_>, place: &Place, file: &MachineFile) -> Vec<(String, Option<f64>, Option<f64>)> {
    let mut steps = Vec::with_capacity(file.step.len());
    for (model, price) in &file.step {
        let known = if model == FACTOR { Some(FACTOR) } else { model_named(model) };
        if known.is_none() {
            let span = c.document().locate(&format!("machine.step.{model}"));
            let list = MODELS.map(|m| format!("`{m}`")).join(", ");
            let problem = Problem::new(span, format!("`{model}` in `[machine.step]` is no model, nor `{FACTOR}`"));
            c.push(
                problem.expecting(format!("expected one of {list}, `{FACTOR}`")).helped(did_you_mean(model, MODELS)),
            );
        }
        let place = place.table(model);
        let mut cost = |key: &str, v: Option<f64>| v.map(|v| c.number(&place, key, v, STEP_COST));
        steps.push((known.unwrap_or(model).to_owned(), cost("base_us", price.base_us), cost("unit_us", price.unit_us)));
    }
    steps
}

/// The points whose state is reported.
pub(crate) fn probes(c: &mut Checker<'_, '_>, files: &[ProbeFile], names: &Names) -> Vec<Probe> {
    if files.len() > PROBES_MAX {
        let expected = format!("expected at most {PROBES_MAX}");
        c.wrong(&Place::new("", ""), "probe", format_args!("has {} entries", files.len()), expected);
        return Vec::new();
    }
    files
        .iter()
        .enumerate()
        .filter_map(|(i, file)| probe(c, &Place::new(format!("probe.{i}"), "of `[[probe]]`"), file, names))
        .collect()
}

fn probe(c: &mut Checker<'_, '_>, place: &Place, file: &ProbeFile, names: &Names) -> Option<Probe> {
    let at = c.optional(place, "at", file.at, PROBE).unwrap_or(1.0);
    let every_ms = file.every_ms.map(|ms| c.number(place, "every_ms", ms, PROBE));
    let agent = match names.get(&file.object) {
        Some(named) if named.agent().is_some() => named.agent()?,
        Some(_) => {
            c.wrong(
                place,
                "object",
                format_args!("names `{}`, which is fixed", file.object),
                "expected an object that moves",
            );
            return None;
        }
        None => {
            c.reference(place, "object", &file.object, names.agents());
            return None;
        }
    };
    Some(Probe {
        agent,
        object: file.object.clone(),
        at,
        every: every_ms.and_then(|ms| SimSpan::from_secs_f64(ms * 1e-3)),
    })
}
