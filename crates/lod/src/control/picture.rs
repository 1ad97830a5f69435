//! The controller of the picture: a level for every object in view, by the selected policy.
//!
//! In: the objects in view, then the time of the frame. Out: a [`Plan`]. Never here: drawing, measuring, a policy's own rule. A frame is
//! `plan`, draw, `observe`. Theory: `docs/theory/control.md`.

mod ahead;
mod scaled;
mod settings;
mod tubes;

use super::choice::adaptive::AdaptiveChoice;
use super::choice::feedback::{Feedback, POLYGONS_AT_ONE, unseen};
use super::choice::groups::Groups;
use super::choice::hierarchy::Hierarchy;
use super::choice::quality_boost::QualityBoost;
use super::choice::select::Select;
use super::choice::steady::{TwoFrames, Worth};
use super::choice::vanish::Vanish;
use super::demand::level;
use super::demand::plan::{FrameWork, LevelDemand, Plan, SizedView, in_view, steers};
use super::demand::policy::{Law, Policy};
use super::demand::query::{FrameQuery, PARTS_OF_A_PIXEL, Promise, left_out};
use super::demand::status::Status;
use super::demand::view::ObjectView;
use super::flicker::Changes;
use super::prices::benefit;
use super::prices::ladder::{Ladder, Ladders};
use super::prices::logic::{Logic, LogicBefore};
use super::prices::price::{Backdrop, Prices};
use super::prices::serial::SerialPart;
use super::render_scale::RenderScale;
use crate::adaptive::DEFAULT_MARGIN;
use crate::cost::benefit::GivenSliders;
use crate::cost::pipeline::Pipeline;
use crate::cost::value::Value;
use ahead::Ahead;
use metachron_core::{AgentId, Resolution};
use tubes::TubeLevels;

/// The share of a new measurement in the smoothed speed on the screen: about five frames of memory.
const SPEED_NEWS: f64 = 0.2;

/// A smaller change of a frame's fixed part, as a fraction of the target, is ignored: it fluctuates, and levels should not follow that.
const FIXED_TREMBLE: f64 = 0.01;

/// The levels n of tubes go by a mean over this long, seconds.
const N_MEMORY_S: f64 = 2.0;

/// The fraction of a frame that policies with a prediction leave free for a lag, which is a bound and not a goal: a camera that starts to move makes a frame 2.4 % longer than predicted.
const LAG_MARGIN: f64 = 0.03;

/// Chooses the level of every picture.
#[derive(Debug, Clone)]
pub struct PictureControl {
    policy: Policy,
    target_hz: f64,
    /// The fraction of a frame to be left free, if the user sets one.
    margin: Option<f64>,
    /// How much a factor counts in a benefit, where scene or user say.
    sliders: GivenSliders,
    value: Value,
    prices: Prices,
    /// The evidence of frames about z, and the z that they have taught.
    serial: SerialPart,
    learned_serial: Option<f64>,
    backdrop: Backdrop,
    frozen: bool,
    /// The rule for raising quality beyond the objects' requested ranges, if that is allowed.
    raise: Option<QualityBoost>,
    /// Time of a frame outside drawing.
    before: LogicBefore,
    /// Time of a frame that is spent whatever is chosen, seconds, as used for the last choice.
    fixed_s: f64,
    /// Time of the frame used by others, seconds.
    reserve_s: f64,
    /// The same plus the time reserved for choosing, as used for the last choice.
    others_s: f64,
    /// The bound of the lag and how it is shared, if the lag is bounded.
    pipeline: Option<Pipeline>,
    /// Culling time of the frame that is chosen for, seconds.
    cull_s: f64,
    feedback: Feedback,
    select: Select,
    hierarchy: Hierarchy,
    adaptive: AdaptiveChoice,
    scale: RenderScale,
    logic: Logic,
    ladders: Ladders,
    groups: Groups,
    vanish: Vanish,
    tubes: TubeLevels,
    changes: Changes,
    /// Speeds on the screen, smoothed, by object.
    speeds: Vec<(AgentId, Option<f64>)>,
    views: Vec<SizedView>,
    plan: Plan,
    /// The choice for the next frame, made while this one is drawn.
    ahead: Option<Ahead>,
    /// Predicted time of this frame's levels when they were chosen over their predicted time as seen now, both by the prices.
    chosen_part: f64,
}

