//! The matrix of a Newton iteration: a block of six for each body, factored in the order that keeps it narrow.
//!
//! In: who acts on whom, masses, rows that resist. Out: the solution, body by body. Never here: which rows resist.

use super::order::Order;
use super::row::{Mass, NOBODY, Row};
use glam::DVec3;
use metachron_core::skyline_cholesky::{BlockIndex, SkylineCholesky};

/// A symmetric positive matrix over the velocities of all bodies; nothing is allocated once the sizes settle.
#[derive(Debug, Clone, Default)]
pub(super) struct Matrix {
    order: Order,
    envelope: SkylineCholesky<6>,
    /// For each place the lowest place that it is joined to.
    first: Vec<u32>,
    ordered: Vec<f64>,
}

impl Matrix {
    /// Learns which of `bodies` bodies `pairs` join.
    pub(super) fn link(&mut self, bodies: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) {
        self.order.find(bodies, pairs.clone());
        self.first.clear();
        self.first.extend(0..bodies as u32);
        for (a, b) in pairs {
            let [a, b] = [a, b].map(|body| self.order.places()[body as usize]);
            let first = &mut self.first[a.max(b) as usize];
            *first = (*first).min(a.min(b));
        }
    }

    /// What its factorisation costs, in products.
    pub(super) fn work(&self) -> usize {
        SkylineCholesky::<6>::work(&self.first)
    }

    /// Begins anew with the masses alone.
    pub(super) fn start(&mut self, masses: &[Mass]) {
        self.envelope.shape(&self.first);
        for (mass, &place) in masses.iter().zip(self.order.places()) {
            let home = BlockIndex::diagonal(place as usize);
            for k in 0..3 {
                let unit = |at: usize| std::array::from_fn(|i| f64::from(u8::from(i == at)));
                self.envelope.add(home, mass.mass_kg, unit(k), unit(k));
                let column = mass.inertia.col(k);
                self.envelope.add(home, 1.0, [0.0, 0.0, 0.0, column.x, column.y, column.z], unit(3 + k));
            }
        }
    }

    /// Adds weight · Jᵀ J of a row.
    pub(super) fn stiffen(&mut self, row: &Row, weight: f64) {
        let six = |sign: f64, turn: DVec3| {
            let (l, t) = (row.lin * sign, turn * sign);
            [l.x, l.y, l.z, t.x, t.y, t.z]
        };
        let place = |body: u32| self.order.places()[body as usize] as usize;
        let a = (place(row.a), six(1.0, row.turn_a));
        self.envelope.add(BlockIndex::diagonal(a.0), weight, a.1, a.1);
        if row.b != NOBODY {
            let b = (place(row.b), six(-1.0, row.turn_b));
            self.envelope.add(BlockIndex::diagonal(b.0), weight, b.1, b.1);
            let (low, high) = if a.0 > b.0 { (b, a) } else { (a, b) };
            self.envelope.add(BlockIndex { row: high.0, column: low.0 }, weight, high.1, low.1);
        }
    }

    /// Solves for `x`, six numbers a body; `false`, and `x` as it was, where the matrix is not positive.
    pub(super) fn solve(&mut self, x: &mut [f64]) -> bool {
        let positive = self.factor();
        if positive {
            self.solve_again(x);
        }
        positive
    }

    /// Factors the matrix; whether it is positive.
    pub(super) fn factor(&mut self) -> bool {
        self.envelope.factor()
    }

    /// Solves for `x` by the factor there is.
    pub(super) fn solve_again(&mut self, x: &mut [f64]) {
        self.ordered.clear();
        self.ordered.resize(x.len(), 0.0);
        for (six, &place) in x.chunks_exact(6).zip(self.order.places()) {
            self.ordered[6 * place as usize..][..6].copy_from_slice(six);
        }
        self.envelope.solve(&mut self.ordered);
        for (six, &place) in x.chunks_exact_mut(6).zip(self.order.places()) {
            six.copy_from_slice(&self.ordered[6 * place as usize..][..6]);
        }
    }
}
