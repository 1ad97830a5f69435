//! Points in a uniform hash grid: all pairs within one cell's size of each other, in O(N); boxes in one: all that meet a region.
//!
//! In: points or boxes and the size of a cell. Out: pairs of point indices, or indices of boxes, each once.
//! Nothing is allocated once the sizes settle.

use crate::Aabb;
use glam::{DVec3, IVec3};

/// The grid: points sorted by the hash of their cell.
#[derive(Debug, Clone, Default)]
pub struct Grid {
    cells: Vec<IVec3>,
    /// Start of each bucket in `sorted`; one entry more than buckets.
    starts: Vec<u32>,
    sorted: Vec<u32>,
}

/// Half of the 26 neighbours of a cell: pairs with the other half are visited from the neighbour's side.
const HALF: [IVec3; 13] = [
    IVec3::new(1, 0, 0),
    IVec3::new(-1, 1, 0),
    IVec3::new(0, 1, 0),
    IVec3::new(1, 1, 0),
    IVec3::new(-1, -1, 1),
    IVec3::new(0, -1, 1),
    IVec3::new(1, -1, 1),
    IVec3::new(-1, 0, 1),
    IVec3::new(0, 0, 1),
    IVec3::new(1, 0, 1),
    IVec3::new(-1, 1, 1),
    IVec3::new(0, 1, 1),
    IVec3::new(1, 1, 1),
];

impl Grid {
    /// Sorts `points` into cells of `cell_m` metres.
    pub fn fill(&mut self, points: impl Iterator<Item = DVec3>, cell_m: f64) {
        self.cells.clear();
        self.cells.extend(points.map(|p| (p / cell_m).floor().as_ivec3()));
        let buckets = (2 * self.cells.len()).next_power_of_two();
        self.starts.clear();
        self.starts.resize(buckets + 1, 0);
        for cell in &self.cells {
            self.starts[bucket(*cell, buckets) + 1] += 1;
        }
        for b in 0..buckets {
            self.starts[b + 1] += self.starts[b];
        }
        self.sorted.clear();
        self.sorted.resize(self.cells.len(), 0);
        // filled backwards, so that each bucket is sorted in ascending order and its entry in `starts` ends at its start
        for (i, cell) in self.cells.iter().enumerate().rev() {
            let end = &mut self.starts[bucket(*cell, buckets) + 1];
            *end -= 1;
            self.sorted[*end as usize] = i as u32;
        }
        self.starts.rotate_left(1);
        self.starts[buckets] = self.cells.len() as u32;
    }

    /// Visits all pairs in the same or in neighbouring cells, each once.
    pub fn near_pairs(&self, mut visit: impl FnMut(u32, u32)) {
        let buckets = self.starts.len() - 1;
        let within = |cell: IVec3| {
            let b = bucket(cell, buckets);
            let range = self.starts[b] as usize..self.starts[b + 1] as usize;
            self.sorted[range].iter().copied().filter(move |&j| self.cells[j as usize] == cell)
        };
        for (i, &cell) in (0_u32..).zip(&self.cells) {
            within(cell).filter(|&j| j > i).for_each(|j| visit(i, j));
            for step in HALF {
                within(cell.wrapping_add(step)).for_each(|j| visit(i, j));
            }
        }
    }
}

/// Boxes in a uniform hash grid, which finds the boxes that meet a region, each once.
#[derive(Debug, Clone, Default)]
pub struct BoxGrid {
    cell_m: f64,
    /// The lowest and the highest cell of each box.
    ranges: Vec<[IVec3; 2]>,
    /// Start of each bucket in `entries`; one entry more than buckets.
    starts: Vec<u32>,
    /// A cell, and a box in it.
    entries: Vec<(IVec3, u32)>,
    /// Boxes in too many cells; they are always visited.
    wide: Vec<u32>,
}

/// A box in more cells than this is in none, and a region of more than this many is compared with every box.
const CELLS_MAX: f64 = 64.0;

