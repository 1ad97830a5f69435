//! The energy that the coupling of one pair may still add: the part that the energy budgets of all kinds of pairs share.
//!
//! In: the energy that impulses added. Out: the energy left. Never here: which work counts as added, and how push-out depends on it
//! (pairs of rigid bodies and pairs with deformables each have their own rule). Theory: docs/theory/coupling.md, section 5.

/// The speed whose kinetic energy a tank holds at the start, m/s: enough for the push-out of a few steps before it fades.
pub const RESERVE_M_S: f64 = 0.1;
/// Time in which an empty tank fills up again and a debt decays to a third, seconds: without recovery push-out would stay off and
/// bodies would sink for good.
pub const REFILL_S: f64 = 1.0;

/// The energy budget of one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tank {
    left_j: f64,
    reserve_j: f64,
}

impl Tank {
    /// A full tank, for a pair whose reduced mass is `mass_kg`.
    #[must_use]
    pub fn of(mass_kg: f64) -> Self {
        let reserve_j = 0.5 * mass_kg * RESERVE_M_S * RESERVE_M_S;
        Self { left_j: reserve_j, reserve_j }
    }

    /// The energy left, joules; below zero where more was added than the tank held.
    #[must_use]
    pub const fn left_j(&self) -> f64 {
        self.left_j
    }

    /// The energy at the start, joules.
    #[must_use]
    pub const fn reserve_j(&self) -> f64 {
        self.reserve_j
    }

    /// The energy left as a share of that at the start.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.left_j / self.reserve_j
    }

    /// Books the energy that impulses added, joules. A full tank takes in no more: energy that contact dissipated long ago gives no credit.
    pub fn spend(&mut self, work_j: f64) {
        self.left_j = (self.left_j - work_j).min(self.reserve_j);
    }

    /// Lets `dt` seconds pass.
    pub fn refill(&mut self, dt: f64) {
        let missing = self.reserve_j - self.left_j;
        self.left_j += (self.reserve_j.max(missing) * dt / REFILL_S).min(missing);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_tank_takes_in_no_more() {
        let mut tank = Tank::of(2.0); // 0.01 J
        tank.spend(0.004);
        tank.spend(-1.0);
        assert_eq!(tank.left_j(), tank.reserve_j());
    }

    #[test]
    fn an_empty_tank_is_full_after_its_time_and_a_debt_of_any_size_is_forgiven_within_seconds() {
        let mut tank = Tank::of(2.0);
        tank.spend(0.01);
        tank.refill(REFILL_S);
        assert!((tank.share() - 1.0).abs() < 1e-12); // rounding of numbers near 1
        tank.spend(10.0); // a thousand times the reserve
        (0..900).for_each(|_| tank.refill(0.01));
        assert!((tank.share() - 1.0).abs() < 1e-12);
    }
}
