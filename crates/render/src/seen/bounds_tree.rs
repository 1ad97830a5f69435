//! A hierarchy of bounding boxes over everything that can be drawn: the items that a view may show are found without
//! asking each object.
//!
//! In: a box for each item, again whenever it moves. Out: the items whose boxes pass a test that every box around them passes as well.
//! Never here: the test itself.

use glam::DVec3;

/// The tree is built anew once its boxes have grown to this many times the surface that they were built with: movers have mixed it up.
const GROWN: f64 = 2.0;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingBox {
    pub low: DVec3,
    pub high: DVec3,
}

impl BoundingBox {
    /// The box of nothing.
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// The box of anything: of an object whose bounds are unknown.
    pub const ALL: Self = Self { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };

    /// A box around `centre`; [`Self::ALL`] where a number is not finite.
    pub fn around(centre: DVec3, half: DVec3) -> Self {
        let all = Self { low: centre - half, high: centre + half };
        if all.low.is_finite() && all.high.is_finite() { all } else { Self::ALL }
    }

    fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half its surface, m²; 0 where it has none or it is not finite.
    fn area(self) -> f64 {
        let size = self.high - self.low;
        let area = size.x * size.y + size.y * size.z + size.z * size.x;
        if size.min_element() >= 0.0 && area.is_finite() { area } else { 0.0 }
    }
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: BoundingBox,
    parent: u32,
    /// The two nodes below it, adjacent; or the item of a leaf.
    first: u32,
    is_leaf: bool,
}

/// A binary tree of boxes, with an item in each leaf.
#[derive(Debug, Default)]
pub struct BoundsTree {
    nodes: Vec<Node>,
    /// The leaf of each item.
    leaves: Vec<u32>,
    boxes: Vec<BoundingBox>,
    /// Surface of all nodes, now and when the tree was built, m².
    area: f64,
    built_area: f64,
    stack: Vec<u32>,
}

impl BoundsTree {
    /// Number of items.
    pub fn len(&self) -> usize {
        self.boxes.len()
    }

    /// Gives every item its box; the tree is built anew.
    pub fn build(&mut self, boxes: impl Iterator<Item = BoundingBox>) {
        self.boxes.clear();
        self.boxes.extend(boxes);
        self.rebuild();
    }

    /// Moves an item; the boxes around it follow.
    pub fn set(&mut self, item: usize, bounds: BoundingBox) {
        if self.boxes[item] == bounds {
            return;
        }
        self.boxes[item] = bounds;
        let mut at = self.leaves[item] as usize;
        let mut now = bounds;
        loop {
            let node = &mut self.nodes[at];
            if node.bounds == now {
                break;
            }
            self.area += now.area() - node.bounds.area();
            node.bounds = now;
            if at == 0 {
                break;
            }
            at = node.parent as usize;
            let first = self.nodes[at].first as usize;
            now = self.nodes[first].bounds.with(self.nodes[first + 1].bounds);
        }
        if self.area > GROWN * self.built_area && self.built_area > 0.0 {
            self.rebuild();
        }
    }

    /// Calls `found` with each item whose box and all boxes around it pass `test`.
    pub fn find(&mut self, test: impl Fn(&BoundingBox) -> bool, mut found: impl FnMut(usize)) {
        self.stack.clear();
        self.stack.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(at) = self.stack.pop() {
            let node = &self.nodes[at as usize];
            if !test(&node.bounds) {
                continue;
            }
            if node.is_leaf {
                found(node.first as usize);
            } else {
                self.stack.extend([node.first + 1, node.first]);
            }
        }
    }

    fn rebuild(&mut self) {
        let count = self.boxes.len();
        self.nodes.clear();
        self.leaves.clear();
        self.leaves.resize(count, 0);
        if count == 0 {
            return;
        }
        let mut items: Vec<u32> = (0..count as u32).collect();
        self.nodes.push(Node { bounds: BoundingBox::EMPTY, parent: 0, first: 0, is_leaf: false });
        self.split(0, &mut items);
        self.area = self.nodes.iter().map(|node| node.bounds.area()).sum();
        self.built_area = self.area;
    }

