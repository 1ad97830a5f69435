//! The linear system of one substep: forces, stiffness and mass of all vertices, and how it is solved.
//!
//! In: the contributions of each element, always in the same order. Out: velocities. Never here: the elements themselves.
//! Theory: docs/theory/soft.md, eq. 1, 2, 4.

use super::gradients::Gradients;
use glam::{DMat3, DVec3};
use metachron_contact::cluster::{Block, Response, SparseFactor};
use metachron_core::PlainLoop;

/// Where vertices fill a volume, a factor that takes more multiplications than this is not made for a step of the body's own: conjugate
/// gradients then take less. For a problem that the body shares with others a factor pays up to here, and fits in memory up to here.
const OWN_FACTOR_MAX: f64 = 3e6;
const LENT_FACTOR_MAX: f64 = 6e7;
const FACTOR_VERTICES_MAX: usize = 3000;

/// A = (1 + h c) M + h² K, vertices that are held left out.
#[derive(Debug, Default)]
pub(super) struct System {
    /// Made where it may serve at all.
    factor: Option<SparseFactor>,
    gradients: Gradients,
    /// Whether the vertices fill a volume.
    bulky: bool,
    /// Whether the last solution was made by the factor.
    by_factor: bool,
    /// The row of each vertex; none for held ones. Rows rise with the vertices.
    rows: Vec<Option<u32>>,
    /// How many vertices move.
    moving: usize,
    /// Force on each vertex at the start of the substep, N.
    pub forces: Vec<DVec3>,
    /// The lower half of the matrix in blocks of moving vertices, row by row.
    blocks: Vec<Block>,
    /// The block on the diagonal of each row, and that of each stiffness in the order in which they are added; how many of these have been.
    diagonal: Vec<u32>,
    slots: Vec<u32>,
    added: usize,
    /// h², s²: the factor of every stiffness.
    square: f64,
    /// The right side and the solution, moving vertices alone.
    right: Vec<DVec3>,
    solution: Vec<DVec3>,
}

/// Whom a solution is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// The body alone.
    Own,
    /// A problem that it shares with others, which takes its factor where there is one.
    Shared,
}

impl System {
    /// A system of vertices of which some are held; `bulky` where its vertices fill a volume, so that a factor is dear and conjugate gradients
    /// end soon. `add_all` adds all stiffness once, as every substep will.
    pub fn new(held: &[bool], bulky: bool, add_all: impl FnOnce(&mut Self)) -> Self {
        let mut next = 0..;
        let rows: Vec<Option<u32>> = held.iter().map(|&held| if held { None } else { next.next() }).collect();
        let moving = held.iter().filter(|held| !**held).count();
        let mut system = Self { rows, moving, bulky, forces: vec![DVec3::ZERO; held.len()], ..Self::default() };
        add_all(&mut system);
        system.merge();
        if !(bulky && moving > FACTOR_VERTICES_MAX) {
            let mut factor = SparseFactor::default();
            factor.shape(moving, &system.blocks);
            system.factor = (!bulky || factor.cost() <= LENT_FACTOR_MAX).then_some(factor);
        }
        system.by_factor = system.takes_factor(Purpose::Shared);
        system
    }

    /// Gives entries with one place one block, and each row a diagonal.
    fn merge(&mut self) {
        let added = std::mem::take(&mut self.blocks);
        let place = |block: &Block| (block.row, block.column);
        let mut places: Vec<_> = added.iter().map(place).chain((0..self.moving).map(|row| (row, row))).collect();
        places.sort_unstable();
        places.dedup();
        let at = |place: (usize, usize)| places.binary_search(&place).map_or(u32::MAX, |at| at as u32);
        self.slots = added.iter().map(|block| at(place(block))).collect();
        self.diagonal = (0..self.moving).map(|row| at((row, row))).collect();
        self.blocks = places.iter().map(|&(row, column)| Block { row, column, value: DMat3::ZERO }).collect();
    }

