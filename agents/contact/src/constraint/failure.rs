//! Attachments that fail: one that gave more than it can bear over a macro step has torn from the next one on; one that gives the most that
//! it may slips, and holds from then on where it has come to.
//!
//! In: rows with their impulses, members' own attachments. Out: torn and yielded attachments, in the memory of the member that remembers
//! them. Never here: how a row is made, its bound ([`Hold::limited`](crate::solve::Hold::limited)), how events are reported.
//! Theory: docs/theory/clusters.md, eq. 28 and 29.

use crate::constraint::{ConstraintRows, FineStep, Frame, Pull, RowOwner, Slides, SlidingRow};
use crate::lists::entry;
use crate::member::memory::{Partner, UnfinishedLoad};
use crate::member::participant::{Progress, relative};
use crate::member::{GuardedMember, OwnFailure, Participant, Slid};
use crate::solve::JointRow;
use glam::DVec3;

/// A macro step of at least this share of the shortest time that a member's own steps fill in it is no cut one. By (23) it is half of that
/// or more: the shortest n h is no less than h_longest/√2, the own steps of the fastest fill no more than √2 h_longest.
const WHOLE: f64 = 0.5;
/// A row whose force is this share of the most that it gives has yielded, but for the accuracy of a solve.
const ALL_SHARE: f64 = 1.0 - 1e-6;
/// A spring has not slipped within the stretch for this share of its greatest force: that is the accuracy of a solve.
const SLIP_SHARE: f64 = 1e-6;

/// An attachment that tore at the end of a macro step, or began to yield in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FailedAttachment {
    /// The participant that remembers it, by its place in the list: of a joint the first body, of a link the lower number, else whose own
    /// it is.
    pub member: usize,
    /// The participant at its other end; `None` is the world.
    pub other: Option<usize>,
    /// A link, a joint, or an attachment that is the participant's own.
    pub partner: Partner,
    /// The force of a torn attachment, the mean over the macro step and over those cut short before it; else the force at which it yields, N.
    pub force_n: f64,
}

/// The attachments that can tear or yield, in one macro step.
#[derive(Debug, Default)]
pub(crate) struct Failures {
    /// By participants and partners.
    loads: Vec<Load>,
    pub torn: Vec<FailedAttachment>,
    /// Attachments that had never yielded before.
    pub yielded: Vec<FailedAttachment>,
}

/// The impulse of an attachment that may tear, since the macro step began.
#[derive(Debug, Clone, Copy)]
struct Load {
    owner: RowOwner,
    impulse_n_s: DVec3,
}

impl Failures {
    /// Begins a macro step, for the first time or again.
    pub fn begin(&mut self) {
        self.loads.clear();
        self.torn.clear();
        self.yielded.clear();
    }

    /// Adds the impulse of a row.
    pub fn note(&mut self, owner: &RowOwner, impulse_n_s: DVec3) {
        if owner.tears_above_n < f64::INFINITY {
            let order = |owner: &RowOwner| (owner.member, owner.partner);
            let none = || Load { owner: *owner, impulse_n_s: DVec3::ZERO };
            let load = entry(&mut self.loads, &order(owner), |load| order(&load.owner), none);
            load.impulse_n_s += impulse_n_s;
        }
    }

    /// Adds the impulses of a member's own attachments over its step of `h_s` seconds, which has ended.
    pub fn note_own(&mut self, member: usize, body: &GuardedMember<'_>, h_s: f64) {
        for own in body.own_attachments() {
            let owner = RowOwner::new(member, None, Partner::Attachment(own.number));
            self.note(&RowOwner { tears_above_n: own.tears_above_n, ..owner }, own.force_n * h_s);
        }
    }

