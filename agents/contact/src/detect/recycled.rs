//! Places of pairs of solids, kept from step to step: they move along with the two, and a resting pair is not searched again.
//!
//! In: where two solids are; what their pair remembers of places found. Out: their places now, if these are known; what the pair is to remember. Never
//! here: how places are found.
//! Theory: docs/theory/contact.md, section 1.

use crate::lists::refill;
use crate::member::Participant;
use crate::member::found_places::{FoundPlaces, Pose, TwoSolids};
use crate::member::memory::Partner;
use glam::DVec3;
use metachron_core::SimTime;
use metachron_geometry::Touch;

/// Places are found within so many times the reach that is asked for, as this follows speeds.
const FURTHER: f64 = 1.25;

/// A pair of solids whose places within `reach_m`, metres, are asked for.
pub(super) struct SolidPair<'a> {
    /// The participant that remembers it.
    pub member: usize,
    pub partner: Partner,
    pub solids: TwoSolids,
    /// The places found of it before, as that participant remembers them.
    pub known: Option<&'a FoundPlaces>,
    pub reach_m: f64,
}

/// The pairs that were searched in a fine step.
#[derive(Debug, Default)]
pub(crate) struct Recycled {
    searched: Vec<Searched>,
    /// The places of one pair after the other, in the axes of their second solids.
    touches: Vec<Touch>,
}

/// A pair that was searched.
#[derive(Debug, Clone, Copy)]
struct Searched {
    /// The participant that remembers it.
    member: usize,
    partner: Partner,
    first: Pose,
    reach_m: f64,
    /// How many places it has.
    count: usize,
}

impl Recycled {
    /// Begins a search.
    pub fn begin(&mut self) {
        self.searched.clear();
        self.touches.clear();
    }

    /// Fills `into` with the places of a pair: the known ones, or else all that `find` gives within the reach passed to it; it returns how
    /// far at least all others are, metres.
    pub(super) fn touches(
        &mut self,
        pair: &SolidPair<'_>,
        into: &mut Vec<Touch>,
        find: impl FnOnce(f64, &mut Vec<Touch>) -> f64,
    ) {
        let SolidPair { member, partner, ref solids, known, reach_m } = *pair;
        if let Some(known) = known.filter(|known| known.last(solids, reach_m)) {
            let moved = |a: DVec3| solids.first.to_world(known.first.to_local(a));
            refill(into, known.touches.iter().map(|touch| solids.placed(touch, moved)));
        } else {
            let further_m = FURTHER * reach_m;
            let clear_m = find(further_m, into);
            // two that nothing of is near are known to be so until they may have come near
            let further_m = if into.is_empty() { clear_m.max(further_m) } else { further_m };
            self.touches.extend(into.iter().map(|touch| solids.unplaced(touch)));
            let count = into.len();
            self.searched.push(Searched { member, partner, first: solids.first, reach_m: further_m, count });
        }
        into.retain(|touch| touch.gap_m <= reach_m);
    }

