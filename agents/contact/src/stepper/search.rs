//! Where members of a cluster may touch each other and the static solids around them within a fine step.
//!
//! In: members with the velocities they have and would have. Out: contacts of the problem, each with its name. Never here: impulses.
//! Theory: docs/theory/clusters.md, section 9.

use super::memory::Partner;
use super::scene::ClusterScene;
use super::{Participant, Progress};
use crate::cluster::{Contact, Side};
use glam::DVec3;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, TouchKey, touches};
use metachron_geometry::{Aabb, CollisionShape, ContactSide, Place, ShapeKind, Touch};

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
    pub key: TouchKey,
}

impl Owner {
    fn name(&self) -> (usize, Partner, TouchKey) {
        (self.member, self.partner, self.key)
    }
}

/// What a round of the search goes by.
pub(super) struct Round<'a, 'p> {
    pub scene: &'a ClusterScene,
    pub all: &'a [Participant<'p>],
    pub progress: &'a [Progress],
    pub h_s: f64,
    pub judge: Judge,
}

/// What was searched: two that may touch, their skins, and how far.
struct Searched<'a> {
    owner: Owner,
    skins: [&'a CollisionShape; 2],
    reach_m: f64,
}

impl Round<'_, '_> {
    /// Whether it is the one before the solve.
    fn foresees(&self) -> bool {
        matches!(self.judge, Judge::Foreseen)
    }
}

/// Reusable storage, and what was found.
#[derive(Default)]
pub(super) struct Search {
    pub contacts: Vec<Contact>,
    /// One for each contact.
    pub owners: Vec<Owner>,
    /// Pairs of participants that are near each other, the lower first.
    pub near: Vec<[usize; 2]>,
    /// What was looked at in this fine step, by rising names once it is sorted.
    looks: Vec<Look>,
    /// How many contacts were found before the solve.
    known: usize,
    /// Pairs near each other by the velocities of a solution.
    again: Vec<[usize; 2]>,
    boxes: Vec<Reach>,
    touches: Vec<Touch>,
    scratch: NarrowPhaseScratch,
}

/// The two sides of a touch.
struct Facing {
    sides: [Side; 2],
    /// The velocity of each side that it is led by, beyond that of its blocks, m/s.
    led_m_s: [DVec3; 2],
}

