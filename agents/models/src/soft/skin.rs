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
        let mut skin = Self { surface, cage, carried: vec![], nearest: vec![], positions, velocities };
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
        self.carried.extend(self.surface.points.iter().map(|point| self.cage.carry(*point)));
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
        let points = vertices.into_iter().zip(shares);
        self.cage.carry(points.map(|(vertex, share)| self.surface.points[vertex as usize] * share).sum())
    }

    /// The point of the surface that stands for a node.
    pub fn point_of(&self, node: usize) -> u32 {
        self.nearest[node]
    }
}
