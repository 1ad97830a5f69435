//! Attachments that yield: one that gives all that it may slips, and holds from then on where it has come to.
//!
//! In: rows with their bounds, what the solve gave. Out: where attachments hold, in the memory of the member that remembers them.
//! Never here: the bound itself, which is the row's ([`Hold::limited`]). Theory: docs/theory/clusters.md, eq. 29.

use crate::cluster::JointRow;
use crate::constraint::spring::{Name, Pull};
use crate::constraint::{FineStep, Ties};
use crate::joint::{Joint, JointKind};
use crate::law::Link;
use crate::member::memory::Partner;
use crate::member::state::Progress;
use crate::member::{ClusterMember, Participant};
use crate::member::{Pose, Slid};
use glam::{DQuat, DVec3};
use metachron_core::Anchor;

/// A row whose force is this share of the most that it gives has yielded, but for the accuracy of a solve.
const ALL_SHARE: f64 = 1.0 - 1e-6;
/// A spring slips by what it would give this share of the most for, or more: less is the accuracy of a solve.
pub(crate) const SLIP_SHARE: f64 = 1e-6;

/// How an attachment holds that has slipped.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Slip {
    /// Which one.
    pub(crate) partner: Partner,
    /// How far, at an end without axes as [`Frame`] says; of a body's own attachment nothing, for each of its springs slips by itself.
    slid: Slid,
}

/// An attachment that began to yield in a macro step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yielded {
    /// The participant that remembers it, by its place in the list: of a joint the first body, of a link the lower number, else whose own
    /// it is.
    pub member: usize,
    /// The participant at its other end; `None` is the world.
    pub other: Option<usize>,
    /// A link, a joint, or an attachment that is the participant's own.
    pub partner: Partner,
    /// The force at which it yields, N.
    pub force_n: f64,
}

/// In which way a row slips.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Slides {
    /// The point at an end moves.
    Point(Frame),
    /// A length grows by what side 0 moves along the axis from side 1 to it.
    Length {
        /// World axes, of length 1.
        axis: DVec3,
    },
}

/// What an attachment gives at most, and where it keeps its slip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct YieldLimit {
    /// The most force, N; infinite where it never yields.
    pub above_n: f64,
    pub frame: Frame,
}

impl YieldLimit {
    /// Of what never yields.
    pub const NONE: Self = Self { above_n: f64::INFINITY, frame: Frame::WORLD };
}

/// The axes in which a moved point is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    /// From the world's axes.
    pub to_own: DQuat,
    /// −1 where the near end's point moves instead, by the opposite.
    pub sign: f64,
}

/// A row that may slip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlidingRow {
    /// Its place among the rows of the fine step.
    pub row: usize,
    pub slides: Slides,
    /// By how much it slips for each unit of velocity by which it gives way, seconds.
    pub per_m_s: f64,
    /// What it may be off without having slipped, metres.
    pub free_m: f64,
    /// The force of its attachment at which it yields, N.
    pub yields_above_n: f64,
    /// Its place among the springs of its member that yield, where it is one of them.
    pub own: Option<usize>,
}

/// What yields, in one macro step.
#[derive(Debug, Default)]
pub(crate) struct Yielding {
    begun: Vec<Yielded>,
}

impl Slip {
    /// One that has not slipped.
    pub(crate) const fn none(partner: Partner) -> Self {
        Self { partner, slid: Slid { moved_m: DVec3::ZERO, longer_m: 0.0 } }
    }

    /// The joint as it holds now.
    pub(crate) fn joint(&self, joint: &Joint) -> Joint {
        let kind = match joint.kind {
            JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } => {
                JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m: (rest_m + self.slid.longer_m).max(0.0) }
            }
            JointKind::Rope { length_m } => JointKind::Rope { length_m: length_m + self.slid.longer_m },
            kind => kind,
        };
        Joint { anchor_b_m: joint.anchor_b_m + self.slid.moved_m, kind, ..*joint }
    }

    /// The link as it holds now. Between two points without axes of their own nothing of it moves: [`Self::beside`] says how far apart
    /// they rest.
    pub(crate) fn link(&self, link: &Link) -> Link {
        let (here, there) = match (link.here, link.there) {
            (here, Anchor::Local(there)) => (here, Anchor::Local(there + self.slid.moved_m)),
            (Anchor::Local(here), there) => (Anchor::Local(here + self.slid.moved_m), there),
            ends => ends,
        };
        Link { here, there, rest_m: (link.rest_m + self.slid.longer_m).max(0.0), ..*link }
    }

    /// How far from its place the far end of a link holds, world axes, metres: between two points without axes of their own.
    pub(crate) fn beside(&self, link: &Link) -> DVec3 {
        match (link.here, link.there) {
            (Anchor::Local(_), _) | (_, Anchor::Local(_)) => DVec3::ZERO,
            _ => self.slid.moved_m,
        }
    }
}

