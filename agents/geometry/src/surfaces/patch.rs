//! The cylinder patch that is bent over one interval of a tube, at every level n.
//!
//! In: the level n. Out: vertices as (u along, angle around) and triangles; counts as const functions for cost models.
//! Never here: positions in space: the renderer bends the patch between two `SkinFrame`s of `metachron-drawable`.
//! Level n has 6·2^⌈n/2⌉ sides and 2^⌊n/2⌋ rings, so 12·2ⁿ triangles: the O(2ⁿ) of (GDC04).

/// One vertex of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchVertex {
    /// Along the interval, 0 … 1.
    pub u: f32,
    /// Around the tube, 0 … 1; the seam's vertices are doubled, at 0 and 1.
    pub turn: f32,
    /// Cosine of the angle; exactly equal on both sides of the seam.
    pub cos: f32,
    /// Sine of the angle; exactly equal on both sides of the seam.
    pub sin: f32,
}

/// Sides around: 6·2^⌈n/2⌉.
#[must_use]
pub const fn sides(n: u8) -> u32 {
    6 << n.div_ceil(2)
}

/// Rings of quads along one interval: 2^⌊n/2⌋.
#[must_use]
pub const fn rings(n: u8) -> u32 {
    1 << (n / 2)
}

/// Triangles of one patch: 12·2ⁿ.
#[must_use]
pub const fn triangles(n: u8) -> u32 {
    2 * sides(n) * rings(n)
}

/// Vertices of one patch; those of the seam are doubled.
#[must_use]
pub const fn vertices(n: u8) -> u32 {
    (sides(n) + 1) * (rings(n) + 1)
}

/// The vertices of level `n`, ring by ring.
#[must_use]
pub fn patch_vertices(n: u8) -> Vec<PatchVertex> {
    let (sides, rings) = (sides(n), rings(n));
    let row = move |ring: u32| {
        let u = ring as f32 / rings as f32;
        (0..=sides).map(move |side| {
            let angle = std::f64::consts::TAU * f64::from(side % sides) / f64::from(sides);
            let (sin, cos) = (libm::sin(angle) as f32, libm::cos(angle) as f32);
            PatchVertex { u, turn: side as f32 / sides as f32, cos, sin }
        })
    };
    (0..=rings).flat_map(row).collect()
}

/// The triangles of level `n`, counter-clockwise seen from outside when u runs along the tangent and the angle from the normal
/// to tangent × normal.
#[must_use]
pub fn patch_triangles(n: u8) -> Vec<[u16; 3]> {
    let stride = sides(n) + 1;
    let corner = |ring: u32, side: u32| u16::try_from(ring * stride + side).expect("N_MAX keeps a patch in 16 bits");
    let quad = |ring: u32, side: u32| {
        let (a, b) = (corner(ring, side), corner(ring, side + 1));
        let (c, d) = (corner(ring + 1, side), corner(ring + 1, side + 1));
        [[a, b, d], [a, d, c]]
    };
    (0..rings(n)).flat_map(|ring| (0..sides(n)).flat_map(move |side| quad(ring, side))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::N_MAX;
    use std::collections::HashMap;

    #[test]
    fn counts_are_as_documented_at_every_level() {
        for n in 0..=N_MAX {
            assert_eq!(triangles(n), 12 << n, "level {n}");
            assert_eq!(patch_triangles(n).len(), triangles(n) as usize);
            assert_eq!(patch_vertices(n).len(), vertices(n) as usize);
        }
    }

    #[test]
    fn patch_is_closed_around_and_open_at_its_ends() {
        for n in 0..=5 {
            let stride = sides(n) + 1;
            // the two columns of the seam coincide
            let place = |v: u16| (u32::from(v) / stride, u32::from(v) % stride % sides(n));
            let mut edges: HashMap<_, i32> = HashMap::new();
            for [a, b, c] in patch_triangles(n) {
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    let (p, q) = (place(p), place(q));
                    *edges.entry((p.min(q), p.max(q))).or_default() += if p < q { 1 } else { -1 };
                }
            }
            for ((p, q), sum) in edges {
                // an inner edge is traversed once in each direction; the rims at the ends only once
                let rim = p.0 == q.0 && (p.0 == 0 || p.0 == rings(n));
                assert_eq!(sum != 0, rim, "level {n}: {p:?} {q:?}");
            }
        }
    }

    #[test]
    fn triangles_face_outward() {
        let vertices = patch_vertices(3);
        // tangent z, normal x, so angle runs from x to y
        let place = |v: u16| {
            let p = vertices[v as usize];
            glam::Vec3::new(p.cos, p.sin, p.u)
        };
        for [a, b, c] in patch_triangles(3) {
            let (a, b, c) = (place(a), place(b), place(c));
            let outward = (a + b + c) * glam::Vec3::new(1.0, 1.0, 0.0);
            assert!((b - a).cross(c - a).dot(outward) > 0.0);
        }
    }
}
