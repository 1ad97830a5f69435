//! What a tube remembers of each agent that it touches: the energy that their coupling may still add.
//!
//! In: what each substep did. Out: how far push-out has to fade, when a contact is to be weighed. Never here: impulses.
//!
//! The tank counts the work of each impulse against the relative velocity after it, which only push-out makes positive, and,
//! where the other side turned out to move differently from what was expected while impulses were on their way, their work on
//! that difference. What contact takes fills it.

use crate::AgentId;
use crate::coupling::Astray;
use glam::DVec3;

/// The tanks of all pairs that have touched lately.
#[derive(Debug, Clone, Default)]
pub struct Tanks(Vec<Tank>);

/// The tank of one pair.
#[derive(Debug, Clone)]
pub struct Tank {
    with: AgentId,
    /// What is left, joules.
    pub left_j: f64,
    reserve_j: f64,
    /// How the other was expected to move when the step ended, m/s, and the impulse then on its way to it, N·s.
    expected: Option<(DVec3, DVec3)>,
    idle_s: f64,
    /// How far the other is from where friction holds it.
    pub astray: Astray,
    /// What its slots were given a second in the step before.
    pub last: Vec<DVec3>,
    /// Steps in which the two have pressed on each other since they met.
    pressed: u32,
}

/// The speed whose energy a tank holds at the start, m/s: what the push-out of a few steps may spend before it fades.
const RESERVE_M_S: f64 = 0.1;
/// An empty tank is full again after this, seconds: a watchdog that never forgave would let bodies sink for good.
const REFILL_S: f64 = 1.0;
/// A pair that has not touched for this long is forgotten, seconds.
const FORGET_S: f64 = 2.0;
/// Friction holds a pair no longer where it did once the two have been apart for this long, seconds.
const LOOSE_S: f64 = 0.05;
/// What a contact weighs is found in the first step of a touch and in every so many from there on: an answer of what bends is up to a
/// twentieth of its step (measured), and what a place weighs changes slowly.
const WEIGH_EVERY: u32 = 4;
/// The share of push-out that an empty tank leaves, for the same reason.
const LEAST: f64 = 0.25;

impl Tanks {
    /// The tank of the pair with `with`; a full one for a pair whose reduced mass is `mass_kg`.
    pub fn of(&mut self, with: AgentId, mass_kg: f64) -> &mut Tank {
        let at = self.0.iter().position(|tank| tank.with == with).unwrap_or_else(|| {
            let reserve_j = 0.5 * mass_kg * RESERVE_M_S * RESERVE_M_S;
            let astray = Astray::default();
            self.0.push(Tank {
                with,
                left_j: reserve_j,
                reserve_j,
                expected: None,
                idle_s: 0.0,
                astray,
                last: vec![],
                pressed: 1,
            });
            self.0.len() - 1
        });
        self.0[at].idle_s = 0.0;
        &mut self.0[at]
    }

    /// The tank of the pair with `with`, where the two have touched.
    pub fn get(&mut self, with: AgentId) -> Option<&mut Tank> {
        self.0.iter_mut().find(|tank| tank.with == with)
    }

    /// Ends a step of `dt` seconds.
    pub fn close(&mut self, dt: f64) {
        for tank in &mut self.0 {
            let missing = (tank.reserve_j - tank.left_j).max(0.0);
            tank.left_j += missing.min(tank.reserve_j * dt / REFILL_S);
            if tank.idle_s > 0.0 {
                tank.pressed = 0;
                tank.last.clear();
            }
            if tank.idle_s > LOOSE_S {
                tank.astray.forget();
            }
            tank.idle_s += dt;
        }
        self.0.retain(|tank| tank.idle_s < FORGET_S);
    }
}

impl Tank {
    /// Whether what the strongest contact weighs is to be found in this step, in which the two press on each other.
    pub fn weighs(&mut self) -> bool {
        self.pressed += 1;
        (self.pressed - 1).is_multiple_of(WEIGH_EVERY)
    }

    /// How much of push-out it still allows: all of it until half the reserve is spent.
    pub fn fade(&self) -> f64 {
        (2.0 * self.left_j / self.reserve_j).clamp(LEAST, 1.0)
    }

    /// Books the energy that a substep added, joules. A full tank takes in no more: what contact took long ago pays for nothing.
    pub fn spend(&mut self, work_j: f64) {
        self.left_j = (self.left_j - work_j).min(self.reserve_j);
    }

    /// How the other should move when the next step begins, with the impulse on its way to it.
    pub fn expect(&mut self, velocity: DVec3, on_its_way: DVec3) {
        self.expected = Some((velocity, on_its_way));
    }

    /// Books the work of what was on its way on the difference between how the other moves and what was expected.
    pub fn correct(&mut self, velocity: DVec3) {
        if let Some((expected, impulse)) = self.expected.take() {
            self.spend(impulse.dot(velocity - expected));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tank_fades_only_when_more_was_added_than_taken_and_forgives() {
        let mut tanks = Tanks::default();
        let tank = tanks.of(AgentId(1), 2.0); // 0.01 J
        tank.spend(0.004);
        tank.spend(-1.0);
        assert_eq!(tank.left_j, tank.reserve_j, "what was taken fills it, and no more");
        tank.spend(0.0075);
        assert!((tank.fade() - 0.5).abs() < 1e-12); // rounding of numbers near 1
        tank.spend(0.002);
        assert_eq!(tank.fade(), LEAST);
        tanks.close(REFILL_S);
        assert_eq!(tanks.of(AgentId(1), 2.0).fade(), 1.0);
    }

    #[test]
    fn a_touch_is_weighed_in_its_first_step_and_in_every_fourth() {
        let mut tanks = Tanks::default();
        let mut step = |presses| {
            let weighs = presses && tanks.get(AgentId(1)).is_none_or(Tank::weighs);
            if presses {
                tanks.of(AgentId(1), 2.0);
            }
            tanks.close(0.01);
            weighs
        };
        let touch = [true; 6];
        assert_eq!(touch.map(&mut step), [true, false, false, false, true, false]);
        assert_eq!([false, true, true].map(&mut step), [false, true, false], "after a step apart");
    }

    #[test]
    fn a_wrong_guess_costs_the_work_of_what_was_on_its_way() {
        let mut tanks = Tanks::default();
        let tank = tanks.of(AgentId(1), 2.0);
        tank.expect(DVec3::X, DVec3::X * 0.01);
        tank.correct(DVec3::X * 1.5);
        assert!((tank.left_j - 0.005).abs() < 1e-15); // a few roundings of 0.01
    }
}
