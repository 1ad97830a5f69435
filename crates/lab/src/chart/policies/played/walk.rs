//! One walk through a scene under one policy, compared with full detail.
//!
//! In: a scene, a case, whether times are measured or declared. Out: a row; without frames where times are measured but no adapter can
//! draw. Never here: figures.
//! Full detail is played once for all policies of a scene: its times set the target, and its pictures are the reference for the others.

use super::Case;
use super::row::frame;
use crate::chart::policies::numeric::{Row, deviation95, mean, within};
use anyhow::Context;
use metachron_lod::control::Policy;
use metachron_render::{Gpu, Offscreen, PictureFile, RendererOptions, Size, flip, psnr_db, ssim};
use metachron_scene::papers::{Choices, Paper};
use metachron_scene::{Source, load};
use metachron_session::{Drawing, FlyThrough, FrameRecord};
use std::sync::{Arc, Mutex, PoisonError};

const SIZE: Size = Size { width: 640, height: 480 };
/// The source of frame times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Times {
    /// The present adapter draws every frame.
    Measured,
    /// Lockstep on [`DECLARED`]: the same bits on every computer. An adapter, if present, draws only the pictures that are compared.
    Declared,
}

/// A machine whose frame times follow the objects and their shading, with the noise of `docs/theory/budget.md`, section 10. The time
/// for choosing is that measured on one core with the default policy (`chart policies`, selection); there is no other core to choose beside
/// drawing.
const DECLARED: [(&str, &str); 5] = [
    ("executor", "lockstep"),
    ("machine.cores", "1"),
    ("machine.choose_object_ns", "50"),
    ("machine.noise", "0.01"),
    ("machine.wander", "0.05"),
];
/// Its prices of drawing, where no preset is named.
const DECLARED_PRICES: [(&str, &str); 8] = [
    ("machine.draw_setup_ms", "0.1"),
    ("machine.draw_pixel_ns", "0.2"),
    ("machine.draw_object_us", "0.5"),
    ("machine.draw_triangle_us", "0.22"),
    ("machine.shading.flat.triangle_us", "0.1"),
    ("machine.shading.gouraud.triangle_us", "0.14"),
    ("machine.shading.flat.pixel_ns", "0.3"),
    ("machine.shading.gouraud.pixel_ns", "0.5"),
];

/// Greatest number of pictures compared in the first round, evenly along a path, and least number of frames between two: a comparison takes as long as
/// dozens of frames.
const PICTURES: usize = 5;
const APART: usize = 10;
/// Frames at the first place before the first that counts: they warm up pipelines, caches and prices; and that many where times are measured
/// and scatter, which has to be known, or as many as there are of the path.
pub(super) const LEAD_IN: usize = 20;
const MEASURED_LEAD_IN: usize = 100;
/// A measured play is bounded: one of full detail, and one at the target, seconds; and fewest frames for all that. Places along the path are
/// then fewer, and the same for all policies.
const FULL_S: f64 = 40.0;
const PLAY_S: f64 = 2.0;
const FRAMES_LEAST: f64 = 25.0;
/// Places at which full detail is timed beforehand, and times that each is drawn: the first one builds meshes.
const TRIALS: usize = 8;
const DRAWN: usize = 2;
/// How often the last picture is drawn again where times are measured.
const AGAIN: usize = 20;
/// PSNR reported for pictures that are alike to the bit, and its upper limit, dB.
pub(in super::super) const ALIKE_DB: f64 = 99.0;

/// A walk that has been played.
#[derive(Default)]
struct PlayedPath {
    adapter: String,
    frames: Vec<FrameRecord>,
    pictures: Vec<PictureFile>,
    /// Times of the last picture drawn again and again, milliseconds, where times are measured.
    again_ms: Vec<f64>,
}

/// Full detail of a scene in so many frames.
type Reference = (&'static str, usize, Times, Arc<PlayedPath>);

static REFERENCES: Mutex<Vec<Reference>> = Mutex::new(Vec::new());

/// A scene that policies are played on.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Shown<'a> {
    /// The key under which full detail is stored: scenes that look the same in full detail may share a name.
    pub(in super::super) name: &'static str,
    pub(in super::super) text: &'a str,
    /// Mean time of full detail over the target.
    pub(in super::super) times_over: f64,
}

impl<'a> Shown<'a> {
    fn opening(&self) -> Opening<'a> {
        Opening { name: self.name, text: self.text, changes: &[] }
    }
}

