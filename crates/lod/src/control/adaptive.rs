//! The default policy: spends every frame's time where it gains most, by prices that are corrected by measurements.
//!
//! In: ladders, groups, a time; measured frame times. Out: a rung or an impostor for everything in view, and a promise with its
//! certificate.
//! Never here: the law (`crate::adaptive` has it). Theory: `docs/theory/budget.md`, section 7; `docs/theory/control.md`, section
//! 6.

use super::groups::Groups;
use super::hierarchy::leave_out_members;
use super::impostors::ImpostorChoice;
use super::ladder::{Ladder, Rung};
use super::plan::LevelDemand;
use super::query::{Ask, Promise, TICKS, demand};
use super::status::Status;
use crate::Bound;
use crate::adaptive::{Adaptive, Offer, Plan, Settings, Time};
use metachron_core::AgentId;

/// A smaller relative change of a weight is ignored: weights fluctuate, and levels should not follow that.
const TREMBLE: f64 = 0.05;

/// The stage of `budget` used for drawing.
const DRAWING: usize = 0;

/// A frame whose time is this near to the promise, as a fraction of the target, is on target.
const ON_TARGET: f64 = 0.05;

/// The entry of an object in the law.
#[derive(Debug, Clone, Copy)]
struct Dish {
    id: AgentId,
    /// Version of the ladder last given to the law, 0 while the object is not there; and the number of its rungs.
    version: u64,
    rungs: usize,
    /// The weight last given to the law.
    weight: Option<f64>,
}

/// The choice that is being drawn.
#[derive(Debug, Clone, Copy, Default)]
struct Drawn {
    frame: u64,
    plan: Plan,
    fixed_s: f64,
}

/// The law and the objects given to it.
#[derive(Debug, Clone)]
pub(super) struct AdaptiveChoice {
    law: Adaptive,
    /// In the order in which the objects are given.
    dishes: Vec<Dish>,
    closing: ImpostorChoice,
    offers: Vec<Offer>,
    fixed_s: f64,
    /// Number of the last frame chosen for, as the law counts them.
    frame: u64,
    plan: Plan,
    /// The plan of the frame that is being drawn.
    drawn: Drawn,
    status: Status,
    kept: Settings,
}

impl Default for AdaptiveChoice {
    fn default() -> Self {
        let kept = Settings::default();
        Self {
            law: Adaptive::new(kept),
            dishes: Vec::new(),
            closing: ImpostorChoice::default(),
            offers: Vec::new(),
            fixed_s: 0.0,
            frame: 0,
            plan: Plan::default(),
            drawn: Drawn::default(),
            status: Status::Waiting,
            kept,
        }
    }
}

impl AdaptiveChoice {
    /// Chooses; `levels` has one entry per object.
    pub fn choose(&mut self, ask: &Ask<'_>, groups: &Groups, levels: &mut [LevelDemand]) -> Promise {
        self.set_margin(ask);
        self.closing.decide(ask, groups, self.plan.lambda, self.kappa());
        self.lay(ask, groups);
        self.fixed_s = ask.fixed_s;
        let time = Time { target: TICKS * ask.target_s, fixed: TICKS * ask.fixed_s };
        self.frame += 1;
        self.plan = self.law.choose(self.frame, time);
        self.serve(ask, levels);
        leave_out_members(ask, groups, levels);
        self.promise()
    }

    /// Marks the last choice as the one being drawn.
    pub fn take_up(&mut self) {
        self.drawn = Drawn { frame: self.frame, plan: self.plan, fixed_s: self.fixed_s };
    }

    /// Reports times of the frame that was drawn, seconds: `drawn_s` for drawing the choice, `work_s` in all, `others_s` reserved for
    /// others.
    pub fn observe(&mut self, drawn_s: f64, work_s: f64, others_s: f64, target_s: f64) {
        let Drawn { frame, plan, fixed_s } = self.drawn;
        self.law.observe(frame, DRAWING, TICKS * drawn_s);
        self.law.finished(frame, TICKS * work_s);
        let missing = (work_s + others_s) / target_s - plan.predicted / (TICKS * target_s);
        let spent_s = plan.predicted / TICKS - fixed_s;
        self.status = match () {
            () if !plan.feasible => Status::Clamped(Bound::Coarsest),
            () if missing.abs() > ON_TARGET => Status::Moving,
            () if plan.lambda == 0.0 => Status::Clamped(Bound::Finest),
            () if plan.budget / (TICKS * target_s) - spent_s / target_s > ON_TARGET => Status::BetweenLevels,
            () => Status::Settled,
        };
    }

