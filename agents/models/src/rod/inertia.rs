//! A tube's response to impulses, as published to other agents: its factor.
//!
//! In: the factor of the last substep. Out: the velocities that impulses cause. Never here: which impulses.

use super::banded_ldl::Factor;
use super::contact::respond;
use super::state::RodMaterial;
use glam::DVec3;
use metachron_core::{Carried, Foot, Lies};
use metachron_core::{CurveResponse, ImpulseResponse};

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
    pub(super) fn copy_from(&mut self, factor: &Factor, span_s: f64, held: [bool; 2], velocities: &[DVec3]) {
        self.span_s = span_s;
        self.factor.copy_from(factor);
        self.held = held;
        self.spins.clear();
        self.spins.extend(velocities.iter().skip(1).step_by(2));
    }

    /// Copies the supports and the accelerations there.
    pub(super) fn copy_supports(&mut self, lies: Lies<'_, Factor>, accelerations: &[DVec3]) {
        self.standing.take(lies, accelerations, Factor::copy_from);
    }

    /// Copies mass, rotary inertia and damping, and lengths and directions of segments.
    pub(super) fn copy_masses(&mut self, matter: &RodMaterial, length_m: &[f64], directions: &[DVec3]) {
        (self.mu, self.rotary, self.damping_per_s) = (matter.mu, matter.rotary, matter.damping);
        self.segments.clear();
        self.segments.extend(length_m.iter().copied().zip(directions.iter().copied()));
    }
}

impl ImpulseResponse for CurveInertia {
    /// Node k is slot 2k, segment k slot 2k + 1.
    fn slots(&self) -> usize {
        self.factor.slots()
    }

    fn respond(&self, impulses: &mut [DVec3], supported: bool) {
        assert_eq!(impulses.len(), self.slots(), "one impulse a slot");
        respond(self.standing.factor().filter(|_| supported).unwrap_or(&self.factor), self.held, impulses);
    }

    fn append_mobilities(&self, into: &mut Vec<f64>) {
        let first = into.len();
        into.extend(self.factor.scales());
        for (end, slot) in [(0, first), (1, into.len() - 1)] {
            if self.held[end] {
                into[slot] = 0.0;
            }
        }
    }

    fn accelerations(&self, supported: bool) -> &[DVec3] {
        self.standing.accelerations().filter(|_| supported).unwrap_or(&self.accelerations)
    }

    fn span_s(&self) -> f64 {
        self.span_s
    }

    fn forecast_s(&self) -> f64 {
        self.ahead_s
    }

    /// Damping acts on what has been carried; elastic forces on the sum (docs/theory/soft.md, eq. 16e).
    fn elastic_change(&self, supported: bool, changed: &mut [DVec3], carried: &mut Vec<DVec3>) {
        let damped = self.ahead_s * self.damping_per_s;
        for (v, c) in changed.iter_mut().zip(&mut *carried) {
            let both = *v + *c;
            *v = both + *c * damped;
            *c = both;
        }
        CurveResponse::momenta(self, changed);
        self.respond(changed, supported);
        changed.iter_mut().zip(carried).for_each(|(v, both)| *v = (*v - *both) / self.ahead_s);
    }

    fn supports(&self) -> &[Foot] {
        self.standing.feet()
    }

    fn curve(&self) -> Option<&dyn CurveResponse> {
        Some(self)
    }

    fn boxed_clone(&self) -> Box<dyn ImpulseResponse> {
        Box::new(self.clone())
    }
}

impl CurveResponse for CurveInertia {
    fn spins(&self) -> &[DVec3] {
        &self.spins
    }

    fn momenta(&self, velocities: &mut [DVec3]) {
        momenta(self.mu, self.rotary, self.segments.iter().copied(), velocities);
    }
}

/// Turns velocities in slots into momenta, by mass and rotary inertia per length and the length and direction of each segment
/// (docs/theory/rod.md, eq. 11).
pub(super) fn momenta(mu: f64, rotary: f64, segments: impl Iterator<Item = (f64, DVec3)>, list: &mut [DVec3]) {
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
