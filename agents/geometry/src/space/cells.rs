//! Cells and portals: box-shaped rooms of a building, and the openings between them.
//!
//! In: boxes, convex polygons between two of them. Out: checked [`Cells`], walls as boxes with the openings left out. Never here: a view.
//! Theory: (TS91); rooms are boxes along the axes here, which is what their own subdivision of a building gives.

use glam::DVec3;
use std::fmt;

/// Coordinates that differ by less are one, metres.
pub const TOUCH_M: f64 = 1e-6;

/// A room: a box along the axes, of which the sides are opaque but for portals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Its lower corner, metres.
    pub low_m: DVec3,
    /// Its upper corner, metres; each coordinate above that of the lower one.
    pub high_m: DVec3,
}

/// One side of a portal: a cell by its number, or all that is in no cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Region {
    /// In no cell.
    Outside,
    /// The cell of this number.
    Cell(usize),
}

/// An opening: a flat convex polygon on a side of each cell that it is between.
#[derive(Debug, Clone, PartialEq)]
pub struct Portal {
    /// Its corners in their order around it, metres; three or more.
    pub corners_m: Vec<DVec3>,
    /// The regions on its two sides.
    pub between: [Region; 2],
}

/// A side of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    /// The axis across it: 0 x, 1 y, 2 z.
    pub axis: usize,
    /// Whether it is the upper one of the two along that axis.
    pub upper: bool,
}

impl Side {
    /// All sides: low and high along x, then y, then z.
    pub const ALL: [Self; 6] = [
        Self { axis: 0, upper: false },
        Self { axis: 0, upper: true },
        Self { axis: 1, upper: false },
        Self { axis: 1, upper: true },
        Self { axis: 2, upper: false },
        Self { axis: 2, upper: true },
    ];

    /// The same side of a cell beyond it.
    const fn opposite(self) -> Self {
        Self { axis: self.axis, upper: !self.upper }
    }
}

/// The faults of cells and portals, by the number of each.
#[derive(Debug, Clone, PartialEq)]
pub enum CellsError {
    /// A cell without a volume.
    Flat {
        /// Its number.
        cell: usize,
    },
    /// Two cells that share a volume.
    Overlap {
        /// The later one.
        cell: usize,
        /// The earlier one.
        with: usize,
    },
    /// A portal between a region and itself.
    Nowhere {
        /// Its number.
        portal: usize,
    },
    /// A portal that names a cell that there is not.
    Unknown {
        /// Its number.
        portal: usize,
        /// The number named.
        cell: usize,
    },
    /// A portal that is not a convex polygon of three or more corners.
    NotConvex {
        /// Its number.
        portal: usize,
    },
    /// A portal that is not on one side of a cell that it names.
    Off {
        /// Its number.
        portal: usize,
        /// The cell.
        cell: usize,
    },
    /// A portal to the outside behind which there is a cell.
    Inside {
        /// Its number.
        portal: usize,
        /// That cell.
        cell: usize,
    },
}

impl fmt::Display for CellsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flat { cell } => write!(f, "cell {cell} has no volume"),
            Self::Overlap { cell, with } => write!(f, "cells {with} and {cell} overlap"),
            Self::Nowhere { portal } => write!(f, "portal {portal} is between a region and itself"),
            Self::Unknown { portal, cell } => write!(f, "portal {portal} names cell {cell}, which does not exist"),
            Self::NotConvex { portal } => write!(f, "portal {portal} is not a convex polygon"),
            Self::Off { portal, cell } => write!(f, "portal {portal} is not on a side of cell {cell}"),
            Self::Inside { portal, cell } => write!(f, "portal {portal} leads to cell {cell}, not to the outside"),
        }
    }
}

impl std::error::Error for CellsError {}

/// Where an object is among cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Exposure {
    /// In no cell.
    #[default]
    Outside,
    /// In a cell or more, and out of all of them with a part.
    Partly,
    /// Wholly in one or more.
    Within,
}

impl Cell {
    /// Whether a point is in it or on a side of it, within a micrometre.
    #[must_use]
    pub fn holds(&self, point_m: DVec3) -> bool {
        (point_m - self.low_m).min_element() >= -TOUCH_M && (self.high_m - point_m).min_element() >= -TOUCH_M
    }

