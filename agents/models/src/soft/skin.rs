//! The skin of a soft body: a surface or a line that moves with the nodes that carry it, and stays the same when they change.
//!
//! In: points, what carries them, where its nodes are. Out: where the skin is, and which nodes carry a point of it. Never here: elements,
//! steps. Theory: docs/theory/soft.md, eq. 18, 24.

use super::carrier::{Carrier, SkinPoints, into_body};
use glam::DVec3;
use metachron_geometry::Carried;

/// A skin on what carries it.
pub(super) struct Skin {
    /// Positions at rest, material coordinates and directions into the body of the points.
    rest: Vec<DVec3>,
    material: Vec<DVec3>,
    inward: Vec<DVec3>,
    pub carrier: Carrier,
    carried: Vec<Carried>,
    /// For each node the point of the skin that it carries most of.
    nearest: Vec<u32>,
    /// Positions of the points, metres.
    pub positions: Vec<DVec3>,
    /// Velocities of the points, m/s.
    pub velocities: Vec<DVec3>,
}

impl Skin {
    /// A skin on `carrier`, at rest at its own place.
    pub fn new(points: SkinPoints, carrier: Carrier) -> Self {
        let SkinPoints { rest, material, inward, .. } = points;
        let (positions, velocities) = (rest.clone(), vec![DVec3::ZERO; rest.len()]);
        let mut skin =
            Self { rest, material, inward, carrier, carried: vec![], nearest: vec![], positions, velocities };
        skin.bind();
        skin
    }

    /// Puts the skin on another carrier.
    pub fn set_carrier(&mut self, carrier: Carrier) {
        self.carrier = carrier;
        self.bind();
    }

    fn bind(&mut self) {
        self.carried.clear();
        let points = self.material.iter().zip(&self.inward);
        self.carried.extend(points.map(|(point, inward)| self.carrier.carry(*point, *inward)));
        let mut most = vec![(0, 0.0); self.carrier.nodes_m().len()];
        for (point, carried) in (0..).zip(&self.carried) {
            for (node, weight) in carried.terms() {
                if weight > most[node].1 {
                    most[node] = (point, weight);
                }
            }
        }
        self.nearest = most.into_iter().map(|(point, _)| point).collect();
    }

    /// Takes cells away from its cage, and gives their points to those that are left; returns the triangles whose middles were in none of
    /// these cells.
    pub fn without_cells(&mut self, is_gone: &[bool], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let Carrier::Cage(cage) = &mut self.carrier else { return triangles.to_vec() };
        let material = &self.material;
        let is_kept = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| material[corner as usize]);
            let inward = into_body([a, b, c]).normalize_or_zero();
            !is_gone[cage.cell_under((a + b + c) / 3.0, inward)]
        };
        let kept = triangles.iter().copied().filter(is_kept).collect();
        cage.remove(is_gone);
        self.bind();
        kept
    }

    /// Moves the skin to where these nodes carry it.
    pub fn follow(&mut self, positions: &[DVec3], velocities: &[DVec3]) {
        for (at, carried) in self.carried.iter().enumerate() {
            self.positions[at] = carried.mean(positions);
            self.velocities[at] = carried.mean(velocities);
        }
    }

    /// The points of the skin at rest, in the body's own axes.
    pub fn rest(&self) -> &[DVec3] {
        &self.rest
    }

    /// What carries each point of the skin.
    pub fn carried(&self) -> &[Carried] {
        &self.carried
    }

    /// What carries the point of the skin with these shares of three of its points.
    pub fn carried_at(&self, vertices: [u32; 3], shares: [f64; 3]) -> Carried {
        let mean = |of: &[DVec3]| vertices.into_iter().zip(shares).map(|(v, share)| of[v as usize] * share).sum();
        // a place on an edge has two vertices alone
        let inward = into_body(vertices.map(|vertex| self.rest[vertex as usize])).try_normalize();
        self.carrier.carry(mean(&self.material), inward.unwrap_or_else(|| mean(&self.inward)))
    }

    /// The point of the skin that stands for a node.
    pub fn point_of(&self, node: usize) -> u32 {
        self.nearest[node]
    }
}
