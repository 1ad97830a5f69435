//! Disturbances of a loop: loads, spikes, drift, a turn of the camera, another speed of the machine.
//!
//! In: the elapsed fraction of a trial, random numbers. Out: factors on the work, and the part of the scene in view.
//! Never here: the loop.

use crate::control::ObjectView;

/// A disturbance of a trial, in addition to the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// No disturbance.
    Nothing,
    /// In the middle third of the trial every frame takes this many times its time, > 0.
    Load(f64),
    /// One frame in a hundred takes five times its time.
    Spikes,
    /// The work drifts by 30 % up and down once in the trial.
    Drift,
    /// In the middle third the camera turns away from every second object; a single object is seen from twice as far.
    CameraTurn,
    /// After the first third the machine is this many times as fast, > 0.
    Speed(f64),
}

/// The fraction of frames that spike.
const SPIKES: f64 = 0.01;
/// Factor on the time of a spike.
const SPIKE: f64 = 5.0;
/// Amplitude of the drift.
const DRIFT: f64 = 0.3;

impl Disturbance {
    /// All disturbances used to judge a law.
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

    /// Whether the disturbance depends on the seed.
    #[must_use]
    pub fn is_random(self) -> bool {
        self == Self::Spikes
    }

    /// The factor on the work of a frame after the fraction `passed` of the trial; `random` is uniform in 0 … 1.
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

    /// Changes the objects in view after the fraction `passed` of the trial.
    pub fn apply_to_views(self, passed: f64, views: &mut [ObjectView]) {
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

/// Random numbers that are identical on every machine.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Random(u64);

impl Random {
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
    fn a_load_ends_and_a_speed_stays() {
        let at = |d: Disturbance, passed| d.load(passed, 0.5);
        assert_eq!([0.1, 0.5, 0.9].map(|p| at(Disturbance::Load(1.4), p)), [1.0, 1.4, 1.0]);
        assert_eq!([0.1, 0.5, 0.9].map(|p| at(Disturbance::Speed(2.0), p)), [1.0, 0.5, 0.5]);
        assert_eq!(Disturbance::Spikes.load(0.5, 0.005), 5.0);
    }

    #[test]
    fn random_numbers_are_uniform_and_normal() {
        let mut random = Random::new(7);
        let n = 20_000;
        let mean = (0..n).map(|_| random.uniform()).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        let (sum, square) = (0..n).map(|_| random.normal()).fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
        assert!((sum / f64::from(n)).abs() < 0.03 && (square / f64::from(n) - 1.0).abs() < 0.05);
    }
}
