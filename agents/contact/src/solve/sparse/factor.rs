//! Sparse Cholesky factor of a symmetric positive definite matrix of 3 × 3 blocks, front by front (DR83).
//!
//! In: which blocks there are, then their numbers. Out: solutions. Never here: where the matrix comes from.
//! The order and the fronts are kept while all blocks lie in them, fill included; numbers then change without allocation, and only
//! the fronts are factored again in or below which a number has changed. Trees of fronts that are dear enough are made side by side.

mod pass;

use super::fronts::{Front, Fronts};
use super::order::minimum_degree;
use super::tiles::{TILE, TILE_SIZE, filled, solve_down, solve_up, triangle};
use crate::lists::refill;
use crate::solve::statement::problem::Block;
use fearless_simd::{Level, dispatch};
use glam::{DMat3, DVec3};
use metachron_core::{Archive, ArchiveError, ParallelFor, archive_values};
use pass::{Part, Pass};

/// Two blocks that are coupled, in either order; a block with itself is its diagonal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Pair {
    pub row: usize,
    pub column: usize,
}

impl Pair {
    pub fn of(block: &Block) -> Self {
        Self { row: block.row, column: block.column }
    }
}

/// Where a block is stored, and whether as its transpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    /// The front.
    pub front: usize,
    /// Its row and column of numbers within the front.
    row: usize,
    column: usize,
    transposed: bool,
}

/// The numbers of one front's columns, to which blocks are added.
#[derive(Debug)]
pub(crate) struct Entries<'a> {
    values: &'a mut [f64],
    /// From one chunk of rows to the next.
    chunk: usize,
}

/// An order made for an earlier structure is kept while its factor costs up to this many times as much as it did then.
const KEEP_ORDER: f64 = 1.5;

/// How often the numbers of blocks that change are expected to change after the first factor: a problem takes three or four Newton steps.
const CHANGES: f64 = 3.0;

/// Where the numbers of a front are.
#[derive(Debug, Clone, Copy, Default)]
struct Layout {
    /// Columns and rows of numbers, in whole tiles.
    columns: usize,
    rows: usize,
    /// The start of its columns, of the triangle that it hands on, and of the targets of its rows in its parent.
    lower: usize,
    update: usize,
    targets: usize,
    /// How many of its rows are columns of its parent.
    inner: usize,
}

/// Where a row of numbers of a front goes in its parent: as a row among eliminated columns and among others, and as a column.
#[derive(Debug, Clone, Copy, Default)]
struct Target {
    near: usize,
    far: usize,
    column: usize,
}

/// A matrix with its factor.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cholesky {
    /// The order as it was made, and the cost then of its factor and of changes of it.
    order: Vec<usize>,
    fresh_cost: f64,
    fronts: Fronts,
    layouts: Vec<Layout>,
    children: Vec<Vec<usize>>,
    /// The first front of the tree below each, which ends with it.
    trees: Vec<usize>,
    targets: Vec<Target>,
    /// The front of each place in the order.
    owners: Vec<usize>,
    /// The couplings of the last matrix, where each is stored, and whether there is room for all.
    known: Vec<Pair>,
    places: Vec<Option<Place>>,
    roomy: bool,
    /// The matrix, and the one before while a new one is filled in.
    base: Vec<f64>,
    before: Vec<f64>,
    lower: Vec<f64>,
    update: Vec<f64>,
    /// Fronts whose numbers are no longer those of the matrix.
    stale: Vec<bool>,
    /// The cost of the stale fronts before each front, and of all.
    costs: Vec<f64>,
    permuted: Vec<DVec3>,
    local: Vec<f64>,
}

