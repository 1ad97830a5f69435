//! Springs, grasps and links of members as rows of the cluster's problem: implicit at both ends, whatever the ends are.
//!
//! In: what members see of springs on them and links between them. Out: rows, and the forces that they gave. Never here: contacts.
//! Theory: docs/theory/clusters.md, eq. 14.

use super::Participant;
use super::memory::Partner;
use crate::AnchorSpring;
use crate::cluster::{Hold, JointRow, Side, Spring};
use glam::DVec3;
use metachron_core::{AgentId, Grip};

/// Where a row belongs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowOwner {
    /// The participant on side 0, which remembers it.
    pub member: usize,
    pub partner: Partner,
    /// The agent that pulls; `None` for the user's spring.
    pub by: Option<AgentId>,
}

/// The rows of a fine step.
#[derive(Debug, Default)]
pub(super) struct Springs {
    pub rows: Vec<JointRow>,
    /// One for each row.
    pub owners: Vec<RowOwner>,
}

impl Springs {
    /// Lays out all rows of a fine step of `h_s` seconds that begins `after_s` seconds into the macro step.
    pub fn gather(&mut self, all: &[Participant<'_>], h_s: f64, after_s: f64) {
        self.rows.clear();
        self.owners.clear();
        for (member, one) in all.iter().enumerate() {
            let mut number = 0..;
            for spring in one.context.anchor_springs() {
                let number = number.next().unwrap_or(0);
                self.pull(all, member, (&spring, number), (h_s, after_s));
            }
        }
    }

    /// A spring to a point that moves by itself.
    fn pull(
        &mut self,
        all: &[Participant<'_>],
        member: usize,
        (spring, number): (&AnchorSpring, u32),
        (h_s, after_s): (f64, f64),
    ) {
        let Some(point) = all[member].member.anchor(spring.anchor) else { return };
        let target = spring.target + spring.target_velocity * after_s;
        let law = Spring {
            stiffness_n_m: spring.stiffness_n_m,
            damping_n_s_m: spring.damping_n_s_m,
            stretch_m: point.position - target,
        };
        let strength = law.stiffness_n_m * h_s + law.damping_n_s_m;
        if !(strength > 0.0 && strength.is_finite() && target.is_finite() && spring.target_velocity.is_finite()) {
            return;
        }
        let partner = Partner::Tie(number);
        let sides = [point.side.of_member(member), Side::FIXED];
        let warm_n_s = all[member].memory.recall(partner, 0).force_n * h_s;
        let row = JointRow { warm_n_s, ..JointRow::new(0, sides, Hold::ALL) }.with_spring(law, h_s);
        self.rows.push(JointRow { target_m_s: row.target_m_s + spring.target_velocity, ..row });
        self.owners.push(RowOwner { member, partner, by: spring.by });
    }

    /// The forces of springs on `member` that gave `impulses` within a fine step of `h_s` seconds, added to `grips`.
    pub fn grips(&self, member: usize, impulses: &[DVec3], h_s: f64, grips: &mut Vec<Grip>) {
        let mine = self.owners.iter().zip(impulses).filter(|(owner, _)| owner.member == member);
        grips.extend(mine.map(|(owner, impulse)| Grip { by: owner.by, force_n: *impulse / h_s }));
    }
}
