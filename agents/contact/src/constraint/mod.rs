//! Rows of the cluster's problem that hold two points or two spins together: springs, links, drives, joints.
//!
//! In: rows with their owners. Out: the same in a list, and the forces that they gave. Never here: contacts, how a row is made.

pub(crate) mod contact_rows;
pub(crate) mod failure;
pub(crate) mod geometric_stiffness;
pub(crate) mod joint;
pub(crate) mod spring;

use crate::agent::Link;
use crate::member::memory::Partner;
use crate::member::participant::{Progress, relative};
use crate::member::{MaterialPoint, Participant, Pose};
use crate::solve::{Hold, JointRow, Side};
pub use failure::FailedAttachment;
use glam::{DQuat, DVec3};
pub use joint::JointTotal;
use metachron_core::{AgentId, Anchor, Grip};
use metachron_geometry::narrow_phase::TouchKey;

/// A fine step as rows are laid out for it.
#[derive(Clone, Copy)]
pub(crate) struct FineStep<'a, 'b> {
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
pub(crate) struct RowOwner {
    /// The participant that remembers it: side 0, the lower number of two.
    pub member: usize,
    /// The participant on side 1, where there is one.
    pub other: Option<usize>,
    pub partner: Partner,
    /// The name of the row within its tie.
    pub key: u32,
    /// The two ends of the pull, where it is a force by which a user or an agent holds a body.
    pub hold: Option<Holders>,
    /// The force above which its tie tears, N, and the most that it gives: infinite for a tie that never tears or yields, and for rows of turns.
    pub tears_above_n: f64,
    pub yields_above_n: f64,
    /// The axes in which it keeps its slip.
    pub frame: Frame,
    /// Its place among the springs of its member that yield, where it is one of them.
    pub own: Option<usize>,
    /// Whether it takes back its creep: true for a row that holds a velocity and knows no position.
    pub owes: bool,
    /// The travels of two joints that it keeps together ([`Remembered::travels`](crate::member::memory::Remembered)).
    pub travels: [f64; 2],
}

impl RowOwner {
    /// The owner of the first row of a tie that holds no member, neither tears nor yields and owes nothing.
    pub fn new(member: usize, other: Option<usize>, partner: Partner) -> Self {
        let (tears_above_n, yields_above_n) = (f64::INFINITY, f64::INFINITY);
        let (hold, frame, own, owes, travels) = (None, Frame::WORLD, None, false, [0.0; 2]);
        Self { member, other, partner, key: 0, hold, tears_above_n, yields_above_n, frame, own, owes, travels }
    }

    /// The way that its row owes after a step that gave `impulse_n_s` (eq. 13).
    pub fn owed_slip_m(&self, row: &JointRow, impulse_n_s: DVec3, progress: &[Progress], h_s: f64) -> DVec3 {
        if !self.owes {
            return DVec3::ZERO;
        }
        let slip_m_s = relative(&row.sides, |member| &progress[member].v_solved);
        row.owed_slip_after(impulse_n_s, slip_m_s, row.hold.most_n_s(impulse_n_s), h_s)
    }

    /// Its participants.
    pub fn both(&self) -> impl Iterator<Item = usize> + use<> {
        std::iter::once(self.member).chain(self.other)
    }
}

/// The two ends of a force, as each is reported to the other: `None` is the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Holders {
    pub side_0: AgentId,
    pub side_1: Option<AgentId>,
}

/// The rows of a fine step.
#[derive(Debug, Default)]
pub(crate) struct ConstraintRows {
    /// Rows with an owner, then the rows that contacts bring.
    pub rows: Vec<JointRow>,
    /// One for each row but for those of contacts.
    pub owners: Vec<RowOwner>,
    /// The rows that may slip.
    pub sliding: Vec<SlidingRow>,
    /// The forces at arms that come with them.
    pub geometric_stiffness: GeometricStiffness,
}

impl ConstraintRows {
    pub fn clear(&mut self) {
        self.geometric_stiffness.clear();
        self.rows.clear();
        self.owners.clear();
        self.sliding.clear();
    }

