//! Neighbourhoods of each vertex and edge of a skin, and which directions out of it belong to them.
//!
//! In: edges and triangles. Out: whether the vector from a spot to the touching point leads out of the skin, and not along it.
//! Never here: where the vertices are. Theory: docs/theory/contact.md, eq. 8 (the Voronoi regions of (ERI05, ch. 5)).

use crate::narrow_phase::primitives::Surface;
use glam::DVec3;

/// No triangle on that side.
const NONE: u32 = u32::MAX;
/// How far a vector may lean over a neighbouring edge and still belong to the spot, as a share of that edge.
pub(super) const LEAN_SHARE: f64 = 1e-3;
/// By how much two features may lean over their neighbours, where their own directions make the normal: about the turn of a body in
/// a step, radians.
pub(super) const LEAN: f64 = 0.1;
/// By how much an edge that stands out is above a line between the far corners of its triangles, metres: a tenth of the usual depth of
/// contacts. A place that bears a good part of a load would else be gone, and come back, where a skin gets a little flatter.
const RIDGE_M: f64 = 2e-6;
/// A vector is no way out when removing its parts along the skin leaves less than this share of it.
const OUT_SHARE: f64 = 0.5;

/// The neighbours of every vertex and edge of a skin; it never changes.
#[derive(Debug, Clone, Default)]
pub struct VoronoiRegions {
    /// Where the neighbours of each vertex begin.
    starts: Vec<u32>,
    /// The other ends of the edges at each vertex.
    neighbours: Vec<u32>,
    /// The corners opposite to each edge.
    opposite: Vec<[u32; 2]>,
}

impl VoronoiRegions {
    /// The neighbourhoods of a skin with these edges and triangles.
    pub fn of(edges: &[[u32; 2]], triangles: &[[u32; 3]]) -> Self {
        let vertices = edges.iter().flatten().max().map_or(0, |last| *last as usize + 1);
        let mut starts = vec![0_u32; vertices + 1];
        edges.iter().flatten().for_each(|vertex| starts[*vertex as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut neighbours = vec![0; 2 * edges.len()];
        for (a, b) in edges.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
            neighbours[next[a as usize] as usize] = b;
            next[a as usize] += 1;
        }
        let sorted = |a: u32, b: u32| [a.min(b), a.max(b)];
        let mut sides: Vec<_> =
            triangles.iter().flat_map(|&[a, b, c]| [(sorted(a, b), c), (sorted(b, c), a), (sorted(c, a), b)]).collect();
        sides.sort_unstable();
        let opposite = edges.iter().map(|&[a, b]| {
            let from = sides.partition_point(|side| side.0 < sorted(a, b));
            let mut found = sides[from..].iter().take_while(|side| side.0 == sorted(a, b)).map(|side| side.1);
            [found.next().unwrap_or(NONE), found.next().unwrap_or(NONE)]
        });
        Self { opposite: opposite.collect(), starts, neighbours }
    }

    /// Vectors from a vertex along the edges that meet there.
    fn at_vertex(&self, surface: &Surface<'_>, vertex: u32) -> impl Iterator<Item = DVec3> {
        let from = surface.positions[vertex as usize];
        let range = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        self.neighbours[range].iter().map(move |next| surface.positions[*next as usize] - from)
    }

    /// Vectors along an edge both ways, and across it into the triangles that meet there.
    fn at_edge(&self, surface: &Surface<'_>, number: u32, [a, b]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
        let along = (b - a).normalize_or_zero();
        let corners = self.opposite[number as usize].into_iter().filter(|corner| *corner != NONE);
        let across = corners.map(move |corner| (surface.positions[corner as usize] - a).reject_from_normalized(along));
        across.chain([b - a, a - b])
    }
}

/// A vertex or an edge of a skin, with its number and, for an edge, its ends.
#[derive(Clone, Copy)]
pub(super) enum Feature {
    Vertex(u32),
    Edge(u32, [DVec3; 2]),
}

impl Feature {
    /// Calls `each` with every vector along the skin from here.
    fn along(self, surface: &Surface<'_>, mut each: impl FnMut(DVec3)) {
        let fans = &surface.form.fans;
        match self {
            Self::Vertex(vertex) => fans.at_vertex(surface, vertex).for_each(&mut each),
            Self::Edge(number, ends) => fans.at_edge(surface, number, ends).for_each(&mut each),
        }
    }

    /// Whether no neighbouring part of the skin is nearer to the point at the end of `way`; otherwise that part reports the place.
    pub fn is_nearest(self, surface: &Surface<'_>, way: DVec3) -> bool {
        let mut nearest = true;
        self.along(surface, |along| nearest &= way.dot(along) <= LEAN_SHARE * along.length_squared());
        nearest
    }

    /// Whether the unit vector `out` leads out of the skin, and leans over no neighbouring part of it by more than `lean` radians.
    pub fn faces(self, surface: &Surface<'_>, out: DVec3, lean: f64) -> bool {
        let mut faces = true;
        self.along(surface, |along| faces &= out.dot(along) <= lean * along.length());
        faces
    }

    /// Whether the skin falls away from here, seen along the unit vector `out` of it. Where the skin is flat across an edge, the gap to whatever
    /// crosses that edge changes evenly: it is least beside the edge, at a place of its own. Vertices and borders stand out.
    pub fn stands_out(self, surface: &Surface<'_>, out: DVec3) -> bool {
        let Self::Edge(number, [a, b]) = self else { return true };
        let corners = surface.form.fans.opposite[number as usize];
        if corners.contains(&NONE) {
            return true;
        }
        let along = (b - a).normalize_or_zero();
        let across = corners.map(|corner| (surface.positions[corner as usize] - a).reject_from_normalized(along));
        let [[low_a, wide_a], [low_b, wide_b]] = across.map(|across| [-across.dot(out), across.length()]);
        // a triangle without a width says nothing of its side
        wide_a == 0.0 || wide_b == 0.0 || low_a * wide_b + low_b * wide_a > RIDGE_M * (wide_a + wide_b)
    }

    /// The unit vector out of the skin that is close to `way`: its parts along the skin are removed. `None` if they were most of it.
    pub fn out(self, surface: &Surface<'_>, way: DVec3) -> Option<DVec3> {
        let mut out = way;
        for _ in 0..2 {
            self.along(surface, |along| {
                let lean = out.dot(along).max(0.0) / along.length_squared().max(f64::MIN_POSITIVE);
                out -= along * lean;
            });
        }
        (out.length() > OUT_SHARE).then(|| out.normalize())
    }
}
