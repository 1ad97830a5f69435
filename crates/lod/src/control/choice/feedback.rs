//! Feedback: one loop variable for the scene, a pair (ε, n) for every object in view (GDC04).
//!
//! In: the objects in view, then the time of the frame. Out: demands. Never here: prices, the other policies. The corrected law controls
//! the polygons of the whole scene through ln ε̂, and the objects share them by covered area, distance and speed; the printed law controls
//! ε̂ and n of all tubes alike.
//! Theory: `docs/theory/control.md`, eq. 1, 7, 13 and 14.

use crate::Bound;
use crate::control::demand::level;
use crate::control::demand::level::LastCut;
use crate::control::demand::plan::{LevelDemand, SizedView, steers};
use crate::control::demand::policy::Law;
use crate::control::demand::status::Status;
use crate::control::demand::view::{Kind, ObjectView};
use crate::grisoni::{GrisoniLaw, Limits};
use crate::log_law::LogLaw;
use crate::share::{Share, water_level};
use metachron_core::{AgentId, N_MAX, Resolution};

/// Intervals of a tube at ε̂ = 1: ε̂ = 40 ε/L.
const INTERVALS_AT_ONE: f64 = 40.0;

/// Polygons of one tube at ε̂ = 1 and n = 0: converts the polygons of a scene to ε̂ (control.md, eq. 13).
pub(crate) const POLYGONS_AT_ONE: f64 = 12.0 * INTERVALS_AT_ONE;

/// Limits of ε̂ and n of the printed law while no tube is in view and n alone counts.
const LIMITS_WITHOUT_TUBES: Limits = Limits { eps: (0.005, 1.0), n: (0, N_MAX) };

/// The laws and their state.
#[derive(Debug, Clone)]
pub(crate) struct Feedback {
    law: Law,
    corrected: LogLaw,
    pub(crate) printed: GrisoniLaw,
    status: Status,
    /// Whether the loop variable has a value: from the first plan in which there is something to choose.
    started: bool,
    /// ln of the factor that [`Feedback::coarsen`] requested before that.
    pushed: f64,
    /// The water level of the last sharing: the starting guess for the next.
    water: f64,
    /// The last cut of each object, in the order in which they are given.
    held: Vec<(AgentId, LastCut)>,
}

impl Feedback {
    pub fn new(law: Law) -> Self {
        let limits = Limits { eps: (1e-6, 1e6), n: (0, N_MAX) };
        Self {
            law,
            corrected: LogLaw::new(law.log_gains(), (-20.0, 20.0), 0.0),
            printed: GrisoniLaw::new(law.printed_gains(), limits, 1.0, 0.0),
            status: Status::Waiting,
            started: false,
            pushed: 0.0,
            water: 1.0,
            held: Vec::new(),
        }
    }

    /// Updates the law: a frame of `polygons` polygons took `work_s` seconds, > 0.
    pub fn observe(&mut self, work_s: f64, target_hz: f64, polygons: f64) {
        if !self.started {
            return;
        }
        self.status = match self.law {
            Law::Corrected { .. } => {
                let granted = libm::log(POLYGONS_AT_ONE / polygons);
                let set_point_s = self.law.set_share() / target_hz;
                self.corrected.observe(work_s / set_point_s, Some(granted)).into()
            }
            Law::Printed { .. } => self.observe_as_printed(work_s, target_hz),
        };
    }

    fn observe_as_printed(&mut self, work_s: f64, target_hz: f64) -> Status {
        if !self.printed.observe(target_hz, 1.0 / work_s) {
            return self.status;
        }
        match self.printed.rest() {
            Some(bound) => Status::Clamped(bound),
            None if (work_s * target_hz - 1.0).abs() <= 0.05 => Status::Settled,
            None => Status::Moving,
        }
    }

    /// Chooses (ε, n) of every object for the next frame.
    pub fn plan(&mut self, views: &[SizedView], levels: &mut Vec<LevelDemand>) {
        self.held.resize(views.len(), (AgentId(0), LastCut::default()));
        for (SizedView { view, .. }, (of, held)) in views.iter().zip(&mut self.held) {
            if *of != view.id || !view.visible {
                *of = view.id;
                held.forget();
            }
        }
        match self.law {
            Law::Corrected { .. } => self.plan_corrected(views, levels),
            Law::Printed { .. } => self.plan_printed(views, levels),
        }
    }

