//! The picture's controller: one loop variable for the scene, a pair (ε, n) for every object in view (GDC04).
//!
//! In: what is in view, then what the frame took. Out: a [`Plan`]. Never here: drawing, measuring.
//! A frame is `plan`, draw, `observe`. The corrected law steers the polygons of the whole scene through ln ε̂, and the objects
//! share them by what they cover, how far they are and how fast they move; the printed law steers ε̂ and n of all tubes alike.
//! Theory: `docs/theory/control.md`, eq. 1, 7, 13 and 14.

use super::level::{self, Held, Span};
use super::status::Status;
use super::view::{Kind, Law, ObjectView, Policy, Shading};
use metachron_agents::{AgentId, N_MAX, Resolution};
use metachron_budget::grisoni::{GrisoniLaw, Limits};
use metachron_budget::log_law::LogLaw;
use metachron_budget::share::{Share, water_level};
use std::collections::BTreeMap;
use std::time::Duration;

/// Intervals of a tube at ε̂ = 1: ε̂ = 40 ε/L.
const INTERVALS_AT_ONE: f64 = 40.0;

/// Polygons of one tube at ε̂ = 1 and n = 0: by it the polygons of a scene are told as ε̂ (control.md, eq. 13).
const POLYGONS_AT_ONE: f64 = 12.0 * INTERVALS_AT_ONE;

/// Where ε̂ and n of the printed law move while no tube is in view and n alone counts.
const LIMITS_WITHOUT_TUBES: Limits = Limits { eps: (0.005, 1.0), n: (0, N_MAX) };

/// What the last frame took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameWork {
    /// The work of the frame: gather, choose, draw. Without any wait for a display or for the frame's time to come.
    pub work: Duration,
    /// Whether the frame must not teach: one of the first three, one with a new size or a new pipeline, a hidden window,
    /// the first after a gap of more than five frames.
    pub skip: bool,
}

/// What to draw one object with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelDemand {
    /// Which one.
    pub id: AgentId,
    /// Its pair (ε, n), inside its range; of a group n = 0 is its proxy, 1 its members.
    pub resolution: Resolution,
    /// Triangles to draw it with: of what is cut by triangles exactly so many. 0: it is left out of the picture, as members of a group
    /// are that is drawn by its proxy, and groups that are drawn as their members. Out of sight: its coarsest, for its shadow.
    pub polygons: f64,
    /// How to shade it.
    pub shading: Shading,
}

/// What to draw the next frame with.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// One entry for each object, in the order they were given.
    pub levels: Vec<LevelDemand>,
    /// Triangles of everything in view.
    pub polygons: f64,
    /// Triangles of everything in view at its finest: what the policy `full` would draw.
    pub full_polygons: f64,
}

/// Chooses the resolution of every picture from the measured work of frames.
#[derive(Debug, Clone)]
pub struct PictureControl {
    policy: Policy,
    law: Law,
    target_hz: f64,
    corrected: LogLaw,
    printed: GrisoniLaw,
    status: Status,
    /// Whether the loop variable has a value: from the first plan with something to choose on.
    started: bool,
    /// ln of what [`PictureControl::coarsen`] asked for before that.
    pushed: f64,
    /// Whether anything in view can be drawn in more than one way.
    steers: bool,
    /// The level of the last sharing: a guess for the next.
    water: f64,
    held: BTreeMap<AgentId, Held>,
    views: Vec<(ObjectView, Span)>,
    plan: Plan,
}

impl PictureControl {
    /// A controller for `target_hz` frames a second (finite, > 0), which begins in the middle of what it may do.
    #[must_use]
    pub fn new(policy: Policy, law: Law, target_hz: f64) -> Self {
        let limits = Limits { eps: (1e-6, 1e6), n: (0, N_MAX) };
        Self {
            policy,
            law,
            target_hz,
            corrected: LogLaw::new(law.log_gains(), (-20.0, 20.0), 0.0),
            printed: GrisoniLaw::new(law.printed_gains(), limits, 1.0, 0.0),
            status: Status::Waiting,
            started: false,
            pushed: 0.0,
            steers: false,
            water: 1.0,
            held: BTreeMap::new(),
            views: Vec::new(),
            plan: Plan::default(),
        }
    }

