//! What fixed solids gave a body while the impulses of others were still on their way to it.
//!
//! In: what contact with fixed solids gave in each step, and impulses that come late. Out: the part of it that would not have been
//! given, had they come in time. Never here: contacts, ledgers. Theory: docs/theory/coupling.md, eq. 4d.

use super::RigidBody;
use glam::{DMat3, DVec3};
use metachron_contact::StepContext;
use metachron_contact::beside::may_press;
use metachron_core::rebound::{since_s, spared};
use metachron_core::{AgentId, Body, SimSpan, SimTime};
use metachron_core::{Impulse, Rebound};

/// What fixed solids gave, step by step.
#[derive(Default)]
pub(super) struct Borne {
    /// The steps in which they gave something.
    steps: Vec<Rebound>,
    /// The last step, where they gave something in it.
    newest: Option<Rebound>,
}

/// An impulse that comes later than this is no part of the same blow, seconds.
const FORGET_S: f64 = 1.0;
/// A change of velocity below this is rounding, m/s: contact with fixed solids is solved in single precision.
const CHANGED_M_S: f64 = 1e-6;
/// What is seen within 60° of the way down stands under a body: the cosine.
const UNDER: f64 = 0.5;

impl Borne {
    /// Notes what fixed solids gave in a step, where they gave something.
    fn note(&mut self, rebound: Rebound) {
        self.steps.retain(|before| rebound.end.secs_after(before.end) < FORGET_S);
        self.newest = (rebound.given != Impulse::ZERO).then_some(rebound);
        self.steps.extend(self.newest);
    }

    /// What they gave in the last step.
    pub(super) const fn newest(&self) -> Option<Rebound> {
        self.newest
    }

    /// Takes out what fixed solids gave in place of `late`, an impulse that comes at `now` and has been carrying the body by
    /// `carried` kg·m since it was given, `unread_s` seconds ago at most: as much of what they gave since then as it would have spared a
    /// body of so much `inverse` mass and inertia, and how far that has carried the body by now.
    pub(super) fn in_place_of(
        &mut self,
        [late, carried]: [Impulse; 2],
        (now, unread_s): (SimTime, f64),
        inverse: (f64, DMat3),
    ) -> [Impulse; 2] {
        let since_s = since_s(late, carried).min(unread_s);
        let recent = |step: &Rebound| step.age_s(now) < since_s;
        let (mut all, mut way, mut met_n_s) = (Impulse::ZERO, Impulse::ZERO, 0.0);
        for step in self.steps.iter().filter(|step| recent(step)) {
            met_n_s += step.met_n_s;
            let [given, moved] = step.part(1.0, now);
            (all, way) = (all + given, way + moved);
        }
        let share = spared(late, (all, met_n_s), inverse);
        for step in self.steps.iter_mut().filter(|step| recent(step)) {
            let left = 1.0 - share;
            (step.given, step.carried, step.met_n_s) = (step.given * left, step.carried * left, step.met_n_s * left);
        }
        [all * share, way * share]
    }

    /// The body moved with others, in a world that they share: what held it up is not known apart.
    pub(super) fn forget(&mut self) {
        self.steps.clear();
        self.newest = None;
    }
}

impl RigidBody {
    /// Notes what fixed solids gave in a step of `dt` that begins now: all that neither gravity nor others did, without
    /// what only carried the weight. That they go on to give: others expect it ([`RigidBody::support`]).
    pub(super) fn note_borne(&mut self, around: &StepContext<'_>, dt: SimSpan) {
        let start = around.time;
        let dt_s = dt.as_secs_f64();
        let fall = self.gravity * dt_s;
        let change = self.motion.velocity - self.begun - self.coupled - fall;
        let carries = (-fall.dot(change) / change.length_squared()).max(0.0);
        let blow = if self.steady { 1.0 - carries } else { 1.0 };
        let is_blow = self.ties.is_empty() && blow * change.length() > CHANGED_M_S;
        let alone = self.coupled == DVec3::ZERO;
        let free = self.begun_at.0 + (self.begun + fall * 0.5) * dt_s;
        // with others about, when in the step it was given is not known: in the middle
        let way = if alone { self.motion.position - free } else { change * (0.5 * dt_s) };
        let given = Impulse {
            linear: change * self.spread.mass_kg,
            angular: if alone { self.motion.angular - self.begun_at.1 } else { DVec3::ZERO },
        };
        let given = if is_blow { given * blow } else { Impulse::ZERO };
        let mut rebound = Rebound {
            start,
            end: start + dt,
            given,
            carried: way * (blow * self.spread.mass_kg),
            met_n_s: 0.0,
            past: None,
        };
        let came = self.begun + self.gravity * -rebound.age_s(start);
        let size = given.linear.length();
        rebound.met_n_s = (-came.dot(given.linear.normalize_or_zero()) * self.spread.mass_kg).clamp(0.5 * size, size);
        rebound.past = self.past(around, given.linear);
        self.borne.note(rebound);
    }

