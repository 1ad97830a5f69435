//! What fixed solids gave a body while the impulses of others were still on their way to it.
//!
//! In: what contact with fixed solids gave in each step, and impulses that come late. Out: the part of it that would not have been
//! given, had they come in time. Never here: contacts, ledgers. Theory: docs/theory/coupling.md, eq. 4d.

use super::RigidBody;
use crate::coupling::Impulse;
use crate::{SimSpan, SimTime};
use glam::DVec3;

/// What fixed solids gave, step by step.
#[derive(Default)]
pub(super) struct Borne {
    /// The steps in which they gave something.
    steps: Vec<Blow>,
}

/// What fixed solids gave in one step.
#[derive(Debug, Clone, Copy)]
struct Blow {
    /// The end of the step.
    end: SimTime,
    given: Impulse,
    /// How far that had carried the body by then, kg·m.
    carried: DVec3,
}

/// An impulse that comes later than this is no part of the same blow, seconds.
const FORGET_S: f64 = 1.0;
/// A change of velocity below this is rounding, m/s: contact with fixed solids is solved in single precision.
const CHANGED_M_S: f64 = 1e-6;

impl Borne {
    /// Notes what fixed solids gave in a step, where they gave something.
    fn note(&mut self, blow: Blow) {
        self.steps.retain(|before| blow.end.secs_after(before.end) < FORGET_S);
        if blow.given != Impulse::ZERO {
            self.steps.push(blow);
        }
    }

    /// Takes out what fixed solids gave in place of `late`, an impulse that comes at `now` and has been carrying the body by
    /// `carried` kg·m since it was given: as much of what they gave since then as points its way, and how far that has carried
    /// the body by now.
    pub(super) fn in_place_of(&mut self, late: Impulse, carried: Impulse, now: SimTime) -> [Impulse; 2] {
        // what is given evenly over a time began twice as long ago as it acts in the mean
        let since_s = 2.0 * carried.linear.length() / late.linear.length();
        let recent = |blow: &Blow| now.secs_after(blow.end) < since_s;
        let (mut all, mut way) = (Impulse::ZERO, DVec3::ZERO);
        for blow in self.steps.iter().filter(|blow| recent(blow)) {
            all += blow.given;
            way += blow.carried + blow.given.linear * now.secs_after(blow.end);
        }
        let share = late.linear.dot(all.linear) / all.linear.length_squared();
        if share.is_nan() || share <= 0.0 {
            return [Impulse::ZERO; 2];
        }
        let share = share.min(1.0);
        for blow in self.steps.iter_mut().filter(|blow| recent(blow)) {
            (blow.given, blow.carried) = (blow.given * (1.0 - share), blow.carried * (1.0 - share));
        }
        [all * share, Impulse { linear: way * share, angular: DVec3::ZERO }]
    }

    /// The body moved with others, in a world that they share: what held it up is not known apart.
    pub(super) fn forget(&mut self) {
        self.steps.clear();
    }
}

impl RigidBody {
    /// Notes what fixed solids gave in a step of `dt` that began at `start`: all that neither gravity nor others did, without
    /// what only carried the weight. That they go on to give: others expect it ([`RigidBody::support`]).
    pub(super) fn note_borne(&mut self, start: SimTime, dt: SimSpan) {
        let dt_s = dt.as_secs_f64();
        let fall = self.gravity * dt_s;
        let change = self.motion.velocity - self.begun - self.coupled - fall;
        let weight = (-fall.dot(change) / change.length_squared()).max(0.0);
        let blow = 1.0 - weight;
        let is_blow = self.ties.is_empty() && blow * change.length() > CHANGED_M_S;
        let alone = self.coupled == DVec3::ZERO;
        let free = self.begun_at.0 + (self.begun + fall * 0.5) * dt_s;
        // with others about, when in the step it was given is not known: in the middle
        let way = if alone { self.motion.position - free } else { change * (0.5 * dt_s) };
        let given = Impulse {
            linear: change * self.spread.mass_kg,
            angular: if alone { self.motion.angular - self.begun_at.1 } else { DVec3::ZERO },
        };
        self.borne.note(Blow {
            end: start + dt,
            given: if is_blow { given * blow } else { Impulse::ZERO },
            carried: way * (blow * self.spread.mass_kg),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn up(size: f64) -> Impulse {
        Impulse { linear: DVec3::Z * size, angular: DVec3::X * size }
    }

    /// 3 N·s, given 2 ms before the end of a step at 0.1 s.
    fn landed() -> Borne {
        let mut borne = Borne::default();
        borne.note(Blow { end: at(0.10), given: up(3.0), carried: DVec3::Z * 0.006 });
        borne
    }

    fn at(seconds: f64) -> SimTime {
        SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
    }

    #[test]
    fn fixed_solids_give_back_what_a_late_impulse_would_have_spared_them_and_no_more() {
        let mut borne = landed();
        // it acted 10 ms ago in the mean, the fixed solid 2 ms before the end of its step
        let [given, way] = borne.in_place_of(up(2.0), up(0.02), at(0.10));
        assert!((given.linear.z - 2.0).abs() < 1e-12 && (given.angular.x - 2.0).abs() < 1e-12, "{given:?}");
        assert!((way.linear.z - 0.004).abs() < 1e-12, "{way:?}");
        // what is left has carried it for 5 ms more
        let [given, way] = borne.in_place_of(up(2.0), up(0.02), at(0.105));
        assert!((given.linear.z - 1.0).abs() < 1e-12 && (way.linear.z - 0.007).abs() < 1e-12, "{given:?} {way:?}");
        assert_eq!(borne.in_place_of(up(2.0), up(0.02), at(0.10)), [Impulse::ZERO; 2]);
    }

    #[test]
    fn what_presses_the_other_way_or_acted_later_spares_nothing() {
        let mut borne = landed();
        assert_eq!(borne.in_place_of(up(-2.0), up(-0.02), at(0.10)), [Impulse::ZERO; 2]);
        assert_eq!(borne.in_place_of(up(2.0), up(0.02), at(0.13)), [Impulse::ZERO; 2]);
        assert_eq!(borne.in_place_of(up(2.0), up(0.0), at(0.10)), [Impulse::ZERO; 2]);
        assert_eq!(borne.in_place_of(Impulse::ZERO, Impulse::ZERO, at(0.10)), [Impulse::ZERO; 2]);
    }
}