impl Cholesky {
    /// Writes or reads the order of elimination, from which the bits of a solution follow: it is that of the matrices that came before. The
    /// numbers are made anew.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.order, self.fresh_cost, self.fronts)?;
        if archive.is_reading() {
            self.fronts.check()?;
            self.lay_out();
        }
        Ok(())
    }

    /// Whether there is room for a matrix of `size` blocks with these couplings.
    pub fn fits(&self, size: usize, pairs: &[Pair]) -> bool {
        let known = self.roomy && self.known == pairs;
        self.fronts.rank.len() == size && (known || pairs.iter().all(|&pair| self.place(pair).is_some()))
    }

    /// Whether the order still serves a matrix of which these blocks change from factor to factor.
    pub fn serves(&self, changes: &[bool]) -> bool {
        let most = KEEP_ORDER * self.fresh_cost;
        let at_most = (1.0 + CHANGES) * self.fronts.cost;
        changes.is_empty() || at_most <= most || expected_cost(&self.fronts, changes) <= most
    }

    /// Makes room for a matrix of `size` blocks with these couplings, of which some change from factor to factor (none where the list is
    /// empty); returns whether the structure is a new one.
    pub fn shape(&mut self, size: usize, pairs: &[Pair], changes: &[bool]) -> bool {
        if self.fits(size, pairs) && self.serves(changes) {
            return false;
        }
        let neighbours = neighbours(size, pairs);
        let kept = (self.order.len() == size).then(|| Fronts::new(&neighbours, &self.order));
        let serving = |fronts: &Fronts| expected_cost(fronts, changes) <= KEEP_ORDER * self.fresh_cost;
        self.fronts = kept.filter(serving).unwrap_or_else(|| {
            let Ordered { order, fronts } = Ordered::cheapest(&neighbours, changes);
            self.order = order;
            self.fresh_cost = expected_cost(&fronts, changes);
            fronts
        });
        self.lay_out();
        self.known.reserve(pairs.len());
        self.places.reserve(pairs.len());
        true
    }

    /// The cost that a factor of a matrix with these couplings would have, about in multiplications.
    pub fn cost_of(size: usize, pairs: &[Pair]) -> f64 {
        let neighbours = neighbours(size, pairs);
        Ordered::new(&neighbours, &[]).fronts.cost
    }

    /// Storage for the fronts as they are.
    fn lay_out(&mut self) {
        let Self { fronts, layouts, children, trees, targets, .. } = self;
        let count = fronts.fronts.len();
        layouts.clear();
        targets.clear();
        self.known.clear();
        self.roomy = false;
        *children = vec![Vec::new(); count];
        self.owners = vec![0; fronts.rank.len()];
        trees.clear();
        let mut next = Layout::default();
        for (k, front) in fronts.fronts.iter().enumerate() {
            self.owners[front.first..front.first + front.columns].fill(k);
            let (columns, rows) = (filled(3 * front.columns), filled(3 * front.rows.len()));
            layouts.push(Layout { columns, rows, ..next });
            next.lower += columns * (columns + rows);
            next.update += triangle(rows / TILE);
            next.targets += 3 * front.rows.len();
            if let Some(parent) = front.parent {
                children[parent].push(k);
            }
            trees.push(children[k].first().map_or(k, |&child| trees[child]));
        }
        targets.reserve(next.targets);
        for k in 0..count {
            let front = &fronts.fronts[k];
            let Some(parent) = front.parent else { continue };
            let (above, room) = (&fronts.fronts[parent], layouts[parent].columns);
            layouts[k].inner = 3 * front.rows.iter().filter(|&&row| row < above.first + above.columns).count();
            for &row in &front.rows {
                let start = above.coordinate(row, room).unwrap_or_default();
                targets.extend((start..start + 3).map(|at| Target::new(at, room)));
            }
        }
        let longest = layouts.iter().map(|layout| layout.columns + layout.rows).max().unwrap_or_default();
        self.local = vec![0.0; longest];
        self.base = vec![0.0; next.lower];
        self.before = vec![f64::NAN; next.lower];
        self.lower = vec![0.0; next.lower];
        self.update = vec![0.0; next.update];
        self.stale = vec![true; count];
        self.costs = vec![0.0; count + 1];
        self.permuted = vec![DVec3::ZERO; self.owners.len()];
    }

    /// The cost of a factor, about in multiplications.
    pub fn cost(&self) -> f64 {
        self.fronts.cost
    }

    /// Where a block is stored; `None` where the structure has no room for it.
    pub fn place(&self, pair: Pair) -> Option<Place> {
        let rank = &self.fronts.rank;
        let [row, column] = [*rank.get(pair.row)?, *rank.get(pair.column)?];
        let [low, high] = [row.min(column), row.max(column)];
        let front = self.owners[low];
        let of = &self.fronts.fronts[front];
        let row_at = of.coordinate(high, self.layouts[front].columns)?;
        Some(Place { front, row: row_at, column: 3 * (low - of.first), transposed: row < column })
    }

    /// How many fronts there are.
    pub fn len(&self) -> usize {
        self.layouts.len()
    }

    /// A new matrix, of the blocks that there is room for. Fronts whose numbers are the last one's need no new factor.
    pub fn set(&mut self, blocks: &[Block]) {
        std::mem::swap(&mut self.base, &mut self.before);
        self.base.fill(0.0);
        for (front, layout) in self.fronts.fronts.iter().zip(&self.layouts) {
            let mut entries = Entries::of(&mut self.base, layout);
            (3 * front.columns..layout.columns).for_each(|at| *entries.at(at, at) = 1.0);
        }
        self.find_places(blocks);
        for (block, place) in blocks.iter().zip(&self.places) {
            if let Some(place) = *place {
                Entries::of(&mut self.base, &self.layouts[place.front]).add(place, &block.value);
            }
        }
        for (layout, stale) in self.layouts.iter().zip(&mut self.stale) {
            // also where one is not a number
            *stale |= layout.of(&self.base) != layout.of(&self.before);
        }
    }

    /// Where these blocks are stored, found anew where they are not those of the last matrix.
    fn find_places(&mut self, blocks: &[Block]) {
        if self.roomy && self.known.iter().copied().eq(blocks.iter().map(Pair::of)) {
            return;
        }
        refill(&mut self.known, blocks.iter().map(Pair::of));
        let mut places = std::mem::take(&mut self.places);
        refill(&mut places, self.known.iter().map(|&pair| self.place(pair)));
        self.roomy = places.iter().all(Option::is_some);
        self.places = places;
    }

    /// Has a front factored again.
    pub fn spoil(&mut self, front: usize) {
        self.stale[front] = true;
    }

    /// Factors the matrix and the terms that `more` adds to the columns of each front, where numbers have changed.
    ///
    /// # Errors
    /// A block at which the matrix is not positive definite.
    pub fn factor(
        &mut self,
        threads: &dyn ParallelFor,
        more: impl Fn(usize, &mut Entries<'_>) + Sync,
    ) -> Result<(), usize> {
        let count = self.layouts.len();
        if count == 0 {
            return Ok(());
        }
        let mut cost = 0.0;
        for (front, of) in self.fronts.fronts.iter().enumerate() {
            self.costs[front] = cost;
            if self.stale[front] {
                cost += of.cost;
                of.parent.into_iter().for_each(|parent| self.stale[parent] = true);
            }
        }
        self.costs[count] = cost;
        let mut all = Part { fronts: 0..count, lower: &mut self.lower, update: &mut self.update };
        let pass = Pass {
            level: Level::new(),
            fronts: &self.fronts.fronts,
            layouts: &self.layouts,
            children: &self.children,
            trees: &self.trees,
            targets: &self.targets,
            base: &self.base,
            stale: &self.stale,
            costs: &self.costs,
            more: &more,
            threads,
        };
        let made = pass.factor(&mut all);
        self.stale.fill(made.is_err());
        made.map_err(|rank| self.fronts.rank.iter().position(|&r| r == rank).unwrap_or_default())
    }

    /// Replaces the right side, one vector for each block, by the solution; the matrix must be factored.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        dispatch!(Level::new(), _ => self.solve_by(x));
    }

    #[inline(always)]
    fn solve_by(&mut self, x: &mut [DVec3]) {
        let Self { fronts, layouts, lower, permuted, local, .. } = self;
        fronts.rank.iter().zip(&*x).for_each(|(&rank, value)| permuted[rank] = *value);
        for (front, layout) in fronts.fronts.iter().zip(&*layouts) {
            let local = &mut local[..layout.columns + layout.rows];
            local.fill(0.0);
            front.load_columns(permuted, local);
            solve_down(layout.of(lower), layout.columns, local);
            front.store_columns(local, permuted);
            for (&row, given) in front.rows.iter().zip(local[layout.columns..].as_chunks::<3>().0) {
                permuted[row] += DVec3::from_array(*given);
            }
        }
        for (front, layout) in fronts.fronts.iter().zip(&*layouts).rev() {
            let local = &mut local[..layout.columns + layout.rows];
            local.fill(0.0);
            front.load_columns(permuted, local);
            for (&row, known) in front.rows.iter().zip(local[layout.columns..].as_chunks_mut::<3>().0) {
                *known = permuted[row].to_array();
            }
            solve_up(layout.of(lower), layout.columns, local);
            front.store_columns(local, permuted);
        }
        fronts.rank.iter().zip(x).for_each(|(&rank, value)| *value = permuted[rank]);
    }
}

