//! Perceptual benefit of a level (FS93, §5), for shapes with levels and for shaded surfaces.
//!
//! In: an object as the camera sees it, triangles, a shading. Out: a weight for the object and an accuracy for the level; their product
//! is the benefit, in pixels. Never here: costs. Theory: `docs/theory/control.md`, eq. 20 … 22.

use super::ladder::Rung;
use crate::control::demand::view::{Kind, Losses, ObjectView, Shading};
use crate::cost::benefit;
use crate::cost::benefit::{BASE_ERROR, Picture, Sliders, size_worth};

/// Triangles of the coarsest closed surface, a tetrahedron: half of the covered pixels are drawn wrong.
const COARSEST: f64 = 4.0;

/// Loss of a textured object drawn without its texture where none was measured: a quarter of its pixels are assumed to be wrong.
const UNPAINTED: f64 = 0.25;

/// Every third object is assumed to have the edge of a shadow across it. Flat shading has one light for a polygon, so that those on the edge,
/// the root of all, are half wrong; the others are lit at every pixel.
const SHADOWED: f64 = 1.0 / 3.0;

/// Upper limit of covered pixels: no picture has more.
const PIXELS_MAX: f64 = 1e9;

/// Time over which motion blur is judged, seconds: a frame at 60 Hz.
const BLUR_S: f64 = 1.0 / 60.0;

/// Pixels covered by an object, 0 if not a valid number.
pub(crate) fn pixels(view: &ObjectView) -> f64 {
    if view.pixels > 0.0 { view.pixels.min(PIXELS_MAX) } else { 0.0 }
}

/// Benefit factor common to all levels of an object: size · importance · focus · motion (control.md, eq. 20).
pub(crate) fn weight(view: &ObjectView, sliders: &Sliders, polygon_px: f64) -> f64 {
    let importance = if view.importance > 0.0 { view.importance.min(1e6) } else { 0.0 };
    let blur = if view.speed_px_s > 0.0 { view.speed_px_s * BLUR_S / polygon_px } else { 0.0 };
    let off_centre = if view.off_centre.is_nan() { 1.0 } else { view.off_centre };
    let factors = [
        (importance, sliders.importance),
        ((1.0 - off_centre).clamp(0.0, 1.0), sliders.focus),
        // half of the benefit is lost at a motion of one polygon per frame
        (1.0 / (1.0 + blur), sliders.motion),
    ];
    let size = size_worth(pixels(view), sliders.size);
    factors.into_iter().fold(size, |all, (factor, slider)| all * (1.0 - slider * (1.0 - factor)).max(0.0))
}

/// Benefit of a level as printed (FS93, §5): accuracy by samples, motion by the size of the level's own polygons, and hysteresis by `change`,
/// the distance from the level of the frame before as a fraction of the ladder; pixels.
pub(crate) fn printed(view: &ObjectView, rung: &Rung, change: f64, sliders: &Sliders) -> f64 {
    let still = Sliders { motion: 0.0, ..*sliders };
    let covered = pixels(view);
    let polygon_px = libm::sqrt(covered / rung.polygons.max(1.0)).max(1e-3);
    let blur = if view.speed_px_s > 0.0 { (view.speed_px_s * BLUR_S / polygon_px).min(1.0) } else { 0.0 };
    let lost = [
        (1.0 - printed_accuracy(rung, view.shading.1, covered), sliders.accuracy),
        (blur, sliders.motion),
        (change.clamp(0.0, 1.0), sliders.hysteresis),
    ];
    lost.into_iter().fold(weight(view, &still, polygon_px), |all, (lost, slider)| all * (1.0 - slider * lost).max(0.0))
}

/// Accuracy = 1 − 0.5 / samples^m as printed: flat, samples are polygons and m = 1; Gouraud, vertices and m = 2. Light at every pixel, which
/// the paper has for ray tracing alone, interpolates normals between vertices: as Gouraud, with half the error.
fn printed_accuracy(rung: &Rung, best: Shading, pixels: f64) -> f64 {
    let vertices = 0.5 * rung.polygons + 2.0;
    let (samples, error) = match rung.shading {
        Shading::Flat => (rung.polygons, BASE_ERROR),
        Shading::Gouraud => (vertices, BASE_ERROR),
        Shading::PerPixel | Shading::Textured | Shading::Shadowed => (vertices, 0.5 * BASE_ERROR),
    };
    let samples = samples.min(pixels).max(1.0);
    let power = if rung.shading == Shading::Flat { samples } else { samples * samples };
    (1.0 - error / power) * painted(rung.shading, best, UNPAINTED)
}

/// The fraction of an object's pixels that a level draws correctly, 0 … 1: its shape by the triangles, its light by the shading
/// (control.md, eq. 21 and 22), relative to the best shading allowed; by what was measured to be lost, where it was.
pub(crate) fn accuracy(seen: &Seen, polygons: f64, shading: Shading) -> f64 {
    let Seen { kind, losses, best, pixels } = *seen;
    let lost = losses.map_or_else(|| 1.0 / samples(&kind, polygons, pixels), |losses| losses.of_form(polygons));
    let shape = 1.0 - BASE_ERROR * lost;
    let light = match shading {
        Shading::Flat => 1.0 - SHADOWED * BASE_ERROR / libm::sqrt(polygons.min(pixels).max(1.0)),
        Shading::Gouraud => {
            let vertices = 0.5 * polygons + 2.0;
            let picture = Picture { level: 0, polygons, vertices, shading: benefit::Shading::Gouraud };
            benefit::accuracy(pixels, &picture)
        }
        Shading::PerPixel | Shading::Textured | Shading::Shadowed => 1.0,
    };
    let unpainted = losses.map_or(UNPAINTED, |losses| f64::from(losses.texture));
    shape.max(0.0) * light * painted(shading, best, unpainted)
}

/// What the accuracy of a level depends on beside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub kind: Kind,
    pub losses: Option<Losses>,
    /// The best shading allowed.
    pub best: Shading,
    pub pixels: f64,
}

/// Triangles in units of the coarsest shape, ≥ 1 and never more than pixels.
fn samples(kind: &Kind, polygons: f64, pixels: f64) -> f64 {
    let (pieces, coarsest) = match *kind {
        // a tube counts as a row of balls of its length
        Kind::Tube { length_m, radius_m } => ((0.5 * length_m / radius_m).max(1.0), COARSEST),
        Kind::Primitive { .. } => (1.0, COARSEST),
        Kind::Counted { least, .. } | Kind::Group { impostors: [least, ..], .. } => (1.0, f64::from(least.max(1))),
    };
    (polygons / pieces / coarsest).min((pixels / pieces).max(1.0)).max(1.0)
}

/// The part of its benefit that a shading leaves to an object that has a texture, of which it loses `unpainted` without.
fn painted(shading: Shading, best: Shading, unpainted: f64) -> f64 {
    if best == Shading::Textured && shading < best { 1.0 - unpainted } else { 1.0 }
}
