//! The skin of a soft body: a surface or a line that moves with the nodes that carry it, and stays the same when they change.
//!
//! In: points, their carrier, where its nodes are. Out: where the skin is, and which nodes carry a point of it. Never here: elements,
//! steps. Theory: docs/theory/soft.md, eq. 16, 20, 23.

use super::carrier::{Carrier, SkinPoints, into_body};
use super::deformation::{follow_turn, outer};
use crate::limits::QUIET_SPEED_M_S;
use glam::{DMat3, DQuat, DVec3};
use metachron_core::{Archive, ArchiveError, archive_values};
use metachron_geometry::Carried;

/// The time in which the jump by other nodes is down to 1/e, seconds: at 60 pictures a second a ninetieth of it goes with each.
const EASE_S: f64 = 1.5;
/// An offset below this is gone, metres.
const EASED_M: f64 = 1e-6;

/// A skin on its carrier.
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
    apart: Apart,
}

/// How far the points are from where their nodes carry them: the rest of a jump that a change of nodes would have made.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Apart {
    /// Of each point, turned back to how the body lay when it began, metres; empty where nothing is left.
    by: Vec<DVec3>,
    /// The nodes then, and how far the body has turned since.
    then: Vec<DVec3>,
    turn: DQuat,
}

impl Skin {
    /// Writes or reads where its points are, and how far that is from where its nodes carry them.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.positions, self.velocities, self.apart)
    }

    /// A skin on `carrier`, at rest at its own place.
    pub fn new(points: SkinPoints, carrier: Carrier) -> Self {
        let SkinPoints { rest, material, inward, .. } = points;
        let (positions, velocities) = (rest.clone(), vec![DVec3::ZERO; rest.len()]);
        let (carried, nearest, apart) = (vec![], vec![], Apart::default());
        let mut skin = Self { rest, material, inward, carrier, carried, nearest, positions, velocities, apart };
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

    /// Takes cells away from its carrier, whose nodes with any cell are `is_left`; returns the triangles that are left: those whose middles were
    /// in none of these cells, and that nodes with a cell carry. The nearest cell of a cage that is left carries the points of one that is gone.
    pub fn without_cells(&mut self, is_gone: &[bool], is_left: &[bool], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let Self { material, carrier, .. } = &*self;
        let is_kept = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| material[corner as usize]);
            let inward = into_body([a, b, c]).normalize_or_zero();
            carrier.cell_under((a + b + c) / 3.0, inward).is_some_and(|cell| !is_gone[cell])
        };
        let mut kept: Vec<[u32; 3]> = triangles.iter().copied().filter(is_kept).collect();
        self.carrier.remove(is_gone);
        self.bind();
        let carried = |corner: &u32| self.carried[*corner as usize].terms().all(|(node, _)| is_left[node]);
        kept.retain(|corners| corners.iter().all(carried));
        kept
    }

    /// Moves the skin to where these nodes carry it, but for its distance from that.
    pub fn follow(&mut self, positions: &[DVec3], velocities: &[DVec3]) {
        for (at, carried) in self.carried.iter().enumerate() {
            self.positions[at] = carried.mean(positions);
            self.velocities[at] = carried.mean(velocities);
        }
        self.apart.follow(positions);
        for at in 0..self.apart.by.len() {
            let apart = self.apart.of(at);
            self.positions[at] += apart;
            self.velocities[at] -= apart / EASE_S;
        }
    }

    /// Leaves the skin where it is though these nodes carry it elsewhere: it goes there by [`Self::ease`].
    pub fn stay(&mut self, positions: &[DVec3]) {
        let by = self.carried.iter().zip(&self.positions).map(|(carried, at)| *at - carried.mean(positions)).collect();
        self.apart = Apart { by, then: positions.to_vec(), turn: DQuat::IDENTITY };
        self.apart.forget_rounding();
    }

    /// Puts it where its nodes carry it, with the next [`Self::follow`].
    pub fn end_easing(&mut self) {
        self.apart = Apart::default();
    }

    /// Moves it on to where its nodes carry it, by the decay in `h` seconds (eq. 20).
    pub fn ease(&mut self, h: f64) {
        let left = libm::exp(-h / EASE_S);
        self.apart.by.iter_mut().for_each(|apart| *apart *= left);
        self.apart.forget_rounding();
    }

    /// Whether it is where its nodes carry it.
    pub fn is_eased(&self) -> bool {
        self.apart.by.is_empty()
    }

    /// Whether it moves on to there no faster than what is at rest may move.
    pub fn is_quiet(&self) -> bool {
        self.apart.by.iter().all(|apart| apart.length() <= QUIET_SPEED_M_S * EASE_S)
    }

    /// How far a point is from where its nodes carry it, metres.
    pub fn apart_of(&self, point: usize) -> DVec3 {
        self.apart.of(point)
    }

    /// How a point of it moves beside the nodes that carry it, m/s.
    pub fn easing_m_s(&self, point: u32) -> DVec3 {
        -self.apart.of(point as usize) / EASE_S
    }

    /// How far it is from where its nodes carry it, to be kept and set back.
    pub fn apart(&mut self) -> &mut Apart {
        &mut self.apart
    }

    /// The points of the skin at rest, in the body's own axes.
    pub fn rest(&self) -> &[DVec3] {
        &self.rest
    }

    /// The nodes that carry each point of the skin.
    pub fn carried(&self) -> &[Carried] {
        &self.carried
    }

    /// The nodes that carry the point of the skin with these shares of three of its points.
    pub fn carried_at(&self, vertices: [u32; 3], shares: [f64; 3]) -> Carried {
        let (material_m, inward) = self.material_at(vertices, shares);
        self.carrier.carry(material_m, inward)
    }

    /// The cell of a cage that carries the same point, by its number; none of a lattice.
    pub fn cell_at(&self, vertices: [u32; 3], shares: [f64; 3]) -> Option<u32> {
        let Carrier::Cage(cage) = &self.carrier else { return None };
        let (material_m, inward) = self.material_at(vertices, shares);
        Some(cage.cell_under(material_m, inward) as u32)
    }

    /// Where the same point is in material coordinates, and the direction into the body there.
    pub fn material_at(&self, vertices: [u32; 3], shares: [f64; 3]) -> (DVec3, DVec3) {
        let mean = |of: &[DVec3]| vertices.into_iter().zip(shares).map(|(v, share)| of[v as usize] * share).sum();
        // a place on an edge has two vertices alone
        let inward = into_body(vertices.map(|vertex| self.rest[vertex as usize])).try_normalize();
        (mean(&self.material), inward.unwrap_or_else(|| mean(&self.inward)))
    }

    /// The point of the skin that stands for a node.
    pub fn point_of(&self, node: usize) -> u32 {
        self.nearest[node]
    }
}

