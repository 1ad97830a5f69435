//! Rotational hold of jaws on a rigid body: a torsional spring to a driven frame.
//!
//! In: what a tool says of its hold, the body's rotation and spin. Out: the torque over a step, linearly implicit, and how much it
//! resists a change of the spin. Never here: the point that is held, and how the system is solved ([`crate::rigid::linear_spring`]).
//! Theory: docs/theory/coupling.md, eq. 9b.

use super::motion::VelocityStep;
use glam::{DQuat, DVec3};
use metachron_contact::AnchorSpring;
use metachron_core::Sprung;
use metachron_core::{GraspOrientation, ToolState};

/// A torsional spring whose far end is driven.
#[derive(Debug, Clone, Copy)]
pub(super) struct OrientationSpring {
    /// The body's rotation at which the torque is zero, for the present rotation of the jaws.
    target: DQuat,
    /// Angular velocity of that target, rad/s.
    spin: DVec3,
    /// Stiffness, N·m/rad.
    stiffness: f64,
    /// Damping, N·m·s/rad.
    damping: f64,
    /// The angular impulse that it gave the body in the last part, N·m·s.
    pub impulse: DVec3,
}

impl OrientationSpring {
    /// The grasp of `tool`, whose state is `age_s` seconds old, on a body that it pulls by `pull`.
    pub(super) fn of(tool: &ToolState, clasp: &GraspOrientation, pull: &AnchorSpring, age_s: f64) -> Self {
        let square = clasp.arm_m * clasp.arm_m;
        let mut turn = Self {
            target: tool.rotation * clasp.rotation,
            spin: tool.spin,
            stiffness: pull.stiffness_n_m * square,
            damping: pull.damping_n_s_m * square,
            impulse: DVec3::ZERO,
        };
        turn.advance(age_s);
        turn
    }

    /// Advances the jaws by `h` seconds.
    pub(super) fn advance(&mut self, h: f64) {
        if self.spin != DVec3::ZERO {
            self.target = (DQuat::from_scaled_axis(self.spin * h) * self.target).normalize();
        }
    }

    /// The shortest rotation back to the target, as a rotation vector in world axes.
    fn away(&self, rotation: DQuat) -> DVec3 {
        let back = self.target * rotation.conjugate();
        if back.w < 0.0 { (-back).to_scaled_axis() } else { back.to_scaled_axis() }
    }

    /// The angular impulse over `h` seconds on a body in this state whose spin does not change.
    pub(super) fn impulse_at(&self, rotation: DQuat, spin: DVec3, h: f64) -> DVec3 {
        self.away(rotation) * (self.stiffness * h) + (self.spin - spin) * self.resistance(h)
    }

    /// The decrease of that impulse per change of the spin, kg·m².
    pub(super) fn resistance(&self, h: f64) -> f64 {
        h * (h * self.stiffness + self.damping)
    }

    /// Stores its impulse over `h` seconds on a body whose spin changes by `change`: `steady` is the impulse without that change
    /// ([`Self::impulse_at`]), `received` the change by impulses at the start.
    pub(super) fn store_impulse(&mut self, steady: DVec3, change: DVec3, h: f64, received: &VelocityStep) {
        let VelocityStep { change: [_, bent], span_s } = *received;
        self.impulse = steady - change * self.resistance(h) - bent * self.resistance(span_s);
    }

    /// Adds its torque on a body in this state, and the derivatives of it, to the published sum of springs.
    pub(super) fn add_to(&self, rotation: DQuat, spin: DVec3, all: &mut Sprung) {
        all.force[1] += self.away(rotation) * self.stiffness + (self.spin - spin) * self.damping;
        all.rising[1] += self.spin * self.stiffness;
        all.stiffness.add_turning(DVec3::ZERO, self.stiffness);
        all.damping.add_turning(DVec3::ZERO, self.damping);
    }
}
