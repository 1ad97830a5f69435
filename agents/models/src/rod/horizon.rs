//! What a tube would do by itself in its next step, or in one of a slower owner: how an owner has to expect it.
//!
//! In: a tube between two of its steps, and who owns its contacts. Out: the accelerations of one implicit step, of a slower
//! owner's length with its factor. Never here: the tube's own motion. Theory: docs/theory/coupling.md, eq. 7e; soft.md, eq. 16e.

use super::anchor_springs::Tie;
use super::banded_ldl::Factor;
use super::contact::respond;
use super::inertia::momenta;
use super::method::Integrator;
use super::publish::bounds;
use super::state::RodState;
use super::step::{Setting, Stepper};
use super::system::{Iterate, SubstepProblem, assemble};
use super::tube::Tube;
use glam::DVec3;
use metachron_contact::Law;
use metachron_contact::beside::{PART_MAX_S, bends, is_linked, may_touch};
use metachron_contact::{Neighbour, StepContext};
use metachron_core::Body;
use std::cell::LazyCell;

/// An owner that is behind by more of the longer of both steps does not keep up.
const BEHIND_STEPS: f64 = 2.0;
/// An owner is slower if its steps are longer by more than this share.
const SLOWER: f64 = 1.01;

/// A step that is only foreseen.
#[derive(Debug, Clone, Default)]
pub struct Horizon {
    factor: Factor,
    /// The same where the tube lies on something fixed.
    standing: Factor,
    /// Its length, seconds; zero where no slower owner is near.
    span_s: f64,
}

impl Horizon {
    /// The factor of the foreseen step, where there is one.
    pub fn factor(&self) -> Option<&Factor> {
        (self.span_s > 0.0).then_some(&self.factor)
    }

    /// The same with what the tube lies on.
    pub fn standing(&self) -> Option<&Factor> {
        (self.span_s > 0.0).then_some(&self.standing)
    }

    /// Nobody needs it.
    pub fn forget(&mut self) {
        self.span_s = 0.0;
    }
}

impl Tube {
    /// Works out what owners that bend may expect of a tube that has just made a step of `dt` seconds: of one that touches nothing that moves
    /// its next step where they are soft, keep up with it, and no link joins it to them; and where they are slower one step of theirs.
    pub(super) fn foresee(&mut self, around: &StepContext<'_>, dt: f64) {
        self.stepper.horizon.forget();
        if self.is_foretold(around, dt) {
            return;
        }
        self.ahead_s = 0.0;
        // beside this one it makes no longer steps
        let steps_s = self.owners(around, dt).map(|n| n.step_s.min(PART_MAX_S));
        // to a faster one among them the tube must not look too heavy
        let span_s = steps_s.fold(f64::INFINITY, f64::min);
        let slower = span_s > SLOWER * dt;
        let soft = self
            .owners(around, dt)
            .all(|n| matches!(n.snapshot.body, Body::Soft(_)) && !is_linked(n, around) && keeps_up(n, around, dt));
        let alone =
            soft && self.spec.integrator == Integrator::ImplicitEuler && !self.stepper.contacts.touches_what_moves();
        if !(span_s.is_finite() && (slower || alone)) {
            return;
        }
        let [mut gained, mut standing] =
            [&mut self.accelerations, &mut self.standing_accelerations].map(std::mem::take);
        let span_s = slower.then_some(span_s);
        let look = |stepper: &mut Stepper, now: &mut RodState, setting: &Setting<'_>, _: &mut [Tie]| {
            stepper.look_ahead(now, setting, span_s, [&mut gained, &mut standing])
        };
        let ahead_s = self.step_by(dt, look);
        (self.accelerations, self.standing_accelerations) = (gained, standing);
        if soft {
            self.ahead_s = ahead_s.unwrap_or(0.0);
        } else {
            for list in [&mut self.accelerations, &mut self.standing_accelerations] {
                list.iter_mut().skip(1).step_by(2).for_each(|turning| *turning = DVec3::ZERO);
            }
        }
    }

    /// Whether the owners of its contacts expect of the tube the step of [`Self::foretell`] after one of `dt` seconds: tubes with steps
    /// as long, and soft bodies where it touches what moves, as long as that presses as it did. One whole substep, implicit, tells how the
    /// next one goes.
    pub(super) fn is_foretold(&self, around: &StepContext<'_>, dt: f64) -> bool {
        let Self { stepper, now, accelerations, spec, .. } = self;
        let slots = now.u.len();
        let whole = stepper.span_s() == dt && stepper.factor().slots() == slots && accelerations.len() == slots;
        let touches = stepper.contacts.touches_what_moves();
        if !whole || spec.integrator != Integrator::ImplicitEuler || (touches && !stepper.presses.lasts()) {
            return false;
        }
        let lasts = |n: &Neighbour| (n.step_s.min(PART_MAX_S) - dt).abs() < (SLOWER - 1.0) * dt;
        let alike = |n: &Neighbour| match n.snapshot.body {
            Body::Curve(_) => lasts(n),
            Body::Soft(_) => touches,
            _ => false,
        };
        let alike = |n: &Neighbour| alike(n) && !is_linked(n, around) && keeps_up(n, around, dt);
        let mut owners = self.owners(around, dt).peekable();
        owners.peek().is_some() && owners.all(alike)
    }

    /// Who has a say in the step after one of `dt` seconds: of those that own contact with the tube who presses on it, or who may touch it
    /// in a step of theirs while nobody does; and who is linked to it.
    fn owners<'a>(&'a self, around: &'a StepContext<'_>, dt: f64) -> impl Iterator<Item = &'a Neighbour> {
        // most of the time nobody asks
        let bounds = LazyCell::new(|| bounds(&self.now, self.widest_m()));
        let presses = |n: &Neighbour| n.snapshot.pairs.iter().any(|pair| pair.with == around.me && pair.contacts > 0);
        let pressed = around.neighbours.iter().any(|n| owns_it(n, around) && presses(n));
        let acts = move |n: &Neighbour| {
            if pressed { presses(n) } else { may_touch(n, around, &bounds, dt.max(n.step_s)) }
        };
        around.neighbours.iter().filter(move |n| owns_it(n, around) && (is_linked(n, around) || acts(n)))
    }

    /// Foretells the step after one of `dt` seconds, whose velocities at its start stand where the accelerations go
    /// (docs/theory/coupling.md, eq. 7i).
    pub(super) fn foretell(&mut self, dt: f64) {
        let Self { now, matter, division, accelerations: list, stepper, .. } = self;
        list.iter_mut().zip(&now.u).for_each(|(began, u)| *began = *u * (2.0 + dt * matter.damping) - *began);
        momenta(matter.mu, matter.rotary, division.length.iter().copied().zip(now.t.iter().copied()), list);
        list.iter_mut().zip(stepper.company.spent()).for_each(|(momentum, spent)| *momentum -= *spent);
        list.iter_mut().zip(stepper.presses.blows()).for_each(|(momentum, blow)| *momentum -= blow * dt);
        let standing = stepper.footing.factor();
        self.standing_accelerations.extend(list.iter().filter(|_| standing.is_some()));
        let accelerate = |factor: &Factor, list: &mut Vec<DVec3>| {
            respond(factor, matter.held, list);
            list.iter_mut().zip(&now.u).for_each(|(then, u)| *then = (*then - *u) / dt);
        };
        accelerate(stepper.factor(), list);
        standing.into_iter().for_each(|standing| accelerate(standing, &mut self.standing_accelerations));
        self.ahead_s = dt;
    }
}

