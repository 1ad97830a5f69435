//! How much a tube's step has to do: the memory that it works on, and its contacts.
//!
//! Out: numbers, for those who measure. Never here: time.

use super::Tube;
use super::discretization::Division;
use super::state::Config;

impl Tube {
    /// Bytes that a step reads and writes, without those of contacts: the state and the next one, the division, the linear
    /// system and its factor.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let stepper = &self.stepper;
        let system = size_of_val(&stepper.rows[..]) + size_of_val(&stepper.rhs[..]) + stepper.factor().bytes();
        of_state(&self.now) + of_state(&stepper.next) + of_division(&self.division) + system
    }

    /// How many contacts the substep that ended last had: with itself, with what never moves, and with others.
    #[must_use]
    pub fn contacts(&self) -> usize {
        self.stepper.contacts.impulses().count()
    }
}

fn of_state(state: &Config) -> usize {
    let Config { x, q, u, t, e, b, force, .. } = state;
    let vectors = [x, u, t, e, force].into_iter().map(|list| size_of_val(&list[..]));
    vectors.sum::<usize>() + size_of_val(&q[..]) + size_of_val(&b[..])
}

/// What a step reads of it.
fn of_division(division: &Division) -> usize {
    let Division { length, chord, joint, bend, .. } = division;
    [length, chord, joint].into_iter().map(|list| size_of_val(&list[..])).sum::<usize>() + size_of_val(&bend[..])
}
