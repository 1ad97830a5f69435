//! How much the direct solve takes on: so many bodies, contacts, and products in a factorisation.
//!
//! In: a count of contacts, what a factorisation costs, or pairs that touch. Out: whether that is too much, or little enough to
//! take it back. Never here: who solves it instead.

use super::matrix::Matrix;

/// More bodies without joints than this are never tried: looking at every pair would cost as much as the solve.
const MEMBERS_MAX: usize = 128;
/// More contacts than this are a pile's business.
const CONTACTS_MAX: usize = 512;
/// A factorisation that costs more than this many products is too dear: sixteen bodies that all touch each other.
const WORK_MAX: usize = 400_000;
/// What another solver has is taken back once it has shrunk to this share of the limits.
const BACK_SHARE: usize = 2;

/// Whether so many bodies without joints are worth a try.
pub(in super::super) const fn may_suit(members: usize) -> bool {
    members <= MEMBERS_MAX
}

/// Whether so many contacts, or a factorisation of so many products, are too much.
pub(super) const fn is_overrun(contacts: usize, work: usize) -> bool {
    contacts > CONTACTS_MAX || work > WORK_MAX
}

/// Looks whether bodies that another solver has would suit the direct one; nothing is allocated once the sizes settle.
#[derive(Default)]
pub(in super::super) struct Reach {
    pairs: Vec<(u32, u32)>,
    matrix: Matrix,
}

impl Reach {
    /// Begins a new look.
    pub(in super::super) fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Two bodies touch.
    pub(in super::super) fn note(&mut self, a: u32, b: u32) {
        self.pairs.push((a, b));
    }

    /// Whether what was noted, of so many bodies and contacts, can be taken back.
    pub(in super::super) fn suits(&mut self, members: usize, contacts: usize) -> bool {
        if !may_suit(members) || contacts > CONTACTS_MAX / BACK_SHARE {
            return false;
        }
        self.matrix.link(members, self.pairs.iter().copied());
        self.matrix.work() <= WORK_MAX / BACK_SHARE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_suits_and_a_heap_in_which_everybody_touches_everybody_does_not() {
        let mut reach = Reach::default();
        (1..100).for_each(|i| reach.note(i, i - 1));
        assert!(reach.suits(100, 200));
        assert!(!reach.suits(100, 400), "too many contacts to come back");
        reach.clear();
        (0..20).for_each(|i| (0..i).for_each(|j| reach.note(i, j)));
        assert!(!reach.suits(20, 200));
    }
}