    /// Adds a row, which starts from its impulse in the last step; whether it did. A row of which neither side moves is
    /// left out.
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

    /// Adds the forces by which rows that gave `impulses` in a fine step hold `member` to `grips`, in the mean over `span_s` seconds: the same
    /// springs in the same order in each fine step.
    pub fn grips(&self, member: usize, impulses: &[DVec3], span_s: f64, grips: &mut Vec<Grip>) {
        let (mut last, mut count) = (None, 0);
        for (owner, impulse) in self.owners.iter().zip(impulses) {
            let Some(hold) = owner.hold else { continue };
            let (by, force_n) = if owner.member == member {
                (hold.side_1, *impulse / span_s)
            } else if owner.other == Some(member) {
                (Some(hold.side_0), -*impulse / span_s)
            } else {
                continue;
            };
            // the rows of one spring are one force
            let tie = Some((owner.member, owner.partner));
            count += usize::from(last != tie);
            last = tie;
            match grips.get_mut(count - 1) {
                Some(grip) => grip.force_n += force_n,
                None => grips.push(Grip { by, force_n }),
            }
        }
    }
}

/// Whether a row passes on an impact: a bounded force gives nothing in no time, and a one-sided row without a load has
/// not met its other end.
pub(crate) fn is_rigid(row: &JointRow) -> bool {
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
pub(crate) fn place_key(row: u32) -> TouchKey {
    TouchKey { place: row, ..TouchKey::default() }
}

/// One end of a spring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End {
    /// The participant; `None` where the end is led from outside.
    pub member: Option<usize>,
    pub point: MaterialPoint,
}

/// The spring between two ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pull {
    pub stiffness_n_m: f64,
    pub damping_n_s_m: f64,
    pub rest_m: f64,
}

impl End {
    pub fn side(&self) -> Side {
        self.member.map_or(Side::FIXED, |member| self.point.side.of_member(member))
    }
}

/// In which way a row slips.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Slides {
    /// The point at an end moves.
    Point(Frame),
    /// A length grows by the motion of side 0 along the axis from side 1 to it.
    Length {
        /// World axes, of length 1.
        axis: DVec3,
    },
}

/// The axes in which a moved point is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    /// From the world's axes.
    pub to_own: DQuat,
    /// −1 where the near end's point moves instead, by the opposite.
    pub sign: f64,
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

/// A row that may slip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlidingRow {
    /// Its place among the rows of the fine step.
    pub row: usize,
    pub slides: Slides,
    /// By how much it slips for each unit of velocity by which it gives way, seconds.
    pub per_m_s: f64,
    /// How far it may be off without having slipped, metres.
    pub free_m: f64,
}

/// The forces of a fine step at arms.
#[derive(Debug, Default)]
pub(crate) struct GeometricStiffness {
    pulls: Vec<ForceAtArms>,
    /// Of each participant, how much inertia its pulls ask for, in shares of its own.
    asked: Vec<f64>,
}

/// A force between two places, as it acts at arms of bodies that move as a whole.
#[derive(Debug, Clone, Copy)]
struct ForceAtArms {
    owner: RowOwner,
    /// Its rows, from the first to past the last.
    rows: [usize; 2],
    /// Whether it holds both ends at one place.
    is_point: bool,
    /// Of its ends; `None` where an end is no such body.
    arms: [Option<Arm>; 2],
}

/// An arm of a body.
#[derive(Debug, Clone, Copy)]
struct Arm {
    /// Its end, and the spin of its body.
    point: Side,
    turns: Side,
    /// From the centre of mass when the step begins, metres, and as its rows have it.
    arm_m: DVec3,
    turned_m: DVec3,
    /// The inverse inertia of the body across it, 1/(kg m²).
    inverse_kg_m2: f64,
    /// The inertia that the force asks for, kg m², and whether the force pulls the body along its arm.
    inertia_kg_m2: f64,
    is_pulled: bool,
    /// The row that adds it.
    added: Option<usize>,
}
