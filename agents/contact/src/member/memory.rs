//! The memory of a pair of bodies from step to step: impulses, slip owed, and when the two were last near.
//!
//! In: contacts with their impulses. Out: the same for the next step. Never here: contacts that are new.
//! A pair is remembered by its lower number, so that nothing has to be moved when clusters join or part.

use crate::agent::Link;
use crate::joint::{Joint, JointKind};
use crate::lists::entry;
use crate::member::Slid;
use crate::member::found_places::FoundPlaces;
use glam::DVec3;
use metachron_core::{AgentId, Anchor, ContactPartner, SensorTouch, SimSpan, SimTime};
use metachron_geometry::narrow_phase::{TouchKey, TouchKind};

/// A pair that bears less than this share of the most that its places have borne is relieved.
const RELIEVED_SHARE: f64 = 0.125;
/// Two bodies belong together until they have not been near each other for this long, seconds.
const PART_S: f64 = 0.2;

/// The other side of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub enum Partner {
    /// The body itself.
    Own,
    /// A static solid, by its number.
    Static(u32),
    /// Another agent.
    Agent(AgentId),
    /// The far end of a spring of the user or of a grasp, by its number among those on its body.
    Tie(u32),
    /// The far end of a link, by its number in the scene.
    Link(u32),
    /// The far end of a joint, by its number in the scene.
    Joint(u32),
    /// The drive of the body.
    Drive,
    /// The end of a transmission line, by its number among those of the macro step.
    Line(u32),
    /// The far end of an attachment that is the body's own, by its number among those of the body.
    Attachment(u32),
}

/// The spin friction of a contact as it is remembered, about its normal.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Spin {
    /// The radius of the patch that resists, metres.
    pub radius_m: f64,
    /// The torque of the last step or solve, N·m, and the angle owed (eq. 13).
    pub torque_n_m: f64,
    pub owed_rad: f64,
}

/// How an attachment holds that has slipped.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Slip {
    /// Which one.
    pub(crate) partner: Partner,
    /// How far, at an end without axes as the frame of its rows says; of a body's own attachment nothing, for each of its springs slips by itself.
    pub(crate) slid: Slid,
}

/// The values that a contact or a joint hands to the next step.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Remembered {
    /// The name of the place within its pair.
    pub key: TouchKey,
    /// The impulse of one second at the rate of the last step: its mean force, world axes, N.
    pub force_n: DVec3,
    /// Its greatest load since its pair was last relieved, likewise, N, ≥ 0: the compliance of a contact is for that.
    pub load_n: f64,
    /// How deep it rests because its bodies began inside each other, metres, ≥ 0 (eq. 2a).
    pub overlap_m: f64,
    /// The force that pushed it out of that in the last step, along its normal, N, ≥ 0.
    pub push_n: f64,
    /// The slip owed, world axes, metres.
    pub owed_slip_m: DVec3,
    /// The same of its friction about the normal.
    pub spin: Spin,
    /// The travels of two joints of which one follows the other, with their whole turns, rad or metres: first of the one that follows.
    pub travels: [f64; 2],
}

/// One pair, with its places by rising names; places of one name by their triangles.
#[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct PairMemory {
    pub partner: Partner,
    /// Until when the two count as near.
    pub near_until: SimTime,
    pub places: Vec<Remembered>,
    /// Where the two touch, of solids.
    pub found: FoundPlaces,
    /// Places of the step that is being made.
    #[serde(skip)]
    pub next: Vec<Remembered>,
}

impl Clone for PairMemory {
    fn clone(&self) -> Self {
        let Self { partner, near_until, places, found, next } = self;
        let (partner, near_until) = (*partner, *near_until);
        Self { partner, near_until, places: places.clone(), found: found.clone(), next: next.clone() }
    }

    // into storage that is there
    fn clone_from(&mut self, from: &Self) {
        (self.partner, self.near_until) = (from.partner, from.near_until);
        self.places.clone_from(&from.places);
        self.found.clone_from(&from.found);
        self.next.clone_from(&from.next);
    }
}

