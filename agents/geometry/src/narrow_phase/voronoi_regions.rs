//! What lies around each vertex and edge of a skin, and which ways out of it belong to them.
//!
//! In: edges and triangles. Out: whether the way from a spot to what it touches leads out of it, and not along the skin.
//! Never here: where the vertices are. Theory: docs/theory/soft.md, eq. 15a (the regions of Voronoi of (ERI05, ch. 5)).

use super::primitives::Surface;
use glam::DVec3;

/// No triangle lies there.
const NONE: u32 = u32::MAX;
/// How far a way may lean over the skin and still belong to the spot, as a share of the edge that it leans over.
pub(super) const LEAN_SHARE: f64 = 1e-3;
/// What is left of a way that leads along the skin, when that is taken off, is no way out below this share.
const OUT_SHARE: f64 = 0.5;

/// The neighbours of every vertex and edge of a skin; it never changes.
#[derive(Debug, Clone, Default)]
pub struct Fans {
    /// Where the neighbours of each vertex begin.
    starts: Vec<u32>,
    /// The other ends of the edges at each vertex.
    neighbours: Vec<u32>,
    /// The corners opposite to each edge.
    opposite: Vec<[u32; 2]>,
}

impl Fans {
    /// Of a skin of these edges and triangles.
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

    /// From a vertex along the edges that meet there.
    fn at_vertex(&self, surface: &Surface<'_>, vertex: u32) -> impl Iterator<Item = DVec3> {
        let from = surface.positions[vertex as usize];
        let range = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        self.neighbours[range].iter().map(move |next| surface.positions[*next as usize] - from)
    }

    /// Along an edge both ways, and across it into the triangles that meet there.
    fn at_edge(&self, surface: &Surface<'_>, number: u64, [a, b]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
        let along = (b - a).normalize_or_zero();
        let corners = self.opposite[number as usize].into_iter().filter(|corner| *corner != NONE);
        let across = corners.map(move |corner| (surface.positions[corner as usize] - a).reject_from_normalized(along));
        across.chain([b - a, a - b])
    }
}

/// A vertex or an edge of a skin, with its number and, of an edge, its ends.
#[derive(Clone, Copy)]
pub(super) enum Ridge {
    Vertex(u32),
    Edge(u64, [DVec3; 2]),
}

impl Ridge {
    /// Calls `each` with every way along the skin from here.
    fn along(self, surface: &Surface<'_>, mut each: impl FnMut(DVec3)) {
        let fans = &surface.form.fans;
        match self {
            Self::Vertex(vertex) => fans.at_vertex(surface, vertex).for_each(&mut each),
            Self::Edge(number, ends) => fans.at_edge(surface, number, ends).for_each(&mut each),
        }
    }

    /// Whether nothing of the skin around it is nearer to what lies at the end of `way`: else that tells the place.
    pub fn is_nearest(self, surface: &Surface<'_>, way: DVec3) -> bool {
        let mut nearest = true;
        self.along(surface, |along| nearest &= way.dot(along) <= LEAN_SHARE * along.length_squared());
        nearest
    }

    /// The unit way out of the skin that is near to `way`: what leads along the skin is taken off. `None` if that was most of it.
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
