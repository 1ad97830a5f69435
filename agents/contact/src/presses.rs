//! What contacts press a body that bends with, and what of it is a blow.
//!
//! In: the contacts of each of its substeps. Out: the part of the last one's that was no part of the one before. Never here: who
//! expects the rest to go on. Theory: docs/theory/soft.md, eq. 16j.

use super::Contact;
use glam::DVec3;

/// What presses lasts where no more than this share of it is a blow.
const NEARLY: f64 = 0.2;

/// How contacts pressed each slot of a body in its last substep, and in the one before, N and N·m.
#[derive(Debug, Clone, Default)]
pub struct Presses([Vec<DVec3>; 2]);

impl Presses {
    /// Notes a substep of `h` seconds of a body of so many `slots`: its contacts, and what they gave.
    pub fn note<'a>(&mut self, contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>, slots: usize, h: f64) {
        self.0.swap(0, 1);
        let now = &mut self.0[0];
        now.clear();
        now.resize(slots, DVec3::ZERO);
        contacts.for_each(|(contact, impulse)| contact.jacobian.scatter_known(*impulse / h, now));
    }

    /// Forgets what pressed: the body was divided anew, or nobody wants to know.
    pub fn forget(&mut self) {
        self.0.iter_mut().for_each(Vec::clear);
    }

    /// Whether what presses is nearly what pressed in the substep before: little of it is a blow.
    pub fn lasts(&self) -> bool {
        let size = |list: &mut dyn Iterator<Item = DVec3>| list.map(|f| f.length_squared()).sum::<f64>();
        size(&mut self.blows()) <= NEARLY * NEARLY * size(&mut self.0[0].iter().copied())
    }

    /// The part of what presses that was no part of it in the substep before, on each slot, N and N·m: a blow, which does not go on.
    pub fn blows(&self) -> impl Iterator<Item = DVec3> {
        let [now, before] = &self.0;
        let size: f64 = before.iter().map(|f| f.length_squared()).sum();
        let along: f64 = now.iter().zip(before).map(|(now, before)| now.dot(*before)).sum();
        let share = if size > 0.0 { (along / size).clamp(0.0, 1.0) } else { 0.0 };
        let lasts = before.iter().copied().chain(std::iter::repeat(DVec3::ZERO));
        now.iter().zip(lasts).map(move |(now, before)| *now - before * share)
    }
}
