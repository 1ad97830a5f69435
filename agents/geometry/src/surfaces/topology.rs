//! The edges of a triangle mesh: whether the mesh is closed, and where more than two triangles share an edge.
//!
//! In: points and triangles. Out: the finding. Never here: its consequences.
//! Coincident points count as one: a seam of doubled points (for texture coordinates, for normals) neither opens a surface nor hides a
//! branch. Triangles without an area are ignored.

use crate::Triangles;
use glam::DVec3;
use std::collections::HashMap;

/// An edge that more than two triangles share: there the surface branches, and no longer has two sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Branch {
    /// Index of the first surplus triangle, from 0.
    pub triangle: usize,
    /// Its corners at the ends of the edge.
    pub corners: [u32; 2],
    /// Number of triangles that share the edge.
    pub sharing: usize,
}

/// A triangle on one of its edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    object: u32,
    /// The ends of the edge, by index among distinct points, the lesser first.
    edge: [u32; 2],
    triangle: u32,
    /// Whether the triangle traverses it from the lesser to the greater.
    forward: bool,
}

/// The first edge, in the order of the triangles, that more than two triangles of one object share. All corner indices must exist.
///
/// `object_of` returns the object of a triangle: objects that touch each other along an edge do not branch.
/// Every triangle counts, duplicates too: a sheet with one copy of its faces for each side branches along every inner edge.
#[must_use]
pub fn branch(points: &[DVec3], triangles: &[[u32; 3]], object_of: impl Fn(usize) -> u32) -> Option<Branch> {
    let place = places(points);
    let sides = sides(points, &place, triangles, object_of);
    let shared = sides.chunk_by(same_edge).filter(|sharing| sharing.len() > 2);
    let first = shared.min_by_key(|sharing| sharing[2].triangle)?;
    let Side { edge, triangle, .. } = first[2];
    let corners = triangles[triangle as usize];
    let at = |end: u32| corners.into_iter().find(|&i| place[i as usize] == end).unwrap_or(end);
    Some(Branch { triangle: triangle as usize, corners: edge.map(at), sharing: first.len() })
}

/// Whether every edge has equally many triangles in either direction.
pub fn is_closed(mesh: &Triangles) -> bool {
    open_edge(mesh).is_none()
}

fn same_edge(a: &Side, b: &Side) -> bool {
    (a.object, a.edge) == (b.object, b.edge)
}

/// An edge with a triangle on one side alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenEdge {
    /// The first such triangle, from 0.
    pub triangle: usize,
    /// Its corners at the ends of the edge.
    pub corners: [u32; 2],
}

/// The first open edge in the order of the triangles, or one that two triangles traverse in the same direction: `None` for a closed surface.
#[must_use]
pub fn open_edge(surface: &Triangles) -> Option<OpenEdge> {
    let place = places(&surface.points);
    let sides = sides(&surface.points, &place, &surface.triangles, |_| 0);
    let balanced = |sharing: &[Side]| 2 * sharing.iter().filter(|side| side.forward).count() == sharing.len();
    let open = sides.chunk_by(same_edge).filter(|sharing| !balanced(sharing)).map(|sharing| sharing[0]);
    let Side { edge, triangle, .. } = open.min_by_key(|side| side.triangle)?;
    let corners = surface.triangles[triangle as usize];
    let at = |end: u32| corners.into_iter().find(|&i| place[i as usize] == end).unwrap_or(end);
    Some(OpenEdge { triangle: triangle as usize, corners: edge.map(at) })
}

/// The first triangle that goes along an edge in the direction in which another does: the two face opposite ways. `None` where all agree, as
/// they cannot on a surface with one side.
#[must_use]
pub fn opposed(surface: &Triangles) -> Option<usize> {
    let place = places(&surface.points);
    let sides = sides(&surface.points, &place, &surface.triangles, |_| 0);
    let against = sides.chunk_by(same_edge).filter_map(|sharing| {
        let second = |forward: bool| sharing.iter().filter(|side| side.forward == forward).nth(1);
        second(true).into_iter().chain(second(false)).map(|side| side.triangle as usize).min()
    });
    against.min()
}

/// How many separate pieces a surface has: triangles that share a point, or coincident ones, belong to one piece.
#[must_use]
pub fn pieces(surface: &Triangles) -> usize {
    let place = places(&surface.points);
    let mut parent: Vec<u32> = (0..surface.points.len() as u32).collect();
    let root = |parent: &mut Vec<u32>, mut at: u32| {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    };
    for t in &surface.triangles {
        let [a, b, c] = t.map(|corner| root(&mut parent, place[corner as usize]));
        parent[b as usize] = a;
        let c = root(&mut parent, c);
        parent[c as usize] = root(&mut parent, a);
    }
    let used = surface.triangles.iter().flatten().map(|corner| root(&mut parent, place[*corner as usize]));
    used.collect::<std::collections::BTreeSet<_>>().len()
}

