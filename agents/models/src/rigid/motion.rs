//! A free rigid body in double precision: its state and its flight.
//!
//! In: a span and a gravity. Out: the state after it, exact in translation. Never here: contacts, springs.
//!
//! Translation is a parabola, evaluated in closed form; so is the rotation of a body of which two principal moments are equal.
//! Any other one conserves the angular momentum L in world axes to the bit and turns the body about its three principal axes one
//! after the other (DLM97), symmetrically: of a flight composed to fourth order (SUZ90), so that energy does not drift over flights of any
//! length; within a step in which impulses change L anyway, once, to the second order of such a step.

use super::Restraint;
use super::mass_properties::MassDistribution;
use glam::{DMat3, DQuat, DVec3, Vec3Swizzles};

/// Position and motion of a rigid body, about its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Motion {
    /// Centre of mass, metres.
    pub position: DVec3,
    /// Rotation from the shape's axes to the world's.
    pub rotation: DQuat,
    /// Velocity of the centre of mass, m/s.
    pub velocity: DVec3,
    /// Angular momentum about the centre of mass, world axes, kg·m²/s.
    pub angular: DVec3,
}

/// Gravity and restraint of a body that nothing touches.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Flight {
    /// m/s², along axes that are not locked.
    pub gravity: DVec3,
    pub restraint: Restraint,
}

/// A part of a turn turns the body by at most this, radians: fourth order then leaves about 1e-6 rad a turn.
const TURN_MAX: f64 = 0.1;
/// The most parts of one flight (reached by a body that spins at 10⁴ rad/s for a second).
const PARTS_MAX: f64 = 1e5;
/// Suzuki's fourth-order composition of five symmetric parts (SUZ90): 1/(4 − 4^(1/3)) and its middle, 1 − 4p.
const SUZUKI: [f64; 5] = [
    0.414_490_771_794_375_7,
    0.414_490_771_794_375_7,
    -0.657_963_087_177_502_8,
    0.414_490_771_794_375_7,
    0.414_490_771_794_375_7,
];

/// The symmetric parts of which a turn is composed, as shares of it: once the whole is of second order.
const ONCE: [f64; 1] = [1.0];

impl Motion {
    /// Angular velocity in world axes, rad/s.
    pub(super) fn spin(&self, body: &MassDistribution) -> DVec3 {
        let to_world = self.rotation * body.axes;
        to_world * ((to_world.conjugate() * self.angular) / body.moments)
    }

    /// Sets the angular momentum from an angular velocity in world axes.
    pub(super) fn set_spin(&mut self, body: &MassDistribution, spin: DVec3) {
        self.angular = self.inertia_times(body, spin);
    }

    /// The inertia tensor in world axes times a vector.
    pub(super) fn inertia_times(&self, body: &MassDistribution, w: DVec3) -> DVec3 {
        let to_world = self.rotation * body.axes;
        to_world * ((to_world.conjugate() * w) * body.moments)
    }

    /// The inverse of the inertia tensor in world axes, 1/(kg·m²).
    pub(super) fn inverse_inertia(&self, body: &MassDistribution) -> DMat3 {
        let to_world = DMat3::from_quat(self.rotation * body.axes);
        to_world * DMat3::from_diagonal(body.moments.recip()) * to_world.transpose()
    }

    /// The largest spin the body can reach with its angular momentum, rad/s.
    pub(super) fn spin_max(&self, body: &MassDistribution) -> f64 {
        self.angular.length() / body.moments.min_element()
    }

    /// Kinetic and gravitational energy, zero at the origin, joules.
    pub(super) fn energy_j(&self, body: &MassDistribution, gravity: DVec3) -> f64 {
        0.5 * body.mass_kg * self.velocity.length_squared() + 0.5 * self.angular.dot(self.spin(body))
            - body.mass_kg * gravity.dot(self.position)
    }

    /// Flies freely for `t` seconds: by a parabola, or, where it is damped, towards its last velocity g / c, both in closed form.
    pub(super) fn fly(&mut self, body: &MassDistribution, flight: &Flight, t: f64) {
        self.fly_by(body, flight, t, &SUZUKI);
    }

    /// The same as others predict it, who act on it: its turn is of second order.
    pub(super) fn fly_predicted(&mut self, body: &MassDistribution, flight: &Flight, t: f64) {
        self.fly_by(body, flight, t, &ONCE);
    }

