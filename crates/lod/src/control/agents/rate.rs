//! The rate controller of an agent: dt and ε of its simulation from the measured time of its turns.
//!
//! In: a [`TurnMeasure`] after every turn. Out: occasionally a [`RateDemand`]. Never here: agents, clocks. One loop variable z moves
//! through two ranges in series: first ε grows to its coarsest, then dt to its longest; back in the reverse order.
//! Theory: `docs/theory/control.md`, eq. 17 … 19.

mod full_load;

use crate::Bound;
use crate::log_law::ERROR_MAX;
use full_load::{FullLoad, IN_A_ROW};
use metachron_core::{NumberRange, gains};

/// Measured times of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnMeasure {
    /// Time the turn took, seconds, > 0.
    pub work_s: f64,
    /// Time between turns at the rate that the scene requests, seconds, > 0: at a dt of [`RateLimits::dt_wanted_s`].
    pub wanted_period_s: f64,
    /// Actual time between turns, seconds, > 0, smoothed over a few of them.
    pub real_period_s: f64,
    /// Length of the step made, simulated seconds, > 0.
    pub dt_s: f64,
}

/// Limits of the demands to an agent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RateLimits {
    /// Length of a step at the requested rate, simulated seconds, > 0.
    pub dt_wanted_s: f64,
    /// Longest step, simulated seconds. If not above `dt_wanted_s`, the rate is fixed.
    pub dt_max_s: f64,
    /// Finest and coarsest ε of the simulation, metres; equal values fix ε. `None` for a model without ε.
    pub eps_m: Option<(f64, f64)>,
    /// Work is proportional to 1/ε to this power, ≥ 1: 1 of a body that is divided along a line, 3 of one that fills a
    /// volume.
    pub work_power: f64,
    /// The fraction of its period that the agent's work may take, 0.01 … 1. Cores over agents, less some reserve, is fair.
    pub share: f64,
}

/// The gains of the law: how much of a difference one demand removes. Where an agent's own work asks to coarsen, the
/// whole difference is removed at once: its load is known, and late turns lose simulated time.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RateGains {
    /// Share of the way to a finer level that one demand goes, 0.02 … 1, where nobody else delays the agent.
    pub refine: f64,
    /// κ: share of a delay by others, of logarithms, that one demand removes, 0.02 … 1.99.
    pub yielding: f64,
}

impl Default for RateGains {
    fn default() -> Self {
        Self { refine: 0.5, yielding: 0.5 }
    }
}

impl RateGains {
    fn sound(self) -> Self {
        let own = Self::default();
        let kept = |gain: f64, own: f64, range: NumberRange| if gain.is_finite() { range.nearest(gain) } else { own };
        Self {
            refine: kept(self.refine, own.refine, gains::REFINE),
            yielding: kept(self.yielding, own.yielding, gains::YIELD),
        }
    }
}

/// The finest detail of an agent's simulation that makes a visible difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleDetail {
    /// Its ε, metres, > 0; +∞ if nothing of the agent is seen.
    pub eps_m: f64,
    /// Length of its steps, simulated seconds, from 0, where every step is seen, to +∞.
    pub dt_s: f64,
}

/// The requested step and spacing of an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateDemand {
    /// Length of a step, simulated seconds.
    pub dt_s: f64,
    /// ε of the simulation, metres; `None` for a model without ε.
    pub eps_m: Option<f64>,
}

/// Measurements are averaged over this long, seconds: many turns, so that a single hiccup has no effect …
const WINDOW_S: f64 = 0.25;

/// … and of at least this many turns.
const WINDOW_TURNS: u32 = 8;

/// A turn of more than this many times the mean of the last windows is clamped to it: such delays are due to the scheduler, not the agent.
const SPIKE: f64 = 8.0;

/// Above this ratio of real to wanted period, beyond the agent's own work, the agent counts as delayed by others.
const LATE: f64 = 1.03;

/// Least |Δ ln| of a demand, dimensionless: re-meshing costs accuracy, which 10 % of ε do not justify.
pub(super) const DEMAND_MIN: f64 = 0.095;

/// Windows without delay before anything gets finer: initially a second, doubled whenever that turns out to have been too early.
const PATIENCE: (u32, u32) = (4, 128);

/// Greatest refinement by one demand after delays by others, and least before, ln 1.25: a small step tests whether they are still there.
const REFINE_MAX: f64 = 0.223;