/// The surface with one point for all that coincide, without points that no triangle has, and without triangles that have no area.
#[must_use]
pub fn welded(surface: &Triangles) -> Triangles {
    let place = places(&surface.points);
    let mut number = HashMap::new();
    let mut points = vec![];
    let mut triangles = vec![];
    for t in &surface.triangles {
        let [a, b, c] = t.map(|corner| surface.points[place[corner as usize] as usize]);
        if (b - a).cross(c - a) == DVec3::ZERO {
            continue;
        }
        triangles.push(t.map(|corner| {
            *number.entry(place[corner as usize]).or_insert_with(|| {
                points.push(surface.points[corner as usize]);
                points.len() as u32 - 1
            })
        }));
    }
    Triangles { points, triangles }
}

/// For each point the index of the first coincident one.
pub(crate) fn places(points: &[DVec3]) -> Vec<u32> {
    let mut first_at = HashMap::with_capacity(points.len());
    // adding zero makes -0.0 equal to 0.0
    let bits = |p: &DVec3| (*p + DVec3::ZERO).to_array().map(f64::to_bits);
    (0..).zip(points).map(|(i, p)| *first_at.entry(bits(p)).or_insert(i)).collect()
}

/// The sides of all triangles with an area, sorted by object and edge, then by triangle.
fn sides(points: &[DVec3], place: &[u32], triangles: &[[u32; 3]], object_of: impl Fn(usize) -> u32) -> Vec<Side> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (number, t) in triangles.iter().enumerate() {
        let [a, b, c] = t.map(|i| points[i as usize]);
        if (b - a).cross(c - a) == DVec3::ZERO {
            continue;
        }
        let [a, b, c] = t.map(|i| place[i as usize]);
        let (object, triangle) = (object_of(number), number as u32);
        let side = |(a, b): (u32, u32)| Side { object, edge: [a.min(b), a.max(b)], triangle, forward: a < b };
        sides.extend([(a, b), (b, c), (c, a)].map(side));
    }
    sides.sort_unstable();
    sides
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hull_triangles;

    /// The branch of triangles that all belong to one object.
    fn branch(points: &[DVec3], triangles: &[[u32; 3]]) -> Option<Branch> {
        super::branch(points, triangles, |_| 0)
    }

    fn corners() -> Vec<DVec3> {
        (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1))).collect()
    }

    #[test]
    fn a_box_of_triangles_is_closed_and_a_box_without_lid_is_not() {
        let hull = hull_triangles(&corners()).unwrap();
        assert!(is_closed(&hull));
        assert_eq!(branch(&hull.points, &hull.triangles), None);
        let mut open = hull;
        open.triangles.pop();
        assert!(!is_closed(&open));
        assert_eq!(branch(&open.points, &open.triangles), None);
    }

    #[test]
    fn a_third_triangle_on_an_edge_is_a_branch_with_its_name() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::NEG_Y, DVec3::Z];
        let fan = [[0, 1, 2], [1, 0, 3], [0, 1, 4], [4, 1, 0]];
        assert_eq!(branch(&points, &fan[..2]), None);
        assert_eq!(branch(&points, &fan), Some(Branch { triangle: 2, corners: [0, 1], sharing: 4 }));
        // a face that occurs three times shares its edges with itself
        let again = [[0, 1, 2], [1, 2, 0], [0, 2, 1]];
        assert_eq!(branch(&points, &again).unwrap().sharing, 3);
        // two objects that touch along an edge: two triangles each, no branch
        let touching = super::branch(&points, &fan, |t| u32::from(t > 1));
        assert_eq!(touching, None);
        // triangles without an area are ignored
        assert_eq!(branch(&points, &[[0, 1, 2], [1, 0, 3], [0, 1, 1], [1, 0, 0]]), None);
    }

    #[test]
    fn doubled_points_neither_open_a_surface_nor_hide_a_branch() {
        let hull = hull_triangles(&corners()).unwrap();
        let doubled = |mesh: &Triangles| Triangles {
            points: mesh.triangles.iter().flatten().map(|&i| mesh.points[i as usize]).collect(),
            triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        };
        let apart = doubled(&hull);
        assert!(is_closed(&apart) && branch(&apart.points, &apart.triangles).is_none());
        let mut fin = hull;
        fin.points.push(DVec3::splat(2.0));
        fin.triangles.push([fin.triangles[0][0], fin.triangles[0][1], 8]);
        let apart = doubled(&fin);
        let found = branch(&apart.points, &apart.triangles).unwrap();
        assert_eq!((found.triangle, found.corners, found.sharing), (12, [36, 37], 3));
    }
}
