//! The features of a skin by place: a tree of boxes over patches of it, refitted to where the skin is, and the normals of its vertices.
//!
//! In: a skin and where its vertices are. Out: the patches near a region, and their vertices, edges and triangles. Never here: what touches.
//!
//! The tree is made once for each skin that a search knows, where it is first; of another place only boxes and normals are made anew, once for
//! all pairs. A patch is a few triangles beside each other. Every edge and vertex is in one patch: that of its first triangle, so that the patch's box is
//! around it.

use crate::narrow_phase::VoronoiRegions;
use crate::{Aabb, SurfaceShape};
use glam::DVec3;
use std::ptr::addr_eq;
use std::sync::{Arc, Weak};

/// The most triangles of a patch: a box costs about as much to test as a triangle.
const PATCH: usize = 8;
/// How many places of one skin are kept: a skin may touch another place of itself.
const PLACES: usize = 2;
/// A feature without an owner yet.
const NONE: u32 = u32::MAX;

/// A box of the tree; boxes are in the order in which they are visited.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// The first node that is not below this one: the next one for a patch.
    next: u32,
    /// The number of the first patch below it.
    patch: u32,
}

/// Numbers of features, patch after patch.
#[derive(Debug, Default)]
struct PatchList {
    /// Where those of each patch begin, and where the last ends.
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

/// The tree over a skin, wherever it is.
#[derive(Debug, Default)]
struct SkinTree {
    nodes: Vec<Node>,
    vertices: PatchList,
    edges: PatchList,
    triangles: PatchList,
    /// The vertices of all features of each patch.
    corners: PatchList,
}

/// A skin where it is.
pub(crate) struct PlacedSkin {
    form: KnownForm,
    /// The address of the positions that it was asked for last, and when.
    address: usize,
    used: u64,
    positions: Vec<DVec3>,
    tree: Arc<SkinTree>,
    /// The box of each node, metres.
    boxes: Vec<Aabb>,
    /// For a closed skin the outward normal at each vertex, of any length; none for an open one.
    normals: Vec<DVec3>,
}

/// The form of a skin, as long as another owner has it.
pub(super) struct KnownForm {
    vertices: Weak<[u32]>,
    edges: Weak<[[u32; 2]]>,
    triangles: Weak<[[u32; 3]]>,
    fans: Weak<VoronoiRegions>,
}

/// The skins that were searched, where they were last.
#[derive(Default)]
pub(crate) struct SkinCache {
    skins: Vec<PlacedSkin>,
    time: u64,
}

impl SkinCache {
    /// Brings the tree of a skin to these positions, if it is not there.
    pub fn prepare(&mut self, form: &SurfaceShape, positions: &[DVec3]) {
        self.time += 1;
        let address = positions.as_ptr().addr();
        let is_known = |skin: &PlacedSkin| skin.form.is_that_of(form) && skin.address == address;
        let at = self.skins.iter().position(is_known).or_else(|| self.replaceable(form));
        let at = at.unwrap_or_else(|| {
            self.skins.retain(|skin| skin.form.is_had());
            let known = self.skins.iter().find(|skin| skin.form.is_that_of(form)).map(|skin| Arc::clone(&skin.tree));
            self.skins.push(PlacedSkin::new(form, known.unwrap_or_else(|| Arc::new(SkinTree::of(form, positions)))));
            self.skins.len() - 1
        });
        let skin = &mut self.skins[at];
        (skin.address, skin.used) = (address, self.time);
        skin.move_to(form, positions);
    }

    /// The place of a skin that was asked for longest ago, if there are as many as are kept.
    fn replaceable(&self, form: &SurfaceShape) -> Option<usize> {
        let places = || self.skins.iter().enumerate().filter(|(_, skin)| skin.form.is_that_of(form));
        let oldest = places().min_by_key(|(_, skin)| skin.used).map(|(at, _)| at);
        oldest.filter(|_| places().count() == PLACES)
    }

    /// A skin at the positions that it was prepared for.
    pub fn placed(&self, form: &SurfaceShape, positions: &[DVec3]) -> Option<&PlacedSkin> {
        let address = positions.as_ptr().addr();
        self.skins.iter().find(|skin| skin.form.is_that_of(form) && skin.address == address && !skin.boxes.is_empty())
    }
}

impl KnownForm {
    pub fn new(form: &SurfaceShape) -> Self {
        Self {
            vertices: Arc::downgrade(&form.vertices),
            edges: Arc::downgrade(&form.edges),
            triangles: Arc::downgrade(&form.triangles),
            fans: Arc::downgrade(&form.fans),
        }
    }