impl PictureControl {
    /// A controller for `target_hz` frames a second (finite, > 0), which starts in the middle of its range.
    #[must_use]
    pub fn new(policy: Policy, law: Law, target_hz: f64) -> Self {
        Self {
            policy,
            target_hz,
            margin: None,
            sliders: GivenSliders::default(),
            value: Value::Plain,
            prices: Prices::default(),
            serial: SerialPart::default(),
            learned_serial: None,
            backdrop: Backdrop::default(),
            frozen: false,
            raise: None,
            before: LogicBefore::default(),
            fixed_s: 0.0,
            reserve_s: 0.0,
            others_s: 0.0,
            pipeline: None,
            cull_s: 0.0,
            feedback: Feedback::new(law),
            select: Select::default(),
            hierarchy: Hierarchy::default(),
            adaptive: AdaptiveChoice::default(),
            scale: RenderScale::default(),
            logic: Logic::default(),
            ladders: Ladders::default(),
            groups: Groups::default(),
            vanish: Vanish::default(),
            tubes: TubeLevels::default(),
            changes: Changes::default(),
            speeds: Vec::new(),
            views: Vec::new(),
            plan: Plan::default(),
            ahead: None,
            chosen_part: 1.0,
        }
    }

    /// Reports the time of the frame drawn by the last [`PictureControl::plan`].
    pub fn observe(&mut self, frame: FrameWork) {
        let (work_s, drawn_s) = (frame.work.as_secs_f64(), frame.draw.min(frame.work).as_secs_f64());
        if frame.skip {
            self.adaptive.disturb();
            self.scale.disturb();
        }
        if frame.skip || work_s <= 0.0 {
            return;
        }
        self.before.observe(in_view(&self.views).count(), work_s - drawn_s);
        let target_s = self.target_s();
        // by the prices that the frame was drawn with: its scale and shadows may change now
        let (backdrop_s, objects_s) =
            (self.picture_prices().backdrop_s(self.backdrop), self.drawn_s(&self.plan.levels));
        self.observe_scale(work_s, drawn_s);
        if self.policy.predicts() {
            self.logic.observe(frame.beside.as_secs_f64(), backdrop_s + objects_s, drawn_s);
        }
        if !steers(&self.views) {
            return;
        }
        match self.policy {
            // pixels come back before levels
            Policy::Feedback if self.scale.is_reduced() && work_s <= self.set_point_s() => {}
            Policy::Feedback => self.feedback.observe(work_s, self.target_hz, self.plan.polygons),
            Policy::Threshold => self.select.observe(work_s, target_s),
            Policy::Adaptive if self.is_as_chosen() => {
                let drawn_s = (drawn_s - backdrop_s).max(0.0);
                if self.adaptive.observe(self.chosen_part * drawn_s, work_s, self.others_s, target_s) {
                    self.learn_serial(drawn_s, target_s);
                }
            }
            _ => {}
        }
    }

    /// Learns from a frame whose objects took `drawn_s` how much of the faster stage of drawing the slower hides.
    fn learn_serial(&mut self, drawn_s: f64, target_s: f64) {
        let prices = self.picture_prices();
        let Some(held) = prices.serial() else { return };
        let objects_s = |prices: Prices| prices.objects_s(self.views.iter().map(|seen| &seen.view), &self.plan.levels);
        let ends = [0.0, 1.0].map(|serial| objects_s(prices.with_serial(serial)) / target_s);
        let Some(learned) = self.serial.observe(ends, drawn_s / target_s, held) else { return };
        self.adaptive.replace_prices(learned.estimator, self.chosen_part * objects_s(prices));
        self.learned_serial = Some(learned.serial);
        self.ladders.clear();
    }

