//! What fixed solids, and those whom they carry, make of what a tube is given: where they carry it, it does not give way.
//!
//! In: the system of the substep that ended last, and where they pressed on the tube in it. Out: how the tube answers
//! impulses as it lies there. Never here: the tube's own contacts, which know no bond. Theory: docs/theory/coupling.md, eq. 7k and 7p.

use super::band::{Factor, Row};
use super::contact::TubeContacts;
use super::sym3::Sym3;
use crate::coupling::{Foot, Mates, Slots, is_borne};
use glam::DVec3;

/// A foot is stiffer than the tube's own system there by this factor: it gives way by a thousandth.
const STIFFER: f64 = 1e3;

/// How a tube that lies on fixed solids answers impulses.
#[derive(Debug, Clone, Default)]
pub struct Footing {
    feet: Vec<Foot>,
    /// How many of them stand on what is fixed: the first ones.
    fixed: usize,
    /// The system with them.
    rows: Vec<Row>,
    factor: Factor,
}

impl Footing {
    /// Takes in where fixed solids pressed in the substep whose system `rows` are; ends that are held need no foot.
    pub fn stand(&mut self, rows: &[Row], (contacts, mates): (&TubeContacts, &mut Mates), held: [bool; 2]) {
        self.forget();
        let foot = |(slots, normal): (Slots, DVec3)| Foot { slots, normal, stiffness: f64::INFINITY };
        self.feet.extend(contacts.footholds().map(foot));
        self.fixed = self.feet.len();
        mates.carry(contacts.impulses(), rows.len(), &mut self.feet);
        for Foot { slots, normal, stiffness } in &mut self.feet {
            let size = |&(slot, share): &(u32, f64)| share * share * normal.dot(rows[slot as usize].diag * *normal);
            *stiffness = stiffness.min(STIFFER * slots.linear().iter().map(size).sum::<f64>());
        }
        if self.feet.is_empty() {
            return;
        }
        let mut standing = std::mem::take(&mut self.rows);
        standing.clear();
        standing.extend_from_slice(rows);
        self.bear(&mut standing, held);
        if self.factor.factor(&standing).is_err() {
            self.forget();
        }
        self.rows = standing;
    }

    /// It lies on nothing.
    pub fn forget(&mut self) {
        self.feet.clear();
        self.fixed = 0;
    }

    /// Where it lies.
    pub fn feet(&self) -> &[Foot] {
        &self.feet
    }

    /// The factor of the system with its feet; `None` where it lies on nothing.
    pub fn factor(&self) -> Option<&Factor> {
        (!self.feet.is_empty()).then_some(&self.factor)
    }

    /// Whether what it lies on bears this push, N·s.
    pub fn bears(&self, push: DVec3) -> bool {
        is_borne(&self.feet, push)
    }

    /// Where it lies on others, who have to be given what presses it there.
    pub fn on_others(&self) -> &[Foot] {
        &self.feet[self.fixed..]
    }

    /// Adds the feet to a system.
    pub fn bear(&self, rows: &mut [Row], held: [bool; 2]) {
        let last = rows.len() as u32 - 1;
        let stays = |slot: u32| (held[0] && slot == 0) || (held[1] && slot == last);
        for Foot { slots, normal, stiffness, .. } in &self.feet {
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
