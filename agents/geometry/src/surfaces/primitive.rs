//! Meshes of solids at every level n: ball, box, capsule, cylinder, jaw; hulls and meshes unchanged.
//!
//! In: a primitive and its level. Out: vertices with normals, triangles, counts for cost models.
//! Never here: the solid's pose, the GPU. Ball, box, capsule and cylinder are one shape, a core swept by a ball (`position = core · extents
//! + normal · radius`), so one mesh per level serves every size of that primitive.

use super::patch::sides;
use crate::Solid;
use crate::solids::tool;
use glam::{Vec2, Vec3};
use std::f64::consts::FRAC_PI_4;

/// A corner of a primitive, independent of its size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrimitiveVertex {
    /// Position on the core, to be multiplied by [`Rounding::extents`].
    pub core: Vec3,
    /// Unit normal outward; the corner is [`Rounding::radius_m`] along it from the core.
    pub normal: Vec3,
    /// Texture coordinates: 0 … 1 across and down, repeating; 0 where there are none.
    pub uv: Vec2,
}

impl PrimitiveVertex {
    /// A corner without texture coordinates.
    #[must_use]
    pub const fn bare(core: Vec3, normal: Vec3) -> Self {
        Self { core, normal, uv: Vec2::ZERO }
    }
}

/// A triangle mesh with normals; triangles are counter-clockwise seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PrimitiveMesh {
    /// Corners.
    pub vertices: Vec<PrimitiveVertex>,
    /// Corner indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// The size of a primitive: `position = core · extents + normal · radius`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// Half extents of the core, metres, ≥ 0; a factor for meshes, whose core is in metres.
    pub extents: Vec3,
    /// Radius of the ball swept over the core, metres, ≥ 0.
    pub radius_m: f32,
}

/// A family of meshes, one per level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Primitive {
    /// A ball; its core is a point.
    Ball,
    /// A box; from level 1 on its edges are slightly rounded, as real ones are, and catch the light.
    Box,
    /// A capsule along z; its core is a line.
    Capsule,
    /// A cylinder along z; from level 1 on its rims are slightly rounded.
    Cylinder,
    /// One jaw of a grasper, from its hinge along +z, closing towards −x; 1 long.
    Jaw,
}

/// Rounding of a box or cylinder, as a fraction of its smallest half extent.
const BEVEL: f64 = 0.08;

/// Quads along a quarter-turn pair (a face of the ball) at level n, close to 2·2^(n/2).
const fn ball_divisions(n: u8) -> u32 {
    if n.is_multiple_of(2) { 2 << (n / 2) } else { 3 << (n / 2) }
}

/// The same for a capsule, whose faces are split in the middle.
const fn capsule_divisions(n: u8) -> u32 {
    ball_divisions(n).next_multiple_of(2)
}

/// Quads across a rounded edge at level n.
const fn bevel_divisions(n: u8) -> u32 {
    match n {
        0 => 0,
        1..=3 => 1,
        _ => 2,
    }
}

impl Primitive {
    /// The primitive and size of a solid; `None` for a plane, a hull, a mesh and a compound.
    #[must_use]
    pub fn of(solid: &Solid, n: u8) -> Option<(Self, Rounding)> {
        let shrink = |half: f64, bevel: f64| (half - bevel) as f32;
        match *solid {
            Solid::Ball { radius_m } => Some((Self::Ball, Rounding { extents: Vec3::ZERO, radius_m: radius_m as f32 })),
            Solid::Box { half_extents_m: h } => {
                let bevel = if n == 0 { 0.0 } else { BEVEL * h.min_element() };
                let extents = Vec3::new(shrink(h.x, bevel), shrink(h.y, bevel), shrink(h.z, bevel));
                Some((Self::Box, Rounding { extents, radius_m: bevel as f32 }))
            }
            Solid::Capsule { radius_m, half_height_m } => {
                let extents = Vec3::new(0.0, 0.0, half_height_m as f32);
                Some((Self::Capsule, Rounding { extents, radius_m: radius_m as f32 }))
            }
            Solid::Cylinder { radius_m, half_height_m } => {
                let bevel = if n == 0 { 0.0 } else { BEVEL * radius_m.min(half_height_m) };
                let r = shrink(radius_m, bevel);
                let extents = Vec3::new(r, r, shrink(half_height_m, bevel));
                Some((Self::Cylinder, Rounding { extents, radius_m: bevel as f32 }))
            }
            Solid::Plane | Solid::Hull { .. } | Solid::Mesh { .. } | Solid::Compound { .. } => None,
        }
    }

    /// Triangles of level `n`, O(2ⁿ).
    #[must_use]
    pub const fn triangles(self, n: u8) -> u32 {
        match self {
            Self::Ball => 12 * ball_divisions(n) * ball_divisions(n),
            Self::Box => {
                let quads = 2 * bevel_divisions(n) + 1;
                12 * quads * quads
            }
            Self::Capsule => {
                let m = capsule_divisions(n);
                12 * m * m + 8 * m
            }
            Self::Cylinder => sides(n) * (4 + 4 * bevel_divisions(n)),
            Self::Jaw => tool::jaw_triangles(n),
        }
    }