impl BoxGrid {
    /// Sorts `boxes` into cells of `cell_m` metres, > 0.
    pub fn fill(&mut self, boxes: impl Iterator<Item = Aabb>, cell_m: f64) {
        let Self { ranges, starts, entries, wide, .. } = self;
        self.cell_m = cell_m;
        ranges.clear();
        wide.clear();
        for (number, around) in (0..).zip(boxes) {
            let range = cells_of(around, cell_m);
            if range.is_none() {
                wide.push(number);
            }
            // no cell is in a range that ends before it begins
            ranges.push(range.unwrap_or([IVec3::ONE, IVec3::ZERO]));
        }
        let buckets = (2 * ranges.len()).next_power_of_two();
        starts.clear();
        starts.resize(buckets + 1, 0);
        let visit = |ranges: &[[IVec3; 2]], each: CellVisitor<'_>| {
            (0_u32..).zip(ranges).for_each(|(number, range)| each_cell(*range, |cell| each(cell, number)));
        };
        visit(ranges, &mut |cell, _| starts[bucket(cell, buckets) + 1] += 1);
        for b in 0..buckets {
            starts[b + 1] += starts[b];
        }
        entries.clear();
        entries.resize(starts[buckets] as usize, (IVec3::ZERO, 0));
        // each bucket's start moves to its end, and then back by one place
        visit(ranges, &mut |cell, number| {
            let at = &mut starts[bucket(cell, buckets)];
            entries[*at as usize] = (cell, number);
            *at += 1;
        });
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// Visits every box that meets `region`, and some near it, each once.
    pub fn visit(&self, region: Aabb, mut visit: impl FnMut(u32)) {
        let Some([low, high]) = cells_of(region, self.cell_m) else {
            (0..self.ranges.len() as u32).for_each(visit);
            return;
        };
        self.wide.iter().for_each(|number| visit(*number));
        let buckets = self.starts.len() - 1;
        each_cell([low, high], |cell| {
            let b = bucket(cell, buckets);
            for (at, number) in &self.entries[self.starts[b] as usize..self.starts[b + 1] as usize] {
                // of the cells that a box shares with the region the lowest one counts
                if *at == cell && self.ranges[*number as usize][0].max(low) == cell {
                    visit(*number);
                }
            }
        });
    }
}

/// A visitor of a cell and the number of a box in it.
type CellVisitor<'a> = &'a mut dyn FnMut(IVec3, u32);

/// The lowest and the highest cell of a box; `None` for too many.
fn cells_of(Aabb { low, high }: Aabb, cell_m: f64) -> Option<[IVec3; 2]> {
    let [low, high] = [low, high].map(|corner| (corner / cell_m).floor());
    let cells = (high - low + 1.0).to_array();
    let few = cells.iter().all(|count| *count >= 1.0) && cells.iter().product::<f64>() <= CELLS_MAX;
    few.then(|| [low.as_ivec3(), high.as_ivec3()])
}

fn each_cell([low, high]: [IVec3; 2], mut visit: impl FnMut(IVec3)) {
    for x in low.x..=high.x {
        for y in low.y..=high.y {
            (low.z..=high.z).for_each(|z| visit(IVec3::new(x, y, z)));
        }
    }
}

fn bucket(cell: IVec3, buckets: usize) -> usize {
    // large primes, as suggested for grids in (TEA03)
    let mixed = cell.x.wrapping_mul(73_856_093) ^ cell.y.wrapping_mul(19_349_663) ^ cell.z.wrapping_mul(83_492_791);
    (mixed as u32 ^ (mixed as u32 >> 15)) as usize & (buckets - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_pair_within_a_cell_is_visited_once(
            points in prop::collection::vec([-2.0..2.0, -2.0..2.0, -2.0..2.0].prop_map(DVec3::from_array), 1..80),
        ) {
            let mut grid = Grid::default();
            for cell_m in [0.9, 0.3] {
                grid.fill(points.iter().copied(), cell_m);
                let mut seen = Vec::new();
                grid.near_pairs(|i, j| seen.push((i.min(j), i.max(j))));
                let visits = seen.len();
                seen.sort_unstable();
                seen.dedup();
                prop_assert_eq!(visits, seen.len());
                for i in 0..points.len() {
                    for j in i + 1..points.len() {
                        let near = points[i].distance(points[j]) <= cell_m;
                        prop_assert!(!near || seen.binary_search(&(i as u32, j as u32)).is_ok());
                    }
                }
            }
        }

        #[test]
        fn every_box_that_meets_a_region_is_visited_once(
            corners in prop::collection::vec([-2.0..2.0, -2.0..2.0, -2.0..2.0].prop_map(DVec3::from_array), 2..80),
            half_m in 0.01..0.6,
        ) {
            let boxes: Vec<Aabb> = corners.windows(2).map(|ends| Aabb::of(&[ends[0], ends[0].lerp(ends[1], half_m)])).collect();
            let mut grid = BoxGrid::default();
            for cell_m in [0.9, 0.2] {
                grid.fill(boxes.iter().copied(), cell_m);
                for corner in &corners {
                    let region = Aabb::about(*corner, half_m);
                    let mut seen = Vec::new();
                    grid.visit(region, |number| seen.push(number));
                    let visits = seen.len();
                    seen.sort_unstable();
                    seen.dedup();
                    prop_assert_eq!(visits, seen.len());
                    for (number, around) in (0_u32..).zip(&boxes) {
                        prop_assert!(!around.meets(region) || seen.binary_search(&number).is_ok());
                    }
                }
            }
        }
    }
}
