//! Rows that contacts bring with them: friction about the normal, of sides that turn as a whole, bounded by the contact's pressure; and the
//! push-out of bodies that began inside each other, bounded by the impulse that moves the two alone at a given speed.
//!
//! In: contacts of a fine step. Out: rows behind those of joints. Never here: where places are, the solve.
//! Theory: docs/theory/clusters.md, section 2.

use crate::constraint::ConstraintRows;
use crate::detect::{Owner, Search};
use crate::member::{Participant, Pose};
use crate::push_out::{PUSH_OUT_MAX_M_S, push_out_m_s};
use crate::solve::{Contact, Hold, JointRow, Pressed};

impl ConstraintRows {
    /// Lays out the rows of contacts anew, behind all others: rows of spins, then rows that push out.
    pub fn lay_contacts(&mut self, search: &mut Search, all: &[Participant<'_>], h_s: f64) {
        self.rows.truncate(self.owners.len());
        for (contact, (owner, at)) in search.owners.iter_mut().zip(&search.contacts).enumerate() {
            let row = spin_row(all, owner, at, contact);
            owner.spin_row = row.is_some().then_some(self.rows.len());
            self.rows.extend(row.map(|row| JointRow {
                owed_slip_m: at.normal * owner.spin.owed_rad,
                warm_n_s: at.normal * (owner.spin.torque_n_m * h_s),
                ..row
            }));
        }
        for (owner, at) in search.owners.iter_mut().zip(&search.contacts) {
            owner.push_row = (at.overlap_m != 0.0).then_some(self.rows.len());
            self.rows.extend(owner.push_row.map(|_| JointRow {
                target_m_s: at.normal * (at.surface_m_s.dot(at.normal) - push_out_m_s(at.gap_m, h_s)),
                limit_m_s: PUSH_OUT_MAX_M_S,
                warm_n_s: at.normal * (owner.push_n * h_s),
                ..JointRow::new(at.sides, Hold::pushing(at.normal))
            }));
        }
    }
}

/// The row about the normal of a contact, by the place of that in its problem, that owes nothing; `None` where nothing resists or turns.
pub(crate) fn spin_row(all: &[Participant<'_>], owner: &Owner, at: &Contact, contact: usize) -> Option<JointRow> {
    let reach_m = at.friction * owner.spin.radius_m;
    if reach_m <= 0.0 {
        return None;
    }
    let (here, there) = (turns(all, Some(owner.member))?, turns(all, owner.other)?);
    if [&here, &there].iter().all(|pose| pose.turns.terms().is_empty()) {
        return None;
    }
    Some(JointRow {
        target_m_s: there.led_rad_s - here.led_rad_s,
        pressed: Some(Pressed { contact, reach_m }),
        ..JointRow::new([here.turns, there.turns], Hold::motor(at.normal, f64::INFINITY))
    })
}

/// The pose of a member that moves as a whole, or of the world; `None` for a deformable.
fn turns(all: &[Participant<'_>], member: Option<usize>) -> Option<Pose> {
    let Some(member) = member else { return Some(Pose::WORLD) };
    let pose = all[member].member.pose(&[], 0.0)?;
    Some(Pose { turns: pose.turns.of_member(member), ..pose })
}
