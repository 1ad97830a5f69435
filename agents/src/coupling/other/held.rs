//! Another agent at a point where a spring holds it: how that point is expected to move, and how it is given what the spring gives.
//!
//! In: a point, and the step of whoever holds it. Out: its mean velocity in that step; into how many parts an impulse falls.
//! Never here: the spring. Theory: docs/theory/coupling.md, eq. 9a.

use super::Other;
use crate::coupling::Place;
use crate::{Anchor, Inertia};
use glam::DVec3;

impl Other {
    /// A point, and its velocity in the mean of a step of `h` seconds of one who holds it by a spring. A body that bends takes what
    /// such a one gives as a force: in an implicit step of that length it is the velocity at the end that moves it (eq. 9a).
    #[must_use]
    pub fn carried_m_s(&self, anchor: Anchor, h: f64) -> Option<(DVec3, DVec3)> {
        let (point, velocity) = self.point(anchor)?;
        let gain = match self.place(anchor)? {
            Place::Point(_) => self.gain(h)[0],
            Place::Chain { segment, share, .. } => {
                let [a, b] = [segment, segment + 1].map(|node| self.acceleration_of(node as usize));
                a.lerp(b, share) * (h - self.reckoned_s()).max(0.5 * h)
            }
            Place::Surface { vertices, .. } => {
                self.acceleration_of(vertices[0] as usize) * (h - self.reckoned_s()).max(0.5 * h)
            }
        };
        Some((point, velocity + gain))
    }

    /// Into how many parts what a spring gives it in `h` seconds is divided: one a step of its own, a millisecond at least.
    #[must_use]
    pub fn parts(&self, h: f64) -> u32 {
        let step_s = self.neighbour.as_ref().map_or(f64::INFINITY, |n| n.step_s);
        if self.is_many() { (h / step_s.max(1e-3) + 1e-6).floor().max(1.0) as u32 } else { 1 }
    }

    /// By how much the velocities of a tube or soft body are reckoned ahead, seconds of its acceleration.
    pub(super) fn reckoned_s(&self) -> f64 {
        match self.neighbour.as_ref().map(|n| &n.snapshot.inertia) {
            Some(Inertia::Curve(curve)) => 0.5 * curve.span_s,
            Some(Inertia::Soft(soft)) => 0.5 * soft.span_s,
            _ => 0.0,
        }
    }
}
