//! Contacts of blocks with blocks: the gap of convex parts in double precision, and the corners and edges on which they rest.
//!
//! In: two blocks. Out: contacts, the nearest gap. Never here: strands.
//! The normal and the gap are [`crate::narrow_phase::blocks::gjk`]'s; parry clips the features that face each other along that normal, in single
//! precision and relative to each other.

use super::epa::Hull;
use super::gjk::{Difference, Part, Parting, Separation};
use crate::narrow_phase::primitives::Block;
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::{Place, Touch};
use glam::{DQuat, DVec3};
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::parry::math::{Pose, Rotation};
use rapier3d::parry::query::{ContactManifold, TrackedContact};
use rapier3d::parry::shape::{PackedFeatureId, PolygonalFeature};

/// Error of a place in single precision, as a share of the sizes: ten roundings.
pub(super) const SINGLE_SHARE: f64 = 1e-6;
/// Points of a manifold closer to each other than this share of the sizes count as one.
pub(crate) const SAME_SHARE: f64 = 1e-4;

/// Storage for the search.
#[derive(Default)]
pub(crate) struct ConvexScratch {
    pub(crate) hull: Hull,
    pub(super) manifold: ContactManifold<(), ()>,
}

impl ConvexScratch {
    /// Every place within `reach_m`. Returns how far at least all others are, metres.
    pub fn touches(&mut self, a: &Block<'_>, b: &Block<'_>, reach_m: f64, into: &mut Vec<Touch>) -> f64 {
        let Self { hull, manifold } = self;
        let size_m = a.around.radius_m + b.around.radius_m;
        let mut clear_m = f64::INFINITY;
        let boxes_m =
            each_pair(a, b, reach_m, |first, second| match Difference::new(first, second).parting(reach_m, hull) {
                Parting::Beyond(least_m) => clear_m = clear_m.min(least_m),
                Parting::Within(apart) => {
                    clear_m = clear_m.min(reach_m);
                    clip(manifold, first, second, &apart);
                    let facing = Facing { first, second, apart, reach_m, size_m };
                    facing.report(manifold, into);
                }
            });
        clear_m.min(boxes_m)
    }

    /// The nearest place: its normal from b towards a, and a gap that is never more than the true one.
    pub fn gap(&mut self, a: &Block<'_>, b: &Block<'_>, reach_m: f64) -> Option<(DVec3, f64)> {
        let mut nearest: Option<(DVec3, f64)> = None;
        each_pair(a, b, reach_m, |first, second| {
            let reach_m = nearest.map_or(reach_m, |(_, gap_m)| gap_m.min(reach_m));
            let apart = Difference::new(first, second).apart(reach_m, &mut self.hull);
            let Some(apart) = apart.filter(|apart| apart.gap_m <= reach_m) else { return };
            nearest = Some((apart.normal, apart.gap_m));
        });
        // the corners are available in single precision only
        let rounding_m = 0.5 * f64::from(f32::EPSILON) * (a.around.radius_m + b.around.radius_m);
        nearest.map(|(normal, gap_m)| (normal, if gap_m > 0.0 { (gap_m - rounding_m).max(0.0) } else { gap_m }))
    }
}

/// Visits the pairs of convex parts whose boxes come within `reach_m`. Returns how far apart at least all others are, metres.
fn each_pair(a: &Block<'_>, b: &Block<'_>, reach_m: f64, mut visit: impl FnMut(&Part<'_>, &Part<'_>)) -> f64 {
    let loose_m = reach_m.max(0.0) + SINGLE_SHARE * (a.around.radius_m + b.around.radius_m);
    let mut clear_m = f64::INFINITY;
    for first in parts(a) {
        let own = first.shape.compute_local_aabb().loosened(loose_m as f32);
        for second in parts(b) {
            let other = second.shape.compute_aabb(&relative(&first, &second));
            if own.intersects(&other) {
                visit(&first, &second);
            } else {
                // the boxes were loosened by as much as rounding may be, too
                let apart = (other.mins - own.maxs).max(own.mins - other.maxs).max_element();
                clear_m = clear_m.min(reach_m.max(0.0) + f64::from(apart.max(0.0)));
            }
        }
    }
    clear_m
}

/// A pose in single precision.
pub(crate) fn pose(position: DVec3, rotation: DQuat) -> Pose {
    let q = rotation.as_quat();
    Pose::from_parts(position.as_vec3(), Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize())
}

