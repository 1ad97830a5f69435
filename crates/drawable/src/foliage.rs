//! Many small pieces that can be drawn in any number, cheaply or in full: the trunk and the leaves of a tree (RH05, §6).
//!
//! In: a seed and sizes. Out: pieces in their order, each as a stroke (a line or a point) and as triangles, and for a number of triangles
//! which pieces are drawn as which. Never here: the choice of the number, the GPU. The most important pieces come first.

use crate::progressive_mesh::FORMS;
use glam::{DVec3, Vec3};
use metachron_geometry::{PrimitiveMesh, PrimitiveVertex};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;
use std::sync::OnceLock;

/// The cheap form of a piece: the line of a bough, or the point of a leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Start of a line, or middle of a leaf, metres.
    pub from: Vec3,
    /// Vector to the end of a line, metres; unit normal of a leaf.
    pub way: Vec3,
    /// Half the width of a line; radius of a disc of the area that the leaf covers on average over all directions of view, metres.
    pub radius_m: f32,
}

/// The kind of the pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PieceKind {
    /// Boughs, thick ones first: a line of two triangles, or a generalized cylinder.
    Bough,
    /// Leaves, those farthest from the middle of their group first: a point of one triangle, or a leaf of two.
    Leaf,
}

/// Pieces in the order in which they are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Foliage {
    kind: PieceKind,
    /// One per piece.
    strokes: Vec<Stroke>,
    /// Whether pieces are never drawn as strokes.
    full_only: bool,
    /// The same number of triangles for each piece, piece by piece.
    mesh: PrimitiveMesh,
    /// [`crate::Model::losses`], once they are asked for.
    pub(crate) losses: OnceLock<[f32; FORMS]>,
}

/// The pieces that are drawn for a number of triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct FoliageCut {
    /// Triangles of the first pieces, drawn in full; whole pieces unless nothing is drawn as a stroke.
    pub triangles: u32,
    /// The pieces drawn as strokes, which follow the others.
    pub strokes: Range<u32>,
    /// Factor on the size of points: fewer cover as much.
    pub growth: f32,
}

/// Widest line, pixels: a thicker bough is drawn in full (RH05, §7.2).
const LINE_MAX_PX: f64 = 20.0;

impl PieceKind {
    /// Triangles of a stroke.
    #[must_use]
    pub const fn stroke_triangles(self) -> u32 {
        match self {
            Self::Bough => 2,
            Self::Leaf => 1,
        }
    }

    /// Triangles of a piece in full.
    #[must_use]
    pub const fn full_triangles(self) -> u32 {
        match self {
            Self::Bough => 2 * SIDES,
            Self::Leaf => 2,
        }
    }
}

impl Foliage {
    /// The kind of the pieces.
    #[must_use]
    pub fn kind(&self) -> PieceKind {
        self.kind
    }

    /// Whether pieces are never drawn as strokes.
    #[must_use]
    pub fn full_only(&self) -> bool {
        self.full_only
    }

    /// The strokes of all pieces, in their order.
    #[must_use]
    pub fn strokes(&self) -> &[Stroke] {
        &self.strokes
    }

    /// All pieces in full, in their order.
    #[must_use]
    pub fn mesh(&self) -> &PrimitiveMesh {
        &self.mesh
    }

    /// The fewest triangles that can be drawn, and those of all pieces in full.
    #[must_use]
    pub fn range(&self) -> (u32, u32) {
        let least = if self.full_only { 1 } else { self.kind.stroke_triangles() };
        (least, self.mesh.triangles.len() as u32)
    }

