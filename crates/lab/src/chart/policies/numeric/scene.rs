//! A scene in numbers: things with positions, sizes and levels, and the part of them that a camera sees.
//!
//! In: things and a camera. Out: for everything in view its pixels, its depth, and cost and gain of each of its levels.
//! Never here: policies ([`super::chooser`]), the deviation of frame times from the table ([`super::machine`]).

use glam::DVec3;
use metachron_lod::cost::benefit::{Picture, Shading, accuracy};
use metachron_lod::cost::stages::{Stages, Work};
use metachron_render::{Camera, Size};

/// The screen of the papers' machines.
pub(super) const SCREEN: Size = Size { width: 1280, height: 1024 };

/// The accuracy of a level, as a part of the best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum BenefitModel {
    /// From the samples of its shading (FS93, §5).
    Shaded(Shading),
    /// This part, 0 … 1, at any distance.
    Part(f64),
}

/// One level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ObjectLevel {
    /// Polygons, lines or points.
    pub(crate) polygons: f64,
    /// Index of the scene's rendering algorithm that draws it.
    pub(crate) algorithm: usize,
    pub(crate) worth: BenefitModel,
}

impl ObjectLevel {
    /// A half to the power of k/2 of so many triangles: the first of a progressive mesh.
    pub(crate) fn prefix(triangles: f64, k: i32) -> Self {
        let part = libm::exp2(-0.5 * f64::from(k));
        Self { polygons: part * triangles, algorithm: 0, worth: BenefitModel::Part(part.sqrt()) }
    }
}

/// A thing that can be drawn at several levels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SceneObject {
    pub(crate) centre_m: DVec3,
    pub(crate) radius_m: f64,
    /// Share of the disc around it that it covers, 0 … 1.
    pub(crate) fill: f64,
    /// Weight relative to the others, > 0.
    pub(crate) importance: f64,
    /// Time of its best form at one fixed area, for the order of (RH05).
    pub(crate) complexity: f64,
    /// Its levels, coarsest first.
    pub(crate) forms: Vec<ObjectLevel>,
}

/// Things, and the costs of drawing them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Scene {
    pub(crate) objects: Vec<SceneObject>,
    /// Costs of every rendering algorithm, microseconds.
    pub(crate) stages: Vec<Stages>,
}

/// A thing in view.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VisibleObject {
    /// Index among the scene's things.
    pub(crate) object: usize,
    /// Pixels it covers, including hidden parts.
    pub(crate) pixels: f64,
    /// Distance along the view and from the eye, metres.
    pub(crate) depth_m: f64,
    pub(super) distance_m: f64,
    /// Cost of each level, microseconds, and its gain per pixel at importance 1, coarsest first.
    pub(crate) levels: Vec<(f64, f64)>,
}

impl Scene {
    /// Everything that may be in the picture, in the order of the things.
    pub(crate) fn seen(&self, camera: &Camera) -> Vec<VisibleObject> {
        let view = camera.frustum(SCREEN);
        let in_view = |t: &&SceneObject| view.sees(t.centre_m, t.radius_m);
        self.objects
            .iter()
            .enumerate()
            .filter(|(_, t)| in_view(t))
            .map(|(i, t)| self.visible_object(camera, i, t))
            .collect()
    }

    fn visible_object(&self, camera: &Camera, object: usize, of: &SceneObject) -> VisibleObject {
        let from_eye = of.centre_m - camera.eye();
        let depth_m = from_eye.dot(camera.forward());
        // from inside the thing it is seen as from its surface
        let radius_px = of.radius_m * camera.pixels_per_metre(depth_m.max(of.radius_m), SCREEN);
        let pixels = (std::f64::consts::PI * radius_px * radius_px * of.fill).min(SCREEN.pixels());
        let levels = of.forms.iter().map(|f| (self.cost(f, 1.0, pixels), f.gain(1.0, pixels))).collect();
        VisibleObject { object, pixels, depth_m, distance_m: from_eye.length(), levels }
    }

    /// Cost of a part of a level, microseconds.
    pub(crate) fn cost(&self, form: &ObjectLevel, part: f64, pixels: f64) -> f64 {
        let polygons = part * form.polygons;
        // a closed mesh has half as many vertices as triangles
        self.stages[form.algorithm].time(Work { polygons, vertices: 0.5 * polygons, pixels })
    }

    /// Cost of everything in view at its finest level, microseconds.
    pub(crate) fn full(seen: &[VisibleObject]) -> f64 {
        seen.iter().filter_map(|s| s.levels.last()).map(|(cost, _)| cost).sum()
    }
}

impl ObjectLevel {
    /// Gain per pixel of a part of the level: the accuracy of a surface grows with the root of its samples (GB99).
    pub(crate) fn gain(&self, part: f64, pixels: f64) -> f64 {
        match self.worth {
            BenefitModel::Part(worth) => worth * libm::sqrt(part),
            BenefitModel::Shaded(shading) => {
                let (polygons, vertices) = (part * self.polygons, 0.5 * part * self.polygons);
                accuracy(pixels, &Picture { level: 0, polygons, vertices, shading })
            }
        }
    }
}
