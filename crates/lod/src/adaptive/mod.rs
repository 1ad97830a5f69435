//! The default policy: spends every frame's time where it gains most, by a cost table that is corrected by measurements.
//!
//! In: objects with levels, weights, measured times. Out: a level for every object, and [`Plan`]s that state the predicted time and value.
//! Never here: clocks, threads, the nature of an object; allocation once the buffers have grown. Theory: `docs/theory/budget.md`, §7.
//!
//! ```
//! use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};
//!
//! let mut adaptive = Adaptive::new(Settings::default());
//! let offer = |cost, gain| Offer { cost, gain };
//! for id in 0..100 {
//!     adaptive.set(id, 0, false, &[offer(100.0, 0.5), offer(400.0, 0.8), offer(2000.0, 1.0)]);
//!     adaptive.weigh(id, 1000.0 / (1.0 + id as f64)); // the pixels it covers
//! }
//! let plan = adaptive.choose(0, Time { target: 50_000.0, fixed: 2_000.0, reserved: 0.0 });
//! assert!(plan.feasible && plan.predicted <= 50_000.0);
//! assert!(adaptive.level(0) > adaptive.level(99));
//! adaptive.observe(0, 0, 1.1 * (plan.predicted - 2_000.0)); // measured
//! ```

mod hysteresis;
pub mod joint;
mod late_margin;
mod options;
mod pick;
mod speed_estimator;

pub use hysteresis::{Trim, is_late};
pub use late_margin::{LATE, LATE_SHARE, LateMargin};
pub use options::Offer;
pub use speed_estimator::{FilterUpdate, SpeedEstimator};
#[cfg(feature = "std")]
pub(crate) use speed_estimator::{SIGMA_LEAST, WANDER};

use crate::select::Level;
use hysteresis::ChoiceHold;
use options::Options;
use pick::{Picker, Terms};

/// The fraction of a frame that a policy with a prediction leaves free where a scene sets none.
pub const DEFAULT_MARGIN: f64 = 0.02;
/// The greatest margin that may be asked for, as a fraction of T.
pub const MARGIN_MAX: f64 = 0.5;
/// Stages with a γ of their own: drawing, culling, classes of simulation.
pub const STAGES: usize = 4;
/// Frames whose measurement may still arrive: later measurements are ignored.
const IN_FLIGHT: usize = 8;
/// Frames after a start or a disturbance whose measurements are ignored.
const UNSETTLED: u8 = 3;
/// A relative change up to this counts as none: positions and times are rounded.
const ROUNDING: f64 = 1e-9;
/// Greatest fall of the planned γ from one frame to the next: lateness is corrected immediately, spare time is used slowly.
const EASING: f64 = 0.95;

/// The settings of [`Adaptive`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The least margin, as a fraction of T; 0 … 0.5.
    pub margin: f64,
    /// The share of frames that may be late, 0 … 1: the margin is as large as the measured scatter requires for it. With 1 there is no
    /// margin but the least; less than 1/128 is 1/128, for one slow frame is a hiccup.
    pub late: f64,
    /// h: additional weight of a step that was taken in the last choice; 0 … 2. At 0 levels change visibly often; above 1 little is gained.
    pub hysteresis: f64,
    /// Frames after a change for which an object is reluctant to reverse it: one that fell may not rise, one that rose falls after others;
    /// 0 … 255. Below 4, levels that come and go within three frames are visible.
    pub dwell: u8,
    /// Whether [`Trim`] corrects the budget as well.
    pub trim: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { margin: DEFAULT_MARGIN, late: LATE_SHARE, hysteresis: 0.25, dwell: 4, trim: false }
    }
}

impl Settings {
    fn sound(self) -> Self {
        let (margin, late) = (crate::within(self.margin, 0.0, MARGIN_MAX), crate::within(self.late, 0.0, 1.0));
        Self { margin, late, hysteresis: crate::within(self.hysteresis, 0.0, 2.0), ..self }
    }
}

/// The time of a frame, ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// T, > 0.
    pub target: f64,
    /// Ticks spent before anything is chosen, ≥ 0.
    pub fixed: f64,
    /// Ticks among `fixed` that the frame does not spend but leaves to others, 0 … `fixed`: a frame that takes longer than predicted takes
    /// it from them before it is late.
    pub reserved: f64,
}