    /// The pieces to draw with at most `triangles`, at least one stroke, where a metre is `pixels` large: of n pieces p strokes up to p = n, past
    /// it p − n pieces in full and 2n − p strokes (RH05, §6.2). Boughs wider than a line can be are in full, whatever that leaves for the others
    /// (RH05, §6.1).
    #[must_use]
    pub fn cut(&self, triangles: u32, pixels: f64) -> FoliageCut {
        let all = self.strokes.len() as u32;
        if self.full_only {
            let triangles = triangles.min(self.mesh.triangles.len() as u32);
            return FoliageCut { triangles, strokes: 0..0, growth: 1.0 };
        }
        let (stroke, full) = (self.kind.stroke_triangles(), self.kind.full_triangles());
        // one stroke is the least
        let triangles = triangles.max(stroke);
        let afforded = triangles.saturating_sub(stroke * all) / (full - stroke);
        let in_full = afforded.max(self.too_thick(pixels)).min(triangles / full).min(all);
        let end = in_full + ((triangles - full * in_full) / stroke).min(all - in_full);
        let fewer = self.kind == PieceKind::Leaf && in_full == 0;
        let growth = if fewer { (all as f32 / end.max(1) as f32).sqrt() } else { 1.0 };
        FoliageCut { triangles: full * in_full, strokes: in_full..end, growth }
    }

    /// Boughs that no line is wide enough for.
    fn too_thick(&self, pixels: f64) -> u32 {
        match self.kind {
            PieceKind::Bough => {
                self.strokes.partition_point(|s| 2.0 * f64::from(s.radius_m) * pixels > LINE_MAX_PX) as u32
            }
            PieceKind::Leaf => 0,
        }
    }
}

/// Parameters of a tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeSpec {
    /// Seed of its shape.
    pub seed: u64,
    /// Height, metres, > 0.
    pub height_m: f64,
    /// Boughs, each a segment of trunk or branch, ≥ 1.
    pub branches: u32,
    /// Leaves, ≥ 1.
    pub leaves: u32,
    /// Whether its pieces are drawn in full only: of all triangles a prefix.
    pub prefix: bool,
}

/// Sides of a bough in full.
const SIDES: u32 = 5;

/// The trunk with its boughs, thick ones first, and the leaves, group by group from the outside in.
#[must_use]
pub fn tree(spec: &TreeSpec) -> [Foliage; 2] {
    let mut chance = SplitMix64(spec.seed);
    let grown = grow(spec, &mut chance);
    let line = |b: &Bough| Stroke {
        from: b.from.as_vec3(),
        way: (b.to - b.from).as_vec3(),
        radius_m: (0.5 * (b.radius_m + b.end_radius_m)) as f32,
    };
    let trunk = Foliage {
        kind: PieceKind::Bough,
        strokes: grown.boughs.iter().map(line).collect(),
        full_only: spec.prefix,
        mesh: bough_mesh(&grown.boughs),
        losses: OnceLock::new(),
    };
    let leaves = outside_in(leaves(spec, &grown, &mut chance), &grown);
    let side_m = LEAF_SIDE * spec.height_m / libm::sqrt(f64::from(spec.leaves.max(1)));
    // a leaf covers half its area on average over all directions
    let radius_m = side_m / libm::sqrt(TAU);
    let point = |l: &Leaf| Stroke { from: l.at.as_vec3(), way: l.normal.as_vec3(), radius_m: radius_m as f32 };
    let crown = Foliage {
        kind: PieceKind::Leaf,
        strokes: leaves.iter().map(point).collect(),
        full_only: spec.prefix,
        mesh: leaf_mesh(&leaves, radius_m),
        losses: OnceLock::new(),
    };
    [trunk, crown]
}

/// Side of a leaf as a fraction of the height over the square root of their number: together they cover the crown about twice.
const LEAF_SIDE: f64 = 0.75;
/// Length of the first bough as a fraction of the height, and of each next one as a fraction of the one before.
const BOUGH: (f64, f64) = (0.22, 0.86);
/// Radius of the trunk as a fraction of the height, and of each next bough as a fraction of the one before: along and to the side.
const GIRTH: (f64, f64, f64) = (0.028, 0.84, 0.62);

/// A segment of trunk or branch.
#[derive(Clone, Copy)]
struct Bough {
    from: DVec3,
    to: DVec3,
    radius_m: f64,
    end_radius_m: f64,
}

struct Leaf {
    at: DVec3,
    normal: DVec3,
}

/// The end of a bough that can grow.
#[derive(Clone, Copy)]
struct Bud {
    at: DVec3,
    way: DVec3,
    radius_m: f64,
    length_m: f64,
}

