//! A device without hardware: a handle with a mass, on a spring to a hand that goes along a path, at the end of a link that takes its time.
//!
//! In: elapsed time, wrenches. Out: states, as late as the link makes them. Deterministic: the same calls give the same bits. Never here: the
//! clock on the wall.

use super::device::{Device, DeviceError, DeviceState, Limits};
use glam::{DQuat, DVec3};
use metachron_core::Wrench;
use metachron_models::tool::Keyframe;
use std::collections::VecDeque;

/// A handle and the hand that leads it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// Mass of the handle, kg, > 0.
    pub mass_kg: f64,
    /// The spring between the hand and the handle, N/m, ≥ 0.
    pub stiffness_n_m: f64,
    /// The damping beside it, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

impl Default for Hand {
    /// A stylus of 0.1 kg in a relaxed hand.
    fn default() -> Self {
        Self { mass_kg: 0.1, stiffness_n_m: 150.0, damping_n_s_m: 6.0 }
    }
}

/// How long states and wrenches are on their way, each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Link {
    /// Seconds, ≥ 0.
    pub delay_s: f64,
    /// The most by which one takes longer than that, at random, seconds, ≥ 0; none overtakes another.
    pub jitter_s: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Where the hand goes.
#[derive(Debug, Clone, PartialEq)]
pub struct HandPath {
    /// Places and rotations, times rising; straight lines between them. At least one.
    keyframes: Vec<Keyframe>,
    repeat: bool,
}

impl HandPath {
    /// Along keyframes like a tool's, from the first again after the last where it is to `repeat`; none where there are
    /// no keyframes.
    #[must_use]
    pub fn along(keyframes: &[Keyframe], repeat: bool) -> Option<Self> {
        (!keyframes.is_empty()).then(|| Self { keyframes: keyframes.to_vec(), repeat })
    }

    /// Stays at one place.
    #[must_use]
    pub fn still(position_m: DVec3, rotation: DQuat) -> Self {
        Self { keyframes: vec![Keyframe { at_s: 0.0, tip_m: position_m, rotation, jaw: 1.0 }], repeat: false }
    }

    /// Where it is at a time, seconds.
    #[must_use]
    pub fn at(&self, time_s: f64) -> (DVec3, DQuat) {
        let last = &self.keyframes[self.keyframes.len() - 1];
        let time_s = if self.repeat && last.at_s > 0.0 { time_s.rem_euclid(last.at_s) } else { time_s };
        let next = self.keyframes.partition_point(|key| key.at_s <= time_s);
        let (Some(to), Some(from)) = (self.keyframes.get(next), next.checked_sub(1).map(|at| &self.keyframes[at]))
        else {
            let end = self.keyframes.get(next).unwrap_or(last);
            return (end.tip_m, end.rotation);
        };
        let share = (time_s - from.at_s) / (to.at_s - from.at_s);
        (from.tip_m.lerp(to.tip_m, share), from.rotation.slerp(to.rotation, share))
    }
}

/// A simulated device of three degrees of freedom: it turns as the hand does.
#[derive(Debug, Clone)]
pub struct SimulatedDevice {
    hand: Hand,
    path: HandPath,
    most_n: f64,
    time_s: f64,
    position_m: DVec3,
    velocity_m_s: DVec3,
    /// The wrench that acts, and its number.
    acting: Wrench,
    applied: u64,
    written: u64,
    states: Delayed<DeviceState>,
    wrenches: Delayed<(u64, Wrench)>,
    newest: DeviceState,
    energy: HandleEnergy,
}

/// The energy that the wrenches have given the handle itself, whatever the link reports of it.
#[derive(Debug, Clone, Copy, Default)]
struct HandleEnergy {
    given_j: f64,
    least_j: f64,
    out_j: f64,
}

/// The longest step of the handle, seconds.
const STEP_S: f64 = 1e-3;