    /// Chooses the level of every object for the next frame.
    pub fn plan(&mut self, objects: &[ObjectView]) -> &Plan {
        self.update_views(objects);
        let same = self.plan.levels.len() == objects.len();
        if self.frozen && same && self.plan.levels.iter().zip(objects).all(|(level, object)| level.id == object.id) {
            self.count();
            return &self.plan;
        }
        let mut levels = std::mem::take(&mut self.plan.levels);
        levels.clear();
        self.plan.promise = self.choose(&mut levels);
        self.plan.levels = levels;
        (self.ahead, self.chosen_part) = (None, 1.0);
        self.adaptive.take_up();
        self.count();
        &self.plan
    }

    fn choose(&mut self, levels: &mut Vec<LevelDemand>) -> Promise {
        let mut promise = Promise { feasible: true, ..Promise::default() };
        match self.policy {
            Policy::Full => self.plan_full(levels),
            Policy::Feedback => self.feedback.plan(&self.views, levels),
            _ => {
                levels.extend(self.views.iter().map(|seen| unseen(&seen.view)));
                promise = self.choose_by_cost(levels);
            }
        }
        // the printed law has an n of its own, full detail the finest
        let own_n = self.policy == Policy::Full
            || self.policy == Policy::Feedback && matches!(self.feedback.law(), Law::Printed { .. });
        if !own_n {
            self.tubes.hold(&self.views, levels, N_MEMORY_S * self.target_hz);
        }
        promise
    }

    /// Target time of a frame: its share of a second, or the lag if that is less.
    fn target_s(&self) -> f64 {
        self.pipeline.map_or(f64::INFINITY, |pipeline| pipeline.lag).min(1.0 / self.target_hz)
    }

    /// The fraction of a frame that is left free by policies with a prediction.
    fn margin_now(&self) -> f64 {
        let bound = self.pipeline.is_some_and(|pipeline| pipeline.lag * self.target_hz < 1.0);
        self.margin.unwrap_or(if bound { LAG_MARGIN } else { DEFAULT_MARGIN })
    }

    fn choose_by_cost(&mut self, levels: &mut [LevelDemand]) -> Promise {
        let (raised, prices) = (self.raise.is_some_and(|raise| raise.is_open()), self.picture_prices());
        let sliders = self.sliders();
        self.ladders.update(&self.views, raised, &prices, &sliders);
        self.groups.update(if self.policy.chooses_groups() { &self.views } else { &[] });
        let (target_s, overhead_s) = (self.target_s(), self.before.seconds(in_view(&self.views).count()));
        let split = self.pipeline.map(|pipeline| Pipeline { lag: target_s, ..pipeline }.split(self.cull_s));
        let kept_s = split.map_or(0.0, |split| target_s - split.draw - overhead_s);
        self.others_s = self.reserve_s + kept_s;
        // the default policy is corrected by frames in which that time is already gone
        let beside_s = match self.policy {
            Policy::Adaptive => 0.0,
            _ => self.logic.lost_s(target_s * (1.0 - self.margin_now()) - overhead_s - self.others_s),
        };
        let fixed_s = prices.backdrop_s(self.backdrop) + overhead_s + self.others_s + beside_s;
        if (fixed_s - self.fixed_s).abs() > FIXED_TREMBLE * target_s {
            self.fixed_s = fixed_s;
        }
        let query = FrameQuery {
            views: &self.views,
            ladders: &self.ladders,
            sliders: &sliders,
            value: self.value,
            target_s,
            choose_s: split.map(|split| split.choose),
            margin: self.margin_now(),
            fixed_s: self.fixed_s,
            reserve_s: self.reserve_s,
            spend_rest: self.raise.is_some(),
            out: &[],
        };
        // the default knows how slow the machine is, and keeps more time free where it wanders
        let (slowness, margin) = match self.policy {
            Policy::Adaptive => (self.adaptive.slowness(), self.adaptive.margin().max(query.margin)),
            _ => (1.0, query.margin),
        };
        // policies that choose by size or by the last frame's time leave nothing out for a cost, and those as printed choose it as a level
        if self.policy.predicts() && !self.policy.has_printed_benefit() {
            self.vanish.update(&FrameQuery { margin, ..query }, &self.groups, slowness);
        } else {
            self.vanish.clear();
        }
        let query = FrameQuery { out: self.vanish.out(), ..query };
        let mut promise = match self.policy {
            Policy::Adaptive => self.adaptive.choose(&query, &self.groups, levels),
            Policy::Hierarchical | Policy::HierarchicalFlat | Policy::MacielShirley => {
                self.hierarchy.choose(self.policy, &query, &self.groups, levels)
            }
            policy => self.select.choose(policy, &query, levels),
        };
        self.keep_levels(&query, &prices, levels, &mut promise);
        for (at, _) in query.out.iter().enumerate().filter(|(_, out)| **out) {
            levels[at] = left_out(at, query.views, query.ladders.of(at));
            promise.holes += 1;
            promise.upper = 0.0; // the bound is over choices without this object
        }
        if let (Policy::Adaptive | Policy::RobinHood, Some(raise)) = (self.policy, &mut self.raise) {
            raise.observe(&query, levels, &promise, self.policy);
        }
        // time reserved for others is not spent by the frame
        promise.predicted_s = (promise.predicted_s - self.others_s).max(0.0);
        promise
    }

