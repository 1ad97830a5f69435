//! Transfers the state of a soft body with a skin from one cage or lattice to another.
//!
//! In: a body and another ε. Out: the same body on other nodes: the same mass and linear momentum to rounding, angular momentum and shape
//! to O(ε²), no more energy; its skin where it was. Never here: when to do it. Theory: docs/theory/soft.md, eq. 17–20, 23.

use super::body::SoftBody;
use super::carrier::Carrier;
use super::fe_mesh::FeMesh;
use super::step::EDGE_CHANGE_MAX;
use super::system::Purpose;
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::Agent;
use metachron_core::Resolution;

/// Spans of the steps from rest that give up elastic energy, seconds: the first, and how many, each twice as long as the one before.
const RELAX_S: f64 = 1e-3;
const RELAX_STEPS: u32 = 10;

/// Span of a step from rest towards balance, seconds, and how many there are at most; moves below the last number end it, metres.
const BALANCE_S: f64 = 0.1;
const BALANCE_STEPS: u32 = 8;
const BALANCED_M: f64 = 1e-7;

/// The quantities that a change of nodes keeps.
#[derive(Debug, Clone, Copy)]
struct Invariants {
    energy_j: f64,
    momentum: DVec3,
    /// Centre of mass, metres, and the motion of the whole.
    centre: DVec3,
    whole: RigidMotion,
    inertia: DMat3,
}

impl SoftBody {
    /// The resolution of its skin's carrier; `None` where its vertices are its skin.
    pub(super) fn present_resolution(&self) -> Option<Resolution> {
        let skin = self.skin.as_ref()?;
        Some(Resolution { eps_m: skin.carrier.cell_m(), n: self.level })
    }

    /// Divides the body anew by cells of at most the ε wanted, where that makes other cells than it has.
    pub(super) fn divide_anew(&mut self, wanted: Resolution) {
        let (Some(range), Some(skin)) = (self.spec.resolutions(), &self.skin) else { return };
        let wanted = range.clamp(wanted);
        self.level = wanted.n;
        let halved_m = &mut self.touches.halved_m;
        if !self.gone.is_empty() || skin.carrier.is_as_wanted(&self.spec, wanted.eps_m, halved_m) {
            return;
        }
        let carrier = Carrier::new(&self.spec, wanted.eps_m, halved_m).or_else(|| {
            // with halves it may have too many nodes
            halved_m.clear();
            Carrier::new(&self.spec, wanted.eps_m, halved_m)
        });
        if let Some(carrier) = carrier {
            self.eps_m = wanted.eps_m;
            self.move_onto(carrier);
        }
    }

    /// Moves the state onto `carrier`; a change of energy by that is undone by rest and, at last, by slower deformation.
    pub(super) fn move_onto(&mut self, carrier: Carrier) {
        let before = self.kept();
        let mesh = carrier.mesh(&self.spec);
        let (positions, velocities) = self.at_nodes(&carrier, &mesh);
        let elastic_m_s2 = self.elastic_m_s2_at(&carrier);
        let Some(skin) = &mut self.skin else { return };
        let turns: Vec<DQuat> = self.mesh.turns().collect();
        let turns = skin.carrier.turns_at(&turns, &carrier);
        skin.set_carrier(carrier);
        self.mesh = mesh;
        self.mesh.set_turns(&turns);
        (self.positions, self.velocities) = (positions, velocities);
        self.system = self.mesh.system(&self.positions);
        self.hang();
        self.free.clone_from(&self.velocities);
        self.balance(&elastic_m_s2, before.energy_j);
        self.keep_momentum(&before);
        self.relax(before.energy_j);
        // nodes that have moved have other arms
        self.keep_momentum(&before);
        self.slow(before.energy_j);
        // where some of those that a node hangs at are held
        self.hang();
        let Self { skin, positions, .. } = self;
        skin.iter_mut().for_each(|skin| skin.stay(positions));
        // others may ask how points of it move before its next step begins
        self.free.clone_from(&self.velocities);
        self.list_velocities();
        self.woken();
    }

    fn kept(&self) -> Invariants {
        let mass = self.mesh.mass_kg.iter().sum::<f64>();
        let centre = self.mesh.mass_kg.iter().zip(&self.positions).map(|(m, x)| *x * *m).sum::<DVec3>() / mass;
        let (whole, inertia) = self.rigid_motion(centre);
        Invariants { energy_j: self.energy_j(), momentum: self.linear_momentum(), centre, whole, inertia }
    }

    /// Where the present carrier has the nodes of another one, and how fast (eq. 17, 23).
    fn at_nodes(&self, carrier: &Carrier, mesh: &FeMesh) -> (Vec<DVec3>, Vec<DVec3>) {
        let rotation = self.spec.rotation.normalize();
        let interpolate = |at_m: DVec3, list: &[DVec3]| {
            self.skin.as_ref().map_or(DVec3::ZERO, |skin| skin.carrier.interpolate(at_m, list))
        };
        let nodes = carrier.nodes_m().iter().zip(&mesh.rest).zip(&mesh.held);
        let of = |((material_m, rest), held): ((&DVec3, &DVec3), &bool)| {
            if *held {
                return (self.spec.position + rotation * *rest, DVec3::ZERO);
            }
            (interpolate(*material_m, &self.positions), interpolate(*material_m, &self.velocities))
        };
        nodes.map(of).unzip()
    }

