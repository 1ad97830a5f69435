//! Shared parts of the stability experiments: plain bodies and tubes, and loads.

use glam::{DQuat, DVec3};
use metachron_contact::AnchorForce;
use metachron_core::Anchor;
use metachron_geometry::{ContactTraits, Solid};
use metachron_models::rigid::RigidSpec;
use metachron_models::rod::{Material, Section, TubeSpec};
use metachron_models::soft::{SoftMaterial, SoftShape, SoftSpec};

/// Gravity of the Earth, m/s².
pub(crate) const GRAVITY: f64 = 9.81;

/// Radius of the tubes that touch other bodies, metres.
pub(in super::super) const TUBE_RADIUS_M: f64 = 0.015;

/// Greatest energy at a common time, as a multiple of the start's: one percent for the error of integration.
pub(super) const COMMON_ENERGY_MAX: f64 = 1.01;

/// A free tube of 1 MPa with a wall of an eighth of its radius, no weight, no damping, no friction.
pub(in super::super) fn plain_tube(path_m: Vec<DVec3>, radius_m: f64, segments: usize) -> TubeSpec {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    TubeSpec::free(path_m, Section::hollow(radius_m, radius_m / 8.0, material), segments)
}

/// A free rigid body at rest at `position`, no weight, no friction, no rebound.
pub(in super::super) fn plain_body(solid: Solid, position: DVec3, mass_kg: f64) -> RigidSpec {
    RigidSpec { friction: 0.0, ..RigidSpec::free(solid, position, mass_kg) }
}

/// A soft body under gravity, attached nowhere, no friction.
pub(crate) fn plain_soft(shape: SoftShape, material: SoftMaterial) -> SoftSpec {
    SoftSpec {
        shape,
        nodes: None,
        eps_touched_m: None,
        material,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: Vec::new(),
        friction: 0.0,
        traits: ContactTraits::default(),
        gravity: DVec3::NEG_Z * GRAVITY,
        self_contact: false,
        sleep: false,
    }
}

/// A constant force on the point of a tube at a rest arc length.
pub(in super::super) fn dead_load(arc_m: f64, force_n: DVec3) -> AnchorForce {
    AnchorForce { anchor: Anchor::Arc(arc_m), force_n, torque_n_m: DVec3::ZERO }
}
