//! Size of a tube's step: the memory it works on.
//!
//! Out: numbers for benchmarks. Never here: time.

use super::Tube;
use super::discretization::Discretization;
use super::state::RodState;

impl Tube {
    /// Bytes that a step reads and writes: the state and the next one, the division, the linear
    /// system and its factor.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let stepper = &self.stepper;
        let system = size_of_val(&stepper.rows[..]) + size_of_val(&stepper.rhs[..]) + stepper.factor().bytes();
        of_state(&self.now) + of_state(&stepper.next) + of_division(&self.division) + system
    }
}

fn of_state(state: &RodState) -> usize {
    let RodState { x, q, u, t, e, b, force, .. } = state;
    let vectors = [x, u, t, e, force].into_iter().map(|list| size_of_val(&list[..]));
    vectors.sum::<usize>() + size_of_val(&q[..]) + size_of_val(&b[..])
}

/// The part that a step reads.
fn of_division(division: &Discretization) -> usize {
    let Discretization { length, chord, joint, bend, .. } = division;
    [length, chord, joint].into_iter().map(|list| size_of_val(&list[..])).sum::<usize>() + size_of_val(&bend[..])
}