    /// Whether a box shares a volume with it: one that touches it does not.
    #[must_use]
    pub fn overlaps(&self, low_m: DVec3, high_m: DVec3) -> bool {
        (self.high_m.min(high_m) - self.low_m.max(low_m)).min_element() > TOUCH_M
    }

    /// Coordinate of a side along its axis, metres.
    #[must_use]
    pub fn side_m(&self, side: Side) -> f64 {
        if side.upper { self.high_m[side.axis] } else { self.low_m[side.axis] }
    }

    /// The side that holds every one of these points.
    fn side_of(&self, points_m: &[DVec3]) -> Option<Side> {
        let on = |side: &Side| points_m.iter().all(|p| (p[side.axis] - self.side_m(*side)).abs() <= TOUCH_M);
        Side::ALL.into_iter().find(on).filter(|_| points_m.iter().all(|p| self.holds(*p)))
    }
}

impl Portal {
    /// Its centroid, metres.
    #[must_use]
    pub fn middle_m(&self) -> DVec3 {
        self.corners_m.iter().sum::<DVec3>() / self.corners_m.len().max(1) as f64
    }

    /// The region across it from `from`.
    #[must_use]
    pub fn beyond(&self, from: Region) -> Option<Region> {
        match self.between {
            [a, b] if a == from => Some(b),
            [a, b] if b == from => Some(a),
            _ => None,
        }
    }

    /// Whether it is a rectangle along the axes.
    #[must_use]
    pub fn is_rectangle(&self) -> bool {
        let (low, high) = bounds(self);
        let at_end = |corner: &DVec3| (0..3).all(|axis| corner[axis] == low[axis] || corner[axis] == high[axis]);
        self.corners_m.len() == 4 && self.corners_m.iter().all(at_end)
    }

    /// Normal of its plane, not of length 1: the sum over its corners, by Newell.
    fn normal(&self) -> DVec3 {
        let next = self.corners_m.iter().cycle().skip(1);
        self.corners_m.iter().zip(next).map(|(a, b)| a.cross(*b)).sum()
    }

    /// Whether it is a convex polygon of three or more corners, and no two of them one.
    fn is_convex(&self) -> bool {
        let (count, normal) = (self.corners_m.len(), self.normal().normalize_or_zero());
        let corner = |k: usize| self.corners_m[k % count];
        let turn = |k: usize| (corner(k + 1) - corner(k)).cross(corner(k + 2) - corner(k + 1)).dot(normal);
        let apart = |k: usize| corner(k).distance(corner(k + 1)) > TOUCH_M;
        // the exterior angles of a polygon that winds once around add up to one turn
        let angle = |k: usize| (corner(k + 1) - corner(k)).angle_between(corner(k + 2) - corner(k + 1));
        count >= 3
            && normal != DVec3::ZERO
            && (0..count).all(|k| apart(k) && turn(k) >= -TOUCH_M * TOUCH_M)
            && (0..count).map(angle).sum::<f64>() < 1.5 * std::f64::consts::TAU
    }
}

/// Cells without a common volume, and portals on their sides.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells {
    cells: Vec<Cell>,
    portals: Vec<Portal>,
}

impl Cells {
    /// Checks cells and portals.
    ///
    /// # Errors
    /// [`CellsError`]: every fault of a cell, and if there is none, the first fault of each portal.
    pub fn new(cells: Vec<Cell>, portals: Vec<Portal>) -> Result<Self, Vec<CellsError>> {
        let mut faults = Vec::new();
        for (cell, it) in cells.iter().enumerate() {
            if (it.high_m - it.low_m).min_element() <= TOUCH_M {
                faults.push(CellsError::Flat { cell });
            }
            let overlapped = cells[..cell].iter().position(|other| other.overlaps(it.low_m, it.high_m));
            faults.extend(overlapped.map(|with| CellsError::Overlap { cell, with }));
        }
        if faults.is_empty() {
            faults.extend(portals.iter().enumerate().filter_map(|(at, it)| fault(&cells, at, it)));
        }
        if faults.is_empty() { Ok(Self { cells, portals }) } else { Err(faults) }
    }