impl PairMemory {
    /// Notes the load of each place in the step that was made. A compliance that followed each step's load would let a place rest equally deep
    /// under any load: nothing would resist where load moves from one side of a body to the other, and a tall body would sway for ever.
    fn note_loads(&mut self) {
        let (mut bears_n, mut borne_n) = (0.0, 0.0);
        for place in &mut self.places {
            let force_n = place.force_n.length();
            place.load_n = place.load_n.max(force_n);
            (bears_n, borne_n) = (bears_n + force_n, borne_n + place.load_n);
        }
        // the whole load of a body has become another: it landed, or was relieved
        if bears_n < RELIEVED_SHARE * borne_n {
            self.places.iter_mut().for_each(|place| place.load_n = place.force_n.length());
        }
    }
}

/// All that one body remembers: pairs with higher numbers, static solids, itself.
#[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactMemory {
    pairs: Vec<PairMemory>,
    /// Links, joints and own attachments of the body that have torn, sorted. They stay torn.
    torn: Vec<Partner>,
    /// Links, joints and own attachments of the body that have slipped, sorted by them.
    slips: Vec<Slip>,
    /// The impulses of attachments that may tear, in macro steps that were cut short.
    unfinished: Vec<UnfinishedLoad>,
    /// The bodies that touched a sensor, or the sensors that the body touched, sorted by partners. They stay.
    sensed: Vec<SensorTouch>,
    /// Whether the body is where its last step ended.
    goes_on: bool,
}

/// The impulse of an attachment since its force was last looked at.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct UnfinishedLoad {
    pub partner: Partner,
    pub impulse_n_s: DVec3,
    /// In how long a time, seconds.
    pub span_s: f64,
}

impl Clone for ContactMemory {
    fn clone(&self) -> Self {
        let Self { pairs, torn, slips, unfinished, sensed, goes_on } = self;
        let (pairs, torn, slips) = (pairs.clone(), torn.clone(), slips.clone());
        Self { pairs, torn, slips, unfinished: unfinished.clone(), sensed: sensed.clone(), goes_on: *goes_on }
    }

    fn clone_from(&mut self, from: &Self) {
        let Self { pairs, torn, slips, unfinished, sensed, goes_on } = self;
        *goes_on = from.goes_on;
        pairs.clone_from(&from.pairs);
        torn.clone_from(&from.torn);
        slips.clone_from(&from.slips);
        unfinished.clone_from(&from.unfinished);
        sensed.clone_from(&from.sensed);
    }
}

impl Slip {
    /// An attachment to `partner` that has not slipped.
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

/// The sort key of a place: first its name without the triangle, then its whole name.
fn sort_key(key: TouchKey) -> [TouchKey; 2] {
    [key.anywhere(), key]
}

impl ContactMemory {
    /// The pair with `partner`, made where it is new.
    pub(crate) fn pair(&mut self, partner: Partner) -> &mut PairMemory {
        let new = || PairMemory {
            partner,
            near_until: SimTime::ZERO,
            places: Vec::new(),
            found: FoundPlaces::default(),
            next: Vec::new(),
        };
        entry(&mut self.pairs, &partner, |pair| pair.partner, new)
    }

    /// The memory of the place `key` of the pair with `partner`, or else of a place of the same name on another triangle.
    pub(crate) fn recall(&self, partner: Partner, key: TouchKey) -> Remembered {
        self.recall_left(partner, key, |_| true)
    }

    /// The same; a new place takes over the values of a place of the same name only where `is_left` says that nothing touches there any
    /// more. A new one may lie as deep as it does where its pair is new too, or began inside each other.
    pub(crate) fn recall_left(
        &self,
        partner: Partner,
        key: TouchKey,
        is_left: impl Fn(TouchKey) -> bool,
    ) -> Remembered {
        let pair = self.pairs.binary_search_by_key(&partner, |pair| pair.partner).ok().map(|at| &self.pairs[at]);
        let places = pair.map_or(&[][..], |pair| &pair.places);
        if let Ok(at) = places.binary_search_by_key(&sort_key(key), |place| sort_key(place.key)) {
            return places[at];
        }
        let name = key.anywhere();
        let same_name = &places[places.partition_point(|place| place.key.anywhere() < name)..];
        let mut same_name = same_name.iter().take_while(|place| place.key.anywhere() == name);
        same_name.find(|place| is_left(place.key)).copied().unwrap_or_else(|| {
            let overlaps = places.is_empty() || places.iter().any(|place| place.overlap_m > 0.0);
            Remembered { key, overlap_m: if overlaps { f64::INFINITY } else { 0.0 }, ..Remembered::default() }
        })
    }

