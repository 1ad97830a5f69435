//! The settings of the picture's controller.
//!
//! In: policies, laws, rates, prices, bounds. Out: a [`PictureControl`] that obeys them from the next frame on. Never here: a choice.

use super::super::render_scale::PictureRung;
use super::PictureControl;
use crate::control::choice::quality_boost::QualityBoost;
use crate::control::demand::policy::{Law, Policy, prices, usual_sliders};
use crate::control::flicker::Changes;
use crate::control::prices::price::{Backdrop, Prices};
use crate::control::prices::serial::SerialPart;
use crate::cost::benefit::{GivenSliders, Sliders};
use crate::cost::pipeline::Pipeline;
use crate::cost::value::Value;
use std::time::Duration;

/// Least part of the faster stage that is taken to show.
const SERIAL_LEAST: f64 = 1.0 / 64.0;

impl PictureControl {
    /// Changes the policy. The loop continues from the present picture.
    pub fn set_policy(&mut self, policy: Policy) {
        if policy != self.policy {
            self.ahead = None;
            let before = (prices(self.policy, &self.prices), self.sliders());
            self.policy = policy;
            if (prices(self.policy, &self.prices), self.sliders()) != before {
                self.forget_ladders();
            }
            self.raise = self.raise.map(|_| QualityBoost::default());
            self.scale.release();
            // another policy may draw groups where this one drew their members
            self.changes = Changes::default();
            self.take_over();
        }
    }

    /// Changes the law or its gains. Another law continues from the present picture.
    pub fn set_law(&mut self, law: Law) {
        let other = std::mem::discriminant(&law) != std::mem::discriminant(&self.feedback.law());
        self.feedback.set_law(law);
        if other {
            self.take_over();
        }
    }

    /// Changes the target frame rate: frames per second, finite, > 0. Anything else is ignored.
    pub fn set_target_hz(&mut self, target_hz: f64) {
        if target_hz.is_finite() && target_hz > 0.0 {
            self.target_hz = target_hz;
        }
    }

    /// Changes the fraction of a frame that policies with a prediction leave free, 0 … 0.9; feedback has its own in its law.
    pub fn set_margin(&mut self, margin: f64) {
        self.margin = margin.is_finite().then(|| margin.clamp(0.0, 0.9));
    }

    /// Changes how much factors count in the benefit of a level; sliders that are not set follow the policy.
    pub fn set_sliders(&mut self, given: impl Into<GivenSliders>) {
        let before = self.sliders();
        self.sliders = given.into();
        if self.sliders() != before {
            self.forget_ladders();
        }
    }

    /// The sliders that are set.
    #[must_use]
    pub fn given_sliders(&self) -> GivenSliders {
        self.sliders
    }

    /// How much each factor counts in the benefit of a level.
    #[must_use]
    pub fn sliders(&self) -> Sliders {
        self.sliders.over(usual_sliders(self.policy))
    }

    /// Changes the value formula of Robin Hood.
    pub fn set_value(&mut self, value: Value) {
        self.value = value;
    }

    /// Changes the assumed cost of drawing.
    pub fn set_prices(&mut self, prices: Prices) {
        let prices = prices.sound();
        if prices != self.prices {
            self.prices = prices;
            (self.serial, self.learned_serial) = (SerialPart::default(), None);
            self.forget_ladders();
        }
    }

    /// The assumed cost of drawing.
    #[must_use]
    pub fn prices(&self) -> &Prices {
        &self.prices
    }

    /// Sets the part of the next picture that is independent of the choice.
    pub fn set_backdrop(&mut self, backdrop: Backdrop) {
        self.backdrop = backdrop;
    }

    /// Bounds the time from reading the camera to the finished picture (finite, > 0; else there is no bound): of the time left after
    /// culling, `share` (0 … 1) is reserved for choosing, which runs in parallel with the drawing of the frame before, and the rest is for
    /// drawing (GB99). Policies without a prediction ignore it.
    pub fn set_lag(&mut self, lag_s: f64, share: f64) {
        self.pipeline = (lag_s.is_finite() && lag_s > 0.0).then_some(Pipeline { lag: lag_s, share, overlapped: true });
    }

