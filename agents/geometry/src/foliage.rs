//! Many small pieces that can be drawn in any number: the trunk and the leaves of a tree (RH05, §6).
//!
//! In: a seed and sizes. Out: rungs (levels) from points and lines up to meshes, and the prefix of a rung for a number of triangles.
//! Never here: the choice of the number, the GPU. The most important pieces come first, so every prefix is the best of its length.

use super::{PrimitiveMesh, PrimitiveVertex};
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// A line or a point that faces the camera: a bough or a leaf from afar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Start of a line, or position of a point, metres.
    pub from: Vec3,
    /// Vector to the end of a line, metres; unit normal of a point.
    pub way: Vec3,
    /// Half the width of a line; distance of a point's three corners from it, metres.
    pub radius_m: f32,
}

/// One representation of all pieces.
#[derive(Debug, Clone, PartialEq)]
pub enum Rung {
    /// One triangle per piece, turned to the camera; fewer of them are drawn larger, so that the covered area stays the same.
    Points(Vec<Stroke>),
    /// Two triangles per piece, turned to the camera.
    Lines(Vec<Stroke>),
    /// Triangles, piece by piece.
    Mesh(PrimitiveMesh),
}

/// Pieces in rungs with increasing numbers of triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Foliage {
    rungs: Vec<Rung>,
}

/// The first pieces of one rung.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prefix {
    /// Index of the rung.
    pub rung: u8,
    /// Number of its triangles.
    pub triangles: u32,
    /// Enlargement of each point.
    pub growth: f32,
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
    /// Whether it has only the finest rung, of which a prefix is drawn.
    pub prefix: bool,
}

/// Sides of a bough in the mesh rungs of a trunk: the last is the one seen from near.
const SIDES: [u32; 3] = [3, 4, 5];

impl Rung {
    /// Triangles of all its pieces.
    #[must_use]
    pub fn triangles(&self) -> u32 {
        match self {
            Self::Points(strokes) => strokes.len() as u32,
            Self::Lines(strokes) => 2 * strokes.len() as u32,
            Self::Mesh(mesh) => mesh.triangles.len() as u32,
        }
    }
}

impl Foliage {
    /// The rungs, cheapest first.
    #[must_use]
    pub fn rungs(&self) -> &[Rung] {
        &self.rungs
    }

    /// The fewest triangles that can be drawn, and the number of the finest rung.
    #[must_use]
    pub fn range(&self) -> (u32, u32) {
        let least = if matches!(self.rungs.first(), Some(Rung::Lines(_))) { 2 } else { 1 };
        (least, self.rungs.last().map_or(0, Rung::triangles))
    }

    /// The prefix for `triangles`: the finest rung that fits whole, else the beginning of the first.
    #[must_use]
    pub fn cut(&self, triangles: u32) -> Prefix {
        let whole = self.rungs.iter().rposition(|rung| rung.triangles() <= triangles);
        if let Some(rung) = whole {
            return Prefix { rung: rung as u8, triangles: self.rungs[rung].triangles(), growth: 1.0 };
        }
        let (growth, triangles) = match self.rungs.first() {
            Some(Rung::Points(all)) => ((all.len() as f32 / triangles.max(1) as f32).sqrt(), triangles),
            Some(Rung::Lines(_)) => (1.0, triangles & !1),
            _ => (1.0, triangles),
        };
        Prefix { rung: 0, triangles, growth }
    }
}

/// The trunk with its boughs, thick ones first, and the leaves, in random order.
#[must_use]
pub fn tree(spec: &TreeSpec) -> [Foliage; 2] {
    let mut chance = SplitMix64(spec.seed);
    let grown = grow(spec, &mut chance);
    let lines = grown.boughs.iter().map(|b| Stroke {
        from: b.from.as_vec3(),
        way: (b.to - b.from).as_vec3(),
        radius_m: (0.5 * (b.radius_m + b.end_radius_m)) as f32,
    });
    let trunk = std::iter::once(Rung::Lines(lines.collect()));
    let trunk = trunk.chain(SIDES.map(|sides| Rung::Mesh(bough_mesh(&grown.boughs, sides))));
    let leaves = leaves(spec, &grown, &mut chance);
    // a triangle turned to the camera covers as much as a randomly oriented leaf does on average: half its area
    let side = LEAF_SIDE * spec.height_m / libm::sqrt(f64::from(spec.leaves.max(1)));
    let radius_m = libm::sqrt(2.0 * side * side / (3.0 * libm::sqrt(3.0))) as f32;
    let points = leaves.iter().map(|l| Stroke { from: l.at.as_vec3(), way: l.normal.as_vec3(), radius_m });
    let hanging = Rung::Mesh(leaf_mesh(&leaves, side));
    let keep = |rungs: Vec<Rung>| if spec.prefix { rungs.into_iter().next_back().into_iter().collect() } else { rungs };
    [Foliage { rungs: keep(trunk.collect()) }, Foliage { rungs: keep(vec![Rung::Points(points.collect()), hanging]) }]
}