/// The cost of a factor and of the changes to come, about in multiplications.
fn expected_cost(fronts: &Fronts, changes: &[bool]) -> f64 {
    fronts.cost + CHANGES * fronts.changed(changes)
}

/// An order of elimination with its fronts.
struct Ordered {
    order: Vec<usize>,
    fronts: Fronts,
}

impl Ordered {
    fn new(neighbours: &[Vec<usize>], late: &[bool]) -> Self {
        let order = minimum_degree(neighbours, late);
        Self { fronts: Fronts::new(neighbours, &order), order }
    }

    /// The order that costs least, changes included: with few blocks that change, these last, so that all else is factored once.
    fn cheapest(neighbours: &[Vec<usize>], changes: &[bool]) -> Self {
        let plain = Self::new(neighbours, &[]);
        let changing = changes.iter().filter(|changes| **changes).count();
        if changing == 0 || 2 * changing > changes.len() {
            return plain;
        }
        let last = Self::new(neighbours, changes);
        let is_cheaper = expected_cost(&last.fronts, changes) < expected_cost(&plain.fronts, changes);
        if is_cheaper { last } else { plain }
    }
}

/// The blocks that each block is coupled with.
fn neighbours(size: usize, pairs: &[Pair]) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); size];
    for pair in pairs.iter().filter(|pair| pair.row != pair.column) {
        neighbours[pair.row].push(pair.column);
        neighbours[pair.column].push(pair.row);
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    neighbours
}