    /// The mesh of level `n`.
    #[must_use]
    pub fn mesh(self, n: u8) -> PrimitiveMesh {
        match self {
            Self::Ball => {
                let round = round_lines(ball_divisions(n));
                swept_box(&[&round, &round, &round])
            }
            Self::Box => {
                let split = split_lines(bevel_divisions(n));
                swept_box(&[&split, &split, &split])
            }
            Self::Capsule => {
                let m = capsule_divisions(n);
                let round = round_lines(m);
                swept_box(&[&round, &round, &split_lines(m / 2)])
            }
            Self::Cylinder => cylinder(sides(n), bevel_divisions(n)),
            Self::Jaw => tool::jaw(n),
        }
    }
}

/// One line of a face's grid: the side of the core it belongs to (−1, 0, 1), and the tangent of the normal's angle.
#[derive(Clone, Copy)]
struct GridLine {
    side: f32,
    lean: f64,
}

/// Lines across a face of a ball: an eighth of a turn to either side of its centre.
fn round_lines(divisions: u32) -> Vec<GridLine> {
    let lean = |i: u32| lean_at(2.0 * f64::from(i) / f64::from(divisions) - 1.0);
    (0..=divisions).map(|i| GridLine { side: 0.0, lean: lean(i) }).collect()
}

/// Lines across a face with a straight part: `divisions` quads of rounding before and after it.
fn split_lines(divisions: u32) -> Vec<GridLine> {
    let turned = |i: u32| if divisions == 0 { 0.0 } else { lean_at(f64::from(i) / f64::from(divisions)) };
    let before = (0..=divisions).rev().map(|i| GridLine { side: -1.0, lean: -turned(i) });
    before.chain((0..=divisions).map(|i| GridLine { side: 1.0, lean: turned(i) })).collect()
}

/// Tangent of `share` of 45°; exactly ±1 at the ends, so that neighbouring faces share their border bit for bit.
fn lean_at(share: f64) -> f64 {
    if share.abs() == 1.0 { share } else { libm::tan(share * FRAC_PI_4) }
}

/// Six faces of a cube, each a grid, with the normals of the knots.
fn swept_box(lines: &[&[GridLine]; 3]) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    for axis in 0..3 {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-1.0, 1.0] {
            let first = mesh.vertices.len() as u32;
            for p in lines[i] {
                for q in lines[j] {
                    let (mut core, mut lean) = (Vec3::ZERO, glam::DVec3::ZERO);
                    (core[axis], core[i], core[j]) = (side, p.side, q.side);
                    (lean[axis], lean[i], lean[j]) = (f64::from(side), p.lean, q.lean);
                    mesh.vertices.push(PrimitiveVertex::bare(core, lean.normalize().as_vec3()));
                }
            }
            grid(&mut mesh.triangles, first, lines[i].len() as u32, lines[j].len() as u32, side < 0.0);
        }
    }
    mesh
}

/// Triangles of a grid of `rows` × `columns` corners numbered from `first`.
fn grid(triangles: &mut Vec<[u32; 3]>, first: u32, rows: u32, columns: u32, flip: bool) {
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let a = first + row * columns + column;
            let (b, c, d) = (a + columns, a + columns + 1, a + 1);
            let quad = if flip { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
            triangles.extend(quad);
        }
    }
}