    /// The cells.
    #[must_use]
    pub fn all(&self) -> &[Cell] {
        &self.cells
    }

    /// The portals.
    #[must_use]
    pub fn portals(&self) -> &[Portal] {
        &self.portals
    }

    /// The side of a cell that a portal is on, if it is on one.
    #[must_use]
    pub fn side(&self, cell: usize, portal: &Portal) -> Option<Side> {
        self.cells.get(cell)?.side_of(&portal.corners_m)
    }

    /// Where a box is among the cells.
    #[must_use]
    pub fn exposure(&self, low_m: DVec3, high_m: DVec3) -> Exposure {
        if !self.cells.iter().any(|cell| cell.overlaps(low_m, high_m)) {
            return Exposure::Outside;
        }
        let volume = |size: DVec3| if size.min_element() > 0.0 { size.element_product() } else { 0.0 };
        // an object that stands on the floor of a cell is in it
        let (middle, half) =
            (0.5 * (low_m + high_m), (0.5 * (high_m - low_m) - TOUCH_M).max(DVec3::splat(0.1 * TOUCH_M)));
        let (low, high) = (middle - half, middle + half);
        let within: f64 = self.cells.iter().map(|cell| volume(cell.high_m.min(high) - cell.low_m.max(low))).sum();
        if within >= (1.0 - 1e-9) * volume(high - low) { Exposure::Within } else { Exposure::Partly }
    }

    /// The walls of a cell on these sides, `thickness_m` thick and within it, as lower and upper corners of boxes that do not overlap: each
    /// side less the bounding rectangles of its portals.
    #[must_use]
    pub fn walls(&self, cell: usize, sides: &[Side], thickness_m: f64) -> Vec<(DVec3, DVec3)> {
        let Some(it) = self.cells.get(cell) else { return Vec::new() };
        let mut walls = Vec::new();
        for &side in sides {
            let holes = self.portals.iter().filter(|portal| portal.between.contains(&Region::Cell(cell)));
            let holes: Vec<_> =
                holes.filter(|portal| it.side_of(&portal.corners_m) == Some(side)).map(bounds).collect();
            walls.extend(panels(wall(it, side, sides, thickness_m), side.axis, &holes));
        }
        walls
    }
}

/// The whole wall of a side. Floors and ceilings reach under and over all other walls, those across x past those across y.
fn wall(cell: &Cell, side: Side, sides: &[Side], thickness_m: f64) -> (DVec3, DVec3) {
    let (mut low, mut high) = (cell.low_m, cell.high_m);
    let rank = |axis: usize| [1, 0, 2][axis];
    for other in sides.iter().filter(|other| rank(other.axis) > rank(side.axis)) {
        let edge = if other.upper { &mut high } else { &mut low };
        edge[other.axis] += if other.upper { -thickness_m } else { thickness_m };
    }
    match side.upper {
        true => low[side.axis] = high[side.axis] - thickness_m,
        false => high[side.axis] = low[side.axis] + thickness_m,
    }
    (low, high)
}

/// A slab across `axis` without its holes: strips along the first of the other axes, cut where a hole begins or ends.
fn panels(slab: (DVec3, DVec3), axis: usize, holes: &[(DVec3, DVec3)]) -> Vec<(DVec3, DVec3)> {
    let (low, high) = slab;
    let [u, v] = [[1, 2], [0, 2], [0, 1]][axis];
    let mut cuts: Vec<f64> = holes.iter().flat_map(|hole| [hole.0[u], hole.1[u]]).chain([low[u], high[u]]).collect();
    cuts.retain(|cut| (low[u]..=high[u]).contains(cut));
    cuts.sort_by(f64::total_cmp);
    let mut found = Vec::new();
    let mut add = |from: [f64; 2], to: [f64; 2]| {
        if to[0] - from[0] > TOUCH_M && to[1] - from[1] > TOUCH_M {
            let (mut a, mut b) = (low, high);
            (a[u], a[v], b[u], b[v]) = (from[0], from[1], to[0], to[1]);
            found.push((a, b));
        }
    };
    for strip in cuts.windows(2) {
        let middle = 0.5 * (strip[0] + strip[1]);
        let mut open: Vec<_> = holes.iter().filter(|hole| hole.0[u] < middle && middle < hole.1[u]).collect();
        open.sort_by(|a, b| a.0[v].total_cmp(&b.0[v]));
        let mut from = low[v];
        for hole in open {
            add([strip[0], from], [strip[1], hole.0[v].min(high[v])]);
            from = from.max(hole.1[v]);
        }
        add([strip[0], from], [strip[1], high[v]]);
    }
    found
}

