//! Division of a flat sheet: triangles on a grid, and bending elements between them.
//!
//! In: a grid and a material. Out: elements of a [`FeMesh`]. Never here: the elements themselves, sheets of any other shape.
//! Theory: docs/theory/soft.md, section 2.

use super::bending::BendingElement;
use super::fe_mesh::FeMesh;
use super::grid::Grid;
use super::membrane::Membrane;
use super::spec::{SoftMaterial, SoftShape};
use glam::DVec2;

/// A flat sheet of equal cells.
#[derive(Debug, Clone, Copy)]
struct Plate {
    /// Length of a cell along each axis, metres.
    step: DVec2,
    thickness_m: f64,
}

impl Plate {
    fn of(size_m: [f64; 2], thickness_m: f64, grid: &Grid) -> Self {
        let [nx, ny, _] = grid.cells;
        Self { step: DVec2::new(size_m[0] / nx as f64, size_m[1] / ny as f64), thickness_m }
    }
}

impl FeMesh {
    /// The triangles of a sheet of `grid`, and how they bend.
    pub(super) fn sheet(&mut self, grid: &Grid, size_m: [f64; 2], thickness_m: f64, material: &SoftMaterial) {
        let [nx, ny, _] = grid.cells;
        let plate = Plate::of(size_m, thickness_m, grid);
        let step = plate.step;
        for place in grid.places() {
            let flat = DVec2::new(place[0] as f64, place[1] as f64) * step;
            self.rest[grid.at(place) as usize] = flat.extend(0.0);
        }
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
            let [a, b, c, d] = [[i, j, 0], [i + 1, j, 0], [i + 1, j + 1, 0], [i, j + 1, 0]].map(|place| grid.at(place));
            // alternating diagonals favour no direction
            let halves = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            for corners in halves {
                let membrane = Membrane::new(corners, self.flat(corners), thickness_m, material);
                corners.iter().zip(membrane.mass_kg()).for_each(|(at, mass)| self.mass_kg[*at as usize] += mass);
                self.membranes.push(membrane);
                self.triangles.push(corners);
            }
        }
        self.list_edges();
        self.bend_sheet(grid, plate, material);
        self.radius_m = 0.5 * thickness_m;
    }

    fn flat<const N: usize>(&self, corners: [u32; N]) -> [DVec2; N] {
        corners.map(|vertex| self.rest[vertex as usize].truncate())
    }

    /// Lists the bending elements of a flat grid of cells, where there are triangles: D (|κx|² + |κy|² + 2 ν κx·κy + 2 (1 − ν) |κxy|²)/2.
    fn bend_sheet(&mut self, grid: &Grid, plate: Plate, material: &SoftMaterial) {
        let (step, poisson) = (plate.step, material.poisson);
        let rigidity_n_m = material.young_pa * plate.thickness_m.powi(3) / (12.0 * (1.0 - poisson * poisson));
        let cell = step.x * step.y;
        let far = [1.0 / (step.x * step.x), 1.0 / (step.y * step.y)];
        let joined = |a: u32, b: u32| self.edges.binary_search(&[a.min(b), a.max(b)]).is_ok();
        let mut bending = vec![];
        for [i, j, _] in grid.places() {
            let here = grid.at([i, j, 0]);
            // both neighbours along an axis, where the sheet goes on to both
            let pair = |at: usize, axis: usize| {
                let ends = (at > 0 && at < grid.cells[axis])
                    .then(|| [at - 1, at + 1].map(|to| grid.at(if axis == 0 { [to, j, 0] } else { [i, to, 0] })));
                ends.filter(|ends| ends.iter().all(|end| joined(here, *end)))
            };
            match (pair(i, 0), pair(j, 1)) {
                (Some([a, b]), Some([c, d])) => {
                    for (sign, share) in [(1.0, 0.5 * (1.0 + poisson)), (-1.0, 0.5 * (1.0 - poisson))] {
                        let (x, y) = (far[0], sign * far[1]);
                        let terms = [(a, x), (b, x), (c, y), (d, y), (here, -2.0 * (x + y))];
                        bending.push(BendingElement::new(&terms, share * rigidity_n_m * cell));
                    }
                }
                // at a free edge the sheet bends freely across it
                (Some([a, b]), None) | (None, Some([a, b])) => {
                    let w = if pair(i, 0).is_some() { far[0] } else { far[1] };
                    let stiffness = 0.5 * (1.0 - poisson * poisson) * rigidity_n_m * cell;
                    bending.push(BendingElement::new(&[(a, w), (b, w), (here, -2.0 * w)], stiffness));
                }
                (None, None) => {}
            }
            if i < grid.cells[0] && j < grid.cells[1] {
                let corners = [[i + 1, j, 0], [i, j + 1, 0], [i + 1, j + 1, 0]].map(|place| grid.at(place));
                let [beside, above, across] = corners;
                let sides = [(here, beside), (beside, across), (across, above), (above, here)];
                // a diagonal is an edge where a half of the cell is left
                if sides.iter().all(|(a, b)| joined(*a, *b)) && (joined(here, across) || joined(beside, above)) {
                    let w = 1.0 / cell;
                    let terms = [(here, w), (beside, -w), (above, -w), (across, w)];
                    bending.push(BendingElement::new(&terms, 2.0 * (1.0 - poisson) * rigidity_n_m * cell));
                }
            }
        }
        self.bending = bending;
    }

    /// Lists the bending elements anew, after triangles were taken away from a sheet of `shape`.
    pub fn bend_anew(&mut self, shape: &SoftShape, material: &SoftMaterial) {
        match shape {
            SoftShape::Sheet { size_m, thickness_m, .. } => {
                let grid = Grid::of(shape);
                self.bend_sheet(&grid, Plate::of(*size_m, *thickness_m, &grid), material);
            }
            SoftShape::Shell { thickness_m, .. } => self.bend_shell(*thickness_m, material),
            _ => {}
        }
    }
}
