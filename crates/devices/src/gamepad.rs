//! A gamepad as a device: its sticks lead a pose by velocities, and its buttons are passed on.
//!
//! In: the first gamepad that the system has. Out: poses from a start on. Never here: keys of a window. On Linux gamepads are files that
//! libudev finds.

use super::device::{Device, DeviceError, DeviceState, Limits};
use gilrs::{Axis, Button, Gilrs};
use glam::{DQuat, DVec3};
use metachron_core::Wrench;

/// The buttons of the bits of [`DeviceState::buttons`], from the lowest.
const BUTTONS: [Button; 6] =
    [Button::South, Button::East, Button::West, Button::North, Button::LeftTrigger, Button::RightTrigger];

/// The first gamepad of the system. The left stick leads along x and y, the right one along z.
pub struct Gamepad {
    pads: Gilrs,
    speed_m_s: f64,
    state: DeviceState,
}

impl Gamepad {
    /// A gamepad that leads from `position_m` with at most `speed_m_s` along each axis.
    ///
    /// # Errors
    /// [`DeviceError`] where the system's gamepads cannot be read.
    pub fn new(position_m: DVec3, rotation: DQuat, speed_m_s: f64) -> Result<Self, DeviceError> {
        let pads = Gilrs::new().map_err(|error| DeviceError(format!("gamepads cannot be read: {error}")))?;
        let (velocity_m_s, spin_rad_s) = (DVec3::ZERO, DVec3::ZERO);
        let state =
            DeviceState { position_m, rotation, velocity_m_s, spin_rad_s, buttons: 0, applied: 0, given_j: 0.0 };
        Ok(Self { pads, speed_m_s, state })
    }
}

impl Device for Gamepad {
    fn name(&self) -> &str {
        "gamepad"
    }

    fn read(&mut self, elapsed_s: f64) -> Result<DeviceState, DeviceError> {
        // the events bring the state of the sticks up to date
        while self.pads.next_event().is_some() {}
        let Some((_, pad)) = self.pads.gamepads().next() else {
            return Err(DeviceError("no gamepad is connected".to_owned()));
        };
        let stick = [Axis::LeftStickX, Axis::LeftStickY, Axis::RightStickY].map(|axis| f64::from(pad.value(axis)));
        let state = &mut self.state;
        state.velocity_m_s = DVec3::from_array(stick) * self.speed_m_s;
        state.position_m += state.velocity_m_s * elapsed_s;
        let held = (0..).zip(BUTTONS).filter(|(_, button)| pad.is_pressed(*button));
        state.buttons = held.fold(0, |bits, (bit, _)| bits | 1 << bit);
        Ok(*state)
    }

    /// A gamepad gives no force.
    fn write(&mut self, _wrench: &Wrench) -> Result<(), DeviceError> {
        self.state.applied += 1;
        Ok(())
    }

    fn limits(&self) -> Limits {
        Limits::NOTHING
    }
}
