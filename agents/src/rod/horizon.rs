//! What a tube would do by itself in one step of a slower owner: how such an owner has to expect it.
//!
//! In: a tube between two of its steps, and who owns its contacts. Out: the factor and the accelerations of one implicit step of
//! the owner's length. Never here: the tube's own motion. Theory: docs/theory/coupling.md, eq. 7e.

use super::band::Factor;
use super::config::Config;
use super::step::{Setting, Stepper};
use super::system::{Iterate, Scene, assemble};
use super::tube::Tube;
use crate::coupling::Law;
use crate::coupling::beside::{PART_MAX_S, bends, is_linked};
use crate::{Neighbour, Surroundings};
use glam::DVec3;

/// An owner is slower if its steps are longer by more than this share.
const SLOWER: f64 = 1.01;

/// A step that is only foreseen.
#[derive(Debug, Clone, Default)]
pub struct Horizon {
    factor: Factor,
    /// Its length, seconds; zero where no slower owner is near.
    span_s: f64,
}

impl Horizon {
    /// The factor of the foreseen step, where there is one.
    pub fn factor(&self) -> Option<&Factor> {
        (self.span_s > 0.0).then_some(&self.factor)
    }

    /// Nobody needs it.
    pub fn forget(&mut self) {
        self.span_s = 0.0;
    }
}

impl Tube {
    /// Works out what slower owners may expect of a tube that has just made a step of `dt` seconds.
    pub(super) fn foresee(&mut self, around: &Surroundings<'_>, dt: f64) {
        self.stepper.horizon.forget();
        // beside this one it makes no longer steps
        let steps_s = around.neighbours.iter().filter(|n| owns_it(n, around)).map(|n| n.step_s.min(PART_MAX_S));
        // to a faster one among them the tube must not look too heavy
        let span_s = steps_s.fold(f64::INFINITY, f64::min);
        if !(span_s.is_finite() && span_s > SLOWER * dt) {
            return;
        }
        let mut gained = std::mem::take(&mut self.accelerations);
        self.step_by(dt, |stepper, now, setting, _| stepper.look_ahead(now, setting, (span_s, &mut gained)));
        self.accelerations = gained;
    }
}

impl Stepper {
    /// Solves one implicit step of `span_s` seconds from `now`: how it accelerates every node goes to `gained`, which stays as
    /// it is where the step has no factor.
    fn look_ahead(&mut self, now: &Config, setting: &Setting<'_>, (span_s, gained): (f64, &mut Vec<DVec3>)) {
        let Setting { matter, division, springs, integrator, .. } = *setting;
        let scene = Scene { matter, division, springs, ties: &[], h: span_s, until: span_s, integrator };
        let Self { rows, rhs, horizon, .. } = self;
        assemble(&scene, &Iterate { start: now, at: now, first: true }, rows, rhs);
        if horizon.factor.factor(rows).is_err() {
            return;
        }
        horizon.factor.solve(rhs);
        horizon.span_s = span_s;
        let changes = rhs.iter().step_by(2).zip(now.u.iter().step_by(2));
        gained.clear();
        gained.extend(changes.map(|(then, v)| (*then - *v) / span_s));
    }
}

/// Whether a neighbour computes the contacts or links with this tube, and expects it by its factor.
pub fn owns_it(neighbour: &Neighbour, around: &Surroundings<'_>) -> bool {
    let meets = neighbour.law == Law::Ledger && neighbour.form.is_some();
    bends(neighbour) && !neighbour.owned && (meets || is_linked(neighbour, around))
}
