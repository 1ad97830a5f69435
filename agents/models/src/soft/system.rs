//! The linear system of one substep: forces, stiffness and mass of all vertices, and how it is solved.
//!
//! In: the contributions of each element, always in the same order. Out: velocities. Never here: the elements themselves.
//! Theory: docs/theory/soft.md, eq. 1–3.

use super::gradients::Gradients;
use glam::{DMat3, DVec3};
use metachron_contact::solve::{Block, Response, SparseFactor};
use metachron_core::PlainLoop;
use metachron_geometry::{Carried, HangingNode};
use std::cmp::Ordering;

/// Products that conjugate gradients take at least, and for each root of how far stiffness outweighs inertia, in solids of some hundred to
/// some thousand vertices; multiplications of a product for each block.
const PRODUCTS_LEAST: f64 = 16.0;
const PRODUCTS_PER_ROOT: f64 = 4.0;
const PER_BLOCK: f64 = 18.0;
/// How many solutions a problem that the body shares with others takes by gradients, and by factors.
const SHARED_SOLUTIONS: f64 = 3.0;
const SHARED_FACTORS: f64 = 2.0;
/// A volume with more vertices than this gets no factor, however stiff: its storage grows as their number to the power 4/3.
const FACTOR_VERTICES_MAX: usize = 3000;

/// Why a step has no solution.
pub(super) const NOT_POSITIVE: &str = "the stiffness matrix is not positive definite";
pub(super) const UNENDED: &str = "conjugate gradients did not end: it is too stiff for so many vertices";

/// A = (1 + h c) M + h (h + b) K, vertices that are held left out.
#[derive(Debug, Default)]
pub(super) struct System {
    factor: SparseFactor,
    gradients: Gradients,
    /// The cost of a factor, multiplications, where the vertices fill a volume and gradients may cost less: infinite
    /// for too many of them.
    factor_cost: Option<f64>,
    /// Whether the last solution was made by the factor.
    by_factor: bool,
    /// The residual of a solution that is left to others to find, moving vertices alone; else empty.
    unanswered: Vec<DVec3>,
    /// The row of each vertex; none for held and hanging ones. Rows rise with the vertices.
    rows: Vec<Option<u32>>,
    /// The vertices that move with others, by rising numbers, and the place of each vertex among them; empty where none hangs.
    hanging: Vec<HangingNode>,
    hangs: Vec<Option<u32>>,
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
    /// Whether the structure is known.
    merged: bool,
    /// The factor of every stiffness, s²; the inertia of each moving vertex, kg.
    square: f64,
    inertia_kg: Vec<f64>,
    /// The right side and the solution, moving vertices alone.
    right: Vec<DVec3>,
    solution: Vec<DVec3>,
}

/// The user of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// The body alone.
    Own,
    /// A problem that it shares with others, which takes its factor where there is one, and else finds the solution itself.
    Shared,
}

impl System {
    /// A system of vertices of which some are held, and some hang between others; `bulky` where its vertices fill a volume, so that a factor is
    /// dear and conjugate gradients end soon. `add_all` adds all stiffness once, as every substep will.
    pub fn new(held: &[bool], hanging: &[HangingNode], bulky: bool, add_all: impl FnOnce(&mut Self)) -> Self {
        let mut hangs = if hanging.is_empty() { vec![] } else { vec![None; held.len()] };
        (0..).zip(hanging).for_each(|(place, one)| hangs[one.node as usize] = Some(place));
        let is_row = |vertex: usize| !held[vertex] && hangs.get(vertex).is_none_or(Option::is_none);
        let mut next = 0..;
        let rows: Vec<_> = (0..held.len()).map(|vertex| if is_row(vertex) { next.next() } else { None }).collect();
        let moving = rows.iter().flatten().count();
        let (inertia_kg, forces, hanging) = (vec![0.0; moving], vec![DVec3::ZERO; held.len()], hanging.to_vec());
        let mut system = Self { rows, hanging, hangs, moving, inertia_kg, forces, ..Self::default() };
        add_all(&mut system);
        system.merge();
        let fits = moving <= FACTOR_VERTICES_MAX;
        system.factor_cost =
            bulky.then(|| if fits { SparseFactor::cost_of(moving, &system.blocks) } else { f64::INFINITY });
        system.by_factor = !bulky;
        if !bulky {
            system.factor.shape(moving, &system.blocks);
        }
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
        self.merged = true;
    }

