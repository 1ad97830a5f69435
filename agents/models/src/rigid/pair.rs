//! What a body remembers of each agent that it touches: since when, and the energy that their coupling may still add.
//!
//! In: what each solve did. Out: who is bonded, how fast push-out may be, what bounces have to pay back. Never here: impulses.
//!
//! The tank counts what the coupling added on both sides: the work of each impulse against the mean of the relative velocity
//! before and after it, and, where the other side turned out to move differently from what was expected while impulses were
//! on their way, their work on that difference. What contact takes fills it up to what it held at the start, push-out and wrong
//! guesses empty it.

use glam::DVec3;
use metachron_contact::tank::{RESERVE_M_S, Tank};
use metachron_core::AgentId;
use metachron_core::Impulse;

/// All pairs that have touched lately.
#[derive(Default)]
pub(super) struct Pairs(Vec<Pair>);

/// A body and one other agent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// The other.
    pub with: AgentId,
    /// How long the two have pressed on each other, short breaks counted, seconds.
    pub lasting_s: f64,
    /// Whether they touch in this step.
    pub touched: bool,
    /// Whether they press on each other in this step.
    pub pressed: bool,
    /// Whether the other is a rigid body that could share a world with this one.
    pub rigid: bool,
    /// The energy that their coupling may still add.
    pub tank: Tank,
    /// How the other was expected to move at the end of the step, m/s and rad/s.
    expected: Option<[DVec3; 2]>,
    loose_s: f64,
    idle_s: f64,
}

/// The share of the reserve that push-out may always spend.
const PUSH_OUT_LEAST: f64 = 1.0 / 16.0;
/// Contact that has lasted this long may share one clock, seconds. Ten times as heavy a load on a slow body sinks 5 mm until
/// then, 12 mm in twice that (measured); a passing blow takes no time.
const BOND_S: f64 = 0.05;
/// Bodies that do not press on each other for this long have parted, seconds: a state seen late makes contact stutter.
const BREAK_S: f64 = 0.05;
/// A pair that has not touched for this long is forgotten, seconds.
const FORGET_S: f64 = 2.0;

impl Pairs {
    /// The memory of the pair with `with`; a new one for a pair whose reduced mass is `mass_kg`.
    pub(super) fn of(&mut self, with: AgentId, mass_kg: f64) -> &mut Pair {
        let at = self.0.iter().position(|pair| pair.with == with).unwrap_or_else(|| {
            self.0.push(Pair::new(with, Tank::of(mass_kg)));
            self.0.len() - 1
        });
        &mut self.0[at]
    }

    /// The memory of a pair that has touched.
    pub(super) fn get(&mut self, with: AgentId) -> Option<&mut Pair> {
        self.0.iter_mut().find(|pair| pair.with == with)
    }

    /// Begins a step.
    pub(super) fn open(&mut self) {
        self.0.iter_mut().for_each(|pair| (pair.touched, pair.pressed) = (false, false));
    }

    /// Ends a step of `dt` seconds.
    pub(super) fn close(&mut self, dt: f64) {
        for pair in &mut self.0 {
            pair.loose_s = if pair.pressed { 0.0 } else { pair.loose_s + dt };
            pair.lasting_s = if pair.loose_s < BREAK_S { pair.lasting_s + dt } else { 0.0 };
            pair.tank.refill(dt);
            pair.idle_s = if pair.touched { 0.0 } else { pair.idle_s + dt };
        }
        self.0.retain(|pair| pair.idle_s < FORGET_S);
    }

    /// Rigid bodies whose contact has lasted.
    pub(super) fn bonds(&self) -> impl Iterator<Item = AgentId> + '_ {
        self.0.iter().filter(|pair| pair.rigid && pair.lasting_s > BOND_S).map(|pair| pair.with)
    }

    /// Who was touched in the last step.
    pub(super) fn touched(&self) -> impl Iterator<Item = AgentId> + '_ {
        self.0.iter().filter(|pair| pair.touched).map(|pair| pair.with)
    }
}

impl Pair {
    const fn new(with: AgentId, tank: Tank) -> Self {
        Self {
            with,
            lasting_s: 0.0,
            touched: false,
            pressed: false,
            rigid: false,
            tank,
            expected: None,
            loose_s: BREAK_S,
            idle_s: 0.0,
        }
    }

