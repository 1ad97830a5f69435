//! The soft body agent: vertices, springs and contacts, and its rest detection.
//!
//! In: a [`SoftSpec`], steps, pulls, neighbours. Out: snapshots ([`super::publish`]). Never here: how a step is solved
//! ([`super::step`]), coupling to peers ([`super::company`]). Theory: docs/theory/soft.md.

use super::anchor_springs::VertexSpring;
use super::company::Company;
use super::contact::Contacts;
use super::fe_mesh::FeMesh;
use super::footing::Footing;
use super::foretold::Foretold;
use super::member::Unknowns;
use super::spec::{SoftError, SoftSpec};
use super::step::EDGE_CHANGE_MAX;
use super::step_doubling::Doubling;
use super::system::System;
use crate::limits::{QUIET_ACCELERATION_M_S2, QUIET_S, QUIET_SPEED_M_S};
use glam::DVec3;
use metachron_contact::beside;
use metachron_contact::beside::has_a_say;
use metachron_contact::crowd;
use metachron_contact::crowd::Lately;
use metachron_contact::stepper::ClusterMember;
use metachron_contact::{Agent, Neighbour, StepContext};
use metachron_contact::{Knock, Law, Link};
use metachron_core::{Body, Bounds, Grip, Resolution, SimSpan, Snapshot, SoftState, StepError, StepReport, check_span};
use metachron_geometry::{Aabb, CollisionShape, PlacedShape, ShapeKind, ShapePose, height_j_kg};
use std::sync::Arc;

/// A sheet, solid or rope with its own clock.
pub struct SoftBody {
    pub(super) spec: SoftSpec,
    pub(super) mesh: FeMesh,
    pub(super) system: System,
    pub(super) positions: Vec<DVec3>,
    pub(super) velocities: Vec<DVec3>,
    /// The velocities at the end of a substep without contact.
    pub(super) free: Vec<DVec3>,
    /// Impulses of peers since the last step, N·s for each vertex, until they are applied; empty for none.
    pub(super) given: Vec<DVec3>,
    pub(super) ties: Vec<VertexSpring>,
    pub(super) company: Company,
    /// Wake queries: the sleeping agents that it may hit.
    pub(super) knock: Knock,
    pub(super) contacts: Contacts,
    pub(super) grips: Vec<Grip>,
    /// Acceleration of the centre of mass in the last step, without the impulses of peers, m/s².
    pub(super) acceleration: DVec3,
    /// The published prediction of its next step.
    pub(super) foretold: Foretold,
    /// Its feet on static solids.
    pub(super) footing: Footing,
    pub(super) at_rest: bool,
    pub(super) doubling: Doubling,
    before: Vec<DVec3>,
    pub(super) quiet_s: f64,
    pub(super) steps: u64,
    /// Its recent contact history.
    pub(super) lately: Lately,
    /// What it is in a contact cluster.
    pub(super) unknowns: Unknowns,
}

impl SoftBody {
    /// Builds the body of `spec` in its rest shape.
    ///
    /// # Errors
    /// [`SoftError`] for a number outside its range, a side it does not have, an invalid obstacle shape.
    pub fn new(spec: SoftSpec) -> Result<Self, SoftError> {
        spec.check()?;
        let mesh = FeMesh::new(&spec);
        let rotation = spec.rotation.normalize();
        let positions: Vec<_> = mesh.rest.iter().map(|rest| spec.position + rotation * *rest).collect();
        let velocities: Vec<_> = mesh.held.iter().map(|&held| if held { DVec3::ZERO } else { spec.velocity }).collect();
        let held = mesh.held.contains(&true);
        let height_j_kg = height_j_kg(&positions, spec.gravity, held);
        let surface = mesh.surface(height_j_kg);
        let edge_m = surface.edge_m;
        let form = CollisionShape { kind: ShapeKind::Surface(surface), friction: spec.friction, restitution: 0.0 };
        let contacts = Contacts::new(&spec, Arc::new(form), edge_m)?;
        Ok(Self {
            system: mesh.system(),
            free: positions.clone(),
            before: velocities.clone(),
            positions,
            velocities,
            mesh,
            contacts,
            given: vec![],
            ties: vec![],
            company: Company::default(),
            knock: Knock::default(),
            grips: vec![],
            acceleration: spec.gravity,
            foretold: Foretold::default(),
            footing: Footing::default(),
            at_rest: false,
            doubling: Doubling::default(),
            quiet_s: 0.0,
            steps: 0,
            lately: Lately::default(),
            unknowns: Unknowns::default(),
            spec,
        })
    }

    /// Its vertices in the form of a snapshot.
    #[must_use]
    pub fn start(&self) -> Body {
        Body::Soft(SoftState { positions: self.positions.clone(), velocities: self.velocities.clone() })
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
        let Aabb { low, high } = Aabb::of(&self.positions);
        let speed = self.velocities.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
        let radius_m = match &self.contacts.form.kind {
            ShapeKind::Surface(surface) => surface.radius_m,
            _ => 0.0,
        };
        Bounds { low: low - radius_m, high: high + radius_m, speed_m_s: speed }
    }