    /// Whether another owner has it.
    pub fn is_had(&self) -> bool {
        self.fans.strong_count() > 0
    }

    pub fn is_that_of(&self, form: &SurfaceShape) -> bool {
        addr_eq(self.fans.as_ptr(), Arc::as_ptr(&form.fans))
            && addr_eq(self.triangles.as_ptr(), Arc::as_ptr(&form.triangles))
            && addr_eq(self.edges.as_ptr(), Arc::as_ptr(&form.edges))
            && addr_eq(self.vertices.as_ptr(), Arc::as_ptr(&form.vertices))
    }
}

impl PlacedSkin {
    fn new(form: &SurfaceShape, tree: Arc<SkinTree>) -> Self {
        let (positions, boxes, normals) = (vec![], vec![], vec![]);
        Self { form: KnownForm::new(form), address: 0, used: 0, positions, tree, boxes, normals }
    }

    fn move_to(&mut self, form: &SurfaceShape, positions: &[DVec3]) {
        if self.positions == positions {
            return;
        }
        let Self { tree, boxes, normals, .. } = self;
        self.positions.clear();
        self.positions.extend_from_slice(positions);
        tree.fit(positions, boxes);
        normals.clear();
        if form.closed {
            normals.resize(positions.len(), DVec3::ZERO);
            for triangle in form.triangles.iter() {
                let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
                let normal = (b - a).cross(c - a);
                triangle.iter().for_each(|vertex| normals[*vertex as usize] += normal);
            }
        }
    }

    /// The box around its vertices, metres.
    pub fn bounds(&self) -> Aabb {
        self.boxes[0]
    }

    /// For a closed skin the outward normal at each vertex, of any length; none for an open one.
    pub fn normals(&self) -> &[DVec3] {
        &self.normals
    }

    /// The patches in and below boxes for which `is_near` is true, by rising numbers.
    pub fn patches(&self, mut is_near: impl FnMut(Aabb) -> bool) -> impl Iterator<Item = u32> {
        let mut at = 0;
        std::iter::from_fn(move || {
            while let Some(node) = self.tree.nodes.get(at) {
                if !is_near(self.boxes[at]) {
                    at = node.next as usize;
                    continue;
                }
                at += 1;
                if node.next as usize == at {
                    return Some(node.patch);
                }
            }
            None
        })
    }

    /// Whether a patch's box meets a region.
    pub fn meets(&self, region: Aabb) -> bool {
        self.patches(|around| around.meets(region)).next().is_some()
    }

    /// The vertices of a patch.
    pub fn vertices(&self, patch: u32) -> &[u32] {
        self.tree.vertices.of(patch)
    }

    /// The edges of a patch.
    pub fn edges(&self, patch: u32) -> &[u32] {
        self.tree.edges.of(patch)
    }

    /// The triangles of a patch.
    pub fn triangles(&self, patch: u32) -> &[u32] {
        self.tree.triangles.of(patch)
    }
}

impl PatchList {
    /// The list of pairs of a patch and a number.
    fn new(patches: u32, mut pairs: Vec<[u32; 2]>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let start = |patch: u32| pairs.partition_point(|pair| pair[0] < patch) as u32;
        Self { starts: (0..=patches).map(start).collect(), numbers: pairs.iter().map(|pair| pair[1]).collect() }
    }

    fn of(&self, patch: u32) -> &[u32] {
        let [from, to] = [patch, patch + 1].map(|at| self.starts[at as usize] as usize);
        &self.numbers[from..to]
    }
}

/// A part of a skin and the middle of its corners: a triangle, or an edge or a vertex that belongs to none.
struct Part {
    number: u32,
    middle: DVec3,
}

impl SkinTree {
    fn of(form: &SurfaceShape, positions: &[DVec3]) -> Self {
        let Parts { corners, edges } = Parts::of(form);
        let middle = |of: &[u32; 3]| of.iter().map(|corner| positions[*corner as usize]).sum::<DVec3>() / 3.0;
        let mut parts: Vec<Part> =
            (0..).zip(&corners).map(|(number, of)| Part { number, middle: middle(of) }).collect();
        let (mut nodes, mut patch_of) = (vec![], vec![0; parts.len()]);
        let patches = if parts.is_empty() { 0 } else { divide(&mut parts, 0, &mut nodes, &mut patch_of) };
        let mut homes = vec![NONE; positions.len()];
        for (of, patch) in corners.iter().zip(&patch_of) {
            of.iter().for_each(|vertex| homes[*vertex as usize] = homes[*vertex as usize].min(*patch));
        }
        let triangles = (0..).zip(&patch_of).take(form.triangles.len()).map(|(number, patch)| [*patch, number]);
        let edges = (0..).zip(edges).map(|(number, part)| [patch_of[part as usize], number]);
        let vertices = form.vertices.iter().map(|vertex| [homes[*vertex as usize], *vertex]);
        let all = corners.iter().zip(&patch_of).flat_map(|(of, patch)| of.map(|vertex| [*patch, vertex]));
        Self {
            nodes,
            vertices: PatchList::new(patches, vertices.collect()),
            edges: PatchList::new(patches, edges.collect()),
            triangles: PatchList::new(patches, triangles.collect()),
            corners: PatchList::new(patches, all.collect()),
        }
    }