    fn fly_by(&mut self, body: &MassDistribution, flight: &Flight, t: f64, parts: &[f64]) {
        let Flight { gravity, restraint } = *flight;
        let damping = restraint.linear_damping_per_s;
        if damping > 0.0 {
            let (decay, last) = (-libm::expm1(-damping * t), gravity / damping);
            self.position += last * t + (self.velocity - last) * (decay / damping);
            self.velocity += (last - self.velocity) * decay;
        } else {
            self.position += self.velocity * t + gravity * (0.5 * t * t);
            self.velocity += gravity * t;
        }
        // an angular momentum that decays as e^(−ct) turns the body along the same path as one that stays, in (1 − e^(−ct)) / c: Euler's
        // equations are homogeneous
        let damping = restraint.angular_damping_per_s;
        if damping > 0.0 {
            let decay = -libm::expm1(-damping * t);
            self.turn_within(body, &restraint, decay / damping, parts);
            self.angular *= 1.0 - decay;
        } else {
            self.turn_within(body, &restraint, t, parts);
        }
    }

    /// Turns for `t` seconds with the angular momentum that the impulses of a step have left to it.
    pub(super) fn turn_held(&mut self, body: &MassDistribution, restraint: &Restraint, t: f64) {
        self.turn_within(body, restraint, t, &ONCE);
    }

    /// Turns for `t` seconds about the axes that are left to it: with its spin, where one is locked, as a hinge lets it.
    fn turn_within(&mut self, body: &MassDistribution, restraint: &Restraint, t: f64, parts: &[f64]) {
        if !restraint.locks_rotation() {
            return self.turn(body, t, parts);
        }
        let spin = restraint.rotation(self.spin(body));
        self.rotation = (DQuat::from_scaled_axis(spin * t) * self.rotation).normalize();
        self.set_spin(body, spin);
    }

    /// Turns freely for `t` seconds, each small turn composed of `parts`; the angular momentum in world axes stays.
    fn turn(&mut self, body: &MassDistribution, t: f64, parts: &[f64]) {
        if self.angular == DVec3::ZERO {
            return;
        }
        if let Some(axis) = symmetry_axis(body.moments) {
            // it turns about L while the body spins about its own axis
            let [along, across] = [axis, axis.zxy()].map(|of| body.moments.dot(of));
            let axis = self.rotation * (body.axes * axis);
            let spun = DQuat::from_scaled_axis(axis * (self.angular.dot(axis) * (1.0 / along - 1.0 / across) * t));
            let turned = DQuat::from_scaled_axis(self.angular / across * t);
            self.rotation = (turned * spun * self.rotation).normalize();
            return;
        }
        let turns = (self.spin_max(body) * t / TURN_MAX).ceil().clamp(1.0, PARTS_MAX);
        let h = t / turns;
        let mut principal = self.rotation * body.axes;
        for _ in 0..turns as u32 {
            for share in parts {
                principal = turn_about_axes(principal, self.angular, body.moments, share * h);
            }
            principal = principal.normalize();
        }
        self.rotation = (principal * body.axes.conjugate()).normalize();
    }

    /// Whether every number is finite and none too large for the contact solver's single precision.
    pub(super) fn is_sane(&self, body: &MassDistribution) -> bool {
        let reach = super::spec::REACH_MAX;
        self.position.is_finite()
            && self.velocity.is_finite()
            && self.angular.is_finite()
            && self.rotation.is_finite()
            && self.position.abs().max_element() <= reach
            && self.velocity.abs().max_element() <= reach
            && self.spin_max(body) <= reach
    }
}

/// The principal axis about which the other two moments are equal, if there is one.
fn symmetry_axis(moments: DVec3) -> Option<DVec3> {
    DVec3::AXES.into_iter().find(|axis| {
        let others = [axis.yzx(), axis.zxy()].map(|other| moments.dot(other));
        (others[0] - others[1]).abs() <= 1e-12 * moments.max_element()
    })
}

