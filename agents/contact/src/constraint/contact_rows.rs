//! Rows that contacts bring with them: friction about the normal, of sides that turn as a whole, bounded by what presses the contact; and the
//! push-out of bodies that began inside each other, bounded by what moves the two alone.
//!
//! In: contacts of a fine step. Out: rows behind those of joints. Never here: where places are, the solve.
//! Theory: docs/theory/clusters.md, section 2.

use crate::constraint::ConstraintRows;
use crate::detect::{Owner, Search};
use crate::member::{ClusterMember, Participant};
use crate::push_out::{PUSH_OUT_MAX_M_S, push_out_m_s};
use crate::solve::{Contact, Hold, JointRow, Pressed, Side};
use glam::DVec3;

/// The rows of contacts of a fine step, in the order of those behind the rows of joints.
#[derive(Debug, Default)]
pub(crate) struct ContactRows {
    /// The contacts of the rows of spins.
    spins: Vec<usize>,
    /// The contacts of the rows that push out, behind them.
    pushes: Vec<usize>,
}

/// How one side of a contact turns: its spin, and that beyond its blocks, rad/s.
struct Turns {
    side: Side,
    led_rad_s: DVec3,
}

impl ContactRows {
    /// Lets go of the rows of the last solve: nothing is solved.
    pub fn clear(&mut self) {
        self.spins.clear();
        self.pushes.clear();
    }

    /// Lays out the rows anew for the contacts as they are.
    pub fn lay(&mut self, search: &Search, all: &[Participant<'_>], constraints: &mut ConstraintRows, h_s: f64) {
        constraints.rows.truncate(constraints.owners.len());
        self.clear();
        for (contact, (owner, at)) in search.owners.iter().zip(&search.contacts).enumerate() {
            let Some(row) = spin_row(all, owner, at, contact) else { continue };
            constraints.rows.push(JointRow {
                owed_slip_m: at.normal * owner.spin.owed_rad,
                warm_n_s: at.normal * (owner.spin.torque_n_m * h_s),
                ..row
            });
            self.spins.push(contact);
        }
        for (contact, (owner, at)) in search.owners.iter().zip(&search.contacts).enumerate() {
            if at.overlap_m == 0.0 {
                continue;
            }
            constraints.rows.push(JointRow {
                target_m_s: at.normal * (at.surface_m_s.dot(at.normal) - push_out_m_s(at.gap_m, h_s)),
                limit_m_s: PUSH_OUT_MAX_M_S,
                warm_n_s: at.normal * (owner.push_n * h_s),
                ..JointRow::new(at.sides, Hold::pushing(at.normal))
            });
            self.pushes.push(contact);
        }
    }

    /// The contacts of the rows of spins, with the place of each row among all of the problem.
    pub fn spins(&self, constraints: &ConstraintRows) -> impl Iterator<Item = (usize, usize)> + use<'_> {
        self.spins.iter().copied().zip(constraints.owners.len()..)
    }

    /// The same of the rows that push out.
    pub fn pushes(&self, constraints: &ConstraintRows) -> impl Iterator<Item = (usize, usize)> + use<'_> {
        self.pushes.iter().copied().zip(constraints.owners.len() + self.spins.len()..)
    }
}

/// The row about the normal of a contact, by the place of that in its problem, that owes nothing; `None` where nothing resists or turns.
pub(crate) fn spin_row(all: &[Participant<'_>], owner: &Owner, at: &Contact, contact: usize) -> Option<JointRow> {
    let reach_m = at.friction * owner.spin.radius_m;
    if reach_m <= 0.0 {
        return None;
    }
    let (here, there) = (turns(all, Some(owner.member))?, turns(all, owner.other)?);
    if [&here, &there].iter().all(|turns| turns.side.terms().is_empty()) {
        return None;
    }
    Some(JointRow {
        target_m_s: there.led_rad_s - here.led_rad_s,
        pressed: Some(Pressed { contact, reach_m }),
        ..JointRow::new([here.side, there.side], Hold::motor(at.normal, f64::INFINITY))
    })
}

/// How a member turns, or what never moves; `None` of a body that does not turn as a whole.
fn turns(all: &[Participant<'_>], member: Option<usize>) -> Option<Turns> {
    let Some(member) = member else { return Some(Turns { side: Side::FIXED, led_rad_s: DVec3::ZERO }) };
    let pose = all[member].member.pose(&[], 0.0)?;
    Some(Turns { side: pose.turns.of_member(member), led_rad_s: pose.led_rad_s })
}
