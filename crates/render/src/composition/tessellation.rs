//! Curved patches over the triangles of a skin: at level n each is divided into about 2ⁿ.
//!
//! In: triangles of corners with normals, and their edges. Out: points with normals, and smaller triangles. Never here: which corners share
//! a normal ([`super::skin`]), the choice of n. Theory: docs/theory/soft.md, section 8; curved PN triangles (VPBM01).
//!
//! Both triangles at an edge take its points from one cubic, also where it is sharp and their normals differ: no gap opens.
//! Nothing is allocated once sizes settle.

use super::mesh_corner::MeshCorner;
use glam::{DVec3, Vec3};

/// No triangle on this side of an edge.
const NONE: u32 = u32::MAX;

/// Into how many parts level `n` divides each side of a triangle of a skin: the square is nearest to 2ⁿ.
#[must_use]
pub const fn skin_divisions(n: u8) -> u32 {
    (1_u32 << (n + 2)).isqrt().div_ceil(2)
}

/// The edges of a skin; they never change.
#[derive(Debug, Clone, Default)]
pub(crate) struct SkinEdges {
    edges: Vec<Edge>,
    /// The edges of each triangle: from its first corner to its second, and so on.
    of_triangle: Vec<[u32; 3]>,
}

/// An edge of one triangle or two.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Its vertices, the lesser first.
    ends: [u32; 2],
    triangles: [u32; 2],
}

/// A point of a skin with its normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct SkinPoint {
    pub position: DVec3,
    pub normal: DVec3,
    /// The same point at rest.
    pub rest: RestPoint,
}

/// A point of a skin at rest, in the body's own axes, with its normal of any length: where tissue's texture lies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RestPoint {
    position: Vec3,
    normal: Vec3,
}

impl RestPoint {
    pub fn of(corner: &MeshCorner) -> Self {
        Self { position: corner.core.into(), normal: corner.normal.into() }
    }

    pub fn corner(&self) -> MeshCorner {
        let normal = self.normal.normalize_or(Vec3::Z);
        MeshCorner { core: self.position.to_array(), normal: normal.to_array(), uv: [0.0; 2] }
    }

    /// The point with these shares of some points: texture lies on the triangle, not on the patch over it.
    fn between<const N: usize>(points: [Self; N], shares: [f64; N]) -> Self {
        points.iter().zip(shares).fold(Self::default(), |sum, (point, share)| Self {
            position: sum.position + point.position * share as f32,
            normal: sum.normal + point.normal * share as f32,
        })
    }
}

/// A skin to be divided.
#[derive(Debug, Clone, Copy)]
pub(super) struct CoarseSkin<'a> {
    pub edges: &'a SkinEdges,
    /// Vertices of its triangles.
    pub vertices: &'a [[u32; 3]],
    /// The same triangles by their corners: a vertex has a corner for each of the surfaces that meet there.
    pub corners: &'a [[u32; 3]],
    /// Into how many parts each side is divided, ≥ 1.
    pub parts: u32,
}

/// The points of an edge between its ends, for one of its triangles.
#[derive(Debug, Clone, Copy, Default)]
struct Strip {
    /// The corners at its ends.
    corners: [u32; 2],
    /// The first of its points.
    from: u32,
}

/// A divided skin.
#[derive(Debug, Default)]
pub(super) struct FineSkin {
    /// The corners that it was made from, then the points between them.
    pub points: Vec<SkinPoint>,
    pub triangles: Vec<[u32; 3]>,
    /// The sides that belong to one triangle alone, each in the direction of its triangle.
    pub rim: Vec<[u32; 2]>,
    strips: Vec<[Strip; 2]>,
    /// The two inner control points of each edge, nearest to its lesser end first.
    controls: Vec<[DVec3; 2]>,
    /// The numbers of the points of one triangle, row by row.
    grid: Vec<u32>,
}

