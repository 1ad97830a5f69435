//! What the picture's scale is chosen by: the time of a frame without what levels take, and of its pixels.
//!
//! In: the frame that was measured, its plan, prices. Out: the next picture's scale. Never here: the law ([`super::super::render_scale`]).
//! Theory: `docs/theory/control.md`, section 11.

use super::super::ladder::Rung;
use super::super::plan::{LevelDemand, SizedView, steers};
use super::super::policy::Policy;
use super::super::price::{Backdrop, Prices};
use super::super::render_scale::ScaledFrame;
use super::super::view::Shading;
use super::PictureControl;

/// Levels that take less than this part of a frame above their least are as good as at their coarsest.
const LEVELS_LEAST: f64 = 0.05;

/// An object of the frame with all else at its coarsest.
#[derive(Debug, Clone, Copy)]
struct Coarsest {
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
            // what is drawn now says nothing of what will be
            return self.scale.disturb();
        }
        let prices = self.policy.prices(&self.prices);
        let here = self.scale.scale();
        let coarsest: Vec<_> = self.drawn().map(|(at, seen, level)| self.coarsest(at, seen, level)).collect();
        let backdrop = self.backdrop;
        let priced_s = |scale: f64| coarsest_s(&prices, &coarsest, backdrop, Scales { here, asked: scale });
        let levels_s: f64 = self.drawn().map(|(_, seen, level)| object_s(&prices, seen, level)).sum();
        let (all_s, least_s) = (prices.backdrop_s(backdrop) + levels_s, priced_s(here));
        // what levels take above their least, by the prices and as fast as this frame was drawn
        let levels_s = if all_s > 0.0 { drawn_s * (1.0 - least_s / all_s).max(0.0) } else { 0.0 };
        let frame = ScaledFrame {
            coarsest_s: work_s - levels_s,
            draw_s: drawn_s - levels_s,
            spent: self.is_spent(levels_s / work_s),
            set_s: self.set_point_s().min(self.target_s()),
            period_s: 1.0 / self.target_hz,
        };
        self.scale.observe(frame, priced_s);
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
        Coarsest { shading, polygons, pixels: seen.view.pixels }
    }
}

/// The scale of a frame, and another one.
#[derive(Debug, Clone, Copy)]
struct Scales {
    here: f64,
    asked: f64,
}

fn object_s(prices: &Prices, seen: &SizedView, level: &LevelDemand) -> f64 {
    prices.object_s(level.shading, level.polygons, seen.view.pixels)
}

/// Time of drawing everything at its coarsest at another scale than the frame's, seconds.
fn coarsest_s(prices: &Prices, objects: &[Coarsest], backdrop: Backdrop, Scales { here, asked }: Scales) -> f64 {
    let part = (asked / here) * (asked / here);
    let full = backdrop.pixels / (here * here);
    let backdrop = Backdrop {
        pixels: part * backdrop.pixels,
        enlarged: if asked < 1.0 { full } else { 0.0 },
        triangles: backdrop.triangles,
    };
    let objects = objects.iter().map(|object| prices.object_s(object.shading, object.polygons, part * object.pixels));
    prices.backdrop_s(backdrop) + objects.fold(0.0, |sum, s| sum + s)
}