    /// Who bends and was nearest to the body where its step began, of those that stood between it and what then gave it an impulse.
    fn past(&self, around: &StepContext<'_>, given: DVec3) -> Option<AgentId> {
        if given == DVec3::ZERO {
            return None;
        }
        let nearer = |a: &DVec3, b: &DVec3| a.length_squared().total_cmp(&b.length_squared());
        let nearest = |points: &[DVec3]| points.iter().map(|point| self.begun_at.0 - *point).min_by(nearer);
        let ways = around.neighbours.iter().filter(|n| may_press(n)).filter_map(|n| match &n.snapshot.body {
            Body::Curve(curve) => Some((n.id, nearest(&curve.positions)?)),
            Body::Soft(soft) => Some((n.id, nearest(&soft.positions)?)),
            _ => None,
        });
        let under = |way: DVec3| way.dot(given) > UNDER * way.length() * given.length();
        ways.filter(|(_, way)| under(*way)).min_by(|a, b| nearer(&a.1, &b.1)).map(|(id, _)| id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn up(size: f64) -> Impulse {
        Impulse { linear: DVec3::Z * size, angular: DVec3::X * size }
    }

    /// 3 N·s that stopped it 2 ms before the end of a step at 0.1 s.
    fn landed() -> Borne {
        let mut borne = Borne::default();
        borne.note(Rebound {
            start: at(0.08),
            end: at(0.10),
            given: up(3.0),
            carried: DVec3::Z * 0.006,
            met_n_s: 3.0,
            past: None,
        });
        borne
    }

    /// 1 kg that nothing turns.
    const MASSES: (f64, DMat3) = (1.0, DMat3::ZERO);

    fn at(seconds: f64) -> SimTime {
        SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap()
    }

    #[test]
    fn fixed_solids_give_back_what_a_late_impulse_would_have_spared_them_and_no_more() {
        let mut borne = landed();
        // it acted 10 ms ago in the mean, the fixed solid 2 ms before the end of its step
        let [given, way] = borne.in_place_of([up(2.0), up(0.02)], (at(0.10), f64::INFINITY), MASSES);
        assert!((given.linear.z - 2.0).abs() < 1e-12 && (given.angular.x - 2.0).abs() < 1e-12, "{given:?}");
        assert!((way.linear.z - 0.004).abs() < 1e-12, "{way:?}");
        // what is left has carried it for 5 ms more
        let [given, way] = borne.in_place_of([up(2.0), up(0.02)], (at(0.105), f64::INFINITY), MASSES);
        assert!((given.linear.z - 1.0).abs() < 1e-12 && (way.linear.z - 0.007).abs() < 1e-12, "{given:?} {way:?}");
        assert_eq!(borne.in_place_of([up(2.0), up(0.02)], (at(0.10), f64::INFINITY), MASSES), [Impulse::ZERO; 2]);
    }

    #[test]
    fn what_presses_the_other_way_or_acted_later_spares_nothing() {
        let mut borne = landed();
        assert_eq!(borne.in_place_of([up(-2.0), up(-0.02)], (at(0.10), f64::INFINITY), MASSES), [Impulse::ZERO; 2]);
        assert_eq!(borne.in_place_of([up(2.0), up(0.02)], (at(0.13), f64::INFINITY), MASSES), [Impulse::ZERO; 2]);
        assert_eq!(borne.in_place_of([up(2.0), up(0.0)], (at(0.10), f64::INFINITY), MASSES), [Impulse::ZERO; 2]);
        assert_eq!(
            borne.in_place_of([Impulse::ZERO, Impulse::ZERO], (at(0.10), f64::INFINITY), MASSES),
            [Impulse::ZERO; 2]
        );
        // the giver's state before it was read a millisecond ago: it was given after the blow
        assert_eq!(borne.in_place_of([up(2.0), up(0.02)], (at(0.10), 1e-3), MASSES), [Impulse::ZERO; 2]);
    }
}