    /// Ends a macro step of `macro_s` seconds: an attachment that gave too much has torn (eq. 28), and both its members remember that. The
    /// impulse of a step that was cut short counts together with the next: a joint corrects its error by a great force in a short time.
    pub fn end(&mut self, all: &mut [Participant<'_>], macro_s: f64) {
        if self.loads.is_empty() {
            return;
        }
        let whole_s = WHOLE * filled_s(all);
        for Load { owner, impulse_n_s } in &self.loads {
            let (RowOwner { member, other, partner, .. }, impulse_n_s) = (*owner, *impulse_n_s);
            let load = UnfinishedLoad { partner, impulse_n_s, span_s: macro_s };
            let Some(UnfinishedLoad { impulse_n_s, span_s, .. }) = all[member].memory.bear(load, whole_s) else {
                continue;
            };
            let force_n = impulse_n_s.length() / span_s;
            if force_n > owner.tears_above_n {
                owner.both().for_each(|one| all[one].memory.tear(partner));
                self.torn.push(FailedAttachment { member, other, partner, force_n });
            }
        }
    }

    /// Lets the rows of a fine step that gave all that they may slip to where they then are (eq. 29).
    pub fn slip(
        &mut self,
        all: &mut [Participant<'_>],
        constraints: &ConstraintRows,
        impulses_n_s: &[DVec3],
        progress: &[Progress],
    ) {
        for sliding in &constraints.sliding {
            let (row, impulse_n_s, owner) =
                (&constraints.rows[sliding.row], impulses_n_s[sliding.row], &constraints.owners[sliding.row]);
            if !row.gives_all(impulse_n_s, ALL_SHARE) {
                continue;
            }
            let moves_m_s = relative(&row.sides, |member| &progress[member].v_solved);
            let given = impulse_n_s * row.compliance_per_kg.unwrap_or(0.0);
            // it gives way against its force, and never along it
            let against = -impulse_n_s.normalize_or_zero();
            let slid_m = row.hold.held_part(moves_m_s - row.target_m_s + given).dot(against) * sliding.per_m_s;
            if slid_m <= sliding.free_m {
                continue;
            }
            let slid = sliding.slides.slid(against * (slid_m - sliding.free_m));
            let one = &mut all[owner.member];
            let first = !one.memory.has_slipped(owner.partner);
            let slip = one.memory.slip(owner.partner);
            match owner.own {
                Some(place) => one.member.change(|m| m.give_way(OwnFailure::Slips(place, slid))),
                None => slip.slid += slid,
            }
            if first {
                let RowOwner { member, other, partner, yields_above_n: force_n, .. } = *owner;
                self.yielded.push(FailedAttachment { member, other, partner, force_n });
            }
        }
    }
}

/// The shortest time that a member's own steps within a macro step fill where nothing cuts it short, seconds.
fn filled_s(all: &[Participant<'_>]) -> f64 {
    let here = all.iter().filter(|one| !one.member.is_remote());
    here.map(|one| f64::from(one.parts) * one.alone_s).fold(f64::INFINITY, f64::min)
}

impl Participant<'_> {
    /// Lets go of its own attachments that have torn.
    pub(crate) fn let_go(&mut self) {
        for torn in self.memory.torn() {
            if let Partner::Attachment(number) = torn {
                self.member.change(|m| m.give_way(OwnFailure::Tears(*number)));
            }
        }
    }
}

impl Slides {
    /// The slip of a row that has moved by `by_m`, world axes, metres.
    fn slid(self, by_m: DVec3) -> Slid {
        match self {
            Self::Point(Frame { to_own, sign }) => Slid { moved_m: to_own * by_m * sign, longer_m: 0.0 },
            Self::Length { axis } => Slid { moved_m: DVec3::ZERO, longer_m: by_m.dot(axis) },
        }
    }
}

impl ConstraintRows {
    /// Notes how the row laid out last slips where it gives all that it may; nothing where it never does.
    pub(crate) fn slides(&mut self, slides: Slides, per_m_s: f64, free_m: f64) {
        if self.owners.last().is_some_and(|owner| owner.yields_above_n < f64::INFINITY) {
            self.sliding.push(SlidingRow { row: self.owners.len() - 1, slides, per_m_s, free_m });
        }
    }

    /// The same of the row of a spring.
    pub(crate) fn spring_slides(&mut self, step: &FineStep<'_, '_>, pull: &Pull, slides: Slides) {
        let Pull { stiffness_n_m, damping_n_s_m, .. } = *pull;
        let Some(owner) = self.owners.last().filter(|_| stiffness_n_m > 0.0) else { return };
        // the part that its damper bears need not be slipped
        let per_m_s = step.h_s + damping_n_s_m / stiffness_n_m;
        self.slides(slides, per_m_s, SLIP_SHARE * owner.yields_above_n / stiffness_n_m);
    }
}

impl JointRow {
    /// Whether an impulse is so much of the most that the row gives in its direction; never of a row that gives as much as it takes.
    pub(crate) fn gives_all(&self, impulse_n_s: DVec3, share: f64) -> bool {
        let most_n_s = self.hold.most_n_s(impulse_n_s);
        most_n_s < f64::INFINITY && impulse_n_s.length() >= share * most_n_s && impulse_n_s != DVec3::ZERO
    }
}
