//! Strands: balls along a polyline, joined by spans, and the facing points of two of them.
//!
//! In: nodes with radii. Out: feet of nodes, facing points, gaps. Never here: the choice of pairs, motion.
//! Theory: `docs/theory/contact.md`, eq. 4.

use super::signed_distance::{Ball, Touch};
use glam::DVec3;

/// Axes closer than this cross, metres: the vector from one to the other has no direction.
pub(crate) const CROSSING_M: f64 = 1e-9;

/// The fraction of `segment` at which `point` has its foot on a chain of at least two nodes; `None` where another segment has it. Each foot
/// belongs to exactly one segment: at a convex joint to the later one, past an end of the chain to the last one there. A segment without
/// length has it at its start.
pub fn foot(point: DVec3, chain: &[DVec3], segment: usize) -> Option<f64> {
    let share = |k: usize| {
        let way = chain[k + 1] - chain[k];
        let length2 = way.length_squared();
        if length2 > 0.0 { (point - chain[k]).dot(way) / length2 } else { 0.0 }
    };
    let here = share(segment);
    if here >= 1.0 {
        return (segment + 2 == chain.len()).then_some(1.0);
    }
    let ours = here >= 0.0 || segment == 0 || share(segment - 1) >= 1.0;
    ours.then_some(here.max(0.0))
}

/// The facing of two points of two spans: the normal from the second to the first, the distance of the surfaces, and the radii there.
pub fn facing(first: [Ball; 2], second: [Ball; 2], shares: [f64; 2]) -> (Touch, [f64; 2]) {
    let (a, b) = (first[0].toward(first[1], shares[0]), second[0].toward(second[1], shares[1]));
    let way = a.centre - b.centre;
    let distance = way.length();
    // crossing axes have no direction between them: the normal of both axes is used
    let across = || {
        let [u, v] = [first, second].map(|ends| ends[1].centre - ends[0].centre);
        let along = if u == DVec3::ZERO { v } else { u };
        u.cross(v).try_normalize().unwrap_or_else(|| along.normalize_or(DVec3::Z).any_orthonormal_vector())
    };
    let normal = if distance > CROSSING_M { way / distance } else { across() };
    (Touch { normal, distance_m: distance - a.radius_m - b.radius_m }, [a.radius_m, b.radius_m])
}
