//! Tubes and others with other clocks.
//!
//! The other bodies are stand-ins without models of their own: a free, led or driven solid that takes what it is given.

mod ahead;
mod bodies;
mod bridge;
mod capstan;
mod closed;
mod crossing;
mod felt;
mod gripper;
mod leaning;
mod meetings;
mod rates;
mod received;
mod slopes;
mod snap;
mod squeezed;
mod tools;

use glam::{DMat3, DQuat, DVec3};
use metachron_contact::Exchange;
use metachron_contact::{Agent, StepContext};
use metachron_core::{
    Body, Bounds, Inertia, Resolution, RigidState, SimSpan, SimTime, Snapshot, StepError, StepReport,
};
use metachron_geometry::Solid;
use metachron_geometry::{CollisionShape, ShapeKind, SolidShape};
use std::sync::Arc;

/// A solid that owns no pair: it takes what it is given, exactly.
#[derive(Clone)]
pub struct Prop {
    form: Arc<CollisionShape>,
    exchange: Exchange,
    state: RigidState,
    mass_kg: f64,
    inertia: DMat3,
    /// A force on its centre, N.
    force: DVec3,
    /// Stiffness and damping that keep it on its line along x and upright, where it is guided.
    guided: Option<(DVec3, f64, f64)>,
    time: SimTime,
    /// Whether it says that it rests.
    at_rest: bool,
    /// All it was ever given, N·s.
    given: DVec3,
    /// Of the last step, without what it was given, m/s².
    acceleration: DVec3,
}

impl Prop {
    /// A solid of this mass (infinite: immovable) at `position`, the same about every axis.
    pub fn new(solid: Solid, mass_kg: f64, position: DVec3, friction: f64) -> Self {
        let form = SolidShape::new(solid, DVec3::ZERO).unwrap();
        let moment = 0.4 * mass_kg * form.radius_m * form.radius_m;
        Self {
            form: Arc::new(CollisionShape { kind: ShapeKind::Solid(form), friction, restitution: 0.0 }),
            exchange: Exchange::default(),
            state: RigidState { position, ..RigidState::default() },
            mass_kg,
            inertia: DMat3::from_diagonal(DVec3::splat(moment)),
            force: DVec3::ZERO,
            guided: None,
            time: SimTime::ZERO,
            at_rest: false,
            given: DVec3::ZERO,
            acceleration: DVec3::ZERO,
        }
    }

    /// A guided one does not turn.
    fn inverse_inertia(&self) -> DMat3 {
        if self.guided.is_some() { DMat3::ZERO } else { self.inertia.inverse() }
    }

    fn is_held(&self) -> bool {
        self.mass_kg.is_infinite()
    }

    fn receive(&mut self, around: &StepContext<'_>, until: SimTime) {
        let wi = self.inverse_inertia();
        let Self { exchange, state, given, mass_kg, .. } = self;
        let w = mass_kg.recip();
        let held = mass_kg.is_infinite();
        exchange.open(around);
        exchange.take(around, until, |_, _, sum, carried| {
            *given += sum.linear;
            if !held {
                state.velocity += sum.linear * w;
                state.position += carried.linear * w;
                state.spin += wi * sum.angular;
                state.rotation = (DQuat::from_scaled_axis(wi * carried.angular) * state.rotation).normalize();
            }
        });
    }

    /// Takes a guided solid back to its line, implicitly.
    fn guide(&mut self, h: f64) {
        let Some((line, k, c)) = self.guided else { return };
        // its acceleration is published as lasting all of the step, so its way must be that of the mean velocity
        let (m, off) = (self.mass_kg, (self.state.position - line) * DVec3::new(0.0, 1.0, 1.0));
        let v = &mut self.state.velocity;
        let held = (*v * m - off * (k * h)) / (m + h * c + h * h * k);
        *v = DVec3::new(v.x, held.y, held.z);
    }
}

impl Agent for Prop {
    /// Led as an instrument is: it never owns a pair.
    fn model(&self) -> &'static str {
        "tool"
    }

    fn step(&mut self, dt: SimSpan, around: &StepContext<'_>) -> Result<StepReport, StepError> {
        let h = dt.as_secs_f64();
        self.receive(around, around.time + dt);
        if !self.is_held() {
            let a = self.force / self.mass_kg;
            let before = self.state.velocity;
            self.guide(h);
            self.acceleration = (self.state.velocity - before) / h + a;
            self.state.velocity += a * h;
            self.state.position += (before + self.state.velocity) * (0.5 * h);
            self.state.rotation = (DQuat::from_scaled_axis(self.state.spin * h) * self.state.rotation).normalize();
        }
        self.time = around.time + dt;
        Ok(StepReport { work: 1.0, substeps: 1, at_rest: self.at_rest })
    }

    fn resolution(&self) -> Option<Resolution> {
        None
    }

    fn set_resolution(&mut self, _wanted: Resolution) {}

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
        into.at_rest = self.at_rest;
        into.body = Body::Rigid(self.state);
        into.energy_j = if self.is_held() {
            0.0
        } else {
            0.5 * self.mass_kg * self.state.velocity.length_squared()
                + 0.5 * self.state.spin.dot(self.inertia * self.state.spin)
        };
        into.inertia = if self.is_held() {
            Inertia::Immovable
        } else {
            into.acceleration = self.acceleration;
            Inertia::Rigid { inverse_mass: self.mass_kg.recip(), inverse_inertia: self.inverse_inertia() }
        };
        let ShapeKind::Solid(solid) = &self.form.kind else { unreachable!("made of a solid") };
        let speed_m_s = self.state.velocity.length() + self.state.spin.length() * solid.radius_m;
        let (at, reach) = (self.state.position, DVec3::splat(solid.radius_m));
        into.bounds = Some(Bounds { low: at - reach, high: at + reach, speed_m_s });
        self.exchange.write(into);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        if self.is_held() {
            // what an immovable one was given is momentum that left the others
            return (self.given, DVec3::ZERO);
        }
        let linear = self.state.velocity * self.mass_kg;
        (linear, self.state.position.cross(linear) + self.inertia * self.state.spin)
    }

    fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }
}
