//! The drive of a tool: its tip is a mass on a spring to the commanded point, and the spring yields at the force limit of the drive.
//!
//! In: the motion of the commanded point and of the tip. Out: the state of the tip, and of the commanded point, which the tip holds back
//! where the drive is not strong enough. Never here: the path, grasps, contacts.
//! Theory: docs/theory/coupling.md, eq. 9d, 9e: the god-object of haptics (ZS95), its coupling limited in force.

use crate::trajectory::PointMotion;
use glam::{DMat3, DVec3};
use metachron_core::Inertia;

/// A step of the drive within a contact cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Driven {
    pub commanded: PointMotion,
    pub tip: PointMotion,
    /// The impulse of the drive on the tip, N·s.
    pub impulse_n_s: DVec3,
}

/// The drive of one tool.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Drive {
    /// Force limit, newtons.
    limit_n: f64,
    /// Vector from the commanded point to the tip, and its rate of change.
    off: DVec3,
    rate: DVec3,
    /// Whether the tip holds the commanded point back: the drive gives all that it can.
    is_saturated: bool,
}

/// Deflection of the tip at the drive's full force, metres: a tool that pushes with a tenth of it is half a millimetre off.
const GIVE_M: f64 = 5e-3;
/// Frequency of tip and drive, rad/s, critically damped: with [`GIVE_M`] the full force accelerates the tip by 16 g and no more.
const SWING_PER_S: f64 = 180.0;
/// A tip closer than this to the commanded point, in metres and m/s, and without contact forces, counts as having reached it.
const REACHED: f64 = 1e-7;
/// Contact torques do not turn a tool: its inverse inertia is this small, 1/(kg·m²).
const TURNS_PER_KG_M2: f64 = 1e-9;

impl Drive {
    /// A drive with this force limit, newtons, whose tip is at the commanded point.
    pub(super) fn new(limit_n: f64) -> Self {
        Self { limit_n, off: DVec3::ZERO, rate: DVec3::ZERO, is_saturated: false }
    }

    pub(super) fn damping_n_s_m(&self) -> f64 {
        2.0 * SWING_PER_S * self.mass_kg()
    }

    pub(super) fn stiffness_n_m(&self) -> f64 {
        self.limit_n / GIVE_M
    }

    pub(super) fn mass_kg(&self) -> f64 {
        self.stiffness_n_m() / (SWING_PER_S * SWING_PER_S)
    }

    /// Whether the tip is at the commanded point.
    pub(super) fn has_arrived(&self) -> bool {
        self.off == DVec3::ZERO && self.rate == DVec3::ZERO
    }

    /// How the tip moves against the commanded point, m/s.
    pub(super) fn rate(&self) -> DVec3 {
        self.rate
    }

    /// Whether it gives all that it can.
    pub(super) fn is_saturated(&self) -> bool {
        self.is_saturated
    }

    /// Ends a step of `h` seconds in which the commanded point moved with `led` to `to`, and the tip with the velocity `moved` that the
    /// drive gave it together with all that touched it (clusters.md, eq. 14). Where the drive gave all that it can, the commanded
    /// point stays as far from the tip as that stretches its spring.
    pub(super) fn follow(&mut self, to: PointMotion, [led, moved]: [DVec3; 2], h: f64) -> Driven {
        let (k, c) = (self.stiffness_n_m(), self.damping_n_s_m());
        let rate = moved - led;
        let asked = -(self.off * k + rate * (h * k + c));
        let force = asked.clamp_length_max(self.limit_n);
        self.off += rate * h;
        self.rate = rate;
        let impulse_n_s = force * h;
        if self.off.length() < REACHED && rate.length() < REACHED {
            (self.off, self.rate) = (DVec3::ZERO, DVec3::ZERO);
        }
        if asked.length() <= self.limit_n {
            self.is_saturated = false;
            return Driven { commanded: to, tip: self.tip(to), impulse_n_s };
        }
        let tip = to.position + self.off;
        (self.off, self.rate, self.is_saturated) = (-force / k, DVec3::ZERO, true);
        let commanded = PointMotion { position: tip - self.off, velocity: moved };
        Driven { commanded, tip: self.tip(commanded), impulse_n_s }
    }

    /// The tip, for this commanded point.
    fn tip(&self, commanded: PointMotion) -> PointMotion {
        PointMotion { position: commanded.position + self.off, velocity: commanded.velocity + self.rate }
    }

    /// The tip's response to impulses apart from its spring.
    pub(super) fn inertia(&self) -> Inertia {
        Inertia::Rigid {
            inverse_mass: DVec3::splat(self.mass_kg().recip()),
            inverse_inertia: DMat3::from_diagonal(DVec3::splat(TURNS_PER_KG_M2)),
        }
    }
}