    /// Shares the polygons that ln ε̂ represents among the objects (control.md, eq. 13 and 14).
    ///
    /// Bodies, whose levels are few and far apart, choose first; tubes, which follow exactly, share the rest.
    fn plan_corrected(&mut self, views: &[SizedView], levels: &mut Vec<LevelDemand>) {
        self.bound_corrected(views);
        let budget = POLYGONS_AT_ONE * libm::exp(-self.corrected.value());
        self.water = water_level(budget, in_view(views).map(share), self.water);
        let water = self.water;
        levels.extend(views.iter().map(|seen| unseen(&seen.view)));
        self.choose(views, levels, water, |view| !is_tube(view) && !view.is_group());
        let bodies = views.iter().zip(&*levels).filter(|(seen, _)| seen.view.visible && !is_tube(&seen.view));
        let taken: f64 = bodies.map(|(_, level)| level.polygons).sum();
        let tubes = in_view(views).filter(|seen| is_tube(&seen.view)).map(share);
        let water = water_level(budget - taken, tubes, water);
        self.choose(views, levels, water, is_tube);
    }

    /// Chooses the level of the objects in view that are `of` the kind, by their shares at `water`.
    fn choose(
        &mut self,
        views: &[SizedView],
        levels: &mut [LevelDemand],
        water: f64,
        of: impl Fn(&ObjectView) -> bool,
    ) {
        let all = views.iter().zip(levels).zip(&mut self.held);
        for ((seen, level), (_, held)) in all.filter(|((seen, _), _)| seen.view.visible && of(&seen.view)) {
            let cut = held.choose(&seen.view, seen.span, share(seen).at(water));
            (level.resolution, level.polygons) = (cut.resolution, cut.polygons);
        }
    }

    /// Keeps ln ε̂ between all objects in view at their finest and all at their coarsest.
    fn bound_corrected(&mut self, views: &[SizedView]) {
        let (least, most) = in_view(views).fold((0.0, 0.0), |(l, m), seen| (l + seen.span.least, m + seen.span.most));
        if least <= 0.0 {
            return; // nothing is in view: keep the present state
        }
        let range = (libm::log(POLYGONS_AT_ONE / most), libm::log(POLYGONS_AT_ONE / least));
        self.corrected.set_range(range);
        if !self.started && steers(views) {
            // includes the requests to `coarsen` before anything was in view
            self.corrected.set_value(0.5 * (range.0 + range.1) + self.pushed);
            self.started = true;
        }
    }

    /// ε̂ for all tubes, weighted; n = ⌊ρ⌋ for everything (GDC04, eq. 1).
    fn plan_printed(&mut self, views: &[SizedView], levels: &mut Vec<LevelDemand>) {
        let mean = mean_coarseness(views);
        self.bound_printed(views, mean);
        for SizedView { view, .. } in views {
            let eps_m = match view.kind {
                Kind::Tube { length_m, .. } => self.printed.eps() * length_m / INTERVALS_AT_ONE * weight(view, mean),
                Kind::Primitive { .. } | Kind::Counted { .. } | Kind::Group { .. } => view.range.eps_m.1,
            };
            let wish = Resolution { eps_m, n: self.printed.n() };
            let chosen = view.visible && !view.is_group();
            let resolution = if chosen { view.range.clamp(wish) } else { coarsest(view) };
            let polygons = level::polygons(view, resolution);
            levels.push(LevelDemand { id: view.id, resolution, polygons, shading: view.shading.1 });
        }
    }

    /// Keeps ε̂ and n where they change at least one tube in view.
    fn bound_printed(&mut self, views: &[SizedView], mean: f64) {
        let tubes = in_view(views).filter_map(|seen| Some((seen.view.range, eps_hat(&seen.view, mean)?)));
        let widest = |a: Limits, b: Limits| Limits {
            eps: (a.eps.0.min(b.eps.0), a.eps.1.max(b.eps.1)),
            n: (a.n.0.min(b.n.0), a.n.1.max(b.n.1)),
        };
        let limits = tubes
            .map(|(range, eps_hat)| Limits { eps: (range.eps_m.0 * eps_hat, range.eps_m.1 * eps_hat), n: range.n });
        let limits = limits.reduce(widest).unwrap_or(LIMITS_WITHOUT_TUBES);
        self.printed.set_limits(limits);
        if !self.started && steers(views) {
            let eps = libm::sqrt(limits.eps.0 * limits.eps.1) * libm::exp(self.pushed);
            let rho = 0.5 * (f64::from(limits.n.0) + f64::from(limits.n.1));
            self.printed = GrisoniLaw::new(self.law.printed_gains(), limits, eps, rho);
            self.started = true;
        }
    }