    /// Reports an outside disturbance: measurements of the next few frames are ignored.
    pub fn disturb(&mut self) {
        self.law.disturb();
    }

    pub fn status(&self) -> Status {
        self.status
    }

    /// κ as planned with: how much slower the machine is than its prices.
    pub fn kappa(&self) -> f64 {
        self.law.planned_kappa(DRAWING)
    }

    /// Gain of one more second, in the unit of the objects' gains; 0 where everything is at its finest.
    pub fn lambda(&self) -> f64 {
        TICKS * self.plan.lambda
    }

    /// The fraction of the target that is left free now.
    pub fn margin(&self) -> f64 {
        self.law.margin()
    }

    fn set_margin(&mut self, ask: &Ask<'_>) {
        let hysteresis = Settings::default().hysteresis + ask.sliders.hysteresis;
        let wanted = Settings { margin: ask.margin, hysteresis, ..Settings::default() };
        if wanted != self.kept {
            self.kept = wanted;
            self.law.set_settings(wanted);
        }
    }

    /// Gives the objects in view to the law, and removes the others.
    fn lay(&mut self, ask: &Ask<'_>, groups: &Groups) {
        let same = self.dishes.len() == ask.views.len();
        if !same || self.dishes.iter().zip(ask.views).any(|(dish, seen)| dish.id != seen.view.id) {
            self.clear();
            self.dishes.extend(ask.views.iter().map(|seen| Dish {
                id: seen.view.id,
                version: 0,
                rungs: 0,
                weight: None,
            }));
        }
        for at in 0..self.dishes.len() {
            let within = groups.parent(at).is_some() && groups.is_within(at, |group| self.closing.is_closed(group));
            let (view, ladder) = (&ask.views[at].view, ask.ladders.of(at));
            let (rungs, weight) = match view.is_group() {
                false => (ladder.rungs.as_slice(), ask.weight(at)),
                true if self.closing.is_closed(at) => self.closing.impostors(ask, at),
                true => (&[][..], 0.0),
            };
            if within || !view.visible || rungs.is_empty() {
                self.take_off(at);
                continue;
            }
            self.put_on(at, ladder, rungs, weight);
        }
    }

    /// Offers the given rungs of a ladder: of a group, only its useful impostors.
    fn put_on(&mut self, at: usize, ladder: &Ladder, rungs: &[Rung], weight: f64) {
        let dish = &mut self.dishes[at];
        let id = u64::from(dish.id.0);
        if (dish.version, dish.rungs) != (ladder.version, rungs.len()) {
            self.offers.clear();
            self.offers.extend(rungs.iter().map(|rung| Offer { cost: TICKS * rung.cost_s, gain: rung.accuracy }));
            (dish.version, dish.rungs) = (ladder.version, rungs.len());
            self.law.set(id, DRAWING, false, &self.offers);
        }
        if dish.weight.is_none_or(|held| (weight - held).abs() > TREMBLE * held) {
            dish.weight = Some(weight);
            self.law.weigh(id, weight);
        }
    }

    fn take_off(&mut self, at: usize) {
        let dish = &mut self.dishes[at];
        if dish.version > 0 {
            self.law.remove(u64::from(dish.id.0));
            (dish.version, dish.weight) = (0, None);
        }
    }

    /// Removes everything from the law: prices have changed, or objects have come or gone.
    pub fn clear(&mut self) {
        (0..self.dishes.len()).for_each(|at| self.take_off(at));
        self.dishes.clear();
        self.closing = ImpostorChoice::default();
    }

    fn serve(&self, ask: &Ask<'_>, levels: &mut [LevelDemand]) {
        for (at, dish) in self.dishes.iter().enumerate().filter(|(_, dish)| dish.version > 0) {
            let ladder = ask.ladders.of(at);
            let level = self.law.level(u64::from(dish.id.0)).map_or(0, |level| level as usize);
            if let Some(rung) = ladder.rungs.get(level) {
                levels[at] = demand(at, ask.views, rung);
            }
        }
    }

    fn promise(&self) -> Promise {
        let Plan { feasible, budget, predicted, value, upper, .. } = self.plan;
        let seconds = |ticks: f64| ticks / TICKS;
        Promise { budget_s: seconds(budget), predicted_s: seconds(predicted), value, upper, feasible, holes: 0 }
    }
}
