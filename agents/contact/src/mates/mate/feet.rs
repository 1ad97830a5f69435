//! How a rigid body stands on what something fixed presses from below.
//!
//! In: contacts and their impulses, which of the owner's slots something fixed presses. Out: the places where the body stands.
//! Never here: solves. Theory: docs/theory/coupling.md, eq. 7l.

use crate::Contact;
use glam::DVec3;
use metachron_core::Stand;
use metachron_core::snapshot::{Footprint, STANDING_M_S};

/// The share of what the body is given that something fixed has to give its owner at the same places.
const CARRIED: f64 = 0.99;

/// The places at which a body was pressed in a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Feet {
    print: Footprint,
    /// What it was given in all, and where something fixed stands against it, N·s.
    all_n_s: f64,
    carried_n_s: f64,
    /// How far it has come in how long.
    way: DVec3,
    span_s: f64,
}

impl Feet {
    /// Takes in a contact with a body around `centre` whose slots begin at `first`.
    pub fn add(&mut self, contact: &Contact, impulse: DVec3, (centre, first, fixed): (DVec3, usize, &[bool])) {
        let along = impulse.dot(contact.normal);
        let Some(arm) = contact.jacobian.arm_from(first).filter(|_| along > 0.0) else { return };
        self.all_n_s += along;
        if !contact.jacobian.is_fixed(fixed) {
            return;
        }
        self.carried_n_s += along;
        self.print.add(centre - arm, -contact.normal);
    }

    /// It has come by `way` in `h` seconds.
    pub fn go(&mut self, way: DVec3, h: f64) {
        (self.way, self.span_s) = (self.way + way, self.span_s + h);
    }

    /// How it stands there, if it does, and how it moves, where `weight_m_s2` tells how fast it would fall along a normal.
    pub fn stand(&self, weight_m_s2: impl Fn(DVec3) -> f64) -> Option<(Stand, DVec3)> {
        let normal = self.print.normal().filter(|_| self.carried_n_s > CARRIED * self.all_n_s)?;
        let velocity = self.way / self.span_s;
        if !velocity.is_finite() || velocity.dot(normal).abs() > STANDING_M_S {
            return None;
        }
        Some((self.print.stand(normal, weight_m_s2(normal), 0.0), velocity))
    }
}