    /// Sets the culling time of the frame that is chosen for next; used only if the lag is bounded.
    pub fn set_cull(&mut self, took: Duration) {
        self.cull_s = took.as_secs_f64();
    }

    /// Reserves this many seconds of every frame for others from the next choice on: finite, ≥ 0; anything else is none.
    pub fn set_reserve(&mut self, seconds: f64) {
        self.reserve_s = if seconds.is_finite() { seconds.max(0.0) } else { 0.0 };
    }

    /// Bounds the fraction of its width and height that a picture is drawn with: least and most, 0.35 … 1. Initially every pixel is drawn.
    pub fn set_render_scale(&mut self, range: (f64, f64)) {
        self.scale.bound(range);
    }

    /// Says whether the light throws shadows: only then can they be taken from a picture. Initially it does.
    pub fn set_throws_shadows(&mut self, throws: bool) {
        if throws != self.scale.most().shadows {
            self.scale.set_throws_shadows(throws);
            self.forget_ladders();
        }
    }

    /// The bounds of that fraction.
    #[must_use]
    pub fn render_scale_range(&self) -> (f64, f64) {
        self.scale.bounds()
    }

    /// The fraction of its width and height to draw the next picture with. Views and pixels given to the controller are
    /// the smaller picture's.
    #[must_use]
    pub fn render_scale(&self) -> f64 {
        self.rung().scale
    }

    /// Whether objects throw shadows in the next picture.
    #[must_use]
    pub fn shadows(&self) -> bool {
        self.rung().shadows
    }

    /// Prices of the next picture, as the policy reckons with them.
    pub(super) fn picture_prices(&self) -> Prices {
        self.policy_prices().with_shadows(self.shadows())
    }

    /// Prices of a picture with shadows, as the policy reckons with them: the default knows that no triangle is quite hidden, so that of levels
    /// that cost the same the coarsest is the cheapest, and learns how much is.
    pub(super) fn policy_prices(&self) -> Prices {
        let known = prices(self.policy, &self.prices);
        match (self.policy, known.serial()) {
            (Policy::Adaptive, Some(serial)) => {
                known.with_serial(self.learned_serial.unwrap_or(serial).max(SERIAL_LEAST))
            }
            _ => known,
        }
    }

    fn rung(&self) -> PictureRung {
        if self.policy.scales_pictures() { self.scale.rung() } else { self.scale.most() }
    }

    /// Freezes all levels, or releases them; objects that come or go are an exception.
    pub fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    /// Whether the default policy and Robin Hood may spend time on smoother shapes and softer shadows once everything has its requested
    /// range; initially they may not.
    pub fn set_raise(&mut self, raise: bool) {
        self.raise = raise.then(QualityBoost::default);
    }

    /// Whether levels are frozen.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    pub(super) fn forget_ladders(&mut self) {
        self.ladders.clear();
        self.adaptive.clear();
    }

    /// Sets the laws to the state of the last plan.
    fn take_over(&mut self) {
        self.feedback.take_over(&self.views, &self.plan.levels, self.plan.polygons);
    }

    /// Multiplies the scene's ε̂ by `factor` (finite, > 0; above 1 is coarser), as far as the ranges allow: another start, or a
    /// disturbance. Only feedback has such a state.
    pub fn coarsen(&mut self, factor: f64) {
        if factor.is_finite() && factor > 0.0 {
            self.feedback.coarsen(factor);
        }
    }

    /// Sets a place in the range of the objects in view: `share` 0 is the finest, 1 the coarsest, by ln ε̂ of the corrected law. For
    /// experiments; without effect before anything was in view, when the middle is used.
    pub fn seek(&mut self, share: f64) {
        self.feedback.seek(share);
    }
}
