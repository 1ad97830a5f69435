//! The default: every frame's time goes where it gains most, by a cost table that learns while it runs.
//!
//! In: objects with levels, weights, measured times. Out: a level for every object in [`Plan`]s that say what they promise.
//! Never here: clocks, threads, what an object is; allocation once the buffers have grown. Theory: `docs/theory/budget.md`, §7.
//!
//! ```
//! use metachron_budget::adaptive::{Adaptive, Offer, Settings, Time};
//!
//! let mut adaptive = Adaptive::new(Settings::default());
//! let offer = |cost, gain| Offer { cost, gain };
//! for id in 0..100 {
//!     adaptive.set(id, 0, false, &[offer(100.0, 0.5), offer(400.0, 0.8), offer(2000.0, 1.0)]);
//!     adaptive.weigh(id, 1000.0 / (1.0 + id as f64)); // the pixels it covers
//! }
//! let plan = adaptive.choose(0, Time { target: 50_000.0, fixed: 2_000.0 });
//! assert!(plan.feasible && plan.predicted <= 50_000.0);
//! assert!(adaptive.level(0) > adaptive.level(99));
//! adaptive.observe(0, 0, 1.1 * (plan.predicted - 2_000.0)); // measured
//! ```

mod gauge;
pub mod joint;
mod menu;
mod pace;
mod pick;

pub use gauge::{Gauge, Lesson};
pub use menu::Offer;
pub use pace::{Ladder, Trim, is_late};

use crate::select::Level;
use menu::Menu;
use pace::Hold;
use pick::{Picker, Terms};

/// Stages with a κ of their own: drawing, culling, classes of simulation.
pub const STAGES: usize = 4;
/// Frames whose measurement may still come: what is later teaches nothing.
const IN_FLIGHT: usize = 8;
/// Frames after a start or a disturbance that teach nothing.
const UNSETTLED: u8 = 3;
/// What moved by no more than this part of itself has not moved: positions and times are rounded.
const ROUNDING: f64 = 1e-9;
/// The most by which κ falls in the plans of one frame to the next: late is mended at once, time to spare is taken up slowly.
const EASING: f64 = 0.95;

/// What can be set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The least margin, as a part of T; 0 … 0.5. Below what the machine's noise is, every other frame is late.
    pub margin: f64,
    /// z: standard deviations of the prediction's error that the margin covers at least; 0 … 5. Where the machine errs by 5 %, 0.5 is
    /// late by 5 % once in 400 frames and leaves 2 % of the time; 1.5 not once in 1250, and leaves 4 %.
    pub sigmas: f64,
    /// h: what a step that was taken counts more; 0 … 2. 0 changes more levels than the eye likes; above 1 little is gained.
    pub hysteresis: f64,
    /// Frames after a change for which an object is slow to turn back: one that fell may not rise, one that rose falls after others;
    /// 0 … 255. Below 4 what comes and goes within three frames is seen.
    pub dwell: u8,
    /// Whether [`Trim`] corrects the budget as well.
    pub trim: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { margin: 0.02, sigmas: 0.5, hysteresis: 0.25, dwell: 8, trim: false }
    }
}

impl Settings {
    fn sound(self) -> Self {
        let (margin, sigmas) = (crate::within(self.margin, (0.0, 0.5)), crate::within(self.sigmas, (0.0, 5.0)));
        Self { margin, sigmas, hysteresis: crate::within(self.hysteresis, (0.0, 2.0)), ..self }
    }
}

/// The time of a frame, ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// T, > 0.
    pub target: f64,
    /// What is taken before anything is chosen, ≥ 0.
    pub fixed: f64,
}

/// What was chosen, and what it promises.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plan {
    /// Whether it fits; if not, everything is in its lowest form and that is too much.
    pub feasible: bool,
    /// Whether it is the last choice, kept because nothing has moved.
    pub held: bool,
    /// What may be spent on what is chosen, ticks.
    pub budget: f64,
    /// What the frame is expected to take, the fixed part with it, ticks.
    pub predicted: f64,
    /// Weighted gain of the choice.
    pub value: f64,
    /// The certificate: no choice within the budget has more; 0 where there is none.
    pub upper: f64,
    /// λ: gain of one more tick; 0 where everything is at its most.
    pub lambda: f64,
}

