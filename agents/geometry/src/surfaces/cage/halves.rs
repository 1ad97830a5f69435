//! Cells of a cage that are halved where they should be finer: eight for one, once, and the nodes that hang between whole cells and halves.
//!
//! In: the points about which cells are halved; volumes of halves. Out: cells of half the length, hanging nodes. Never here: when cells are halved.
//! Theory: docs/theory/soft.md, section 12.

use super::{Cage, CageCell, Carried, NONE, corner_of, index_of, nearest, place_of};
use glam::DVec3;

/// Where the cells of a cage are halved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Halving<'a> {
    /// The cells of these points at rest and their neighbours are halved, metres.
    pub about_m: &'a [DVec3],
    /// Only if they are longer than this, metres.
    pub longer_than_m: f64,
}

impl Halving<'_> {
    /// Nowhere.
    pub const NONE: Self = Self { about_m: &[], longer_than_m: f64::INFINITY };
}

/// A corner of halves in the middle of an edge or a face of a whole cell: it moves with the ends of the edge, or the corners of the face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HangingNode {
    /// Its number.
    pub node: u32,
    /// The two or four nodes, which hang at none.
    pub carried: Carried,
    /// The whole cell.
    pub cell: u32,
}

impl CageCell {
    /// A whole cell, still without nodes.
    pub(super) const WHOLE: Self = Self { corners: [NONE; 8], fill: 0.0, volumes_m3: [0.0; 8], is_half: false };
}

impl Cage {
    /// The places of whole cells that are `halving`, in rising order.
    pub(super) fn places_of(&self, halving: Halving<'_>) -> Vec<usize> {
        // by more than rounding
        if self.cell_m.max_element() * (1.0 - 1e-9) <= halving.longer_than_m {
            return vec![];
        }
        let mut places = vec![];
        for at_m in halving.about_m {
            let middle = self.place_at(*at_m);
            let beside = |by: [usize; 3]| {
                let at = |axis: usize| (middle[axis] + by[axis]).saturating_sub(1).min(self.counts[axis] - 1);
                index_of([at(0), at(1), at(2)], self.counts)
            };
            places.extend((0..27).map(|at| beside(place_of(at, [3; 3]))));
        }
        places.sort_unstable();
        places.dedup();
        places
    }

    /// The place of a whole cell that a point at rest belongs to, or the nearest, counted along each axis.
    #[must_use]
    pub fn place_at(&self, at_m: DVec3) -> [usize; 3] {
        nearest((at_m - self.low) / self.cell_m, self.counts)
    }

    /// Whether its cells are halved as they would be by `halving`.
    #[must_use]
    pub fn is_halved(&self, halving: Halving<'_>) -> bool {
        self.halved == self.places_of(halving)
    }

    /// Makes the cells of a place that is halved, of `whole_m3` together: those of its halves that are filled at least as far as `least`. Whether
    /// there are any.
    pub(super) fn halve(&mut self, place: usize, whole_m3: f64, halves: &[[f64; 8]], least: f64) -> bool {
        let low = place_of(place, self.counts).map(|count| 2 * count);
        let full = 0.125 * self.cell_m.element_product();
        let parts = [0, 1, 2, 3, 4, 5, 6, 7].map(|bits| corner_of(low, bits, 1));
        let of = |part: [usize; 3]| &halves[index_of(part, self.lattice())];
        let sum = |part: [usize; 3]| of(part).iter().sum::<f64>();
        let kept: Vec<_> = parts.into_iter().filter(|part| sum(*part) > 0.0 && sum(*part) >= least * full).collect();
        let scale = whole_m3 / kept.iter().map(|part| sum(*part)).sum::<f64>();
        let cell = |part: &[usize; 3]| CageCell {
            volumes_m3: of(*part).map(|volume| volume * scale),
            fill: (sum(*part) / full * scale).min(1.0),
            is_half: true,
            ..CageCell::WHOLE
        };
        let cells: Vec<CageCell> = kept.iter().map(cell).collect();
        kept.iter().zip(cells).for_each(|(part, cell)| self.add(*part, cell));
        !kept.is_empty()
    }

    /// Finds the nodes that hang at whole cells.
    pub(super) fn find_hanging(&mut self) {
        self.hanging.clear();
        if self.parts == 1 {
            return;
        }
        let nodes = self.lattice().map(|count| count + 1);
        for (number, cell) in (0..).zip(&self.cells).filter(|(_, cell)| !cell.is_half) {
            let low = self.low_of(cell);
            // the places of corners, and between them along each axis
            for by in (0..27).map(|at| place_of(at, [3; 3])) {
                let node = self.node_at[index_of([0, 1, 2].map(|axis| low[axis] + by[axis]), nodes)];
                let between = by.iter().filter(|by| **by == 1).count();
                if between == 0 || node == NONE {
                    continue;
                }
                let at =
                    |bits: usize| [0, 1, 2].into_iter().all(|axis| by[axis] == 1 || by[axis] == 2 * (bits >> axis & 1));
                let mut carried = Carried { nodes: [node; 4], weights: [0.0; 4] };
                for (term, bits) in (0..8).filter(|bits| at(*bits)).enumerate() {
                    (carried.nodes[term], carried.weights[term]) = (cell.corners[bits], 1.0 / f64::from(1 << between));
                }
                self.hanging.push(HangingNode { node, carried, cell: number });
            }
        }
        self.hanging.sort_by_key(|hanging| hanging.node);
        self.hanging.dedup_by_key(|hanging| hanging.node);
    }

