//! What fixed solids gave a rigid body within one step, as those must know it who expect the body at an earlier time, or who
//! have given it something since that would have spared it.
//!
//! In: the body's own account. Out: how much of it falls away. Never here: contacts. Theory: docs/theory/coupling.md, eq. 4d, 5a.

use super::ledger::Impulse;
use crate::{AgentId, SimTime};
use glam::{DMat3, DVec3};

/// What fixed solids gave in one step, as if at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rebound {
    /// When the step began.
    pub start: SimTime,
    /// When it ended.
    pub end: SimTime,
    /// Their impulse.
    pub given: Impulse,
    /// How far it had carried the body by the end, kg·m.
    pub carried: DVec3,
    /// The momentum with which the body came, N·s: between half of what was given, where it bounced without loss, and all.
    pub met_n_s: f64,
    /// Who bends and stood between the body and them when the step began.
    pub past: Option<AgentId>,
}

impl Rebound {
    /// How far it has carried the body by `at`, kg·m; before it was given, how much too far the way back from the end leads.
    #[must_use]
    pub fn way(&self, at: SimTime) -> DVec3 {
        self.carried + self.given.linear * at.secs_after(self.end)
    }

    /// Seconds from the moment at which it was given to `at`.
    #[must_use]
    pub fn age_s(&self, at: SimTime) -> f64 {
        at.secs_after(self.end) + self.carried.length() / self.given.linear.length().max(f64::MIN_POSITIVE)
    }

    /// The share of it that `late` would have spared a body of so much inverse mass and inertia, which is on its way to it and has carried
    /// it so far by `at`.
    #[must_use]
    pub fn spared_by(&self, [late, carried]: [Impulse; 2], at: SimTime, inverse: (f64, DMat3)) -> f64 {
        // what the body had read when it began is in its state
        let since_s = since_s(late, carried).min(at.secs_after(self.start));
        let is_earlier = self.age_s(at) < since_s;
        if is_earlier { spared(late, (self.given, self.met_n_s), inverse) } else { 0.0 }
    }

    /// A share of it: the impulse, and the way at `at`, kg·m and kg·m².
    #[must_use]
    pub fn part(&self, share: f64, at: SimTime) -> [Impulse; 2] {
        let way = Impulse { linear: self.way(at), angular: self.given.angular * self.age_s(at) };
        [self.given * share, way * share]
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.given.linear.is_finite() && self.given.angular.is_finite() && self.carried.is_finite()
    }
}

/// How long ago an impulse began to act that has carried a body so far: evenly over a time, twice as long as in the mean.
pub fn since_s(late: Impulse, carried: Impulse) -> f64 {
    2.0 * carried.linear.length() / late.linear.length()
}

/// The share of what was `given` that `late` would have spared: what slows the body where it was struck takes from the momentum with
/// which it came, and with that all that it bounced by.
pub fn spared(late: Impulse, (given, met_n_s): (Impulse, f64), (mass, inertia): (f64, DMat3)) -> f64 {
    let at_blow = |by: Impulse| given.linear.dot(by.linear * mass) + given.angular.dot(inertia * by.angular);
    let share = at_blow(late) * given.linear.length() / (at_blow(given) * met_n_s);
    if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SimSpan;

    fn up(size: f64) -> Impulse {
        Impulse { linear: DVec3::Z * size, angular: DVec3::X * size }
    }

    fn at(seconds: f64) -> SimTime {
        SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
    }

    /// 3 N·s, 20 ms before the end of a step at 0.1 s; half of it stopped the body.
    const BLOW: fn() -> Rebound = || Rebound {
        start: at(0.05),
        end: at(0.1),
        given: up(3.0),
        carried: DVec3::Z * 0.06,
        met_n_s: 1.5,
        past: None,
    };

    /// 1 kg that nothing turns.
    const MASSES: (f64, DMat3) = (1.0, DMat3::ZERO);

    fn carried(way: f64) -> Impulse {
        Impulse { linear: DVec3::Z * way, angular: DVec3::ZERO }
    }

    #[test]
    fn what_was_given_before_a_bounce_spares_as_much_of_it() {
        // 1 N·s, 30 ms ago in the mean: two thirds of the momentum with which it came
        let share = BLOW().spared_by([up(1.0), carried(0.03)], at(0.09), MASSES);
        assert!((share - 2.0 / 3.0).abs() < 1e-12, "{share}");
        let [given, way] = BLOW().part(share, at(0.09));
        assert!((given.linear.z - 2.0).abs() < 1e-12 && (way.linear.z - 0.02).abs() < 1e-12, "{given:?} {way:?}");
    }

    #[test]
    fn what_was_given_after_a_bounce_or_against_it_spares_nothing() {
        for late in [[up(1.0), carried(0.002)], [up(-1.0), carried(-0.03)], [Impulse::ZERO; 2]] {
            assert_eq!(BLOW().spared_by(late, at(0.09), MASSES), 0.0, "{late:?}");
        }
        // whatever it has carried, none of it is older than the step in which it was not known
        let late = Rebound { start: at(0.085), ..BLOW() };
        assert_eq!(late.spared_by([up(1.0), carried(0.03)], at(0.09), MASSES), 0.0);
    }

    #[test]
    fn the_way_back_from_a_bounce_leads_behind_what_it_bounced_on() {
        assert!((BLOW().way(at(0.07)).z + 0.03).abs() < 1e-12);
        assert!((BLOW().age_s(at(0.07)) + 0.01).abs() < 1e-12);
    }

    #[test]
    fn what_presses_the_place_that_was_struck_further_down_spares_nothing() {
        // a rod of 1 kg from −1 to 1 m, struck at one end, lifted elsewhere
        let masses = (1.0, DMat3::from_diagonal(DVec3::splat(3.0)));
        let given = |x: f64| Impulse { angular: DVec3::X * x, ..up(1.0) };
        let blow_at = |x: f64| Rebound { given: given(x), carried: DVec3::Z * 0.02, met_n_s: 1.0, ..BLOW() };
        let lift = |x: f64| [Impulse { angular: DVec3::X * (0.5 * x), ..up(0.5) }, carried(0.015)];
        let share = |x: f64| blow_at(-1.0).spared_by(lift(x), at(0.09), masses);
        // at x it moves that end by 1 − 3 x, of 4 for as much there
        assert!((share(-1.0) - 0.5).abs() < 1e-12 && (share(0.0) - 0.125).abs() < 1e-12, "{}", share(0.0));
        assert_eq!(share(0.5), 0.0);
    }
}
