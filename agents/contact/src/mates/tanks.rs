//! What a body that bends remembers of each agent that it touches: the energy that their coupling may still add.
//!
//! In: what each substep did. Out: how far push-out has to fade, when a contact is to be weighed. Never here: impulses.
//!
//! The tank counts the work of each impulse against the relative velocity after it, which only push-out makes positive, and,
//! where the other side turned out to move differently from what was expected while impulses were on their way, their work on
//! that difference. What contact takes fills it.

use crate::Astray;
use crate::tank::Tank;
use glam::DVec3;
use metachron_core::AgentId;

/// The tanks of all pairs that have touched lately.
#[derive(Debug, Clone, Default)]
pub struct Tanks(Vec<Account>);

/// The tank of one pair, and what else is remembered of it.
#[derive(Debug, Clone)]
pub struct Account {
    with: AgentId,
    /// The energy that the coupling may still add.
    pub tank: Tank,
    /// How the other was expected to move when the step ended, m/s, and the impulse then on its way to it, N·s.
    expected: Option<(DVec3, DVec3)>,
    idle_s: f64,
    /// How far the other is from where friction holds it.
    pub astray: Astray,
    /// What its slots were given a second in the step before.
    pub last: Vec<DVec3>,
    /// Whether the other lay on the owner in the step before.
    pub bore: bool,
    /// Steps in which the two have pressed on each other since they met.
    pressed: u32,
}

/// A pair that has not touched for this long is forgotten, seconds.
const FORGET_S: f64 = 2.0;
/// Friction holds a pair no longer where it did once the two have been apart for this long, seconds.
const LOOSE_S: f64 = 0.05;
/// What a contact weighs is found in the first step of a touch and in every so many from there on: an answer of what bends is up to a
/// twentieth of its step (measured), and what a place weighs changes slowly.
const WEIGH_EVERY: u32 = 4;
/// The share of push-out that an empty tank leaves: bodies without any would sink for good.
const LEAST: f64 = 0.25;
/// The most that one solve may add, in full tanks.
const MOST_RESERVES: f64 = 100.0;

impl Tanks {
    /// The tank of the pair with `with`; a full one for a pair whose reduced mass is `mass_kg`.
    pub fn of(&mut self, with: AgentId, mass_kg: f64) -> &mut Account {
        let at = self.0.iter().position(|account| account.with == with).unwrap_or_else(|| {
            let (tank, astray) = (Tank::of(mass_kg), Astray::default());
            self.0.push(Account {
                with,
                tank,
                expected: None,
                idle_s: 0.0,
                astray,
                last: vec![],
                bore: false,
                pressed: 1,
            });
            self.0.len() - 1
        });
        self.0[at].idle_s = 0.0;
        &mut self.0[at]
    }

    /// The tank of the pair with `with`, where the two have touched.
    pub fn get(&mut self, with: AgentId) -> Option<&mut Account> {
        self.0.iter_mut().find(|account| account.with == with)
    }

    /// Ends a step of `dt` seconds.
    pub fn close(&mut self, dt: f64) {
        for account in &mut self.0 {
            account.tank.refill(dt);
            if account.idle_s > 0.0 {
                account.pressed = 0;
                account.last.clear();
                account.bore = false;
            }
            if account.idle_s > LOOSE_S {
                account.astray.forget();
            }
            account.idle_s += dt;
        }
        self.0.retain(|account| account.idle_s < FORGET_S);
    }
}

impl Account {
    /// Whether what the strongest contact weighs is to be found in this step, in which the two press on each other.
    pub fn weighs(&mut self) -> bool {
        self.pressed += 1;
        (self.pressed - 1).is_multiple_of(WEIGH_EVERY)
    }

    /// Whether the two pressed on each other in the step before.
    pub const fn presses(&self) -> bool {
        self.pressed > 0
    }

    /// How much of push-out it still allows: all of it until half the reserve is spent.
    pub fn fade(&self) -> f64 {
        (2.0 * self.tank.share()).clamp(LEAST, 1.0)
    }

    /// The most that one solve may add, joules: what push-out takes while a body comes to rest is far less.
    pub fn most_j(&self) -> f64 {
        self.tank.left_j().max(0.0) + MOST_RESERVES * self.tank.reserve_j()
    }

    /// How the other should move when the next step begins, with the impulse on its way to it.
    pub fn expect(&mut self, velocity: DVec3, on_its_way: DVec3) {
        self.expected = Some((velocity, on_its_way));
    }

    /// Books the work of what was on its way on the difference between how the other moves and what was expected.
    pub fn correct(&mut self, velocity: DVec3) {
        if let Some((expected, impulse)) = self.expected.take() {
            self.tank.spend(impulse.dot(velocity - expected));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tank::REFILL_S;

    #[test]
    fn push_out_fades_once_half_of_a_tank_is_spent_and_comes_back() {
        let mut tanks = Tanks::default();
        let account = tanks.of(AgentId(1), 2.0); // 0.01 J
        account.tank.spend(0.0075);
        assert!((account.fade() - 0.5).abs() < 1e-12); // rounding of numbers near 1
        account.tank.spend(0.002);
        assert_eq!(account.fade(), LEAST);
        tanks.close(REFILL_S);
        assert_eq!(tanks.of(AgentId(1), 2.0).fade(), 1.0);
    }

    #[test]
    fn a_touch_is_weighed_in_its_first_step_and_in_every_fourth() {
        let mut tanks = Tanks::default();
        let mut step = |presses| {
            let weighs = presses && tanks.get(AgentId(1)).is_none_or(Account::weighs);
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
        let account = tanks.of(AgentId(1), 2.0);
        account.expect(DVec3::X, DVec3::X * 0.01);
        account.correct(DVec3::X * 1.5);
        assert!((account.tank.left_j() - 0.005).abs() < 1e-15); // a few roundings of 0.01
    }
}
