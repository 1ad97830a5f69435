//! Frames that are not drawn as they were just chosen: chosen for while the frame before was drawn (GB99), or late before anything is drawn.
//!
//! In: what is in view now, then what is in view when its turn has come. Out: the plan of that frame. Never here: who draws meanwhile.
//! Theory: `docs/theory/control.md`, section 6.

use super::super::ask::{Promise, demand};
use super::super::feedback::unseen;
use super::super::level::Span;
use super::super::plan::LevelDemand;
use super::super::policy::Policy;
use super::super::view::ObjectView;
use super::PictureControl;

/// A choice that nothing is drawn with yet.
#[derive(Debug, Clone, Default)]
pub(super) struct Ahead {
    levels: Vec<LevelDemand>,
    promise: Promise,
}

/// A frame teaches nothing where what was chosen for is less than this part of what is seen when it is drawn, by the prices, or more
/// than one over it.
const LIKE: f64 = 0.5;

impl PictureControl {
    /// Chooses for the next frame while this one, which [`PictureControl::last_plan`] tells of, is drawn; frozen levels stay.
    pub fn plan_ahead(&mut self, objects: &[ObjectView]) {
        if self.frozen {
            return;
        }
        self.look(objects);
        let mut levels = self.ahead.take().map_or_else(Vec::new, |ahead| ahead.levels);
        levels.clear();
        let promise = self.choose(&mut levels);
        self.ahead = Some(Ahead { levels, promise });
    }

    /// Makes what was chosen ahead the plan of this frame; `false` where nothing was, or for others than these objects.
    ///
    /// What has come into view since is drawn at its coarsest, shaded as cheaply as it may be: nobody has set time aside for it.
    pub fn take_up(&mut self, objects: &[ObjectView]) -> bool {
        let ours = |ahead: &Ahead| {
            let alike = ahead.levels.len() == objects.len() && self.views.len() == objects.len();
            alike && ahead.levels.iter().zip(objects).all(|(level, object)| level.id == object.id)
        };
        let Some(mut ahead) = self.ahead.take().filter(|ahead| ours(ahead) && !self.frozen) else { return false };
        let chosen_s = self.drawn_s(&ahead.levels);
        for (((known, span), object), level) in self.views.iter_mut().zip(objects).zip(&mut ahead.levels) {
            if object.visible && !known.visible {
                level.shading = object.shading.0;
                known.speed_px_s = object.speed_px_s;
            }
            let now = ObjectView { speed_px_s: known.speed_px_s, ..*object };
            if *known != now {
                (*known, *span) = (now, Span::of(&now));
            }
        }
        self.plan.levels = ahead.levels;
        self.plan.promise = ahead.promise;
        self.drawn_otherwise(chosen_s);
        self.adaptive.take_up();
        self.count();
        true
    }

    /// Draws all that is in view in its lowest form: most of the frame's time is gone before anything is drawn. What is frozen stays as it
    /// is, and a group that is open stays open.
    pub fn hurry(&mut self) {
        if self.frozen {
            return;
        }
        let chosen_s = self.drawn_s(&self.plan.levels);
        for (at, ((view, _), level)) in self.views.iter().zip(&mut self.plan.levels).enumerate() {
            if !(view.visible && level.polygons > 0.0) {
                continue;
            }
            *level = match self.ladders.get(at).and_then(|ladder| ladder.rungs.first()) {
                Some(coarsest) if view.is_group() => demand(at, &self.views, coarsest),
                _ => LevelDemand { shading: view.shading.0, ..unseen(view) },
            };
        }
        self.drawn_otherwise(chosen_s);
        let drawn = self.views.iter().zip(&self.plan.levels).filter(|((view, _), _)| view.visible);
        self.plan.polygons = drawn.map(|(_, level)| level.polygons).sum();
    }

    /// What is drawn is not what was chosen, which was to take `chosen_s` by the prices: tells what it is to take now.
    fn drawn_otherwise(&mut self, chosen_s: f64) {
        let seen_s = self.drawn_s(&self.plan.levels);
        self.chosen_part = if seen_s > 0.0 { chosen_s / seen_s } else { 1.0 };
        let predicted_s = &mut self.plan.promise.predicted_s;
        if *predicted_s > 0.0 {
            let slower = if self.policy == Policy::Adaptive { self.adaptive.kappa() } else { 1.0 };
            *predicted_s = (*predicted_s + slower * (seen_s - chosen_s)).max(0.0);
        }
    }

    /// Whether the frame that is drawn is much like the one that was chosen for.
    pub(super) fn is_as_chosen(&self) -> bool {
        (LIKE..=1.0 / LIKE).contains(&self.chosen_part)
    }

    /// What the objects in view take at these levels by the prices, seconds.
    fn drawn_s(&self, levels: &[LevelDemand]) -> f64 {
        let prices = self.policy.prices(&self.prices);
        prices.objects_s(self.views.iter().map(|(view, _)| view), levels)
    }
}