/// Side of a leaf as a fraction of the height over the square root of their number: together they cover the crown about once.
const LEAF_SIDE: f64 = 0.55;
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

fn bough_mesh(boughs: &[Bough], sides: u32) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    for bough in boughs {
        let first = mesh.vertices.len() as u32;
        let along = (bough.to - bough.from).normalize_or(DVec3::Z);
        let x = along.any_orthonormal_vector();
        let y = along.cross(x);
        for (centre, radius) in [(bough.from, bough.radius_m), (bough.to, bough.end_radius_m)] {
            for side in 0..sides {
                let angle = TAU * f64::from(side) / f64::from(sides);
                let out = x * libm::cos(angle) + y * libm::sin(angle);
                mesh.vertices.push(PrimitiveVertex::bare((centre + out * radius).as_vec3(), out.as_vec3()));
            }
        }
        for side in 0..sides {
            let next = (side + 1) % sides;
            let (a, b, c, d) = (first + side, first + next, first + sides + next, first + sides + side);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn leaf_mesh(leaves: &[Leaf], side: f64) -> PrimitiveMesh {
    let mut mesh = PrimitiveMesh::default();
    for leaf in leaves {
        let first = mesh.vertices.len() as u32;
        let x = leaf.normal.any_orthonormal_vector();
        let y = leaf.normal.cross(x);
        for (u, v) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            let core = (leaf.at + (x * u + y * v) * side).as_vec3();
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

    #[test]
    fn a_tree_of_the_paper_has_the_papers_triangles() {
        // 620 of trunk and 480 of leaves (RH05, §6)
        let [trunk, leaves] = tree(&spec(false));
        assert_eq!((trunk.range().1, leaves.range().1), (620, 480));
        assert_eq!(trunk.rungs().iter().map(Rung::triangles).collect::<Vec<_>>(), [124, 372, 496, 620]);
        assert_eq!(leaves.rungs().iter().map(Rung::triangles).collect::<Vec<_>>(), [240, 480]);
    }

    #[test]
    fn a_cut_never_has_more_triangles_than_asked_for_nor_less_detail_than_a_cheaper_one() {
        for foliage in tree(&spec(false)).iter().chain(&tree(&spec(true))) {
            let mut before = foliage.cut(0);
            for asked in 0..800 {
                let cut = foliage.cut(asked);
                assert!(cut.triangles <= asked);
                assert!((cut.rung, cut.triangles) >= (before.rung, before.triangles));
                before = cut;
            }
            assert_eq!(before.triangles, foliage.range().1);
        }
    }

    #[test]
    fn fewer_points_cover_as_much() {
        let [_, leaves] = tree(&spec(false));
        for asked in [1, 7, 60, 239] {
            let cut = leaves.cut(asked);
            let covered = cut.triangles as f32 * cut.growth * cut.growth;
            assert!((covered / 240.0 - 1.0).abs() < 1e-5, "{covered}"); // a square root and back in f32
        }
    }

    #[test]
    fn thick_boughs_come_first_and_everything_stays_about_the_height() {
        let [trunk, leaves] = tree(&spec(false));
        let Rung::Lines(boughs) = &trunk.rungs()[0] else { panic!("the first rung is lines") };
        assert!(boughs.windows(2).all(|pair| pair[0].radius_m >= pair[1].radius_m));
        let Rung::Points(points) = &leaves.rungs()[0] else { panic!("the first rung is points") };
        let far = boughs.iter().chain(points).map(|s| s.from.length()).fold(0.0, f32::max);
        assert!((3.0..12.0).contains(&far), "{far}");
    }

    #[test]
    fn one_prefix_is_the_beginning_of_another() {
        let [trunk, _] = tree(&spec(true));
        assert_eq!(trunk.rungs().len(), 1);
        assert_eq!(trunk.cut(37), Prefix { rung: 0, triangles: 37, growth: 1.0 });
    }
}
