//! Blocks against blocks: manifolds of convex parts by parry, relative to each other.
//!
//! In: two blocks. Out: all points of their manifolds, the nearest gap. Poses are made relative in double precision, so that
//! single precision sees small numbers only. Never here: strands.

use super::pieces::Block;
use super::{Place, Touch};
use glam::{DQuat, DVec3};
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::parry::math::{Pose, Rotation, Vec3};
use rapier3d::parry::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, QueryDispatcher, TrackedContact,
};
use rapier3d::parry::shape::{PackedFeatureId, Shape};

/// What single precision may get wrong of a gap, as a share of the sizes: eight roundings.
const SINGLE_SHARE: f64 = 1e-6;
/// Points of a manifold nearer to each other than this share of the sizes are one.
const SAME_SHARE: f64 = 1e-4;
/// Bits of a feature and of a part in keys.
const FEATURE_BITS: u32 = 24;
/// See [`FEATURE_BITS`].
const PART_BITS: u32 = 5;

/// Storage for a manifold.
#[derive(Default)]
pub(super) struct BlockRoom {
    manifold: ContactManifold<(), ()>,
}

/// A convex part of a block.
struct Part<'a> {
    number: u64,
    shape: &'a dyn Shape,
    origin: DVec3,
    rotation: DQuat,
}

impl BlockRoom {
    /// Every point of the manifolds of all parts within `reach_m`.
    pub fn touches(&mut self, a: &Block<'_>, b: &Block<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        let size_m = size(a, b);
        each_pair(a, b, reach_m, |first, second, relative| {
            let manifold = &mut self.manifold;
            manifold.points.clear();
            manifold.local_n1 = Vec3::ZERO;
            let reach = (reach_m + SINGLE_SHARE * size_m) as f32;
            // a pair that parry does not support leaves the manifold empty
            let _ = DefaultQueryDispatcher.contact_manifold_convex_convex(
                relative,
                first.shape,
                second.shape,
                None,
                None,
                reach,
                manifold,
            );
            let Some(out) = manifold.local_n1.as_dvec3().try_normalize() else { return };
            let normal = first.rotation * -out;
            let from = into.len();
            for point in &manifold.points {
                let gap_m = f64::from(point.dist);
                let on_a = first.origin + first.rotation * point.local_p1.as_dvec3();
                let on_b = on_a - normal * gap_m;
                let is_told = into[from..].iter().any(|told| is_near(told.on_a, on_a, SAME_SHARE * size_m));
                if gap_m <= reach_m && !is_told {
                    let key = key(first.number, second.number, point);
                    into.push(Touch { key, normal, gap_m, on_a: Place::Point(on_a), on_b: Place::Point(on_b) });
                }
            }
        });
    }

    /// The nearest place: its normal from b towards a, and a lower bound of the gap.
    pub fn gap(&mut self, a: &Block<'_>, b: &Block<'_>, reach_m: f64) -> Option<(DVec3, f64)> {
        let slack_m = SINGLE_SHARE * (size(a, b) + reach_m);
        let mut nearest: Option<(DVec3, f64)> = None;
        each_pair(a, b, reach_m, |first, second, relative| {
            let reach = nearest.map_or(reach_m, |(_, gap_m)| gap_m.min(reach_m)) + 2.0 * slack_m;
            let contact = DefaultQueryDispatcher.contact(relative, first.shape, second.shape, reach.max(0.0) as f32);
            let Ok(Some(contact)) = contact else { return };
            let Some(out) = contact.normal1.as_dvec3().try_normalize() else { return };
            let normal = first.rotation * -out;
            // parry's own distance is right to a thousandth; no plane lies between the bodies with more room than they have
            let between = extent(second, normal).zip(extent(first, -normal));
            let gap_m = between.map_or(f64::from(contact.dist), |(far, near)| -near - far) - slack_m;
            if nearest.is_none_or(|(_, least)| gap_m < least) {
                nearest = Some((normal, gap_m));
            }
        });
        nearest
    }
}

/// How far a part reaches along a direction, metres from the world's origin.
fn extent(part: &Part<'_>, way: DVec3) -> Option<f64> {
    let inside = part.rotation.conjugate() * way;
    let corner = part.shape.as_support_map()?.local_support_point(inside.as_vec3());
    Some(corner.as_dvec3().dot(inside) + part.origin.dot(way))
}

/// Visits the pairs of convex parts whose boxes come within `reach_m`, with the second's pose in the first's axes.
fn each_pair(a: &Block<'_>, b: &Block<'_>, reach_m: f64, mut visit: impl FnMut(&Part<'_>, &Part<'_>, &Pose)) {
    let reach = (reach_m + SINGLE_SHARE * size(a, b)) as f32;
    for first in parts(a) {
        let own = first.shape.compute_local_aabb().loosened(reach.max(0.0));
        for second in parts(b) {
            let back = first.rotation.conjugate();
            let relative = pose(back * (second.origin - first.origin), back * second.rotation);
            let is_plane = |part: &Part<'_>| part.shape.as_halfspace().is_some();
            if is_plane(&first) || is_plane(&second) || own.intersects(&second.shape.compute_aabb(&relative)) {
                visit(&first, &second, &relative);
            }
        }
    }
}

/// The convex parts of a block. Taken apart here: parry 0.31.1 answers for a compound over a half space with the pose turned
/// round.
fn parts<'a>(block: &'a Block<'a>) -> impl Iterator<Item = Part<'a>> {
    let whole = Part { number: 0, shape: block.shape.as_ref(), origin: block.origin, rotation: block.rotation };
    let compound = block.shape.as_compound();
    let within = compound.into_iter().flat_map(|compound| (0..).zip(compound.shapes())).map(|(number, (at, shape))| {
        let turn =
            DQuat::from_xyzw(at.rotation.x.into(), at.rotation.y.into(), at.rotation.z.into(), at.rotation.w.into());
        Part {
            number,
            shape: shape.as_ref(),
            origin: block.origin + block.rotation * at.translation.as_dvec3(),
            rotation: block.rotation * turn.normalize(),
        }
    });
    Some(whole).filter(|_| compound.is_none()).into_iter().chain(within)
}

/// How large both blocks are together, metres; planes have no size.
fn size(a: &Block<'_>, b: &Block<'_>) -> f64 {
    [a, b].iter().map(|block| block.around.radius_m).filter(|radius_m| radius_m.is_finite()).sum()
}

fn is_near(place: Place, point: DVec3, within_m: f64) -> bool {
    matches!(place, Place::Point(told) if told.distance_squared(point) <= within_m * within_m)
}

/// The name of a point: the parts, and the corners, edges or faces that meet in it.
fn key(first: u64, second: u64, point: &TrackedContact<()>) -> u64 {
    let part = |number: u64| number & ((1 << PART_BITS) - 1);
    // parry keeps the kind of a feature in the two highest bits
    let feature = |PackedFeatureId(id): PackedFeatureId| {
        let (kind, number) = (u64::from(id >> 30), u64::from(id) & ((1 << (FEATURE_BITS - 2)) - 1));
        kind << (FEATURE_BITS - 2) | number
    };
    (part(first) << PART_BITS | part(second)) << (2 * FEATURE_BITS)
        | feature(point.fid1) << FEATURE_BITS
        | feature(point.fid2)
}

/// A pose in single precision.
fn pose(position: DVec3, rotation: DQuat) -> Pose {
    let q = rotation.as_quat();
    Pose::from_parts(position.as_vec3(), Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize())
}