/// The dead zone of ln(load/share), 80 % … 105 %: wider than [`DEMAND_MIN`], so that there is always an ε at which it rests.
const DEAD: (f64, f64) = (-0.223, 0.049);
/// Target inside the dead zone.
const MIDDLE: f64 = 0.5 * (DEAD.0 + DEAD.1);

/// Windows of a beginning at the coarsest: of 1, 2 and 4 turns, so that three refinements are made within seven turns.
const BEGINNING: u32 = 3;

#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Window {
    turns: u32,
    span_s: f64,
    work_s: f64,
    wanted_s: f64,
    /// The part of the work that exceeds its own turn's period.
    over_s: f64,
    late: f64,
}

impl RateLimits {
    /// Upper end of the range of z that ε covers: p ln(coarsest ε / finest ε) with the power p of work.
    fn eps_end(&self) -> f64 {
        self.eps_m.map_or(0.0, |(fine, coarse)| self.work_power * ratio_ln(coarse, fine))
    }

    /// Upper end of the range of z, the logarithm of a ratio of work: that of ε, and ln(longest dt / wanted dt) beyond it. 0 where nothing can
    /// be chosen.
    #[must_use]
    pub fn top(&self) -> f64 {
        self.eps_end() + ratio_ln(self.dt_max_s, self.dt_wanted_s)
    }

    /// z of a step and a spacing: the inverse of [`RateLimits::demand`] inside its range.
    #[must_use]
    pub fn z_of(&self, demand: &RateDemand) -> f64 {
        let finer =
            self.eps_m.zip(demand.eps_m).map_or(0.0, |((fine, _), eps_m)| self.work_power * ratio_ln(eps_m, fine));
        finer + ratio_ln(demand.dt_s, self.dt_wanted_s)
    }

    /// The step and the spacing at `z`, 0 … [`RateLimits::top`] (control.md, eq. 17).
    #[must_use]
    pub fn demand(&self, z: f64) -> RateDemand {
        let eps_end = self.eps_end();
        let coarsened = |fine: f64, coarse: f64, rise: f64| (fine * libm::exp(rise)).min(coarse.max(fine));
        let of_eps = z.min(eps_end) / self.work_power;
        let eps_m = self.eps_m.map(|(fine, coarse)| coarsened(fine, coarse, of_eps));
        let dt_s = coarsened(self.dt_wanted_s, self.dt_max_s, (z - eps_end).max(0.0));
        RateDemand { dt_s, eps_m }
    }
}

/// Controls dt and ε of one agent.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct RateControl {
    limits: RateLimits,
    gains: RateGains,
    /// Upper ends of the two ranges of z.
    eps_end: f64,
    top: f64,
    window: Window,
    full: FullLoad,
    /// Best known target of the loop variable z.
    aim: f64,
    /// z at the last change of the target for the agent's own load.
    own_target: f64,
    /// The same of the finest detail that makes a visible difference, from 0.
    visible: f64,
    /// z of the last demand sent to the agent.
    sent: f64,
    /// Windows in a row in which others delayed the agent, and in which they did not.
    late: usize,
    windows_in_time: u32,
    patience: u32,
    /// z before the last demand, if that refined and is not confirmed yet.
    refined_from: Option<f64>,
    rest: Option<Bound>,
    /// Windows of its beginning that are left.
    beginning: u32,
}

impl RateControl {
    /// A controller of an agent that presently steps by `dt_wanted_s` and simulates at `eps_m`.
    #[must_use]
    pub fn new(limits: RateLimits, gains: RateGains, eps_m: Option<f64>) -> Self {
        let (eps_end, top) = (limits.eps_end(), limits.top());
        let start = eps_m
            .zip(limits.eps_m)
            .map_or(0.0, |(now, (fine, _))| (limits.work_power * ratio_ln(now, fine)).min(eps_end));
        let limits =
            RateLimits { share: if limits.share > 0.0 { limits.share.clamp(0.01, 1.0) } else { 1.0 }, ..limits };
        Self {
            limits,
            gains: gains.sound(),
            eps_end,
            top,
            window: Window::default(),
            full: FullLoad::default(),
            aim: start,
            own_target: start,
            visible: 0.0,
            sent: start,
            late: 0,
            windows_in_time: 0,
            patience: PATIENCE.0,
            refined_from: None,
            rest: None,
            beginning: 0,
        }
    }

    /// A controller of an agent that begins at its coarsest ε and longest step, and refines within its first turns as far as they leave time
    /// (control.md, eq. 19c).
    #[must_use]
    pub fn from_coarsest(limits: RateLimits, gains: RateGains) -> Self {
        let control = Self::new(limits, gains, None);
        let top = control.top;
        Self { aim: top, own_target: top, sent: top, beginning: BEGINNING, ..control }
    }