    /// Replaces the places of every pair by those noted since, and forgets pairs that have not been near at `now`.
    pub(crate) fn turn(&mut self, now: SimTime) {
        self.goes_on = true;
        for pair in &mut self.pairs {
            std::mem::swap(&mut pair.places, &mut pair.next);
            pair.next.clear();
            pair.places.sort_unstable_by_key(|place| sort_key(place.key));
            pair.note_loads();
        }
        self.pairs.retain(|pair| !pair.places.is_empty() || pair.near_until > now);
    }

    /// Notes that an agent is near at `now`: the two belong together from then on until they have not been near for a while.
    pub fn meet(&mut self, id: AgentId, now: SimTime) {
        self.near_pair(Partner::Agent(id), now);
    }

    /// The pair with a partner that is near at `now`, kept until that has not been so for a while.
    fn near_pair(&mut self, partner: Partner, now: SimTime) -> &mut PairMemory {
        let until = now + SimSpan::from_secs_f64(PART_S).unwrap_or(SimSpan::ZERO);
        let pair = self.pair(partner);
        pair.near_until = pair.near_until.max(until);
        pair
    }

    /// The places found of the pair with `partner`, if there is one.
    pub(crate) fn known(&self, partner: Partner) -> Option<&FoundPlaces> {
        let pair = self.pairs.binary_search_by_key(&partner, |pair| pair.partner).ok();
        pair.map(|at| &self.pairs[at].found)
    }

    /// The same to be replaced, of a partner that is near at `now`.
    pub(crate) fn found(&mut self, partner: Partner, now: SimTime) -> &mut FoundPlaces {
        &mut self.near_pair(partner, now).found
    }

    /// The agents that were near lately, at `now`, of the pairs that this memory keeps.
    pub fn near(&self, now: SimTime) -> impl Iterator<Item = AgentId> + '_ {
        self.pairs.iter().filter_map(move |pair| match pair.partner {
            Partner::Agent(id) if pair.near_until > now => Some(id),
            _ => None,
        })
    }

    /// Notes that an attachment has torn: nothing of it is remembered but that.
    pub(crate) fn tear(&mut self, partner: Partner) {
        self.pairs.retain(|pair| pair.partner != partner);
        self.slips.retain(|slip| slip.partner != partner);
        if let Err(at) = self.torn.binary_search(&partner) {
            self.torn.insert(at, partner);
        }
    }

    /// Adds the impulse of an attachment in a macro step. Returns the sum since this last returned something, once that is over a
    /// time of `whole_s` seconds.
    pub(crate) fn bear(&mut self, load: UnfinishedLoad, whole_s: f64) -> Option<UnfinishedLoad> {
        let at = self.unfinished.iter().position(|before| before.partner == load.partner);
        let before = at.map(|at| self.unfinished.swap_remove(at));
        let (impulse_n_s, span_s) = before.map_or((DVec3::ZERO, 0.0), |before| (before.impulse_n_s, before.span_s));
        let load = UnfinishedLoad { impulse_n_s: load.impulse_n_s + impulse_n_s, span_s: load.span_s + span_s, ..load };
        if load.span_s >= whole_s {
            return Some(load);
        }
        self.unfinished.push(load);
        None
    }

    /// Counts touches of which one side only senses: `now` are the partners that touch the body `at` this time, by rising names.
    pub(crate) fn sense(&mut self, now: impl Iterator<Item = Partner>, at: SimTime) {
        let with = |partner| match partner {
            Partner::Agent(id) => Some(ContactPartner::Agent(id)),
            Partner::Static(number) => Some(ContactPartner::Static(number)),
            _ => None,
        };
        let mut place = 0;
        for with in now.filter_map(with) {
            let ended = self.sensed[place..].iter().take_while(|known| known.with < with).count();
            self.sensed[place..place + ended].iter_mut().for_each(|known| known.note(false, at));
            place += ended;
            if self.sensed.get(place).is_none_or(|known| known.with != with) {
                self.sensed.insert(place, SensorTouch::new(with));
            }
            self.sensed[place].note(true, at);
            place += 1;
        }
        self.sensed[place..].iter_mut().for_each(|known| known.note(false, at));
    }

