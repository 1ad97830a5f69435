//! A regular grid of vertices: their numbers, and the sides a scene can name.
//!
//! In: cells along three axes. Out: numbers of vertices, rows of them, and the vertices on a side. Never here: where they are.
//! Vertices are numbered along the axis with the fewest cells first: the band of the matrix is then as narrow as it can be.

use super::spec::SoftShape;

metachron_core::choices! {
    /// A side of a soft body, in its own axes: a rope has two ends, a sheet four edges, a box six faces.
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum Side {
        /// Where x is least; the start of a rope.
        Left = "left",
        /// Where x is largest; the end of a rope.
        Right = "right",
        /// Where y is least.
        Near = "near",
        /// Where y is largest.
        Far = "far",
        /// Where z is least.
        Bottom = "bottom",
        /// Where z is largest.
        Top = "top",
    }
}

impl Side {
    /// Its axis, and whether it is where that coordinate is largest.
    pub(super) const fn place(self) -> (usize, bool) {
        match self {
            Self::Left => (0, false),
            Self::Right => (0, true),
            Self::Near => (1, false),
            Self::Far => (1, true),
            Self::Bottom => (2, false),
            Self::Top => (2, true),
        }
    }

    /// Whether a shape has this side; a ball has none.
    #[must_use]
    pub const fn of(self, shape: &SoftShape) -> bool {
        let axes = match shape {
            SoftShape::Rope { .. } => 1,
            SoftShape::Sheet { .. } => 2,
            SoftShape::Box { .. }
            | SoftShape::Embedded { .. }
            | SoftShape::Tetrahedra { .. }
            | SoftShape::Shell { .. } => 3,
            SoftShape::Ball { .. } => 0,
        };
        self.place().0 < axes
    }
}

/// A grid of vertices.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// Cells along each axis; zero along an axis that the shape does not have.
    pub cells: [usize; 3],
    stride: [usize; 3],
}

impl Grid {
    /// The grid of a shape.
    pub fn of(shape: &SoftShape) -> Self {
        let cells = match *shape {
            SoftShape::Rope { segments, .. } => [segments, 0, 0],
            SoftShape::Sheet { segments: [x, y], .. } => [x, y, 0],
            SoftShape::Box { segments, .. } => segments,
            SoftShape::Ball { segments, .. } => [segments; 3],
            // these have a cage or a mesh
            SoftShape::Embedded { .. } | SoftShape::Tetrahedra { .. } | SoftShape::Shell { .. } => [0; 3],
        };
        let cells = cells.map(|count| count as usize);
        let mut axes = [2, 1, 0];
        axes.sort_by_key(|axis| cells[*axis]);
        let (mut stride, mut next) = ([0; 3], 1);
        for axis in axes {
            stride[axis] = next;
            next *= cells[axis] + 1;
        }
        Self { cells, stride }
    }

    /// How many vertices there are.
    pub fn count(&self) -> usize {
        self.cells.iter().map(|cells| cells + 1).product()
    }

    /// The number of a vertex.
    pub fn at(&self, place: [usize; 3]) -> u32 {
        (0..3).map(|axis| place[axis] * self.stride[axis]).sum::<usize>() as u32
    }

    /// The place of every vertex, in no particular order.
    pub fn places(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let [x, y, z] = self.cells;
        (0..=x).flat_map(move |i| (0..=y).flat_map(move |j| (0..=z).map(move |k| [i, j, k])))
    }

    /// Three vertices in a row, for each inner vertex and axis.
    pub fn rows(&self) -> Vec<[u32; 3]> {
        let mut rows = vec![];
        for place in self.places() {
            for axis in (0..3).filter(|&axis| place[axis] > 0 && place[axis] < self.cells[axis]) {
                let beside = |by: isize| {
                    let mut there = place;
                    there[axis] = there[axis].wrapping_add_signed(by);
                    self.at(there)
                };
                rows.push([beside(-1), self.at(place), beside(1)]);
            }
        }
        rows
    }

    /// The vertices on a side.
    pub fn on(&self, side: Side) -> impl Iterator<Item = u32> + '_ {
        let (axis, last) = side.place();
        let at = if last { self.cells[axis] } else { 0 };
        self.places().filter(move |place| place[axis] == at).map(|place| self.at(place))
    }
}
