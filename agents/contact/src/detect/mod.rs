//! Where members of a cluster may touch each other, themselves and the static solids around them within a fine step.
//!
//! In: members with the velocities they have and would have. Out: contacts of the problem, each with its name. Never here: impulses.
//! Theory: docs/theory/clusters.md, section 9.

pub(crate) mod domain;
mod pair;
mod reach;
mod recycled;
mod scene;
mod sensor;
mod thinning;

use crate::detect::domain::Domain;
use crate::lists::refill;
use crate::member::Role;
use crate::member::found_places::TwoSolids;
use crate::member::memory::{Partner, Spin};
use crate::solve::Contact;
use glam::DVec3;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, TouchKey, self_touches, touches};
use metachron_geometry::{CollisionShape, Place, ShapeKind, Touch};
use pair::{Against, LOOK_M, Pair, Reaching, closes, taken_up};
pub(crate) use pair::{Judge, Owner, Round};
use reach::{Boxes, FAR_M, Meeting, Sought, Sweep, Sweeping};
use recycled::{Recycled, SolidPair};
pub use scene::{
    BadDepth, BadLeastSteps, ClusterScene, DEPTH_RANGE_M, LEAST_STEPS_DEFAULT, LEAST_STEPS_RANGE, Passage, SolveBudget,
};
pub(crate) use sensor::Sensed;
use thinning::Thinning;

/// How many steps ahead bodies look for each other.
const NEAR_STEPS: f64 = 2.0;

/// Places found of a pair.
struct Found<'a> {
    owner: Owner,
    skins: [&'a CollisionShape; 2],
    /// When, in a fine step: later than its start for a pair that meets on its way.
    at: Meeting,
    /// No place was left out that is nearer than this, metres.
    clear_m: f64,
}

/// Reusable storage, and the places found.
#[derive(Default)]
pub(crate) struct Search {
    pub contacts: Vec<Contact>,
    /// One for each contact.
    pub owners: Vec<Owner>,
    /// Pairs of participants that are near each other, the lower first.
    pub near: Vec<[usize; 2]>,
    /// Pairs that touch and of which one side only senses, by rising names.
    pub sensed: Vec<Sensed>,
    point: sensor::Point,
    /// Members that rapier3d steps have no contacts but with the others; empty where there are none.
    domains: Vec<Domain>,
    /// The pairs that were searched in this fine step, by rising names once it is sorted.
    looks: Vec<Look>,
    /// How many contacts were found before the solve.
    known: usize,
    /// Whether a contact of before the solve has another place since.
    moved: bool,
    /// Pairs near each other by the velocities of a solution.
    again: Vec<[usize; 2]>,
    boxes: Boxes,
    /// Numbers of the static solids near a member.
    solids: Vec<u32>,
    sweep: Sweep,
    thinning: Thinning,
    pub recycled: Recycled,
    touches: Vec<Touch>,
    scratch: NarrowPhaseScratch,
    sorted: Vec<Named>,
}

/// A contact with its owner.
struct Named {
    owner: Owner,
    contact: Contact,
}

/// A member and its partner that were looked at.
#[derive(Debug, Clone, Copy)]
struct Look {
    member: usize,
    partner: Partner,
    /// No place of the two that was left out is nearer than this, metres.
    clear_m: f64,
}

impl Search {
    /// Finds all places of a fine step, but for those of a rigid pile among itself and with static solids; `domains` is empty where there is none.
    pub fn find(&mut self, round: &Round<'_, '_>, domains: &[Domain]) {
        self.find_near(round);
        domains.clone_into(&mut self.domains);
        let near = std::mem::take(&mut self.near);
        self.find_all(round, &near);
        self.near = near;
        self.sort();
    }

