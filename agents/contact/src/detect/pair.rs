//! A pair that is searched for places that may close, the two sides of a touch, and the contact that they make.
//!
//! In: members with the velocities they have and would have, touches. Out: contacts of the problem, and their owners. Never here: which touches there
//! are.

use crate::detect::ClusterScene;
use crate::member::memory::{Partner, Spin};
use crate::member::participant::{Progress, velocity};
use crate::member::{Participant, SkinPoint};
use crate::push_out::push_out_m_s;
use crate::solve::{Contact, Side};
use glam::DVec3;
use metachron_geometry::narrow_phase::{StaticSolid, TouchKey};
use metachron_geometry::{CollisionShape, ContactSide, Place, Touch};

/// A place is taken up if its gap may close below this within the step, metres.
pub(crate) const LOOK_M: f64 = 4e-4;
/// Sides that are closer than this have met, metres.
pub(crate) const MET_M: f64 = 1e-6;

/// Where a contact belongs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Owner {
    /// The participant that remembers it: the lower number, side 0.
    pub member: usize,
    pub partner: Partner,
    /// The participant on side 1, where there is one.
    pub other: Option<usize>,
    /// The name of the place within its pair.
    pub key: TouchKey,
    /// Its friction about the normal, and its row in the problem.
    pub spin: Spin,
    pub spin_row: Option<usize>,
    /// The force that pushes its sides apart where their bodies began inside each other, N, ≥ 0, and its row in the
    /// problem.
    pub push_n: f64,
    pub push_row: Option<usize>,
    /// The point of the skin of each side.
    pub places: [Place; 2],
    /// Newton's coefficient of restitution of its pair, 0 to 1.
    pub restitution: f64,
    /// How long side 1 takes to answer, seconds: longer than a step where its body is stepped elsewhere.
    pub late_s: f64,
}

impl Owner {
    pub(crate) fn name(&self) -> (usize, Partner, TouchKey) {
        (self.member, self.partner, self.key)
    }

    /// The pair that it belongs to.
    pub const fn pair(&self) -> (usize, Partner) {
        (self.member, self.partner)
    }

    /// Its participants.
    pub fn both(&self) -> impl Iterator<Item = usize> + use<> {
        std::iter::once(self.member).chain(self.other)
    }
}

/// The inputs of a round of the search.
pub(crate) struct Round<'a, 'p> {
    pub scene: &'a ClusterScene,
    pub all: &'a [Participant<'p>],
    pub progress: &'a [Progress],
    pub h_s: f64,
    pub judge: Judge,
}

/// By which velocities a place is judged.
#[derive(Clone, Copy)]
pub(crate) enum Judge {
    /// By velocities at the start and without contact, each side's alone too.
    Predicted,
    /// By velocities of a solution.
    Solved,
}

/// The other side that a member is searched against.
#[derive(Clone, Copy)]
pub(crate) enum Against<'a> {
    /// Another member.
    Member(usize),
    /// A static solid, with its number.
    Static { number: u32, solid: &'a StaticSolid },
    /// The member itself.
    Own,
}

/// A member and the other side that it is searched against.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) member: usize,
    pub(crate) against: Against<'a>,
}

/// How far a pair is searched.
#[derive(Clone, Copy)]
pub(crate) struct Reaching {
    /// From where it is, metres.
    pub(crate) reach_m: f64,
    /// On its way, at the moment at which it is this near; `None` for a pair that is searched where it is.
    pub(crate) swept_m: Option<f64>,
}

impl<'a> Round<'a, '_> {
    /// Whether it is the one before the solve.
    pub(crate) fn predicts(&self) -> bool {
        matches!(self.judge, Judge::Predicted)
    }

    /// The velocities at which a member's place moves, as far as this round knows.
    pub(crate) fn moved(&self, member: usize) -> &'a [DVec3] {
        let state = &self.progress[member];
        if self.predicts() { &state.v_predicted } else { &state.v_mean }
    }
}

impl Pair<'_> {
    /// The other side, as the member remembers it.
    pub(crate) fn partner(&self, all: &[Participant<'_>]) -> Partner {
        match self.against {
            Against::Member(other) => Partner::Agent(all[other].id),
            Against::Static { number, .. } => Partner::Static(number),
            Against::Own => Partner::Own,
        }
    }

    /// The member on side 1; `None` for a static solid.
    pub(crate) fn other(&self) -> Option<usize> {
        match self.against {
            Against::Member(other) => Some(other),
            Against::Own => Some(self.member),
            Against::Static { .. } => None,
        }
    }
}

