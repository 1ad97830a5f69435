//! How a tube answers impulses: its factor, as others may know it.
//!
//! In: the factor of the substep that ended last. Out: the velocities that impulses cause. Never here: which impulses.

use super::band::Factor;
use super::contact::respond;
use glam::DVec3;

/// A tube's answer to impulses: A⁻¹ of its own step (docs/theory/rod.md, eq. 17), ends that are held left out.
#[derive(Debug, Clone, Default)]
pub struct CurveInertia {
    factor: Factor,
    held: [bool; 2],
    /// How fast each segment turns, rad/s, world axes.
    pub spins: Vec<DVec3>,
    /// How each node accelerated in the last step, without what others gave at its start, m/s²; empty before the first.
    pub accelerations: Vec<DVec3>,
    /// The length of the substep that ended last, seconds: published velocities are the means over it. Zero before the first.
    pub span_s: f64,
}

impl CurveInertia {
    /// Takes over the factor of a substep of `span_s` seconds and the velocities of all slots, into the storage that is here.
    pub(super) fn copy_from(&mut self, (factor, span_s): (&Factor, f64), held: [bool; 2], velocities: &[DVec3]) {
        self.span_s = span_s;
        self.factor.copy_from(factor);
        self.held = held;
        self.spins.clear();
        self.spins.extend(velocities.iter().skip(1).step_by(2));
    }

    /// How many slots it knows: node k is slot 2k, segment k slot 2k + 1; zero before the tube's first step.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.factor.slots()
    }

    /// Appends the size of the inverse mass of each slot: enough for the scale of an iteration.
    pub(super) fn scale(&self, into: &mut Vec<f64>) {
        let first = into.len();
        into.extend(self.factor.scales());
        for (end, slot) in [(0, first), (1, into.len() - 1)] {
            if self.held[end] {
                into[slot] = 0.0;
            }
        }
    }

    /// Turns impulses, one a slot (N·s; N·m·s for a segment), into the velocities they cause (m/s; rad/s).
    ///
    /// # Panics
    /// Where there are not as many as [`Self::slots`].
    pub fn respond(&self, impulses: &mut [DVec3]) {
        assert_eq!(impulses.len(), self.slots(), "one impulse a slot");
        respond((&self.factor, self.held), impulses);
    }
}
