//! The two sides of a touch: how they move, whether they may close within a step, and the contact that they make.
//!
//! In: touches, members. Out: contacts of the problem. Never here: which touches there are.

use super::super::Progress;
use super::super::remote;
use super::{LOOK_M, Owner, Pair, Round};
use crate::cluster::{Contact, Side};
use crate::stepper::ClusterMember;
use glam::DVec3;
use metachron_geometry::{CollisionShape, ContactSide, Place, Touch};

/// The two sides of a touch.
pub(super) struct Facing {
    pub sides: [Side; 2],
    /// How far the skins lie inside the shapes that touch, metres.
    pub recess_m: f64,
    /// The velocity of each side that it is led by, beyond that of its blocks, m/s.
    led_m_s: [DVec3; 2],
}

impl Pair<'_> {
    /// The sides of a touch between bodies that have gone as far as `ways`.
    pub(super) fn facing(&self, round: &Round<'_, '_>, touch: &Touch, ways: [DVec3; 2]) -> Facing {
        let all = round.all;
        let back = |place: &Place, way: DVec3| match *place {
            Place::Point(point) => Place::Point(point - way),
            Place::Chain { .. } | Place::Surface { .. } => *place,
        };
        let (on_a, on_b) = (back(&touch.on_a, ways[0]), back(&touch.on_b, ways[1]));
        let side = |member: usize, place: &Place, contact: ContactSide| {
            all[member].member.side(place, contact).of_member(member)
        };
        let [first, second] = [ContactSide::first(touch.normal), ContactSide::second(touch.normal)];
        let other = self.other();
        let recess_m = |member: usize, place: &Place, contact: ContactSide| all[member].member.recess_m(place, contact);
        Facing {
            recess_m: recess_m(self.member, &on_a, first) + other.map_or(0.0, |other| recess_m(other, &on_b, second)),
            sides: [side(self.member, &on_a, first), other.map_or(Side::FIXED, |other| side(other, &on_b, second))],
            led_m_s: [
                all[self.member].member.led_m_s(&on_a),
                other.map_or(DVec3::ZERO, |other| all[other].member.led_m_s(&on_b)),
            ],
        }
    }
}

impl Facing {
    /// How fast a gap opens with the velocities `of` each member, m/s.
    pub(super) fn opening_m_s<'a>(&self, normal: DVec3, of: impl Fn(usize) -> &'a [DVec3]) -> f64 {
        let [a, b] = [0, 1].map(|at| {
            let side = &self.sides[at];
            (velocity(side, &of) + self.led_m_s[at]).dot(normal)
        });
        a - b
    }
}

/// The velocity of a side with the velocities `of` its member, m/s; zero for one that does not move.
pub(in super::super) fn velocity<'a>(side: &Side, of: impl Fn(usize) -> &'a [DVec3]) -> DVec3 {
    if side.terms().is_empty() { DVec3::ZERO } else { side.velocity(of(side.member)) }
}

/// Whether a gap may close within the step, by the motion of both or of either alone, as it is or as it would be without contact: what
/// lies on something that the ground stops would else not be seen.
pub(super) fn closes(touch: &Touch, facing: &Facing, progress: &[Progress], h_s: f64) -> bool {
    let led = facing.led_m_s.map(|led| led.dot(touch.normal));
    [(|p: &Progress| &p.before[..]) as fn(&Progress) -> &[DVec3], |p: &Progress| &p.seen[..]].into_iter().any(|of| {
        let [a, b] =
            facing.sides.each_ref().map(|side| velocity(side, |member| of(&progress[member])).dot(touch.normal));
        let (a, b) = (a + led[0], b + led[1]);
        [a - b, a, -b].into_iter().any(|opening_m_s| touch.gap_m + opening_m_s * h_s < LOOK_M)
    })
}

/// The two sides of a touch, with their skins.
pub(super) struct Skinned<'a> {
    pub facing: &'a Facing,
    pub skins: [&'a CollisionShape; 2],
}

/// A contact of the problem; from what is stepped elsewhere it comes out in that one's steps.
pub(super) fn taken_up(round: &Round<'_, '_>, owner: &Owner, touch: &Touch, sides: &Skinned<'_>) -> Contact {
    let late_s = owner.other.map_or(0.0, |other| round.all[other].member.answers_after_s());
    let found = contact(touch, sides.facing, sides.skins);
    let let_go_m_s = remote::slower_push_out(touch, round.scene.depth_m(), round.h_s, late_s);
    Contact { surface_m_s: found.surface_m_s + let_go_m_s, ..found }
}

fn contact(touch: &Touch, facing: &Facing, skins: [&CollisionShape; 2]) -> Contact {
    let Facing { sides, led_m_s, .. } = *facing;
    let surface_m_s = led_m_s[1] - led_m_s[0];
    let tangent = touch.normal.any_orthonormal_vector();
    Contact {
        sides,
        normal: touch.normal,
        tangents: [tangent, touch.normal.cross(tangent)],
        gap_m: touch.gap_m,
        friction: skins[0].friction_with(skins[1]),
        parting_m_s: 0.0,
        surface_m_s,
        owed_slip_m: DVec3::ZERO,
        warm_n_s: DVec3::ZERO,
        load_n_s: 0.0,
        overlap_m: 0.0,
    }
}
