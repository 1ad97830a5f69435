//! The default policy: spends every frame's time where it gains most, by prices that are corrected by measurements.
//!
//! In: ladders, groups, a time; measured frame times. Out: a rung or an impostor for everything in view, and a promise with its
//! certificate.
//! Never here: the law (`crate::adaptive` has it). Theory: `docs/theory/budget.md`, section 7; `docs/theory/control.md`, section
//! 6.

use super::groups::{Groups, Impostors};
use super::hierarchy::{leave_out_members, upper};
use super::impostors::ImpostorChoice;
use crate::Bound;
use crate::adaptive::{Adaptive, FilterUpdate, Offer, Plan, Settings, SpeedEstimator, Time};
use crate::control::demand::plan::LevelDemand;
use crate::control::demand::query::{FrameQuery, Promise, TICKS, demand};
use crate::control::demand::status::Status;
use crate::control::prices::ladder::{Ladder, Rung};
use metachron_core::AgentId;

/// A smaller relative change of a weight is ignored: weights fluctuate, and levels should not follow that.
const WEIGHT_DEADBAND: f64 = 0.05;

/// The stage of `budget` used for drawing.
const DRAWING: usize = 0;

/// A frame whose time is this near to the promise, as a fraction of the target, is on target.
const ON_TARGET: f64 = 0.05;

/// The entry of an object in the law.
#[derive(Debug, Clone, Copy)]
struct ObjectEntry {
    id: AgentId,
    /// Version of the ladder last given to the law, 0 while the object is not there; and the number of its rungs.
    version: u64,
    rungs: usize,
    /// The weight last given to the law.
    weight: Option<f64>,
}

/// The choice that is being drawn.
#[derive(Debug, Clone, Copy, Default)]
struct DrawnChoice {
    frame: u64,
    plan: Plan,
    fixed_s: f64,
    reserve_s: f64,
    slowness: f64,
}

/// The law and the objects given to it.
#[derive(Debug, Clone)]
pub(crate) struct AdaptiveChoice {
    law: Adaptive,
    /// In the order in which the objects are given.
    entries: Vec<ObjectEntry>,
    group_choice: ImpostorChoice,
    offers: Vec<Offer>,
    fixed_s: f64,
    reserve_s: f64,
    /// Number of the last frame chosen for, as the law counts them.
    frame: u64,
    plan: Plan,
    /// The plan of the frame that is being drawn.
    drawn: DrawnChoice,
    status: Status,
    settings: Settings,
}

impl Default for AdaptiveChoice {
    fn default() -> Self {
        let settings = Settings::default();
        Self {
            law: Adaptive::new(settings),
            entries: Vec::new(),
            group_choice: ImpostorChoice::default(),
            offers: Vec::new(),
            fixed_s: 0.0,
            reserve_s: 0.0,
            frame: 0,
            plan: Plan::default(),
            drawn: DrawnChoice::default(),
            status: Status::Waiting,
            settings,
        }
    }
}

impl AdaptiveChoice {
    /// Chooses; `levels` has one entry per object.
    pub fn choose(&mut self, query: &FrameQuery<'_>, groups: &Groups, levels: &mut [LevelDemand]) -> Promise {
        self.set_margin(query);
        self.group_choice.decide(query, groups, self.plan.lambda, self.slowness());
        self.update_objects(query, groups);
        (self.fixed_s, self.reserve_s) = (query.fixed_s, query.reserve_s);
        let [target, fixed, reserved] = [query.target_s, query.fixed_s, query.reserve_s].map(|s| TICKS * s);
        let time = Time { target, fixed, reserved };
        self.frame += 1;
        self.plan = self.law.choose(self.frame, time);
        self.write_levels(query, levels);
        leave_out_members(query, groups, levels);
        let promise = self.promise();
        if groups.all().is_empty() || !self.plan.feasible {
            promise
        } else {
            self.over_all_cuts(query, groups, promise)
        }
    }