impl Front {
    /// The first row of numbers of a block, by its place in the order, where eliminated columns have this room.
    fn coordinate(&self, rank: usize, room: usize) -> Option<usize> {
        if rank < self.first + self.columns {
            return rank.checked_sub(self.first).map(|at| 3 * at);
        }
        self.rows.binary_search(&rank).ok().map(|at| room + 3 * at)
    }

    fn load_columns(&self, from: &[DVec3], local: &mut [f64]) {
        let own = &from[self.first..self.first + self.columns];
        local.as_chunks_mut::<3>().0.iter_mut().zip(own).for_each(|(x, value)| *x = value.to_array());
    }

    fn store_columns(&self, local: &[f64], to: &mut [DVec3]) {
        let own = &mut to[self.first..self.first + self.columns];
        own.iter_mut().zip(local.as_chunks::<3>().0).for_each(|(value, x)| *value = DVec3::from_array(*x));
    }
}

impl Layout {
    /// How many numbers its columns have.
    fn size(&self) -> usize {
        self.columns * (self.columns + self.rows)
    }

    fn of<'a>(&self, lower: &'a [f64]) -> &'a [f64] {
        &lower[self.lower..self.lower + self.size()]
    }
}

impl Target {
    /// The target of a row of numbers, in a front whose eliminated columns have this room.
    fn new(at: usize, room: usize) -> Self {
        let near = at / TILE * TILE * room + at % TILE;
        match at.checked_sub(room) {
            None => Self { near, far: 0, column: TILE * at },
            Some(below) => {
                let far = triangle(below / TILE) + below % TILE;
                Self { near, far, column: below / TILE * TILE_SIZE + below % TILE * TILE }
            }
        }
    }
}

impl Entries<'_> {
    fn of<'a>(lower: &'a mut [f64], layout: &Layout) -> Entries<'a> {
        Entries { values: &mut lower[layout.lower..], chunk: TILE * layout.columns }
    }

    fn at(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.values[row / TILE * self.chunk + TILE * column + row % TILE]
    }

    /// Adds to a block of this front.
    pub fn add(&mut self, place: Place, value: &DMat3) {
        let value = if place.transposed { value.transpose() } else { *value };
        for (row, start) in (place.row..place.row + 3).map(|row| row / TILE * self.chunk + row % TILE).enumerate() {
            for (k, number) in value.row(row).to_array().into_iter().enumerate() {
                self.values[start + TILE * (place.column + k)] += number;
            }
        }
    }
}
