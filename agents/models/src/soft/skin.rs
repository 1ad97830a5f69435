//! The skin of an embedded solid: a surface that moves with the nodes of a cage.
//!
//! In: a surface, a cage, where its nodes are. Out: where the surface is, and which nodes carry a point of it. Never here: elements, steps.
//! Theory: docs/theory/soft.md, eq. 18.

use glam::DVec3;
use metachron_geometry::{Cage, Carried, Triangles};
use std::sync::Arc;

/// A surface in its cage.
pub(super) struct Skin {
    surface: Arc<Triangles>,
    pub cage: Cage,
    /// The mean direction into the body at each point at rest; of length 1, or none.
    inward: Vec<DVec3>,
    carried: Vec<Carried>,
    /// For each node the point of the surface that it carries most of.
    nearest: Vec<u32>,
    /// Positions of the points, metres.
    pub positions: Vec<DVec3>,
    /// Velocities of the points, m/s.
    pub velocities: Vec<DVec3>,
}

impl Skin {
    /// The skin of `surface` in `cage`, at rest at its own place.
    pub fn new(surface: Arc<Triangles>, cage: Cage) -> Self {
        let positions = surface.points.clone();
        let velocities = vec![DVec3::ZERO; positions.len()];
        let mut inward = vec![DVec3::ZERO; positions.len()];
        for corners in &surface.triangles {
            let into = into_body(corners.map(|corner| positions[corner as usize]));
            corners.iter().for_each(|corner| inward[*corner as usize] += into);
        }
        inward.iter_mut().for_each(|into| *into = into.normalize_or_zero());
        let mut skin = Self { surface, cage, inward, carried: vec![], nearest: vec![], positions, velocities };
        skin.bind();
        skin
    }

    /// Puts the surface into another cage.
    pub fn set_cage(&mut self, cage: Cage) {
        self.cage = cage;
        self.bind();
    }

    fn bind(&mut self) {
        self.carried.clear();
        let points = self.surface.points.iter().zip(&self.inward);
        self.carried.extend(points.map(|(point, inward)| self.cage.carry(*point, *inward)));
        let mut most = vec![(0, 0.0); self.cage.nodes_m().len()];
        for (point, carried) in (0..).zip(&self.carried) {
            for (node, weight) in carried.terms() {
                if weight > most[node].1 {
                    most[node] = (point, weight);
                }
            }
        }
        self.nearest = most.into_iter().map(|(point, _)| point).collect();
    }

    /// Moves the surface to where these nodes carry it.
    pub fn follow(&mut self, positions: &[DVec3], velocities: &[DVec3]) {
        for (at, carried) in self.carried.iter().enumerate() {
            self.positions[at] = carried.mean(positions);
            self.velocities[at] = carried.mean(velocities);
        }
    }

    /// The points of the surface at rest, in the body's own axes.
    pub fn rest(&self) -> &[DVec3] {
        &self.surface.points
    }

    /// What carries each point of the surface.
    pub fn carried(&self) -> &[Carried] {
        &self.carried
    }

    /// What carries the point of the surface with these shares of three of its points.
    pub fn carried_at(&self, vertices: [u32; 3], shares: [f64; 3]) -> Carried {
        let points = vertices.map(|vertex| self.surface.points[vertex as usize]);
        let at = points.into_iter().zip(shares).map(|(point, share)| point * share).sum();
        let of_vertices = || vertices.into_iter().zip(shares).map(|(v, share)| self.inward[v as usize] * share).sum();
        // a place on an edge has two vertices alone
        let inward = into_body(points).try_normalize().unwrap_or_else(of_vertices);
        self.cage.carry(at, inward)
    }

    /// The point of the surface that stands for a node.
    pub fn point_of(&self, node: usize) -> u32 {
        self.nearest[node]
    }
}

/// The direction into the body at a triangle, by twice its area.
fn into_body([a, b, c]: [DVec3; 3]) -> DVec3 {
    (c - a).cross(b - a)
}
