//! Points in a uniform hash grid: all pairs within one cell's size of each other, in O(N).
//!
//! In: points and the size of a cell. Out: pairs of point indices, each once. Nothing is allocated once the sizes settle.

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
    }
}
