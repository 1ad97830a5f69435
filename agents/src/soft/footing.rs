//! What fixed solids, and those whom they carry, make of what a soft body is given: where they carry it, it does not give way.
//!
//! In: the system of the step that comes, and where they pressed on the body in the one that ended. Out: how the body answers
//! impulses as it lies there. Never here: the body's own contacts, which know no bond. Theory: docs/theory/coupling.md, eq. 7k and 7p.

use super::company::Company;
use super::contact::Contacts;
use super::system::{Factor, System};
use crate::coupling::{Foot, Lies, Slots, is_borne};
use glam::{DMat3, DVec3};

/// A foot is stiffer than the body's own system there by this factor: it gives way by a thousandth.
const STIFFER: f64 = 1e3;

/// Where fixed solids carry a soft body.
#[derive(Debug, Clone, Default)]
pub(super) struct Footing {
    feet: Vec<Foot>,
    /// How many of them stand on what is fixed: the first ones.
    fixed: usize,
    /// How the body answers impulses where it is lifted off.
    free: Factor,
}

impl Footing {
    /// Finds where fixed solids pressed in the last substep, and those whom they carry.
    pub fn find(&mut self, contacts: &Contacts, company: &mut Company) {
        self.forget();
        let foot = |(slots, normal): (Slots, DVec3)| Foot { slots, normal, stiffness: f64::INFINITY };
        self.feet.extend(contacts.footholds().map(foot));
        self.fixed = self.feet.len();
        company.mates_mut().carry(contacts.impulses(), contacts.mobilities.len(), &mut self.feet);
        let mobility = |slot: u32| contacts.mobilities[slot as usize];
        for Foot { slots, stiffness, .. } in &mut self.feet {
            let moved = slots.linear().iter().filter(|(slot, _)| mobility(*slot) > 0.0);
            let inertia = moved.map(|&(slot, share)| share * share / mobility(slot)).sum::<f64>();
            *stiffness = stiffness.min(STIFFER * inertia);
        }
    }

    /// It lies on nothing.
    pub fn forget(&mut self) {
        self.feet.clear();
        self.fixed = 0;
    }

    /// Whether it lies on nothing fixed.
    pub fn is_empty(&self) -> bool {
        self.feet.is_empty()
    }

    /// Keeps how the body answers impulses where it is lifted off.
    pub fn keep(&mut self, free: &Factor) {
        self.free.copy_from(free);
    }

    /// How a body of this `answer` answers impulses, and where it lies with its answer there.
    pub fn told<'a>(&'a self, answer: &'a Factor) -> (&'a Factor, Lies<'a, Factor>) {
        if self.is_empty() { (answer, None) } else { (&self.free, Some((&self.feet, answer))) }
    }

    /// Whether what it lies on bears these impulses, one a vertex.
    pub fn bears(&self, impulses: &[DVec3]) -> bool {
        is_borne(&self.feet, impulses.iter().sum())
    }

    /// How a body of this `answer` answers impulses where what it lies on `bears` them, or where it is lifted off.
    pub fn under<'a>(&'a self, bears: bool, answer: &'a Factor) -> &'a Factor {
        if bears || self.is_empty() { answer } else { &self.free }
    }

    /// Where it lies on others, who have to be given what presses it there.
    pub fn on_others(&self) -> &[Foot] {
        &self.feet[self.fixed..]
    }

    /// Adds the feet to a `system` that is not yet factored.
    pub fn bear(&self, system: &mut System) {
        for Foot { slots, normal, stiffness, .. } in &self.feet {
            let across = DMat3::from_cols(*normal * normal.x, *normal * normal.y, *normal * normal.z) * *stiffness;
            for &(i, a) in slots.linear() {
                for &(j, b) in slots.linear().iter().filter(|(j, _)| *j <= i) {
                    system.join((i, j), across * (a * b));
                }
            }
        }
    }
}