    /// Fills a node with items, halved along the axis on which their middles spread most.
    fn split(&mut self, at: usize, items: &mut [u32]) {
        if let [item] = *items {
            self.leaves[item as usize] = at as u32;
            self.nodes[at] = Node { bounds: self.boxes[item as usize], first: item, is_leaf: true, ..self.nodes[at] };
            return;
        }
        let middle = |item: u32| {
            let BoundingBox { low, high } = self.boxes[item as usize];
            let middle = 0.5 * (low + high);
            if middle.is_finite() { middle } else { DVec3::ZERO }
        };
        let (low, high) = items.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), item| {
            (low.min(middle(*item)), high.max(middle(*item)))
        });
        let axis = (high - low).max_position();
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| middle(*a)[axis].total_cmp(&middle(*b)[axis]).then(a.cmp(b)));
        let first = self.nodes.len() as u32;
        let below = Node { bounds: BoundingBox::EMPTY, parent: at as u32, first: 0, is_leaf: false };
        self.nodes.extend([below; 2]);
        let (left, right) = items.split_at_mut(half);
        self.split(first as usize, left);
        self.split(first as usize + 1, right);
        let bounds = self.nodes[first as usize].bounds.with(self.nodes[first as usize + 1].bounds);
        self.nodes[at] = Node { bounds, first, ..self.nodes[at] };
    }
}

/// Pseudo-random numbers for tests: splitmix.
#[cfg(test)]
pub struct Random(pub u64);

#[cfg(test)]
impl Random {
    /// A number in 0 … 1, without 1.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 11) as f64 * 2.0_f64.powi(-53)
    }

    /// A point in the unit cube.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random_boxes(count: usize, random: &mut Random) -> Vec<BoundingBox> {
        (0..count).map(|_| BoundingBox::around(10.0 * random.point(), 0.5 * random.point())).collect()
    }

    fn overlaps(a: &BoundingBox, b: &BoundingBox) -> bool {
        a.low.cmple(b.high).all() && b.low.cmple(a.high).all()
    }

    #[test]
    fn a_tree_finds_what_a_search_of_all_items_finds_while_they_move() {
        let mut random = Random(7);
        let mut boxes = random_boxes(300, &mut random);
        let mut tree = BoundsTree::default();
        tree.build(boxes.iter().copied());
        for round in 0..200 {
            for moved in random_boxes(7, &mut random) {
                let item = (random.next() * boxes.len() as f64) as usize;
                boxes[item] = if round % 50 == 3 { BoundingBox::EMPTY } else { moved };
                tree.set(item, boxes[item]);
            }
            let wanted = random_boxes(1, &mut random)[0];
            let mut found = Vec::new();
            tree.find(|bounds| overlaps(bounds, &wanted), |item| found.push(item));
            found.sort_unstable();
            let expected: Vec<_> = (0..boxes.len()).filter(|item| overlaps(&boxes[*item], &wanted)).collect();
            assert_eq!(found, expected, "round {round}");
        }
    }

    #[test]
    fn a_small_view_of_many_objects_tests_few_of_them() {
        let cell = |k: u32| DVec3::new(f64::from(k % 100), f64::from(k / 100), 0.0);
        let mut tree = BoundsTree::default();
        tree.build((0..10_000).map(|k| BoundingBox::around(cell(k), DVec3::splat(0.3))));
        let wanted = BoundingBox::around(DVec3::new(50.0, 50.0, 0.0), DVec3::splat(2.0));
        let (tests, mut found) = (std::cell::Cell::new(0), 0);
        let test = |bounds: &BoundingBox| {
            tests.set(tests.get() + 1);
            overlaps(bounds, &wanted)
        };
        tree.find(test, |_| found += 1);
        assert_eq!(found, 25);
        assert!(tests.get() < 200, "{} tests of 10,000 objects", tests.get());
    }

    #[test]
    fn an_object_without_bounds_is_found_everywhere_and_an_empty_tree_has_none() {
        let mut tree = BoundsTree::default();
        tree.find(|_| true, |_| panic!("found in an empty tree"));
        tree.build([BoundingBox::EMPTY, BoundingBox::around(DVec3::NAN, DVec3::ONE)].into_iter());
        let point = BoundingBox::around(DVec3::ONE, DVec3::ZERO);
        let mut found = Vec::new();
        tree.find(|bounds| overlaps(bounds, &point), |item| found.push(item));
        assert_eq!(found, [1]);
    }
}