/// The two sides of a touch.
pub(crate) struct Facing<'a> {
    pub skins: [&'a CollisionShape; 2],
    pub sides: [Side; 2],
    /// How far the skins lie inside the shapes that touch, metres.
    pub recess_m: f64,
    /// The velocity of each side that it is led by, beyond that of its blocks, m/s.
    led_m_s: [DVec3; 2],
}

impl Pair<'_> {
    /// The sides of a touch between bodies that have gone as far as `ways`.
    pub(crate) fn facing<'a>(
        &self,
        round: &Round<'_, '_>,
        touch: &Touch,
        ways: [DVec3; 2],
        skins: [&'a CollisionShape; 2],
    ) -> Facing<'a> {
        let all = round.all;
        let back = |place: &Place, way: DVec3| match *place {
            Place::Point(point) => Place::Point(point - way),
            Place::Chain { .. } | Place::Surface { .. } => *place,
        };
        let (on_a, on_b) = (back(&touch.on_a, ways[0]), back(&touch.on_b, ways[1]));
        let point = |member: usize, place: &Place, contact: ContactSide| {
            let point = all[member].member.skin_point(place, contact);
            SkinPoint { side: point.side.of_member(member), ..point }
        };
        let a = point(self.member, &on_a, ContactSide::first(touch.normal));
        let b = self.other().map(|other| point(other, &on_b, ContactSide::second(touch.normal)));
        let b = b.unwrap_or(Side::FIXED.into());
        let (sides, led_m_s) = ([a.side, b.side], [a.led_m_s, b.led_m_s]);
        Facing { skins, sides, recess_m: a.recess_m + b.recess_m, led_m_s }
    }
}

impl Facing<'_> {
    /// How fast a gap opens with the velocities `of` each member, m/s.
    pub(crate) fn opening_m_s<'a>(&self, normal: DVec3, of: impl Fn(usize) -> &'a [DVec3]) -> f64 {
        let [a, b] = [0, 1].map(|at| {
            let side = &self.sides[at];
            (velocity(side, &of) + self.led_m_s[at]).dot(normal)
        });
        a - b
    }
}

/// Whether a gap may close within the step, by the motion of both or of either alone, as it is or as it would be
/// without contact: a body that rests on one that the ground stops would else not be seen.
pub(crate) fn closes(touch: &Touch, facing: &Facing<'_>, progress: &[Progress], h_s: f64) -> bool {
    let led = facing.led_m_s.map(|led| led.dot(touch.normal));
    [(|p: &Progress| &p.v_before[..]) as fn(&Progress) -> &[DVec3], |p: &Progress| &p.v_predicted[..]].into_iter().any(
        |of| {
            let [a, b] =
                facing.sides.each_ref().map(|side| velocity(side, |member| of(&progress[member])).dot(touch.normal));
            let (a, b) = (a + led[0], b + led[1]);
            [a - b, a, -b].into_iter().any(|opening_m_s| touch.gap_m + opening_m_s * h_s < LOOK_M)
        },
    )
}

/// A contact of the problem; an overlap with a body that is stepped elsewhere is pushed out in the steps of that body.
pub(crate) fn taken_up(round: &Round<'_, '_>, owner: &Owner, touch: &Touch, facing: &Facing<'_>) -> Contact {
    let Facing { skins: [mine, theirs], sides, led_m_s, .. } = *facing;
    let let_go_m_s = slower_push_out(touch, round.scene.depth_m(), round.h_s, owner.late_s);
    let tangent = touch.normal.any_orthonormal_vector();
    Contact {
        sides,
        normal: touch.normal,
        tangents: [tangent, touch.normal.cross(tangent)],
        gap_m: touch.gap_m,
        friction: mine.friction_with(theirs),
        parting_m_s: 0.0,
        surface_m_s: led_m_s[1] - led_m_s[0] + let_go_m_s,
        owed_slip_m: DVec3::ZERO,
        warm_n_s: DVec3::ZERO,
        load_n_s: 0.0,
        overlap_m: 0.0,
    }
}

/// The velocity that a contact's sides are let go on with where one of them takes `late_s` seconds to answer: an overlap deeper than
/// contacts rest, `rests_m`, is pushed out once in that time, and not in each step of `h_s` until it shows (eq. 8).
fn slower_push_out(touch: &Touch, rests_m: f64, h_s: f64, late_s: f64) -> DVec3 {
    if touch.gap_m >= -rests_m || late_s <= h_s {
        return DVec3::ZERO;
    }
    let slow = push_out_m_s(-rests_m, h_s) + push_out_m_s(touch.gap_m + rests_m, late_s);
    touch.normal * (push_out_m_s(touch.gap_m, h_s) - slow).min(0.0)
}
