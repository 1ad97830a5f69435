//! Explicit W of a few contacts, for solves that need many products with it.
//!
//! In: contacts, a body's response to impulses. Out: products W λ at a cost that depends on the contacts alone. Never here: when that
//! is cheaper ([`super::solver`]). Theory: docs/theory/contact.md, eq. 5.

use super::{Contact, Response};
use glam::{DMat3, DVec3};

/// W = J A⁻¹ Jᵀ (1/kg): the velocity at each contact caused by an impulse at each.
#[derive(Debug, Clone, Default)]
pub(super) struct DelassusMatrix {
    /// One block for each pair of contacts, those of one impulse in a row; empty while W is not formed.
    blocks: Vec<DMat3>,
}

impl DelassusMatrix {
    /// Forms W from three responses for each contact; `scratch` has one entry for each slot.
    pub fn form(&mut self, contacts: &[Contact], body: &mut impl Response, scratch: &mut [DVec3]) {
        self.blocks.clear();
        for pushed in contacts {
            let from = self.blocks.len();
            self.blocks.resize(from + contacts.len(), DMat3::ZERO);
            for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                scratch.fill(DVec3::ZERO);
                pushed.jacobian.scatter(unit, scratch);
                body.respond(scratch);
                for (block, moved) in self.blocks[from..].iter_mut().zip(contacts) {
                    *block.col_mut(axis) = moved.jacobian.velocity(scratch);
                }
            }
        }
    }

    pub fn forget(&mut self) {
        self.blocks.clear();
    }

    pub fn is_known(&self) -> bool {
        !self.blocks.is_empty()
    }

    /// W λ, one velocity for each contact.
    pub fn times(&self, lambda: &[DVec3], caused: &mut Vec<DVec3>) {
        caused.clear();
        caused.resize(lambda.len(), DVec3::ZERO);
        for (impulse, column) in lambda.iter().zip(self.blocks.chunks(lambda.len())) {
            caused.iter_mut().zip(column).for_each(|(sum, block)| *sum += *block * *impulse);
        }
    }
}