    /// Changes the law or its gains.
    pub fn set_law(&mut self, law: Law) {
        self.law = law;
        self.corrected.set_gains(law.log_gains());
        self.printed.set_gains(law.printed_gains());
    }

    /// Sets both laws to the state of the last plan.
    pub fn take_over(&mut self, views: &[SizedView], levels: &[LevelDemand], polygons: f64) {
        self.status = Status::Waiting;
        if polygons <= 0.0 {
            return;
        }
        self.corrected.set_value(libm::log(POLYGONS_AT_ONE / polygons));
        let mean = mean_coarseness(views);
        let drawn = views.iter().zip(levels).filter(|(seen, _)| seen.view.visible);
        let mut tubes =
            drawn.filter_map(|(seen, at)| Some((eps_hat(&seen.view, mean)? * at.resolution.eps_m, at.resolution.n)));
        if let Some((eps, n)) = tubes.next() {
            let limits = Limits { eps: (1e-9, 1e9), n: (0, N_MAX) }; // until the next plan
            self.printed = GrisoniLaw::new(self.law.printed_gains(), limits, eps, f64::from(n) + 0.5);
        }
        self.started = true;
    }

    /// Multiplies the scene's ε̂ by `factor` (finite, > 0).
    pub fn coarsen(&mut self, factor: f64) {
        self.corrected.set_value(self.corrected.value() + libm::log(factor));
        self.printed.coarsen(factor);
        self.pushed += if self.started { 0.0 } else { libm::log(factor) };
    }

    /// Sets ln ε̂ of the corrected law to the fraction `share` from its finest to its coarsest; without effect before it has a range.
    pub fn seek(&mut self, share: f64) {
        let (finest, coarsest) = self.corrected.range();
        if share.is_finite() && self.started {
            self.corrected.set_value(finest + share.clamp(0.0, 1.0) * (coarsest - finest));
        }
    }

    pub fn status(&self) -> Status {
        self.status
    }

    /// Whether everything in view is as coarse as it may be.
    pub fn is_coarsest(&self) -> bool {
        self.started
            && match self.law {
                Law::Corrected { .. } => self.corrected.value() >= self.corrected.range().1,
                Law::Printed { .. } => self.printed.rest() == Some(Bound::Coarsest),
            }
    }

    /// The loop variable ε̂: of the printed law, or of the corrected law (480 over the scene's polygons).
    pub fn eps_hat(&self) -> f64 {
        match self.law {
            Law::Corrected { .. } => libm::exp(self.corrected.value()),
            Law::Printed { .. } => self.printed.eps(),
        }
    }

    pub fn law(&self) -> Law {
        self.law
    }
}

fn in_view(views: &[SizedView]) -> impl Iterator<Item = &SizedView> + Clone {
    views.iter().filter(|seen| seen.view.visible)
}

/// The geometric mean of the tubes' coarseness: one tube alone has weight 1, and the law is exactly the printed one.
fn mean_coarseness(views: &[SizedView]) -> f64 {
    let tubes = in_view(views).filter(|seen| is_tube(&seen.view));
    let (sum, count) = tubes.fold((0.0, 0.0), |(s, c), seen| (s + libm::log(seen.view.coarseness_m2()), c + 1.0));
    if count > 0.0 { libm::exp(sum / count) } else { 1.0 }
}

fn is_tube(view: &ObjectView) -> bool {
    matches!(view.kind, Kind::Tube { .. })
}

/// The claim of an object in view on the polygons (control.md, eq. 14).
fn share(SizedView { view, span }: &SizedView) -> Share {
    Share { weight: 2.0 * view.surface_m2() / view.coarseness_m2(), least: span.least, most: span.most }
}

/// The demand of an object out of view: its coarsest, for its shadow.
pub(crate) fn unseen(view: &ObjectView) -> LevelDemand {
    let resolution = coarsest(view);
    LevelDemand { id: view.id, resolution, polygons: level::polygons(view, resolution), shading: view.shading.1 }
}

/// The coarsest resolution. This law always draws the members of groups, which share the polygons among themselves.
fn coarsest(view: &ObjectView) -> Resolution {
    let n = if view.is_group() { level::open(view) } else { view.range.n.0 };
    Resolution { eps_m: view.range.eps_m.1, n }
}

fn weight(view: &ObjectView, mean: f64) -> f64 {
    view.coarseness_m2() / mean
}

/// ε̂ of a tube per metre of its ε; `None` for other kinds.
fn eps_hat(view: &ObjectView, mean: f64) -> Option<f64> {
    let Kind::Tube { length_m, .. } = view.kind else { return None };
    Some(INTERVALS_AT_ONE / (length_m * weight(view, mean)))
}
