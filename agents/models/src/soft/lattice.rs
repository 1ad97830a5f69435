//! The lattice of a sheet or a rope as the carrier of a skin: which nodes move a material point.
//!
//! In: a shape and a spacing. Out: nodes in material coordinates, and the nodes that carry any point: a triangle's three, a piece's two.
//! Never here: masses, elements, where anything is now. Theory: docs/theory/soft.md, eq. 23.

use super::grid::Grid;
use super::spec::SoftShape;
use glam::{DVec2, DVec3};
use metachron_geometry::Carried;

/// A share of a cell this near to 0 or 1 is that: a point on an edge is carried by the edge alone.
const ON_EDGE: f64 = 1e-9;
/// More cells than this along an axis are far too many, and one more would be no different.
const CELLS_MAX: f64 = 1e6;

impl SoftShape {
    /// A sheet or a rope of the same dimensions with cells of at most `eps_m` metres, > 0; `None` for other shapes.
    #[must_use]
    pub fn divided_by(&self, eps_m: f64) -> Option<Self> {
        let [along, across, _] = counts_at(self, eps_m)?.map(|count| count as u32);
        match self.clone() {
            Self::Sheet { size_m, thickness_m, .. } => {
                Some(Self::Sheet { size_m, thickness_m, segments: [along, across] })
            }
            Self::Rope { path_m, radius_m, .. } => Some(Self::Rope { path_m, radius_m, segments: along }),
            _ => None,
        }
    }
}

/// Cells of at most `eps_m` along each axis of a sheet or a rope, 0 along one that it does not have; `None` for other shapes.
pub(super) fn counts_at(shape: &SoftShape, eps_m: f64) -> Option<[usize; 3]> {
    let cells =
        |size: f64| if size > 0.0 { (size / eps_m * (1.0 - 1e-9)).ceil().clamp(1.0, CELLS_MAX) as usize } else { 0 };
    extent_m(shape).map(|extent| [cells(extent.x), cells(extent.y), 0])
}

/// The extent of a sheet along its axes, or the length of a rope, metres; `None` for other shapes.
fn extent_m(shape: &SoftShape) -> Option<DVec2> {
    match shape {
        SoftShape::Sheet { size_m, .. } => Some(DVec2::from_array(*size_m)),
        SoftShape::Rope { path_m, .. } => {
            Some(DVec2::new(path_m.windows(2).map(|pair| pair[0].distance(pair[1])).sum(), 0.0))
        }
        _ => None,
    }
}

/// A lattice in material coordinates: x and y of a flat sheet, the length from the start of a rope.
pub(super) struct Lattice {
    /// The sheet or rope with the segments that are its cells.
    shape: SoftShape,
    grid: Grid,
    /// Length of a cell along each axis, metres; 0 along the second of a rope.
    cell_m: DVec2,
    nodes_m: Vec<DVec3>,
    /// The number of each triangle of a sheet among the triangles that are left; `None` where it is gone.
    triangles: Vec<Option<u32>>,
}

impl Lattice {
    /// The lattice of a sheet or a rope; `None` for other shapes.
    pub fn of(shape: SoftShape) -> Option<Self> {
        let extent = extent_m(&shape)?;
        let grid = Grid::of(&shape);
        let [x, y, _] = grid.cells.map(|cells| cells.max(1) as f64);
        let cell_m = extent / DVec2::new(x, y);
        let mut nodes_m = vec![DVec3::ZERO; grid.count()];
        for place in grid.places() {
            let at = DVec2::new(place[0] as f64, place[1] as f64);
            nodes_m[grid.at(place) as usize] = (at * cell_m).extend(0.0);
        }
        let [along, across, _] = grid.cells;
        let triangles = (0..2 * (along * across) as u32).map(Some).collect();
        Some(Self { shape, grid, cell_m, nodes_m, triangles })
    }

    /// The sheet or rope with the segments that are its cells.
    pub const fn shape(&self) -> &SoftShape {
        &self.shape
    }

    /// The nodes in material coordinates, metres.
    pub fn nodes_m(&self) -> &[DVec3] {
        &self.nodes_m
    }

    /// Cells along each axis; 0 along one that the shape does not have.
    pub const fn counts(&self) -> [usize; 3] {
        self.grid.cells
    }

    /// The greatest length of a cell, metres.
    pub fn cell_m(&self) -> f64 {
        self.cell_m.max_element()
    }

    /// How the point with these material coordinates moves with the nodes: linear in a triangle or a piece of the lattice (eq. 23).
    pub fn carry(&self, at_m: DVec3) -> Carried {
        let x = Share::of(at_m.x, self.cell_m.x, self.grid.cells[0]);
        if self.grid.cells[1] == 0 {
            let ends = [x.cell, x.cell + 1].map(|i| self.grid.at([i, 0, 0]));
            return Carried {
                nodes: [ends[0], ends[1], ends[1], ends[1]],
                weights: [1.0 - x.share, x.share, 0.0, 0.0],
            };
        }
        let y = Share::of(at_m.y, self.cell_m.y, self.grid.cells[1]);
        let (i, j, u, v) = (x.cell, y.cell, x.share, y.share);
        let nodes = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[i, j]| self.grid.at([i, j, 0]));
        let weights = match (is_rising(i, j), is_second([i, j], [u, v])) {
            (true, false) => [1.0 - u, u - v, v, 0.0],
            (true, true) => [1.0 - v, 0.0, u, v - u],
            (false, false) => [1.0 - u - v, u, 0.0, v],
            (false, true) => [0.0, 1.0 - v, u + v - 1.0, 1.0 - u],
        };
        Carried { nodes, weights }
    }

    /// The number of the triangle of a sheet that a material point is in among the triangles left; `None` where it is gone.
    pub fn triangle_at(&self, at_m: DVec3) -> Option<usize> {
        let [along, across, _] = self.grid.cells;
        let (x, y) = (Share::of(at_m.x, self.cell_m.x, along), Share::of(at_m.y, self.cell_m.y, across.max(1)));
        let half = usize::from(is_second([x.cell, y.cell], [x.share, y.share]));
        // in the order of the elements: `FeMesh::sheet`
        self.triangles.get(2 * (x.cell * across + y.cell) + half).copied().flatten().map(|number| number as usize)
    }

    /// Takes triangles of a sheet away, by their numbers among those left, which are numbered anew in the same order.
    pub fn remove(&mut self, is_gone: &[bool]) {
        let mut left = 0..;
        for number in &mut self.triangles {
            *number = number.filter(|number| !is_gone[*number as usize]).and_then(|_| left.next());
        }
    }
}

/// Whether the diagonal of a cell of a sheet goes from its origin: the diagonals of the elements (`FeMesh::sheet`).
const fn is_rising(i: usize, j: usize) -> bool {
    (i + j).is_multiple_of(2)
}

/// Whether a point at these shares of a cell is in the second of its triangles.
fn is_second([i, j]: [usize; 2], [u, v]: [f64; 2]) -> bool {
    if is_rising(i, j) { u < v } else { u + v > 1.0 }
}
/// A place along one axis: a cell, and the share of it that is before the place.
struct Share {
    cell: usize,
    share: f64,
}

impl Share {
    fn of(at_m: f64, cell_m: f64, cells: usize) -> Self {
        let place = at_m / cell_m;
        let cell = (place.max(0.0) as usize).min(cells - 1);
        let share = (place - cell as f64).clamp(0.0, 1.0);
        let near = if share < ON_EDGE { 0.0 } else { share };
        Self { cell, share: if near > 1.0 - ON_EDGE { 1.0 } else { near } }
    }
}
