//! The inputs of the choice of the picture's scale: the time of a frame without its levels, and of its pixels.
//!
//! In: the frame that was measured, its plan, prices. Out: the next picture's scale. Never here: the law ([`super::super::render_scale`]).
//! Theory: `docs/theory/control.md`, section 11.

use super::super::render_scale::{PictureRung, ScaledFrame};
use super::PictureControl;
use crate::control::demand::plan::{LevelDemand, SizedView, steers};
use crate::control::demand::policy::Policy;
use crate::control::demand::view::{Pieces, Shading};
use crate::control::prices::ladder::Rung;
use crate::control::prices::price::{Backdrop, Prices};

/// Levels that take less than this part of a frame above their least are as good as at their coarsest.
const LEVELS_LEAST: f64 = 0.05;

/// An object of the frame with all else at its coarsest.
#[derive(Debug, Clone, Copy)]
struct Coarsest {
    pieces: Option<Pieces>,
    shading: Shading,
    polygons: f64,
    /// Pixels that it covers at the present scale.
    pixels: f64,
}

impl PictureControl {
    /// Chooses the scale of the next picture by a frame of `work_s`, of which `drawn_s` were drawing.
    pub(super) fn observe_scale(&mut self, work_s: f64, drawn_s: f64) {
        if self.scale.is_fixed() || !self.policy.scales_pictures() {
            return;
        }
        if self.frozen {
            // the frozen picture says nothing of later ones
            return self.scale.disturb();
        }
        let prices = self.policy_prices();
        let here = self.scale.rung();
        let coarsest: Vec<_> = self.drawn().map(|(at, seen, level)| self.coarsest(at, seen, level)).collect();
        let backdrop = self.backdrop;
        let priced_s = |asked: PictureRung| {
            let part = asked.scale / here.scale;
            coarsest_s(
                &prices.with_shadows(asked.shadows),
                &coarsest,
                scaled(backdrop, here.scale, asked.scale),
                part * part,
            )
        };
        let drawn_by = prices.with_shadows(here.shadows);
        let levels_s: f64 = self.drawn().map(|(_, seen, level)| object_s(&drawn_by, seen, level)).sum();
        let (all_s, least_s) = (drawn_by.backdrop_s(backdrop) + levels_s, priced_s(here));
        // the time of levels above their least, by the prices and as fast as this frame was drawn
        let levels_s = if all_s > 0.0 { drawn_s * (1.0 - least_s / all_s).max(0.0) } else { 0.0 };
        let frame = ScaledFrame {
            coarsest_s: work_s - levels_s,
            draw_s: drawn_s - levels_s,
            spent: self.is_spent(levels_s / work_s),
            set_s: self.set_point_s().min(self.target_s()),
            period_s: 1.0 / self.target_hz,
        };
        self.scale.observe(frame, priced_s);
        if self.scale.rung().shadows != here.shadows {
            self.forget_ladders();
        }
    }

    /// Whether nothing but pixels is left to take; `levels` is the part of the frame that levels take above their least.
    fn is_spent(&self, levels: f64) -> bool {
        match self.policy {
            Policy::Feedback => self.feedback.is_coarsest() || !steers(&self.views),
            _ => !self.plan.promise.feasible || levels < LEVELS_LEAST,
        }
    }

    /// The objects that the frame was drawn with, their numbers and levels.
    fn drawn(&self) -> impl Iterator<Item = (usize, &SizedView, &LevelDemand)> {
        let all = self.views.iter().zip(&self.plan.levels).enumerate();
        all.filter(|(_, (seen, level))| seen.view.visible && level.polygons > 0.0)
            .map(|(at, (seen, level))| (at, seen, level))
    }

    /// An object at the first of its rungs; feedback, which has none, has it at its coarsest wherever that counts.
    fn coarsest(&self, at: usize, seen: &SizedView, level: &LevelDemand) -> Coarsest {
        let rung = self.ladders.get(at).and_then(|ladder| ladder.rungs.first()).filter(|_| self.policy.predicts());
        let (shading, polygons) = match rung {
            Some(Rung { shading, polygons, .. }) => (*shading, *polygons),
            None => (level.shading, level.polygons),
        };
        Coarsest { pieces: seen.view.pieces, shading, polygons, pixels: seen.view.pixels }
    }
}

fn object_s(prices: &Prices, seen: &SizedView, level: &LevelDemand) -> f64 {
    prices.pieces_s(seen.view.pieces, level.shading, level.polygons, seen.view.pixels)
}

/// The backdrop of a frame drawn at the scale `here`, drawn at another.
fn scaled(backdrop: Backdrop, here: f64, asked: f64) -> Backdrop {
    let full = backdrop.pixels / (here * here);
    let enlarged = if asked < 1.0 { full } else { 0.0 };
    Backdrop { pixels: asked * asked * full, enlarged, triangles: backdrop.triangles }
}

/// Time of drawing everything at its coarsest, each object on this `part` of its pixels, seconds.
fn coarsest_s(prices: &Prices, objects: &[Coarsest], backdrop: Backdrop, part: f64) -> f64 {
    let objects = objects.iter().map(|object| {
        let Coarsest { pieces, shading, polygons, pixels } = *object;
        prices.pieces_s(pieces, shading, polygons, part * pixels)
    });
    prices.backdrop_s(backdrop) + objects.fold(0.0, |sum, s| sum + s)
}