    /// Marks the last choice as the one being drawn.
    pub fn take_up(&mut self) {
        let Self { frame, plan, fixed_s, reserve_s, .. } = *self;
        self.drawn = DrawnChoice { frame, plan, fixed_s, reserve_s, slowness: self.slowness() };
    }

    /// Reports times of the frame that was drawn, seconds: `drawn_s` for drawing the choice, `work_s` in all, `others_s` reserved for
    /// others. Whether γ may learn from it.
    pub fn observe(&mut self, drawn_s: f64, work_s: f64, others_s: f64, target_s: f64) -> bool {
        let DrawnChoice { frame, plan, fixed_s, reserve_s, .. } = self.drawn;
        let update = self.law.observe(frame, DRAWING, TICKS * drawn_s);
        self.law.finished(frame, TICKS * (work_s + (others_s - reserve_s).max(0.0)));
        let missing = (work_s + others_s) / target_s - plan.predicted / (TICKS * target_s);
        let spent_s = plan.predicted / TICKS - fixed_s;
        let in_time = work_s <= (1.0 - self.margin()) * target_s;
        self.status = match () {
            () if !plan.feasible && in_time && others_s > 0.0 => Status::Reserved,
            () if !plan.feasible => Status::Clamped(Bound::Coarsest),
            () if missing.abs() > ON_TARGET => Status::Moving,
            () if plan.lambda == 0.0 => Status::Clamped(Bound::Finest),
            () if plan.budget / (TICKS * target_s) - spent_s / target_s > ON_TARGET => Status::BetweenLevels,
            () => Status::Settled,
        };
        update != FilterUpdate::Rejected
    }

    /// Takes the γ of other prices; by those before, the frame that was drawn cost `priced_s`. A ladder's sizes are rounded and its prices with them.
    pub fn replace_prices(&mut self, estimator: SpeedEstimator, priced_s: f64) {
        let DrawnChoice { plan, fixed_s, slowness, .. } = self.drawn;
        let table_s = (plan.predicted / TICKS - fixed_s) / slowness;
        let rounding = priced_s / table_s;
        let known = rounding.is_finite() && rounding > 0.0;
        self.law.replace_estimator(DRAWING, estimator.rescaled(if known { rounding } else { 1.0 }));
    }

    /// Reports an outside disturbance: measurements of the next few frames are ignored.
    pub fn disturb(&mut self) {
        self.law.disturb();
    }

    pub fn status(&self) -> Status {
        self.status
    }

    /// γ as planned with: how much slower the machine is than its prices.
    pub fn slowness(&self) -> f64 {
        self.law.planned_slowness(DRAWING)
    }

    /// Gain of one more second that others leave, in the unit of the objects' gains; 0 where everything is at its
    /// finest, or where the scatter bounds the picture: it leaves more time free than the reserved part, so that
    /// another reserve would change nothing.
    pub fn lambda(&self) -> f64 {
        if self.margin() > self.settings.margin { 0.0 } else { TICKS * self.plan.lambda }
    }

    /// The fraction of the target that is left free now.
    pub fn margin(&self) -> f64 {
        self.law.margin()
    }

    fn set_margin(&mut self, query: &FrameQuery<'_>) {
        let hysteresis = Settings::default().hysteresis + query.sliders.hysteresis;
        let wanted = Settings { margin: query.margin, hysteresis, ..Settings::default() };
        if wanted != self.settings {
            self.settings = wanted;
            self.law.set_settings(wanted);
        }
    }