impl Plan {
    /// How far below the best this can be, as a part of the best.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.upper > 0.0 { (1.0 - self.value / self.upper).max(0.0) } else { 0.0 }
    }
}

/// What a frame was predicted from, until it is measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sent {
    frame: u64,
    target: f64,
    table: [u64; STAGES],
    teaches: bool,
}

/// Objects, what is known of the machine, and the last choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptive {
    settings: Settings,
    menu: Menu,
    picker: Picker,
    gauges: [Gauge; STAGES],
    /// κ as planned with: follows the gauges up at once and down slowly.
    kappa: [f64; STAGES],
    ladder: Ladder,
    hold: Hold,
    trim: Trim,
    sent: [Option<Sent>; IN_FLIGHT],
    unsettled: u8,
    plan: Plan,
    table: [u64; STAGES],
    /// The menu's changes and the time at the last choice.
    chosen_for: Option<(u64, Time)>,
}

impl Adaptive {
    /// A controller that knows nothing yet.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings: settings.sound(),
            menu: Menu::default(),
            picker: Picker::default(),
            gauges: [Gauge::default(); STAGES],
            kappa: [1.0; STAGES],
            ladder: Ladder::default(),
            hold: Hold::default(),
            trim: Trim::default(),
            sent: [None; IN_FLIGHT],
            unsettled: UNSETTLED,
            plan: Plan::default(),
            table: [0; STAGES],
            chosen_for: None,
        }
    }

    /// Puts an object on the menu, or gives it other levels (coarsest first; cost by the table of `stage`, `0..STAGES`, else the last).
    ///
    /// A new object starts at its lowest form with weight 1. `droppable` objects may be left out altogether.
    pub fn set(&mut self, id: u64, stage: usize, droppable: bool, levels: &[Offer]) {
        self.menu.set(id, stage.min(STAGES - 1), droppable, levels);
    }

    /// What an object's gains are multiplied by from the next choice on; NaN and what is below 0 are 0, and 0 is the lowest form.
    /// `false` where there is no such object.
    pub fn weigh(&mut self, id: u64, weight: f64) -> bool {
        self.menu.weigh(id, weight)
    }

    /// Takes an object off the menu; `false` where there is no such object.
    pub fn remove(&mut self, id: u64) -> bool {
        self.menu.remove(id)
    }

    /// Takes other settings from the next choice on.
    pub fn set_settings(&mut self, settings: Settings) {
        self.settings = settings.sound();
        self.chosen_for = None;
    }

    /// Chooses for a frame; the answer is read with [`Self::level`]. Frames have numbers that never come twice.
    pub fn choose(&mut self, frame: u64, time: Time) -> Plan {
        let (mut target, mut fixed) = (time.target, time.fixed);
        if !(target.is_finite() && target > 0.0) {
            (target, fixed) = (1.0, 1.0); // no time at all: the lowest of everything, said to be infeasible
        }
        fixed = if fixed > 0.0 { fixed } else { 0.0 };
        for (planned, gauge) in self.kappa.iter_mut().zip(&self.gauges) {
            *planned = gauge.kappa().max(EASING * *planned);
        }
        let trim = if self.settings.trim { self.trim.part() } else { 0.0 };
        let budget = target * (1.0 - self.margin() + trim) - fixed;
        let terms = Terms::new(budget, self.kappa, 1.0 + self.settings.hysteresis);
        if self.may_keep(time, &terms, target, fixed) {
            self.menu.objects_mut().iter_mut().for_each(|o| o.dwell = o.dwell.saturating_sub(1));
        } else {
            self.pick(terms);
            self.chosen_for = Some((self.menu.changes, time));
        }
        self.plan.predicted = self.cost(&terms) + fixed;
        self.plan.budget = budget;
        let teaches = self.unsettled == 0;
        self.unsettled = self.unsettled.saturating_sub(1);
        self.sent[frame as usize % IN_FLIGHT] = Some(Sent { frame, target, table: self.table, teaches });
        self.plan
    }

    /// Learns what a stage of a frame took, ticks, without what is fixed. Measurements may come late, and in any order.
    pub fn observe(&mut self, frame: u64, stage: usize, took: f64) -> Lesson {
        match self.sent[frame as usize % IN_FLIGHT] {
            Some(sent) if sent.frame == frame && sent.teaches && stage < STAGES => {
                self.gauges[stage].observe(sent.table[stage] as f64 / sent.target, took / sent.target)
            }
            _ => Lesson::Refused,
        }
    }

    /// Learns what a whole frame took, ticks: for the miss ladder and the trim.
    pub fn finished(&mut self, frame: u64, took: f64) {
        match self.sent[frame as usize % IN_FLIGHT] {
            Some(sent) if sent.frame == frame && sent.teaches && took.is_finite() => {
                self.ladder.observe(took / sent.target);
                let left_over = 1.0 - self.settings.margin - took / sent.target;
                self.trim.observe(left_over, self.plan.lambda == 0.0);
            }
            _ => {}
        }
    }

    /// Something outside made frames unlike others (a resize, a shader compiled, a hidden window): the next few teach nothing.
    pub fn disturb(&mut self) {
        self.unsettled = UNSETTLED;
        self.sent = [None; IN_FLIGHT];
    }

    /// The level an object was given; `None` where it is left out, is unknown, or has no levels.
    #[must_use]
    pub fn level(&self, id: u64) -> Level {
        let object = self.menu.find(id)?;
        self.menu.vertex(object, object.taken).level
    }

    /// The lowest form of an object, for what is left when [`is_late`] says so.
    #[must_use]
    pub fn lowest(&self, id: u64) -> Level {
        self.menu.find(id)?.base.level
    }

    /// What is known of a stage; the last where there is no such stage.
    #[must_use]
    pub fn gauge(&self, stage: usize) -> &Gauge {
        &self.gauges[stage.min(STAGES - 1)]
    }

    /// κ of a stage as the last plan was made with: it follows the gauge up at once, and down by 5 % a frame at most.
    #[must_use]
    pub fn planned_kappa(&self, stage: usize) -> f64 {
        self.kappa[stage.min(STAGES - 1)]
    }

    /// The margin now, as a part of T.
    #[must_use]
    pub fn margin(&self) -> f64 {
        let used = self.gauges.iter().zip(&self.table).filter(|(_, table)| **table > 0);
        let sigma = used.map(|(gauge, _)| gauge.sigma()).fold(0.0, f64::max);
        self.settings.margin.max((self.settings.sigmas + self.ladder.extra_sigmas()) * sigma).min(0.5)
    }

    fn cost(&self, terms: &Terms) -> f64 {
        self.table.iter().zip(&terms.kappa).map(|(&t, k)| t as f64 * k).sum()
    }

    /// Whether nothing has moved and the last choice still holds.
    fn may_keep(&mut self, time: Time, terms: &Terms, target: f64, fixed: f64) -> bool {
        let is_same = |(changes, before): (u64, Time)| {
            let fixed = (time.fixed - before.fixed).abs() <= ROUNDING * before.target;
            changes == self.menu.changes && time.target == before.target && fixed
        };
        let still = self.chosen_for.is_some_and(is_same) && self.plan.feasible;
        let predicted = (self.cost(terms) + fixed) / target;
        let goal = (terms.budget + fixed) / target;
        if !still {
            self.hold = Hold::default();
        }
        self.plan.held = still && self.hold.keeps(predicted, goal, self.plan.lambda > 0.0);
        self.plan.held
    }

    fn pick(&mut self, terms: Terms) {
        let picked = self.picker.pick(&mut self.menu, terms, self.settings.dwell);
        self.table = picked.table;
        let (value, upper, lambda) = (picked.value, picked.upper, picked.lambda);
        self.plan = Plan { feasible: picked.feasible, held: false, value, upper, lambda, ..self.plan };
    }
}
