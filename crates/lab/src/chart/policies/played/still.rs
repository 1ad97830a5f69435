//! One place of a scene's path under one policy: a frame's numbers, and pictures of it.
//!
//! In: a scene, a policy, a target, the way to the place. Out: a [`Still`]; without pictures where no adapter can draw and times are declared.
//! Never here: sheets, rows.

use super::walk::{LEAD_IN, Opening, Times, opened};
use anyhow::Context;
use metachron_lod::control::Policy;
use metachron_render::{Camera, Colouring, PictureFile, Style};
use metachron_session::FlyThrough;

/// The subject of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) enum Sight {
    /// The view of the path's camera.
    Eye,
    /// The same, every object in the shade of its level: the darker, the finer.
    Levels,
    /// These shades seen from above, of the objects in view of the path's camera.
    Above(Above),
    /// The difference of [`Sight::Eye`] from full detail, brightened; nothing of its own is drawn for it.
    Difference,
}

/// A camera over the head of the path's, metres above it, that looks at the ground so many metres ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Above {
    pub(in super::super) height_m: f64,
    pub(in super::super) ahead_m: f64,
}

/// The frames before a picture: some at the beginning of a part of the path and then evenly along it, or all at one place, where the last half of them counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Approach {
    pub(in super::super) from: f64,
    pub(in super::super) to: f64,
    pub(in super::super) frames: usize,
}

/// A place of a scene under a policy.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct StillRequest<'a> {
    pub(in super::super) scene: Opening<'a>,
    pub(in super::super) policy: Policy,
    pub(in super::super) target_s: f64,
    pub(in super::super) approach: Approach,
    pub(in super::super) times: Times,
    pub(in super::super) sights: &'a [Sight],
}

/// The last frame at a place.
#[derive(Debug, Clone)]
pub(in super::super) struct Still {
    pub(in super::super) adapter: String,
    /// Median of the frames that count.
    pub(in super::super) frame_ms: f64,
    pub(in super::super) triangles: u64,
    /// Objects in view of which nothing is drawn.
    pub(in super::super) holes: u32,
    /// Groups that are drawn as one.
    pub(in super::super) impostors: usize,
    /// Objects in view that are drawn with a texture.
    pub(in super::super) textured: u32,
    /// The pictures that were asked for; none where nothing draws.
    pub(in super::super) pictures: Vec<(Sight, PictureFile)>,
}

/// Plays the frames of an approach.
///
/// # Errors
/// Errors of the scene and of the adapter.
pub(in super::super) fn still(request: &StillRequest<'_>) -> anyhow::Result<Still> {
    let Approach { from, to, frames } = request.approach;
    let (adapter, mut fly_through) = opened(&request.scene, request.times)?;
    let control = fly_through.session().control();
    control.set_target_hz(1.0 / request.target_s);
    control.set_policy(request.policy);
    if from != to {
        for _ in 0..LEAD_IN {
            fly_through.step(from)?;
        }
    }
    let part = |frame: usize| from + (to - from) * (frame + 1) as f64 / frames as f64;
    let mut records = (0..frames).map(|frame| fly_through.step(part(frame))).collect::<Result<Vec<_>, _>>()?;
    let last = *records.last().context("no frames")?;
    let mut counted = records.split_off(if from == to { frames / 2 } else { frames - 1 });
    counted.sort_by(|a, b| a.frame_ms.total_cmp(&b.frame_ms));
    let session = fly_through.session();
    let is_impostor: Vec<bool> = session.views().iter().map(|view| view.visible && view.is_group()).collect();
    let plan = session.control().last_plan();
    let impostors =
        is_impostor.iter().zip(&plan.levels).filter(|(group, level)| **group && level.polygons > 0.0).count();
    let with_sight = |sight: &Sight| Ok(drawn(&mut fly_through, *sight)?.map(|picture| (*sight, picture)));
    let pictures = request.sights.iter().map(with_sight).filter_map(Result::transpose);
    Ok(Still {
        adapter,
        frame_ms: counted[counted.len() / 2].frame_ms,
        triangles: last.triangles,
        holes: last.holes,
        impostors,
        textured: last.textured,
        pictures: pictures.collect::<anyhow::Result<_>>()?,
    })
}

impl Still {
    /// The picture of a sight.
    pub(in super::super) fn picture(&self, sight: Sight) -> Option<&PictureFile> {
        self.pictures.iter().find(|(of, _)| *of == sight).map(|(_, picture)| picture)
    }
}

fn drawn(fly_through: &mut FlyThrough, sight: Sight) -> anyhow::Result<Option<PictureFile>> {
    let levels = Style { colouring: Colouring::Detail, ..Style::default() };
    let eye = *fly_through.camera();
    Ok(match sight {
        Sight::Eye => fly_through.picture()?,
        Sight::Difference => None,
        Sight::Levels => fly_through.picture_of_levels(None, levels)?,
        Sight::Above(above) => fly_through.picture_of_levels(Some(&above.camera(&eye)), levels)?,
    })
}

impl Above {
    fn camera(&self, walker: &Camera) -> Camera {
        let eye_m = walker.eye();
        let ahead = walker.forward().with_z(0.0).normalize_or(glam::DVec3::X);
        let ground_m = (eye_m + ahead * self.ahead_m).with_z(0.0);
        Camera::looking(eye_m + glam::DVec3::Z * self.height_m, ground_m, walker.fov_y_rad)
    }
}
