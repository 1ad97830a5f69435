//! What fixed solids make of what a tube is given: where they carry it, it does not give way.
//!
//! In: the system of the substep that ended last, and where fixed solids pressed on the tube in it. Out: how the tube answers impulses as
//! it lies there. Never here: the tube's own contacts, which know no bond. Theory: docs/theory/coupling.md, eq. 7k.

use super::band::{Factor, Row};
use super::contact::{TubeContacts, respond};
use super::sym3::Sym3;
use crate::coupling::Slots;
use glam::DVec3;

/// A foot is stiffer than the tube's own system there by this factor: it gives way by a thousandth.
const STIFFER: f64 = 1e3;

/// How a tube that lies on fixed solids answers impulses.
#[derive(Debug, Clone, Default)]
pub struct Footing {
    /// The system without feet.
    rows: Vec<Row>,
    feet: Vec<Foot>,
    /// The system with them.
    standing: Vec<Row>,
    factor: Factor,
    /// Room for an answer.
    answer: Vec<DVec3>,
}

/// A place where a fixed solid carries the tube.
#[derive(Debug, Clone, Copy)]
struct Foot {
    slots: Slots,
    normal: DVec3,
    /// What the solid gave it in the substep that ended last, N·s.
    given: f64,
    /// What it gives against a motion into the solid or out of it, kg.
    stiffness: f64,
}

impl Footing {
    /// Takes in where fixed solids pressed in the substep whose system `rows` are; ends that are held need no foot.
    pub fn stand(&mut self, rows: &[Row], contacts: &TubeContacts, held: [bool; 2]) {
        self.forget();
        let foot = |(slots, normal, given): (Slots, DVec3, f64)| {
            let size = |&(slot, share): &(u32, f64)| share * share * normal.dot(rows[slot as usize].diag * normal);
            let stiffness = STIFFER * slots.linear().iter().map(size).sum::<f64>();
            Foot { slots, normal, given, stiffness }
        };
        self.feet.extend(contacts.footholds().map(foot));
        if !self.feet.is_empty() {
            self.rows.clear();
            self.rows.extend_from_slice(rows);
            self.set(held);
        }
    }

    /// It lies on nothing.
    pub fn forget(&mut self) {
        self.feet.clear();
    }

    /// The factor of the system with its feet; `None` where it lies on nothing.
    pub fn factor(&self) -> Option<&Factor> {
        (!self.feet.is_empty()).then_some(&self.factor)
    }

    /// The same under these impulses, one a slot, which lift it off some of its feet: they push and do not pull.
    pub fn under(&mut self, impulses: &[DVec3], held: [bool; 2]) -> Option<&Factor> {
        while !self.feet.is_empty() {
            let Self { feet, factor, answer, .. } = self;
            answer.clear();
            answer.extend_from_slice(impulses);
            respond((factor, held), answer);
            let count = feet.len();
            feet.retain(|foot| foot.given >= foot.stiffness * foot.slots.velocity_of_nodes(answer).dot(foot.normal));
            if feet.len() == count {
                break;
            }
            self.set(held);
        }
        self.factor()
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

    /// Factors the system with the feet that are left; with none where that has no factor.
    fn set(&mut self, held: [bool; 2]) {
        let mut standing = std::mem::take(&mut self.standing);
        standing.clone_from(&self.rows);
        self.bear(&mut standing, held);
        if self.factor.factor(&standing).is_err() {
            self.forget();
        }
        self.standing = standing;
    }
}