/// The bounding box of a portal.
fn bounds(portal: &Portal) -> (DVec3, DVec3) {
    let fold = |of: fn(DVec3, DVec3) -> DVec3| portal.corners_m.iter().copied().reduce(of).unwrap_or_default();
    (fold(DVec3::min), fold(DVec3::max))
}

/// The first fault of a portal.
fn fault(cells: &[Cell], number: usize, portal: &Portal) -> Option<CellsError> {
    if portal.between[0] == portal.between[1] {
        return Some(CellsError::Nowhere { portal: number });
    }
    let named =
        portal.between.iter().filter_map(|region| if let Region::Cell(cell) = region { Some(*cell) } else { None });
    if let Some(cell) = named.clone().find(|cell| *cell >= cells.len()) {
        return Some(CellsError::Unknown { portal: number, cell });
    }
    if !portal.is_convex() {
        return Some(CellsError::NotConvex { portal: number });
    }
    let mut first = None;
    for cell in named.clone() {
        let side = cells[cell].side_of(&portal.corners_m);
        let fits = side.is_some_and(|side| first.is_none_or(|first: Side| first.opposite() == side));
        if !fits {
            return Some(CellsError::Off { portal: number, cell });
        }
        first = side;
    }
    let (side, middle) = (first?, portal.middle_m());
    let out = if side.upper { 10.0 * TOUCH_M } else { -10.0 * TOUCH_M };
    let leads_to = |corner: &DVec3| {
        // a little towards the middle: a neighbour of its rim is not behind it
        let mut point = *corner + 1e-3 * (middle - *corner);
        point[side.axis] += out;
        cells.iter().position(|cell| cell.overlaps(point - 2.0 * TOUCH_M, point + 2.0 * TOUCH_M))
    };
    let behind = || portal.corners_m.iter().chain([&middle]).find_map(leads_to);
    let outside = portal.between.contains(&Region::Outside);
    outside.then(behind).flatten().map(|cell| CellsError::Inside { portal: number, cell })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(low: [f64; 3], high: [f64; 3]) -> Cell {
        Cell { low_m: low.into(), high_m: high.into() }
    }

    /// Two rooms of 4 × 3 × 2.5 m side by side along x.
    fn rooms() -> Vec<Cell> {
        vec![cell([0.0; 3], [4.0, 3.0, 2.5]), cell([4.0, 0.0, 0.0], [8.0, 3.0, 2.5])]
    }

    /// A rectangle across x.
    fn door(x: f64, y: [f64; 2], z: [f64; 2], between: [Region; 2]) -> Portal {
        let corners = [[y[0], z[0]], [y[1], z[0]], [y[1], z[1]], [y[0], z[1]]];
        Portal { corners_m: corners.map(|[y, z]| DVec3::new(x, y, z)).into(), between }
    }

    const BOTH: [Region; 2] = [Region::Cell(0), Region::Cell(1)];

    fn only(portal: Portal) -> Vec<CellsError> {
        Cells::new(rooms(), vec![portal]).unwrap_err()
    }

    #[test]
    fn a_fault_names_its_cell_or_portal() {
        let mut cells = rooms();
        cells[1].low_m.x = 3.9;
        cells.push(cell([0.0, 5.0, 0.0], [1.0, 5.0, 1.0]));
        let faults = Cells::new(cells, vec![]).unwrap_err();
        assert_eq!(faults, [CellsError::Overlap { cell: 1, with: 0 }, CellsError::Flat { cell: 2 }]);
        let (y, z) = ([1.0, 2.0], [0.0, 2.0]);
        assert!(Cells::new(rooms(), vec![door(4.0, y, z, BOTH)]).is_ok());
        assert_eq!(only(door(4.0, y, z, [BOTH[0]; 2])), [CellsError::Nowhere { portal: 0 }]);
        let unknown = [Region::Outside, Region::Cell(2)];
        assert_eq!(only(door(4.0, y, z, unknown)), [CellsError::Unknown { portal: 0, cell: 2 }]);
        assert_eq!(only(door(4.1, y, z, BOTH)), [CellsError::Off { portal: 0, cell: 0 }]);
        assert_eq!(only(door(4.0, [1.0, 3.5], z, BOTH)), [CellsError::Off { portal: 0, cell: 0 }]);
        let outside = [Region::Cell(0), Region::Outside];
        assert_eq!(only(door(4.0, y, z, outside)), [CellsError::Inside { portal: 0, cell: 1 }]);
        assert!(Cells::new(rooms(), vec![door(0.0, y, z, outside)]).is_ok());
        assert_eq!(only(door(0.0, y, z, BOTH)), [CellsError::Off { portal: 0, cell: 1 }]);
    }

    #[test]
    fn a_portal_is_a_convex_polygon_that_winds_once() {
        let of = |corners: &[[f64; 2]]| Portal {
            corners_m: corners.iter().map(|[y, z]| DVec3::new(4.0, *y, *z)).collect(),
            between: BOTH,
        };
        let is_refused = |portal: Portal| only(portal) == [CellsError::NotConvex { portal: 0 }];
        assert!(is_refused(of(&[[1.0, 0.0], [2.0, 0.0]])));
        assert!(is_refused(of(&[[1.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 1.0]])), "crosses itself");
        assert!(is_refused(of(&[[1.0, 0.0], [2.0, 0.0], [1.2, 0.2], [1.0, 1.0]])), "has a dent");
        let star = |k: i32| (f64::from(2 * k) * std::f64::consts::TAU / 5.0).sin_cos();
        let star: Vec<_> = (0..5).map(star).map(|(sin, cos)| [1.5 + 0.5 * sin, 1.0 + 0.5 * cos]).collect();
        assert!(is_refused(of(&star)), "winds twice");
        assert!(Cells::new(rooms(), vec![of(&[[1.0, 0.0], [2.0, 0.0], [1.5, 2.0]])]).is_ok());
    }

    #[test]
    fn walls_fill_what_portals_leave_of_the_sides() {
        let portals = vec![door(4.0, [1.0, 2.0], [0.0, 2.0], BOTH), door(4.0, [2.5, 2.8], [1.0, 2.0], BOTH)];
        let cells = Cells::new(rooms(), portals).unwrap();
        let walls = cells.walls(0, &Side::ALL, 0.1);
        let volume: f64 = walls.iter().map(|(low, high)| (*high - *low).element_product()).sum();
        // the shell of the room, without 0.1 m × the openings above the floor
        let shell = 4.0 * 3.0 * 2.5 - 3.8 * 2.8 * 2.3;
        let openings = 0.1 * (1.0 * 1.9 + 0.3 * 1.0);
        assert!((volume - (shell - openings)).abs() < 1e-9, "{volume}");
        let overlap = |a: &(DVec3, DVec3), b: &(DVec3, DVec3)| (a.1.min(b.1) - a.0.max(b.0)).min_element() > 1e-9;
        let pairs = (0..walls.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        assert!(pairs.into_iter().all(|(i, j)| !overlap(&walls[i], &walls[j])));
    }

    #[test]
    fn what_stands_on_a_floor_is_within_its_cell_and_what_leans_out_is_partly() {
        let cells = Cells::new(rooms(), vec![]).unwrap();
        let of = |low: [f64; 3], high: [f64; 3]| cells.exposure(low.into(), high.into());
        assert_eq!(of([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]), Exposure::Within);
        assert_eq!(of([3.0, 1.0, 0.0], [5.0, 2.0, 1.0]), Exposure::Within, "in both");
        assert_eq!(of([1.0, 1.0, 0.5], [2.0, 2.0, 0.5]), Exposure::Outside, "without a volume it is in no cell");
        assert_eq!(of([-1.0, 1.0, 0.0], [2.0, 2.0, 1.0]), Exposure::Partly);
        assert_eq!(of([1.0, 1.0, 2.5], [2.0, 2.0, 3.0]), Exposure::Outside);
    }
}