    /// Gives the objects in view to the law, and removes the others.
    fn update_objects(&mut self, query: &FrameQuery<'_>, groups: &Groups) {
        let same = self.entries.len() == query.views.len();
        if !same || self.entries.iter().zip(query.views).any(|(entry, seen)| entry.id != seen.view.id) {
            self.clear();
            self.entries.extend(query.views.iter().map(|seen| ObjectEntry {
                id: seen.view.id,
                version: 0,
                rungs: 0,
                weight: None,
            }));
        }
        for at in 0..self.entries.len() {
            let within =
                groups.parent(at).is_some() && groups.is_within(at, |group| self.group_choice.is_closed(group));
            let (view, ladder) = (&query.views[at].view, query.ladders.of(at));
            let (rungs, weight) = match view.is_group() {
                false => (ladder.rungs.as_slice(), query.weight(at)),
                true if self.group_choice.is_closed(at) => self.group_choice.impostors(query, at),
                true => (&[][..], 0.0),
            };
            if within || !query.is_offered(at) || rungs.is_empty() {
                self.withdraw(at);
                continue;
            }
            self.offer(at, ladder, rungs, weight);
        }
    }

    /// Offers the given rungs of a ladder: of a group, only its useful impostors.
    fn offer(&mut self, at: usize, ladder: &Ladder, rungs: &[Rung], weight: f64) {
        let entry = &mut self.entries[at];
        let id = u64::from(entry.id.0);
        if (entry.version, entry.rungs) != (ladder.version, rungs.len()) {
            self.offers.clear();
            self.offers.extend(rungs.iter().map(|rung| Offer { cost: TICKS * rung.cost_s, gain: rung.accuracy }));
            (entry.version, entry.rungs) = (ladder.version, rungs.len());
            self.law.set(id, DRAWING, false, &self.offers);
        }
        if entry.weight.is_none_or(|held| (weight - held).abs() > WEIGHT_DEADBAND * held) {
            entry.weight = Some(weight);
            self.law.weigh(id, weight);
        }
    }

    fn withdraw(&mut self, at: usize) {
        let entry = &mut self.entries[at];
        if entry.version > 0 {
            self.law.remove(u64::from(entry.id.0));
            (entry.version, entry.weight) = (0, None);
        }
    }

    /// Removes everything from the law: prices have changed, or objects have come or gone.
    pub fn clear(&mut self) {
        (0..self.entries.len()).for_each(|at| self.withdraw(at));
        self.entries.clear();
        self.group_choice = ImpostorChoice::default();
    }

    fn write_levels(&self, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) {
        for (at, entry) in self.entries.iter().enumerate().filter(|(_, entry)| entry.version > 0) {
            let ladder = query.ladders.of(at);
            let level = self.law.level(u64::from(entry.id.0)).map_or(0, |level| level as usize);
            if let Some(rung) = ladder.rungs.get(level) {
                levels[at] = demand(at, query.views, rung);
            }
        }
    }

    /// The promise with the bound over all cuts: the law's own bound is over what it was offered, which lacks the members of closed
    /// groups. Both values are by the present weights, without the law's deadband.
    fn over_all_cuts(&self, query: &FrameQuery<'_>, groups: &Groups, promise: Promise) -> Promise {
        let mut impostors = Impostors::default();
        impostors.update(query, groups);
        let drawn = |(at, entry): (usize, &ObjectEntry)| {
            let rung = query.ladders.of(at).rungs.get(self.law.level(u64::from(entry.id.0))? as usize)?;
            Some(rung.accuracy * if query.views[at].view.is_group() { impostors.worth(at) } else { query.weight(at) })
        };
        let offered = self.entries.iter().enumerate().filter(|(_, entry)| entry.version > 0);
        let budget = self.plan.budget / self.slowness();
        // a cast of floats saturates
        let upper = upper(query, groups, &impostors, budget as i64 + 1);
        Promise { value: offered.filter_map(drawn).sum(), upper, ..promise }
    }

    fn promise(&self) -> Promise {
        let Plan { feasible, budget, predicted, value, upper, .. } = self.plan;
        let seconds = |ticks: f64| ticks / TICKS;
        Promise {
            budget_s: seconds(budget),
            predicted_s: seconds(predicted),
            value,
            upper,
            feasible,
            ..Promise::default()
        }
    }
}
