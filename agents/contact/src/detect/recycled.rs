//! Places of pairs of solids, kept from step to step: they move along with the two, and what lies still is not searched again.
//!
//! In: where two solids are; places that were found of them. Out: their places now, if these are known. Never here: how places are found.
//! Theory: docs/theory/contact.md, section 1.

use crate::member::memory::Partner;
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Archive, ArchiveError, archive_values};
use metachron_geometry::{Place, ShapePose, Touch};

/// How far a point of one solid may have gone against the other since their places were found, metres: less than what has met is apart by.
const MOVED_M: f64 = 1e-6;
/// Places are found within so many times the reach that is asked for, as this follows speeds.
const FURTHER: f64 = 1.25;

/// A pair, by the body that remembers it.
pub(super) type PairName = (AgentId, Partner);

/// Where a solid is.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Pose {
    position: DVec3,
    rotation: DQuat,
}

/// Two solids: the pose of the first in the axes of the second, and that of the second.
#[derive(Debug, Clone, Copy)]
pub(super) struct TwoSolids {
    first: Pose,
    second: Pose,
    /// No point of the first is farther from its middle, metres.
    radius_m: f64,
}

/// A pair whose places were found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct Found {
    name: PairName,
    /// The pose of the first solid then, in the axes of the second.
    first: Pose,
    /// All places nearer than this were found, metres.
    reach_m: f64,
    /// How many.
    count: usize,
    /// The number of the first of them.
    from: usize,
}

/// Pairs by rising names, with their places in the axes of the second solid.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
struct FoundPairs {
    pairs: Vec<Found>,
    touches: Vec<Touch>,
}

/// The places of the last fine step, and of the one that is searched.
#[derive(Debug, Default)]
pub(super) struct Recycled {
    known: FoundPairs,
    next: FoundPairs,
}

impl Pose {
    const HERE: Self = Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// `None` of what is no solid.
    fn of(view: ShapePose<'_>) -> Option<Self> {
        match view {
            ShapePose::Solid { position, rotation } => Some(Self { position, rotation }),
            _ => None,
        }
    }

    fn to_world(self, point: DVec3) -> DVec3 {
        self.position + self.rotation * point
    }

    fn to_local(self, point: DVec3) -> DVec3 {
        self.rotation.conjugate() * (point - self.position)
    }
}

impl TwoSolids {
    /// Two placed shapes, the second of a static solid where it is `None`; `None` where one is no solid.
    pub fn of(first: ShapePose<'_>, second: Option<ShapePose<'_>>, radius_m: f64) -> Option<Self> {
        let (first, second) = (Pose::of(first)?, second.map_or(Some(Pose::HERE), Pose::of)?);
        let turned = second.rotation.conjugate() * first.rotation;
        let first = Pose { position: second.to_local(first.position), rotation: turned };
        Some(Self { first, second, radius_m })
    }

    /// How far at most a point of the first has gone against the second since it was at `then`, metres.
    fn moved_m(&self, then: Pose) -> f64 {
        let turned = self.first.rotation * then.rotation.conjugate();
        let angle_rad = 2.0 * DVec3::new(turned.x, turned.y, turned.z).length();
        self.first.position.distance(then.position) + angle_rad * self.radius_m
    }

    /// A place in the axes of the second, into the world's; `by` moves what is fixed to the first.
    fn placed(&self, touch: &Touch, by: impl Fn(DVec3) -> DVec3) -> Touch {
        let Touch { on_a: Place::Point(a), on_b: Place::Point(b), .. } = *touch else { return *touch };
        let moved = by(a);
        Touch {
            normal: self.second.rotation * touch.normal,
            gap_m: touch.gap_m + touch.normal.dot(moved - a),
            on_a: Place::Point(self.second.to_world(moved)),
            on_b: Place::Point(self.second.to_world(b)),
            ..*touch
        }
    }

    /// A place of the world, in the axes of the second.
    fn unplaced(&self, touch: &Touch) -> Touch {
        let local = |place: Place| match place {
            Place::Point(point) => Place::Point(self.second.to_local(point)),
            other => other,
        };
        let normal = self.second.rotation.conjugate() * touch.normal;
        Touch { normal, on_a: local(touch.on_a), on_b: local(touch.on_b), ..*touch }
    }
}

