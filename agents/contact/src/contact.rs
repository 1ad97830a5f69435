//! One contact: which velocities it joins, and the conditions it puts on them (docs/theory/contact.md, eq. 1–4).

use glam::DVec3;
use metachron_core::ContactJacobian;

/// Share of a penetration that a step corrects: 0.2 of the depth. More turns depth into speed: at 1 a body placed 1 cm
/// deep leaves at 2.5 m/s with steps of 4 ms.
pub const PUSH_OUT_SHARE: f64 = 0.2;

/// The fastest push-out, m/s: a body found deep inside another comes out slowly instead of being shot out.
pub(crate) const PUSH_OUT_MAX_M_S: f64 = 0.5;

/// The velocity by which an overlap, a gap below zero, is corrected over `span_s` seconds: below zero, m/s.
pub(crate) fn push_out_m_s(gap_m: f64, span_s: f64) -> f64 {
    (gap_m * PUSH_OUT_SHARE / span_s).max(-PUSH_OUT_MAX_M_S)
}

/// A place where two bodies touch, or may touch within the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Its name from step to step, for the warm start; unique, and contacts are listed by rising keys.
    pub key: u64,
    /// The velocities it joins.
    pub jacobian: ContactJacobian,
    /// Unit normal: away from the other body, so that a rising gap has a positive normal velocity.
    pub normal: DVec3,
    /// Distance of the surfaces, metres; below zero they overlap.
    pub gap_m: f64,
    /// Coulomb friction coefficient, ≥ 0.
    pub friction: f64,
    /// Speed at which the surfaces must part, m/s, ≥ 0: restitution times the speed of the approach. Zero for contact
    /// that does not bounce.
    pub rebound_m_s: f64,
    /// The velocity across the normal by which the two bodies are to return to where friction holds them, m/s, with reversed sign:
    /// friction brings u + this to zero.
    pub back_m_s: DVec3,
    /// Age of the other body's state, seconds, ≥ 0. A depth is corrected over this time where it is longer than the step: the effect
    /// of a push-out becomes visible only that much later.
    pub age_s: f64,
}

impl Contact {
    /// The velocity added to the real normal velocity before the condition u·n + bias ≥ 0 (eq. 3, 4).
    #[must_use]
    pub fn bias_m_s(&self, h: f64) -> f64 {
        let bias = if self.gap_m >= 0.0 { self.gap_m / h } else { push_out_m_s(self.gap_m, h.max(self.age_s)) };
        if self.rebound_m_s > 0.0 { bias.min(-self.rebound_m_s) } else { bias }
    }

    /// Stops pushing out an overlap: neither depth nor rebound count any more.
    pub fn stop_push_out(&mut self) {
        (self.gap_m, self.rebound_m_s) = (self.gap_m.max(0.0), 0.0);
    }

    /// The impulse nearest to `impulse` that the contact can give (eq. 7): no pull, friction inside its disc.
    #[must_use]
    pub fn project(&self, impulse: DVec3) -> DVec3 {
        let along = impulse.dot(self.normal);
        if along <= 0.0 {
            return DVec3::ZERO;
        }
        let across = impulse - self.normal * along;
        let most = self.friction * along;
        let size = across.length();
        let share = if size > most { most / size } else { 1.0 };
        self.normal * along + across * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest(gap_m: f64, friction: f64) -> Contact {
        let jacobian = ContactJacobian::default();
        Contact {
            key: 0,
            jacobian,
            normal: DVec3::Z,
            gap_m,
            friction,
            rebound_m_s: 0.0,
            back_m_s: DVec3::ZERO,
            age_s: 0.0,
        }
    }

    #[test]
    fn scattering_is_the_transpose_of_gathering() {
        let mut slots = ContactJacobian::default();
        slots.add_linear(0, 0.25);
        slots.add_linear(2, -0.75);
        slots.add_angular(1, DVec3::new(0.1, -0.2, 0.3));
        let velocities = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 2.0), DVec3::new(0.3, 0.2, 0.1)];
        let impulse = DVec3::new(0.7, -0.4, 0.9);
        let mut scattered = [DVec3::ZERO; 3];
        slots.scatter(impulse, &mut scattered);
        let power: f64 = scattered.iter().zip(&velocities).map(|(j, v)| j.dot(*v)).sum();
        assert!((power - slots.velocity(&velocities).dot(impulse)).abs() < 1e-15); // a few roundings near 1
    }

    #[test]
    fn a_projected_impulse_never_pulls_and_stays_in_its_disc() {
        let contact = at_rest(0.0, 0.5);
        assert_eq!(contact.project(DVec3::new(1.0, 0.0, -2.0)), DVec3::ZERO);
        assert_eq!(contact.project(DVec3::new(0.5, 0.0, 2.0)), DVec3::new(0.5, 0.0, 2.0));
        assert_eq!(contact.project(DVec3::new(4.0, 0.0, 2.0)), DVec3::new(1.0, 0.0, 2.0));
    }

    #[test]
    fn a_gap_may_close_within_the_step_and_a_depth_opens_slowly() {
        let at = |gap_m| at_rest(gap_m, 0.0);
        assert_eq!(at(0.004).bias_m_s(0.004), 1.0);
        assert_eq!(at(-0.004).bias_m_s(0.004), -PUSH_OUT_SHARE);
        assert_eq!(at(-1.0).bias_m_s(0.004), -PUSH_OUT_MAX_M_S);
    }

    #[test]
    fn a_depth_comes_out_over_the_age_of_the_data_where_that_is_longer_than_the_step() {
        let deep = Contact { age_s: 0.02, ..at_rest(-0.01, 0.0) };
        assert_eq!(deep.bias_m_s(0.001), -0.01 * PUSH_OUT_SHARE / 0.02);
        assert_eq!(deep.bias_m_s(0.04), -0.01 * PUSH_OUT_SHARE / 0.04);
    }

    #[test]
    fn a_rebound_is_asked_for_whatever_the_gap() {
        let bounce = |gap_m| Contact { rebound_m_s: 2.0, ..at_rest(gap_m, 0.0) };
        assert_eq!(bounce(0.001).bias_m_s(0.001), -2.0);
        assert_eq!(bounce(-0.001).bias_m_s(0.001), -2.0);
    }
}
