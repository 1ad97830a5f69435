//! The soft body agent: its vertices, and what is set and published of them.
//!
//! In: a [`SoftSpec`]. Out: snapshots ([`super::publish`]). Never here: how a step is solved ([`super::step`]), contact.
//! Theory: docs/theory/soft.md.

use super::carrier::Carrier;
use super::division::{Division, form};
use super::fe_mesh::FeMesh;
use super::member::Unknowns;
use super::skin::Skin;
use super::spec::{SoftError, SoftSpec};
use super::system::System;
use super::touched::Touches;
use crate::set_motion::{WholeMotion, check_nodes};
use glam::DVec3;
use metachron_contact::{Agent, Carving, Input, Inputs, SetMotion, Stepping};
use metachron_core::{Archive, ArchiveError, Body, Bounds, Removed, Resolution, Snapshot};
use metachron_geometry::{Aabb, Carried, CollisionShape, ShapeKind};
use std::sync::Arc;

/// A sheet, solid or rope with its own clock.
pub struct SoftBody {
    pub(super) spec: SoftSpec,
    pub(super) mesh: FeMesh,
    pub(super) system: System,
    /// Its skin as others see it, where that is not its vertices.
    pub(super) skin: Option<Skin>,
    /// For each cell that it was divided into, whether it was removed; empty while it has all of them.
    pub(super) gone: Vec<bool>,
    /// The matter removed since the start.
    pub(super) removed: Removed,
    /// The ε for which its cage or lattice was made, metres; no meaning where its vertices are its skin.
    pub(super) eps_m: f64,
    /// Where it was touched lately, and about which places its cells are halved.
    pub(super) touches: Touches,
    /// The level n that was asked for: its picture's.
    pub(super) level: u8,
    pub(super) positions: Vec<DVec3>,
    pub(super) velocities: Vec<DVec3>,
    /// The velocities at the end of a substep without contact.
    pub(super) free: Vec<DVec3>,
    /// The right side of eq. 1: the momenta of the vertices with the impulses of forces in the substep, kg·m/s.
    pub(super) impulses: Vec<DVec3>,
    pub(super) form: Arc<CollisionShape>,
    /// The mean acceleration of the centre of mass in the last step, m/s².
    pub(super) acceleration: DVec3,
    pub(super) at_rest: bool,
    pub(super) quiet_s: f64,
    /// Its unknowns in a contact cluster.
    pub(super) unknowns: Unknowns,
}

impl SoftSpec {
    /// Whether a body can be built of it.
    ///
    /// # Errors
    /// [`SoftError`] for a number outside its range, a side it does not have, a surface without an inside.
    pub fn check(&self) -> Result<(), SoftError> {
        self.check_numbers()?;
        let Some(eps_m) = self.spacing().map(|spacing| spacing.range_m.0) else { return Ok(()) };
        Carrier::new(self, eps_m, &[]).map(drop).ok_or(SoftError::FineCage { eps_m })
    }
}

impl SoftBody {
    /// Builds the body of `spec` in its rest shape.
    ///
    /// # Errors
    /// [`SoftError`] for a number outside its range, a side it does not have, a surface without an inside.
    pub fn new(spec: SoftSpec) -> Result<Self, SoftError> {
        spec.check()?;
        let eps_m = spec.spacing().map_or(0.0, |spacing| spacing.eps_m);
        let Division { mut mesh, surface, skin } = Division::of(&spec, eps_m, &[])?;
        let rotation = spec.rotation.normalize();
        let positions: Vec<_> = mesh.rest.iter().map(|rest| spec.position + rotation * *rest).collect();
        let velocities: Vec<_> = mesh.held.iter().map(|&held| if held { DVec3::ZERO } else { spec.velocity }).collect();
        mesh.begin_turns(&positions);
        let system = mesh.system(&positions);
        let mut body = Self {
            system,
            skin,
            gone: vec![],
            removed: Removed::default(),
            eps_m,
            touches: Touches::default(),
            level: 0,
            impulses: vec![],
            free: positions.clone(),
            positions,
            velocities,
            mesh,
            form: form(&spec, surface),
            acceleration: spec.gravity,
            at_rest: false,
            quiet_s: 0.0,
            unknowns: Unknowns::default(),
            spec,
        };
        body.follow();
        Ok(body)
    }

    /// Moves the nodes that hang between others with these.
    pub(super) fn hang(&mut self) {
        self.system.spread(&mut self.positions);
        self.system.spread(&mut self.velocities);
    }

    /// Moves its skin to where its vertices are. One at rest stays there, also where its skin is still on its way to its nodes.
    pub(super) fn follow(&mut self) {
        let Self { skin, positions, velocities, at_rest, .. } = self;
        if let Some(skin) = skin {
            skin.follow(positions, velocities);
            if *at_rest {
                skin.velocities.fill(DVec3::ZERO);
            }
        }
    }

    /// Moves its skin on towards where its vertices carry it, by the decay in `h` seconds, and with them.
    pub(super) fn ease(&mut self, h: f64) {
        self.skin.iter_mut().for_each(|skin| skin.ease(h));
        self.follow();
    }

    /// Positions of its skin's vertices, metres: its shape as others see it.
    pub(super) fn seen(&self) -> &[DVec3] {
        self.skin.as_ref().map_or(&self.positions, |skin| &skin.positions)
    }

