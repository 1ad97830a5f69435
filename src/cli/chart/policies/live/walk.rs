//! One walk through a scene of the papers under one policy, drawn and compared with full detail.
//!
//! In: a play, a case. Out: a row; without an adapter that draws, one without frames. Never here: figures.
//! Full detail is drawn once for all policies of a play: its times give the target, its pictures what the others are held against.

use super::row::{Played, Row};
use super::{Case, Play};
use crate::compositor::{Gpu, Offscreen, PictureFile, RendererOptions, Size, psnr_db, ssim};
use crate::control::Policy;
use crate::frame::{FrameRecord, Walk};
use crate::scene::papers::{Choices, Paper};
use crate::scene::{Source, load};
use anyhow::Context;
use std::sync::{Arc, Mutex, PoisonError};

const SIZE: Size = Size { width: 640, height: 480 };
/// Every so many frames the picture is kept and compared.
const COMPARED: usize = 10;
/// Frames at the first place before the first that counts: pipelines, caches and prices are warm then, as after any start.
const LEAD_IN: usize = 20;
/// Where pictures are alike to the bit there is no noise to speak of, dB.
pub(super) const ALIKE_DB: f64 = 99.0;

/// A walk that has been drawn.
struct Walked {
    adapter: String,
    frames: Vec<FrameRecord>,
    pictures: Vec<PictureFile>,
}