impl Stepper {
    /// Solves one implicit step from `now`, of `span_s` seconds by a factor of its own, or as long as the last substep and by the factor
    /// of that. How it accelerates every slot goes to `gained`, and how it does with what it lies on to `standing`. Returns the length of the
    /// step; `None` where it has no factor.
    fn look_ahead(
        &mut self,
        now: &RodState,
        setting: &Setting<'_>,
        span_s: Option<f64>,
        [gained, standing]: [&mut Vec<DVec3>; 2],
    ) -> Option<f64> {
        let Setting { matter, division, springs, integrator, .. } = *setting;
        let h = span_s.unwrap_or(self.span_s);
        if span_s.is_none() && (h <= 0.0 || self.factor.slots() != now.u.len()) {
            return None;
        }
        let scene = SubstepProblem { matter, division, springs, ties: &[], h, until: h, integrator };
        let Self { rows, rhs, factor, horizon, footing, .. } = self;
        assemble(&scene, &Iterate { start: now, at: now, first: true }, rows, rhs);
        let lies = !footing.stance.is_empty();
        standing.clear();
        standing.extend(rhs.iter().filter(|_| lies));
        if span_s.is_some() {
            horizon.factor.factor(rows).ok()?;
            if lies {
                footing.bear(rows, matter.held);
                horizon.standing.factor(rows).ok()?;
            }
            horizon.span_s = h;
        }
        horizon.factor().unwrap_or(factor).solve(rhs);
        horizon.standing().or(footing.factor()).filter(|_| lies).into_iter().for_each(|factor| factor.solve(standing));
        gained.clear();
        gained.extend_from_slice(rhs);
        for list in [gained, standing] {
            list.iter_mut().zip(&now.u).for_each(|(then, now)| *then = (*then - *now) / h);
        }
        Some(h)
    }
}

/// Whether an owner is not so far behind a tube with steps of `dt` that what it gives comes whole steps late.
fn keeps_up(owner: &Neighbour, around: &StepContext<'_>, dt: f64) -> bool {
    around.time.secs_after(owner.snapshot.time) <= BEHIND_STEPS * owner.step_s.max(dt)
}

/// Whether a neighbour computes the contacts or links with this tube, and expects it by its factor.
pub fn owns_it(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    let meets = neighbour.law == Law::Cluster && neighbour.form.is_some();
    bends(neighbour) && !neighbour.owned && (meets || is_linked(neighbour, around))
}
