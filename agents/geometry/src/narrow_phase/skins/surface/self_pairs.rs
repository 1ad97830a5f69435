//! The features of a skin that may touch other features of it, kept from search to search.
//!
//! In: where a skin is, and where it is at rest. Out: its pairs of near edges, and its vertices near triangles. Never here: which these are.
//!
//! They are found within more than is asked for, and are all that there can be until the skin has changed its shape by the rest: a sheet that
//! hangs still is not searched again. Features that are one at rest are never among them, so that a flat sheet has none.

use glam::DVec3;

/// See the module.
#[derive(Default)]
pub(super) struct SelfPairs {
    rest: Vec<DVec3>,
    /// Where the vertices were when all that are nearer than this, metres, were found.
    positions: Vec<DVec3>,
    within_m: f64,
    /// Numbers of edges, the lower first.
    pub edges: Vec<[u32; 2]>,
    pub vertices: Vec<u32>,
}

impl SelfPairs {
    /// Whether all that may be nearer than `asked_m` are among them.
    pub fn has_all(&self, rest: &[DVec3], positions: &[DVec3], asked_m: f64) -> bool {
        self.rest == rest && asked_m + self.change_m(positions) <= self.within_m
    }

    /// Drops the pairs that were found: the pairs nearer than `within_m` now are to follow.
    pub fn clear(&mut self, rest: &[DVec3], positions: &[DVec3], within_m: f64) {
        self.within_m = within_m;
        rest.clone_into(&mut self.rest);
        positions.clone_into(&mut self.positions);
        self.edges.clear();
        self.vertices.clear();
    }

    /// By how much at most two places have come nearer to each other since, metres: the diagonal of the box of all ways gone.
    fn change_m(&self, positions: &[DVec3]) -> f64 {
        if self.positions.len() != positions.len() {
            return f64::INFINITY;
        }
        let ways = positions.iter().zip(&self.positions).map(|(now, then)| *now - *then);
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = ways.fold(none, |(low, high), way| (low.min(way), high.max(way)));
        low.distance(high)
    }
}
