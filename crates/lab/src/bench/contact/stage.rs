//! A scene of `bench contact` as data: bodies with their steps, static solids, joints.
//!
//! In: specifications. Out: a cluster to step, or one rapier3d world of the same bodies. Never here: which scenes there are, measurements.

use super::super::super::chart::GRAVITY;
use crate::bench::rig::plain_world::{Frame, Settings, world_of};
use crate::bench::rig::play::Play;
use crate::bench::rig::shaken_floor::ShakenFloor;
use anyhow::Context;
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_contact::joint::Joint;
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Tube, TubeSpec};
use metachron_models::soft::{SoftBody, SoftSpec};
use rapier3d::pipeline::PhysicsWorld;

/// A body before it is built.
#[derive(Debug, Clone)]
pub(super) enum Body {
    Rigid(RigidSpec),
    Soft(SoftSpec),
    Tube(TubeSpec),
    /// A floor that is led to and fro.
    ShakenFloor,
}

/// Bodies among static solids.
#[derive(Debug, Clone, Default)]
pub(super) struct Stage {
    /// Each with the length of its step, seconds.
    pub bodies: Vec<(Body, f64)>,
    pub obstacles: Vec<Obstacle>,
    pub joints: Vec<Joint>,
}

impl Stage {
    /// Bodies that all make steps of one length on a floor of this friction.
    pub fn on_floor(bodies: Vec<Body>, step_s: f64, friction: f64) -> Self {
        let floor = Obstacle { friction, ..Obstacle::new("floor", Solid::Plane) };
        Self { obstacles: vec![floor], ..Self::apart(bodies, step_s) }
    }

    /// Bodies that all make steps of one length, and nothing around them.
    pub fn apart(bodies: Vec<Body>, step_s: f64) -> Self {
        Self { bodies: bodies.into_iter().map(|body| (body, step_s)).collect(), ..Self::default() }
    }

    /// The same with joints between bodies, which are numbered in their order.
    pub fn jointed(self, joints: Vec<Joint>) -> Self {
        Self { joints, ..self }
    }

    /// The same with another coefficient of restitution of every rigid body.
    pub fn rebounding(mut self, restitution: f64) -> Self {
        for (body, _) in &mut self.bodies {
            if let Body::Rigid(spec) = body {
                spec.restitution = restitution;
            }
        }
        self
    }

    /// The cluster.
    pub fn play(&self) -> anyhow::Result<Play> {
        let build = |(body, _): &(Body, f64)| {
            Ok(match body {
                Body::Rigid(spec) => Box::new(RigidBody::new(spec.clone())?) as Box<dyn Agent>,
                Body::Soft(spec) => Box::new(SoftBody::new(spec.clone())?),
                Body::Tube(spec) => Box::new(Tube::new(spec.clone())?),
                Body::ShakenFloor => Box::new(ShakenFloor::new()?),
            })
        };
        let bodies = self.bodies.iter().map(build).collect::<anyhow::Result<Vec<_>>>()?;
        let steps_s: Vec<_> = self.bodies.iter().map(|(_, step_s)| *step_s).collect();
        let first_s = *steps_s.first().context("a scene without bodies")?;
        Play::new(bodies, &self.obstacles, first_s)?.in_own_steps(&steps_s).jointed(self.joints.clone())
    }

    /// One rapier3d world of the same; `None` where some body is none that it takes, or is jointed.
    pub fn plain_world(&self) -> Option<PhysicsWorld> {
        let specs = self.bodies.iter().map(|(body, _)| match body {
            Body::Rigid(spec) => Some(spec),
            _ => None,
        });
        let specs = specs.collect::<Option<Vec<_>>>().filter(|_| self.joints.is_empty())?;
        let (_, step_s) = *self.bodies.first()?;
        let radius_m = match &specs.first()?.solid {
            Solid::Box { half_extents_m } => half_extents_m.length(),
            _ => return None,
        };
        let frame = Frame { settings: Settings::Careful, step_s, radius_m, gravity: DVec3::NEG_Z * GRAVITY };
        world_of(specs, &self.obstacles, frame).ok()
    }
}

/// A rigid body that gravity pulls down.
pub(super) fn rigid(solid: Solid, middle: DVec3, mass_kg: f64) -> RigidSpec {
    RigidSpec { gravity: DVec3::NEG_Z * GRAVITY, ..RigidSpec::free(solid, middle, mass_kg) }
}

/// A rigid box, turned about z.
pub(super) fn block(middle: DVec3, half_extents_m: DVec3, mass_kg: f64, yaw_rad: f64) -> Body {
    let spec = rigid(Solid::Box { half_extents_m }, middle, mass_kg);
    Body::Rigid(RigidSpec { rotation: DQuat::from_rotation_z(yaw_rad), ..spec })
}

/// A static box.
pub(super) fn wall(half_extents_m: DVec3, position: DVec3) -> Obstacle {
    Obstacle { position, friction: 0.5, ..Obstacle::new("wall", Solid::Box { half_extents_m }) }
}

/// Four walls of a bin whose inside reaches so far from the middle, so thick and so high, metres.
pub(super) fn walls(inside_m: f64, thick_m: f64, high_m: f64) -> [Obstacle; 4] {
    let (out_m, half_m) = (inside_m + 0.5 * thick_m, 0.5 * thick_m);
    let wide_m = inside_m + thick_m;
    [(-1.0, true), (1.0, true), (-1.0, false), (1.0, false)].map(|(sign, along_x)| {
        let half = if along_x { DVec3::new(half_m, wide_m, high_m) } else { DVec3::new(wide_m, half_m, high_m) };
        let axis = if along_x { DVec3::X } else { DVec3::Y };
        wall(half, axis * (sign * out_m) + DVec3::Z * high_m)
    })
}

/// Numbers between −1 and 1 that every engine draws alike: the fractions of a sine.
pub(super) fn drawn(number: usize, what: usize) -> f64 {
    let x = libm::sin(12.9898 * (number + 1) as f64 + 78.233 * what as f64) * 43_758.545_3;
    2.0 * (x - x.floor()) - 1.0
}