impl SkinEdges {
    /// The edges of these triangles of vertices.
    pub fn of(triangles: &[[u32; 3]]) -> Self {
        let numbered = || (0..).zip(triangles);
        let sides = numbered().flat_map(|(t, &[a, b, c])| [[a, b], [b, c], [c, a]].map(|ends| (sorted(ends), t)));
        let mut sides: Vec<([u32; 2], u32)> = sides.collect();
        sides.sort_unstable();
        let edges = sides.chunk_by(|one, other| one.0 == other.0).map(|sharing| Edge {
            ends: sharing[0].0,
            triangles: [sharing[0].1, sharing.get(1).map_or(NONE, |side| side.1)],
        });
        let edges: Vec<Edge> = edges.collect();
        let number = |ends: [u32; 2]| edges.partition_point(|edge| edge.ends < sorted(ends)) as u32;
        let of_triangle = triangles.iter().map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(number)).collect();
        Self { edges, of_triangle }
    }
}

const fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// The inner control point, nearest to `from`, of a cubic from there that leaves along the surface with its normal.
fn control(from: SkinPoint, to: DVec3) -> DVec3 {
    let way = to - from.position;
    from.position + (way - from.normal * way.dot(from.normal)) / 3.0
}

/// The normal between two points: the middle normal of a parabola that meets both normals (VPBM01, eq. 8).
fn middle_normal(a: SkinPoint, b: SkinPoint) -> DVec3 {
    let (way, sum) = (b.position - a.position, a.normal + b.normal);
    let length = way.length_squared();
    let across = if length > 0.0 { 2.0 * way.dot(sum) / length } else { 0.0 };
    (sum - way * across).normalize_or(sum.normalize_or(a.normal))
}

impl FineSkin {
    /// Divides a skin whose corners are already in the list of points.
    pub fn divide(&mut self, skin: CoarseSkin<'_>) {
        self.triangles.clear();
        self.rim.clear();
        self.strips.clear();
        self.controls.clear();
        for edge in &skin.edges.edges {
            self.divide_edge(skin, edge);
        }
        for triangle in 0..skin.corners.len() {
            self.divide_triangle(skin, triangle);
        }
    }

    /// Adds the points of an edge: one strip where both its triangles have the same corners, else one each at the same places.
    fn divide_edge(&mut self, skin: CoarseSkin<'_>, edge: &Edge) {
        let parts = skin.parts;
        let corners_of = |triangle: u32| {
            let [vertices, corners] = [skin.vertices, skin.corners].map(|list| list[triangle as usize]);
            edge.ends.map(|end| (0..3).find(|k| vertices[*k] == end).map_or(0, |k| corners[k]))
        };
        let first = corners_of(edge.triangles[0]);
        let second = if edge.triangles[1] == NONE { first } else { corners_of(edge.triangles[1]) };
        let ends = [first, second].map(|corners| corners.map(|corner| self.points[corner as usize]));
        let [a, b] = [0, 1].map(|end| {
            let of = |ends: &[SkinPoint; 2]| control(ends[end], ends[1 - end].position);
            0.5 * (of(&ends[0]) + of(&ends[1]))
        });
        self.controls.push([a, b]);
        let mut strip = |corners: [u32; 2], ends: [SkinPoint; 2]| {
            let from = self.points.len() as u32;
            let middle = middle_normal(ends[0], ends[1]);
            for part in 1..parts {
                let u = f64::from(part) / f64::from(parts);
                let v = 1.0 - u;
                let position =
                    ends[0].position * (v * v * v) + (a * v + b * u) * (3.0 * u * v) + ends[1].position * (u * u * u);
                let normal = ends[0].normal * (v * v) + middle * (u * v) + ends[1].normal * (u * u);
                let rest = RestPoint::between([ends[0].rest, ends[1].rest], [v, u]);
                self.points.push(SkinPoint { position, normal: normal.normalize_or(middle), rest });
            }
            Strip { corners, from }
        };
        let one = strip(first, ends[0]);
        let other = if second == first { one } else { strip(second, ends[1]) };
        self.strips.push([one, other]);
        if edge.triangles[1] == NONE {
            self.add_rim(skin, edge);
        }
    }

    /// Lists the parts of a border edge in the direction of its triangle.
    fn add_rim(&mut self, skin: CoarseSkin<'_>, edge: &Edge) {
        let parts = skin.parts;
        let Some(&[Strip { corners, from }, _]) = self.strips.last() else { return };
        let at = |part: u32| match part {
            0 => corners[0],
            _ if part == parts => corners[1],
            _ => from + part - 1,
        };
        let [a, b, c] = skin.vertices[edge.triangles[0] as usize];
        let along = [[a, b], [b, c], [c, a]].contains(&edge.ends);
        let sides = (0..parts).map(|part| if along { [at(part), at(part + 1)] } else { [at(part + 1), at(part)] });
        self.rim.extend(sides);
    }