    /// Finds pairs that are near each other, and no places.
    fn find_near(&mut self, round: &Round<'_, '_>) {
        let Round { all, progress, h_s, .. } = *round;
        self.contacts.clear();
        self.owners.clear();
        self.near.clear();
        self.looks.clear();
        self.thinning.begin();
        self.recycled.begin();
        self.boxes.place(all, |member| {
            let (body, state) = (&all[member].member, &progress[member]);
            body.speed_bound(&state.v_before).max(body.speed_bound(&state.v_predicted))
        });
        self.boxes.pairs(|reach| NEAR_STEPS * h_s.max(reach.alone_s), &mut self.near);
        let apart =
            |[a, b]: [usize; 2]| all[a].member.is_remote() && all[b].member.is_remote() || !all[a].meets(&all[b]);
        self.near.retain(|pair| !apart(*pair));
    }

    /// Adds the places that bodies would have passed with the velocities `solved`: a body that is struck moves unlike
    /// its prediction. Returns whether there are any; contacts are then in a new order.
    pub fn add_passed(&mut self, round: &Round<'_, '_>) -> bool {
        let Round { all, h_s, .. } = *round;
        if (0..all.len()).all(|member| self.is_pile(member)) {
            return false;
        }
        self.boxes.place(all, |member| all[member].member.speed_bound(round.moved(member)));
        let mut pairs = std::mem::take(&mut self.again);
        pairs.clear();
        self.boxes.pairs(|_| h_s, &mut pairs);
        (self.known, self.moved) = (self.contacts.len(), false);
        self.find_all(round, &pairs);
        self.again = pairs;
        let more = self.moved || self.contacts.len() > self.known;
        self.sort();
        more
    }

    /// Places of all members with themselves and with static solids, and of some pairs of members, sorted: by rising names.
    fn find_all(&mut self, round: &Round<'_, '_>, pairs: &[[usize; 2]]) {
        let Round { scene, all, .. } = *round;
        let mut pairs = pairs.iter().peekable();
        for member in 0..all.len() {
            if !self.is_pile(member) {
                self.find_around(round, member);
            }
            while let Some(&[_, other]) = pairs.next_if(|pair| pair[0] == member) {
                let is_left_out =
                    self.is_pile(member) && self.is_pile(other) || scene.lets_through([all[member].id, all[other].id]);
                if !is_left_out
                    && all[member].may_touch(&all[other])
                    && [member, other].iter().any(|at| all[*at].member.role() != Role::Kinematic)
                {
                    self.find_of(round, Pair { member, against: Against::Member(other) });
                }
            }
        }
    }

    /// Places of a member with itself and with static solids.
    fn find_around(&mut self, round: &Round<'_, '_>, member: usize) {
        let (scene, one) = (round.scene, &round.all[member]);
        if one.member.rest_shape().is_some() {
            self.find_of(round, Pair { member, against: Against::Own });
        }
        if one.member.is_led() {
            return; // the drive of a led body is stronger than any static solid
        }
        let Some(form) = one.member.skin().map(|skin| skin.form) else { return };
        let Some(reach) = self.boxes.of(member) else { return };
        let mut solids = std::mem::take(&mut self.solids);
        scene.statics_near(reach.skin.grown(LOOK_M + reach.speed_m_s * round.h_s), &mut solids);
        for &number in &solids {
            let solid = &scene.statics()[number as usize];
            if form.meets(&solid.form) && !scene.has_passage(Passage { body: one.id, solid: number }) {
                self.find_of(round, Pair { member, against: Against::Static { number, solid } });
            }
        }
        self.solids = solids;
    }

    fn is_pile(&self, member: usize) -> bool {
        self.domains.get(member) == Some(&Domain::RigidPile)
    }