    /// Whether a factor is cheaper than gradients.
    fn takes_factor(&self, purpose: Purpose) -> bool {
        let Some(cost) = self.factor_cost else { return true };
        let (solutions, factors) = match purpose {
            Purpose::Own => (1.0, 1.0),
            Purpose::Shared => (SHARED_SOLUTIONS, SHARED_FACTORS),
        };
        let products = PRODUCTS_LEAST + PRODUCTS_PER_ROOT * self.stiffness_ratio().sqrt();
        factors * cost <= solutions * products * PER_BLOCK * self.blocks.len() as f64
    }

    /// How far the stiffness of a vertex outweighs its inertia in this step, at most.
    fn stiffness_ratio(&self) -> f64 {
        let of = |(at, inertia): (&u32, &f64)| {
            let block = &self.blocks[*at as usize].value;
            (block.x_axis.x + block.y_axis.y + block.z_axis.z) / (3.0 * inertia)
        };
        self.diagonal.iter().zip(&self.inertia_kg).map(of).fold(1.0, f64::max)
    }

    /// Begins a substep: no force, no stiffness; `square` is the factor of every stiffness, h² and the part of damping, s².
    pub fn begin(&mut self, square: f64) {
        self.blocks.iter_mut().for_each(|block| block.value = DMat3::ZERO);
        self.forces.fill(DVec3::ZERO);
        self.inertia_kg.fill(0.0);
        (self.square, self.added) = (square, 0);
    }

    /// Adds a force on a vertex, N.
    pub fn push(&mut self, vertex: u32, force: DVec3) {
        match self.carried(vertex as usize) {
            None => self.forces[vertex as usize] += force,
            Some(carried) => carried.terms().for_each(|(node, weight)| self.forces[node] += force * weight),
        }
    }

    /// The vertices that a hanging one moves with; `None` for one that does not hang.
    fn carried(&self, vertex: usize) -> Option<Carried> {
        let place = self.hangs.get(vertex).copied().flatten()?;
        Some(self.hanging[place as usize].carried)
    }

    /// Gives hanging vertices the mean of the values of those that they move with.
    pub fn spread(&self, list: &mut [DVec3]) {
        self.hanging.iter().for_each(|one| list[one.node as usize] = one.carried.mean(list));
    }

    /// The velocity of a vertex with those of moving ones, m/s.
    pub fn velocity(&self, vertex: u32, v: &[DVec3]) -> DVec3 {
        let of = |vertex: usize| self.rows[vertex].map_or(DVec3::ZERO, |row| v[row as usize]);
        let hanging = self.carried(vertex as usize);
        hanging.map_or_else(
            || of(vertex as usize),
            |carried| carried.terms().map(|(node, weight)| of(node) * weight).sum(),
        )
    }

    /// Adds the stiffness −∂fᵢ/∂xⱼ, N/m, where `i` is not below `j`: the matrix is symmetric.
    pub fn stiffen(&mut self, i: u32, j: u32, stiffness: DMat3) {
        if i < j {
            return;
        }
        match (self.rows[i as usize], self.rows[j as usize]) {
            (Some(row), Some(column)) => self.add(row as usize, column as usize, stiffness),
            _ if self.hangs.is_empty() => {}
            _ => self.stiffen_hanging(i as usize, j as usize, stiffness),
        }
    }

