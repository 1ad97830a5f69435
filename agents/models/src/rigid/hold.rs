//! A body that springs on led points hold while another agent owns contact with it: how it goes on, and what it says of that.
//!
//! In: what owners give, as forces that go on. Out: the body's motion after a step that others could foresee, and what they need
//! for it ([`Sprung`]). Never here: how springs are solved ([`crate::rigid::linear_spring`]), bodies that nothing holds.
//! Theory: docs/theory/coupling.md, eq. 4c and 7b–7d.

use super::RigidBody;
use super::linear_spring::{PartLoads, SpringResult, spring_state};
use super::motion::VelocityStep;
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::Law;
use metachron_contact::StepContext;
use metachron_core::{Impulse, InverseMass, Mat6, Sprung, Twist};

/// What such a body keeps from step to step.
#[derive(Default)]
pub(super) struct Hold {
    /// What it published last, and (M + h C + h² K)⁻¹ of it.
    known: Option<(Sprung, Mat6)>,
    /// The force and torque of what owners go on giving in this step, N and N·m.
    lasting: Twist,
    /// What they gave before did to its velocities at the step's start, m/s and rad/s.
    bent: Twist,
    /// Its acceleration in this step without them, m/s² and rad/s².
    past: Twist,
}

impl Hold {
    /// Whether others expect the body to move as its springs pull.
    pub(super) fn is_known(&self) -> bool {
        self.known.is_some()
    }

    /// What others need to know of it.
    pub(super) fn published(&self) -> Option<Sprung> {
        self.known.map(|(sprung, _)| sprung)
    }

    /// Nothing holds it any more.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// What acts over a part of `h` seconds beside gravity and springs.
    pub(super) fn under(&self, h: f64, gravity: DVec3) -> PartLoads {
        let span_s = self.known.map_or(0.0, |(sprung, _)| sprung.span_s);
        let received = VelocityStep { change: self.bent, span_s };
        PartLoads { h, gravity, lasting: self.lasting.map(|force| force * h), received }
    }

    /// Notes what springs, gravity and what lasts added to the velocities in `h` seconds, and what the last of these did.
    pub(super) fn note(&mut self, SpringResult { change, lasting, .. }: &SpringResult, h: f64) {
        self.past = [0, 1].map(|i| (change[i] - lasting[i]) / h);
    }
}

impl RigidBody {
    /// Takes what owners gave, as forces that go on over the `dt` seconds of the step; what they gave before acts at once as
    /// they expect it to (eq. 3, 4 with the answer of eq. 7b).
    pub(super) fn follow(&mut self, around: &StepContext<'_>, dt: f64) {
        let Some((_, answer)) = self.hold.known else { return };
        let (mut sum, mut carried, mut lasting) = (Impulse::ZERO, Impulse::ZERO, Impulse::ZERO);
        self.company.exchange.follow(around, dt, |_, [new, way, on]| {
            (sum, carried, lasting) = (sum + new, carried + way, lasting + on);
        });
        self.hold.lasting = [lasting.linear / dt, lasting.angular / dt];
        self.hold.bent = [DVec3::ZERO; 2];
        if sum == Impulse::ZERO && carried == Impulse::ZERO {
            return;
        }
        let change = answer.times([sum.linear, sum.angular]);
        let [way, turn] = answer.times([carried.linear, carried.angular]);
        self.hold.bent = change;
        self.motion.velocity += change[0];
        self.motion.angular += self.motion.inertia_times(&self.spread, change[1]);
        let turn = self.motion.inertia_times(&self.spread, turn);
        self.shift(Impulse { linear: way * self.spread.mass_kg, angular: turn });
        self.world.moved();
    }

    /// A whole step of `h` seconds under springs that others foresee: the velocity changes evenly, the way is that of its mean.
    pub(super) fn lean(&mut self, h: f64) -> Result<(), &'static str> {
        let before = (self.motion.velocity, self.motion.spin(&self.spread));
        self.pull(h)?;
        let pulled = (self.motion.velocity, self.motion.angular);
        let spin = self.motion.spin(&self.spread);
        self.advance(h, DVec3::ZERO)?;
        if (self.motion.velocity, self.motion.angular) == pulled {
            self.motion.position -= (pulled.0 - before.0) * (0.5 * h);
            let turn = DQuat::from_scaled_axis((spin - before.1) * (-0.5 * h));
            self.motion.rotation = (turn * self.motion.rotation).normalize();
            self.world.moved();
        }
        Ok(())
    }

    /// Ends a step of `dt` seconds: others who own contact with the body learn how springs hold it, where only led ones do and
    /// nothing fixed carries it.
    pub(super) fn tell(&mut self, around: &StepContext<'_>, dt: f64) {
        let owned = |n: &metachron_contact::Neighbour| n.form.is_some() && !n.owned && n.law == Law::Cluster;
        let seen = around.neighbours.iter().any(owned);
        if !seen || self.touching || self.ties.is_empty() || self.ties.all.iter().any(|tie| tie.yields != DMat3::ZERO) {
            return self.hold.forget();
        }
        self.ties.update_targets(&self.company);
        let sprung = spring_state(&self.motion, &self.spread, &self.ties.all, self.gravity);
        let sprung = Sprung { past: self.hold.past, span_s: dt, ..sprung };
        let (linear_per_kg, angular_per_kg_m2) = self.motion.inverse_inertia(&self.spread);
        let answer = sprung.response(InverseMass { linear_per_kg, angular_per_kg_m2 }, dt);
        self.hold.known = Some((sprung, answer));
    }
}