impl SimulatedDevice {
    /// A handle at the beginning of the path, that gives `most_n` N at most.
    #[must_use]
    pub fn new(hand: Hand, path: HandPath, link: Link, most_n: f64) -> Self {
        let (position_m, rotation) = path.at(0.0);
        let newest = DeviceState {
            position_m,
            rotation,
            velocity_m_s: DVec3::ZERO,
            spin_rad_s: DVec3::ZERO,
            buttons: 0,
            applied: 0,
            given_j: 0.0,
        };
        let back = Link { seed: link.seed ^ u64::MAX, ..link };
        Self {
            hand,
            path,
            most_n,
            time_s: 0.0,
            position_m,
            velocity_m_s: DVec3::ZERO,
            acting: Wrench::default(),
            applied: 0,
            written: 0,
            states: Delayed::new(link),
            wrenches: Delayed::new(back),
            newest,
            energy: HandleEnergy::default(),
        }
    }

    /// The most energy that the handle itself was given from any moment on beyond what it gave back, J.
    #[must_use]
    pub const fn energy_out_j(&self) -> f64 {
        self.energy.out_j
    }

    /// Lets the handle live for `h` seconds.
    fn step(&mut self, h: f64) {
        while let Some((number, wrench)) = self.wrenches.arrived(self.time_s) {
            (self.applied, self.acting) = (number, wrench);
        }
        let (wanted_m, rotation) = self.path.at(self.time_s + h);
        let wanted_m_s = (wanted_m - self.path.at(self.time_s).0) / h;
        let Hand { mass_kg: m, stiffness_n_m: k, damping_n_s_m: c } = self.hand;
        // linearly implicit in the hand's spring
        let off_m = self.position_m - wanted_m + wanted_m_s * h;
        let pull = self.acting.force_n - off_m * k + (wanted_m_s - self.velocity_m_s) * c
            - (self.velocity_m_s - wanted_m_s) * (h * k);
        self.velocity_m_s += pull * (h / (m + h * c + h * h * k));
        let way_m = self.velocity_m_s * h;
        self.position_m += way_m;
        self.time_s += h;
        let HandleEnergy { given_j, least_j, out_j } = &mut self.energy;
        *given_j += self.acting.force_n.dot(way_m);
        *least_j = least_j.min(*given_j);
        *out_j = out_j.max(*given_j - *least_j);
        let (position_m, velocity_m_s, applied, given_j) = (self.position_m, self.velocity_m_s, self.applied, *given_j);
        let spin_rad_s = metachron_core::shortest_turn(self.newest.rotation, rotation) / h;
        let state = DeviceState { position_m, rotation, velocity_m_s, spin_rad_s, buttons: 0, applied, given_j };
        self.states.send(self.time_s, state);
    }
}

impl Device for SimulatedDevice {
    fn name(&self) -> &str {
        "simulated"
    }

    fn read(&mut self, elapsed_s: f64) -> Result<DeviceState, DeviceError> {
        let steps = (elapsed_s / STEP_S).ceil().max(1.0);
        (0..steps as u32).for_each(|_| self.step(elapsed_s / steps));
        while let Some(state) = self.states.arrived(self.time_s) {
            self.newest = state;
        }
        Ok(self.newest)
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        self.written += 1;
        self.wrenches.send(self.time_s, (self.written, *wrench));
        Ok(())
    }

    fn limits(&self) -> Limits {
        Limits { force_n: self.most_n, torque_n_m: 0.0, mass_kg: self.hand.mass_kg }
    }
}

/// The values on their way along a link.
#[derive(Debug, Clone)]
struct Delayed<T> {
    link: Link,
    random: u64,
    on_the_way: VecDeque<(f64, T)>,
}

/// Rounding of sums of times, seconds.
const ROUNDING_S: f64 = 1e-9;

impl<T> Delayed<T> {
    fn new(link: Link) -> Self {
        Self { link, random: link.seed, on_the_way: VecDeque::new() }
    }

    fn send(&mut self, now_s: f64, what: T) {
        let due_s = now_s + self.link.delay_s + self.link.jitter_s * self.share();
        let after_s = self.on_the_way.back().map_or(due_s, |(last_s, _)| due_s.max(*last_s));
        self.on_the_way.push_back((after_s, what));
    }

    fn arrived(&mut self, now_s: f64) -> Option<T> {
        let is_due = self.on_the_way.front().is_some_and(|(due_s, _)| *due_s <= now_s + ROUNDING_S);
        if is_due { self.on_the_way.pop_front().map(|(_, what)| what) } else { None }
    }

    /// The next random number, 0 … 1 (SplitMix64).
    fn share(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
