//! The energy tank: the energy that a device may give the hand before it has to take something in.
//!
//! In: the wrenches that were sent, the ones of them that have acted, their work. Out: the wrench that may be sent.
//! Never here: where the force comes from.
//!
//! A force that is held between samples, or that comes late, can give more energy than the contact has taken (docs/theory/coupling.md, section 6). The tank
//! (FSMS11) begins full, is emptied by energy that the handle gets and filled, up to its capacity, by energy that the
//! hand puts in: from any moment on the hand gets no more than the capacity beyond its own. A wrench is admitted as far
//! as the tank covers the energy that it and the wrenches on their way can give at the speed of the handle.

use super::device::{DeviceState, Limits};
use metachron_core::Wrench;
use std::collections::VecDeque;

/// How much further than by its velocity and the wrenches sent the handle may go within one sample, metres and radians:
/// by the hand's own force.
const SURPRISE_M: f64 = 5e-5;
const SURPRISE_RAD: f64 = 5e-4;
/// By how much the velocity of the handle may grow until a wrench acts.
const HASTE: f64 = 1.5;
/// Most wrenches on their way: of a link that takes longer nothing is known.
const IN_FLIGHT_MAX: usize = 256;

/// The handle that a wrench acts on, as it is known now.
#[derive(Debug, Clone, Copy)]
pub struct Handle {
    /// Its newest state.
    pub state: DeviceState,
    /// The limits of the device, and the handle's mass.
    pub limits: Limits,
    /// Time between states, seconds, > 0.
    pub period_s: f64,
}

/// The tank of one device.
#[derive(Debug, Clone)]
pub struct EnergyTank {
    capacity_j: f64,
    level_j: f64,
    /// The wrenches sent, from the one that acted last on, and the number of the first of them.
    sent: VecDeque<Wrench>,
    first: u64,
    /// The work that the last state told of, J.
    before_j: f64,
    given_j: f64,
    least_given_j: f64,
    out_j: f64,
}

impl EnergyTank {
    /// A full tank of this capacity, J, > 0.
    #[must_use]
    pub fn new(capacity_j: f64) -> Self {
        // number 0 acts until the first wrench has been written
        let sent = VecDeque::from([Wrench::default()]);
        let (level_j, before_j) = (capacity_j, 0.0);
        Self { capacity_j, level_j, sent, first: 0, before_j, given_j: 0.0, least_given_j: 0.0, out_j: 0.0 }
    }

    /// The energy in it, J.
    #[must_use]
    pub const fn level_j(&self) -> f64 {
        self.level_j
    }

    /// The most energy that the handle has been given from any moment on, beyond the energy that the hand put in, J.
    #[must_use]
    pub const fn out_j(&self) -> f64 {
        self.out_j
    }

    /// Books the energy that the handle was given since the last state, and which wrenches are no more on their way.
    pub fn settle(&mut self, now: &DeviceState) {
        let last = self.first + self.sent.len() as u64 - 1;
        let applied = now.applied.clamp(self.first, last);
        let before_j = std::mem::replace(&mut self.before_j, now.given_j);
        self.sent.drain(..(applied - self.first) as usize);
        self.first = applied;
        let gave_j = now.given_j - before_j;
        self.level_j = (self.level_j - gave_j).min(self.capacity_j);
        self.given_j += gave_j;
        self.least_given_j = self.least_given_j.min(self.given_j);
        self.out_j = self.out_j.max(self.given_j - self.least_given_j);
    }

    /// The share of a wrench that the tank covers.
    #[must_use]
    pub fn admit(&mut self, wanted: &Wrench, handle: &Handle) -> Wrench {
        let forces_n = self.sent.iter().map(|wrench| wrench.force_n.length()).sum::<f64>() + wanted.force_n.length();
        let most_j = |wrench: &Wrench| handle.most_work_j(wrench, forces_n);
        // of the wrenches on their way any one may act in the place of late ones (coupling.md, eq. 7u)
        let periods = self.sent.len() as f64;
        let on_the_way_j = periods * self.sent.iter().map(most_j).fold(0.0, f64::max);
        let free_j = (self.level_j - on_the_way_j).max(0.0).min(self.level_j / (periods + 1.0));
        let asked_j = most_j(wanted);
        let admitted = if asked_j > free_j { *wanted * (free_j / asked_j) } else { *wanted };
        if self.sent.len() == IN_FLIGHT_MAX {
            self.sent.pop_front();
            self.first += 1;
        }
        self.sent.push_back(admitted);
        admitted
    }
}

impl Handle {
    /// The most that a wrench can give within a period, J, ≥ 0, beside forces of `forces_n` that have come to act by then.
    fn most_work_j(&self, wrench: &Wrench, forces_n: f64) -> f64 {
        let Self { state, limits, period_s } = self;
        let power_w = wrench.force_n.dot(state.velocity_m_s) + wrench.torque_n_m.dot(state.spin_rad_s);
        let pushed_m = forces_n / limits.mass_kg * period_s * period_s;
        let surprise_j = wrench.force_n.length() * (SURPRISE_M + pushed_m) + wrench.torque_n_m.length() * SURPRISE_RAD;
        HASTE * power_w.max(0.0) * period_s + surprise_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    fn at(z: f64, velocity: f64, applied: u64, given_j: f64) -> DeviceState {
        let (rotation, spin_rad_s) = (DQuat::IDENTITY, DVec3::ZERO);
        DeviceState {
            position_m: DVec3::Z * z,
            rotation,
            velocity_m_s: DVec3::Z * velocity,
            spin_rad_s,
            buttons: 0,
            applied,
            given_j,
        }
    }

    fn handle(state: DeviceState) -> Handle {
        Handle { state, limits: Limits { force_n: 5.0, torque_n_m: 0.0, mass_kg: 0.5 }, period_s: 1e-3 }
    }

    #[test]
    fn a_force_along_the_motion_gives_no_more_than_the_tank_has() {
        let mut tank = EnergyTank::new(0.01);
        let push = Wrench { force_n: DVec3::Z * 5.0, torque_n_m: DVec3::ZERO };
        let (mut z, mut gave_j, mut force_n) = (0.0, 0.0, 0.0);
        for tick in 0..1000 {
            // the handle runs away at 0.2 m/s whatever is done
            gave_j += force_n * 2e-4;
            z += 2e-4;
            let state = at(z, 0.2, tick, gave_j);
            tank.settle(&state);
            force_n = tank.admit(&push, &handle(state)).force_n.z;
        }
        assert!(gave_j > 0.009 && gave_j <= 0.01, "{gave_j} J");
        assert!((tank.out_j() - gave_j).abs() < 1e-9, "{} J of {gave_j} J", tank.out_j());
    }

    #[test]
    fn an_empty_tank_is_filled_by_the_hand_and_no_further_than_its_capacity() {
        let mut tank = EnergyTank { level_j: 1e-6, ..EnergyTank::new(0.01) };
        let push = Wrench { force_n: DVec3::Z * 5.0, torque_n_m: DVec3::ZERO };
        let (mut z, mut gave_j, mut force_n) = (0.0, 0.0, 0.0);
        for tick in 0..500 {
            gave_j -= force_n * 2e-4;
            z -= 2e-4;
            let state = at(z, -0.2, tick, gave_j);
            tank.settle(&state);
            force_n = tank.admit(&push, &handle(state)).force_n.z;
        }
        assert_eq!(tank.level_j(), 0.01);
    }
}
