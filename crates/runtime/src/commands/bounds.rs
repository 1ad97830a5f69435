//! The bounds of the numbers of commands and states: one table for all of them.
//!
//! In: forces, springs, regions, pressures, states. Out: the number that is beyond its bound, with the bound. Never here: which of them an agent
//! takes; rotations, and motors, which have joints' own bounds ([`metachron_contact::joint::Motor::check`]).

use glam::DVec3;
use metachron_contact::{AnchorForce, AnchorSpring, Carving, MOTION_MAX, SetMotion};
use metachron_core::{Anchor, Body};

/// A number of a command or a state that is beyond its bound; the agent stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the {} is {value:e} {}; expected a finite number from {:e} to {:e} {}", .bound.what, .bound.unit, .bound.least, .bound.most, .bound.unit)]
pub struct OutOfBounds {
    /// The number.
    pub value: f64,
    /// The bound that it is beyond.
    pub bound: Bound,
}

/// The least and the greatest number of a kind; of a vector along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// The kind.
    pub what: &'static str,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub most: f64,
    /// The unit of both.
    pub unit: &'static str,
}

const POSITION: Bound = Bound::either("position", MOTION_MAX, "m");
const VELOCITY: Bound = Bound::either("velocity", MOTION_MAX, "m/s");
const SPIN: Bound = Bound::either("spin", MOTION_MAX, "rad/s");
/// The weight of the heaviest body that a scene has, of 1e9 kg, and the same a second long.
const FORCE: Bound = Bound::either("force", 1e10, "N");
const TORQUE: Bound = Bound::either("torque", 1e10, "N·m");
const IMPULSE: Bound = Bound::either("impulse", 1e10, "N·s");
const ANGULAR_IMPULSE: Bound = Bound::either("angular impulse", 1e10, "N·m·s");
/// A hand that moves the heaviest body as fast as a light one, at up to 30 rad/s.
const STIFFNESS: Bound = Bound { what: "stiffness", least: 0.0, most: 1e12, unit: "N/m" };
const DAMPING: Bound = Bound { what: "damping", least: 0.0, most: 1e12, unit: "N·s/m" };
/// Ten times the pressure that a scene may ask of a tube.
const PRESSURE: Bound = Bound::either("pressure", 1e8, "Pa");
const RADIUS: Bound = Bound { what: "radius", least: 0.0, most: MOTION_MAX, unit: "m" };

impl Bound {
    /// The same to either side of zero.
    const fn either(what: &'static str, most: f64, unit: &'static str) -> Self {
        Self { what, least: -most, most, unit }
    }

    fn check(self, value: f64) -> Result<(), OutOfBounds> {
        // NaN fails every comparison
        if (self.least..=self.most).contains(&value) { Ok(()) } else { Err(OutOfBounds { value, bound: self }) }
    }

    fn check_axes(self, vector: DVec3) -> Result<(), OutOfBounds> {
        vector.to_array().into_iter().try_for_each(|value| self.check(value))
    }

    fn check_all(self, vectors: &[DVec3]) -> Result<(), OutOfBounds> {
        vectors.iter().try_for_each(|vector| self.check_axes(*vector))
    }
}

pub(super) fn check_force(force: &AnchorForce) -> Result<(), OutOfBounds> {
    check_anchor(force.anchor)?;
    FORCE.check_axes(force.force_n)?;
    TORQUE.check_axes(force.torque_n_m)
}

pub(super) fn check_impulse(impulse: &AnchorForce) -> Result<(), OutOfBounds> {
    check_anchor(impulse.anchor)?;
    IMPULSE.check_axes(impulse.force_n)?;
    ANGULAR_IMPULSE.check_axes(impulse.torque_n_m)
}

pub(super) fn check_spring(spring: &AnchorSpring) -> Result<(), OutOfBounds> {
    check_anchor(spring.anchor)?;
    POSITION.check_axes(spring.target)?;
    VELOCITY.check_axes(spring.target_velocity)?;
    STIFFNESS.check(spring.stiffness_n_m)?;
    DAMPING.check(spring.damping_n_s_m)
}

pub(super) fn check_motion(motion: &SetMotion) -> Result<(), OutOfBounds> {
    let SetMotion { position_m, velocity_m_s, spin_rad_s, .. } = *motion;
    let vectors = [(POSITION, position_m), (VELOCITY, velocity_m_s), (SPIN, spin_rad_s)];
    vectors.into_iter().try_for_each(|(bound, vector)| vector.map_or(Ok(()), |vector| bound.check_axes(vector)))
}

pub(super) fn check_carving(carving: &Carving) -> Result<(), OutOfBounds> {
    POSITION.check_all(&[carving.from_m, carving.to_m])?;
    RADIUS.check(carving.radius_m)
}

pub(super) fn check_pressure(pressure_pa: f64) -> Result<(), OutOfBounds> {
    PRESSURE.check(pressure_pa)
}

/// Checks the numbers of a state that move something.
///
/// # Errors
/// The first that is beyond its bound.
pub fn check_state(state: &Body) -> Result<(), OutOfBounds> {
    let (positions, velocities, spin) = match state {
        Body::Nothing => return Ok(()),
        Body::Curve(curve) => (&curve.positions[..], &curve.velocities[..], DVec3::ZERO),
        Body::Rigid(body) => (std::slice::from_ref(&body.position), std::slice::from_ref(&body.velocity), body.spin),
        Body::Tool(tool) => (std::slice::from_ref(&tool.tip), std::slice::from_ref(&tool.velocity), tool.spin),
        Body::Soft(soft) => match &soft.nodes {
            Some(nodes) => (&nodes.positions[..], &nodes.velocities[..], DVec3::ZERO),
            None => (&soft.positions[..], &soft.velocities[..], DVec3::ZERO),
        },
    };
    POSITION.check_all(positions)?;
    VELOCITY.check_all(velocities)?;
    SPIN.check_axes(spin)
}

fn check_anchor(anchor: Anchor) -> Result<(), OutOfBounds> {
    match anchor {
        Anchor::Arc(arc_m) => POSITION.check(arc_m),
        Anchor::Local(point) => POSITION.check_axes(point),
        Anchor::Vertex(_) => Ok(()),
    }
}