    /// Fits the boxes of all nodes to these positions.
    fn fit(&self, positions: &[DVec3], boxes: &mut Vec<Aabb>) {
        boxes.clear();
        boxes.resize(self.nodes.len(), Aabb::of(&[]));
        for (at, node) in self.nodes.iter().enumerate().rev() {
            boxes[at] = if node.next as usize == at + 1 {
                let corners = self.corners.of(node.patch).iter().map(|vertex| positions[*vertex as usize]);
                corners.fold(Aabb::of(&[]), |Aabb { low, high }, p| Aabb { low: low.min(p), high: high.max(p) })
            } else {
                boxes[at + 1].union(boxes[self.nodes[at + 1].next as usize])
            };
        }
    }
}

/// The parts of a skin: their corners, triangles first, and the part that each edge is of.
struct Parts {
    corners: Vec<[u32; 3]>,
    edges: Vec<u32>,
}

impl Parts {
    fn of(form: &SurfaceShape) -> Self {
        let sorted = |a: u32, b: u32| [a.min(b), a.max(b)];
        let sides_of = |(number, &[a, b, c]): (u32, &[u32; 3])| {
            [sorted(a, b), sorted(b, c), sorted(c, a)].map(|side| (side, number))
        };
        let mut sides: Vec<([u32; 2], u32)> = (0..).zip(form.triangles.iter()).flat_map(sides_of).collect();
        sides.sort_unstable();
        let mut corners = form.triangles.to_vec();
        let mut edges = Vec::with_capacity(form.edges.len());
        for &[a, b] in form.edges.iter() {
            let at = sides.partition_point(|(side, _)| *side < sorted(a, b));
            let of_triangle = sides.get(at).filter(|(side, _)| *side == sorted(a, b)).map(|(_, triangle)| *triangle);
            edges.push(of_triangle.unwrap_or(corners.len() as u32));
            if of_triangle.is_none() {
                corners.push([a, b, b]);
            }
        }
        let mut met: Vec<u32> = corners.iter().flatten().copied().collect();
        met.sort_unstable();
        let lone = form.vertices.iter().filter(|vertex| met.binary_search(vertex).is_err());
        corners.extend(lone.map(|vertex| [*vertex; 3]));
        Self { corners, edges }
    }
}

/// Adds the nodes over some parts, at least one, whose patches are numbered from `patch` on; returns the number after the last.
fn divide(parts: &mut [Part], patch: u32, nodes: &mut Vec<Node>, patch_of: &mut [u32]) -> u32 {
    let at = nodes.len();
    nodes.push(Node { next: 0, patch });
    let after = if parts.len() <= PATCH {
        parts.iter().for_each(|part| patch_of[part.number as usize] = patch);
        patch + 1
    } else {
        let (low, high) = parts.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), part| {
            (low.min(part.middle), high.max(part.middle))
        });
        let axis = (high - low).max_position();
        let half = parts.len() / 2;
        let along = |a: &Part, b: &Part| a.middle[axis].total_cmp(&b.middle[axis]).then(a.number.cmp(&b.number));
        parts.select_nth_unstable_by(half, along);
        let (first, second) = parts.split_at_mut(half);
        let patch = divide(first, patch, nodes, patch_of);
        divide(second, patch, nodes, patch_of)
    };
    nodes[at].next = nodes.len() as u32;
    after
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A grid of triangles, a rope of two edges from its corner, and a vertex alone.
    fn skin() -> SurfaceShape {
        let at = |i: u32, j: u32| i * 6 + j;
        let cells = (0..5).flat_map(|i| (0..5).map(move |j| (i, j)));
        let triangles: Vec<[u32; 3]> = cells
            .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
            .collect();
        let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|[a, b]| [a.min(b), a.max(b)]);
        let mut edges: Vec<[u32; 2]> = sides.chain([[35, 36], [36, 37]]).collect();
        edges.sort_unstable();
        edges.dedup();
        SurfaceShape {
            fans: VoronoiRegions::of(&edges, &triangles).into(),
            vertices: (0..39).collect(),
            edges: edges.into(),
            triangles: triangles.into(),
            radius_m: 0.0,
            edge_m: 0.1,
            closed: false,
        }
    }

    /// The features that meet a region, tested one by one.
    fn within<const N: usize>(features: &[[u32; N]], positions: &[DVec3], region: Aabb) -> Vec<u32> {
        let around = |of: &[u32; N]| Aabb::of(&of.map(|vertex| positions[vertex as usize]));
        (0..).zip(features).filter(|(_, of)| around(of).meets(region)).map(|(number, _)| number).collect()
    }

    proptest! {
        /// Wherever the vertices are, all that meets a region is in a patch that does, and in no other.
        #[test]
        fn a_region_s_patches_hold_what_meets_it_each_once(
            places in prop::collection::vec(prop::collection::vec([0.0..1.0, 0.0..1.0, 0.0..0.2].prop_map(DVec3::from_array), 39), 2),
            centre in [0.0..1.0, 0.0..1.0, 0.0..0.2].prop_map(DVec3::from_array),
            half_m in 0.01..0.4,
        ) {
            let (form, region) = (skin(), Aabb::about(centre, half_m));
            let mut cache = SkinCache::default();
            let mut positions = places[0].clone();
            for place in &places {
                positions.copy_from_slice(place);
                cache.prepare(&form, &positions);
                let skin = cache.placed(&form, &positions).unwrap();
                let near: Vec<u32> = skin.patches(|around| around.meets(region)).collect();
                prop_assert_eq!(skin.meets(region), !near.is_empty());
                let meets = |corners: &[u32]| {
                    Aabb::of(&corners.iter().map(|v| positions[*v as usize]).collect::<Vec<_>>()).meets(region)
                };
                let sorted = |mut list: Vec<u32>| {
                    list.sort_unstable();
                    list
                };
                let vertices = near.iter().flat_map(|p| skin.vertices(*p)).copied().filter(|v| meets(&[*v]));
                let edges = near.iter().flat_map(|p| skin.edges(*p)).copied().filter(|e| meets(&form.edges[*e as usize]));
                let triangles =
                    near.iter().flat_map(|p| skin.triangles(*p)).copied().filter(|t| meets(&form.triangles[*t as usize]));
                let alone: Vec<[u32; 1]> = form.vertices.iter().map(|vertex| [*vertex]).collect();
                prop_assert_eq!(sorted(vertices.collect()), within(&alone, &positions, region));
                prop_assert_eq!(sorted(edges.collect()), within(&form.edges, &positions, region));
                prop_assert_eq!(sorted(triangles.collect()), within(&form.triangles, &positions, region));
            }
        }
    }

    #[test]
    fn two_places_of_one_skin_are_kept_and_a_third_takes_that_of_the_oldest() {
        let form = skin();
        let places: Vec<Vec<DVec3>> = (0..3).map(|k| vec![DVec3::splat(f64::from(k)); 39]).collect();
        let mut cache = SkinCache::default();
        places.iter().take(2).for_each(|place| cache.prepare(&form, place));
        let low = |cache: &SkinCache, k: usize| cache.placed(&form, &places[k]).map(|skin| skin.bounds().low.x);
        assert_eq!([low(&cache, 0), low(&cache, 1)], [Some(0.0), Some(1.0)]);
        cache.prepare(&form, &places[2]);
        assert_eq!([low(&cache, 0), low(&cache, 1), low(&cache, 2)], [None, Some(1.0), Some(2.0)]);
    }

    #[test]
    fn a_skin_that_nobody_has_any_more_is_dropped() {
        let mut cache = SkinCache::default();
        let places = [vec![DVec3::ZERO; 39], vec![DVec3::ONE; 39]];
        for _ in 0..3 {
            let form = skin();
            places.iter().for_each(|place| cache.prepare(&form, place));
        }
        assert_eq!(cache.skins.len(), 2);
    }
}
