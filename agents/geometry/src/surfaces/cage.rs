//! A cage of box-shaped cells around a closed surface: which cells hold volume, how much of it, and how points move with the cells.
//!
//! In: a closed surface and a spacing. Out: nodes, cells with the volume inside the surface that belongs to each corner, and the four
//! nodes that carry any point. Never here: masses, forces, what the cells are made of. Theory: docs/theory/soft.md, eq. 15, 16.

use crate::{Aabb, Triangles};
use glam::DVec3;

/// Columns along each of x and y, in a cell, along which volume is integrated; along z it is exact.
const COLUMNS: usize = 6;
/// How far columns are from the middles of their squares, as a share of a cell: few surfaces have vertices or edges in such columns.
const COLUMN_SHIFT: [f64; 2] = [1.137e-5, -0.731e-5];
/// A cell filled less than this share of the fullest one is no cell of the cage: its nodes would weigh next to nothing.
const FILL_LEAST: f64 = 0.01;
/// How far inward a point of the surface is taken to be when its cell is looked for, as a share of a cell.
const INWARD: f64 = 1e-3;
/// No cell, no node.
const NONE: u32 = u32::MAX;

/// A cell of a cage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CageCell {
    /// Its nodes: bit 0 of a corner's place says whether it is the far one in x, bit 1 in y, bit 2 in z.
    pub corners: [u32; 8],
    /// The share of its volume that is inside the surface, 0 … 1.
    pub fill: f64,
    /// The volume inside the surface that belongs to each corner, m³.
    pub volumes_m3: [f64; 8],
}

/// A point that moves with four nodes, or with one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    /// The nodes.
    pub nodes: [u32; 4],
    /// The weight of each node, in sum one; nodes of weight zero do not matter.
    pub weights: [f64; 4],
}

impl Carried {
    /// A point that moves with one node.
    #[must_use]
    pub const fn by_node(node: u32) -> Self {
        Self { nodes: [node; 4], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    /// The nodes with a weight.
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let pairs = self.nodes.into_iter().zip(self.weights);
        pairs.filter(|(_, weight)| *weight != 0.0).map(|(node, weight)| (node as usize, weight))
    }

    /// The weighted mean of the nodes' values.
    #[must_use]
    pub fn mean(&self, of: &[DVec3]) -> DVec3 {
        self.terms().map(|(node, weight)| of[node] * weight).sum()
    }
}

/// A cage at rest.
#[derive(Debug, Clone)]
pub struct Cage {
    low: DVec3,
    /// Length of a cell along each axis, metres.
    cell_m: DVec3,
    /// Cells along each axis.
    counts: [usize; 3],
    /// The cell of each place of the lattice, or the nearest one where nothing is inside.
    cell_at: Vec<u32>,
    cells: Vec<CageCell>,
    nodes_m: Vec<DVec3>,
    /// The node of each corner of the lattice.
    node_at: Vec<u32>,
}

/// Cells along each axis of a cage about a surface with cells of at most `eps_m`.
#[must_use]
pub fn cage_counts(surface: &Triangles, eps_m: f64) -> [usize; 3] {
    let Aabb { low, high } = Aabb::of(&surface.points);
    (high - low).to_array().map(|size| ((size / eps_m) * (1.0 - 1e-9)).ceil().clamp(1.0, 1e6) as usize)
}

impl Cage {
    /// The cage about a closed `surface`, cells of at most `eps_m` that fit its extent; `None` where nothing is inside, or where it would have
    /// more than `nodes_max` nodes.
    #[must_use]
    pub fn new(surface: &Triangles, eps_m: f64, nodes_max: usize) -> Option<Self> {
        let Aabb { low, high } = Aabb::of(&surface.points);
        let counts = cage_counts(surface, eps_m);
        // the inside fills no less than a hundredth of any box around an organ: far more places than nodes are a mistake
        let places = counts.iter().try_fold(1_usize, |product, count| product.checked_mul(*count))?;
        if places > nodes_max.saturating_mul(200) {
            return None;
        }
        let cell_m = (high - low) / DVec3::from_array(counts.map(|count| count as f64));
        let mut cage = Self { low, cell_m, counts, cell_at: vec![], cells: vec![], nodes_m: vec![], node_at: vec![] };
        let volumes = cage.volumes(surface, places);
        cage.keep_filled(&volumes, surface.volume_m3())?;
        (cage.nodes_m.len() <= nodes_max).then_some(cage)
    }

