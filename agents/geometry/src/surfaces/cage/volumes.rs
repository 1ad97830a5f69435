//! The volume inside a surface that belongs to each corner of each part of a cage's lattice, along columns.
//!
//! In: a closed surface, a lattice. Out: volumes. Never here: which parts are cells. Theory: docs/theory/soft.md, eq. 15.

use super::Cage;
use crate::{Aabb, Triangles};
use glam::DVec3;

/// Columns along each of x and y, in a cell, along which volume is integrated; along z it is exact.
const COLUMNS: usize = 6;
/// How far columns are from the middles of their squares, as a share of a cell: few surfaces have vertices or edges in such columns.
const COLUMN_SHIFT: [f64; 2] = [1.137e-5, -0.731e-5];

impl Cage {
    /// The volume inside that belongs to each corner of each part of the lattice, m³ (eq. 15).
    pub(super) fn volumes(&self, surface: &Triangles) -> Vec<[f64; 8]> {
        let (part_m, [nx, ny, nz]) = (self.part_m(), self.lattice());
        let mut volumes = vec![[0.0; 8]; nx * ny * nz];
        let across = part_m / COLUMNS as f64;
        let area = across.x * across.y;
        for (column, crossings) in self.crossings(surface).iter_mut().enumerate() {
            let (a, b) = (column % (nx * COLUMNS), column / (nx * COLUMNS));
            let (i, j) = (a / COLUMNS, b / COLUMNS);
            let share = |at: usize| (0.5 + (at % COLUMNS) as f64) / COLUMNS as f64;
            let (u, v) = (share(a), share(b));
            crossings.sort_unstable_by(|one, other| one.z.total_cmp(&other.z));
            let mut winding = 0;
            for pair in crossings.windows(2) {
                winding += pair[0].enters;
                if winding <= 0 {
                    continue;
                }
                let [from, to] = [pair[0].z, pair[1].z].map(|z| (z - self.low.z) / part_m.z);
                let last = (to.ceil().max(1.0) as usize).min(nz);
                for k in (from.max(0.0) as usize)..last {
                    let [start, end] = [from, to].map(|at| (at - k as f64).clamp(0.0, 1.0));
                    let height = [(end - start) - 0.5 * (end * end - start * start), 0.5 * (end * end - start * start)];
                    let into = &mut volumes[i + nx * (j + ny * k)];
                    for (corner, volume) in into.iter_mut().enumerate() {
                        let x = if corner & 1 == 1 { u } else { 1.0 - u };
                        let y = if corner >> 1 & 1 == 1 { v } else { 1.0 - v };
                        *volume += area * part_m.z * x * y * height[corner >> 2];
                    }
                }
            }
        }
        volumes
    }

    /// Where each column along z goes through the surface.
    fn crossings(&self, surface: &Triangles) -> Vec<Vec<Crossing>> {
        let (part_m, [nx, ny, _]) = (self.part_m(), self.lattice());
        let [wide, deep] = [nx * COLUMNS, ny * COLUMNS];
        let across = part_m / COLUMNS as f64;
        let mut columns = vec![vec![]; wide * deep];
        let at = |index: usize, axis: usize| {
            self.low[axis] + (index as f64 + 0.5) * across[axis] + COLUMN_SHIFT[axis] * part_m[axis]
        };
        for corners in &surface.triangles {
            let corners = corners.map(|corner| surface.points[corner as usize]);
            let Aabb { low, high } = Aabb::of(&corners);
            let range = |axis: usize, count: usize| {
                let place = |x: f64| (x - self.low[axis]) / across[axis] - 0.5;
                let first = place(low[axis]).floor().max(0.0) as usize;
                first..(place(high[axis]).ceil() as usize + 1).min(count)
            };
            for b in range(1, deep) {
                for a in range(0, wide) {
                    columns[a + wide * b].extend(Crossing::of(corners, [at(a, 0), at(b, 1)]));
                }
            }
        }
        columns
    }
}

/// Where a column goes through a triangle.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    z: f64,
    /// 1 where it goes in, upwards, −1 where out.
    enters: i32,
}

impl Crossing {
    /// The crossing of the column at `at` with a triangle; none where it passes beside, or the triangle is upright.
    fn of(corners: [DVec3; 3], at: [f64; 2]) -> Option<Self> {
        // an edge is judged in one direction whichever triangle asks: of two that share it exactly one has the column
        let left = |a: DVec3, b: DVec3| {
            let swap = (a.x, a.y) > (b.x, b.y);
            let (from, to) = if swap { (b, a) } else { (a, b) };
            let turn = (to.x - from.x) * (at[1] - from.y) - (to.y - from.y) * (at[0] - from.x);
            (turn >= 0.0) != swap
        };
        let [a, b, c] = corners;
        let sides = [left(a, b), left(b, c), left(c, a)];
        if sides != [true; 3] && sides != [false; 3] {
            return None;
        }
        let normal = (b - a).cross(c - a);
        let z = a.z - (normal.x * (at[0] - a.x) + normal.y * (at[1] - a.y)) / normal.z;
        z.is_finite().then_some(Self { z, enters: if normal.z < 0.0 { 1 } else { -1 } })
    }
}