/// Full detail of a scene in so many frames.
type Reference = (&'static str, usize, Arc<Walked>);

static REFERENCES: Mutex<Vec<Reference>> = Mutex::new(Vec::new());

/// The row of a case.
pub(super) fn measure(play: &Play, case: &Case) -> Row {
    let measured = reference(play, case.frames).and_then(|full| {
        let target_s = 1e-3 * mean_ms(&full) / play.times_over;
        let own = if case.policy == "full" { Arc::clone(&full) } else { Arc::new(walked(play, case, target_s)?) };
        Ok((full, own, target_s))
    });
    let (full, own, target_s) = measured.unwrap_or_else(|_| (nothing(), nothing(), f64::NAN));
    let pairs = own.pictures.iter().zip(&full.pictures);
    let likeness: Vec<_> = pairs.filter_map(|(a, b)| Some((ssim(a, b)?, psnr_db(a, b)?.min(ALIKE_DB)))).collect();
    let full_ms: Vec<f64> = full.frames.iter().map(|row| row.frame_ms).collect();
    Row::of(&Played {
        scene: play.paper.name(),
        policy: &case.policy,
        adapter: &own.adapter,
        target_ms: 1e3 * target_s,
        frames: &own.frames,
        full_ms: &full_ms,
        likeness: &likeness,
    })
}

fn nothing() -> Arc<Walked> {
    Arc::new(Walked { adapter: String::new(), frames: Vec::new(), pictures: Vec::new() })
}

fn mean_ms(walked: &Walked) -> f64 {
    walked.frames.iter().map(|row| row.frame_ms).sum::<f64>() / walked.frames.len() as f64
}

/// Full detail of a play, drawn where it was not yet.
fn reference(play: &Play, frames: usize) -> anyhow::Result<Arc<Walked>> {
    let mut known = REFERENCES.lock().unwrap_or_else(PoisonError::into_inner);
    let here = |r: &&Reference| (r.0, r.1) == (play.paper.name(), frames);
    if let Some((.., walked)) = known.iter().find(here) {
        return Ok(Arc::clone(walked));
    }
    // no target: full detail has none to miss
    let full = Arc::new(walked(play, &Case { policy: "full".to_owned(), frames }, 1.0)?);
    known.push((play.paper.name(), frames, Arc::clone(&full)));
    Ok(full)
}

fn walked(play: &Play, case: &Case, target_s: f64) -> anyhow::Result<Walked> {
    let (adapter, mut walk) = opened(play.paper)?;
    let control = walk.session().control();
    control.set_target_hz(1.0 / target_s);
    control.set_policy(Policy::named(&case.policy).context("no such policy")?);
    for _ in 0..LEAD_IN {
        walk.step(0.0)?;
    }
    let mut walked = Walked { adapter, frames: Vec::with_capacity(case.frames), pictures: Vec::new() };
    for frame in 0..case.frames {
        walked.frames.push(walk.step(frame as f64 / case.frames as f64)?);
        if frame % COMPARED == 0 {
            walked.pictures.push(walk.picture()?);
        }
    }
    Ok(walked)
}

/// What was foretold of one picture, and what it took each time it was drawn, milliseconds.
pub(super) struct Foretold {
    pub(super) told_ms: f64,
    pub(super) took_ms: Vec<f64>,
}

/// Frames until a picture is itself: meshes of levels that were never drawn are made, and all are at the end of their way.
const SETTLED: usize = 8;

/// Pictures at places of a scene's path under targets in seconds, as `policy` foretells and chooses them, each drawn several times; and
/// the adapter.
///
/// # Errors
/// Of the scene, of the adapter.
pub(super) fn predicted(
    paper: Paper,
    policy: Policy,
    (asked, times): (&[(f64, f64)], usize),
) -> anyhow::Result<(String, Vec<Foretold>)> {
    let (adapter, mut walk) = opened(paper)?;
    walk.session().control().set_policy(policy);
    for _ in 0..LEAD_IN {
        walk.step(0.0)?;
    }
    let mut pictures = Vec::with_capacity(asked.len());
    for (part, target_s) in asked {
        walk.session().control().set_target_hz(1.0 / target_s);
        walk.step(*part)?;
        let told = walk.step(*part)?.predicted_ms;
        walk.session().control().freeze(true);
        for _ in 2..SETTLED {
            walk.step(*part)?;
        }
        let took: Result<Vec<_>, _> = (0..times).map(|_| walk.step(*part)).collect();
        walk.session().control().freeze(false);
        let took_ms = took?.iter().map(|record| record.frame_ms).collect();
        pictures.extend(told.map(|told_ms| Foretold { told_ms, took_ms }));
    }
    Ok((adapter, pictures))
}

/// A scene of the papers before the first frame, and the adapter that draws it.
fn opened(paper: Paper) -> anyhow::Result<(String, Walk)> {
    let text = paper.text(&Choices::default());
    let scene = load(&Source::memory(paper.name(), text.as_bytes())?, &[])?;
    let gpu = Gpu::headless()?;
    let (adapter, options) = (gpu.describe(), RendererOptions::for_adapter(&gpu.info));
    Ok((adapter, Walk::open(scene, Offscreen::new(gpu, SIZE, options)?)?))
}

/// One view of a scene after a policy has come to rest on it.
pub(super) struct Still {
    pub(super) adapter: String,
    pub(super) target_s: f64,
    /// The median of the last frames.
    pub(super) frame_ms: f64,
    pub(super) triangles: u64,
    pub(super) picture: PictureFile,
}

/// Frames that are drawn of one view; the last half of them counts.
const STOOD: usize = 40;

/// Stands still at a part of a scene's path.
///
/// # Errors
/// Of the scene, of the adapter.
pub(super) fn still(paper: Paper, part: f64, policy: &str, target_s: f64) -> anyhow::Result<Still> {
    let (adapter, mut walk) = opened(paper)?;
    let control = walk.session().control();
    control.set_target_hz(1.0 / target_s);
    control.set_policy(Policy::named(policy).context("no such policy")?);
    let mut records = (0..STOOD).map(|_| walk.step(part)).collect::<Result<Vec<_>, _>>()?.split_off(STOOD / 2);
    let triangles = records.last().map_or(0, |row| row.triangles);
    records.sort_by(|a, b| a.frame_ms.total_cmp(&b.frame_ms));
    let frame_ms = records[records.len() / 2].frame_ms;
    Ok(Still { adapter, target_s, frame_ms, triangles, picture: walk.picture()? })
}
