//! How tools that press a body resist what a shared world does to it in the same part.
//!
//! In: what a tool's contacts gave in a part, solved with the body alone. Out: how the tool resists a further change of the body's
//! velocities, and what that gives it. Never here: the shared world. Theory: docs/theory/coupling.md, eq. 9g.

use super::company::Company;
use glam::DVec3;
use metachron_core::{Mat6, Twist};

/// A tool on a body in a part, all its contacts as one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leant {
    /// Which guest.
    guest: usize,
    /// What one newton second of it is on the body, about its centre of mass.
    along: Twist,
    /// How much a push along it takes to move the tool, kg.
    mass_kg: f64,
    /// What it gave in the part, N·s.
    impulse_n_s: f64,
}

impl Leant {
    /// Guest `guest` gave `impulse`, where a tool that moves did.
    pub(super) fn new(company: &Company, guest: usize, [linear, angular]: Twist) -> Option<Self> {
        let impulse_n_s = linear.length();
        let along = [linear / impulse_n_s, angular / impulse_n_s];
        let mut answer = [along[0], DVec3::ZERO];
        company.guests()[guest].other.respond(&mut answer);
        let mass_kg = along[0].dot(answer[0]).recip();
        (impulse_n_s > 0.0 && mass_kg.is_finite()).then_some(Self { guest, along, mass_kg, impulse_n_s })
    }

    /// What it gives besides where the body's velocities change so, N·s: never so much less that it would pull.
    fn gives(&self, change: Twist) -> f64 {
        let faster = self.along[0].dot(change[0]) + self.along[1].dot(change[1]);
        (-self.mass_kg * faster).max(-self.impulse_n_s)
    }
}

/// How all of them resist a change of the body's velocities, kg, kg·m and kg·m².
pub(super) fn resistance(all: &[Leant]) -> Option<Mat6> {
    let mut sum = Mat6::ZERO;
    all.iter().for_each(|leant| sum.add_outer(leant.along, leant.mass_kg));
    (!all.is_empty()).then_some(sum)
}

/// Gives the tools what a `change` of the body's velocities gives them in the `h` seconds from `after_s` seconds into the step on; what
/// the body got of it, N·s.
pub(super) fn give(all: &[Leant], company: &mut Company, change: Twist, (after_s, h): (f64, f64)) -> DVec3 {
    let mut got = DVec3::ZERO;
    for leant in all {
        let impulse = leant.along[0] * leant.gives(change);
        let (guests, exchange, ..) = company.split();
        let other = &mut guests[leant.guest].other;
        let given = [-impulse, DVec3::ZERO];
        other.book(exchange, (after_s, h), &given);
        other.push(&given, h);
        got += impulse;
    }
    got
}