    /// Lets the pairs remember the places found at `now`; those with static solids that are not near are forgotten at
    /// once.
    pub fn note(&mut self, all: &mut [Participant<'_>], now: SimTime) {
        let mut rest = &self.touches[..];
        for &Searched { member, partner, first, reach_m, count } in &self.searched {
            let (touches, others) = rest.split_at(count);
            rest = others;
            if count > 0 || matches!(partner, Partner::Agent(_)) {
                let found = all[member].memory.found(partner, now);
                (found.first, found.reach_m) = (first, reach_m);
                touches.clone_into(&mut found.touches);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::member::found_places::MOVED_M;
    use glam::DQuat;
    use metachron_core::AgentId;
    use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
    use metachron_geometry::{
        CollisionShape, ContactTraits, Place, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape,
    };

    /// A box of 4 cm.
    fn form() -> CollisionShape {
        let solid = Solid::Box { half_extents_m: DVec3::splat(0.02) };
        let kind = ShapeKind::Solid(SolidShape::new(solid, DVec3::ZERO).unwrap());
        CollisionShape { kind, friction: 0.5, restitution: 0.0, traits: ContactTraits::default() }
    }

    /// The places of two boxes, the second standing askew in the world, the first `up_m` over it and turned by `turn_rad`; whether they were searched.
    fn places(known: &mut FoundPlaces, frame: Pose, [up_m, turn_rad]: [f64; 2]) -> (Vec<Touch>, bool) {
        within(known, frame, [up_m, turn_rad], 1e-3)
    }

    fn within(known: &mut FoundPlaces, frame: Pose, [up_m, turn_rad]: [f64; 2], reach_m: f64) -> (Vec<Touch>, bool) {
        let form = form();
        let place = |position: DVec3, turn_rad: f64| {
            let rotation = frame.rotation * DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), turn_rad);
            PlacedShape { form: &form, view: ShapePose::Solid { position: frame.to_world(position), rotation } }
        };
        let (first, second) = (place(DVec3::new(0.005, 0.003, 0.04 + up_m), turn_rad), place(DVec3::ZERO, 0.0));
        let (mut into, mut scratch, mut recycled) = (Vec::new(), NarrowPhaseScratch::default(), Recycled::default());
        let solids = TwoSolids::of(first.view, Some(second.view), 0.07).unwrap();
        let pair = SolidPair { member: 0, partner: Partner::Agent(AgentId(5)), solids, known: Some(known), reach_m };
        recycled.touches(&pair, &mut into, |reach_m, into| touches(&first, &second, reach_m, &mut scratch, into));
        let searched = recycled.searched.first().copied();
        if let Some(Searched { first, reach_m, .. }) = searched {
            *known = FoundPlaces { first, reach_m, touches: recycled.touches };
        }
        (into, searched.is_some())
    }

    #[test]
    fn places_move_along_with_their_solids_as_a_search_finds_them() {
        let at = |angle_rad: f64| Pose {
            position: DVec3::new(3.0, angle_rad, -1.0),
            rotation: DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle_rad),
        };
        let mut recycled = FoundPlaces::default();
        assert!(places(&mut recycled, at(0.3), [-20e-6, 0.0]).1, "nothing is known");
        // both go on together, and a little against each other
        let (known, searched) = places(&mut recycled, at(1.7), [-19.6e-6, 4e-6]);
        assert!(!searched && known.len() >= 4, "{}", known.len());
        let (found, _) = places(&mut FoundPlaces::default(), at(1.7), [-19.6e-6, 4e-6]);
        assert_eq!(known.len(), found.len());
        for (known, found) in known.iter().zip(&found) {
            assert_eq!(known.key, found.key);
            assert!((known.gap_m - found.gap_m).abs() < 1e-8, "{} {}", known.gap_m, found.gap_m);
            assert!(known.normal.distance(found.normal) < 1e-5);
            let (Place::Point(a), Place::Point(b)) = (known.on_a, found.on_a) else { panic!("points") };
            assert!(a.distance(b) < MOVED_M, "{a} {b}");
        }
        assert!(places(&mut recycled, at(1.7), [-17e-6, 0.0]).1, "it went by more than a micrometre");
        assert!(!places(&mut recycled, at(1.7), [-17e-6, 0.0]).1);
    }

    #[test]
    fn a_pair_that_is_far_is_searched_again_once_it_may_be_near() {
        let mut known = FoundPlaces::default();
        let mut at_m = |up_m: f64| places(&mut known, Pose::HERE, [up_m, 0.0]);
        assert!(at_m(0.02).1, "nothing is known");
        // at a millimetre's reach two that were 2 cm apart may come nearer by 1.9
        assert_eq!([0.015, 0.01, 0.0011].map(|up_m| at_m(up_m).1), [false; 3]);
        let (found, searched) = at_m(0.9e-3);
        assert!(searched && found.len() >= 4, "{}", found.len());
    }

    #[test]
    fn a_pair_is_searched_again_for_places_farther_than_it_was_searched_for() {
        let mut known = FoundPlaces::default();
        let here = [0.5e-3, 0.0];
        assert!(places(&mut known, Pose::HERE, here).1 && !places(&mut known, Pose::HERE, here).1);
        let (near, searched) = within(&mut known, Pose::HERE, here, 0.4e-3);
        assert!(near.is_empty() && !searched, "none is nearer than half a millimetre");
        assert!(!within(&mut known, Pose::HERE, here, 1.2e-3).1);
        assert!(within(&mut known, Pose::HERE, here, 1.25e-3).1);
    }
}
