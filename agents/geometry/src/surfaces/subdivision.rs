//! Division of a triangle mesh, so that no edge is longer than wanted.
//!
//! In: a surface, a length. Out: the same surface in more triangles. Never here: smoothing, a point that leaves its surface.

use crate::Triangles;
use std::collections::HashMap;

/// The midpoints of the edges that are divided, by the ends of those, the lesser first.
type Midpoints = HashMap<[u32; 2], u32>;

/// The surface with edges of at most `longest_m` metres: longer ones are halved, on both sides alike, until there are none, or as many
/// triangles as `triangles_max`. Points stay and keep their numbers; new ones follow, in the middles of edges. A closed
/// surface stays closed.
#[must_use]
pub fn subdivided(surface: &Triangles, longest_m: f64, triangles_max: usize) -> Triangles {
    let Triangles { mut points, mut triangles } = surface.clone();
    while triangles.len() < triangles_max {
        let mut midpoints = Midpoints::new();
        for [a, b] in triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]) {
            let (from, to) = (points[a as usize], points[b as usize]);
            if from.distance_squared(to) > longest_m * longest_m {
                midpoints.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    points.push(from.midpoint(to));
                    points.len() as u32 - 1
                });
            }
        }
        if midpoints.is_empty() {
            break;
        }
        let mut parts = Vec::with_capacity(2 * triangles.len());
        for triangle in &triangles {
            divide(*triangle, &midpoints, |a, b| points[a as usize].distance_squared(points[b as usize]), &mut parts);
        }
        triangles = parts;
    }
    Triangles { points, triangles }
}

/// Adds the parts of a triangle; of a quadrangle that is left the shorter diagonal, by `apart`, becomes an edge.
fn divide([a, b, c]: [u32; 3], midpoints: &Midpoints, apart: impl Fn(u32, u32) -> f64, parts: &mut Vec<[u32; 3]>) {
    let middle = |a: u32, b: u32| midpoints.get(&[a.min(b), a.max(b)]).copied();
    match [middle(a, b), middle(b, c), middle(c, a)] {
        [None, None, None] => parts.push([a, b, c]),
        [Some(ab), Some(bc), Some(ca)] => parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
        [Some(ab), None, None] => parts.extend([[a, ab, c], [ab, b, c]]),
        [None, Some(bc), Some(ca)] => {
            parts.push([ca, bc, c]);
            let shorter = apart(a, bc) <= apart(b, ca);
            parts.extend(if shorter { [[a, b, bc], [a, bc, ca]] } else { [[a, b, ca], [b, bc, ca]] });
        }
        // one of these, begun at another corner
        [_, Some(_), None] | [_, None, Some(_)] => divide([b, c, a], midpoints, apart, parts),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::is_closed;
    use glam::DVec3;

    fn longest_m(surface: &Triangles) -> f64 {
        let at = |i: u32| surface.points[i as usize];
        let edges = surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|[a, b]| at(a).distance(at(b))).fold(0.0, f64::max)
    }

    fn area_m2(surface: &Triangles) -> f64 {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| surface.points[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        surface.triangles.iter().map(of).sum()
    }

    /// A tetrahedron of unlike edges.
    fn wedge(height_m: f64) -> Triangles {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y * 0.3, DVec3::new(0.2, 0.1, height_m)];
        Triangles { points, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] }
    }

    #[test]
    fn a_divided_surface_is_the_same_surface_closed_in_short_edges() {
        for height_m in [1.0, 0.01] {
            for wanted_m in [0.7, 0.11, 0.04] {
                let (whole, fine) = (wedge(height_m), subdivided(&wedge(height_m), wanted_m, 100_000));
                assert!(longest_m(&fine) <= wanted_m, "{} m of {wanted_m} m", longest_m(&fine));
                assert!(is_closed(&fine) && fine.points[..4] == whole.points);
                assert!((fine.volume_m3() / whole.volume_m3() - 1.0).abs() < 1e-9);
                assert!((area_m2(&fine) / area_m2(&whole) - 1.0).abs() < 1e-9);
                // equilateral triangles of such edges would be as many, and no more than a few times as many are made
                let fewest = area_m2(&whole) / (0.433 * wanted_m * wanted_m);
                assert!((fine.triangles.len() as f64) < 12.0 * fewest + 16.0, "{} of {fewest}", fine.triangles.len());
            }
        }
    }

    #[test]
    fn what_is_short_stays_and_what_would_be_too_many_ends() {
        let whole = wedge(1.0);
        assert_eq!(subdivided(&whole, 2.0, 100).triangles, whole.triangles);
        let most = subdivided(&whole, 1e-6, 1000).triangles.len();
        assert!((1000..=4000).contains(&most), "{most}");
    }
}