    /// Lists this step's springs: user springs, tools that grasp it, and links whose pair it owns.
    pub(super) fn gather_springs(&mut self, context: &StepContext<'_>) {
        let count = self.positions.len();
        self.ties.clear();
        self.ties.extend(context.anchor_springs().filter_map(|pull| VertexSpring::of_pull(&pull, count)));
        let owned = |link: &&Link| context.neighbours.iter().any(|n| n.id == link.other && n.owned);
        let links = context.links.iter().filter(|link| link.law == Law::Cluster).filter(owned);
        self.ties.extend(links.filter_map(|link| VertexSpring::of_link(link, count)));
    }

    /// Counts quiet time; returns whether it has been quiet for long enough.
    fn update_rest(&mut self, dt: f64) -> bool {
        let Self { velocities, before, .. } = self;
        let pairs = velocities.iter().zip(before.iter());
        let limit = (QUIET_SPEED_M_S, QUIET_ACCELERATION_M_S2 * dt);
        let mut still = pairs.map(|(v, was)| v.length() <= limit.0 && v.distance(*was) <= limit.1);
        let calm = self.spec.sleep && self.ties.is_empty() && self.company.is_calm();
        let quiet = calm && still.all(|still| still);
        self.quiet_s = if quiet { self.quiet_s + dt } else { 0.0 };
        let at_rest = self.quiet_s >= QUIET_S;
        if at_rest {
            self.doubling.watch.rest();
            velocities.fill(DVec3::ZERO); // the drawn state of a sleeping body must not drift
        }
        before.clone_from(velocities);
        at_rest
    }

    /// Finds the sleeping agents that it may hit.
    fn wake_others(&mut self, context: &StepContext<'_>, dt_s: f64) {
        let bounds = self.bounds();
        let placed = PlacedShape { form: &self.contacts.form, view: ShapePose::Surface(&self.positions) };
        self.knock.find(&placed, &bounds, (context, dt_s));
    }

    /// Ends a step of `dt` seconds: books impulses, grips and the published prediction; returns the additional substeps that this took.
    fn finish_step(&mut self, context: &StepContext<'_>, dt: f64) -> u32 {
        let mass_kg = self.mass_kg();
        let Self { company, system, .. } = self;
        company.mates_mut().weigh(system.vertices(), |impulses| system.respond(impulses));
        self.company.close(context, (dt, mass_kg));
        self.grips.clear();
        self.grips.extend(self.ties.iter().map(|tie| Grip { by: tie.by, force_n: tie.impulse / dt }));
        self.acceleration = if self.mesh.held.contains(&true) { DVec3::ZERO } else { self.spec.gravity };
        let extra = self.foretell(dt);
        self.lately.pass(self.contacts.is_grounded(), dt);
        self.steps += 1;
        self.at_rest = self.update_rest(dt);
        self.wake_others(context, dt);
        extra
    }
}

impl Agent for SoftBody {
    fn model(&self) -> &'static str {
        self.spec.shape.model()
    }

    /// Advances by `dt`: one solve, more where an edge would turn or stretch too far in one.
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let dt_s = check_span(dt)?;
        let (substeps, doubled) = self.advance(context, dt_s)?;
        let extra = self.finish_step(context, dt_s);
        Ok(StepReport { work: self.work() * f64::from(substeps + doubled + extra), substeps, at_rest: self.at_rest })
    }

    fn longest_step(&self, dt: SimSpan, context: &StepContext<'_>) -> SimSpan {
        let dt = beside::longest_step(dt, context, || self.bounds(), |n| has_a_say(n, context));
        let dt = crowd::crowded(dt, context, || self.bounds(), crowd::Member::bent(self.lately, &self.contacts.form));
        beside::unhurried(dt, context, || self.bounds(), |n| self.approach_limit_m(n))
    }

    fn resolution(&self) -> Option<Resolution> {
        None
    }

    /// The division of a soft body is fixed by its scene: nothing changes.
    fn set_resolution(&mut self, _wanted: Resolution) {}

    fn member(&mut self) -> Option<&mut dyn ClusterMember> {
        Some(self)
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.contacts.form.clone())
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
    /// How far a neighbour may approach in a step, metres: beyond an edge length it would turn cells inside out before contact is detected.
    /// Another soft body must stay predictable, which requires that neither has to divide its step ([`EDGE_CHANGE_MAX`]).
    fn approach_limit_m(&self, neighbour: &Neighbour) -> Option<f64> {
        let edge_m = self.contacts.edge_m();
        match neighbour.form.as_deref().map(|form| &form.kind) {
            Some(ShapeKind::Surface(there)) => Some(EDGE_CHANGE_MAX * edge_m.min(there.edge_m)),
            _ => Some(edge_m).filter(|_| neighbour.owned),
        }
    }

    /// Work of a substep in thousands of multiplications: the factor's, and some 500 an element.
    pub(super) fn work(&self) -> f64 {
        1e-3 * self.system.work() as f64 + 0.5 * self.mesh.elements() as f64
    }
}
