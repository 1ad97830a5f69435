//! The interface of a device: a pose and buttons in, a wrench out.
//!
//! In: the time that has passed. Out: where the handle is. Never here: a vendor's driver, which device leads which
//! object.

use glam::{DQuat, DVec3};
use metachron_core::Wrench;

/// A device in a hand. Both calls are made by one thread, about once a millisecond, and must not wait longer than a fraction of that.
pub trait Device: Send {
    /// Its name, for reports.
    fn name(&self) -> &str;

    /// The newest state of the handle, `elapsed_s` seconds after the last call; a device with a clock of its own does not need them.
    ///
    /// # Errors
    /// [`DeviceError`] where there is none: it is reported, nothing is led meanwhile, and the next call follows as if nothing had happened.
    fn read(&mut self, elapsed_s: f64) -> Result<DeviceState, DeviceError>;

    /// Gives the hand this wrench from now on, world axes, about the position of the newest state.
    ///
    /// # Errors
    /// [`DeviceError`] where it cannot be given: it is reported, and the next call follows.
    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError>;

    /// The most that it can give, and the mass of its handle: it is asked for no more.
    fn limits(&self) -> Limits;
}

/// The greatest force and torque that a device gives, and its handle's mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// N, ≥ 0.
    pub force_n: f64,
    /// N·m, ≥ 0; zero of a device of three degrees of freedom.
    pub torque_n_m: f64,
    /// The least mass with which the handle answers a force, kg, > 0: by it the energy is bounded that a force gives before it is known to act.
    pub mass_kg: f64,
}

impl Limits {
    /// Of a device that gives nothing.
    pub const NOTHING: Self = Self { force_n: 0.0, torque_n_m: 0.0, mass_kg: 1.0 };

    /// The same wrench, as far as the device gives it.
    #[must_use]
    pub fn of(&self, wrench: &Wrench) -> Wrench {
        Wrench {
            force_n: wrench.force_n.clamp_length_max(self.force_n),
            torque_n_m: wrench.torque_n_m.clamp_length_max(self.torque_n_m),
        }
    }
}

/// A handle at one moment, in the axes of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceState {
    /// Where it is, metres: where the origin of a kinematic body's axes, or the tip of a tool, is to be.
    pub position_m: DVec3,
    /// Its rotation to the world's axes. A tool keeps its own.
    pub rotation: DQuat,
    /// m/s.
    pub velocity_m_s: DVec3,
    /// rad/s.
    pub spin_rad_s: DVec3,
    /// Buttons held down, a bit each.
    pub buttons: u32,
    /// How many of the wrenches written so far have come to act on the handle: wrenches on their way may still give
    /// energy. A device without a link of its own counts its calls of [`Device::write`].
    pub applied: u64,
    /// The work of the wrenches on the handle so far, J: each one's product with the way that the handle went under it, summed where the handle
    /// is, so that no delay of a link falsifies it.
    pub given_j: f64,
}

impl DeviceState {
    /// Whether every number is finite and the rotation is one.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let vectors = [self.position_m, self.velocity_m_s, self.spin_rad_s];
        vectors.iter().all(|v| v.is_finite())
            && self.rotation.is_finite()
            && self.given_j.is_finite()
            && self.rotation.length_squared() > 0.25
    }
}

/// Why a device gave no state, or took no wrench.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);
