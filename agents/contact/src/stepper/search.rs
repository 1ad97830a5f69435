//! Where members of a cluster may touch each other and the static solids around them within a fine step.
//!
//! In: members with the velocities they have and would have. Out: contacts of the problem, each with its name. Never here: impulses.
//! Theory: docs/theory/clusters.md, section 7.

use super::memory::Partner;
use super::scene::ClusterScene;
use super::{Participant, Progress};
use crate::cluster::{Contact, Side};
use glam::DVec3;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{Aabb, CollisionShape, ContactSide, Touch};

/// A place is taken up if its gap may close below this within the step, metres.
const LOOK_M: f64 = 4e-4;
/// Bodies whose boxes come closer than this within two steps belong together, metres.
const NEAR_M: f64 = 2e-3;
/// How many steps ahead bodies look for each other.
const NEAR_STEPS: f64 = 2.0;

/// Where a contact belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Owner {
    /// The participant that remembers it: the lower number, side 0.
    pub member: usize,
    pub partner: Partner,
    /// The participant on side 1, where there is one.
    pub other: Option<usize>,
    /// The name of the place within its pair.
    pub key: u64,
}

/// Reusable storage, and what was found.
#[derive(Default)]
pub(super) struct Search {
    pub contacts: Vec<Contact>,
    /// One for each contact.
    pub owners: Vec<Owner>,
    /// Pairs of participants that are near each other, the lower first.
    pub near: Vec<[usize; 2]>,
    boxes: Vec<Reach>,
    touches: Vec<Touch>,
    scratch: NarrowPhaseScratch,
}

/// Where a member may be in a step.
#[derive(Debug, Clone, Copy)]
struct Reach {
    member: usize,
    /// Its skin now.
    skin: Aabb,
    /// The fastest speed of any point of it at the start or without contact, m/s.
    speed_m_s: f64,
}