/// Measures the row of a case.
pub(in super::super) fn measure(shown: &Shown<'_>, case: &Case, times: Times) -> Row {
    let measured = reference(shown, case.frames, times).and_then(|full| {
        let target_s = 1e-3 * mean_ms(&full) / shown.times_over;
        let full_itself = case.policy == Policy::Full.name();
        let case = Case { frames: full.frames.len(), ..case.clone() };
        let own = if full_itself { Arc::clone(&full) } else { Arc::new(played(shown, &case, target_s, times)?) };
        Ok((full, own, target_s))
    });
    let (full, own, target_s) = measured.unwrap_or_else(|_| (Arc::default(), Arc::default(), f64::NAN));
    let target_ms = 1e3 * target_s;
    let pairs = own.pictures.iter().zip(&full.pictures);
    let likeness: Vec<_> =
        pairs.filter_map(|(a, b)| Some([ssim(a, b)?, flip(b, a)?, psnr_db(a, b)?.min(ALIKE_DB)])).collect();
    let column = |at: usize| likeness.iter().map(|row| row[at]).collect::<Vec<_>>();
    let pairs = own.frames.iter().zip(&full.frames);
    let frames: Vec<_> = pairs.map(|(row, full)| frame(row, full.frame_ms / target_ms, target_ms)).collect();
    let text = |of: &mut dyn Iterator<Item = String>| of.collect::<Vec<_>>().join(" ");
    Row {
        adapter: own.adapter.clone(),
        target_ms,
        spread95: deviation95(&own.again_ms),
        ssim: mean(&column(0)),
        ssim_least: within(&column(0), 0.0),
        flip: mean(&column(1)),
        psnr_db: mean(&column(2)),
        times: text(&mut frames.iter().map(|frame| format!("{:.3}", frame.time))),
        primitives: text(&mut own.frames.iter().map(|row| format!("{}/{}/{}", row.triangles, row.lines, row.points))),
        ..Row::of(&case.setting, case.policy, &[frames])
    }
}

fn mean_ms(played: &PlayedPath) -> f64 {
    played.frames.iter().map(|row| row.frame_ms).sum::<f64>() / played.frames.len() as f64
}

/// Full detail of a scene, played if it was not yet.
fn reference(shown: &Shown<'_>, frames: usize, times: Times) -> anyhow::Result<Arc<PlayedPath>> {
    let mut known = REFERENCES.lock().unwrap_or_else(PoisonError::into_inner);
    let here = |r: &&Reference| (r.0, r.1, r.2) == (shown.name, frames, times);
    if let Some((.., played)) = known.iter().find(here) {
        return Ok(Arc::clone(played));
    }
    let in_time = if times == Times::Measured { frames_in_time(shown, frames)? } else { frames };
    let case = Case::new(shown.name, Policy::Full.name(), in_time);
    // the target has no effect on full detail
    let full = Arc::new(played(shown, &case, 1.0, times)?);
    known.push((shown.name, frames, times, Arc::clone(&full)));
    Ok(full)
}

/// As many of these frames as can be played in the time of a play.
fn frames_in_time(shown: &Shown<'_>, frames: usize) -> anyhow::Result<usize> {
    let (_, mut fly_through) = opened(&shown.opening(), Times::Measured)?;
    fly_through.session().control().set_policy(Policy::Full);
    let mut sum_s = 0.0;
    for trial in 0..TRIALS {
        let mut draw = || fly_through.step(trial as f64 / TRIALS as f64);
        let drawn = (0..DRAWN).map(|_| draw()).collect::<Result<Vec<_>, _>>()?;
        sum_s += 1e-3 * drawn.last().map_or(0.0, |row| row.frame_ms);
    }
    let each_s = sum_s / TRIALS as f64;
    let most = (FULL_S / each_s).min(PLAY_S * shown.times_over / each_s).max(FRAMES_LEAST);
    // a cast of floats saturates
    Ok(frames.min(most as usize))
}

fn played(shown: &Shown<'_>, case: &Case, target_s: f64, times: Times) -> anyhow::Result<PlayedPath> {
    let (adapter, mut fly_through) = opened(&shown.opening(), times)?;
    let control = fly_through.session().control();
    control.set_target_hz(1.0 / target_s);
    control.set_policy(case.policy.parse().context("no such policy")?);
    let lead_in = if times == Times::Measured { MEASURED_LEAD_IN.min(case.frames).max(LEAD_IN) } else { LEAD_IN };
    for _ in 0..lead_in {
        fly_through.step(0.0)?;
    }
    let frames = Vec::with_capacity(case.frames);
    let mut played = PlayedPath { adapter, frames, pictures: Vec::new(), again_ms: Vec::new() };
    for frame in 0..case.frames {
        played.frames.push(fly_through.step(frame as f64 / case.frames as f64)?);
        if case.round == 0 && frame % case.frames.div_ceil(PICTURES).max(APART) == 0 {
            played.pictures.extend(fly_through.picture()?);
        }
    }
    if times == Times::Measured {
        played.again_ms = again(&mut fly_through, (case.frames - 1) as f64 / case.frames as f64)?;
    }
    Ok(played)
}

