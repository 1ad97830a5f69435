//! How another agent answers impulses, and where what it is given is booked.
//!
//! Theory: docs/theory/coupling.md, eq. 7 and 7a.

use super::Other;
use crate::Exchange;
use glam::{DMat3, DVec3};
use metachron_core::{Body, Inertia};
use metachron_core::{ContactJacobian, Impulse, Site};

impl Other {
    /// The inverse mass of what gathers from `slots`, 1/kg: J A⁻¹ Jᵀ.
    #[must_use]
    pub fn inverse_mass(&mut self, slots: &ContactJacobian) -> DMat3 {
        let mut answer = std::mem::take(&mut self.answer);
        answer.resize(self.velocities.len(), DVec3::ZERO);
        let mut column = |axis: DVec3| {
            answer.fill(DVec3::ZERO);
            slots.scatter(axis, &mut answer);
            self.respond(&mut answer);
            slots.velocity(&answer)
        };
        let whole = DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z));
        self.answer = answer;
        whole
    }

    /// Turns impulses, one a slot, into the velocities they cause: W of the coupling (eq. 7).
    ///
    /// # Panics
    /// Where there are not as many as [`Self::velocities`].
    pub fn respond(&self, impulses: &mut [DVec3]) {
        if let (Some(lean), [linear, angular]) = (&self.lean, &mut *impulses) {
            [*linear, *angular] = lean.respond([*linear, *angular]);
            return;
        }
        let inertia = self.neighbour.as_ref().filter(|_| !self.held).map(|n| &n.snapshot.inertia);
        match inertia {
            Some(Inertia::Rigid { inverse_mass, inverse_inertia }) => {
                let stand = self.stands(impulses[0], impulses[1]);
                let within = self.neighbour.as_ref().and_then(|n| n.snapshot.within.get());
                if let (Some(within), None, [linear, angular]) = (within, stand, &mut *impulses) {
                    [*linear, *angular] = within.times([*linear, *angular]);
                    return;
                }
                if let (Some(tips), [linear, angular]) = (self.tips(), &mut *impulses) {
                    [*linear, *angular] =
                        tips.answer((*inverse_mass, *inverse_inertia), [*linear, *angular], self.pressed);
                    return;
                }
                impulses[0] *= *inverse_mass;
                impulses[1] = *inverse_inertia * impulses[1];
                if stand.is_some() && self.lying.is_some() {
                    impulses.fill(DVec3::ZERO); // who bears it answers first
                } else if let Some(normal) = stand {
                    impulses[0] -= normal * normal.dot(impulses[0]);
                    impulses[1] = DVec3::ZERO;
                }
            }
            Some(Inertia::Deformable(response)) if response.slots() == impulses.len() => {
                response.respond(impulses, self.borne);
            }
            _ => impulses.fill(DVec3::ZERO),
        }
    }

    /// The normal of what it stands on, where such an impulse only presses it down there (eq. 7a).
    fn stands(&self, linear: DVec3, angular: DVec3) -> Option<DVec3> {
        let stand = self.grounded()?;
        let pressed = self.pressed.unwrap_or_else(|| self.is_pressed(&stand, Impulse { linear, angular }));
        pressed.then_some(stand.normal)
    }

    /// Lets impulses, one a slot, act on it: for the next `h` seconds, or at once where that is zero.
    pub fn push(&mut self, impulses: &[DVec3], h: f64) {
        let mut answer = std::mem::take(&mut self.answer);
        answer.clear();
        answer.extend_from_slice(impulses);
        self.respond(&mut answer);
        self.leave(answer[0]);
        self.velocities.iter_mut().zip(&answer).for_each(|(v, dv)| *v += *dv);
        if let (Some(lean), [linear, angular]) = (&mut self.lean, &answer[..]) {
            lean.push([*linear, *angular], h > 0.0);
        }
        self.answer = answer;
    }

    /// Books impulses, one a slot, that act from `after_s` seconds into the step on; on a body on springs they last for `h`.
    pub fn book(&self, exchange: &mut Exchange, (after_s, h): (f64, f64), impulses: &[DVec3]) {
        let after_s = if self.lean.is_some() { after_s + 0.5 * h } else { after_s };
        let Some(neighbour) = &self.neighbour else { return };
        if self.held && !matches!(neighbour.snapshot.body, Body::Tool(_)) {
            return; // a body at rest stands on something else, which takes the impulse
        }
        if matches!(neighbour.snapshot.body, Body::Soft(_)) {
            for (vertex, impulse) in impulses.iter().enumerate().filter(|(_, i)| **i != DVec3::ZERO) {
                let impulse = Impulse { linear: *impulse, angular: DVec3::ZERO };
                exchange.give(neighbour.id, Site::Vertex(vertex as u32), after_s, impulse);
            }
            return;
        }
        let Body::Curve(curve) = &neighbour.snapshot.body else {
            let impulse = Impulse { linear: impulses[0], angular: impulses[1] };
            match self.answered_s(after_s, impulse) {
                _ if impulse == Impulse::ZERO => {}
                Some(times_s) => exchange.give_late(neighbour.id, Site::Whole, times_s, impulse),
                None => exchange.give(neighbour.id, Site::Whole, after_s, impulse),
            }
            return;
        };
        for (slot, impulse) in impulses.iter().enumerate().filter(|(_, i)| **i != DVec3::ZERO) {
            let (site, impulse) = if slot % 2 == 0 {
                (curve.arc_m[slot / 2], Impulse { linear: *impulse, angular: DVec3::ZERO })
            } else {
                let middle = 0.5 * (curve.arc_m[slot / 2] + curve.arc_m[slot / 2 + 1]);
                (middle, Impulse { linear: DVec3::ZERO, angular: *impulse })
            };
            exchange.give(neighbour.id, Site::Arc(site), after_s, impulse);
        }
    }
}