    /// Whether anything can be controlled: fixed values switch the controller off.
    #[must_use]
    pub fn steers(&self) -> bool {
        self.top > 0.0
    }

    /// Changes the fraction of its period that the agent's work may take: clamped to 0.001 … 1; not above 0 is ignored.
    pub fn set_share(&mut self, share: f64) {
        if share > 0.0 {
            self.limits.share = share.clamp(1e-3, 1.0);
        }
    }

    /// The demand with which the agent begins; `None` of a controller that takes it as it is.
    #[must_use]
    pub fn begins_with(&self) -> Option<RateDemand> {
        (self.beginning > 0).then(|| self.demand())
    }

    /// The fraction of its period that the agent's work may take.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.limits.share
    }

    /// Sets the ε and step that make a visible difference. Until the next call nothing finer is demanded; afterwards
    /// the agent returns to its own target.
    /// A longer step counts where the coarsest ε is fine enough.
    pub fn set_visible(&mut self, detail: VisibleDetail) {
        let RateLimits { dt_wanted_s, dt_max_s, work_power, .. } = self.limits;
        let coarsened = |(fine, coarse): (f64, f64)| work_power * ratio_ln(detail.eps_m.min(coarse), fine);
        let of_eps = self.limits.eps_m.map_or(0.0, coarsened).min(self.eps_end);
        let of_dt = if of_eps < self.eps_end { 0.0 } else { ratio_ln(detail.dt_s.min(dt_max_s), dt_wanted_s) };
        self.visible = (of_eps + of_dt).min(self.top);
    }

    /// The present target of z: by load, and by visibility.
    fn target(&self) -> f64 {
        self.own_target.max(self.visible)
    }

    /// Load of one core at the finest ε and the wanted rate, from 0, as the mean of the last windows; `None` before the first measurement.
    /// Work falls as a power of 1/ε and as 1/dt.
    #[must_use]
    pub fn full_load(&self) -> Option<f64> {
        self.full.mean()
    }

    /// The least fraction of that load, 0 … 1: at the coarsest ε and the longest dt.
    #[must_use]
    pub fn least_part(&self) -> f64 {
        libm::exp(-self.top)
    }

    /// Reports the time of a turn; gives a demand when dt or ε should change.
    pub fn after_turn(&mut self, turn: &TurnMeasure) -> Option<RateDemand> {
        if !self.steers() || !self.collect(turn) {
            return None;
        }
        let window = std::mem::take(&mut self.window);
        if self.beginning > 0 {
            self.begin(&window);
        } else {
            self.note(&window);
            self.learn(&window);
        }
        self.demand_if_worth_it()
    }

    /// Refines from the coarsest by one window, by a factor of four in work at most. What a far coarser level says of the finest is forgotten with
    /// the next window, and first turns say nothing of others.
    fn begin(&mut self, window: &Window) {
        self.beginning -= 1;
        self.full = FullLoad::default();
        self.full.note(window.work_s / window.wanted_s * libm::exp(self.sent));
        let to = self.full.mean().map_or(self.top, |full| libm::log(full / self.limits.share) - MIDDLE);
        self.aim = to.max(self.own_target - ERROR_MAX).clamp(0.0, self.top);
    }

    /// Adds a turn to the window; `true` when the window is full. An invalid measurement is left out.
    fn collect(&mut self, turn: &TurnMeasure) -> bool {
        let all = [turn.work_s, turn.wanted_period_s, turn.real_period_s, turn.dt_s];
        if !all.iter().all(|x| x.is_finite() && *x > 0.0) {
            return false;
        }
        // the period that belongs to the present step
        let wanted_s = turn.wanted_period_s * turn.dt_s / self.limits.dt_wanted_s;
        if !(wanted_s.is_finite() && wanted_s > 0.0) {
            return false;
        }
        let usual_s = self.full.mean().map_or(f64::INFINITY, |load| load * libm::exp(-self.sent) * wanted_s);
        let work_s = turn.work_s.min(SPIKE * usual_s);
        let window = &mut self.window;
        window.turns += 1;
        window.span_s += turn.real_period_s.max(wanted_s);
        window.work_s += work_s;
        window.over_s += (work_s - wanted_s).max(0.0);
        window.wanted_s += wanted_s;
        window.late += turn.real_period_s / wanted_s;
        if self.beginning > 0 {
            return window.turns >= 1 << (BEGINNING - self.beginning);
        }
        // a turn of an agent that takes more than a core lasts long: before anything is known of it, its first turns are enough
        let is_lost = self.full.mean().is_none() && window.work_s > window.wanted_s;
        window.span_s >= WINDOW_S && (window.turns >= WINDOW_TURNS || is_lost)
    }

    /// Stores the load scaled to the finest level: in both ranges it falls as e⁻ᶻ (control.md, eq. 18). While the agent does less work than
    /// it may (for lack of visibility), the measurement says nothing of its full load and is skipped, unless none is known.
    fn note(&mut self, window: &Window) {
        let load = window.work_s / window.wanted_s;
        let reduced = self.sent > self.own_target && load <= self.limits.share * libm::exp(DEAD.1);
        if !reduced || self.full.mean().is_none() {
            self.full.note(load * libm::exp(self.sent));
        }
    }

    /// Updates the target of z by the agent's own work, and by delays from others (control.md, eq. 19).
    fn learn(&mut self, window: &Window) {
        let lateness = window.late / f64::from(window.turns) - window.over_s / window.wanted_s;
        self.late = if lateness > LATE { self.late + 1 } else { 0 };
        self.windows_in_time = if self.late > 0 { 0 } else { self.windows_in_time.saturating_add(1) };
        if self.late >= IN_A_ROW {
            self.coarsen_for_others(lateness);
        }
        if self.windows_in_time >= 2 * self.patience && self.refined_from.take().is_some() {
            self.patience = (self.patience / 2).max(PATIENCE.0);
        }
        let Some(full) = self.full.mean() else { return };
        let wish = libm::log(full / self.limits.share);
        let reduced = self.sent > self.own_target;
        let from = if reduced { self.sent } else { self.aim };
        let step = wish - from;
        self.rest = match () {
            () if wish > self.top + DEAD.1 => Some(Bound::Coarsest),
            () if self.own_target == 0.0 && step < DEAD.0 => Some(Bound::Finest),
            () => None,
        };
        if step > DEAD.1 {
            // not into the range of dt if the range of ε suffices
            let end = if wish <= self.eps_end + DEAD.1 { self.eps_end } else { self.top };
            self.aim = (wish - MIDDLE).min(end);
        } else if step < DEAD.0 && !reduced {
            self.refine(wish - MIDDLE);
        }
    }

    /// Delayed by others: the last refinement was too much, is reverted, and tried again after twice the wait.
    fn coarsen_for_others(&mut self, lateness: f64) {
        self.aim = (self.aim.max(self.sent) + self.gains.yielding * libm::log(lateness).min(ERROR_MAX)).min(self.top);
        if let Some(before) = self.refined_from.take() {
            self.patience = (2 * self.patience).min(PATIENCE.1);
            self.aim = self.aim.max(before);
        }
    }

    /// With time to spare: refines, once delays by others have ceased for long enough.
    fn refine(&mut self, to: f64) {
        if self.windows_in_time >= self.patience {
            let part = if self.patience == PATIENCE.0 { self.gains.refine * (self.own_target - to) } else { 0.0 };
            self.aim = to.max(self.own_target - part.max(REFINE_MAX)).max(0.0);
        }
    }

    fn demand_if_worth_it(&mut self) -> Option<RateDemand> {
        if self.is_worth_it(self.own_target, self.aim) {
            if self.aim < self.own_target {
                (self.refined_from, self.windows_in_time) = (Some(self.own_target), 0);
            }
            self.own_target = self.aim;
        }
        if !self.is_worth_it(self.sent, self.target()) {
            return None;
        }
        self.sent = self.target();
        Some(self.demand())
    }

    fn is_worth_it(&self, from: f64, to: f64) -> bool {
        to != from && ((to - from).abs() >= DEMAND_MIN || to <= 0.0 || to >= self.top)
    }

    /// The present demand.
    #[must_use]
    pub fn demand(&self) -> RateDemand {
        self.limits.demand(self.target())
    }

    /// The end of the range at which the agent rests: finest with time to spare, or coarsest and still late.
    #[must_use]
    pub fn rest(&self) -> Option<Bound> {
        self.rest
    }
}

/// ln(a/b); 0 if b is not below a or one of them is not a valid length.
fn ratio_ln(a: f64, b: f64) -> f64 {
    if a.is_finite() && b > 0.0 && a > b { libm::log(a / b) } else { 0.0 }
}

#[cfg(test)]
mod tests;