impl Search {
    /// Finds all places of a fine step of `h_s` seconds.
    pub fn find(&mut self, scene: &ClusterScene, all: &[Participant<'_>], progress: &[Progress], h_s: f64) {
        self.contacts.clear();
        self.owners.clear();
        self.near.clear();
        self.boxes.clear();
        for (member, (one, state)) in all.iter().zip(progress).enumerate() {
            if let Some(skin) = one.member.skin() {
                let speed_m_s = one.member.speed_bound(&state.before).max(one.member.speed_bound(&state.seen));
                self.boxes.push(Reach { member, skin: skin.bounds(), speed_m_s });
            }
        }
        self.boxes.sort_unstable_by(|a, b| a.skin.low.x.total_cmp(&b.skin.low.x).then(a.member.cmp(&b.member)));
        self.find_pairs(h_s);
        let near = std::mem::take(&mut self.near);
        for &[a, b] in &near {
            self.find_between(scene, (all, progress), [a, b], h_s);
        }
        self.near = near;
        for member in 0..all.len() {
            self.find_static(scene, (all, progress), member, h_s);
        }
        self.sort();
    }

    /// Pairs whose boxes may meet, by a sweep along x.
    fn find_pairs(&mut self, h_s: f64) {
        let grown = |reach: &Reach| reach.skin.grown(NEAR_STEPS * reach.speed_m_s * h_s + 0.5 * NEAR_M);
        let widest = self.boxes.iter().map(|reach| NEAR_STEPS * reach.speed_m_s * h_s).fold(0.0, f64::max) + NEAR_M;
        for (at, reach) in self.boxes.iter().enumerate() {
            let mine = grown(reach);
            for other in &self.boxes[at + 1..] {
                if other.skin.low.x - widest > mine.high.x {
                    break;
                }
                let theirs = grown(other);
                if mine.low.cmple(theirs.high).all() && theirs.low.cmple(mine.high).all() {
                    self.near.push([reach.member.min(other.member), reach.member.max(other.member)]);
                }
            }
        }
        self.near.sort_unstable();
    }

    fn speed(&self, member: usize) -> f64 {
        self.boxes.iter().find(|reach| reach.member == member).map_or(0.0, |reach| reach.speed_m_s)
    }

    /// Places between two members.
    fn find_between(
        &mut self,
        scene: &ClusterScene,
        (all, progress): (&[Participant<'_>], &[Progress]),
        [a, b]: [usize; 2],
        h_s: f64,
    ) {
        let (Some(here), Some(there)) = (all[a].member.skin(), all[b].member.skin()) else { return };
        if !all[a].may_touch(&all[b]) || scene.lets_through([all[a].id, all[b].id]) {
            return;
        }
        let reach_m = LOOK_M + (self.speed(a) + self.speed(b)) * h_s;
        touches(&here, &there, reach_m, &mut self.scratch, &mut self.touches);
        let skins = [here.form, there.form];
        let partner = Partner::Agent(all[b].id);
        for touch in &self.touches {
            let side = |member: usize, place, contact| all[member].member.side(place, contact).of_member(member);
            let sides = [
                side(a, &touch.on_a, ContactSide::first(touch.normal)),
                side(b, &touch.on_b, ContactSide::second(touch.normal)),
            ];
            let led_m_s = [all[a].member.led_m_s(&touch.on_a), all[b].member.led_m_s(&touch.on_b)];
            if closes(touch, &sides, led_m_s, progress, h_s) {
                self.owners.push(Owner { member: a, partner, other: Some(b), key: touch.key });
                self.contacts.push(contact(touch, sides, led_m_s, skins, progress));
            }
        }
    }

    /// Places between a member and the static solids.
    fn find_static(
        &mut self,
        scene: &ClusterScene,
        (all, progress): (&[Participant<'_>], &[Progress]),
        member: usize,
        h_s: f64,
    ) {
        let Some(skin) = all[member].member.skin() else { return };
        let reach_m = LOOK_M + self.speed(member) * h_s;
        let bounds = skin.bounds().grown(reach_m);
        for (number, solid) in (0..).zip(scene.statics()) {
            if !solid.may_meet(&bounds) {
                continue;
            }
            solid.touches(&skin, reach_m, &mut self.scratch, &mut self.touches);
            let skins = [skin.form, solid.form()];
            for touch in &self.touches {
                let place = all[member].member.side(&touch.on_a, ContactSide::first(touch.normal));
                let sides = [place.of_member(member), Side::FIXED];
                let led_m_s = [all[member].member.led_m_s(&touch.on_a), DVec3::ZERO];
                if closes(touch, &sides, led_m_s, progress, h_s) {
                    let partner = Partner::Static(number);
                    self.owners.push(Owner { member, partner, other: None, key: touch.key });
                    self.contacts.push(contact(touch, sides, led_m_s, skins, progress));
                }
            }
        }
    }

    /// Contacts in the order of their names: sums are then the same whatever found them first.
    fn sort(&mut self) {
        let order = |owner: &Owner| (owner.member, owner.partner, owner.key);
        if self.owners.is_sorted_by_key(order) {
            return;
        }
        let mut both: Vec<_> = self.owners.drain(..).zip(self.contacts.drain(..)).collect();
        both.sort_by_key(|(owner, _)| order(owner));
        for (owner, contact) in both {
            self.owners.push(owner);
            self.contacts.push(contact);
        }
    }
}

/// Whether a gap may close within the step, by the motion of both or of either alone, as it is or as it would be without contact: what
/// lies on something that the ground stops would else not be seen.
fn closes(touch: &Touch, sides: &[Side; 2], led_m_s: [DVec3; 2], progress: &[Progress], h_s: f64) -> bool {
    if sides.iter().all(|side| side.terms().is_empty()) {
        return false;
    }
    let led = led_m_s.map(|led| led.dot(touch.normal));
    let along = |side: &Side, of: fn(&Progress) -> &[DVec3]| -> f64 {
        if side.terms().is_empty() { 0.0 } else { side.velocity(of(&progress[side.member])).dot(touch.normal) }
    };
    [(|p: &Progress| &p.before[..]) as fn(&Progress) -> &[DVec3], |p: &Progress| &p.seen[..]].into_iter().any(|of| {
        let (a, b) = (along(&sides[0], of) + led[0], along(&sides[1], of) + led[1]);
        [a - b, a, -b].into_iter().any(|opening_m_s| touch.gap_m + opening_m_s * h_s < LOOK_M)
    })
}

fn contact(
    touch: &Touch,
    sides: [Side; 2],
    led_m_s: [DVec3; 2],
    skins: [&CollisionShape; 2],
    progress: &[Progress],
) -> Contact {
    let surface_m_s = led_m_s[1] - led_m_s[0];
    let tangent = touch.normal.any_orthonormal_vector();
    Contact {
        key: touch.key,
        sides,
        normal: touch.normal,
        tangents: [tangent, touch.normal.cross(tangent)],
        gap_m: touch.gap_m,
        // a pair takes the geometric mean of both frictions, and the larger restitution
        friction: (skins[0].friction * skins[1].friction).sqrt(),
        restitution: skins[0].restitution.max(skins[1].restitution),
        approach_m_s: along(&sides[1], progress, touch.normal) - along(&sides[0], progress, touch.normal)
            + surface_m_s.dot(touch.normal),
        surface_m_s,
        owed_slip_m: DVec3::ZERO,
        warm_n_s: DVec3::ZERO,
    }
}

/// The velocity of a side along a normal when the fine step begins, m/s.
fn along(side: &Side, progress: &[Progress], normal: DVec3) -> f64 {
    if side.terms().is_empty() { 0.0 } else { side.velocity(&progress[side.member].before).dot(normal) }
}
