//! The shortest way out of an overlap: the face of the difference of two convex parts that is nearest to the origin (EPA).
//!
//! In: the difference as corners by direction. Out: the normal and the depth. Never here: parts that are apart.
//! The hull grows from any tetrahedron: the face nearest to the origin first, and before all a face that has the origin in front of it.

use super::gjk::{Corner, Difference, Separation};
use glam::DVec3;

/// Rounds of growing; the difference of two boxes is complete after thirty, that of round shapes is accurate to 1e-6 of its size.
const ROUNDS: usize = 96;
/// A face belongs to the true difference if no corner is farther than this share of the sizes in front of it.
const OWN_SHARE: f64 = 1e-10;
/// A face with an area below this share of the sizes squared has no normal.
const AREA_SHARE: f64 = 1e-14;

/// The growing hull; its storage is reused.
#[derive(Default)]
pub(crate) struct Hull {
    corners: Vec<Corner>,
    faces: Vec<Face>,
    rim: Vec<[usize; 2]>,
}

#[derive(Clone, Copy)]
struct Face {
    corners: [usize; 3],
    /// Outward.
    normal: DVec3,
    /// Depth of the origin behind it, metres; infinite for a face without area.
    depth_m: f64,
}

impl Hull {
    /// The shortest separation of two overlapping parts; `None` where the numbers are not finite.
    pub fn way_out(&mut self, difference: &Difference<'_>) -> Option<Separation> {
        self.start(difference)?;
        let size_m = self.corners.iter().map(|c| c.way.length()).fold(0.0, f64::max);
        let mut best: Option<Separation> = None;
        for _ in 0..ROUNDS {
            let face = *self.faces.iter().min_by(|p, q| p.depth_m.total_cmp(&q.depth_m))?;
            if !face.depth_m.is_finite() {
                break;
            }
            let corner = difference.support(face.normal);
            let depth_m = corner.way.dot(face.normal);
            if best.is_none_or(|best| -depth_m > best.gap_m) {
                best = Some(Separation { normal: -face.normal, gap_m: -depth_m, on: self.facing(face) });
            }
            if depth_m - face.depth_m <= OWN_SHARE * size_m {
                break;
            }
            self.grow(corner, size_m);
            if self.faces.len() > 2 * self.corners.len() {
                break; // rounding has broken it: a closed hull has twice as many faces as corners, less four
            }
        }
        best
    }

    /// A tetrahedron with a volume.
    fn start(&mut self, difference: &Difference<'_>) -> Option<()> {
        self.corners.clear();
        self.faces.clear();
        let farther = |way: DVec3, from: DVec3| {
            let [p, q] = [difference.support(way), difference.support(-way)];
            let far = |corner: &Corner| (corner.way - from).dot(way).abs();
            if far(&p) >= far(&q) { p } else { q }
        };
        let (a, b) = (difference.support(DVec3::X), difference.support(DVec3::NEG_X));
        let along = (b.way - a.way).try_normalize()?;
        let c = farther(along.any_orthonormal_vector(), a.way);
        let across = (b.way - a.way).cross(c.way - a.way).try_normalize()?;
        let d = farther(across, a.way);
        self.corners.extend([a, b, c, d]);
        let size_m = self.corners.iter().map(|c| c.way.length()).fold(0.0, f64::max);
        // counter-clockwise seen from outside, whichever side d is on
        let (b, c) = if (d.way - a.way).dot(across) < 0.0 { (1, 2) } else { (2, 1) };
        for face in [[0, b, c], [0, c, 3], [c, b, 3], [b, 0, 3]] {
            self.push(face, size_m);
        }
        Some(())
    }

    fn push(&mut self, corners: [usize; 3], size_m: f64) {
        let [a, b, c] = corners.map(|i| self.corners[i].way);
        let area = (b - a).cross(c - a);
        let has_normal = area.length() > AREA_SHARE * size_m * size_m;
        let normal = if has_normal { area.normalize() } else { DVec3::ZERO };
        let depth_m = if has_normal { a.dot(normal) } else { f64::INFINITY };
        self.faces.push(Face { corners, normal, depth_m });
    }

    /// Adds a corner: faces that see it are removed, their rim is joined to it.
    fn grow(&mut self, corner: Corner, size_m: f64) {
        let number = self.corners.len();
        self.corners.push(corner);
        self.rim.clear();
        let Self { corners, faces, rim, .. } = self;
        faces.retain(|face| {
            let sees = (corner.way - corners[face.corners[0]].way).dot(face.normal) > 0.1 * OWN_SHARE * size_m;
            if sees {
                let [a, b, c] = face.corners;
                for edge in [[a, b], [b, c], [c, a]] {
                    match rim.iter().position(|&[p, q]| [q, p] == edge) {
                        Some(shared) => drop(rim.swap_remove(shared)),
                        None => rim.push(edge),
                    }
                }
            }
            !sees
        });
        for i in 0..self.rim.len() {
            let [a, b] = self.rim[i];
            self.push([a, b, number], size_m);
        }
    }

    /// The points of both parts that face each other where the way out crosses a face.
    fn facing(&self, face: Face) -> [DVec3; 2] {
        let [a, b, c] = face.corners.map(|i| self.corners[i]);
        let foot = face.normal * face.depth_m;
        let area = |p: DVec3, q: DVec3| (p - foot).cross(q - foot).dot(face.normal).max(0.0);
        let areas = [area(b.way, c.way), area(c.way, a.way), area(a.way, b.way)];
        let whole = areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        [0, 1].map(|side| (a.on[side] * areas[0] + b.on[side] * areas[1] + c.on[side] * areas[2]) / whole)
    }
}
