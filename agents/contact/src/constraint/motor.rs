//! Motors of hinges and slides as rows of the cluster's problem.
//!
//! In: what a motor drives its joint to, where the joint is. Out: a row that gives at most what the motor may. Never here: joints' own
//! rows (`joint.rs`). Theory: docs/theory/clusters.md, section 8.

use crate::constraint::{ConstraintRows, FineStep, RowOwner};
use crate::joint::{Motor, MotorGoal};
use crate::solve::{Hold, JointRow, Side, Spring};
use glam::DVec3;
use std::f64::consts::TAU;

/// A joint with a motor as a fine step finds it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motored {
    /// What the motor acts on, of a and b: spins of a hinge, points of a slide.
    pub sides: [Side; 2],
    /// The joint's axis, world axes, of length 1.
    pub axis: DVec3,
    /// How far b has moved from a along or about it, m or rad.
    pub travel: f64,
    /// How fast it does so when the step begins, m/s or rad/s.
    pub speed: f64,
    /// The inverse mass of both along or about it where nothing else holds them, 1/kg or 1/(kg m²), ≥ 0.
    pub inverse_mass: f64,
    /// Whether travel is known but for whole turns.
    pub turns: bool,
}

impl ConstraintRows {
    /// Lays out the row of a motor. What it gives is not what holds its joint together.
    pub fn motor(&mut self, step: &FineStep<'_, '_>, row: JointRow, owner: RowOwner) {
        let owes = row.compliance_per_kg.is_none();
        self.push(step, row, RowOwner { owes, ..owner });
    }
}

impl Motor {
    /// Its row in a fine step of `h_s` seconds. What moves b forward pushes a back.
    pub(crate) fn row(&self, joint: &Motored, h_s: f64) -> JointRow {
        let Motored { sides, axis, travel, speed, inverse_mass, turns } = *joint;
        let row = JointRow::new(sides, Hold::motor(axis, self.max_effort * h_s));
        match self.goal {
            MotorGoal::Velocity(velocity) => JointRow { target_m_s: axis * -velocity, ..row },
            MotorGoal::Spring { position, velocity, stiffness, damping } => {
                let off = travel - position;
                let off = if turns { off - (off / TAU).round() * TAU } else { off };
                let law = Spring { stiffness_n_m: stiffness, damping_n_s_m: damping, stretch_m: axis * -off };
                let row = row.with_spring(law, h_s);
                let compliance = row.compliance_per_kg.unwrap_or(0.0);
                // what a step resolves, it need not damp (eq. 22a)
                let stiff = h_s * h_s * stiffness;
                let kept = speed * stiff / (1.0 + stiff * inverse_mass);
                let target_m_s = row.target_m_s - axis * ((velocity * h_s * damping + kept) * compliance);
                JointRow { target_m_s, ..row }
            }
        }
    }

    /// Whether it keeps its joint moving.
    pub(crate) fn moves(&self) -> bool {
        matches!(self.goal, MotorGoal::Velocity(velocity) | MotorGoal::Spring { velocity, .. } if velocity != 0.0)
    }
}