/// One symmetric sweep of turns about the principal axes: x/2, y/2, z, y/2, x/2 (DLM97).
fn turn_about_axes(principal: DQuat, angular: DVec3, moments: DVec3, h: f64) -> DQuat {
    let about = |q: DQuat, axis: DVec3, share: f64| {
        let rate = (q.conjugate() * angular).dot(axis) / moments.dot(axis);
        let (sin, cos) = libm::sincos(0.5 * rate * share * h);
        q * DQuat::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
    };
    let q = about(about(principal, DVec3::X, 0.5), DVec3::Y, 0.5);
    let q = about(q, DVec3::Z, 1.0);
    about(about(q, DVec3::Y, 0.5), DVec3::X, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brick() -> MassDistribution {
        MassDistribution {
            mass_kg: 2.0,
            com: DVec3::ZERO,
            moments: DVec3::new(1.0, 2.0, 2.6),
            axes: DQuat::from_rotation_x(0.3),
        }
    }

    fn tumbling() -> Motion {
        Motion {
            position: DVec3::ZERO,
            rotation: DQuat::from_rotation_z(0.2),
            velocity: DVec3::new(1.0, 2.0, 3.0),
            angular: DVec3::new(0.3, 5.0, 0.2),
        }
    }

    #[test]
    fn a_body_with_an_axis_of_symmetry_turns_as_its_principal_axes_in_small_turns_do() {
        for moments in [DVec3::new(2.0, 2.0, 0.3), DVec3::new(0.3, 2.0, 2.0), DVec3::new(1.0, 3.0, 1.0)] {
            let body = MassDistribution { moments, ..brick() };
            let mut motion = tumbling();
            let mut principal = motion.rotation * body.axes;
            motion.turn(&body, 1.0, &SUZUKI);
            for _ in 0..20_000 {
                principal = turn_about_axes(principal, motion.angular, moments, 5e-5).normalize();
            }
            // the splitting is of second order: 3e-9 rad here
            let apart = (motion.rotation * body.axes).angle_between(principal);
            assert!(apart < 1e-7, "{moments}: {apart:e} rad");
        }
    }

    #[test]
    fn a_tumbling_body_keeps_its_energy_for_an_hour() {
        let (body, mut motion) = (brick(), tumbling());
        let before = motion.energy_j(&body, DVec3::ZERO);
        for _ in 0..36_000 {
            motion.fly(&body, &Flight::default(), 0.1);
        }
        // bounded by the fourth-order splitting (2e-7 measured here), no drift on top
        let change = (motion.energy_j(&body, DVec3::ZERO) / before - 1.0).abs();
        assert!(change < 1e-6, "energy changed by {change:e}");
    }

    #[test]
    fn turning_is_of_fourth_order() {
        let body = brick();
        let end = |h: f64, parts: u32| {
            let motion = tumbling();
            let mut q = motion.rotation * body.axes;
            for _ in 0..parts {
                for share in SUZUKI {
                    q = turn_about_axes(q, motion.angular, body.moments, share * h);
                }
            }
            q
        };
        let exact = end(0.000_5, 2_000);
        let error = |h: f64, parts: u32| exact.angle_between(end(h, parts).normalize());
        let order = libm::log2(error(0.1, 10) / error(0.05, 20));
        assert!(order > 3.7, "order {order}"); // asymptotically 4
    }

    #[test]
    fn a_parabola_in_one_step_is_the_parabola_in_a_thousand() {
        let (body, g) = (brick(), Flight { gravity: DVec3::Z * -9.81, ..Flight::default() });
        let (mut one, mut many) = (tumbling(), tumbling());
        one.fly(&body, &g, 1.0);
        (0..1000).for_each(|_| many.fly(&body, &g, 0.001));
        // double precision: 1000 roundings of 1 ulp of 2
        assert!((one.position - many.position).length() < 1e-12, "{} {}", one.position, many.position);
        assert!((one.velocity - many.velocity).length() < 1e-12);
    }

    #[test]
    fn what_is_damped_decays_by_its_rate_and_falls_at_its_last_speed() {
        let restraint = Restraint { linear_damping_per_s: 2.0, angular_damping_per_s: 3.0, ..Restraint::default() };
        let (body, g) = (brick(), Flight { gravity: DVec3::Z * -9.81, restraint });
        let (mut one, mut many) = (tumbling(), tumbling());
        one.fly(&body, &g, 0.5);
        (0..500).for_each(|_| many.fly(&body, &g, 0.001));
        // a closed form has no step; the turn is of fourth order in it
        assert!((one.position - many.position).length() < 1e-12 && (one.velocity - many.velocity).length() < 1e-12);
        assert!(one.rotation.angle_between(many.rotation) < 1e-4);
        let left = (-1.0_f64).exp();
        let falls = -4.905 + (3.0 + 4.905) * left;
        assert!((one.velocity - DVec3::new(left, 2.0 * left, falls)).length() < 1e-12, "{}", one.velocity);
        assert!((one.angular - tumbling().angular * (-1.5_f64).exp()).length() < 1e-12);
    }

    #[test]
    fn what_is_locked_turns_about_the_axis_that_is_left_and_keeps_its_spin() {
        let restraint = Restraint { locked_rotation: [true, true, false], ..Restraint::default() };
        let (body, flight) = (brick(), Flight { gravity: DVec3::ZERO, restraint });
        let mut motion = Motion { angular: DVec3::ZERO, ..tumbling() };
        motion.set_spin(&body, DVec3::Z * 2.0);
        (0..100).for_each(|_| motion.fly(&body, &flight, 0.01));
        assert!((motion.spin(&body) - DVec3::Z * 2.0).length() < 1e-12, "{}", motion.spin(&body));
        let turned = DQuat::from_rotation_z(2.2);
        assert!(motion.rotation.angle_between(turned) < 1e-7); // acos near 1 loses half the digits
    }
}