    /// How many nodes it is solved at now: those of its cage or lattice, or its vertices; none that lost all its cells.
    #[must_use]
    pub fn nodes(&self) -> u32 {
        self.mesh.mass_kg.iter().filter(|mass| **mass > 0.0).count() as u32
    }

    /// The nodes that carry a vertex of its skin.
    pub(super) fn carried(&self, vertex: u32) -> Carried {
        self.skin.as_ref().map_or(Carried::by_node(vertex), |skin| skin.carried()[vertex as usize])
    }

    /// Wakes it, and forgets values of steps before.
    pub(super) fn woken(&mut self) {
        (self.quiet_s, self.at_rest) = (0.0, false);
        self.follow();
    }

    /// The specification it was built from.
    #[must_use]
    pub fn spec(&self) -> &SoftSpec {
        &self.spec
    }

    /// Kinetic, elastic and gravitational energy, J.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        let moving = self.mesh.mass_kg.iter().zip(&self.velocities).zip(&self.positions);
        let of =
            |((mass, v), x): ((&f64, &DVec3), &DVec3)| mass * (0.5 * v.length_squared() - self.spec.gravity.dot(*x));
        moving.map(of).sum::<f64>() + self.mesh.energy_j(&self.positions)
    }

    /// The box around it.
    pub(super) fn bounds(&self) -> Bounds {
        let Aabb { low, high } = match &self.form.kind {
            ShapeKind::Surface(surface) => surface.bounds(self.seen()).grown(surface.radius_m),
            _ => Aabb::of(self.seen()),
        };
        let speed = self.velocities.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
        Bounds { low, high, speed_m_s: speed }
    }

    /// The momentum of its vertices, kg·m/s.
    pub(super) fn linear_momentum(&self) -> DVec3 {
        self.mesh.mass_kg.iter().zip(&self.velocities).map(|(mass, v)| *v * *mass).sum()
    }
}

impl Agent for SoftBody {
    fn model(&self) -> &'static str {
        self.spec.shape.model()
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn resolution(&self) -> Option<Resolution> {
        self.present_resolution()
    }

    fn inputs(&self) -> Inputs {
        use Input::{Carving, Force, Place, Resolution, Spring, State, Velocity};
        let all = Inputs::of(&[Spring, Force, Velocity, State]);
        let all = all.with(Place, !self.mesh.is_held()).with(Carving, self.form.has_cells());
        all.with(Resolution, self.present_resolution().is_some() && self.spec.resolutions().is_some())
    }

    /// A body of which parts are held stays where it is, and takes velocities.
    fn set_motion(&mut self, set: &SetMotion) -> bool {
        let whole = WholeMotion::new(set, self.mesh.mass_kg.iter().copied().zip(self.positions.iter().copied()));
        if whole.shifts() && self.mesh.is_held() {
            return false;
        }
        let Self { positions, velocities, mesh, .. } = self;
        for ((x, v), held) in positions.iter_mut().zip(&mut *velocities).zip(&mesh.held) {
            *x = whole.place(*x);
            *v = if *held { DVec3::ZERO } else { whole.velocity(*x, *v) };
        }
        if whole.shifts() {
            mesh.begin_turns(positions);
        }
        self.hang();
        self.woken();
        true
    }

    fn set_state(&mut self, state: &Body) -> Result<(), String> {
        let Body::Soft(state) = state else { return Err("a soft body has the state of vertices".to_owned()) };
        let (to, to_m_s) = match (&self.skin, &state.nodes) {
            (None, _) => (&state.positions, &state.velocities),
            (Some(_), Some(nodes)) => (&nodes.positions, &nodes.velocities),
            (Some(_), None) => {
                return Err(format!("it is carried by {} nodes; the state has none", self.positions.len()));
            }
        };
        let Self { positions, velocities, mesh, skin, system, .. } = self;
        // a held vertex stays where it is
        check_nodes(positions, [to, to_m_s], |_| false)?;
        for (at, (x, v)) in to.iter().zip(to_m_s).enumerate().filter(|(at, _)| !mesh.held[*at]) {
            (positions[at], velocities[at]) = (*x, *v);
        }
        system.spread(positions);
        system.spread(velocities);
        mesh.begin_turns(positions);
        skin.iter_mut().for_each(Skin::end_easing);
        self.woken();
        Ok(())
    }

    /// A body with a skin of its own is divided anew; the division of any other is fixed by its scene.
    fn set_resolution(&mut self, wanted: Resolution) {
        self.divide_anew(wanted);
    }

    fn carve(&mut self, carving: &Carving) -> Option<Removed> {
        self.remove_within(carving)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.archive_state(archive)
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        self.publish(into);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let moving = self.mesh.mass_kg.iter().zip(&self.velocities).zip(&self.positions);
        moving.fold((DVec3::ZERO, DVec3::ZERO), |(linear, angular), ((mass, v), x)| {
            let momentum = *v * *mass;
            (linear + momentum, angular + x.cross(momentum))
        })
    }

    fn mass_kg(&self) -> f64 {
        self.mesh.mass_kg.iter().sum()
    }
}

impl SoftBody {
    /// Work of a substep in thousands of multiplications: of the factor or of its products, and some 500 an element.
    pub(super) fn work(&self) -> f64 {
        1e-3 * self.system.work() + 0.5 * self.mesh.elements() as f64
    }
}