    /// The volume inside that belongs to each corner of each cell of the lattice, m³ (eq. 15).
    fn volumes(&self, surface: &Triangles, places: usize) -> Vec<[f64; 8]> {
        let mut volumes = vec![[0.0; 8]; places];
        let [nx, ny, nz] = self.counts;
        let across = self.cell_m / COLUMNS as f64;
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
                let [from, to] = [pair[0].z, pair[1].z].map(|z| (z - self.low.z) / self.cell_m.z);
                let last = (to.ceil().max(1.0) as usize).min(nz);
                for k in (from.max(0.0) as usize)..last {
                    let [start, end] = [from, to].map(|at| (at - k as f64).clamp(0.0, 1.0));
                    let height = [(end - start) - 0.5 * (end * end - start * start), 0.5 * (end * end - start * start)];
                    let into = &mut volumes[i + nx * (j + ny * k)];
                    for (corner, volume) in into.iter_mut().enumerate() {
                        let x = if corner & 1 == 1 { u } else { 1.0 - u };
                        let y = if corner >> 1 & 1 == 1 { v } else { 1.0 - v };
                        *volume += area * self.cell_m.z * x * y * height[corner >> 2];
                    }
                }
            }
        }
        volumes
    }

    /// Where each column along z goes through the surface.
    fn crossings(&self, surface: &Triangles) -> Vec<Vec<Crossing>> {
        let [nx, ny, _] = self.counts;
        let [wide, deep] = [nx * COLUMNS, ny * COLUMNS];
        let across = self.cell_m / COLUMNS as f64;
        let mut columns = vec![vec![]; wide * deep];
        let at = |index: usize, axis: usize| {
            self.low[axis] + (index as f64 + 0.5) * across[axis] + COLUMN_SHIFT[axis] * self.cell_m[axis]
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

    /// Makes cells of the filled places, so that their volumes sum to `whole_m3`; `None` where none is filled.
    fn keep_filled(&mut self, volumes: &[[f64; 8]], whole_m3: f64) -> Option<()> {
        let [nx, ny, nz] = self.counts;
        let full = self.cell_m.element_product();
        let fill = |volumes: &[f64; 8]| volumes.iter().sum::<f64>() / full;
        let least = FILL_LEAST * volumes.iter().map(fill).fold(0.0, f64::max);
        let kept = |volumes: &[f64; 8]| fill(volumes) >= least && fill(volumes) > 0.0;
        let sum: f64 = volumes.iter().filter(|volumes| kept(volumes)).flatten().sum();
        if !(sum > 0.0 && whole_m3 > 0.0) {
            return None;
        }
        let scale = whole_m3 / sum;
        self.node_at = vec![NONE; (nx + 1) * (ny + 1) * (nz + 1)];
        self.cell_at = vec![NONE; volumes.len()];
        for (place, volumes) in volumes.iter().enumerate().filter(|(_, volumes)| kept(volumes)) {
            let [i, j, k] = self.place(place);
            let corners = std::array::from_fn(|bits| self.node([i + (bits & 1), j + (bits >> 1 & 1), k + (bits >> 2)]));
            self.cell_at[place] = self.cells.len() as u32;
            let volumes_m3 = volumes.map(|volume| volume * scale);
            self.cells.push(CageCell { corners, fill: (fill(volumes) * scale).min(1.0), volumes_m3 });
        }
        self.extend_cells();
        Some(())
    }

    const fn place(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// The node at a corner of the lattice, made where there is none yet.
    fn node(&mut self, corner: [usize; 3]) -> u32 {
        let [nx, ny, _] = self.counts;
        let at = corner[0] + (nx + 1) * (corner[1] + (ny + 1) * corner[2]);
        if self.node_at[at] == NONE {
            self.node_at[at] = self.nodes_m.len() as u32;
            self.nodes_m.push(self.low + self.cell_m * DVec3::from_array(corner.map(|count| count as f64)));
        }
        self.node_at[at]
    }

    /// Gives each place without a cell that of a neighbour, outwards from the cells.
    fn extend_cells(&mut self) {
        let mut reached: Vec<usize> = (0..self.cell_at.len()).filter(|at| self.cell_at[*at] != NONE).collect();
        let mut next = 0;
        while next < reached.len() {
            let from = reached[next];
            next += 1;
            let mut stride = 1;
            for (at, count) in self.place(from).into_iter().zip(self.counts) {
                let beside = [(at > 0).then(|| from - stride), (at + 1 < count).then(|| from + stride)];
                for to in beside.into_iter().flatten() {
                    if self.cell_at[to] == NONE {
                        self.cell_at[to] = self.cell_at[from];
                        reached.push(to);
                    }
                }
                stride *= count;
            }
        }
    }

    /// Positions of the nodes, metres.
    #[must_use]
    pub fn nodes_m(&self) -> &[DVec3] {
        &self.nodes_m
    }

    /// The cells.
    #[must_use]
    pub fn cells(&self) -> &[CageCell] {
        &self.cells
    }

    /// Cells along each axis.
    #[must_use]
    pub const fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// Length of a cell along each axis, metres.
    #[must_use]
    pub const fn cell_m(&self) -> DVec3 {
        self.cell_m
    }

    /// The nodes on a side of the cage's extent: where coordinate `axis` is least, or largest.
    pub fn on_side(&self, axis: usize, last: bool) -> impl Iterator<Item = u32> + '_ {
        let at = self.low[axis] + if last { self.cell_m[axis] * self.counts[axis] as f64 } else { 0.0 };
        let near = 1e-6 * self.cell_m[axis];
        (0..).zip(&self.nodes_m).filter(move |(_, node)| (node[axis] - at).abs() < near).map(|(node, _)| node)
    }

    /// Three nodes in a row, for each node between two others along an axis.
    #[must_use]
    pub fn rows(&self) -> Vec<[u32; 3]> {
        let [nx, ny, nz] = self.counts.map(|count| count + 1);
        let mut rows = vec![];
        for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
            for at in 0..nx * ny * nz {
                let place = [at % nx, at / nx % ny, at / (nx * ny)][axis];
                if place == 0 || place == self.counts[axis] {
                    continue;
                }
                let row = [at - stride, at, at + stride].map(|at| self.node_at[at]);
                if !row.contains(&NONE) {
                    rows.push(row);
                }
            }
        }
        rows
    }

    /// The cell that a point at rest belongs to: the one around it, or the nearest.
    #[must_use]
    pub fn cell_at(&self, at_m: DVec3) -> usize {
        let place = (at_m - self.low) / self.cell_m;
        let index: [usize; 3] = std::array::from_fn(|axis| (place[axis].max(0.0) as usize).min(self.counts[axis] - 1));
        let [nx, ny, _] = self.counts;
        self.cell_at[index[0] + nx * (index[1] + ny * index[2])] as usize
    }

    /// The cell that a point at rest belongs to, and where it is in it, 0 … 1 along each axis and beyond for a point that is in no cell.
    #[must_use]
    pub fn locate(&self, at_m: DVec3) -> (&CageCell, DVec3) {
        let cell = &self.cells[self.cell_at(at_m)];
        (cell, (at_m - self.nodes_m[cell.corners[0] as usize]) / self.cell_m)
    }

    /// The cell that a point of the surface at rest belongs to, on the side of the unit vector `inward`.
    #[must_use]
    pub fn cell_under(&self, at_m: DVec3, inward: DVec3) -> usize {
        self.cell_at(at_m + inward * (INWARD * self.cell_m.min_element()))
    }

    /// Takes cells away, not all of them; the others are numbered anew in the same order, nodes keep their numbers, and matter of a cell that
    /// is gone belongs to the nearest one that is left.
    pub fn remove(&mut self, is_gone: &[bool]) {
        let mut gone = is_gone.iter();
        self.cells.retain(|_| !gone.next().copied().unwrap_or_default());
        // from the cells alone: whatever went first, the same are left
        self.cell_at.fill(NONE);
        for (number, cell) in (0..).zip(&self.cells) {
            let place = (self.nodes_m[cell.corners[0] as usize] - self.low) / self.cell_m;
            let [i, j, k] = place.to_array().map(|at| at.round() as usize);
            self.cell_at[i + self.counts[0] * (j + self.counts[1] * k)] = number;
        }
        self.extend_cells();
    }

    /// How a point of the surface at rest moves with the cage: linear in one of the six tetrahedra of its cell, continuous from cell to cell
    /// (eq. 16). The cell is the one on the side of the unit vector `inward`: a surface may lie between two cells.
    #[must_use]
    pub fn carry(&self, at_m: DVec3, inward: DVec3) -> Carried {
        let cell = &self.cells[self.cell_under(at_m, inward)];
        let share = (at_m - self.nodes_m[cell.corners[0] as usize]) / self.cell_m;
        let mut axes = [0, 1, 2];
        axes.sort_by(|a, b| share[*b].total_cmp(&share[*a]));
        let [first, second, third] = axes.map(|axis| share[axis]);
        let corners = [0, 1 << axes[0], 1 << axes[0] | 1 << axes[1], 7];
        Carried {
            nodes: corners.map(|corner: usize| cell.corners[corner]),
            weights: [1.0 - first, first - second, second - third, third],
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 1 m.
    fn cube() -> Triangles {
        let points = (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Triangles { points: points.collect(), triangles: halves.collect() }
    }

    /// A ball of points on a grid of angles.
    fn ball(radius_m: f64) -> Triangles {
        let (rings, around) = (40_u32, 60_u32);
        let mut points = vec![DVec3::Z * radius_m, -DVec3::Z * radius_m];
        for ring in 1..rings {
            let down = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            points.extend((0..around).map(|step| {
                let turn = std::f64::consts::TAU * f64::from(step) / f64::from(around);
                DVec3::new(down.sin() * turn.cos(), down.sin() * turn.sin(), down.cos()) * radius_m
            }));
        }
        let at = |ring: u32, step: u32| 2 + (ring - 1) * around + step % around;
        let mut triangles = vec![];
        for step in 0..around {
            triangles.push([0, at(1, step), at(1, step + 1)]);
            triangles.push([1, at(rings - 1, step + 1), at(rings - 1, step)]);
            for ring in 1..rings - 1 {
                let [a, b, c, d] = [at(ring, step), at(ring + 1, step), at(ring + 1, step + 1), at(ring, step + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Triangles { points, triangles }
    }

    fn volume(cage: &Cage) -> f64 {
        cage.cells().iter().flat_map(|cell| cell.volumes_m3).sum()
    }

    /// The centre of the volume that the corners share.
    fn centre(cage: &Cage) -> DVec3 {
        let moments = cage.cells().iter().flat_map(|cell| cell.corners.into_iter().zip(cell.volumes_m3));
        moments.map(|(node, volume)| cage.nodes_m()[node as usize] * volume).sum::<DVec3>() / volume(cage)
    }

    #[test]
    fn a_cube_fills_its_cells() {
        let cage = Cage::new(&cube(), 0.25, 1000).unwrap();
        assert_eq!((cage.cells().len(), cage.nodes_m().len(), cage.counts()), (64, 125, [4; 3]));
        assert!(cage.cells().iter().all(|cell| (cell.fill - 1.0).abs() < 1e-3), "{:?}", cage.cells()[0]);
        assert!((volume(&cage) - 1.0).abs() < 1e-12);
        assert!(centre(&cage).distance(DVec3::splat(0.5)) < 1e-4);
        assert_eq!(cage.on_side(2, false).count(), 25);
        assert_eq!(cage.rows().len(), 3 * 3 * 25);
    }

    #[test]
    fn a_ball_has_its_volume_and_its_centre_at_every_spacing() {
        let surface = ball(0.1);
        for eps_m in [0.2, 0.05, 0.033, 0.02] {
            let cage = Cage::new(&surface, eps_m, 10_000).unwrap();
            assert!((volume(&cage) - surface.volume_m3()).abs() < 1e-12 * surface.volume_m3());
            assert!(centre(&cage).length() < 2e-4, "{eps_m}: {}", centre(&cage));
            let integrated: f64 = cage.volumes(&surface, cage.cell_at.len()).iter().flatten().sum();
            let off = (integrated / surface.volume_m3() - 1.0).abs();
            assert!(off < if eps_m > 0.1 { 0.05 } else { 0.01 }, "{eps_m}: {off}");
        }
    }

    #[test]
    fn whatever_is_carried_follows_any_linear_motion_and_is_continuous() {
        let surface = ball(0.1);
        let cage = Cage::new(&surface, 0.03, 10_000).unwrap();
        let bent = |x: DVec3| DVec3::new(1.0 + 2.0 * x.y, x.z - 0.3 * x.x, 0.5 * x.x + x.z);
        let moved: Vec<DVec3> = cage.nodes_m().iter().map(|node| bent(*node)).collect();
        for point in &surface.points {
            let carried = cage.carry(*point, -point.normalize());
            assert!((carried.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(carried.mean(&moved).distance(bent(*point)) < 1e-12);
        }
        let wild: Vec<DVec3> = (0..cage.nodes_m().len()).map(|i| DVec3::splat((i * 7919 % 101) as f64)).collect();
        let inner = DVec3::new(0.01, -0.02, 0.005);
        for way in [DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 1.0)] {
            let walk = (0..4000).map(|i| cage.carry(inner + way * (f64::from(i) * 1e-5), DVec3::ZERO).mean(&wild).x);
            let walk: Vec<f64> = walk.collect();
            assert!(walk.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.5), "a jump along {way}");
        }
    }

    #[test]
    fn nothing_inside_or_too_many_nodes_make_no_cage() {
        let flat = Triangles { points: cube().points, triangles: vec![[0, 1, 2], [0, 2, 1]] };
        assert!(Cage::new(&flat, 0.5, 1000).is_none());
        assert!(Cage::new(&cube(), 0.05, 1000).is_none());
        assert!(Cage::new(&cube(), 1e-9, 10_000).is_none());
    }
}
