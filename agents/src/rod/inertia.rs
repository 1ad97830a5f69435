//! A tube's response to impulses, as published to other agents: its factor.
//!
//! In: the factor of the last substep. Out: the velocities that impulses cause. Never here: which impulses.

use super::band::Factor;
use super::config::Matter;
use super::contact::respond;
use crate::coupling::{Carried, Foot, Lies};
use glam::DVec3;

/// A tube's response to impulses: A⁻¹ of its own step (docs/theory/rod.md, eq. 17), held ends excluded.
#[derive(Debug, Clone, Default)]
pub struct CurveInertia {
    factor: Factor,
    /// The tube's supports, and its response there.
    standing: Carried<Factor>,
    held: [bool; 2],
    /// Spin of each segment, rad/s, world axes.
    pub spins: Vec<DVec3>,
    /// Predicted acceleration of each slot in the next step, or its acceleration in the last step without what others gave at its start,
    /// m/s² and rad/s²; empty before the first.
    pub accelerations: Vec<DVec3>,
    /// The length of the last substep, seconds: published velocities are the means over it. Zero before the first.
    pub span_s: f64,
    /// The length of the step that the accelerations predict, seconds; zero where they are those of the last one.
    pub ahead_s: f64,
    /// Length (m) and direction of each segment.
    segments: Vec<(f64, DVec3)>,
    /// Mass per length, kg/m, rotary inertia per length, kg·m, and damping, 1/s.
    mu: f64,
    rotary: f64,
    damping_per_s: f64,
}

impl CurveInertia {
    /// Copies the factor of a substep of `span_s` seconds and the velocities of all slots, into the existing storage.
    pub(super) fn copy_from(&mut self, (factor, span_s): (&Factor, f64), held: [bool; 2], velocities: &[DVec3]) {
        self.span_s = span_s;
        self.factor.copy_from(factor);
        self.held = held;
        self.spins.clear();
        self.spins.extend(velocities.iter().skip(1).step_by(2));
    }

    /// Copies the supports and the accelerations there.
    pub(super) fn stand(&mut self, lies: Lies<'_, Factor>, accelerations: &[DVec3]) {
        self.standing.take(lies, accelerations, Factor::copy_from);
    }

    /// The contact points at which the tube is supported.
    pub(crate) fn feet(&self) -> &[Foot] {
        self.standing.feet()
    }

    /// Predicted acceleration of each slot, with the supports' response if they have `borne` the load given; empty where unknown.
    pub(crate) fn foretold(&self, borne: bool) -> &[DVec3] {
        self.standing.accelerations().filter(|_| borne).unwrap_or(&self.accelerations)
    }

    /// Copies mass, rotary inertia and damping, and lengths and directions of segments.
    pub(super) fn weigh(&mut self, matter: &Matter, length_m: &[f64], directions: &[DVec3]) {
        (self.mu, self.rotary, self.damping_per_s) = (matter.mu, matter.rotary, matter.damping);
        self.segments.clear();
        self.segments.extend(length_m.iter().copied().zip(directions.iter().copied()));
    }

    /// Change of the predicted acceleration of each slot by impulses still in flight: `changed` are the velocities that they add when the
    /// predicted step begins, and `carried` the displacement they have caused by then, divided by that step, m/s. The result goes to
    /// `changed`, m/s² (docs/theory/soft.md, eq. 16e).
    pub(crate) fn take_back(&self, borne: bool, changed: &mut [DVec3], carried: &mut [DVec3]) {
        let damped = self.ahead_s * self.damping_per_s;
        for (v, c) in changed.iter_mut().zip(&mut *carried) {
            let both = *v + *c;
            *v = both + *c * damped;
            *c = both;
        }
        self.momenta(changed);
        self.respond(changed, borne);
        changed.iter_mut().zip(carried).for_each(|(v, both)| *v = (*v - *both) / self.ahead_s);
    }

    /// Turns velocities in slots into momenta (docs/theory/rod.md, eq. 11).
    pub(crate) fn momenta(&self, list: &mut [DVec3]) {
        momenta((self.mu, self.rotary), self.segments.iter().copied(), list);
    }

    /// Number of slots: node k is slot 2k, segment k slot 2k + 1; zero before the tube's first step.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.factor.slots()
    }

    /// Appends the size of the inverse mass of each slot: accurate enough to scale an iteration.
    pub(crate) fn scale(&self, into: &mut Vec<f64>) {
        let first = into.len();
        into.extend(self.factor.scales());
        for (end, slot) in [(0, first), (1, into.len() - 1)] {
            if self.held[end] {
                into[slot] = 0.0;
            }
        }
    }

    /// Turns impulses, one per slot (N·s; N·m·s for a segment), into the velocities they cause (m/s; rad/s), with the supports' response if
    /// they have `borne` the load, else without.
    ///
    /// # Panics
    /// Where their number is not [`Self::slots`].
    pub fn respond(&self, impulses: &mut [DVec3], borne: bool) {
        assert_eq!(impulses.len(), self.slots(), "one impulse a slot");
        respond((self.standing.factor().filter(|_| borne).unwrap_or(&self.factor), self.held), impulses);
    }
}

/// Turns velocities in slots into momenta, by mass and rotary inertia per length and the length and direction of each segment
/// (docs/theory/rod.md, eq. 11).
pub(super) fn momenta((mu, rotary): (f64, f64), segments: impl Iterator<Item = (f64, DVec3)>, list: &mut [DVec3]) {
    let mut left = list[0];
    list[0] = DVec3::ZERO;
    for (k, (length_m, t)) in segments.enumerate() {
        let (right, spin, m) = (list[2 * k + 2], list[2 * k + 1], mu * length_m / 6.0);
        list[2 * k] += (left * 2.0 + right) * m;
        list[2 * k + 1] = (spin + t * t.dot(spin)) * (rotary * length_m);
        list[2 * k + 2] = (left + right * 2.0) * m;
        left = right;
    }
}
