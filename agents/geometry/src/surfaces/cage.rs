//! A cage of box-shaped cells around a closed surface: which cells hold volume, how much of it, and how points move with the cells.
//!
//! In: a closed surface and a spacing. Out: nodes, cells with the volume inside the surface that belongs to each corner, and the four
//! nodes that carry any point. Never here: masses, forces, what the cells are made of. Theory: docs/theory/soft.md, eq. 15, 16.

mod halves;
mod volumes;

use crate::{Aabb, Triangles};
use glam::DVec3;
pub use halves::{Halving, HangingNode};

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
    /// Whether it is an eighth of a place of the lattice.
    pub is_half: bool,
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
    /// Parts of the lattice along a cell: 2 where any cell is halved.
    parts: usize,
    /// The places of whole cells that are halved where they have a cell, in rising order.
    halved: Vec<usize>,
    /// The cell of each part of the lattice, or the nearest one where nothing is inside.
    cell_at: Vec<u32>,
    cells: Vec<CageCell>,
    nodes_m: Vec<DVec3>,
    /// The node of each corner of the lattice.
    node_at: Vec<u32>,
    /// By rising nodes.
    hanging: Vec<HangingNode>,
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
        Self::halved(surface, eps_m, nodes_max, Halving::NONE)
    }

    /// The same with cells that are `halving`.
    #[must_use]
    pub fn halved(surface: &Triangles, eps_m: f64, nodes_max: usize, halving: Halving<'_>) -> Option<Self> {
        let Aabb { low, high } = Aabb::of(&surface.points);
        let counts = cage_counts(surface, eps_m);
        // the inside fills no less than a hundredth of any box around an organ: far more places than nodes are a mistake
        let places = counts.iter().try_fold(1_usize, |product, count| product.checked_mul(*count))?;
        if places > nodes_max.saturating_mul(200) {
            return None;
        }
        let cell_m = (high - low) / DVec3::from_array(counts.map(|count| count as f64));
        let mut cage = Self {
            low,
            cell_m,
            counts,
            parts: 1,
            halved: vec![],
            cell_at: vec![],
            cells: vec![],
            nodes_m: vec![],
            node_at: vec![],
            hanging: vec![],
        };
        let volumes = cage.volumes(surface);
        cage.halved = cage.places_of(halving);
        let mut halves = vec![];
        if !cage.halved.is_empty() {
            cage.parts = 2;
            halves = cage.volumes(surface);
        }
        cage.keep_filled(&volumes, &halves, surface.volume_m3())?;
        (cage.nodes_m.len() <= nodes_max).then_some(cage)
    }

    /// Parts of the lattice along each axis.
    fn lattice(&self) -> [usize; 3] {
        self.counts.map(|count| count * self.parts)
    }

    /// Length of a part of the lattice along each axis, metres.
    fn part_m(&self) -> DVec3 {
        self.cell_m / self.parts as f64
    }

    /// Makes cells of the filled places, of those to be halved by the volumes of their `halves`, so that all sum to `whole_m3`; `None` where
    /// none is filled.
    fn keep_filled(&mut self, volumes: &[[f64; 8]], halves: &[[f64; 8]], whole_m3: f64) -> Option<()> {
        let full = self.cell_m.element_product();
        let fill = |volumes: &[f64; 8]| volumes.iter().sum::<f64>() / full;
        let least = FILL_LEAST * volumes.iter().map(fill).fold(0.0, f64::max);
        let kept = |volumes: &[f64; 8]| fill(volumes) >= least && fill(volumes) > 0.0;
        let sum: f64 = volumes.iter().filter(|volumes| kept(volumes)).flatten().sum();
        if !(sum > 0.0 && whole_m3 > 0.0) {
            return None;
        }
        let scale = whole_m3 / sum;
        let [nx, ny, nz] = self.lattice();
        self.node_at = vec![NONE; (nx + 1) * (ny + 1) * (nz + 1)];
        self.cell_at = vec![NONE; nx * ny * nz];
        for (place, volumes) in volumes.iter().enumerate().filter(|(_, volumes)| kept(volumes)) {
            let volumes_m3 = volumes.map(|volume| volume * scale);
            let is_halved = self.halved.binary_search(&place).is_ok();
            if !(is_halved && self.halve(place, volumes_m3.iter().sum(), halves, least)) {
                let low = place_of(place, self.counts).map(|count| count * self.parts);
                self.add(low, CageCell { volumes_m3, fill: (fill(volumes) * scale).min(1.0), ..CageCell::WHOLE });
            }
        }
        self.extend_cells();
        self.find_hanging();
        Some(())
    }

    /// Adds a cell whose first corner is this one of the lattice.
    fn add(&mut self, low: [usize; 3], cell: CageCell) {
        let parts = self.parts_of(&cell);
        let corners = std::array::from_fn(|bits| self.node(corner_of(low, bits, parts)));
        self.cover(low, self.cells.len() as u32, parts);
        self.cells.push(CageCell { corners, ..cell });
    }

    /// How many parts of the lattice a cell is long.
    const fn parts_of(&self, cell: &CageCell) -> usize {
        if cell.is_half { 1 } else { self.parts }
    }

    /// Gives so many parts of the lattice along each axis the cell of this number.
    fn cover(&mut self, low: [usize; 3], number: u32, parts: usize) {
        let counts = self.lattice();
        for bits in 0..parts.pow(3) {
            self.cell_at[index_of(corner_of(low, bits, 1), counts)] = number;
        }
    }

    /// The node at a corner of the lattice, made where there is none yet.
    fn node(&mut self, corner: [usize; 3]) -> u32 {
        let at = index_of(corner, self.lattice().map(|count| count + 1));
        if self.node_at[at] == NONE {
            self.node_at[at] = self.nodes_m.len() as u32;
            self.nodes_m.push(self.low + self.part_m() * DVec3::from_array(corner.map(|count| count as f64)));
        }
        self.node_at[at]
    }

    /// The corner of the lattice, or its part, at which a cell begins.
    fn low_of(&self, cell: &CageCell) -> [usize; 3] {
        let place = (self.nodes_m[cell.corners[0] as usize] - self.low) / self.part_m();
        place.to_array().map(|at| at.round() as usize)
    }

    /// Gives each place without a cell that of a neighbour, outwards from the cells.
    fn extend_cells(&mut self) {
        let mut reached: Vec<usize> = (0..self.cell_at.len()).filter(|at| self.cell_at[*at] != NONE).collect();
        let (mut next, counts) = (0, self.lattice());
        while next < reached.len() {
            let from = reached[next];
            next += 1;
            let mut stride = 1;
            for (at, count) in place_of(from, counts).into_iter().zip(counts) {
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
        let counts = self.lattice().map(|count| count + 1);
        let [nx, ny, nz] = counts;
        let mut rows = vec![];
        for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
            for at in 0..nx * ny * nz {
                let place = place_of(at, counts)[axis];
                // between halves, or between whole cells
                let row = (1..=self.parts).filter(|by| place >= *by && place + by < counts[axis]).find_map(|by| {
                    let row = [at - by * stride, at, at + by * stride].map(|at| self.node_at[at]);
                    (!row.contains(&NONE)).then_some(row)
                });
                rows.extend(row);
            }
        }
        rows
    }

    /// The cell that a point at rest belongs to: the one around it, or the nearest.
    #[must_use]
    pub fn cell_at(&self, at_m: DVec3) -> usize {
        let counts = self.lattice();
        self.cell_at[index_of(nearest((at_m - self.low) / self.part_m(), counts), counts)] as usize
    }

    /// Length of a cell along each axis, metres.
    fn length_of(&self, cell: &CageCell) -> DVec3 {
        if cell.is_half { self.cell_m * 0.5 } else { self.cell_m }
    }

    /// The cell that a point at rest belongs to, and where it is in it, 0 … 1 along each axis and beyond for a point that is in no cell.
    #[must_use]
    pub fn locate(&self, at_m: DVec3) -> (&CageCell, DVec3) {
        let cell = &self.cells[self.cell_at(at_m)];
        (cell, self.share_of(cell, at_m))
    }

    fn share_of(&self, cell: &CageCell, at_m: DVec3) -> DVec3 {
        (at_m - self.nodes_m[cell.corners[0] as usize]) / self.length_of(cell)
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
        for number in 0..self.cells.len() {
            let cell = self.cells[number];
            self.cover(self.low_of(&cell), number as u32, self.parts_of(&cell));
        }
        self.extend_cells();
        self.find_hanging();
    }

    /// How a point of the surface at rest moves with the cage: linear in one of the six tetrahedra of its cell, continuous from cell to cell
    /// (eq. 16), or in that of the whole cell at which one of those nodes hangs, beyond it. The cell is the one on the side of the unit vector
    /// `inward`: a surface may lie between two cells.
    #[must_use]
    pub fn carry(&self, at_m: DVec3, inward: DVec3) -> Carried {
        let carried = self.carried_in(&self.cells[self.cell_under(at_m, inward)], at_m);
        let hangs = carried.terms().find_map(|(node, _)| self.hanging_at(node as u32));
        hangs.map_or(carried, |hanging| self.carried_in(&self.cells[hanging.cell as usize], at_m))
    }

    fn carried_in(&self, cell: &CageCell, at_m: DVec3) -> Carried {
        let share = self.share_of(cell, at_m);
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

/// The place of this index, of so many along each axis.
const fn place_of(index: usize, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [index % nx, index / nx % ny, index / (nx * ny)]
}

const fn index_of([i, j, k]: [usize; 3], [nx, ny, _]: [usize; 3]) -> usize {
    i + nx * (j + ny * k)
}

/// The place that this one belongs to, or the nearest of so many along each axis.
fn nearest(place: DVec3, counts: [usize; 3]) -> [usize; 3] {
    std::array::from_fn(|axis| (place[axis].max(0.0) as usize).min(counts[axis] - 1))
}

/// The corner with these bits of what begins at `low` and is so many parts long.
const fn corner_of([i, j, k]: [usize; 3], bits: usize, parts: usize) -> [usize; 3] {
    [i + parts * (bits & 1), j + parts * (bits >> 1 & 1), k + parts * (bits >> 2)]
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
    pub(super) fn ball(radius_m: f64) -> Triangles {
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

    pub(super) fn volume(cage: &Cage) -> f64 {
        cage.cells().iter().flat_map(|cell| cell.volumes_m3).sum()
    }

    /// The centre of the volume that the corners share.
    pub(super) fn centre(cage: &Cage) -> DVec3 {
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
            let integrated: f64 = cage.volumes(&surface).iter().flatten().sum();
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
