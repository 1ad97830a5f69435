//! The fronts of a sparse factor (DR83): which blocks are eliminated together, and which rows they reach.
//!
//! In: the neighbours of each block, and an order. Out: fronts, each after those below it. Never here: numbers of the matrix.
//! A front takes up one below it where that is cheaper by [`Size::cost`], zeros that it stores then included.

use metachron_core::ArchiveError;

/// A group of blocks that are eliminated together.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Front {
    /// The first of its blocks in the order of elimination, and how many they are.
    pub first: usize,
    pub columns: usize,
    /// The later blocks that they are coupled with, by rising places in the order.
    pub rows: Vec<usize>,
    /// The front that takes up the rest of this one.
    pub parent: Option<usize>,
    /// Its cost, about in multiplications.
    pub cost: f64,
}

/// All fronts of a matrix.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Fronts {
    pub fronts: Vec<Front>,
    /// Where each block stands in the order of elimination.
    pub rank: Vec<usize>,
    /// The cost of a factor, about in multiplications.
    pub cost: f64,
}

/// Blocks of a front, eliminated and others.
#[derive(Debug, Clone, Copy)]
struct Size {
    columns: usize,
    rows: usize,
}

/// The cost of a front besides multiplications, in these: by itself, and for each number that it hands on.
const COST_FRONT: f64 = 1000.0;
const COST_NUMBER: f64 = 4.0;

impl Size {
    fn cost(self) -> f64 {
        let [columns, rows] = [self.columns, self.rows].map(|blocks| super::tiles::filled(3 * blocks) as f64);
        let all = columns + rows;
        (all * all * all - rows * rows * rows) / 6.0 + COST_NUMBER * (columns * all + 0.5 * rows * rows) + COST_FRONT
    }
}

/// The tree of columns while fronts are made of it; places are those of the order given.
struct Tree {
    /// The later columns that each is coupled with.
    rows: Vec<Vec<usize>>,
    children: Vec<Vec<usize>>,
    /// The columns of the front that ends with each column.
    columns: Vec<Vec<usize>>,
}

impl Fronts {
    /// Checks that fronts which were read belong to one matrix.
    ///
    /// # Errors
    /// [`ArchiveError::Mismatch`].
    pub fn check(&self) -> Result<(), ArchiveError> {
        let size = self.rank.len();
        let mut next = 0;
        let is_sound = self.fronts.iter().enumerate().all(|(at, front)| {
            let follows = front.first == next && front.columns <= size - next;
            next += if follows { front.columns } else { 0 };
            let rows = front.rows.is_sorted_by(|a, b| a < b) && front.rows.iter().all(|row| (next..size).contains(row));
            follows && rows && front.parent.is_none_or(|parent| (at + 1..self.fronts.len()).contains(&parent))
        });
        let ranked = self.rank.iter().all(|rank| *rank < size);
        if is_sound && ranked && next == size {
            return Ok(());
        }
        let found = format!("{} fronts that do not fit together", self.fronts.len());
        Err(ArchiveError::Mismatch { what: "a sparse factor", found, expected: format!("fronts of {size} blocks") })
    }

    /// The fronts of a graph in this order of its nodes.
    pub fn new(neighbours: &[Vec<usize>], order: &[usize]) -> Self {
        let mut tree = Tree::new(neighbours, order);
        (0..order.len()).for_each(|column| tree.take_up(column));
        tree.listed(order)
    }

    /// The cost of a factor again after changes of the blocks that `changes` marks: of their fronts, and all above
    /// them.
    pub fn changed(&self, changes: &[bool]) -> f64 {
        let mut stale = vec![false; self.fronts.len()];
        let mut own = vec![false; self.rank.len()];
        self.rank.iter().zip(changes).for_each(|(&rank, &changes)| own[rank] = changes);
        let mut cost = 0.0;
        for (k, front) in self.fronts.iter().enumerate() {
            if stale[k] || own[front.first..front.first + front.columns].contains(&true) {
                cost += front.cost;
                front.parent.into_iter().for_each(|parent| stale[parent] = true);
            }
        }
        cost
    }
}

