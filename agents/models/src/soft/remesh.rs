//! Transfers the state of an embedded solid from one cage to another.
//!
//! In: a body and another ε. Out: the same body in another cage: the same mass and linear momentum to rounding, angular momentum and shape
//! to O(ε²), no more energy. Never here: when to do it. Theory: docs/theory/soft.md, eq. 19–21.

use super::body::SoftBody;
use super::fe_mesh::FeMesh;
use super::spec::{SoftShape, VERTICES_MAX};
use super::system::Purpose;
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::Agent;
use metachron_core::Resolution;
use metachron_geometry::{Cage, cage_counts};

/// Spans of the steps from rest that give up elastic energy, seconds: the first, and how many, each twice as long as the one before.
const RELAX_S: f64 = 1e-3;
const RELAX_STEPS: u32 = 10;

/// What a change of cage keeps.
#[derive(Debug, Clone, Copy)]
struct Kept {
    energy_j: f64,
    momentum: DVec3,
    /// Centre of mass, metres, and the motion of the whole.
    centre: DVec3,
    whole: RigidMotion,
    inertia: DMat3,
}

impl SoftBody {
    /// The resolution of its cage; `None` of a lattice.
    pub(super) fn present_resolution(&self) -> Option<Resolution> {
        let skin = self.skin.as_ref()?;
        Some(Resolution { eps_m: skin.cage.cell_m().max_element(), n: self.level })
    }

    /// Divides the body anew by cells of at most the ε wanted, where that makes other cells than it has.
    pub(super) fn divide_anew(&mut self, wanted: Resolution) {
        let (Some(range), SoftShape::Embedded { surface, .. }) = (self.spec.resolutions(), &self.spec.shape) else {
            return;
        };
        let wanted = range.clamp(wanted);
        self.level = wanted.n;
        let counts = self.skin.as_ref().map(|skin| skin.cage.counts());
        if counts == Some(cage_counts(surface, wanted.eps_m)) {
            return;
        }
        if let Some(cage) = Cage::new(surface, wanted.eps_m, VERTICES_MAX as usize) {
            self.move_into(cage);
        }
    }

    /// Moves the state into `cage`; what it would do to energy is undone by rest and, at last, by slower deformation.
    fn move_into(&mut self, cage: Cage) {
        let before = self.kept();
        let mesh = FeMesh::caged(&cage, &self.spec);
        let (positions, velocities) = self.at_nodes(&cage, &mesh);
        let turns = self.turns_at(&cage);
        let Some(skin) = &mut self.skin else { return };
        skin.set_cage(cage);
        self.mesh = mesh;
        self.mesh.set_turns(&turns);
        (self.positions, self.velocities) = (positions, velocities);
        self.system = self.mesh.system(&self.positions);
        self.free.clone_from(&self.velocities);
        self.keep_momentum(&before);
        self.relax(before.energy_j);
        // nodes that have moved have other arms
        self.keep_momentum(&before);
        self.slow(before.energy_j);
        self.woken();
    }

    fn kept(&self) -> Kept {
        let mass = self.mesh.mass_kg.iter().sum::<f64>();
        let centre = self.mesh.mass_kg.iter().zip(&self.positions).map(|(m, x)| *x * *m).sum::<DVec3>() / mass;
        let (whole, inertia) = self.rigid_motion(centre);
        Kept { energy_j: self.energy_j(), momentum: self.linear_momentum(), centre, whole, inertia }
    }

    /// Where the present cage carries the nodes of another one, and how fast (eq. 19).
    fn at_nodes(&self, cage: &Cage, mesh: &FeMesh) -> (Vec<DVec3>, Vec<DVec3>) {
        let rotation = self.spec.rotation.normalize();
        let of = |(node, held): (&DVec3, &bool)| {
            if *held {
                return (self.spec.position + rotation * *node, DVec3::ZERO);
            }
            let spread = |list: &[DVec3]| self.spread(*node, list);
            (spread(&self.positions), spread(&self.velocities))
        };
        cage.nodes_m().iter().zip(&mesh.held).map(of).unzip()
    }