/// Times of the picture at a place of the path, drawn again and again with the levels that it has, milliseconds.
fn again(fly_through: &mut FlyThrough, part: f64) -> anyhow::Result<Vec<f64>> {
    fly_through.session().control().freeze(true);
    for _ in 0..SETTLED {
        fly_through.step(part)?;
    }
    (0..AGAIN).map(|_| Ok(fly_through.step(part)?.frame_ms)).collect()
}

/// Predicted time of one picture, and its time at each drawing, milliseconds.
pub(in super::super) struct Predicted {
    pub(in super::super) predicted_ms: f64,
    pub(in super::super) measured_ms: Vec<f64>,
}

/// Frames until a picture is final: meshes of levels drawn for the first time are built, and all transitions have ended.
const SETTLED: usize = 8;

/// A point of a scene's path, as a fraction 0 … 1 of it, and the target time of a frame there, seconds.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct PathPoint {
    pub(in super::super) part: f64,
    pub(in super::super) target_s: f64,
}

/// Pictures at points of a scene's path, predicted and chosen by `policy`, each drawn `drawings` times; and the adapter.
///
/// # Errors
/// Errors of the scene and of the adapter.
pub(in super::super) fn predicted(
    paper: Paper,
    policy: Policy,
    asked: &[PathPoint],
    drawings: usize,
) -> anyhow::Result<(String, Vec<Predicted>)> {
    let text = paper.text(&Choices::default());
    let (adapter, mut fly_through) =
        opened(&Opening { name: paper.name(), text: &text, changes: &[] }, Times::Measured)?;
    fly_through.session().control().set_policy(policy);
    for _ in 0..LEAD_IN {
        fly_through.step(0.0)?;
    }
    let mut pictures = Vec::with_capacity(asked.len());
    for PathPoint { part, target_s } in asked {
        fly_through.session().control().set_target_hz(1.0 / target_s);
        fly_through.step(*part)?;
        let predicted_ms = fly_through.step(*part)?.predicted_ms;
        fly_through.session().control().freeze(true);
        for _ in 2..SETTLED {
            fly_through.step(*part)?;
        }
        let measured: Result<Vec<_>, _> = (0..drawings).map(|_| fly_through.step(*part)).collect();
        fly_through.session().control().freeze(false);
        let measured_ms = measured?.iter().map(|record| record.frame_ms).collect();
        pictures.extend(predicted_ms.map(|predicted_ms| Predicted { predicted_ms, measured_ms }));
    }
    Ok((adapter, pictures))
}

/// A scene to be opened.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Opening<'a> {
    pub(in super::super) name: &'a str,
    pub(in super::super) text: &'a str,
    /// Keys of the scene and their values instead.
    pub(in super::super) changes: &'a [(&'static str, &'static str)],
}

/// Opens a scene before the first frame; also names the adapter that draws it.
pub(super) fn opened(scene: &Opening<'_>, times: Times) -> anyhow::Result<(String, FlyThrough)> {
    let is_preset = scene.changes.iter().any(|(key, _)| *key == "machine.preset");
    let declared = if times == Times::Declared { DECLARED.as_slice() } else { &[] };
    let prices = if times == Times::Declared && !is_preset { DECLARED_PRICES.as_slice() } else { &[] };
    // the policies of the papers are compared at one number of pixels
    let overrides: Vec<_> = [("target.render_scale", "1.0")]
        .iter()
        .chain(declared)
        .chain(prices)
        .chain(scene.changes)
        .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
        .collect();
    let scene = load(&Source::memory(scene.name, scene.text.as_bytes())?, &overrides)?;
    let gpu = match times {
        Times::Measured => Some(Gpu::headless()?),
        Times::Declared => Gpu::headless().ok(),
    };
    let adapter = gpu.as_ref().map(Gpu::describe).unwrap_or_default();
    let screen = |gpu: Gpu| {
        let options = RendererOptions::for_adapter(&gpu.info);
        Offscreen::new(gpu, SIZE, options).map(Box::new)
    };
    let drawing = match (gpu.map(screen).transpose()?, times) {
        (Some(screen), Times::Measured) => Drawing::Every(screen),
        (Some(screen), Times::Declared) => Drawing::Last(screen),
        (None, _) => Drawing::Nothing,
    };
    Ok((adapter, FlyThrough::open(scene, drawing, SIZE)?))
}