impl Recycled {
    /// Writes or reads what the next search needs.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.known)
    }

    /// Fills `into` with the places of a pair within `reach_m`: those known, or else all that `find` gives within the reach it is told.
    pub fn touches(
        &mut self,
        name: PairName,
        solids: &TwoSolids,
        reach_m: f64,
        into: &mut Vec<Touch>,
        find: impl FnOnce(f64, &mut Vec<Touch>),
    ) {
        let Self { known, next } = self;
        let from = next.touches.len();
        let found = known.pairs.binary_search_by_key(&name, |pair| pair.name).ok().map(|at| known.pairs[at]);
        if let Some(pair) = found.filter(|pair| reach_m <= pair.reach_m && solids.moved_m(pair.first) < MOVED_M) {
            let touches = &known.touches[pair.from..pair.from + pair.count];
            into.clear();
            into.extend(
                touches.iter().map(|touch| solids.placed(touch, |a| solids.first.to_world(pair.first.to_local(a)))),
            );
            next.touches.extend_from_slice(touches);
            next.pairs.push(Found { from, ..pair });
        } else {
            let further_m = FURTHER * reach_m;
            find(further_m, into);
            next.touches.extend(into.iter().map(|touch| solids.unplaced(touch)));
            next.pairs.push(Found { name, first: solids.first, reach_m: further_m, count: into.len(), from });
        }
        into.retain(|touch| touch.gap_m <= reach_m);
    }

    /// Begins a search.
    pub fn begin(&mut self) {
        self.next.pairs.clear();
        self.next.touches.clear();
    }

    /// Ends a search: what it has found or used is known, and nothing else.
    pub fn end(&mut self) {
        std::mem::swap(&mut self.known, &mut self.next);
        if !self.known.pairs.is_sorted_by_key(|pair| pair.name) {
            self.known.pairs.sort_unstable_by_key(|pair| pair.name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
    use metachron_geometry::{CollisionShape, ContactTraits, PlacedShape, ShapeKind, Solid, SolidShape};

    /// A box of 4 cm.
    fn form() -> CollisionShape {
        let solid = Solid::Box { half_extents_m: DVec3::splat(0.02) };
        let kind = ShapeKind::Solid(SolidShape::new(solid, DVec3::ZERO).unwrap());
        CollisionShape { kind, friction: 0.5, restitution: 0.0, traits: ContactTraits::default() }
    }

    /// The places of two boxes, the second standing askew in the world, the first `up_m` over it and turned by `turn_rad`; whether they were searched.
    fn places(recycled: &mut Recycled, frame: Pose, [up_m, turn_rad]: [f64; 2]) -> (Vec<Touch>, bool) {
        let form = form();
        let place = |position: DVec3, turn_rad: f64| {
            let rotation = frame.rotation * DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), turn_rad);
            PlacedShape { form: &form, view: ShapePose::Solid { position: frame.to_world(position), rotation } }
        };
        let (first, second) = (place(DVec3::new(0.005, 0.003, 0.04 + up_m), turn_rad), place(DVec3::ZERO, 0.0));
        let (mut into, mut scratch, mut searched) = (Vec::new(), NarrowPhaseScratch::default(), false);
        let solids = TwoSolids::of(first.view, Some(second.view), 0.07).unwrap();
        let name = (AgentId(3), Partner::Agent(AgentId(5)));
        recycled.begin();
        recycled.touches(name, &solids, 1e-3, &mut into, |reach_m, into| {
            searched = true;
            touches(&first, &second, reach_m, &mut scratch, into);
        });
        recycled.end();
        (into, searched)
    }

    #[test]
    fn places_move_along_with_their_solids_as_a_search_finds_them() {
        let at = |angle_rad: f64| Pose {
            position: DVec3::new(3.0, angle_rad, -1.0),
            rotation: DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle_rad),
        };
        let mut recycled = Recycled::default();
        assert!(places(&mut recycled, at(0.3), [-20e-6, 0.0]).1, "nothing is known");
        // both go on together, and a little against each other
        let (known, searched) = places(&mut recycled, at(1.7), [-19.6e-6, 4e-6]);
        assert!(!searched && known.len() >= 4, "{}", known.len());
        let (found, _) = places(&mut Recycled::default(), at(1.7), [-19.6e-6, 4e-6]);
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
    fn a_pair_that_is_not_searched_for_is_forgotten() {
        let mut recycled = Recycled::default();
        let here = Pose::HERE;
        assert!(places(&mut recycled, here, [0.0, 0.0]).1 && !places(&mut recycled, here, [0.0, 0.0]).1);
        recycled.begin();
        recycled.end();
        assert!(places(&mut recycled, here, [0.0, 0.0]).1);
    }

    #[test]
    fn what_is_known_comes_back_from_an_archive() {
        let mut recycled = Recycled::default();
        places(&mut recycled, Pose::HERE, [-20e-6, 0.0]);
        let mut archive = Archive::writer();
        recycled.archive(&mut archive).unwrap();
        let (bytes, mut read) = (archive.into_bytes(), Recycled::default());
        read.archive(&mut Archive::reader(&bytes)).unwrap();
        let (there, searched) = places(&mut read, Pose::HERE, [-20e-6, 1e-6]);
        assert!(!searched);
        assert_eq!(there, places(&mut recycled, Pose::HERE, [-20e-6, 1e-6]).0);
    }
}