    /// The same where a vertex may hang: the stiffness is that between those that it moves with, by their weights.
    fn stiffen_hanging(&mut self, i: usize, j: usize, stiffness: DMat3) {
        let [of_i, of_j] = [i, j].map(|vertex| self.carried(vertex).unwrap_or_else(|| Carried::by_node(vertex as u32)));
        for ((a, of_a), (b, of_b)) in of_i.terms().flat_map(|a| of_j.terms().map(move |b| (a, b))) {
            let (Some(row), Some(column)) = (self.rows[a], self.rows[b]) else { continue };
            let (row, column, part) = (row as usize, column as usize, stiffness * (of_a * of_b));
            // that of j on i is the transpose; of one vertex with itself both are the same
            match row.cmp(&column) {
                Ordering::Greater => self.add(row, column, part),
                Ordering::Equal if i != j => self.add(row, column, part + part.transpose()),
                Ordering::Equal => self.add(row, column, part),
                Ordering::Less if i != j => self.add(column, row, part.transpose()),
                Ordering::Less => {}
            }
        }
    }

    /// Adds to the block of two rows.
    fn add(&mut self, row: usize, column: usize, stiffness: DMat3) {
        if !self.merged {
            return self.blocks.push(Block { row, column, value: DMat3::ZERO });
        }
        let block = &mut self.blocks[self.slots[self.added] as usize];
        debug_assert_eq!((block.row, block.column), (row, column), "stiffness is added in the same order every time");
        block.value += stiffness * self.square;
        self.added += 1;
    }

    /// Adds an inertia to a vertex, kg.
    pub fn weigh(&mut self, vertex: usize, inertia: DMat3) {
        if let Some(row) = self.rows[vertex] {
            self.blocks[self.diagonal[row as usize] as usize].value += inertia;
            self.inertia_kg[row as usize] += (inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z) / 3.0;
        }
    }

    /// Replaces the velocities `x` of all vertices, from which a solution may start, by A⁻¹ of impulses on them (N·s), or by an estimate
    /// where others find it; held vertices stay still.
    ///
    /// # Errors
    /// The reason why there is no solution.
    pub fn solve(&mut self, impulses: &[DVec3], x: &mut [DVec3], purpose: Purpose) -> Result<(), &'static str> {
        self.by_factor = self.takes_factor(purpose);
        let Self { factor, gradients, unanswered, rows, moving, blocks, diagonal, right, solution, .. } = self;
        unanswered.clear();
        let moved = |list: &[DVec3], into: &mut Vec<DVec3>| {
            into.clear();
            into.extend(rows.iter().zip(list).filter_map(|(row, value)| row.map(|_| *value)));
        };
        moved(impulses, right);
        let solved = if self.by_factor {
            solution.clone_from(right);
            // members of a cluster begin side by side: a factor is one thread's
            let made = factor.factor(*moving, blocks, &PlainLoop).map_err(|_| NOT_POSITIVE);
            made.map(|()| factor.respond(solution))
        } else {
            moved(x, solution);
            match purpose {
                Purpose::Own => gradients.solve(blocks, diagonal, right, solution),
                Purpose::Shared => {
                    unanswered.extend_from_slice(gradients.approach(blocks, right, solution));
                    Ok(())
                }
            }
        };
        for (x, row) in x.iter_mut().zip(rows) {
            *x = row.map_or(DVec3::ZERO, |row| solution[row as usize]);
        }
        self.spread(x);
        solved
    }

    /// The residual of the last solution, moving vertices alone; empty where it was solved for.
    pub fn unanswered(&self) -> &[DVec3] {
        &self.unanswered
    }

    /// The velocity of all moving vertices alike that answers impulses on them in sum, m/s; zero for none.
    pub fn together(&self, impulses: &[DVec3]) -> DVec3 {
        if impulses.is_empty() { DVec3::ZERO } else { self.gradients.answer_alike(impulses) }
    }

    /// The factor of the last solution, where it was made by one.
    pub fn response(&self) -> Option<&SparseFactor> {
        self.by_factor.then_some(&self.factor)
    }

    /// The lower half of the matrix, in blocks of moving vertices.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The row of each vertex among the moving ones; none for held and hanging ones.
    pub fn rows(&self) -> &[Option<u32>] {
        &self.rows
    }

    /// The cost of the last solution, multiplications.
    pub fn work(&self) -> f64 {
        let by_products = || PER_BLOCK * self.blocks.len() as f64 * f64::from(self.gradients.products.max(1));
        self.response().map_or_else(by_products, SparseFactor::cost)
    }
}
