//! What all contacts of the last problem give against a motion from outside: the stiffness of what is led, condensed to its contacts.
//!
//! In: the last problem of a solver, a velocity of the sides of each contact that is not that of any block. Out: impulses. Never here: the
//! solve, who moves. Theory: `docs/theory/coupling.md`, eq. 7s.

use super::iterate::Iterate;
use super::newton::linearise;
use super::residuals::Task;
use super::skew::Stiffness;
use super::solver::Solver;
use glam::DVec3;
use metachron_core::PlainLoop;

/// The share of the right side that a solve without a factor may leave: contacts are harder than bodies by 10⁴ to 10⁷, and what they give is the
/// difference.
const LEFT_SHARE: f64 = 1e-9;

impl Solver {
    /// By how much the impulse of each contact on its side 0 changes where side 0 moves by `moved_m_s` against side 1 beyond what blocks do, one
    /// of each contact, world axes: −S u with S = G − G J (⊕A/f + JᵀGJ)⁻¹ Jᵀ G, all contacts and rows being held as they were solved. `None`
    /// where rounding leaves no factor.
    pub(crate) fn resistance(&mut self, moved_m_s: &[DVec3]) -> Option<&[DVec3]> {
        linearise(&mut self.iterate);
        let Iterate { rows, system, gains, .. } = &mut self.iterate;
        self.resisted.clear();
        self.resisted.resize(rows.len(), DVec3::ZERO);
        for (k, moved) in moved_m_s.iter().enumerate() {
            self.resisted[k] = gains[k] * (rows.rows[k].frame.transpose() * *moved);
        }
        for list in &mut self.held {
            list.clear();
            list.resize(system.members.size(), DVec3::ZERO);
        }
        let [right, x, left] = &mut self.held;
        rows.scatter(&self.resisted, right);
        let goal = LEFT_SHARE * system.members.measure(right).root();
        let contacts = Stiffness { rows, gains, skews: &[], threads: &PlainLoop };
        if !system.factor(contacts) {
            return None;
        }
        system.solve(contacts, &mut Task { right, x, left, goal });
        for (k, given) in self.resisted.iter_mut().enumerate() {
            *given = rows.rows[k].frame * (gains[k] * rows.velocity(k, x) - *given);
        }
        self.resisted.truncate(moved_m_s.len());
        Some(&self.resisted)
    }
}