    /// Places of a pair.
    fn find_of(&mut self, round: &Round<'_, '_>, pair: Pair<'_>) {
        let Round { all, h_s, .. } = *round;
        let Pair { member, against } = pair;
        let (Some(skin), Some(reach)) = (all[member].member.skin(), self.boxes.of(member)) else { return };
        let (form, bounds, their_m_s) = match against {
            Against::Own => (skin.form, reach.skin, reach.speed_m_s),
            Against::Static { solid, .. } => (&solid.form, solid.bounds(), 0.0),
            Against::Member(other) => {
                let (Some(skin), Some(there)) = (all[other].member.skin(), self.boxes.of(other)) else { return };
                (skin.form, there.skin, there.speed_m_s)
            }
        };
        let partner = pair.partner(all);
        if skin.form.senses(form) {
            return;
        }
        let way_m = (reach.speed_m_s + their_m_s) * h_s;
        if !round.predicts() && !self.may_have_passed(member, partner, way_m) {
            return;
        }
        let reach_m = LOOK_M + way_m;
        self.touches.clear();
        let meets = reach.skin.grown(reach_m).meets(bounds);
        // a body that goes far meets others that are not near yet
        let swept_m = (reach_m > FAR_M).then_some(LOOK_M);
        let at = if meets { self.touch(round, pair, Reaching { reach_m, swept_m }) } else { Meeting::default() };
        let clear_m = if at.after_s > 0.0 { 0.0 } else { reach_m };
        let spin = Spin { radius_m: skin.form.spin_radius_with_m(form), ..Spin::default() };
        let owner = Owner {
            member,
            partner,
            other: pair.other(),
            key: TouchKey::default(),
            spin,
            spin_row: None,
            push_n: 0.0,
            push_row: None,
            places: [Place::Point(DVec3::NAN); 2],
            restitution: skin.form.restitution_with(form),
            late_s: pair.other().map_or(0.0, |other| all[other].member.answers_after_s()),
        };
        self.take(round, pair, Found { owner, skins: [skin.form, form], at, clear_m });
    }

    /// Finds the places of a pair that may come within reach, and when: at their first meeting, of a pair that is apart now and goes far.
    fn touch(&mut self, round: &Round<'_, '_>, pair: Pair<'_>, reaching: Reaching) -> Meeting {
        let Reaching { reach_m, swept_m } = reaching;
        let Self { touches: into, scratch, sweep, recycled, .. } = self;
        let body = &round.all[pair.member].member;
        let (now, end) = (Meeting::default(), Meeting { after_s: round.h_s, ..Meeting::default() });
        let Some(skin) = body.skin() else { return now };
        if let Some(reach_m) = swept_m {
            match sweep.meet(round, Sought { pair, reach_m }, scratch, into) {
                Sweeping::Meets(meeting) if meeting.after_s > 0.0 => return meeting,
                Sweeping::Passes => return end,
                Sweeping::Meets(_) | Sweeping::Unknown => {}
            }
        }
        let there = pair.other().and_then(|other| round.all[other].member.skin());
        let mut find = |reach_m: f64, into: &mut Vec<Touch>| match pair.against {
            Against::Own => {
                body.rest_shape().into_iter().for_each(|rest| self_touches(&skin, rest, reach_m, scratch, into));
                reach_m
            }
            Against::Static { solid, .. } => {
                solid.touches(&skin, reach_m, scratch, into);
                reach_m
            }
            Against::Member(_) => there.as_ref().map_or(reach_m, |there| touches(&skin, there, reach_m, scratch, into)),
        };
        let radius_m = if let ShapeKind::Solid(solid) = &skin.form.kind { solid.radius_m } else { f64::INFINITY };
        let solids = TwoSolids::of(skin.view, there.map(|there| there.view), radius_m);
        match solids.filter(|_| round.predicts()) {
            Some(solids) => {
                let partner = pair.partner(round.all);
                let known = round.all[pair.member].memory.known(partner);
                let pair = SolidPair { member: pair.member, partner, solids, known, reach_m };
                recycled.touches(&pair, into, find);
            }
            None => _ = find(reach_m, into),
        }
        now
    }