    /// Lets levels of the frame before stay; the default policy does that in its own choice.
    fn keep_levels(&self, query: &FrameQuery<'_>, prices: &Prices, levels: &mut [LevelDemand], promise: &mut Promise) {
        if !self.policy.predicts() || self.policy == Policy::Adaptive {
            return;
        }
        let most_px = |at: usize| match query.views[at].view.is_group() {
            true => self.hierarchy.worth(at),
            false => query.weight(at),
        };
        let of = |at: usize, level: &LevelDemand| {
            let (SizedView { view, span }, ladder) = (&query.views[at], query.ladders.of(at));
            let rung = ladder.rung_of(level, prices, query.sliders);
            match self.policy {
                Policy::Convex | Policy::ConvexBarrier => {
                    [ladder.line.at(level.polygons), most_px(at) * libm::sqrt(level.polygons / span.full)]
                }
                printed if printed.has_printed_benefit() => {
                    [rung.cost_s, benefit::printed(view, &rung, 0.0, query.sliders)]
                }
                _ => [rung.cost_s, most_px(at) * rung.accuracy],
            }
        };
        let parts = match self.policy {
            Policy::Convex | Policy::ConvexBarrier | Policy::RobinHood => 1.0,
            _ => PARTS_OF_A_PIXEL,
        };
        let frames = TwoFrames { query, groups: &self.groups, changes: &self.changes };
        frames.keep_levels(&Worth { of: &of, most_px: &most_px, parts }, levels, promise);
    }

    /// The plan of the last frame.
    #[must_use]
    pub fn last_plan(&self) -> &Plan {
        &self.plan
    }

    /// Stores the objects in view with their polygon ranges and smoothed speeds.
    fn update_views(&mut self, objects: &[ObjectView]) {
        self.views.truncate(objects.len());
        self.speeds.resize(objects.len(), (AgentId(0), None));
        for (at, (object, (of, held))) in objects.iter().zip(&mut self.speeds).enumerate() {
            // an unchanged object that stays out of view has no speed, and its polygon range stays
            if !object.visible && held.is_none() && self.views.get(at).is_some_and(|known| known.view == *object) {
                continue;
            }
            let mut view = *object;
            if *of != view.id || !view.visible {
                (*of, *held) = (view.id, None);
            }
            if view.visible {
                let now = if view.speed_px_s.is_finite() { view.speed_px_s.max(0.0) } else { 0.0 };
                view.speed_px_s = held.map_or(now, |before| before + SPEED_NEWS * (now - before));
                *held = Some(view.speed_px_s);
            }
            match self.views.get_mut(at) {
                Some(place) => *place = SizedView::of(view),
                None => self.views.push(SizedView::of(view)),
            }
        }
    }

