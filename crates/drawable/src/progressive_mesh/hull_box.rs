//! The box around a mesh of several parts as its coarsest cut.
//!
//! In: a welded mesh, then its order. Out: the corners to keep, then the order with a box before it.
//! Never here: meshes of one part.
//! The eight outermost corners of the largest part are never removed, so that it is the last and has twelve triangles; the substitutes of
//! its corners are those of the box.

use super::weld::{SAME_PLACE, Welded};
use glam::{BVec3, Vec3};
use metachron_geometry::PrimitiveVertex;
use std::collections::BTreeMap;

/// Triangles of a box.
pub(super) const TRIANGLES: u32 = 12;
/// Most triangles of the first cut beyond the box: further ones are of many things side by side, of which a box says less than those that
/// are left.
pub(super) const NEXT_MOST: u32 = 64;

/// The outermost positions of the largest part in the eight directions of its diagonals; `None` for a mesh of one part, and for a part that
/// has fewer.
pub(super) fn corners(welded: &Welded) -> Option<[u32; 8]> {
    let parts = parts(welded);
    let bounds = |part: &Vec<u32>| around(part.iter().map(|&p| welded.places[p as usize]));
    let size = |part: &Vec<u32>| bounds(part).map_or(0.0, |[low, high]| low.distance(high));
    let part = parts.iter().rev().max_by(|a, b| size(a).total_cmp(&size(b))).filter(|_| parts.len() > 1)?;
    let [low, high] = bounds(part)?;
    let outermost = |octant: usize| {
        let way = Vec3::from(side(octant)) / (high - low);
        let out = |p: &u32| way.dot(welded.places[*p as usize]);
        part.iter().copied().max_by(|a, b| out(a).total_cmp(&out(b)))
    };
    let mut found = [0; 8];
    for octant in 0..8 {
        found[octant] = outermost(octant)?;
        if found[..octant].contains(&found[octant]) {
            return None;
        }
    }
    Some(found)
}

/// Signs of the diagonal of an octant.
fn side(octant: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { 1.0 } else { -1.0 })
}

/// Positions of each part.
fn parts(welded: &Welded) -> Vec<Vec<u32>> {
    let mut roots: Vec<u32> = (0..welded.places.len() as u32).collect();
    for t in &welded.triangles {
        let [a, b, c] = t.map(|w| root(&mut roots, welded.place_of[w as usize]));
        let least = a.min(b).min(c);
        [a, b, c].iter().for_each(|&p| roots[p as usize] = least);
    }
    let mut parts: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for p in 0..roots.len() as u32 {
        parts.entry(root(&mut roots, p)).or_default().push(p);
    }
    parts.into_values().collect()
}

/// The least position known to be of the part of `p`.
fn root(roots: &mut [u32], mut p: u32) -> u32 {
    while roots[p as usize] != p {
        roots[p as usize] = roots[roots[p as usize] as usize];
        p = roots[p as usize];
    }
    p
}

fn around(points: impl Iterator<Item = Vec3>) -> Option<[Vec3; 2]> {
    points.map(|p| [p, p]).reduce(|[low, high], [p, _]| [low.min(p), high.max(p)])
}

/// The lists of an ordered mesh.
pub(super) struct Order<'a> {
    pub vertices: &'a mut Vec<PrimitiveVertex>,
    pub triangles: &'a mut [[u32; 3]],
    pub substitutes: &'a mut Vec<u32>,
}

/// Puts the corners of the box around all vertices before those of the last part, which has the triangles `faces`; gives their number, `None` where that part is no box in the same way.
pub(super) fn prepend(tom: Order<'_>, faces: &[[u32; 3]]) -> Option<u32> {
    // the last vertices of parts that vanished follow those of the kept one
    let is_own = |v: &&PrimitiveVertex| faces.iter().flatten().any(|&i| tom.vertices[i as usize].core == v.core);
    let part: Vec<PrimitiveVertex> = tom.vertices.iter().take_while(is_own).copied().collect();
    let [low, high] = around(part.iter().map(|v| v.core))?;
    let beyond: Vec<BVec3> = part.iter().map(|v| v.core.cmpgt(0.5 * (low + high))).collect();
    let flat = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| beyond[i as usize].bitmask());
        a != b && b != c && c != a && (!(a ^ b) & !(b ^ c)) & 0b111 != 0
    };
    let [low, high] = around(tom.vertices.iter().map(|v| v.core))
        .filter(|_| faces.len() == TRIANGLES as usize && faces.iter().all(flat))?;
    let corner =
        |(v, beyond): (&PrimitiveVertex, &BVec3)| PrimitiveVertex { core: Vec3::select(*beyond, high, low), ..*v };
    let corners: Vec<PrimitiveVertex> = part.iter().zip(&beyond).map(corner).collect();
    let vertices = part.len() as u32;
    let own = |i: u32| i | tom.substitutes[i as usize] & SAME_PLACE;
    let boxed: Vec<u32> = (0..vertices).map(own).collect();
    let later = tom.substitutes[vertices as usize..].iter().map(|s| s + vertices);
    *tom.substitutes = boxed.iter().chain(&boxed).copied().chain(later).collect();
    tom.vertices.splice(0..0, corners);
    tom.triangles.iter_mut().for_each(|t| *t = t.map(|i| i + vertices));
    Some(vertices)
}