    /// What the nodes of the present cage have, at a point at rest: trilinear in cells, linear beyond them.
    fn spread(&self, at_m: DVec3, list: &[DVec3]) -> DVec3 {
        let Some(skin) = &self.skin else { return DVec3::ZERO };
        let (cell, share) = skin.cage.locate(at_m);
        let inner = share.clamp(DVec3::ZERO, DVec3::ONE);
        let beyond = share - inner;
        let along = |axis: usize, bits: usize| if bits >> axis & 1 == 1 { inner[axis] } else { 1.0 - inner[axis] };
        let mut sum = DVec3::ZERO;
        for (bits, node) in cell.corners.iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis| along(axis, bits));
            let slope = |axis: usize| if bits >> axis & 1 == 1 { beyond[axis] } else { -beyond[axis] };
            let weight = x * y * z + slope(0) * y * z + x * slope(1) * z + x * y * slope(2);
            sum += list[*node as usize] * weight;
        }
        sum
    }

    /// The rotations of the present cells at the middles of those of another cage.
    fn turns_at(&self, cage: &Cage) -> Vec<DQuat> {
        let Some(skin) = &self.skin else { return vec![] };
        let turns: Vec<DQuat> = self.mesh.turns().collect();
        let middle =
            |corners: &[u32; 8]| 0.5 * (cage.nodes_m()[corners[0] as usize] + cage.nodes_m()[corners[7] as usize]);
        cage.cells().iter().map(|cell| turns[skin.cage.cell_at(middle(&cell.corners))]).collect()
    }

    /// Moves the nodes that are not held so that linear momentum is what it was, and the centre of mass and angular momentum too where none is
    /// (eq. 20).
    fn keep_momentum(&mut self, before: &Kept) {
        if self.mesh.held.contains(&true) {
            // what holds it takes up the difference of the centre, and gives that of momentum
            let missing = before.momentum - self.linear_momentum();
            let moving: f64 = self.moving().map(|(_, mass)| mass).sum();
            let by = missing / moving;
            let nodes: Vec<usize> = self.moving().map(|(node, _)| node).collect();
            return nodes.into_iter().for_each(|node| self.velocities[node] += by);
        }
        let now = self.kept();
        let shift = before.centre - now.centre;
        let spin = now.inertia.inverse() * (before.inertia * before.whole.spin) - now.whole.spin;
        let by = RigidMotion { centre: now.centre, velocity: before.whole.velocity - now.whole.velocity, spin };
        for (x, v) in self.positions.iter_mut().zip(&mut self.velocities) {
            *v += by.at(*x);
            *x += shift;
        }
        // what rounding of the turn leaves
        let rest = (before.momentum - self.linear_momentum()) / self.mass_kg();
        self.velocities.iter_mut().for_each(|v| *v += rest);
    }

    /// The nodes that are not held, and their masses.
    fn moving(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let masses = self.mesh.mass_kg.iter().zip(&self.mesh.held).enumerate();
        masses.filter(|(_, (_, held))| !**held).map(|(node, (mass, _))| (node, *mass))
    }

    /// Steps from rest until there is no more energy than `most_j`, or a step gives up none: linearly implicit Euler moves towards
    /// equilibrium, least of all what is slow, and keeps the centre of mass of what is free.
    fn relax(&mut self, most_j: f64) {
        let mut span_s = RELAX_S;
        let mut energy_j = self.energy_j();
        for _ in 0..RELAX_STEPS {
            if energy_j <= most_j {
                return;
            }
            let before = self.positions.clone();
            let lower_j = if self.settle(span_s) { self.energy_j() } else { f64::INFINITY };
            if lower_j >= energy_j {
                self.positions = before;
                return;
            }
            (energy_j, span_s) = (lower_j, 2.0 * span_s);
        }
    }

    /// One step of `h` seconds from rest under elastic forces, and under gravity where it is held against that; returns whether it could be
    /// made.
    fn settle(&mut self, h: f64) -> bool {
        let velocities = std::mem::take(&mut self.velocities);
        self.velocities = vec![DVec3::ZERO; velocities.len()];
        let (gravity, ties) = (self.spec.gravity, std::mem::take(&mut self.ties));
        if !self.mesh.held.contains(&true) {
            self.spec.gravity = DVec3::ZERO;
        }
        let solved = self.predict(h, Purpose::Own).is_ok();
        if solved {
            self.positions.iter_mut().zip(&self.free).for_each(|(x, v)| *x += *v * h);
        }
        (self.velocities, self.spec.gravity, self.ties) = (velocities, gravity, ties);
        solved
    }

    /// Slows what moves beside the motion of the whole, and then what moves beside its centre, until there is no more energy than `most_j`
    /// (eq. 21).
    fn slow(&mut self, most_j: f64) {
        let whole = self.kept().whole;
        for beside in [whole, RigidMotion { spin: DVec3::ZERO, ..whole }] {
            let above_j = self.energy_j() - most_j;
            if above_j <= 0.0 {
                return;
            }
            let nodes: Vec<(usize, f64)> = self.moving().collect();
            let of = |node: usize| self.velocities[node] - beside.at(self.positions[node]);
            let beside_j: f64 = nodes.iter().map(|(node, mass)| 0.5 * mass * of(*node).length_squared()).sum();
            // a little more, so that rounding leaves none
            let left = (1.0 - (1.0 + 1e-9) * above_j / beside_j).max(0.0).sqrt();
            for (node, _) in nodes {
                let slow = beside.at(self.positions[node]);
                self.velocities[node] = slow + (self.velocities[node] - slow) * left;
            }
        }
    }

    /// The motion of the whole about its centre of mass with the same linear and angular momentum, and its inertia, kg·m²; none of what is
    /// held.
    fn rigid_motion(&self, centre: DVec3) -> (RigidMotion, DMat3) {
        if self.mesh.held.contains(&true) {
            return (RigidMotion::default(), DMat3::IDENTITY);
        }
        let (mut angular, mut inertia) = (DVec3::ZERO, DMat3::ZERO);
        for ((m, x), v) in self.mesh.mass_kg.iter().zip(&self.positions).zip(&self.velocities) {
            let arm = *x - centre;
            angular += arm.cross(*v) * *m;
            let outer = DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z);
            inertia += (DMat3::from_diagonal(DVec3::splat(arm.length_squared())) - outer) * *m;
        }
        let velocity = self.linear_momentum() / self.mass_kg();
        (RigidMotion { centre, velocity, spin: inertia.inverse() * angular }, inertia)
    }
}

/// A motion of the whole.
#[derive(Debug, Clone, Copy, Default)]
struct RigidMotion {
    centre: DVec3,
    velocity: DVec3,
    spin: DVec3,
}

impl RigidMotion {
    fn at(&self, position: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(position - self.centre)
    }
}