    /// The point of a triangle's side `part` parts from the corner where the side begins.
    fn on_side(&self, skin: CoarseSkin<'_>, triangle: usize, side: usize, part: u32) -> u32 {
        let number = skin.edges.of_triangle[triangle][side] as usize;
        let second = usize::from(skin.edges.edges[number].triangles[0] as usize != triangle);
        let forward = skin.vertices[triangle][side] == skin.edges.edges[number].ends[0];
        self.strips[number][second].from + if forward { part } else { skin.parts - part } - 1
    }

    /// Adds the inner points and the small triangles of a triangle. Row i has the points with i parts of the way from its first corner to
    /// the others, from the side to its second on.
    fn divide_triangle(&mut self, skin: CoarseSkin<'_>, triangle: usize) {
        let parts = skin.parts;
        let corners = skin.corners[triangle];
        if parts == 1 {
            return self.triangles.push(corners);
        }
        let patch = self.patch(skin, triangle);
        self.grid.clear();
        for i in 0..=parts {
            for j in 0..=i {
                let point = match (i, j) {
                    (0, _) => corners[0],
                    _ if i == parts && j == 0 => corners[1],
                    _ if i == parts && j == i => corners[2],
                    (_, 0) => self.on_side(skin, triangle, 0, i),
                    _ if i == parts => self.on_side(skin, triangle, 1, j),
                    _ if j == i => self.on_side(skin, triangle, 2, parts - i),
                    _ => {
                        let of = |count: u32| f64::from(count) / f64::from(parts);
                        self.points.push(patch.at([of(parts - i), of(i - j), of(j)]));
                        self.points.len() as u32 - 1
                    }
                };
                self.grid.push(point);
            }
        }
        let Self { grid, triangles, .. } = self;
        let at = |i: u32, j: u32| grid[(i * (i + 1) / 2 + j) as usize];
        for i in 0..parts {
            triangles.extend((0..=i).map(|j| [at(i, j), at(i + 1, j), at(i + 1, j + 1)]));
            triangles.extend((0..i).map(|j| [at(i, j), at(i + 1, j + 1), at(i, j + 1)]));
        }
    }

    fn patch(&self, skin: CoarseSkin<'_>, triangle: usize) -> Patch {
        let corners = skin.corners[triangle].map(|corner| self.points[corner as usize]);
        let sides = [0, 1, 2].map(|side| {
            let number = skin.edges.of_triangle[triangle][side] as usize;
            let [near, far] = self.controls[number];
            let forward = skin.vertices[triangle][side] == skin.edges.edges[number].ends[0];
            if forward { [near, far] } else { [far, near] }
        });
        let mean = sides.as_flattened().iter().sum::<DVec3>() / 6.0;
        let flat = corners.iter().map(|corner| corner.position).sum::<DVec3>() / 3.0;
        let between = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| middle_normal(corners[a], corners[b]));
        Patch { corners, sides, middle: mean + 0.5 * (mean - flat), between }
    }
}

/// A curved triangle: a cubic of positions, a parabola of normals.
struct Patch {
    corners: [SkinPoint; 3],
    /// The control points of each side, in its direction.
    sides: [[DVec3; 2]; 3],
    middle: DVec3,
    /// The normals at the middles of the sides.
    between: [DVec3; 3],
}

impl Patch {
    /// The point with these shares of the corners.
    fn at(&self, shares: [f64; 3]) -> SkinPoint {
        let (mut position, mut normal) = (self.middle * (6.0 * shares[0] * shares[1] * shares[2]), DVec3::ZERO);
        for (k, corner) in self.corners.iter().enumerate() {
            let (w, next) = (shares[k], shares[(k + 1) % 3]);
            let [near, far] = self.sides[k];
            position += corner.position * (w * w * w) + (near * w + far * next) * (3.0 * w * next);
            normal += corner.normal * (w * w) + self.between[k] * (w * next);
        }
        let rest = RestPoint::between(self.corners.map(|corner| corner.rest), shares);
        SkinPoint { position, normal: normal.normalize_or(self.corners[0].normal), rest }
    }
}
