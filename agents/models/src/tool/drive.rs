//! The drive of a tool: its tip is a mass on a spring to the commanded point, and the spring yields at the force limit of the drive.
//!
//! In: the motion of the commanded point, the impulses that the tip received in contact. Out: the state of the tip, and of the
//! commanded point, which the tip holds back where the drive is not strong enough; the data by which peers predict both. Never here:
//! the path, grasps.
//! Theory: docs/theory/coupling.md, eq. 9d–9f: the god-object of haptics (ZS95), its coupling limited in force.

use glam::{DMat3, DVec3};
use metachron_core::Inertia;
use metachron_core::{Mat6, Sprung};

/// A moving point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PointMotion {
    /// Metres.
    pub position: DVec3,
    /// Metres per second.
    pub velocity: DVec3,
}

impl PointMotion {
    /// How it moves as seen from `other`.
    pub(super) fn relative_to(self, other: Self) -> Self {
        Self { position: self.position - other.position, velocity: self.velocity - other.velocity }
    }
}

/// A step of the drive within a contact cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Driven {
    pub commanded: PointMotion,
    pub tip: PointMotion,
    /// What the drive gave the tip, N·s.
    pub impulse_n_s: DVec3,
}

/// The impulses that the tip received in contact, as forces that go on (eq. 2, 4c), N·s and N·m·s² a metre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ReceivedImpulses {
    /// The new impulse: dJ, and t dJ − dS.
    pub sum: DVec3,
    /// See [`Self::sum`].
    pub carried: DVec3,
    /// The impulse that acts evenly over the step.
    pub lasting: DVec3,
}

/// The drive of one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drive {
    /// Force limit, newtons.
    limit_n: f64,
    /// Vector from the commanded point to the tip, and its rate of change.
    off: DVec3,
    rate: DVec3,
    /// The force, newtons, while the tip holds the commanded point back.
    saturated_force: Option<DVec3>,
    /// The tip's acceleration in the last step without the impulses it received, m/s².
    past: DVec3,
    /// Length of that step, seconds.
    span_s: f64,
}

/// Deflection of the tip at the drive's full force, metres: a tool that pushes with a tenth of it is half a millimetre off.
const GIVE_M: f64 = 5e-3;
/// Frequency of tip and drive, rad/s, critically damped: with [`GIVE_M`] the full force accelerates the tip by 16 g and no more.
const SWING_PER_S: f64 = 180.0;
/// A tip closer than this to the commanded point, in metres and m/s, and without contact forces, counts as having reached it.
const REACHED: f64 = 1e-7;
/// Contact torques do not turn a tool: its inverse inertia is this small, 1/(kg·m²).
const TURNS_PER_KG_M2: f64 = 1e-9;

impl Drive {
    /// A drive with this force limit, newtons, whose tip is at the commanded point.
    pub(super) fn new(limit_n: f64) -> Self {
        let none = DVec3::ZERO;
        Self { limit_n, off: none, rate: none, saturated_force: None, past: none, span_s: 0.0 }
    }

    /// Stiffness, N/m, and damping, N·s/m, as published: a drive at its force limit still resists changes of its velocity
    /// within a step.
    fn spring(&self) -> [f64; 2] {
        let stiffness_n_m = if self.saturated_force.is_some() { 0.0 } else { self.stiffness_n_m() };
        [stiffness_n_m, self.damping_n_s_m()]
    }

    pub(super) fn damping_n_s_m(&self) -> f64 {
        2.0 * SWING_PER_S * self.mass_kg()
    }

    pub(super) fn stiffness_n_m(&self) -> f64 {
        self.limit_n / GIVE_M
    }

    pub(super) fn mass_kg(&self) -> f64 {
        self.stiffness_n_m() / (SWING_PER_S * SWING_PER_S)
    }

    /// Sets the length of the steps to come, seconds.
    pub(super) const fn set_step(&mut self, dt: f64) {
        self.span_s = dt;
    }

    /// Whether the tip is at the commanded point.
    pub(super) fn has_arrived(&self) -> bool {
        self.off == DVec3::ZERO && self.rate == DVec3::ZERO
    }

