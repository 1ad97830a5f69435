//! How bodies and contacts answer a push after a solve, all contacts and rows being held as they were solved: the compliance that a partner
//! outside the cluster meets, and the stiffness of the contacts of led bodies.
//!
//! In: the last problem of a solver. Out: velocities of blocks per impulse on them; impulses of contacts against a motion. Never here: the
//! solve, the use of the answers. Theory: `docs/theory/coupling.md`, eq. 7m and 7s.

use super::iterate::Iterate;
use super::newton::linearise;
use crate::lists::reset;
use crate::solve::equations::gradients::{Stiffness, Task};
use crate::solve::solver::Solver;
use glam::{DMat3, DVec3};
use metachron_core::PlainLoop;

/// The share of an impulse that a solve without a factor may leave.
const LEFT_SHARE: f64 = 1e-6;
/// The same for the impulses of contacts, which are harder than bodies by 10⁴ to 10⁷: these impulses are a difference.
const LEFT_BY_CONTACTS: f64 = 1e-9;

/// Storage of right sides and their solutions, and of the resistance of contacts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Held {
    right: Vec<DVec3>,
    x: Vec<DVec3>,
    left: Vec<DVec3>,
    resisted: Vec<DVec3>,
}

impl Solver {
    /// W of some blocks of a member of the last problem, row by row: J (⊕A/f + JᵀGJ)⁻¹ Jᵀ. `false` where rounding leaves it without a factor.
    pub fn held_compliance(&mut self, member: usize, blocks: &[usize], into: &mut Vec<DMat3>) -> bool {
        if !self.hold() {
            return false;
        }
        let start = self.solution.offsets[member];
        reset(into, blocks.len() * blocks.len(), DMat3::ZERO);
        for (column, &pushed) in blocks.iter().enumerate() {
            for axis in 0..3 {
                self.held.right[start + pushed] = DVec3::AXES[axis];
                self.push(LEFT_SHARE);
                for (row, &block) in blocks.iter().enumerate() {
                    *into[row * blocks.len() + column].col_mut(axis) = self.held.x[start + block];
                }
            }
            self.held.right[start + pushed] = DVec3::ZERO;
        }
        true
    }

    /// By how much the impulse of each contact on its side 0 changes where side 0 moves by `moved_m_s` against side 1 beyond its blocks, one
    /// of each contact, world axes: −S u with S = G − G J (⊕A/f + JᵀGJ)⁻¹ Jᵀ G. `None` where rounding leaves no factor.
    pub(crate) fn resistance(&mut self, moved_m_s: &[DVec3]) -> Option<&[DVec3]> {
        if !self.hold() {
            return None;
        }
        let Iterate { rows, gains, .. } = &self.iterate;
        let Held { right, resisted, .. } = &mut self.held;
        reset(resisted, rows.len(), DVec3::ZERO);
        for (k, moved) in moved_m_s.iter().enumerate() {
            resisted[k] = gains[k] * (rows.rows[k].frame.transpose() * *moved);
        }
        rows.scatter(resisted, right);
        self.push(LEFT_BY_CONTACTS);
        let (Iterate { rows, gains, .. }, Held { x, resisted, .. }) = (&self.iterate, &mut self.held);
        for (k, given) in resisted.iter_mut().enumerate() {
            *given = rows.rows[k].frame * (gains[k] * rows.velocity(k, x) - *given);
        }
        resisted.truncate(moved_m_s.len());
        Some(resisted)
    }

    /// Factors the problem as it was solved, with nothing that pushes; `false` where rounding leaves no factor.
    fn hold(&mut self) -> bool {
        linearise(&mut self.iterate);
        let Iterate { rows, system, gains, .. } = &mut self.iterate;
        let Held { right, x, left, .. } = &mut self.held;
        for list in [right, x, left] {
            reset(list, system.members.size(), DVec3::ZERO);
        }
        system.factor(Stiffness { rows, gains, skews: &[], threads: &PlainLoop })
    }

    /// The velocities that the right side makes, of which a solve without a factor may leave this share.
    fn push(&mut self, left_share: f64) {
        let Iterate { rows, system, gains, .. } = &mut self.iterate;
        let Held { right, x, left, .. } = &mut self.held;
        x.fill(DVec3::ZERO);
        let goal = left_share * system.members.measure(right).root();
        let contacts = Stiffness { rows, gains, skews: &[], threads: &PlainLoop };
        system.solve(contacts, &mut Task { right, x, left, goal });
    }
}