    /// Whether the factor serves.
    fn takes_factor(&self, purpose: Purpose) -> bool {
        let own = |factor: &SparseFactor| !self.bulky || factor.cost() <= OWN_FACTOR_MAX;
        self.factor.as_ref().is_some_and(|factor| purpose == Purpose::Shared || own(factor))
    }

    /// Begins a substep of `h` seconds: no force, no stiffness.
    pub fn begin(&mut self, h: f64) {
        self.blocks.iter_mut().for_each(|block| block.value = DMat3::ZERO);
        self.forces.fill(DVec3::ZERO);
        (self.square, self.added) = (h * h, 0);
    }

    /// Adds a force on a vertex, N.
    pub fn push(&mut self, vertex: u32, force: DVec3) {
        self.forces[vertex as usize] += force;
    }

    /// Adds the stiffness −∂fᵢ/∂xⱼ, N/m, where `i` is not below `j`: the matrix is symmetric.
    pub fn stiffen(&mut self, i: u32, j: u32, stiffness: DMat3) {
        if i < j {
            return;
        }
        let (Some(row), Some(column)) = (self.rows[i as usize], self.rows[j as usize]) else { return };
        let (row, column) = (row as usize, column as usize);
        let Some(&slot) = self.slots.get(self.added) else {
            // the structure is not known yet
            return self.blocks.push(Block { row, column, value: DMat3::ZERO });
        };
        let block = &mut self.blocks[slot as usize];
        debug_assert_eq!((block.row, block.column), (row, column), "stiffness is added in the same order every time");
        block.value += stiffness * self.square;
        self.added += 1;
    }

    /// Adds an inertia to a vertex, kg.
    pub fn weigh(&mut self, vertex: usize, inertia: DMat3) {
        // before the structure is known there is no diagonal
        if let Some(&at) = self.rows[vertex].and_then(|row| self.diagonal.get(row as usize)) {
            self.blocks[at as usize].value += inertia;
        }
    }

    /// Replaces the velocities `x` of all vertices, from which a solution may start, by A⁻¹ of impulses on them (N·s); held vertices stay
    /// still. `false` where the matrix is not positive.
    pub fn solve(&mut self, impulses: &[DVec3], x: &mut [DVec3], purpose: Purpose) -> bool {
        self.by_factor = self.takes_factor(purpose);
        let Self { factor, gradients, rows, moving, blocks, diagonal, right, solution, .. } = self;
        let moved = |list: &[DVec3], into: &mut Vec<DVec3>| {
            into.clear();
            into.extend(rows.iter().zip(list).filter_map(|(row, value)| row.map(|_| *value)));
        };
        moved(impulses, right);
        let solved = match factor.as_mut().filter(|_| self.by_factor) {
            Some(factor) => {
                solution.clone_from(right);
                // members of a cluster begin side by side: a factor is one thread's
                let made = factor.factor(*moving, blocks, &PlainLoop).is_ok();
                if made {
                    factor.respond(solution);
                }
                made
            }
            None => {
                moved(x, solution);
                gradients.solve(blocks, diagonal, right, solution)
            }
        };
        for (x, row) in x.iter_mut().zip(rows) {
            *x = row.map_or(DVec3::ZERO, |row| solution[row as usize]);
        }
        solved
    }

    /// The factor of the last solution, where it was made by one.
    pub fn response(&self) -> Option<&SparseFactor> {
        self.factor.as_ref().filter(|_| self.by_factor)
    }

    /// The lower half of the matrix, in blocks of moving vertices.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The row of each vertex among those that move; none for held ones.
    pub fn rows(&self) -> &[Option<u32>] {
        &self.rows
    }

    /// What the last solution cost, multiplications.
    pub fn work(&self) -> f64 {
        let by_products = || 18.0 * self.blocks.len() as f64 * f64::from(self.gradients.products.max(1));
        self.response().map_or_else(by_products, SparseFactor::cost)
    }
}
