//! How jaws keep a body from turning between them: a torsional spring to a frame that is led.
//!
//! In: what a tool says of its hold, the body's rotation and spin. Out: the torque over a step, linearly implicit, and how much it
//! resists a change of the spin. Never here: the point that is held, and how the system is solved ([`crate::rigid::linear_spring`]).
//! Theory: docs/theory/coupling.md, eq. 9b.

use glam::{DQuat, DVec3};
use metachron_contact::Pull;
use metachron_core::{Clasp, ToolState};
use metachron_core::{Sprung, Twist};

/// A torsional spring whose far end is led.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// The body's rotation in which it turns nothing, where the jaws are now.
    target: DQuat,
    /// How that turns, rad/s.
    spin: DVec3,
    /// N·m/rad.
    stiffness: f64,
    /// N·m·s/rad.
    damping: f64,
    /// The angular impulse that it gave the body in the last part, N·m·s.
    pub impulse: DVec3,
}

impl Turn {
    /// The hold of `tool`, whose state is `age_s` seconds old, on a body that it pulls by `pull`.
    pub(super) fn of(tool: &ToolState, clasp: &Clasp, (pull, age_s): (&Pull, f64)) -> Self {
        let square = clasp.arm_m * clasp.arm_m;
        let mut turn = Self {
            target: tool.rotation * clasp.rotation,
            spin: tool.spin,
            stiffness: pull.stiffness_n_m * square,
            damping: pull.damping_n_s_m * square,
            impulse: DVec3::ZERO,
        };
        turn.go_on(age_s);
        turn
    }

    /// Lets `h` seconds pass for the jaws.
    pub(super) fn go_on(&mut self, h: f64) {
        if self.spin != DVec3::ZERO {
            self.target = (DQuat::from_scaled_axis(self.spin * h) * self.target).normalize();
        }
    }

    /// The shortest way back, as a rotation vector in world axes.
    fn away(&self, rotation: DQuat) -> DVec3 {
        let back = self.target * rotation.conjugate();
        if back.w < 0.0 { (-back).to_scaled_axis() } else { back.to_scaled_axis() }
    }

    /// The angular impulse over `h` seconds on a body in this state whose spin does not change.
    pub(super) fn impulse_at(&self, rotation: DQuat, spin: DVec3, h: f64) -> DVec3 {
        self.away(rotation) * (self.stiffness * h) + (self.spin - spin) * self.resistance(h)
    }

    /// How much of it a change of the spin takes back, kg·m².
    pub(super) fn resistance(&self, h: f64) -> f64 {
        h * (h * self.stiffness + self.damping)
    }

    /// Notes what it gives over `h` seconds to a body in this state whose spin changes by `change`; `bent` is what impulses that
    /// were received at the start did to the velocities while springs gave way over so many seconds.
    pub(super) fn give(&mut self, (rotation, spin): (DQuat, DVec3), (change, h): (DVec3, f64), bent: (Twist, f64)) {
        let ([_, bent], span_s) = bent;
        self.impulse =
            self.impulse_at(rotation, spin, h) - change * self.resistance(h) - bent * self.resistance(span_s);
    }

    /// Adds what it does to a body in this state, and how that changes, to what others know of its springs.
    pub(super) fn lean(&self, rotation: DQuat, spin: DVec3, all: &mut Sprung) {
        all.force[1] += self.away(rotation) * self.stiffness + (self.spin - spin) * self.damping;
        all.rising[1] += self.spin * self.stiffness;
        all.stiffness.add_turning(DVec3::ZERO, self.stiffness);
        all.damping.add_turning(DVec3::ZERO, self.damping);
    }
}