    /// Advances by `dt` seconds in which the path would move the commanded point `from` … `to`; returns the commanded point and the tip.
    ///
    /// The tip moves like a body on springs (eq. 7d). Where the spring force would exceed the limit, it equals the limit and the
    /// commanded point stays that far from the tip (eq. 9f).
    pub(super) fn advance(
        &mut self,
        [from, to]: [PointMotion; 2],
        given: &ReceivedImpulses,
        dt: f64,
    ) -> [PointMotion; 2] {
        let [k, c] = self.spring();
        let known = (self.mass_kg() + self.span_s * (c + self.span_s * k)).recip();
        self.off += given.carried * known;
        self.rate += given.sum * known;
        self.span_s = dt;
        let idle = self.off.length() < REACHED && self.rate.length() < REACHED && *given == ReceivedImpulses::default();
        if idle {
            (self.off, self.rate, self.past, self.saturated_force) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, None);
            return [to, to];
        }
        let led =
            self.pull(to, given.lasting, dt).unwrap_or_else(|force| self.saturate(from, force, given.lasting, dt));
        [led, self.tip(led)]
    }

    /// How the tip moves against the commanded point, m/s.
    pub(super) fn rate(&self) -> DVec3 {
        self.rate
    }

    /// Whether it gives all that it can.
    pub(super) fn is_saturated(&self) -> bool {
        self.saturated_force.is_some()
    }

    /// Ends a step of `h` seconds in which the commanded point moved with `led` to `to`, and the tip with the velocity `moved` that the
    /// drive gave it together with all that touched it (clusters.md, eq. 14). Where the drive gave all that it can, the commanded
    /// point stays as far from the tip as that stretches its spring (eq. 9f).
    pub(super) fn follow(&mut self, to: PointMotion, [led, moved]: [DVec3; 2], h: f64) -> Driven {
        let (k, c) = (self.stiffness_n_m(), self.damping_n_s_m());
        let rate = moved - led;
        let asked = -(self.off * k + rate * (h * k + c));
        let force = asked.clamp_length_max(self.limit_n);
        self.off += rate * h;
        self.rate = rate;
        let impulse_n_s = force * h;
        if self.off.length() < REACHED && rate.length() < REACHED {
            (self.off, self.rate) = (DVec3::ZERO, DVec3::ZERO);
        }
        if asked.length() <= self.limit_n {
            self.saturated_force = None;
            return Driven { commanded: to, tip: self.tip(to), impulse_n_s };
        }
        let tip = to.position + self.off;
        (self.off, self.rate, self.saturated_force) = (-force / k, DVec3::ZERO, Some(force));
        let commanded = PointMotion { position: tip - self.off, velocity: moved };
        Driven { commanded, tip: self.tip(commanded), impulse_n_s }
    }

    /// The tip, for this commanded point.
    fn tip(&self, commanded: PointMotion) -> PointMotion {
        PointMotion { position: commanded.position + self.off, velocity: commanded.velocity + self.rate }
    }

    /// Moves the tip by the spring while the commanded point follows the path; the mean force needed, clamped to the limit, as an error
    /// where it is too much.
    fn pull(&mut self, to: PointMotion, lasting: DVec3, dt: f64) -> Result<PointMotion, DVec3> {
        let (m, k, c) = (self.mass_kg(), self.stiffness_n_m(), self.damping_n_s_m());
        let yields = (m + dt * (c + dt * k)).recip();
        let pull = -(self.off + self.rate * dt) * k - self.rate * c;
        let change = (pull * dt + lasting) * yields;
        let force = (change * m - lasting) / dt;
        if force.length() > self.limit_n {
            return Err(force.clamp_length_max(self.limit_n));
        }
        self.off += self.rate * dt + change * (0.5 * dt);
        self.rate += change;
        (self.past, self.saturated_force) = ((change - lasting * yields) / dt, None);
        Ok(to)
    }

    /// The drive gives its full `force`; the commanded point is at the distance from the tip that this force stretches the spring to.
    fn saturate(&mut self, from: PointMotion, force: DVec3, lasting: DVec3, dt: f64) -> PointMotion {
        let yields = (self.mass_kg() + dt * self.damping_n_s_m()).recip();
        let change = (force * dt + lasting) * yields;
        let PointMotion { position, velocity } = self.tip(from);
        let tip = position + velocity * dt + change * (0.5 * dt);
        (self.off, self.rate) = (-force / self.stiffness_n_m(), DVec3::ZERO);
        (self.past, self.saturated_force) = (force * yields, Some(force));
        PointMotion { position: tip - self.off, velocity: velocity + change }
    }

    /// The tip's response to impulses apart from its spring.
    pub(super) fn inertia(&self) -> Inertia {
        Inertia::Rigid {
            inverse_mass: self.mass_kg().recip(),
            inverse_inertia: DMat3::from_diagonal(DVec3::splat(TURNS_PER_KG_M2)),
        }
    }

    /// The data by which peers predict the tip, whose commanded point moves on with `velocity` (eq. 7b, 7c).
    pub(super) fn sprung(&self, velocity: DVec3) -> Sprung {
        let [k, c] = self.spring();
        let all_ways = |x: f64| {
            let mut six = Mat6::ZERO;
            six.add_point(DVec3::ZERO, DMat3::from_diagonal(DVec3::splat(x)));
            six
        };
        let force = self.saturated_force.unwrap_or(self.off * -k - self.rate * c);
        Sprung {
            force: [force, DVec3::ZERO],
            rising: [velocity * k, DVec3::ZERO],
            stiffness: all_ways(k),
            damping: all_ways(c),
            past: [self.past, DVec3::ZERO],
            span_s: self.span_s,
            limit_n: self.limit_n,
        }
    }
}
