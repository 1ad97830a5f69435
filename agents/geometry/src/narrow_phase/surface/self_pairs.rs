//! The features of a skin that may touch other features of it, kept from search to search.
//!
//! In: a skin, where it is and where it is at rest. Out: its pairs of near edges, and its vertices near triangles. Never here: contacts.
//!
//! They are found within more than is asked for, and are all that there can be until the skin has changed its shape by the rest: a sheet that
//! hangs still is not searched again. Features that are one at rest are never among them, so that a flat sheet has none.

use super::super::skin_tree::KnownForm;
use super::Surface;
use super::surface_surface::SkinPair;
use crate::SurfaceShape;
use glam::DVec3;

/// By how much more than is asked for they are found, as a share of the length of an edge.
const ROOM_SHARE: f64 = 0.25;

/// See the module.
pub(in super::super) struct SelfPairs {
    form: KnownForm,
    rest: Vec<DVec3>,
    /// Where the vertices were when all that are nearer than this, metres, were found.
    positions: Vec<DVec3>,
    within_m: f64,
    /// Numbers of edges, the lower first.
    pub edges: Vec<[u32; 2]>,
    pub vertices: Vec<u32>,
}

impl SelfPairs {
    pub fn new(form: &SurfaceShape) -> Self {
        let (form, within_m) = (KnownForm::new(form), 0.0);
        Self { form, rest: vec![], positions: vec![], within_m, edges: vec![], vertices: vec![] }
    }

    pub fn is_of(&self, form: &SurfaceShape) -> bool {
        self.form.is_that_of(form)
    }

    /// Whether somebody still has the skin.
    pub fn is_wanted(&self) -> bool {
        self.form.is_had()
    }

    /// Finds them anew where some that are asked for may be missing.
    pub fn bring_to(&mut self, surface: &Surface<'_>, rest: &[DVec3], pair: &SkinPair<'_>) {
        let asked_m = pair.within_m();
        if self.rest == rest && asked_m + self.change_m(surface.positions) <= self.within_m {
            return;
        }
        self.within_m = asked_m + ROOM_SHARE * surface.form.edge_m;
        rest.clone_into(&mut self.rest);
        surface.positions.clone_into(&mut self.positions);
        self.edges.clear();
        self.vertices.clear();
        pair.find_pairs(self.within_m, self);
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
