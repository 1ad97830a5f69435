//! Rows of the cluster's problem that hold two points or two spins together: springs, links, drives, joints.
//!
//! In: rows with what they belong to. Out: the same in a list, and the forces that they gave. Never here: contacts, what a row is made of.

use super::arms::Arms;
use super::memory::Partner;
use super::search::velocity;
use super::yielding::SlidingRow;
use super::{Participant, Progress};
use crate::cluster::{Hold, JointRow};
use glam::DVec3;
use metachron_core::{AgentId, Grip};
use metachron_geometry::narrow_phase::TouchKey;

/// A fine step as rows are laid out for it.
#[derive(Clone, Copy)]
pub(super) struct FineStep<'a, 'b> {
    pub all: &'a [Participant<'b>],
    pub progress: &'a [Progress],
    /// How long it is, seconds.
    pub h_s: f64,
    /// How long after the start of the macro step it begins, seconds.
    pub after_s: f64,
    /// By how much a joint that holds may be off, metres.
    pub joint_miss_m: f64,
}

/// Where a row belongs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowOwner {
    /// The participant that remembers it: side 0, the lower number of two.
    pub member: usize,
    /// The participant on side 1, where there is one.
    pub other: Option<usize>,
    pub partner: Partner,
    /// The name of the row within its tie.
    pub key: u32,
    /// Who pulls at whom, where it is a force by which somebody holds a body.
    pub hold: Option<Holders>,
    /// The force above which its tie tears, N: infinite of one that never does, and of rows that hold turns.
    pub tears_above_n: f64,
    /// Whether it takes back what it has crept: of one that knows its velocity, and no place.
    pub owes: bool,
}

impl RowOwner {
    /// The way that its row owes after a step that gave `impulse_n_s` (eq. 13).
    pub fn owed_slip_m(&self, row: &JointRow, impulse_n_s: DVec3, progress: &[Progress], h_s: f64) -> DVec3 {
        if !self.owes {
            return DVec3::ZERO;
        }
        let [a, b] = row.sides.map(|side| velocity(&side, |member| &progress[member].solved[..]));
        row.owed_slip_after(impulse_n_s, a - b, row.hold.most_n_s(impulse_n_s), h_s)
    }

    /// Its participants.
    pub fn both(&self) -> impl Iterator<Item = usize> + use<> {
        std::iter::once(self.member).chain(self.other)
    }
}

/// The two ends of a force, as each is told to the other: `None` is the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Holders {
    pub side_0: AgentId,
    pub side_1: Option<AgentId>,
}

/// The rows of a fine step.
#[derive(Debug, Default)]
pub(super) struct Ties {
    /// Behind those with an owner are those that contacts bring.
    pub rows: Vec<JointRow>,
    /// One for each row but for those.
    pub owners: Vec<RowOwner>,
    /// Those that may slip.
    pub sliding: Vec<SlidingRow>,
    /// The forces at arms that come with them.
    pub arms: Arms,
}

impl Ties {
    pub fn clear(&mut self) {
        self.arms.clear();
        self.rows.clear();
        self.owners.clear();
        self.sliding.clear();
    }

    /// Adds a row, which starts from what it gave in the last step; whether it did. Left out is one of which neither side moves.
    pub fn push(&mut self, step: &FineStep<'_, '_>, row: JointRow, owner: RowOwner) -> bool {
        let sound = row.target_m_s.is_finite() && row.compliance_per_kg.is_none_or(|r| r > 0.0 && r.is_finite());
        if !sound || row.sides.iter().all(|side| side.terms().is_empty()) {
            return false;
        }
        let remembered = step.all[owner.member].memory.recall(owner.partner, place_key(owner.key));
        let warm_n_s = remembered.force_n * step.h_s;
        let owed_slip_m = if owner.owes { remembered.owed_slip_m } else { DVec3::ZERO };
        self.rows.push(JointRow { warm_n_s, owed_slip_m, ..row });
        self.owners.push(owner);
        true
    }

    /// The forces by which `member` is held, of rows that gave `impulses` within a fine step of `h_s` seconds, added to `grips`.
    pub fn grips(&self, member: usize, impulses: &[DVec3], h_s: f64, grips: &mut Vec<Grip>) {
        let mut last = None;
        for (owner, impulse) in self.owners.iter().zip(impulses) {
            let Some(hold) = owner.hold else { continue };
            let (by, force_n) = if owner.member == member {
                (hold.side_1, *impulse / h_s)
            } else if owner.other == Some(member) {
                (Some(hold.side_0), -*impulse / h_s)
            } else {
                continue;
            };
            // the rows of one spring are one force
            let tie = Some((owner.member, owner.partner));
            match grips.last_mut().filter(|_| last == tie) {
                Some(grip) => grip.force_n += force_n,
                None => grips.push(Grip { by, force_n }),
            }
            last = tie;
        }
    }
}

/// Whether a row passes on an impact: what gives no more than a force gives nothing in no time, and what it could push is not there yet.
pub(super) fn is_rigid(row: &JointRow) -> bool {
    let unbounded = match row.hold {
        Hold::All { limit_n_s } | Hold::Across { limit_n_s, .. } => limit_n_s == f64::INFINITY,
        Hold::Along { low_n_s, high_n_s, .. } => match (low_n_s == f64::NEG_INFINITY, high_n_s == f64::INFINITY) {
            (true, true) => true,
            (true, false) | (false, true) => row.warm_n_s != DVec3::ZERO,
            (false, false) => false,
        },
    };
    unbounded && row.limit_m_s == f64::INFINITY && row.compliance_per_kg.is_none() && row.pressed.is_none()
}

/// The name of a row in the memory of its pair.
pub(super) fn place_key(row: u32) -> TouchKey {
    TouchKey { place: row, ..TouchKey::default() }
}