/// The convex parts of a block; a half space has none.
pub(crate) fn parts<'a>(block: &Block<'a>) -> impl Iterator<Item = Part<'a>> + use<'a> {
    let Block { shape, origin, rotation, .. } = *block;
    let whole = Part { number: 0, shape, origin, rotation };
    let compound = shape.as_compound();
    let within =
        compound.into_iter().flat_map(|compound| (0..).zip(compound.shapes())).map(move |(number, (at, shape))| {
            let turn = at.rotation;
            let turn = DQuat::from_xyzw(turn.x.into(), turn.y.into(), turn.z.into(), turn.w.into()).normalize();
            let origin = origin + rotation * at.translation.as_dvec3();
            Part { number, shape: shape.as_ref(), origin, rotation: rotation * turn }
        });
    let whole = Some(whole).filter(|whole| compound.is_none() && whole.shape.as_support_map().is_some());
    whole.into_iter().chain(within)
}

/// The second part's pose in the first's axes: relative in double precision first.
fn relative(first: &Part<'_>, second: &Part<'_>) -> Pose {
    let back = first.rotation.conjugate();
    pose(back * (second.origin - first.origin), back * second.rotation)
}

/// The points where the features that face each other along the normal meet.
pub(super) fn clip(manifold: &mut ContactManifold<(), ()>, first: &Part<'_>, second: &Part<'_>, apart: &Separation) {
    manifold.points.clear();
    let maps = first.shape.as_polygonal_feature_map().zip(second.shape.as_polygonal_feature_map());
    let Some(((one, one_rim), (two, two_rim))) = maps else { return };
    let (back, there) = (first.rotation.conjugate(), second.rotation.conjugate());
    let (out, inward) = ((back * -apart.normal).as_vec3(), (there * apart.normal).as_vec3());
    let (mut face, mut other) = (PolygonalFeature::default(), PolygonalFeature::default());
    one.local_support_feature_toward(out, (back * apart.on[0]).as_vec3(), &mut face);
    let hint = there * (apart.on[1] + first.origin - second.origin);
    two.local_support_feature_toward(inward, hint.as_vec3(), &mut other);
    let pose = relative(first, second);
    PolygonalFeature::contacts(&pose, &pose.inverse(), out, inward, &face, &other, manifold, false);
    for point in &mut manifold.points {
        point.local_p1 += out * one_rim;
        point.dist -= one_rim + two_rim;
    }
}

/// A point where the facing features of two parts meet.
struct ClippedPoint {
    key: TouchKey,
    gap_m: f64,
    /// On the first part, relative to its origin, in world axes, metres.
    place: DVec3,
}

/// Two parts that face each other.
struct Facing<'a> {
    first: &'a Part<'a>,
    second: &'a Part<'a>,
    apart: Separation,
    reach_m: f64,
    size_m: f64,
}

impl Facing<'_> {
    /// Adds the points of a manifold, the lowest of which gets the gap of double precision, and the nearest place if the manifold
    /// does not contain it.
    fn report(&self, manifold: &ContactManifold<(), ()>, into: &mut Vec<Touch>) {
        let least_m = manifold.points.iter().map(|point| f64::from(point.dist)).fold(f64::INFINITY, f64::min);
        let shift_m = self.apart.gap_m - least_m;
        let is_there = shift_m.abs() < SAME_SHARE * self.size_m;
        let from = into.len();
        if !is_there {
            let key = self.key(PackedFeatureId::UNKNOWN, PackedFeatureId::UNKNOWN);
            let nearest = ClippedPoint { key, gap_m: self.apart.gap_m, place: self.apart.on[0] };
            self.add(nearest, from, into);
        }
        for point in &manifold.points {
            let gap_m = f64::from(point.dist) + if is_there { shift_m } else { 0.0 };
            let TrackedContact { fid1, fid2, local_p1, .. } = *point;
            let place = self.first.rotation * local_p1.as_dvec3();
            let key = self.key(fid1, fid2);
            self.add(ClippedPoint { key, gap_m: gap_m.max(self.apart.gap_m), place }, from, into);
        }
    }

    /// Adds a point, unless it is too far or already listed at or after `from`.
    fn add(&self, point: ClippedPoint, from: usize, into: &mut Vec<Touch>) {
        let ClippedPoint { key, gap_m, place } = point;
        let on_a = self.first.origin + place;
        let within_m = SAME_SHARE * self.size_m;
        let is_same =
            |reported: Place| matches!(reported, Place::Point(reported) if reported.distance(on_a) < within_m);
        if gap_m <= self.reach_m && !into[from..].iter().any(|reported| is_same(reported.on_a)) {
            let normal = self.apart.normal;
            let on_b = Place::Point(on_a - normal * gap_m);
            into.push(Touch { key, normal, gap_m, on_a: Place::Point(on_a), on_b });
        }
    }

    /// The key of a point: the parts, and the corners, edges or faces that meet in it.
    fn key(&self, one: PackedFeatureId, two: PackedFeatureId) -> TouchKey {
        let parts = [self.first.number, self.second.number];
        TouchKey { parts, ..TouchKey::new(TouchKind::Convex, [one.0, two.0]) }
    }
}