struct Grown {
    boughs: Vec<Bough>,
    buds: Vec<Bud>,
}

/// Repeatedly grows the thickest bud: it becomes a bough with two buds at its end.
fn grow(spec: &TreeSpec, chance: &mut SplitMix64) -> Grown {
    let height = spec.height_m;
    let first = Bud { at: DVec3::ZERO, way: DVec3::Z, radius_m: GIRTH.0 * height, length_m: BOUGH.0 * height };
    let mut grown = Grown { boughs: Vec::new(), buds: vec![first] };
    for _ in 0..spec.branches.max(1) {
        let thickest =
            (0..grown.buds.len()).reduce(|a, b| if grown.buds[b].radius_m > grown.buds[a].radius_m { b } else { a });
        let Some(bud) = thickest.map(|i| grown.buds.swap_remove(i)) else { break };
        let to = bud.at + bud.way * bud.length_m;
        grown.boughs.push(Bough { from: bud.at, to, radius_m: bud.radius_m, end_radius_m: bud.radius_m * GIRTH.1 });
        let side = chance.across(bud.way);
        for (share, lean) in [(GIRTH.1, 0.18), (GIRTH.2, 0.75)] {
            let aside = if share == GIRTH.1 { -side } else { side };
            let way = (bud.way + aside * (lean * (0.7 + 0.6 * chance.share())) + DVec3::Z * 0.06).normalize();
            let length_m = bud.length_m * BOUGH.1 * (0.8 + 0.4 * chance.share());
            grown.buds.push(Bud { at: to, way, radius_m: bud.radius_m * share, length_m });
        }
    }
    grown
}

/// Leaves around the remaining buds, facing roughly away from the buds' centre.
fn leaves(spec: &TreeSpec, grown: &Grown, chance: &mut SplitMix64) -> Vec<Leaf> {
    let middle = grown.buds.iter().map(|b| b.at).sum::<DVec3>() / grown.buds.len().max(1) as f64;
    let leaf = |_| {
        let bud = grown.buds[chance.below(grown.buds.len())];
        let off = DVec3::new(chance.share(), chance.share(), chance.share()) * 2.0 - 1.0;
        let at = bud.at + bud.way * (bud.length_m * chance.share()) + off * (0.6 * bud.length_m);
        let tilt = DVec3::new(chance.share(), chance.share(), chance.share()) - 0.5;
        let out = (at - middle).normalize_or(DVec3::Z);
        Leaf { at, normal: (out + tilt).normalize_or(out) }
    };
    (0..spec.leaves.max(1)).map(leaf).collect()
}

/// The leaves of all groups together, in each group those farthest from its middle first (RH05, §6.2): a group belongs to the end of a
/// branch, and has the leaves that are nearest to it.
fn outside_in(leaves: Vec<Leaf>, grown: &Grown) -> Vec<Leaf> {
    let mut groups: Vec<Vec<Leaf>> = grown.buds.iter().map(|_| Vec::new()).collect();
    for leaf in leaves {
        let far = |bud: usize| grown.buds[bud].at.distance_squared(leaf.at);
        let nearest = (0..groups.len()).min_by(|&a, &b| far(a).total_cmp(&far(b)));
        if let Some(group) = nearest.and_then(|bud| groups.get_mut(bud)) {
            group.push(leaf);
        }
    }
    let mut ordered = Vec::new();
    for mut group in groups {
        let size = group.len().max(1) as f64;
        let middle = group.iter().map(|leaf| leaf.at).sum::<DVec3>() / size;
        group.sort_by(|a, b| b.at.distance_squared(middle).total_cmp(&a.at.distance_squared(middle)));
        // each group gives the same share of its leaves to every beginning of the order
        ordered.extend(group.into_iter().enumerate().map(|(rank, leaf)| ((rank as f64 + 0.5) / size, leaf)));
    }
    ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
    ordered.into_iter().map(|(_, leaf)| leaf).collect()
}

