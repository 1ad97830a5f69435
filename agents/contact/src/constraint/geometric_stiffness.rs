//! Forces at arms of bodies that move as a whole, and the inertia that such bodies lack for them.
//!
//! In: forces of springs and joints with the places where they act. Out: rows that resist changes of a spin. Never here: forces themselves.
//! Theory: docs/theory/clusters.md, eq. 22.
//!
//! A force f at an arm r turns a body back with the stiffness f·r, which no row knows. A light body that holds much swings by it faster
//! than steps can follow, and would be thrown. Where h² of that stiffness is more than steps bear, inertia is added across the
//! arm: it takes no energy, and a turn that steps can follow has none of it.

use crate::constraint::{ConstraintRows, End, FineStep, ForceAtArm, GeometricStiffness, RowOwner};
use crate::lists::reset;
use crate::member::Participant;
use crate::solve::{Hold, JointRow, Side};
use glam::DVec3;

/// The share of h² times the stiffness of a force that a body's inertia has to reach: at ¼ steps begin to throw it.
const INERTIA_SHARE: f64 = 0.5;
/// The key of the first row of added inertia of a tie.
const ADDED: u32 = 8;

impl GeometricStiffness {
    pub fn clear(&mut self) {
        self.pulls.clear();
    }

    /// Notes a force on the first end of a tie, of which the other has the opposite.
    pub fn note(&mut self, step: &FineStep<'_, '_>, ends: &[End; 2], force_n: DVec3, owner: RowOwner) {
        let FineStep { all, h_s, .. } = *step;
        for (at, (end, force_n)) in ends.iter().zip([force_n, -force_n]).enumerate() {
            let Some(member) = end.member else { continue };
            let Some(pose) = all[member].member.pose(&[], 0.0) else { continue };
            let arm = end.point.position - pose.centre_m;
            let Some(axis) = arm.try_normalize() else { continue };
            // the largest of its stiffnesses: a force that is not along its arm has three
            let stiffness = 0.5 * (force_n.dot(arm) + force_n.length() * arm.length());
            let owner = RowOwner { hold: None, key: ADDED + at as u32, other: Some(member), ..owner };
            let inertia_kg_m2 = INERTIA_SHARE * h_s * h_s * stiffness;
            self.pulls.push(ForceAtArm { owner, member, turns: pose.turns.of_member(member), axis, inertia_kg_m2 });
        }
    }
}

impl ConstraintRows {
    /// Adds the inertia that bodies lack for the forces noted.
    pub fn add_inertia(&mut self, step: &FineStep<'_, '_>) {
        let FineStep { all, progress, .. } = *step;
        let GeometricStiffness { pulls, mut asked } = std::mem::take(&mut self.geometric_stiffness);
        reset(&mut asked, all.len(), 0.0);
        for pull in &pulls {
            asked[pull.member] += pull.share(all);
        }
        for pull in &pulls {
            let lacking = 1.0 - asked[pull.member].recip();
            if lacking > 0.0 && pull.inertia_kg_m2 > 0.0 {
                let row = JointRow {
                    target_m_s: pull.turns.velocity(&progress[pull.member].v_before),
                    compliance_per_kg: Some((pull.inertia_kg_m2 * lacking).recip()),
                    ..JointRow::new([pull.turns, Side::FIXED], Hold::across(pull.axis))
                };
                self.push(step, row, pull.owner);
            }
        }
        self.geometric_stiffness = GeometricStiffness { pulls, asked };
    }
}

impl ForceAtArm {
    /// The trace of the inertia asked for over that of the body: no direction lacks more.
    fn share(&self, all: &[Participant<'_>]) -> f64 {
        let Some(spin) = self.turns.terms().first().map(|term| term.block) else { return 0.0 };
        let own =
            all[self.member].member.system().blocks.iter().find(|block| block.row == spin && block.column == spin);
        let Some(own) = own else { return 0.0 };
        let inverse = own.value.inverse();
        let trace = inverse.x_axis.x + inverse.y_axis.y + inverse.z_axis.z;
        self.inertia_kg_m2 * (trace - self.axis.dot(inverse * self.axis))
    }
}