/// A cylinder along z: caps, rims of `bevel` quads, a wall.
fn cylinder(sides: u32, bevel: u32) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    let ring = |mesh: &mut PrimitiveMesh, z: f32, tilt: f64| {
        let first = mesh.vertices.len() as u32;
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            let (out, up) = (libm::cos(tilt), libm::sin(tilt));
            let normal = glam::DVec3::new(cos * out, sin * out, up).as_vec3();
            mesh.vertices.push(PrimitiveVertex::bare(Vec3::new(cos as f32, sin as f32, z), normal));
        }
        first
    };
    let tilt = |i: u32| if bevel == 0 { 0.0 } else { 2.0 * FRAC_PI_4 * f64::from(i) / f64::from(bevel) };
    // rings from the bottom's rim up to the top's, joined; then the two caps with their own flat normals
    let mut rings = Vec::new();
    rings.extend((0..=bevel).rev().map(|i| ring(&mut mesh, -1.0, -tilt(i))));
    rings.extend((0..=bevel).map(|i| ring(&mut mesh, 1.0, tilt(i))));
    for pair in rings.windows(2) {
        for side in 0..sides {
            let next = (side + 1) % sides;
            let (a, b, c, d) = (pair[0] + side, pair[0] + next, pair[1] + next, pair[1] + side);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    for z in [-1.0_f32, 1.0] {
        let rim = ring(&mut mesh, z, f64::from(z) * 2.0 * FRAC_PI_4);
        let middle = mesh.vertices.len() as u32;
        mesh.vertices.push(PrimitiveVertex::bare(Vec3::new(0.0, 0.0, z), Vec3::new(0.0, 0.0, z)));
        for side in 0..sides {
            let (a, b) = (rim + side, rim + (side + 1) % sides);
            mesh.triangles.push(if z > 0.0 { [middle, a, b] } else { [middle, b, a] });
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::collections::HashMap;
    use std::f64::consts::PI;

    fn solids() -> [Solid; 4] {
        [
            Solid::Ball { radius_m: 0.3 },
            Solid::Box { half_extents_m: DVec3::new(0.1, 0.2, 0.3) },
            Solid::Capsule { radius_m: 0.1, half_height_m: 0.25 },
            Solid::Cylinder { radius_m: 0.2, half_height_m: 0.3 },
        ]
    }

    fn corners(solid: &Solid, n: u8) -> (Vec<Vec3>, PrimitiveMesh) {
        let (primitive, size) = Primitive::of(solid, n).unwrap();
        let mesh = primitive.mesh(n);
        (mesh.vertices.iter().map(|v| v.core * size.extents + v.normal * size.radius_m).collect(), mesh)
    }

    /// Area and volume of a closed mesh.
    fn measure(places: &[Vec3], mesh: &PrimitiveMesh) -> (f64, f64) {
        mesh.triangles.iter().fold((0.0, 0.0), |(area, volume), t| {
            let [a, b, c] = t.map(|i| places[i as usize].as_dvec3());
            (area + 0.5 * (b - a).cross(c - a).length(), volume + a.dot(b.cross(c)) / 6.0)
        })
    }

    #[test]
    fn triangle_counts_are_as_documented() {
        for primitive in [Primitive::Ball, Primitive::Box, Primitive::Capsule, Primitive::Cylinder, Primitive::Jaw] {
            for n in 0..=metachron_core::N_MAX {
                let mesh = primitive.mesh(n);
                assert_eq!(mesh.triangles.len() as u32, primitive.triangles(n), "{primitive:?} level {n}");
                assert!(mesh.vertices.len() <= 1 << 16, "{primitive:?} level {n}");
            }
        }
    }

    #[test]
    fn meshes_are_closed() {
        for solid in solids() {
            for n in 0..=4 {
                let (places, mesh) = corners(&solid, n);
                // corners count as equal if they coincide to a millionth of the size (f32 rounding of two sums)
                let key = |i: u32| (places[i as usize] * 1e5).round().as_ivec3().to_array();
                let mut edges: HashMap<_, i32> = HashMap::new();
                for [a, b, c] in &mesh.triangles {
                    for (p, q) in [(key(*a), key(*b)), (key(*b), key(*c)), (key(*c), key(*a))] {
                        if p != q {
                            *edges.entry((p.min(q), p.max(q))).or_default() += if p < q { 1 } else { -1 };
                        }
                    }
                }
                assert!(edges.values().all(|&sum| sum == 0), "{solid:?} level {n} has a hole");
            }
        }
    }

    #[test]
    fn finest_meshes_have_the_area_and_volume_of_their_solids() {
        let closed = [
            (4.0 * PI * 0.09, 4.0 / 3.0 * PI * 0.027),
            (8.0 * (0.02 + 0.03 + 0.06), 8.0 * 0.006),
            (4.0 * PI * 0.01 + 2.0 * PI * 0.1 * 0.5, 4.0 / 3.0 * PI * 0.001 + PI * 0.01 * 0.5),
            (2.0 * PI * 0.04 + 2.0 * PI * 0.2 * 0.6, PI * 0.04 * 0.6),
        ];
        for (solid, (area, volume)) in solids().iter().zip(closed) {
            let (places, mesh) = corners(solid, 8);
            let (a, v) = measure(&places, &mesh);
            // a bevel of 8 % of the smallest half extent removes less than 2 %; tessellation of level 8 less than 0.1 %
            assert!((a / area - 1.0).abs() < 0.02, "{solid:?}: area {a} of {area}");
            assert!((v / volume - 1.0).abs() < 0.02, "{solid:?}: volume {v} of {volume}");
        }
    }

    #[test]
    fn normals_are_units_and_point_out() {
        for solid in solids() {
            for n in 0..=5 {
                let (places, mesh) = corners(&solid, n);
                assert!(mesh.vertices.iter().all(|v| (v.normal.length() - 1.0).abs() < 1e-6));
                for t in &mesh.triangles {
                    let [a, b, c] = t.map(|i| places[i as usize]);
                    let face = (b - a).cross(c - a);
                    let mean: Vec3 = t.iter().map(|&i| mesh.vertices[i as usize].normal).sum();
                    // slivers without area have no orientation
                    assert!(face.length() < 1e-9 || face.dot(mean) > 0.0, "{solid:?} level {n}");
                }
            }
        }
    }
}