impl Tree {
    /// Rows of every column: those of the matrix, and those of all columns whose first row it is.
    fn new(neighbours: &[Vec<usize>], order: &[usize]) -> Self {
        let size = order.len();
        let mut rank = vec![0; size];
        order.iter().enumerate().for_each(|(place, &block)| rank[block] = place);
        let (mut rows, mut children) = (vec![Vec::new(); size], vec![Vec::new(); size]);
        let mut seen = vec![usize::MAX; size];
        for column in 0..size {
            let mut own: Vec<usize> = Vec::new();
            let of_children = children[column].iter().flat_map(|&child: &usize| &rows[child]).copied();
            for row in neighbours[order[column]].iter().map(|&block| rank[block]).chain(of_children) {
                if row > column && seen[row] != column {
                    seen[row] = column;
                    own.push(row);
                }
            }
            if let Some(&parent) = own.iter().min() {
                children[parent].push(column);
            }
            rows[column] = own;
        }
        let columns = (0..size).map(|column| vec![column]).collect();
        Self { rows, children, columns }
    }

    fn size(&self, column: usize) -> Size {
        Size { columns: self.columns[column].len(), rows: self.rows[column].len() }
    }

    /// Makes a column's front larger by those below it that cost less within it.
    fn take_up(&mut self, column: usize) {
        let mut below = std::mem::take(&mut self.children[column]);
        // the fronts that bring the fewest zeros first
        below.sort_by_key(|&child| (usize::MAX - self.rows[child].len(), child));
        let mut kept = Vec::with_capacity(below.len());
        for child in below {
            let (own, lower) = (self.size(column), self.size(child));
            let both = Size { columns: own.columns + lower.columns, rows: own.rows };
            if both.cost() > own.cost() + lower.cost() {
                kept.push(child);
                continue;
            }
            let mut columns = std::mem::take(&mut self.columns[child]);
            columns.append(&mut self.columns[column]);
            self.columns[column] = columns;
            kept.append(&mut self.children[child]);
        }
        kept.sort_unstable();
        self.children[column] = kept;
    }

    /// The fronts from the leaves up, with a new order in which each one's columns follow each other.
    fn listed(self, order: &[usize]) -> Fronts {
        let mut tops = vec![true; order.len()];
        self.children.iter().flatten().for_each(|&child| tops[child] = false);
        let roots = (0..order.len()).filter(|&column| tops[column] && !self.columns[column].is_empty());
        let mut waiting: Vec<(usize, bool)> = roots.rev().map(|column| (column, false)).collect();
        let mut listed = Vec::new();
        while let Some((column, seen)) = waiting.pop() {
            if seen {
                listed.push(column);
                continue;
            }
            waiting.push((column, true));
            waiting.extend(self.children[column].iter().rev().map(|&child| (child, false)));
        }
        self.ranked(order, &listed)
    }

    fn ranked(self, order: &[usize], listed: &[usize]) -> Fronts {
        let mut found = Fronts { rank: vec![0; order.len()], ..Fronts::default() };
        let (mut place, mut ranks, mut fronts) = (0, vec![0; order.len()], vec![0; order.len()]);
        for (front, &last) in listed.iter().enumerate() {
            for &column in &self.columns[last] {
                (ranks[column], fronts[column], found.rank[order[column]]) = (place, front, place);
                place += 1;
            }
        }
        for &last in listed {
            let size = self.size(last);
            let cost = size.cost();
            found.cost += cost;
            let mut rows: Vec<_> = self.rows[last].iter().map(|&row| ranks[row]).collect();
            rows.sort_unstable();
            let parent = self.rows[last].iter().min().map(|&row| fronts[row]);
            let first = ranks[self.columns[last][0]];
            found.fronts.push(Front { first, columns: size.columns, rows, parent, cost });
        }
        found
    }
}