/// A member and its partner that were looked at.
#[derive(Debug, Clone, Copy)]
struct Look {
    member: usize,
    partner: Partner,
    /// No place of the two that was left out is nearer than this, metres.
    clear_m: f64,
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

/// By which velocities a place is judged.
#[derive(Clone, Copy)]
pub(super) enum Judge {
    /// Those at the start and without contact, each side's alone too.
    Foreseen,
    /// Those of a solution.
    Solved,
}

impl Search {
    /// Finds all places of a fine step of `h_s` seconds.
    pub fn find(&mut self, scene: &ClusterScene, all: &[Participant<'_>], progress: &[Progress], h_s: f64) {
        self.contacts.clear();
        self.owners.clear();
        self.near.clear();
        self.looks.clear();
        let speed = |member: usize| {
            let (body, state) = (&all[member].member, &progress[member]);
            body.speed_bound(&state.before).max(body.speed_bound(&state.seen))
        };
        self.place_boxes(all, speed);
        find_pairs(&self.boxes, NEAR_STEPS * h_s, &mut self.near);
        let round = Round { scene, all, progress, h_s, judge: Judge::Foreseen };
        let near = std::mem::take(&mut self.near);
        for &pair in &near {
            self.find_between(&round, pair);
        }
        self.near = near;
        for member in 0..all.len() {
            self.find_static(&round, member);
        }
        self.sort();
    }

    /// Adds the places that bodies would have passed with the velocities `solved`: what is struck moves as nobody foresaw. Returns
    /// whether there are any; contacts are then in a new order.
    pub fn add_passed(&mut self, round: &Round<'_, '_>) -> bool {
        let Round { all, h_s, .. } = *round;
        self.place_boxes(all, |member| all[member].member.speed_bound(&round.progress[member].solved));
        let mut pairs = std::mem::take(&mut self.again);
        pairs.clear();
        find_pairs(&self.boxes, h_s, &mut pairs);
        self.known = self.contacts.len();
        for &pair in &pairs {
            self.find_between(round, pair);
        }
        self.again = pairs;
        for member in 0..all.len() {
            self.find_static(round, member);
        }
        let more = self.contacts.len() > self.known;
        self.sort();
        more
    }

    /// The boxes around all members that have a skin, along x.
    fn place_boxes(&mut self, all: &[Participant<'_>], speed_m_s: impl Fn(usize) -> f64) {
        self.boxes.clear();
        for (member, one) in all.iter().enumerate() {
            if let Some(skin) = one.member.skin() {
                self.boxes.push(Reach { member, skin: skin.bounds(), speed_m_s: speed_m_s(member) });
            }
        }
        self.boxes.sort_unstable_by(|a, b| a.skin.low.x.total_cmp(&b.skin.low.x).then(a.member.cmp(&b.member)));
    }

    fn speed(&self, member: usize) -> f64 {
        self.boxes.iter().find(|reach| reach.member == member).map_or(0.0, |reach| reach.speed_m_s)
    }

    /// Whether a solution may have closed a place of the two that was left out: they come closer by at most `way_m`.
    fn may_have_passed(&self, member: usize, partner: Partner, way_m: f64) -> bool {
        let found = self.looks.binary_search_by_key(&(member, partner), |look| (look.member, look.partner));
        found.map_or(true, |at| way_m > self.looks[at].clear_m)
    }

    /// Places between two members.
    fn find_between(&mut self, round: &Round<'_, '_>, [a, b]: [usize; 2]) {
        let Round { scene, all, h_s, .. } = *round;
        let (Some(here), Some(there)) = (all[a].member.skin(), all[b].member.skin()) else { return };
        if !all[a].may_touch(&all[b]) || scene.lets_through([all[a].id, all[b].id]) {
            return;
        }
        let partner = Partner::Agent(all[b].id);
        let way_m = (self.speed(a) + self.speed(b)) * h_s;
        if !round.foresees() && !self.may_have_passed(a, partner, way_m) {
            return;
        }
        let reach_m = LOOK_M + way_m;
        if here.bounds().grown(reach_m).meets(there.bounds()) {
            touches(&here, &there, reach_m, &mut self.scratch, &mut self.touches);
        } else {
            self.touches.clear();
        }
        let side = |member: usize, place: &Place, contact: ContactSide| {
            all[member].member.side(place, contact).of_member(member)
        };
        let facing = |touch: &Touch| {
            let [first, second] = [ContactSide::first(touch.normal), ContactSide::second(touch.normal)];
            Facing {
                sides: [side(a, &touch.on_a, first), side(b, &touch.on_b, second)],
                led_m_s: [all[a].member.led_m_s(&touch.on_a), all[b].member.led_m_s(&touch.on_b)],
            }
        };
        let owner = Owner { member: a, partner, other: Some(b), key: TouchKey::default() };
        self.take(round, Searched { owner, skins: [here.form, there.form], reach_m }, facing);
    }

    /// Places between a member and the static solids.
    fn find_static(&mut self, round: &Round<'_, '_>, member: usize) {
        let Round { scene, all, h_s, .. } = *round;
        let Some(skin) = all[member].member.skin() else { return };
        if all[member].member.is_led() {
            return; // what leads it is stronger than what never moves
        }
        let way_m = self.speed(member) * h_s;
        let reach_m = LOOK_M + way_m;
        let bounds = skin.bounds().grown(reach_m);
        for (number, solid) in (0..).zip(scene.statics()) {
            let partner = Partner::Static(number);
            let looks = round.foresees() || self.may_have_passed(member, partner, way_m);
            if !looks || !solid.bounds().meets(bounds) {
                continue;
            }
            solid.touches(&skin, reach_m, &mut self.scratch, &mut self.touches);
            let facing = |touch: &Touch| {
                let side = all[member].member.side(&touch.on_a, ContactSide::first(touch.normal));
                let led_m_s = [all[member].member.led_m_s(&touch.on_a), DVec3::ZERO];
                Facing { sides: [side.of_member(member), Side::FIXED], led_m_s }
            };
            let owner = Owner { member, partner, other: None, key: TouchKey::default() };
            self.take(round, Searched { owner, skins: [skin.form, &solid.form], reach_m }, facing);
        }
    }

    /// Takes up those of the touches found that may close.
    fn take(
        &mut self,
        round: &Round<'_, '_>,
        Searched { owner, skins, reach_m }: Searched<'_>,
        facing: impl Fn(&Touch) -> Facing,
    ) {
        let Self { contacts, owners, touches, looks, known, .. } = self;
        let mut clear_m = reach_m;
        for touch in touches.iter() {
            let (owner, facing) = (Owner { key: touch.key, ..owner }, facing(touch));
            if facing.sides.iter().all(|side| side.terms().is_empty()) {
                continue;
            }
            let taken = match round.judge {
                Judge::Foreseen => closes(touch, &facing, round.progress, round.h_s),
                Judge::Solved => {
                    let known = owners[..*known].binary_search_by_key(&owner.name(), Owner::name).is_ok();
                    !known && touch.gap_m + opening_m_s(touch, &facing, round.progress) * round.h_s < 0.0
                }
            };
            if taken {
                owners.push(owner);
                contacts.push(contact(touch, &facing, skins, round.progress));
            } else {
                clear_m = clear_m.min(touch.gap_m);
            }
        }
        if round.foresees() {
            looks.push(Look { member: owner.member, partner: owner.partner, clear_m });
        }
    }

    /// Keeps those contacts for which `keep` is true.
    pub fn retain(&mut self, mut keep: impl FnMut(&Contact) -> bool) {
        let Self { contacts, owners, .. } = self;
        let mut kept = contacts.iter().map(&mut keep);
        owners.retain(|_| kept.next().unwrap_or(true));
        contacts.retain(|contact| keep(contact));
    }

    /// Contacts in the order of their names: sums are then the same whatever found them first.
    fn sort(&mut self) {
        self.looks.sort_unstable_by_key(|look| (look.member, look.partner));
        if self.owners.is_sorted_by_key(Owner::name) {
            return;
        }
        let mut both: Vec<_> = self.owners.drain(..).zip(self.contacts.drain(..)).collect();
        both.sort_by_key(|(owner, _)| owner.name());
        for (owner, contact) in both {
            self.owners.push(owner);
            self.contacts.push(contact);
        }
    }
}

/// Pairs whose boxes may meet within `after_s` seconds, by a sweep along x; the boxes are sorted by that.
fn find_pairs(boxes: &[Reach], after_s: f64, near: &mut Vec<[usize; 2]>) {
    let grown = |reach: &Reach| reach.skin.grown(reach.speed_m_s * after_s + 0.5 * NEAR_M);
    let widest = boxes.iter().map(|reach| reach.speed_m_s * after_s).fold(0.0, f64::max) + NEAR_M;
    for (at, reach) in boxes.iter().enumerate() {
        let mine = grown(reach);
        for other in &boxes[at + 1..] {
            if other.skin.low.x - widest > mine.high.x {
                break;
            }
            let theirs = grown(other);
            if mine.meets(theirs) {
                near.push([reach.member.min(other.member), reach.member.max(other.member)]);
            }
        }
    }
    near.sort_unstable();
}

/// Whether a gap may close within the step, by the motion of both or of either alone, as it is or as it would be without contact: what
/// lies on something that the ground stops would else not be seen.
fn closes(touch: &Touch, facing: &Facing, progress: &[Progress], h_s: f64) -> bool {
    let led = facing.led_m_s.map(|led| led.dot(touch.normal));
    let along = |side: &Side, of: fn(&Progress) -> &[DVec3]| -> f64 {
        if side.terms().is_empty() { 0.0 } else { side.velocity(of(&progress[side.member])).dot(touch.normal) }
    };
    [(|p: &Progress| &p.before[..]) as fn(&Progress) -> &[DVec3], |p: &Progress| &p.seen[..]].into_iter().any(|of| {
        let (a, b) = (along(&facing.sides[0], of) + led[0], along(&facing.sides[1], of) + led[1]);
        [a - b, a, -b].into_iter().any(|opening_m_s| touch.gap_m + opening_m_s * h_s < LOOK_M)
    })
}

/// How fast a gap opens with the velocities of a solution, m/s.
fn opening_m_s(touch: &Touch, facing: &Facing, progress: &[Progress]) -> f64 {
    let [a, b] = [0, 1].map(|at| {
        let side = &facing.sides[at];
        let moved = if side.terms().is_empty() { DVec3::ZERO } else { side.velocity(&progress[side.member].solved) };
        (moved + facing.led_m_s[at]).dot(touch.normal)
    });
    a - b
}

fn contact(touch: &Touch, facing: &Facing, skins: [&CollisionShape; 2], progress: &[Progress]) -> Contact {
    let bends = skins.iter().any(|skin| matches!(skin.kind, ShapeKind::Chain { .. } | ShapeKind::Surface(_)));
    let Facing { sides, led_m_s } = *facing;
    let surface_m_s = led_m_s[1] - led_m_s[0];
    let tangent = touch.normal.any_orthonormal_vector();
    Contact {
        sides,
        normal: touch.normal,
        tangents: [tangent, touch.normal.cross(tangent)],
        gap_m: touch.gap_m,
        // a pair takes the geometric mean of both frictions, and the larger restitution; what bends gives back what it has stored
        friction: (skins[0].friction * skins[1].friction).sqrt(),
        restitution: if bends { 0.0 } else { skins[0].restitution.max(skins[1].restitution) },
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
