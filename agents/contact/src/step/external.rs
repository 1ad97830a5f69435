//! Impulses on a cluster from outside within a macro step, and its impulses on partners that are stepped elsewhere.
//!
//! In: impulses that partners gave before, forces of users, ends of transmission lines; the impulses of a solve. Out: velocities that known impulses make,
//! rows of lines, sums of the impulses on remote members. Never here: ledgers, waves. Theory: docs/theory/coupling.md, eq. 3, 4c and 10.

use crate::constraint::{ConstraintRows, FineStep, RowOwner};
use crate::lists::reset;
use crate::member::Participant;
use crate::member::memory::Partner;
use crate::member::participant::Progress;
use crate::member::problem::respond;
use crate::solve::{Hold, JointRow, Side};
use glam::DVec3;
use metachron_core::Impulse;

/// An impulse that a partner gave before the macro step: it acts evenly over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownImpulse {
    /// The participant.
    pub member: usize,
    /// Where on it; its member has no meaning.
    pub side: Side,
    /// N·s, or N·m·s of a spin.
    pub impulse: DVec3,
}

/// The end of a transmission line at a participant: it resists the velocity of a point beyond a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineRow {
    /// The participant.
    pub member: usize,
    /// The point; its member has no meaning.
    pub side: Side,
    /// Where it acts.
    pub hold: Hold,
    /// Impedance and damping, N·s/m, > 0.
    pub resistance_n_s_m: f64,
    /// The velocity of its blocks at which it gives nothing, m/s.
    pub target_m_s: DVec3,
}

/// The impulse of a participant on a block of a remote member in a macro step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemoteImpulse {
    /// The participant that touches the remote member or is linked to it.
    pub member: usize,
    /// The remote member, by its place among the participants.
    pub remote: usize,
    /// Its block.
    pub block: usize,
    /// When the fine step began in which it acts, seconds from the start of the macro step.
    pub after_s: f64,
    /// N·s, or N·m·s of a spin.
    pub impulse: DVec3,
}

/// All of it in one macro step.
#[derive(Debug, Default)]
pub struct ExternalImpulses {
    /// The impulses known to act on participants.
    pub known: Vec<KnownImpulse>,
    /// Ends of lines at participants.
    pub lines: Vec<LineRow>,
    /// The impulse of each line on its participant in the last macro step, N·s.
    pub line_impulses: Vec<DVec3>,
    /// The impulses on remote members in the last macro step.
    pub given: Vec<RemoteImpulse>,
    /// When the present fine step begins, seconds from the start of the macro step.
    pub(crate) after_s: f64,
    scratch: Vec<DVec3>,
    residual: Vec<DVec3>,
}

impl ExternalImpulses {
    /// Forgets the inputs of the last macro step.
    pub fn clear(&mut self) {
        self.known.clear();
        self.lines.clear();
    }

    /// Begins a macro step, for the first time or again.
    pub(super) fn begin(&mut self) {
        self.given.clear();
        reset(&mut self.line_impulses, self.lines.len(), DVec3::ZERO);
    }

    /// Lets external impulses on the participant at `place` act in its own step of `own_s` seconds within a macro step
    /// of `macro_s`: the known ones and the forces of users, Jᵀ of them. A member that answers all momentum itself
    /// takes the velocities that they make; one that leaves momentum to the cluster takes them as momentum.
    pub(super) fn act(
        &mut self,
        place: usize,
        one: &Participant<'_>,
        [own_s, macro_s]: [f64; 2],
        state: &mut Progress,
    ) {
        let Self { known, scratch, residual, .. } = self;
        let (member, forces) = (&one.member, one.context.forces);
        scratch.clear();
        if forces.is_empty() && !known.iter().any(|known| known.member == place) {
            return state.push(&[]);
        }
        scratch.resize(member.system().free.len(), DVec3::ZERO);
        let mut give = |side: &Side, impulse: DVec3| {
            for term in side.terms() {
                scratch[term.block] += term.map.transpose() * impulse;
            }
        };
        for known in known.iter().filter(|known| known.member == place) {
            give(&known.side, known.impulse * (own_s / macro_s));
        }
        for force in forces {
            let impulse = Impulse { linear: force.force_n * own_s, angular: force.torque_n_m * own_s };
            member.visit_sides(force.anchor, impulse, |side, impulse| give(&side, impulse));
        }
        if member.system().unanswered.is_empty() {
            respond(member, scratch, residual);
            state.push(scratch);
        } else {
            state.owe(scratch);
        }
    }

    /// Adds the impulse of contacts or rows on a side of theirs, where it is that of a remote member.
    pub(super) fn note(&mut self, all: &[Participant<'_>], by: usize, side: &Side, impulse: DVec3) {
        if side.terms().is_empty() || impulse == DVec3::ZERO || !all[side.member].member.is_remote() {
            return;
        }
        for term in side.terms() {
            let (remote, block) = (side.member, term.block);
            let after_s = self.after_s;
            let same = |given: &&mut RemoteImpulse| {
                (given.member, given.remote, given.block) == (by, remote, block) && given.after_s == after_s
            };
            let part = term.map.transpose() * impulse;
            match self.given.iter_mut().find(same) {
                Some(given) => given.impulse += part,
                None => self.given.push(RemoteImpulse { member: by, remote, block, after_s, impulse: part }),
            }
        }
    }

    /// Adds the impulses of lines' rows.
    pub(super) fn note_line(&mut self, owner: &RowOwner, impulse: DVec3) {
        if let Partner::Line(number) = owner.partner {
            self.line_impulses[number as usize] += impulse;
        }
    }

    /// Adds the impulses of lines in a fine step of `h_s` seconds at led ends: no unknowns, as nothing changes how these move.
    pub(super) fn give_led(&mut self, h_s: f64) {
        for (line, given) in self.lines.iter().zip(&mut self.line_impulses).filter(|(line, _)| line.is_led()) {
            let asked = line.hold.held_part(line.target_m_s * (line.resistance_n_s_m * h_s));
            *given += asked.clamp_length_max(line.hold.most_n_s(asked));
        }
    }
}

impl LineRow {
    /// Whether its end moves as it is led.
    fn is_led(&self) -> bool {
        self.side.terms().is_empty()
    }
}

impl ConstraintRows {
    /// Lays out the ends of transmission lines (eq. 10): implicit in the motion of the point, where something moves it.
    pub fn gather_lines(&mut self, step: &FineStep<'_, '_>, lines: &[LineRow]) {
        for (number, line) in (0..).zip(lines).filter(|(_, line)| !line.is_led()) {
            let sides = [line.side.of_member(line.member), Side::FIXED];
            let row = JointRow {
                target_m_s: line.target_m_s,
                compliance_per_kg: Some((step.h_s * line.resistance_n_s_m).recip()),
                ..JointRow::new(sides, line.hold)
            };
            self.push(step, row, RowOwner::new(line.member, None, Partner::Line(number)));
        }
    }
}
