//! Frames drawn differently from their choice: chosen while the frame before is drawn (GB99), or late before drawing starts.
//!
//! In: the objects in view now, then the objects in view when the frame is drawn. Out: the plan of that frame. Never
//! here: the drawing in between.
//! Theory: `docs/theory/control.md`, section 6.

use super::PictureControl;
use crate::control::choice::feedback::unseen;
use crate::control::demand::plan::{LevelDemand, SizedView};
use crate::control::demand::policy::Policy;
use crate::control::demand::query::{Promise, demand};
use crate::control::demand::view::ObjectView;

/// A choice that is not drawn yet.
#[derive(Debug, Clone, Default)]
pub(super) struct Ahead {
    levels: Vec<LevelDemand>,
    promise: Promise,
}

/// A frame is not used for learning if the predicted time of the choice is less than this fraction of the predicted time of the frame as
/// drawn, by the prices, or more than its inverse.
const LIKE: f64 = 0.5;

impl PictureControl {
    /// Chooses for the next frame while this one ([`PictureControl::last_plan`]) is drawn; frozen levels stay.
    pub fn plan_ahead(&mut self, objects: &[ObjectView]) {
        if self.frozen {
            return;
        }
        self.update_views(objects);
        let mut levels = self.ahead.take().map_or_else(Vec::new, |ahead| ahead.levels);
        levels.clear();
        let promise = self.choose(&mut levels);
        self.ahead = Some(Ahead { levels, promise });
    }

    /// Makes the choice made ahead the plan of this frame; `false` if there is none, or if it was for other objects.
    ///
    /// Objects that have come into view since are drawn at their coarsest with the cheapest shading: no time is reserved for them.
    pub fn take_up(&mut self, objects: &[ObjectView]) -> bool {
        let ours = |ahead: &Ahead| {
            let alike = ahead.levels.len() == objects.len() && self.views.len() == objects.len();
            alike && ahead.levels.iter().zip(objects).all(|(level, object)| level.id == object.id)
        };
        let Some(mut ahead) = self.ahead.take().filter(|ahead| ours(ahead) && !self.frozen) else { return false };
        let chosen_s = self.drawn_s(&ahead.levels);
        for ((known, object), level) in self.views.iter_mut().zip(objects).zip(&mut ahead.levels) {
            if object.visible && !known.view.visible {
                level.shading = object.shading.0;
                known.view.speed_px_s = object.speed_px_s;
            }
            let now = ObjectView { speed_px_s: known.view.speed_px_s, ..*object };
            if known.view != now {
                *known = SizedView::of(now);
            }
        }
        self.plan.levels = ahead.levels;
        self.plan.promise = ahead.promise;
        self.drawn_otherwise(chosen_s);
        self.adaptive.take_up();
        self.count();
        true
    }

    /// Draws everything in view in its lowest form: most of the frame's time is gone before drawing starts. Frozen levels stay, and an open
    /// group stays open.
    pub fn hurry(&mut self) {
        if self.frozen {
            return;
        }
        let chosen_s = self.drawn_s(&self.plan.levels);
        for (at, (SizedView { view, .. }, level)) in self.views.iter().zip(&mut self.plan.levels).enumerate() {
            if !(view.visible && level.polygons > 0.0) {
                continue;
            }
            *level = match self.ladders.get(at).and_then(|ladder| ladder.rungs.first()) {
                Some(coarsest) if view.is_group() => demand(at, &self.views, coarsest),
                _ => LevelDemand { shading: view.shading.0, ..unseen(view) },
            };
        }
        self.drawn_otherwise(chosen_s);
        let drawn = self.views.iter().zip(&self.plan.levels).filter(|(seen, _)| seen.view.visible);
        self.plan.polygons = drawn.map(|(_, level)| level.polygons).sum();
    }

    /// Updates the prediction after levels were changed from the choice, which was predicted to take `chosen_s` by the prices.
    fn drawn_otherwise(&mut self, chosen_s: f64) {
        let seen_s = self.drawn_s(&self.plan.levels);
        self.chosen_part = if seen_s > 0.0 { chosen_s / seen_s } else { 1.0 };
        let predicted_s = &mut self.plan.promise.predicted_s;
        if *predicted_s > 0.0 {
            let slower = if self.policy == Policy::Adaptive { self.adaptive.slowness() } else { 1.0 };
            *predicted_s = (*predicted_s + slower * (seen_s - chosen_s)).max(0.0);
        }
    }

    /// Whether the frame as drawn resembles the one that was chosen for.
    pub(super) fn is_as_chosen(&self) -> bool {
        (LIKE..=1.0 / LIKE).contains(&self.chosen_part)
    }

    /// Time of the objects in view at these levels by the prices, seconds.
    pub(super) fn drawn_s(&self, levels: &[LevelDemand]) -> f64 {
        let prices = self.picture_prices();
        prices.objects_s(self.views.iter().map(|seen| &seen.view), levels)
    }
}