    /// Learns what the frame drawn by the last [`PictureControl::plan`] took.
    pub fn observe(&mut self, frame: FrameWork) {
        let work_s = frame.work.as_secs_f64();
        if frame.skip || work_s <= 0.0 || self.policy == Policy::Full || !self.started || !self.steers {
            return;
        }
        self.status = match self.law {
            Law::Corrected { .. } => {
                let granted = libm::log(POLYGONS_AT_ONE / self.plan.polygons);
                self.corrected.observe(work_s / self.set_point_s(), Some(granted)).into()
            }
            Law::Printed { .. } => self.observe_as_printed(work_s),
        };
    }

    fn observe_as_printed(&mut self, work_s: f64) -> Status {
        if !self.printed.observe(self.target_hz, 1.0 / work_s) {
            return self.status;
        }
        match self.printed.rest() {
            Some(bound) => Status::Clamped(bound),
            None if (work_s * self.target_hz - 1.0).abs() <= 0.05 => Status::Settled,
            None => Status::Moving,
        }
    }

    /// Chooses (ε, n) of every object for the next frame.
    pub fn plan(&mut self, objects: &[ObjectView]) -> &Plan {
        self.look(objects);
        self.plan.levels.clear();
        match (self.policy, self.law) {
            (Policy::Full, _) => self.plan_full(),
            (Policy::Feedback, Law::Corrected { .. }) => self.plan_corrected(),
            (Policy::Feedback, Law::Printed { .. }) => self.plan_printed(),
        }
        let drawn = self.views.iter().zip(&self.plan.levels).filter(|((view, _), _)| view.visible);
        self.plan.polygons = drawn.map(|(_, level)| level.polygons).sum();
        self.plan.full_polygons = self.in_view().map(|(_, span)| span.full).sum();
        &self.plan
    }

    /// What the last frame was to be drawn with.
    #[must_use]
    pub fn last_plan(&self) -> &Plan {
        &self.plan
    }

    /// Keeps what is in view with its polygons, its speed smoothed.
    fn look(&mut self, objects: &[ObjectView]) {
        self.views.clear();
        for object in objects {
            let held = self.held.entry(object.id).or_default();
            let view = if object.visible { held.steady(*object) } else { *object };
            self.views.push((view, Span::of(&view)));
        }
        let steers = self.in_view().any(|(_, span)| span.most > span.least);
        self.steers = steers;
        if self.policy == Policy::Full {
            self.status = Status::Full;
        } else if !self.steers && self.in_view().next().is_some() {
            self.status = Status::Fixed;
        } else if matches!(self.status, Status::Full | Status::Fixed) {
            self.status = Status::Waiting;
        }
    }

    fn in_view(&self) -> impl Iterator<Item = &(ObjectView, Span)> + Clone {
        self.views.iter().filter(|(view, _)| view.visible)
    }

    fn plan_full(&mut self) {
        for (view, span) in &self.views {
            let resolution = Resolution { eps_m: view.range.eps_m.0, n: view.range.n.1 };
            self.plan.levels.push(LevelDemand {
                id: view.id,
                resolution,
                polygons: span.full,
                shading: view.shading.1,
            });
        }
    }

    /// The polygons that ln ε̂ stands for, shared out (control.md, eq. 13 and 14).
    ///
    /// Bodies, whose levels are few and far apart, choose first; tubes, which follow exactly, share what is then left.
    fn plan_corrected(&mut self) {
        self.bound_corrected();
        let budget = POLYGONS_AT_ONE * libm::exp(-self.corrected.value());
        self.water = water_level(budget, self.in_view().map(share), self.water);
        let water = self.water;
        self.plan.levels.extend(self.views.iter().map(|(view, _)| unseen(view)));
        self.choose(water, |view| !is_tube(view) && !is_group(view));
        let bodies = self.views.iter().zip(&self.plan.levels).filter(|((view, _), _)| view.visible && !is_tube(view));
        let taken: f64 = bodies.map(|(_, level)| level.polygons).sum();
        let tubes = self.in_view().filter(|(view, _)| is_tube(view)).map(share);
        let water = water_level(budget - taken, tubes, water);
        self.choose(water, is_tube);
    }