    /// The two press on each other and something else holds one of them up: that lasts, and their world is shared from now on.
    pub(super) fn bond(&mut self) {
        if self.pressed {
            self.lasting_s = self.lasting_s.max(BOND_S);
        }
    }

    /// The two will press on each other in a moment, and that will last.
    pub(super) fn expect_contact(&mut self) {
        (self.rigid, self.pressed) = (true, true);
        self.bond();
    }

    /// What a bounce has to pay back, joules: what has been spent beyond half the reserve.
    pub(super) fn owed_j(&self) -> f64 {
        (0.5 * self.tank.reserve_j() - self.tank.left_j()).max(0.0)
    }

    /// The fastest push-out that the tank can pay, m/s: √(2 E/μ). An empty one still pays for a little, for without any
    /// push-out bodies that lie on each other would sink for good.
    pub(super) fn push_out_m_s(&self) -> f64 {
        RESERVE_M_S * self.tank.share().clamp(PUSH_OUT_LEAST, 1.0).sqrt()
    }

    /// How the other should move when the next step begins.
    pub(super) fn expect(&mut self, velocities: &[DVec3]) {
        self.expected = if let [velocity, spin] = *velocities { Some([velocity, spin]) } else { None };
    }

    /// Books the work of what is still on its way on the difference between how the other moves and what was expected.
    ///
    /// What it has taken meanwhile it took before it moved on: whatever it met then is no error of this coupling.
    pub(super) fn correct(&mut self, velocities: &[DVec3], on_their_way: Impulse) {
        let Some([velocity, spin]) = self.expected.take() else { return };
        if let [now, now_spin] = *velocities {
            self.tank.spend(on_their_way.linear.dot(now - velocity) + on_their_way.angular.dot(now_spin - spin));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_push_out_is_as_fast_as_its_tank_can_pay() {
        let mut pairs = Pairs::default();
        let pair = pairs.of(AgentId(1), 2.0); // 0.01 J
        pair.tank.spend(-1.0);
        for (spent_j, left_j) in [(0.0, 0.01), (0.0051, 0.0049), (0.0040, 0.0009), (1.0, 0.01 / 16.0)] {
            pair.tank.spend(spent_j);
            let energy_j = 0.5 * 2.0 * pair.push_out_m_s().powi(2);
            assert!((energy_j - left_j).abs() < 1e-12, "{energy_j} J of {left_j} J"); // rounding of numbers near 1
        }
        pair.tank.spend(-2.0);
        assert!((pair.push_out_m_s() - RESERVE_M_S).abs() < 1e-12, "what was given back is there again");
    }

    #[test]
    fn a_wrong_guess_counts_only_for_what_was_still_on_its_way() {
        let mut pairs = Pairs::default();
        let pair = pairs.of(AgentId(1), 2.0);
        let full = pair.tank.left_j();
        pair.expect(&[DVec3::X, DVec3::ZERO]);
        pair.correct(&[DVec3::X * 3.0, DVec3::ZERO], Impulse::ZERO);
        assert_eq!(pair.tank.left_j(), full, "it has bounced off a wall since");
        pair.expect(&[DVec3::X, DVec3::ZERO]);
        pair.correct(&[DVec3::X * 1.5, DVec3::ZERO], Impulse { linear: DVec3::X * 0.01, angular: DVec3::ZERO });
        assert!((pair.tank.left_j() - (full - 0.005)).abs() < 1e-15); // a few roundings of 0.01
    }

    #[test]
    fn a_bond_needs_contact_that_presses_and_outlives_a_stutter() {
        let mut pairs = Pairs::default();
        let mut step = |pressed| {
            pairs.open();
            let pair = pairs.of(AgentId(4), 1.0);
            (pair.rigid, pair.touched, pair.pressed) = (true, true, pressed);
            pairs.close(0.02);
            pairs.bonds().count()
        };
        assert_eq!([true, false, true, true].map(&mut step), [0, 0, 1, 1], "0.06 s with a stutter");
        assert_eq!([false, false, false, true].map(&mut step), [1, 1, 0, 0], "0.06 s apart");
    }
}