impl Slides {
    /// What has slipped where its row has moved by so much, world axes, metres.
    fn slid(self, by_m: DVec3) -> Slid {
        match self {
            Self::Point(Frame { to_own, sign }) => Slid { moved_m: to_own * by_m * sign, longer_m: 0.0 },
            Self::Length { axis } => Slid { moved_m: DVec3::ZERO, longer_m: by_m.dot(axis) },
        }
    }
}

impl Frame {
    /// The world's axes at the far end.
    pub const WORLD: Self = Self { to_own: DQuat::IDENTITY, sign: 1.0 };

    /// The axes of a far end in this pose.
    pub fn of(far: &Pose) -> Self {
        Self { to_own: far.rotation.conjugate(), sign: 1.0 }
    }

    /// The axes that a link keeps its slip in, of its ends' participants.
    pub fn of_link(all: &[Participant<'_>], ends: [usize; 2], link: &Link) -> Self {
        let axes = |member: usize, sign: f64| {
            let pose = all[member].member.pose(&[], 0.0);
            pose.map_or(Self::WORLD, |pose| Self { sign, ..Self::of(&pose) })
        };
        match (link.here, link.there) {
            (_, Anchor::Local(_)) => axes(ends[1], 1.0),
            (Anchor::Local(_), _) => axes(ends[0], -1.0),
            _ => Self::WORLD,
        }
    }
}

impl Pull {
    /// By how much its spring slips for each unit of velocity by which it gives way: what its damper bears it need not.
    pub(crate) fn slips_per_m_s(&self, h_s: f64) -> Option<f64> {
        (self.stiffness_n_m > 0.0).then(|| h_s + self.damping_n_s_m / self.stiffness_n_m)
    }
}

impl Ties {
    /// Notes that the row laid out last slips where it gives all that it may; nothing where it never does.
    pub(crate) fn slides(&mut self, row: SlidingRow) {
        if row.yields_above_n < f64::INFINITY {
            self.sliding.push(row);
        }
    }

    /// The same of the row of a spring.
    pub(crate) fn spring_slides(&mut self, step: &FineStep<'_, '_>, pull: &Pull, name: Name, slides: Slides) {
        let (Some(row), Some(per_m_s)) = (self.rows.len().checked_sub(1), pull.slips_per_m_s(step.h_s)) else { return };
        let free_m = SLIP_SHARE * name.yields.above_n / pull.stiffness_n_m;
        self.slides(SlidingRow { row, slides, per_m_s, free_m, yields_above_n: name.yields.above_n, own: None });
    }
}

impl Yielding {
    /// Begins a macro step, for the first time or again.
    pub fn begin(&mut self) {
        self.begun.clear();
    }

    /// Lets the rows of a fine step that gave all that they may slip to where they then are (eq. 29).
    pub fn slip(&mut self, all: &mut [Participant<'_>], ties: &Ties, impulses_n_s: &[DVec3], progress: &[Progress]) {
        for sliding in &ties.sliding {
            let (row, impulse_n_s, owner) =
                (&ties.rows[sliding.row], impulses_n_s[sliding.row], &ties.owners[sliding.row]);
            if !row.gives_all(impulse_n_s, ALL_SHARE) {
                continue;
            }
            let [a, b] = row.sides.map(|side| crate::detect::velocity(&side, |member| &progress[member].solved[..]));
            let given = impulse_n_s * row.compliance_per_kg.unwrap_or(0.0);
            // it gives way against its force, and never along it
            let against = -impulse_n_s.normalize_or_zero();
            let slid_m = row.hold.held_part(a - b - row.target_m_s + given).dot(against) * sliding.per_m_s;
            if slid_m <= sliding.free_m {
                continue;
            }
            let slid = sliding.slides.slid(against * (slid_m - sliding.free_m));
            let one = &mut all[owner.member];
            let (slip, first) = one.memory.slip(owner.partner);
            match sliding.own {
                Some(place) => one.member.slip(place, slid),
                None => slip.slid += slid,
            }
            if first {
                let force_n = sliding.yields_above_n;
                self.begun.push(Yielded { member: owner.member, other: owner.other, partner: owner.partner, force_n });
            }
        }
    }

    pub fn begun(&self) -> &[Yielded] {
        &self.begun
    }
}

impl JointRow {
    /// Whether an impulse is so much of the most that the row gives in its direction; never of a row that gives as much as it takes.
    pub(crate) fn gives_all(&self, impulse_n_s: DVec3, share: f64) -> bool {
        let most_n_s = self.hold.most_n_s(impulse_n_s);
        most_n_s < f64::INFINITY && impulse_n_s.length() >= share * most_n_s && impulse_n_s != DVec3::ZERO
    }
}