    /// Chooses the level of those in view that are `of` the kind, by their shares at `water`.
    fn choose(&mut self, water: f64, of: impl Fn(&ObjectView) -> bool) {
        let all = self.views.iter().zip(&mut self.plan.levels);
        for (seen, level) in all.filter(|((view, _), _)| of(view)) {
            let held = self.held.entry(seen.0.id).or_default();
            if seen.0.visible {
                (level.resolution, level.polygons) = held.choose(&seen.0, seen.1, share(seen).at(water));
            } else {
                held.forget();
            }
        }
    }

    /// Keeps ln ε̂ between all finest and all coarsest of what is in view now.
    fn bound_corrected(&mut self) {
        let (least, most) = self.in_view().fold((0.0, 0.0), |(l, m), (_, span)| (l + span.least, m + span.most));
        if least <= 0.0 {
            return; // nothing is in view: wait with what is known
        }
        let range = (libm::log(POLYGONS_AT_ONE / most), libm::log(POLYGONS_AT_ONE / least));
        self.corrected.set_range(range);
        if !self.started && self.steers {
            // whatever `coarsen` asked for before there was anything to see
            self.corrected.set_value(0.5 * (range.0 + range.1) + self.pushed);
            self.started = true;
        }
    }

    /// ε̂ for all tubes, weighted; n = ⌊ρ⌋ for everything (GDC04, eq. 1).
    fn plan_printed(&mut self) {
        let mean = self.mean_coarseness();
        self.bound_printed(mean);
        for (view, _) in &self.views {
            let held = self.held.entry(view.id).or_default();
            if !view.visible {
                held.forget();
            }
            let eps_m = match view.kind {
                Kind::Tube { length_m, .. } => self.printed.eps() * length_m / INTERVALS_AT_ONE * weight(view, mean),
                Kind::Primitive { .. } | Kind::Counted { .. } | Kind::Group { .. } => view.range.eps_m.1,
            };
            let wish = Resolution { eps_m, n: self.printed.n() };
            let chosen = view.visible && !is_group(view);
            let resolution = if chosen { view.range.clamp(wish) } else { coarsest(view) };
            let polygons = level::polygons(view, resolution);
            self.plan.levels.push(LevelDemand { id: view.id, resolution, polygons, shading: view.shading.1 });
        }
    }

    /// Keeps ε̂ and n where they change at least one tube in view.
    fn bound_printed(&mut self, mean: f64) {
        let tubes = self.in_view().filter_map(|(view, _)| Some((view.range, eps_hat(view, mean)?)));
        let widest = |a: Limits, b: Limits| Limits {
            eps: (a.eps.0.min(b.eps.0), a.eps.1.max(b.eps.1)),
            n: (a.n.0.min(b.n.0), a.n.1.max(b.n.1)),
        };
        let limits = tubes
            .map(|(range, eps_hat)| Limits { eps: (range.eps_m.0 * eps_hat, range.eps_m.1 * eps_hat), n: range.n });
        let limits = limits.reduce(widest).unwrap_or(LIMITS_WITHOUT_TUBES);
        self.printed.set_limits(limits);
        if !self.started && self.steers {
            let eps = libm::sqrt(limits.eps.0 * limits.eps.1) * libm::exp(self.pushed);
            let rho = 0.5 * (f64::from(limits.n.0) + f64::from(limits.n.1));
            self.printed = GrisoniLaw::new(self.law.printed_gains(), limits, eps, rho);
            self.started = true;
        }
    }

    /// The geometric mean of the tubes' coarseness: one tube alone has weight 1, and the law is exactly the printed one.
    fn mean_coarseness(&self) -> f64 {
        let tubes = self.in_view().filter(|(view, _)| is_tube(view));
        let (sum, count) = tubes.fold((0.0, 0.0), |(s, c), (view, _)| (s + libm::log(view.coarseness_m2()), c + 1.0));
        if count > 0.0 { libm::exp(sum / count) } else { 1.0 }
    }

    /// Changes the policy. The loop goes on from the picture as it is.
    pub fn set_policy(&mut self, policy: Policy) {
        if policy != self.policy {
            self.policy = policy;
            self.take_over();
        }
    }