    /// The bodies that touched a sensor, or the sensors that the body touched, by rising partners.
    #[must_use]
    pub fn sensed(&self) -> &[SensorTouch] {
        &self.sensed
    }

    /// Whether an attachment of the body has torn.
    #[must_use]
    pub fn has_torn(&self, partner: Partner) -> bool {
        self.torn.binary_search(&partner).is_ok()
    }

    /// The attachments of the body that have torn.
    pub(crate) fn torn(&self) -> &[Partner] {
        &self.torn
    }

    /// How an attachment of the body holds, as far as it has slipped.
    pub(crate) fn slipped(&self, partner: Partner) -> Slip {
        let at = self.slips.binary_search_by_key(&partner, |slip| slip.partner);
        at.map_or(Slip::none(partner), |at| self.slips[at])
    }

    /// Whether an attachment of the body has ever slipped.
    pub(crate) fn has_slipped(&self, partner: Partner) -> bool {
        self.slips.iter().any(|slip| slip.partner == partner)
    }

    /// The same, to let it slip on.
    pub(crate) fn slip(&mut self, partner: Partner) -> &mut Slip {
        entry(&mut self.slips, &partner, |slip| slip.partner, || Slip::none(partner))
    }

    /// Notes that the body was put where no step has led it.
    pub fn note_placed(&mut self) {
        self.goes_on = false;
    }

