//! What upsets a loop: loads, spikes, drift, a turn of the camera, another speed of the machine.
//!
//! In: how much of a trial has passed, random numbers. Out: factors on the work, and what of the scene is in view.
//! Never here: the loop.

use crate::control::ObjectView;

/// What happens in a trial, beside the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// Nothing.
    Nothing,
    /// From a third to two thirds of the trial every frame takes so many times its time, > 0.
    Load(f64),
    /// One frame in a hundred takes five times its time.
    Spikes,
    /// The work drifts by 30 % up and down once in the trial.
    Drift,
    /// From a third to two thirds the camera looks away from every second object; a single one is seen from twice as far.
    CameraTurn,
    /// From a third on the machine is so many times as fast, > 0.
    Speed(f64),
}

/// The share of frames that spike.
const SPIKES: f64 = 0.01;
/// How long they take.
const SPIKE: f64 = 5.0;
/// How far the work drifts.
const DRIFT: f64 = 0.3;

impl Disturbance {
    /// All that a law is judged by.
    pub const ALL: [Self; 8] = [
        Self::Nothing,
        Self::Load(1.4),
        Self::Load(0.6),
        Self::Spikes,
        Self::Drift,
        Self::CameraTurn,
        Self::Speed(2.0),
        Self::Speed(0.5),
    ];

    /// Whether it differs from one seed to another.
    #[must_use]
    pub fn is_by_chance(self) -> bool {
        self == Self::Spikes
    }

    /// The factor on the work of a frame when the share `passed` of the trial is over; `random` is uniform in 0 … 1.
    #[must_use]
    pub fn load(self, passed: f64, random: f64) -> f64 {
        match self {
            Self::Load(factor) if in_the_middle(passed) => factor,
            Self::Spikes if random < SPIKES => SPIKE,
            Self::Drift => 1.0 + DRIFT * libm::sin(std::f64::consts::TAU * passed),
            Self::Speed(factor) if passed >= 1.0 / 3.0 => 1.0 / factor,
            _ => 1.0,
        }
    }

    /// Changes what is in view when the share `passed` of the trial is over.
    pub fn look(self, passed: f64, views: &mut [ObjectView]) {
        if self != Self::CameraTurn || !in_the_middle(passed) {
            return;
        }
        match views {
            [only] => {
                only.distance_m *= 2.0;
                only.pixels *= 0.25;
            }
            many => many.iter_mut().skip(1).step_by(2).for_each(|view| view.visible = false),
        }
    }
}

fn in_the_middle(passed: f64) -> bool {
    (1.0 / 3.0..2.0 / 3.0).contains(&passed)
}

/// Random numbers that are the same on every machine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in 0 … 1 (SplitMix64).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / 2f64.powi(53)
    }

    /// Normal with deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_come_and_go_and_a_speed_stays() {
        let at = |d: Disturbance, passed| d.load(passed, 0.5);
        assert_eq!([0.1, 0.5, 0.9].map(|p| at(Disturbance::Load(1.4), p)), [1.0, 1.4, 1.0]);
        assert_eq!([0.1, 0.5, 0.9].map(|p| at(Disturbance::Speed(2.0), p)), [1.0, 0.5, 0.5]);
        assert_eq!(Disturbance::Spikes.load(0.5, 0.005), 5.0);
    }

    #[test]
    fn the_dice_are_uniform_and_normal() {
        let mut dice = Dice::new(7);
        let n = 20_000;
        let mean = (0..n).map(|_| dice.uniform()).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        let (sum, square) = (0..n).map(|_| dice.normal()).fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
        assert!((sum / f64::from(n)).abs() < 0.03 && (square / f64::from(n) - 1.0).abs() < 0.05);
    }
}