/// A choice, with its predicted time and value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plan {
    /// Whether the choice fits; if not, everything is in its lowest form and still exceeds the budget.
    pub feasible: bool,
    /// Whether this is the last choice, kept because nothing has moved.
    pub held: bool,
    /// Ticks that may be spent on the choice.
    pub budget: f64,
    /// The expected time of the frame including the fixed part, ticks.
    pub predicted: f64,
    /// Weighted gain of the choice.
    pub value: f64,
    /// The certificate: no choice within the budget has more; 0 where there is none.
    pub upper: f64,
    /// λ: gain of one more tick; 0 where everything is at its finest.
    pub lambda: f64,
}

impl Plan {
    /// Upper bound of the relative loss against the best choice.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.upper > 0.0 { (1.0 - self.value / self.upper).max(0.0) } else { 0.0 }
    }
}

/// The prediction for a frame, stored until the frame is measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Prediction {
    frame: u64,
    target: f64,
    table: [u64; STAGES],
    /// Ticks of the whole frame by the table alone, without the time reserved for others.
    whole: f64,
    usable: bool,
}

/// Objects, the estimates of the machine, and the last choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptive {
    settings: Settings,
    options: Options,
    picker: Picker,
    estimators: [SpeedEstimator; STAGES],
    /// γ used in plans: follows the estimators up immediately and down slowly.
    slowness: [f64; STAGES],
    late: LateMargin,
    hold: ChoiceHold,
    trim: Trim,
    /// The fraction of T that the last choice left to others.
    reserved: f64,
    predictions: [Option<Prediction>; IN_FLIGHT],
    unsettled: u8,
    plan: Plan,
    table: [u64; STAGES],
    /// The options' change counter and the time at the last choice.
    chosen_for: Option<(u64, Time)>,
}

