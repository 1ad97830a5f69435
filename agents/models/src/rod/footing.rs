//! What fixed solids, and those whom they carry, make of what a tube is given: where they carry it, it does not give way.
//!
//! In: the system of the substep that ended last, and where they pressed on the tube in it. Out: how the tube answers
//! impulses as it lies there. Never here: the tube's own contacts, which know no bond. Theory: docs/theory/coupling.md, eq. 7k and 7p.

use super::banded_ldl::{Factor, Row};
use super::contact::TubeContacts;
use super::sym3::Sym3;
use metachron_contact::Mates;
use metachron_core::{Foot, Stance};

/// How a tube that lies on fixed solids answers impulses.
#[derive(Debug, Clone, Default)]
pub struct Footing {
    /// Where it lies.
    pub stance: Stance,
    /// The system with them.
    rows: Vec<Row>,
    factor: Factor,
}

impl Footing {
    /// Takes in where fixed solids pressed in the substep whose system `rows` are; ends that are held need no foot.
    pub fn stand(&mut self, rows: &[Row], (contacts, mates): (&TubeContacts, &mut Mates), held: [bool; 2]) {
        let inertia = |foot: &Foot| {
            let Foot { slots, normal, .. } = foot;
            let size = |&(slot, share): &(u32, f64)| share * share * normal.dot(rows[slot as usize].diag * *normal);
            slots.linear().iter().map(size).sum()
        };
        let carry = |feet: &mut Vec<Foot>| mates.carry(contacts.impulses(), rows.len(), feet);
        self.stance.find(contacts.supporting_contacts(), carry, inertia);
        if self.stance.is_empty() {
            return;
        }
        let mut standing = std::mem::take(&mut self.rows);
        standing.clear();
        standing.extend_from_slice(rows);
        self.bear(&mut standing, held);
        if self.factor.factor(&standing).is_err() {
            self.stance.forget();
        }
        self.rows = standing;
    }

    /// The factor of the system with its feet; `None` where it lies on nothing.
    pub fn factor(&self) -> Option<&Factor> {
        (!self.stance.is_empty()).then_some(&self.factor)
    }

    /// Adds the feet to a system.
    pub fn bear(&self, rows: &mut [Row], held: [bool; 2]) {
        let last = rows.len() as u32 - 1;
        let stays = |slot: u32| (held[0] && slot == 0) || (held[1] && slot == last);
        for Foot { slots, normal, stiffness, .. } in self.stance.feet() {
            let moves = || slots.linear().iter().filter(|(slot, _)| !stays(*slot));
            for &(slot, share) in moves() {
                rows[slot as usize].diag += Sym3::outer(*normal, stiffness * share * share);
            }
            // a place inside a segment joins its two nodes
            if let (Some(&(_, a)), Some(&(right, b))) = (moves().next(), moves().nth(1)) {
                rows[right as usize].far += Sym3::outer(*normal, stiffness * a * b);
            }
        }
    }
}