    /// Changes the law or its gains. Another law goes on from the picture as it is.
    pub fn set_law(&mut self, law: Law) {
        let other = std::mem::discriminant(&law) != std::mem::discriminant(&self.law);
        self.law = law;
        self.corrected.set_gains(law.log_gains());
        self.printed.set_gains(law.printed_gains());
        if other {
            self.take_over();
        }
    }

    /// Changes the wanted frame rate: frames a second, finite, > 0. Anything else is ignored.
    pub fn set_target_hz(&mut self, target_hz: f64) {
        if target_hz.is_finite() && target_hz > 0.0 {
            self.target_hz = target_hz;
        }
    }

    /// Puts both laws where the last plan is.
    fn take_over(&mut self) {
        self.status = Status::Waiting;
        if self.plan.polygons <= 0.0 {
            return;
        }
        self.corrected.set_value(libm::log(POLYGONS_AT_ONE / self.plan.polygons));
        let mean = self.mean_coarseness();
        let drawn = self.views.iter().zip(&self.plan.levels).filter(|((view, _), _)| view.visible);
        let mut tubes =
            drawn.filter_map(|((view, _), at)| Some((eps_hat(view, mean)? * at.resolution.eps_m, at.resolution.n)));
        if let Some((eps, n)) = tubes.next() {
            let limits = Limits { eps: (1e-9, 1e9), n: (0, N_MAX) }; // until the next plan
            self.printed = GrisoniLaw::new(self.law.printed_gains(), limits, eps, f64::from(n) + 0.5);
        }
        self.started = true;
    }

    /// Multiplies the scene's ε̂ by `factor` (finite, > 0; above 1 is coarser), as far as the ranges allow: another start, or a push.
    pub fn coarsen(&mut self, factor: f64) {
        if factor.is_finite() && factor > 0.0 {
            self.corrected.set_value(self.corrected.value() + libm::log(factor));
            self.printed.coarsen(factor);
            self.pushed += if self.started { 0.0 } else { libm::log(factor) };
        }
    }

    /// What the controller is doing; its text is for the viewer and the report.
    #[must_use]
    pub fn status(&self) -> Status {
        self.status
    }

    /// The loop variable ε̂: as printed, or of the corrected law (480 over the scene's polygons).
    #[must_use]
    pub fn eps_hat(&self) -> f64 {
        match self.law {
            Law::Corrected { .. } => libm::exp(self.corrected.value()),
            Law::Printed { .. } => self.printed.eps(),
        }
    }

    /// The work a frame is to take, seconds: T_set = (1 − margin)/target.
    #[must_use]
    pub fn set_point_s(&self) -> f64 {
        self.law.set_share() / self.target_hz
    }

    /// The policy in use.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.policy
    }

    /// The law in use.
    #[must_use]
    pub fn law(&self) -> Law {
        self.law
    }

    /// The wanted frame rate, frames a second.
    #[must_use]
    pub fn target_hz(&self) -> f64 {
        self.target_hz
    }
}

fn is_tube(view: &ObjectView) -> bool {
    matches!(view.kind, Kind::Tube { .. })
}

fn is_group(view: &ObjectView) -> bool {
    matches!(view.kind, Kind::Group { .. })
}

/// What an object in view may get of the polygons (control.md, eq. 14).
fn share((view, span): &(ObjectView, Span)) -> Share {
    Share { weight: 2.0 * view.surface_m2() / view.coarseness_m2(), least: span.least, most: span.most }
}

fn unseen(view: &ObjectView) -> LevelDemand {
    let resolution = coarsest(view);
    LevelDemand { id: view.id, resolution, polygons: level::polygons(view, resolution), shading: view.shading.1 }
}

/// Groups are opened by this law, always: their members make room for each other.
fn coarsest(view: &ObjectView) -> Resolution {
    let n = if is_group(view) { level::OPEN } else { view.range.n.0 };
    Resolution { eps_m: view.range.eps_m.1, n }
}

fn weight(view: &ObjectView, mean: f64) -> f64 {
    view.coarseness_m2() / mean
}

/// ε̂ of a tube for each metre of its ε; `None` for a primitive.
fn eps_hat(view: &ObjectView, mean: f64) -> Option<f64> {
    let Kind::Tube { length_m, .. } = view.kind else { return None };
    Some(INTERVALS_AT_ONE / (length_m * weight(view, mean)))
}

#[cfg(test)]
mod tests;