impl Clone for Apart {
    fn clone(&self) -> Self {
        Self { by: self.by.clone(), then: self.then.clone(), turn: self.turn }
    }

    // into storage that is there
    fn clone_from(&mut self, from: &Self) {
        self.by.clone_from(&from.by);
        self.then.clone_from(&from.then);
        self.turn = from.turn;
    }
}

impl Apart {
    /// World axes, metres.
    fn of(&self, point: usize) -> DVec3 {
        self.by.get(point).map_or(DVec3::ZERO, |apart| self.turn * *apart)
    }

    /// Turns with the nodes: by the rotation that brings them nearest to where they are.
    fn follow(&mut self, positions: &[DVec3]) {
        if self.by.is_empty() {
            return;
        }
        let middle = |of: &[DVec3]| of.iter().sum::<DVec3>() / of.len() as f64;
        let [now, then] = [middle(positions), middle(&self.then)];
        let (mut gradient, mut size) = (DMat3::ZERO, 0.0);
        for (x, before) in positions.iter().zip(&self.then) {
            let arm = *before - then;
            gradient += outer(*x - now, arm);
            size += arm.length_squared();
        }
        follow_turn(&mut self.turn, gradient * (1.0 / size));
    }

    fn forget_rounding(&mut self) {
        if self.by.iter().all(|apart| apart.length_squared() < EASED_M * EASED_M) {
            *self = Self::default();
        }
    }
}