    /// By how much elastic forces accelerate the present nodes, at the nodes of another carrier, m/s²: at rest the
    /// forces that bear its weight.
    fn elastic_m_s2_at(&mut self, carrier: &Carrier) -> Vec<DVec3> {
        let weight = std::mem::take(&mut self.spec.gravity);
        self.assemble(BALANCE_S);
        self.spec.gravity = weight;
        let nodes = self.system.forces.iter().zip(&self.mesh.mass_kg).zip(&self.mesh.held);
        // the hold of a node bears its weight as well
        let of = |((force, mass), held): ((&DVec3, &f64), &bool)| if *held { -weight } else { *force / *mass };
        let mut elastic_m_s2: Vec<DVec3> = nodes.map(of).collect();
        self.system.spread(&mut elastic_m_s2);
        let Some(skin) = &self.skin else { return vec![] };
        carrier.nodes_m().iter().map(|node_m| skin.carrier.interpolate(*node_m, &elastic_m_s2)).collect()
    }

    /// Moves new nodes to where elastic forces accelerate them as they did the old ones, by steps from rest: a body that was at rest is again,
    /// and one that swings goes on. They stay where that would take more energy than they have and than `most_j`.
    fn balance(&mut self, wanted_m_s2: &[DVec3], most_j: f64) {
        let before = self.positions.clone();
        let most_j = self.energy_j().max(most_j);
        let velocities = std::mem::replace(&mut self.velocities, vec![DVec3::ZERO; before.len()]);
        let weight = std::mem::take(&mut self.spec.gravity);
        for _ in 0..BALANCE_STEPS {
            self.assemble(BALANCE_S);
            for (node, wanted) in wanted_m_s2.iter().enumerate() {
                self.system.push(node as u32, -*wanted * self.mesh.mass_kg[node]);
            }
            if self.solve_for_velocities(BALANCE_S, Purpose::Own).is_err() {
                self.positions.clone_from(&before);
                break;
            }
            // no edge further than its linear forces hold
            let change = self.mesh.edge_change(|node| self.free[node as usize], BALANCE_S);
            let by_s = BALANCE_S * (EDGE_CHANGE_MAX / change).min(1.0);
            self.positions.iter_mut().zip(&self.free).for_each(|(x, v)| *x += *v * by_s);
            if self.free.iter().all(|v| v.length() * by_s < BALANCED_M) {
                break;
            }
        }
        (self.velocities, self.spec.gravity) = (velocities, weight);
        let energy_j = self.energy_j();
        if energy_j.is_nan() || energy_j > most_j {
            self.positions = before;
        }
    }

    /// Moves the nodes that are not held so that linear momentum is as it was, and, where none is held, the centre of mass and angular
    /// momentum too (eq. 18).
    fn keep_momentum(&mut self, before: &Invariants) {
        if self.mesh.held.contains(&true) {
            // the hold takes up the difference of the centre, and gives that of momentum
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
        // the rest by rounding of the turn
        let rest = (before.momentum - self.linear_momentum()) / self.mass_kg();
        self.velocities.iter_mut().for_each(|v| *v += rest);
    }

    /// The nodes that are not held, and their masses.
    fn moving(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let masses = self.mesh.mass_kg.iter().zip(&self.mesh.held).enumerate();
        masses.filter(|(_, (_, held))| !**held).map(|(node, (mass, _))| (node, *mass))
    }

    /// Steps from rest until there is no more energy than `most_j`, or a step gives up none: linearly implicit Euler moves towards
    /// equilibrium, least of all in slow modes, and keeps the centre of mass of a free body.
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
        let gravity = self.spec.gravity;
        if !self.mesh.held.contains(&true) {
            self.spec.gravity = DVec3::ZERO;
        }
        let solved = self.predict(h, Purpose::Own).is_ok();
        if solved {
            self.positions.iter_mut().zip(&self.free).for_each(|(x, v)| *x += *v * h);
        }
        (self.velocities, self.spec.gravity) = (velocities, gravity);
        solved
    }

    /// Slows the motion beside that of the whole, and then that beside its centre, until there is no more energy than `most_j`;
    /// where nodes are held, beside the mean of the others, and then all of it (eq. 19).
    fn slow(&mut self, most_j: f64) {
        let held = self.mesh.held.contains(&true);
        let whole = if held { self.mean_motion() } else { self.kept().whole };
        let centre = RigidMotion { spin: DVec3::ZERO, ..whole };
        for beside in [whole, if held { RigidMotion::default() } else { centre }] {
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

    /// The mean velocity of the nodes that are not held, as a motion of all of them.
    fn mean_motion(&self) -> RigidMotion {
        let moving: f64 = self.moving().map(|(_, mass)| mass).sum();
        RigidMotion { velocity: self.linear_momentum() / moving, ..RigidMotion::default() }
    }

    /// The motion of the whole about its centre of mass with the same linear and angular momentum, and its inertia,
    /// kg·m²; none of a body that is held.
    fn rigid_motion(&self, centre: DVec3) -> (RigidMotion, DMat3) {
        if self.mesh.held.contains(&true) {
            return (RigidMotion::default(), DMat3::IDENTITY);
        }
        // a straight rope has no inertia about its line but that of its sections
        let of_sections = self.mass_kg() * self.mesh.radius_m() * self.mesh.radius_m();
        let (mut angular, mut inertia) = (DVec3::ZERO, DMat3::from_diagonal(DVec3::splat(of_sections)));
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
