//! The compliance of a member with its contacts held, after a solve: what a partner outside the cluster meets.
//!
//! In: the last problem of a solver. Out: velocities of blocks per impulse on them. Never here: the solve, who asks.
//! Theory: `docs/theory/coupling.md`, eq. 7m.

use super::newton::linearise;
use super::residuals::Task;
use super::skew::Stiffness;
use super::solver::Solver;
use glam::{DMat3, DVec3};
use metachron_core::PlainLoop;

/// The share of an impulse that a solve without a factor may leave.
const LEFT_SHARE: f64 = 1e-6;

impl Solver {
    /// W of some blocks of a member of the last problem, row by row, with the contacts and rows that bear something held as they were
    /// solved: J (⊕A/f + JᵀGJ)⁻¹ Jᵀ. `false` where rounding leaves it without a factor.
    pub fn held_compliance(&mut self, member: usize, blocks: &[usize], into: &mut Vec<DMat3>) -> bool {
        linearise(&mut self.iterate);
        let (start, size) = (self.solution.offsets[member], self.iterate.system.members.size());
        for list in &mut self.held {
            list.clear();
            list.resize(size, DVec3::ZERO);
        }
        let [right, x, left] = &mut self.held;
        into.clear();
        into.resize(blocks.len() * blocks.len(), DMat3::ZERO);
        let super::iterate::Iterate { rows, system, gains, .. } = &mut self.iterate;
        let contacts = Stiffness { rows, gains, skews: &[], threads: &PlainLoop };
        if !system.factor(contacts) {
            return false;
        }
        for (column, &pushed) in blocks.iter().enumerate() {
            for axis in 0..3 {
                right[start + pushed] = DVec3::AXES[axis];
                x.fill(DVec3::ZERO);
                let goal = LEFT_SHARE * system.members.measure(right).root();
                system.solve(contacts, &mut Task { right, x, left, goal });
                for (row, &block) in blocks.iter().enumerate() {
                    *into[row * blocks.len() + column].col_mut(axis) = x[start + block];
                }
            }
            right[start + pushed] = DVec3::ZERO;
        }
        true
    }
}