    /// The nodes that hang at whole cells, by rising numbers.
    #[must_use]
    pub fn hanging(&self) -> &[HangingNode] {
        &self.hanging
    }

    /// How a node hangs; `None` where it does not.
    pub(super) fn hanging_at(&self, node: u32) -> Option<&HangingNode> {
        let at = self.hanging.binary_search_by_key(&node, |hanging| hanging.node);
        at.ok().map(|at| &self.hanging[at])
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ball, centre, volume};
    use super::*;

    /// Where a tool touches a ball of 0.1 m.
    const TOUCHED: [DVec3; 2] = [DVec3::new(0.0, 0.0, 0.1), DVec3::new(0.07, 0.05, -0.05)];
    const EPS_M: f64 = 0.03;

    fn halved(about_m: &[DVec3]) -> Cage {
        Cage::halved(&ball(0.1), EPS_M, 10_000, Halving { about_m, longer_than_m: 0.02 }).unwrap()
    }

    #[test]
    fn halves_have_the_volume_of_their_place_and_lie_within_a_cell_of_what_touches() {
        let (whole, cage) = (halved(&[]), halved(&TOUCHED));
        let of = |cage: &Cage| {
            let mut volumes = vec![0.0; 7 * 7 * 7];
            for cell in cage.cells() {
                let middle = cage.length_of(cell) * 0.5 + cage.nodes_m[cell.corners[0] as usize];
                volumes[index_of(cage.place_at(middle), [7; 3])] += cell.volumes_m3.iter().sum::<f64>();
            }
            volumes
        };
        for (wanted, found) in of(&whole).iter().zip(of(&cage)) {
            assert!((wanted - found).abs() < 1e-15 * whole.cell_m().element_product(), "{wanted} {found}");
        }
        assert!(centre(&cage).length() < 2e-4 && (volume(&cage) / volume(&whole) - 1.0).abs() < 1e-12);
        let apart = |cell: &CageCell| {
            let at = cage.place_at(cage.nodes_m[cell.corners[0] as usize] + cage.part_m() * 0.5).map(|at| at as i32);
            let from = |point: &DVec3| {
                let place = cage.place_at(*point).map(|at| at as i32);
                [0, 1, 2].map(|axis| (at[axis] - place[axis]).abs()).into_iter().max().unwrap()
            };
            TOUCHED.iter().map(from).min().unwrap()
        };
        assert!(cage.cells().iter().all(|cell| cell.is_half == (apart(cell) <= 1)));
        assert!(cage.cells().iter().filter(|cell| cell.is_half).count() > 80 && whole.hanging().is_empty());
    }

    #[test]
    fn a_node_hangs_in_the_middle_of_those_that_it_moves_with_and_none_of_these_hangs() {
        let cage = halved(&TOUCHED);
        assert!(cage.hanging().len() > 20);
        for HangingNode { node, carried, cell } in cage.hanging() {
            assert!(carried.mean(cage.nodes_m()).distance(cage.nodes_m()[*node as usize]) < 1e-15);
            assert!(carried.terms().all(|(by, _)| cage.hanging_at(by as u32).is_none()));
            assert!(!cage.cells()[*cell as usize].is_half);
        }
        // no other node is on a whole cell but its corners
        let on = |cell: &CageCell, at_m: DVec3| {
            let share = cage.share_of(cell, at_m);
            share.min_element() > -1e-9 && share.max_element() < 1.0 + 1e-9
        };
        for cell in cage.cells().iter().filter(|cell| !cell.is_half) {
            for (node, at_m) in (0..).zip(cage.nodes_m()).filter(|(_, at_m)| on(cell, **at_m)) {
                assert!(cell.corners.contains(&node) || cage.hanging_at(node).is_some(), "{at_m}");
            }
        }
    }

    #[test]
    fn what_is_carried_across_follows_any_linear_motion_by_nodes_that_do_not_hang() {
        let (surface, mut cage) = (ball(0.1), halved(&TOUCHED));
        let bent = |x: DVec3| DVec3::new(1.0 + 2.0 * x.y, x.z - 0.3 * x.x, 0.5 * x.x + x.z);
        for _ in 0..2 {
            let moved: Vec<DVec3> = cage.nodes_m().iter().map(|node| bent(*node)).collect();
            for point in &surface.points {
                let carried = cage.carry(*point, -point.normalize());
                assert!(carried.mean(&moved).distance(bent(*point)) < 1e-12);
                assert!(carried.terms().all(|(node, _)| cage.hanging_at(node as u32).is_none()));
            }
            // and again without some cells, of both kinds
            let gone: Vec<bool> = (0..cage.cells().len()).map(|cell| cell % 7 == 3).collect();
            cage.remove(&gone);
        }
    }

    #[test]
    fn cells_that_are_no_longer_than_asked_for_are_not_halved() {
        let halving = Halving { about_m: &TOUCHED, longer_than_m: 0.03 };
        let cage = Cage::halved(&ball(0.1), EPS_M, 10_000, halving).unwrap();
        assert!(cage.cells().iter().all(|cell| !cell.is_half) && cage.is_halved(Halving::NONE));
        assert!(halved(&TOUCHED).is_halved(Halving { longer_than_m: 0.02, ..halving }));
        assert!(!halved(&TOUCHED[..1]).is_halved(Halving { longer_than_m: 0.02, ..halving }));
    }
}
