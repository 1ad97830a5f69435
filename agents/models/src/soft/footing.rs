//! What fixed solids, and those whom they carry, make of what a soft body is given: where they carry it, it does not give way.
//!
//! In: the system of the step that comes, and where they pressed on the body in the one that ended. Out: how the body answers
//! impulses as it lies there. Never here: the body's own contacts, which know no bond. Theory: docs/theory/coupling.md, eq. 7k and 7p.

use super::company::Company;
use super::contact::Contacts;
use super::system::{Factor, System};
use glam::DMat3;
use metachron_core::{Foot, Lies, Stance};

/// Where fixed solids carry a soft body.
#[derive(Debug, Clone, Default)]
pub(super) struct Footing {
    pub stance: Stance,
    /// How the body answers impulses where it is lifted off.
    free: Factor,
}

impl Footing {
    /// Finds where fixed solids pressed in the last substep, and those whom they carry.
    pub fn find(&mut self, contacts: &Contacts, company: &mut Company) {
        let mobility = |slot: u32| contacts.mobilities[slot as usize];
        let inertia = |foot: &Foot| {
            let moved = foot.slots.linear().iter().filter(|(slot, _)| mobility(*slot) > 0.0);
            moved.map(|&(slot, share)| share * share / mobility(slot)).sum()
        };
        let own = contacts.mobilities.len();
        let carry = |feet: &mut Vec<Foot>| company.mates_mut().carry(contacts.impulses(), own, feet);
        self.stance.find(contacts.footholds(), carry, inertia);
    }

    /// Keeps how the body answers impulses where it is lifted off.
    pub fn keep(&mut self, free: &Factor) {
        self.free.copy_from(free);
    }

    /// How a body of this `answer` answers impulses, and where it lies with its answer there.
    pub fn told<'a>(&'a self, answer: &'a Factor) -> (&'a Factor, Lies<'a, Factor>) {
        if self.stance.is_empty() { (answer, None) } else { (&self.free, Some((self.stance.feet(), answer))) }
    }

    /// How a body of this `answer` answers impulses where what it lies on `bears` them, or where it is lifted off.
    pub fn under<'a>(&'a self, bears: bool, answer: &'a Factor) -> &'a Factor {
        if bears || self.stance.is_empty() { answer } else { &self.free }
    }

    /// Adds the feet to a `system` that is not yet factored.
    pub fn bear(&self, system: &mut System) {
        for Foot { slots, normal, stiffness, .. } in self.stance.feet() {
            let across = DMat3::from_cols(*normal * normal.x, *normal * normal.y, *normal * normal.z) * *stiffness;
            for &(i, a) in slots.linear() {
                for &(j, b) in slots.linear().iter().filter(|(j, _)| *j <= i) {
                    system.join(i, j, across * (a * b));
                }
            }
        }
    }
}