fn bough_mesh(boughs: &[Bough]) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    for bough in boughs {
        let first = mesh.vertices.len() as u32;
        let along = (bough.to - bough.from).normalize_or(DVec3::Z);
        let x = along.any_orthonormal_vector();
        let y = along.cross(x);
        for (centre, radius) in [(bough.from, bough.radius_m), (bough.to, bough.end_radius_m)] {
            for side in 0..SIDES {
                let angle = TAU * f64::from(side) / f64::from(SIDES);
                let out = x * libm::cos(angle) + y * libm::sin(angle);
                mesh.vertices.push(PrimitiveVertex::bare((centre + out * radius).as_vec3(), out.as_vec3()));
            }
        }
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let (a, b, c, d) = (first + side, first + next, first + SIDES + next, first + SIDES + side);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Leaves twice as long as they are wide.
fn leaf_mesh(leaves: &[Leaf], radius_m: f64) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    // half the diagonals of a rhombus of area 2π r²
    let (across, along) = (radius_m * libm::sqrt(FRAC_PI_2), radius_m * libm::sqrt(2.0 * PI));
    for leaf in leaves {
        let first = mesh.vertices.len() as u32;
        let x = leaf.normal.any_orthonormal_vector();
        let y = leaf.normal.cross(x);
        for (u, v) in [(0.0, -along), (across, 0.0), (0.0, along), (-across, 0.0)] {
            let core = (leaf.at + x * u + y * v).as_vec3();
            mesh.vertices.push(PrimitiveVertex::bare(core, leaf.normal.as_vec3()));
        }
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
}

/// Pseudo-random numbers from a seed: splitmix.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0 … 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// A unit vector across `way`.
    fn across(&mut self, way: DVec3) -> DVec3 {
        let x = way.any_orthonormal_vector();
        let angle = TAU * self.share();
        x * libm::cos(angle) + way.cross(x) * libm::sin(angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(prefix: bool) -> TreeSpec {
        TreeSpec { seed: 5, height_m: 6.0, branches: 62, leaves: 240, prefix }
    }

    /// Pixels of a metre seen from afar: no bough is wider than a line.
    const AFAR: f64 = 10.0;

    fn drawn(foliage: &Foliage, cut: &FoliageCut) -> u32 {
        cut.triangles + cut.strokes.len() as u32 * foliage.kind().stroke_triangles()
    }

    #[test]
    fn a_tree_of_the_paper_has_the_papers_triangles() {
        // 620 of trunk and 480 of leaves (RH05, §6)
        let [trunk, leaves] = tree(&spec(false));
        assert_eq!((trunk.range(), leaves.range()), ((2, 620), (1, 480)));
        assert_eq!((trunk.strokes().len(), leaves.strokes().len()), (62, 240));
    }

    #[test]
    fn n_pieces_are_p_strokes_and_past_n_p_less_n_in_full_and_the_rest_strokes() {
        let [trunk, leaves] = tree(&spec(false));
        for foliage in [&trunk, &leaves] {
            let n = foliage.strokes().len() as u32;
            let (stroke, full) = (foliage.kind().stroke_triangles(), foliage.kind().full_triangles());
            for p in 1..=2 * n {
                let triangles = stroke * p.min(n) + (full - stroke) * p.saturating_sub(n);
                let cut = foliage.cut(triangles, AFAR);
                assert_eq!(drawn(foliage, &cut), triangles);
                assert_eq!((cut.triangles / full, cut.strokes), (p.saturating_sub(n), p.saturating_sub(n)..p.min(n)));
            }
        }
    }

    #[test]
    fn a_cut_never_has_more_triangles_than_asked_for_nor_fewer_pieces_than_a_cheaper_one() {
        for foliage in tree(&spec(false)).iter().chain(&tree(&spec(true))) {
            for pixels in [AFAR, 80.0, 500.0] {
                let mut before = (0, 0);
                for asked in 0..800 {
                    let cut = foliage.cut(asked, pixels);
                    assert!(drawn(foliage, &cut) <= asked.max(foliage.range().0));
                    let here = (cut.triangles, cut.triangles + cut.strokes.end);
                    assert!(here >= before, "{asked}: {here:?} after {before:?}");
                    before = here;
                }
                assert_eq!(before.0, foliage.range().1);
            }
        }
    }

    #[test]
    fn boughs_wider_than_twenty_pixels_are_in_full_beside_lines() {
        let [trunk, _] = tree(&spec(false));
        // half again the triangles of all lines: some boughs can be in full and leave lines to the others
        let (mut before, asked) = (0, 186);
        for pixels in [10.0, 70.0, 120.0, 200.0] {
            let cut = trunk.cut(asked, pixels);
            let wide = trunk.strokes().iter().filter(|s| 2.0 * f64::from(s.radius_m) * pixels > 20.0).count() as u32;
            let afforded = (asked - 124) / 8;
            assert_eq!(cut.triangles / 10, wide.max(afforded).min(asked / 10), "{pixels}");
            assert!(cut.strokes.start == cut.triangles / 10 && cut.triangles >= before);
            before = cut.triangles;
        }
        assert!(before > 70, "{before}");
    }

    #[test]
    fn fewer_points_cover_as_much() {
        let [_, leaves] = tree(&spec(false));
        for asked in [1, 7, 60, 239] {
            let cut = leaves.cut(asked, AFAR);
            let covered = cut.strokes.len() as f32 * cut.growth * cut.growth;
            assert!((covered / 240.0 - 1.0).abs() < 1e-5, "{covered}"); // a square root and back in f32
        }
    }

    #[test]
    fn a_leaf_has_twice_the_area_of_its_points_disc() {
        let [_, leaves] = tree(&spec(false));
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| leaves.mesh().vertices[i as usize].core);
            0.5 * (b - a).cross(c - a).length()
        };
        for (pair, stroke) in leaves.mesh().triangles.chunks(2).zip(leaves.strokes()) {
            let (leaf, disc) = (area(&pair[0]) + area(&pair[1]), std::f32::consts::PI * stroke.radius_m.powi(2));
            assert!((leaf / disc - 2.0).abs() < 1e-3, "{leaf} {disc}"); // corners in f32 some metres from the origin
        }
    }

    #[test]
    fn leaves_come_from_the_outside_of_their_groups_in() {
        let spec = TreeSpec { branches: 3, leaves: 400, ..spec(false) };
        let grown = grow(&spec, &mut SplitMix64(spec.seed));
        let [_, leaves] = tree(&spec);
        let mut large = 0;
        for group in 0..grown.buds.len() {
            let nearest = |at: DVec3| {
                let far = |bud: &Bud| bud.at.distance_squared(at);
                (0..grown.buds.len()).min_by(|&a, &b| far(&grown.buds[a]).total_cmp(&far(&grown.buds[b])))
            };
            let own: Vec<DVec3> = leaves.strokes().iter().map(|s| s.from.as_dvec3()).collect();
            let own: Vec<DVec3> = own.into_iter().filter(|at| nearest(*at) == Some(group)).collect();
            let middle = own.iter().sum::<DVec3>() / own.len() as f64;
            let far: Vec<f64> = own.iter().map(|at| at.distance(middle)).collect();
            assert!(far.windows(2).all(|pair| pair[0] >= pair[1] - 1e-5), "{far:?}"); // places in f32
            large += usize::from(far.len() > 20);
        }
        assert!(large > 1, "{large}");
    }

    #[test]
    fn thick_boughs_come_first_and_everything_stays_about_the_height() {
        let [trunk, leaves] = tree(&spec(false));
        assert!(trunk.strokes().windows(2).all(|pair| pair[0].radius_m >= pair[1].radius_m));
        let far = trunk.strokes().iter().chain(leaves.strokes()).map(|s| s.from.length()).fold(0.0, f32::max);
        assert!((3.0..12.0).contains(&far), "{far}");
    }

    #[test]
    fn one_prefix_is_the_beginning_of_another() {
        let [trunk, _] = tree(&spec(true));
        assert!(trunk.full_only());
        assert_eq!(trunk.cut(37, AFAR), FoliageCut { triangles: 37, strokes: 0..0, growth: 1.0 });
    }
}