impl Adaptive {
    /// A controller without measurements.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let settings = settings.sound();
        Self {
            settings,
            options: Options::default(),
            picker: Picker::default(),
            estimators: [SpeedEstimator::default(); STAGES],
            slowness: [1.0; STAGES],
            late: LateMargin::new(settings.late),
            hold: ChoiceHold::default(),
            trim: Trim::default(),
            reserved: 0.0,
            predictions: [None; IN_FLIGHT],
            unsettled: UNSETTLED,
            plan: Plan::default(),
            table: [0; STAGES],
            chosen_for: None,
        }
    }

    /// Adds an object, or replaces its levels (coarsest first; cost by the table of `stage`, `0..STAGES`, else the last).
    ///
    /// A new object starts at its lowest form with weight 1. `droppable` objects may be left out altogether.
    pub fn set(&mut self, id: u64, stage: usize, droppable: bool, levels: &[Offer]) {
        self.options.set(id, stage.min(STAGES - 1), droppable, levels);
    }

    /// Sets the factor of an object's gains from the next choice on; NaN and negative values are 0, and 0 gives the lowest form. `false`
    /// where there is no such object.
    pub fn weigh(&mut self, id: u64, weight: f64) -> bool {
        self.options.weigh(id, weight)
    }

    /// Removes an object; `false` where there is no such object.
    pub fn remove(&mut self, id: u64) -> bool {
        self.options.remove(id)
    }

    /// Takes other settings from the next choice on.
    pub fn set_settings(&mut self, settings: Settings) {
        self.settings = settings.sound();
        self.late.set_share(self.settings.late);
        self.chosen_for = None;
    }

    /// Chooses for a frame; the result is read with [`Self::level`]. Frame numbers must be unique.
    pub fn choose(&mut self, frame: u64, time: Time) -> Plan {
        let (mut target, mut fixed) = (time.target, time.fixed);
        if !(target.is_finite() && target > 0.0) {
            (target, fixed) = (1.0, 1.0); // no time at all: everything at its lowest, reported as infeasible
        }
        fixed = if fixed > 0.0 { fixed } else { 0.0 };
        let reserved = crate::within(time.reserved, 0.0, fixed);
        self.reserved = reserved / target;
        for (planned, estimator) in self.slowness.iter_mut().zip(&self.estimators) {
            *planned = estimator.slowness().max(EASING * *planned);
        }
        let trim = if self.settings.trim { self.trim.part() } else { 0.0 };
        let budget = target * (1.0 - self.margin() + trim) - fixed;
        let terms = Terms::new(budget, self.slowness, 1.0 + self.settings.hysteresis);
        if self.may_keep(time, &terms, target, fixed) {
            self.options.objects_mut().iter_mut().for_each(|o| o.dwell = o.dwell.saturating_sub(1));
        } else {
            self.pick(terms);
            self.chosen_for = Some((self.options.changes, time));
        }
        self.plan.predicted = self.cost(&terms) + fixed;
        self.plan.budget = budget;
        let usable = self.unsettled == 0;
        self.unsettled = self.unsettled.saturating_sub(1);
        let table = self.table;
        let whole = fixed - reserved + table.iter().sum::<u64>() as f64;
        self.predictions[frame as usize % IN_FLIGHT] = Some(Prediction { frame, target, table, whole, usable });
        self.plan
    }

    /// Reports the time that a stage of a frame took, ticks, without the fixed part. Measurements may come late, and in any order.
    pub fn observe(&mut self, frame: u64, stage: usize, took: f64) -> FilterUpdate {
        match self.predictions[frame as usize % IN_FLIGHT] {
            Some(prediction) if prediction.frame == frame && prediction.usable && stage < STAGES => self.estimators
                [stage]
                .observe(prediction.table[stage] as f64 / prediction.target, took / prediction.target),
            _ => FilterUpdate::Rejected,
        }
    }

    /// Reports the time that a whole frame took with its fixed part, without reserved time, ticks: for the margin and
    /// the trim.
    pub fn finished(&mut self, frame: u64, took: f64) {
        match self.predictions[frame as usize % IN_FLIGHT] {
            Some(prediction) if prediction.frame == frame && prediction.usable && took.is_finite() => {
                self.late.observe(prediction.whole, took);
                let left_over = 1.0 - self.margin() - took / prediction.target;
                self.trim.observe(left_over, self.plan.lambda == 0.0);
            }
            _ => {}
        }
    }

    /// Reports an outside disturbance (a resize, a shader compiled, a hidden window): measurements of the next few frames are ignored.
    pub fn disturb(&mut self) {
        self.unsettled = UNSETTLED;
        self.predictions = [None; IN_FLIGHT];
        self.late.interrupt();
    }

    /// Reports that another table has taken the place of a stage's, with the estimator that goes with it. Frames chosen by the table before teach
    /// nothing.
    pub fn replace_estimator(&mut self, stage: usize, estimator: SpeedEstimator) {
        let stage = stage.min(STAGES - 1);
        (self.estimators[stage], self.slowness[stage]) = (estimator, estimator.slowness());
        self.predictions = [None; IN_FLIGHT];
    }

    /// The level given to an object; `None` where it is left out, is unknown, or has no levels.
    #[must_use]
    pub fn level(&self, id: u64) -> Level {
        let object = self.options.find(id)?;
        self.options.vertex(object, object.taken).level
    }

    /// The lowest form of an object, for the rest of a frame when [`is_late`] is true.
    #[must_use]
    pub fn lowest(&self, id: u64) -> Level {
        self.options.find(id)?.base.level
    }

    /// The estimator of a stage; of the last where there is no such stage.
    #[must_use]
    pub fn estimator(&self, stage: usize) -> &SpeedEstimator {
        &self.estimators[stage.min(STAGES - 1)]
    }

    /// γ of a stage in the last plan: follows the estimator up immediately, and down by 5 % a frame at most.
    #[must_use]
    pub fn planned_slowness(&self, stage: usize) -> f64 {
        self.slowness[stage.min(STAGES - 1)]
    }

    /// The present margin, as a fraction of T: the part that the scatter requires, as far as it is not reserved for
    /// others, who may be made to wait.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.settings.margin.max(self.late.margin() - self.reserved)
    }

    fn cost(&self, terms: &Terms) -> f64 {
        self.table.iter().zip(&terms.slowness).map(|(&t, k)| t as f64 * k).sum()
    }

    /// Whether nothing has moved and the last choice still holds.
    fn may_keep(&mut self, time: Time, terms: &Terms, target: f64, fixed: f64) -> bool {
        let is_same = |(changes, before): (u64, Time)| {
            let fixed = (time.fixed - before.fixed).abs() <= ROUNDING * before.target;
            changes == self.options.changes && time.target == before.target && fixed
        };
        // where all had to fall at once none may rise at first, and nothing is on offer
        let fallen = self.plan.lambda == 0.0 && self.options.are_all_fallen();
        let still = self.chosen_for.is_some_and(is_same) && self.plan.feasible && !fallen;
        let predicted = (self.cost(terms) + fixed) / target;
        let goal = (terms.budget + fixed) / target;
        if !still {
            self.hold = ChoiceHold::default();
        }
        self.plan.held = still && self.hold.keeps(predicted, goal, self.plan.lambda > 0.0);
        self.plan.held
    }

    fn pick(&mut self, terms: Terms) {
        let picked = self.picker.pick(&mut self.options, terms, self.settings.dwell);
        self.table = picked.table;
        let (value, upper, lambda) = (picked.value, picked.upper, picked.lambda);
        self.plan = Plan { feasible: picked.feasible, held: false, value, upper, lambda, ..self.plan };
    }
}