    /// Updates the totals of the plan.
    fn count(&mut self) {
        let drawn = self.views.iter().zip(&self.plan.levels).filter(|(seen, _)| seen.view.visible);
        self.plan.polygons = drawn.map(|(_, level)| level.polygons).sum();
        self.plan.full_polygons = in_view(&self.views).map(|seen| seen.span.full).sum();
        (self.plan.changes, self.plan.reversals) = self.changes.count(&self.views, &self.plan.levels);
    }

    fn plan_full(&self, levels: &mut Vec<LevelDemand>) {
        levels.extend(self.views.iter().map(|SizedView { view, span }| {
            let n = if view.is_group() { level::open(view) } else { view.range.n.1 };
            let resolution = Resolution { eps_m: view.range.eps_m.0, n };
            LevelDemand { id: view.id, resolution, polygons: span.full, shading: view.shading.1 }
        }));
    }

    /// Time that the default policy would take of a frame without competition, seconds, and the gain of one more
    /// second, pixels: 0 if it has all it can use, also where others leave less time than the scatter of frames makes
    /// it leave free. `None` for policies without a price.
    #[must_use]
    pub fn wants(&self) -> Option<(f64, f64)> {
        if self.policy != Policy::Adaptive || self.plan.levels.is_empty() {
            return None;
        }
        let lambda = self.adaptive.lambda();
        let all_s = (1.0 - self.adaptive.margin()) * self.target_s();
        Some((if lambda > 0.0 { all_s } else { self.plan.promise.predicted_s }, lambda))
    }

    /// The benefit of object `at` in the last choice at an accuracy of 1, pixels; 0 if unknown.
    #[must_use]
    pub fn weight(&self, at: usize) -> f64 {
        let Some(seen) = self.views.get(at) else { return 0.0 };
        let weight = |ladder: &Ladder| benefit::weight(&seen.view, &self.sliders(), ladder.polygon_px());
        self.ladders.get(at).map_or(0.0, weight)
    }

    /// The state of the controller; its text is for the viewer and the report.
    #[must_use]
    pub fn status(&self) -> Status {
        match self.policy {
            Policy::Full => Status::Full,
            _ if !steers(&self.views) && in_view(&self.views).next().is_some() => Status::Fixed,
            Policy::Feedback if self.feedback.is_coarsest() && self.scale.helps() => Status::Reduced,
            Policy::Feedback => self.feedback.status(),
            Policy::Adaptive => self.adaptive.status(),
            _ => Status::of_promise(&self.plan.promise),
        }
    }

    /// The loop variable ε̂: for feedback that of its law, for other policies 480 over the polygons in view.
    #[must_use]
    pub fn eps_hat(&self) -> f64 {
        match self.policy {
            Policy::Feedback => self.feedback.eps_hat(),
            _ => POLYGONS_AT_ONE / self.plan.polygons.max(1.0),
        }
    }

    /// Target work of a frame, seconds: T_set = (1 − margin)/target.
    #[must_use]
    pub fn set_point_s(&self) -> f64 {
        let share = match self.policy {
            Policy::Feedback => self.law().set_share(),
            Policy::Adaptive => 1.0 - self.adaptive.margin(),
            _ => 1.0 - self.margin_now(),
        };
        share / self.target_hz
    }

    /// The policy in use.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.policy
    }

    /// The law in use.
    #[must_use]
    pub fn law(&self) -> Law {
        self.feedback.law()
    }

    /// The target frame rate, frames per second.
    #[must_use]
    pub fn target_hz(&self) -> f64 {
        self.target_hz
    }
}

#[cfg(test)]
mod tests;
