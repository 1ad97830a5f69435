//! Devices in hands: they lead an object of a running world, and feel its contacts, a thousand times a second.
//!
//! In: a [`World`], an object that is led (a kinematic body or a tool), a [`Device`]. Out: poses for the object, wrenches for the device, a
//! [`DeviceReport`]. Between two states that the world publishes the force follows the device by the local model of the object's contacts
//! ([`ContactModel`]), and an [`EnergyTank`] bounds the energy that the hand is given. Never here: physics, a picture, a file.
//!
//! Theory: `docs/theory/coupling.md`, section 6.
//!
//! [`World`]: metachron_world::World

mod contact_model;
mod device;
mod device_loop;
#[cfg(feature = "gamepad")]
mod gamepad;
mod histogram;
mod report;
mod served;
mod simulated;
mod tank;

pub use contact_model::ContactModel;
pub use device::{Device, DeviceError, DeviceState, Limits};
pub use device_loop::{DeviceLoop, LoopOptions};
#[cfg(feature = "gamepad")]
pub use gamepad::Gamepad;
pub use report::{DeviceReport, Quantiles};
pub use served::Served;
pub use simulated::{Hand, HandPath, Link, SimulatedDevice};
pub use tank::EnergyTank;

/// The page of the crate: its code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