    /// Whether a solution may have closed a place of the two that was left out: they come closer by at most `way_m`.
    fn may_have_passed(&self, member: usize, partner: Partner, way_m: f64) -> bool {
        let found = self.looks.binary_search_by_key(&(member, partner), |look| (look.member, look.partner));
        found.map_or(true, |at| way_m > self.looks[at].clear_m)
    }

    /// Takes up the touches found that may close.
    fn take(&mut self, round: &Round<'_, '_>, pair: Pair<'_>, found: Found<'_>) {
        let Self { contacts, owners, touches, looks, known, moved, thinning, .. } = self;
        thinning.begin_pair();
        let from = contacts.len();
        let Found { owner, skins, at: Meeting { after_s, ways }, mut clear_m } = found;
        let swept = after_s > 0.0;
        for touch in touches.iter() {
            let (owner, facing) = (
                Owner { key: touch.key, places: [touch.on_a, touch.on_b], ..owner },
                pair.facing(round, touch, ways, skins),
            );
            if facing.sides.iter().all(|side| side.terms().is_empty()) {
                continue;
            }
            let opening_m_s = facing.opening_m_s(touch.normal, |member| round.moved(member));
            let gap_m = touch.gap_m + facing.recess_m - opening_m_s * after_s;
            let touch = Touch { gap_m, ..*touch };
            let ends_m = gap_m + opening_m_s * round.h_s;
            let taken = match round.judge {
                Judge::Predicted if swept => ends_m < LOOK_M,
                Judge::Predicted => closes(&touch, &facing, round.progress, round.h_s),
                Judge::Solved => match owners[..*known].binary_search_by_key(&owner.name(), Owner::name) {
                    Err(_) => ends_m < 0.0,
                    // on its way it meets another place than the one it was kept from
                    Ok(at) if swept && ends_m < -LOOK_M => {
                        let Contact { warm_n_s, load_n_s, overlap_m, owed_slip_m, .. } = contacts[at];
                        let found = taken_up(round, &owner, &touch, &facing);
                        contacts[at] = Contact { warm_n_s, load_n_s, overlap_m, owed_slip_m, ..found };
                        *moved = true;
                        false
                    }
                    Ok(_) => false,
                },
            };
            if taken && thinning.note(round, pair, &owner, &touch) {
                owners.push(owner);
                contacts.push(taken_up(round, &owner, &touch, &facing));
            } else if !taken {
                clear_m = clear_m.min(gap_m);
            }
        }
        thinning.thin(from, contacts, owners);
        if round.predicts() {
            looks.push(Look { member: owner.member, partner: owner.partner, clear_m });
        }
    }

    /// Keeps the contacts for which `keep` is true; the pairs of others are looked at again after the solve.
    pub fn retain(&mut self, keep: impl Fn(&Contact, &Owner) -> bool) {
        let Self { contacts, owners, looks, .. } = self;
        let mut kept = 0;
        for at in 0..contacts.len() {
            if !keep(&contacts[at], &owners[at]) {
                let pair = (owners[at].member, owners[at].partner);
                if let Ok(look) = looks.binary_search_by_key(&pair, |look| (look.member, look.partner)) {
                    looks[look].clear_m = 0.0;
                }
            } else {
                contacts.swap(kept, at);
                owners.swap(kept, at);
                kept += 1;
            }
        }
        contacts.truncate(kept);
        owners.truncate(kept);
    }

    /// Contacts in the order of their names: sums are then the same whatever found them first.
    fn sort(&mut self) {
        let Self { looks, owners, contacts, sorted, thinning, .. } = self;
        thinning.sort();
        looks.sort_unstable_by_key(|look| (look.member, look.partner));
        if owners.is_sorted_by_key(Owner::name) {
            return;
        }
        refill(sorted, owners.drain(..).zip(contacts.drain(..)).map(|(owner, contact)| Named { owner, contact }));
        // names are unique
        sorted.sort_unstable_by_key(|named| named.owner.name());
        for Named { owner, contact } in sorted.drain(..) {
            owners.push(owner);
            contacts.push(contact);
        }
    }
}