    /// Whether the body is where its last step ended: it was not put somewhere since, and has made a step.
    pub(crate) const fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Forgets places that are named by edges and triangles of skins, where one has lost some and others have their numbers now.
    pub fn forget_features(&mut self) {
        let lasts = |place: &Remembered| !matches!(place.key.kind, TouchKind::Edge | TouchKind::Triangle);
        self.pairs.iter_mut().for_each(|pair| pair.places.retain(lasts));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_recalled_after_one_turn_and_forgotten_after_two() {
        let mut memory = ContactMemory::default();
        let (partner, now) = (Partner::Static(3), SimTime::ZERO);
        let key = |vertex: u32| TouchKey { features: [vertex, 0], ..TouchKey::default() };
        let place = Remembered {
            key: key(70_000),
            force_n: DVec3::Z,
            load_n: 2.0,
            owed_slip_m: DVec3::X,
            ..Remembered::default()
        };
        memory.pair(partner).next.push(place);
        memory.turn(now);
        assert_eq!(memory.recall(partner, key(70_000)), place);
        assert_eq!(memory.recall(partner, key(70_000 - 32_768)).force_n, DVec3::ZERO, "another place of the same pair");
        assert_eq!(memory.recall(Partner::Static(3 + 32_768), key(70_000)).force_n, DVec3::ZERO, "another pair");
        memory.turn(now);
        assert_eq!(memory.recall(partner, key(70_000)).force_n, DVec3::ZERO);
        assert!(memory.pairs.is_empty());
    }

    #[test]
    fn a_corner_that_slides_over_a_mesh_is_recalled_on_its_next_triangle() {
        let mut memory = ContactMemory::default();
        let partner = Partner::Static(0);
        let on_triangle =
            |number| TouchKey { kind: TouchKind::MeshTriangle, parts: [number, 0], ..TouchKey::default() };
        let place = Remembered { key: on_triangle(7), force_n: DVec3::Z, ..Remembered::default() };
        memory.pair(partner).next.push(place);
        memory.turn(SimTime::ZERO);
        assert_eq!([7, 8].map(|number| memory.recall(partner, on_triangle(number)).force_n), [DVec3::Z; 2]);
    }

    #[test]
    fn contacts_of_one_name_on_two_triangles_keep_their_own() {
        let mut memory = ContactMemory::default();
        let partner = Partner::Static(0);
        let on = |triangle: u32, of: u32| TouchKey::new(TouchKind::Triangle, [triangle, of]);
        let places = [(on(7, 0), 0.0), (on(9, 0), 5.0), (on(8, 1), 2.0)];
        let place = |(key, force_n)| Remembered { key, force_n: DVec3::Z * force_n, ..Remembered::default() };
        memory.pair(partner).next.extend(places.map(place));
        memory.turn(SimTime::ZERO);
        let force_n =
            |key, there: &[TouchKey]| memory.recall_left(partner, key, |other| !there.contains(&other)).force_n.z;
        for (key, own_n) in places {
            assert_eq!(force_n(key, &places.map(|(key, _)| key)), own_n);
        }
        // a contact that is new on triangle 4 takes over the force of triangle 9 once nothing touches there
        assert_eq!(force_n(on(4, 0), &[on(4, 0), on(7, 0)]), 5.0);
        assert_eq!(force_n(on(4, 0), &[on(4, 0), on(7, 0), on(9, 0)]), 0.0);
    }

    #[test]
    fn a_place_keeps_the_most_that_it_bore_until_its_pair_is_relieved() {
        let mut memory = ContactMemory::default();
        let partner = Partner::Static(0);
        let key = |vertex: u32| TouchKey { features: [vertex, 0], ..TouchKey::default() };
        let mut load_n = |forces_n: [f64; 2]| {
            for (vertex, force_n) in (0..).zip(forces_n) {
                let before = memory.recall(partner, key(vertex));
                memory.pair(partner).next.push(Remembered { force_n: DVec3::Z * force_n, ..before });
            }
            memory.turn(SimTime::ZERO);
            [0, 1].map(|vertex| memory.recall(partner, key(vertex)).load_n)
        };
        assert_eq!(load_n([4.0, 1.0]), [4.0, 1.0]);
        // load moves from one place to the other: both stay as hard as under their greatest load
        assert_eq!(load_n([0.0, 5.0]), [4.0, 5.0]);
        assert_eq!(load_n([1.0, 1.0]), [4.0, 5.0]);
        assert_eq!(load_n([0.5, 0.25]), [0.5, 0.25], "an eighth of nine is more than they bear");
    }

    #[test]
    fn what_has_torn_is_remembered_as_nothing_else_and_stays_torn() {
        let mut memory = ContactMemory::default();
        let (joint, other) = (Partner::Joint(4), Partner::Joint(5));
        memory.pair(joint).next.push(Remembered { force_n: DVec3::Z, ..Remembered::default() });
        memory.turn(SimTime::ZERO);
        memory.tear(joint);
        memory.tear(joint);
        let copy = memory.clone();
        assert!(copy.has_torn(joint) && !copy.has_torn(other) && copy.pairs.is_empty());
        assert_eq!((copy.recall(joint, TouchKey::default()).force_n, copy.torn.len()), (DVec3::ZERO, 1));
    }

    #[test]
    fn vertices_are_remembered_where_the_numbers_of_edges_and_triangles_have_changed() {
        let mut memory = ContactMemory::default();
        let partner = Partner::Static(0);
        let kinds = [TouchKind::Vertex, TouchKind::Edge, TouchKind::Triangle];
        let keys = kinds.map(|kind| TouchKey::new(kind, [3, 0]));
        memory.pair(partner).next.extend(keys.map(|key| Remembered {
            key,
            force_n: DVec3::Z,
            ..Remembered::default()
        }));
        memory.turn(SimTime::ZERO);
        memory.forget_features();
        assert_eq!(keys.map(|key| memory.recall(partner, key).force_n.z), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_pair_that_was_near_counts_as_near_until_its_time_is_over() {
        let mut memory = ContactMemory::default();
        memory.pair(Partner::Agent(AgentId(40_000))).near_until = SimTime::from_nanos(2);
        memory.turn(SimTime::from_nanos(1));
        assert_eq!(memory.near(SimTime::from_nanos(1)).collect::<Vec<_>>(), [AgentId(40_000)]);
        memory.turn(SimTime::from_nanos(2));
        assert_eq!(memory.near(SimTime::from_nanos(2)).count(), 0);
    }
}
