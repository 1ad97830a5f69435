//! A row of constraints between two bodies: what it joins, what it asks for, what it gives.
//!
//! In: directions, levers, a law. Out: its velocity, its inverse mass, what its impulse does. Never here: the impulse it needs.

use glam::{DMat3, DVec3};

/// Where a row has no second body.
pub(super) const NOBODY: u32 = u32::MAX;

/// The least inverse mass of a row: a row between nothing.
pub(super) const MOBILITY_MIN: f64 = 1e-12;

/// One scalar constraint: u = lin·(v_a − v_b) + turn_a·ω_a − turn_b·ω_b.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    /// The first body.
    pub a: u32,
    /// The second body, or [`NOBODY`].
    pub b: u32,
    /// Direction of the impulse on `a`.
    pub lin: DVec3,
    /// Lever on `a`.
    pub turn_a: DVec3,
    /// Lever on `b`.
    pub turn_b: DVec3,
    /// What the row asks for.
    pub law: Law,
    /// Velocity added to u before the law is asked, m/s or rad/s.
    pub bias: f64,
    /// Impulse, N·s or N·m·s: the start, and the answer.
    pub lambda: f64,
}

/// What a row asks of its velocity and impulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Law {
    /// u + b = 0.
    Equal,
    /// u + b ≥ 0, λ ≥ 0, one of them zero.
    AtLeast,
    /// u + b = −λ · compliance: a spring and its damper over the step.
    Spring(f64),
    /// As `AtLeast`; the two rows after it are friction with this coefficient.
    Normal(f64),
    /// Friction: u = 0 within the disc, at its edge against u.
    Tangent,
}

/// A body's mass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mass {
    /// Kilograms.
    pub mass_kg: f64,
    /// World axes, kg·m².
    pub inertia: DMat3,
    /// Its inverse.
    pub inverse: DMat3,
}

/// Linear and angular velocity of a body.
pub(super) type Twist = [DVec3; 2];

impl Row {
    /// u, from the twist of each body.
    pub(super) fn velocity_of(&self, twist: impl Fn(u32) -> Twist) -> f64 {
        let [v, w] = twist(self.a);
        let of_a = self.lin.dot(v) + self.turn_a.dot(w);
        if self.b == NOBODY {
            return of_a;
        }
        let [v, w] = twist(self.b);
        of_a - self.lin.dot(v) - self.turn_b.dot(w)
    }

    /// u.
    pub(super) fn velocity(&self, velocities: &[Twist]) -> f64 {
        self.velocity_of(|body| velocities[body as usize])
    }

    /// Whether it acts on this body.
    pub(super) fn joins(&self, body: u32) -> bool {
        self.a == body || self.b == body
    }

    /// The row's own inverse mass.
    pub(super) fn mobility(&self, masses: &[Mass]) -> f64 {
        let of = |body: u32, turn: DVec3| {
            let mass = &masses[body as usize];
            self.lin.length_squared() / mass.mass_kg + turn.dot(mass.inverse * turn)
        };
        of(self.a, self.turn_a) + if self.b == NOBODY { 0.0 } else { of(self.b, self.turn_b) }
    }

    /// Changes velocities by an impulse.
    pub(super) fn push(&self, impulse: f64, masses: &[Mass], velocities: &mut [Twist]) {
        for (body, impulse, turn) in [(self.a, impulse, self.turn_a), (self.b, -impulse, self.turn_b)] {
            if body != NOBODY {
                let (mass, [v, w]) = (&masses[body as usize], &mut velocities[body as usize]);
                *v += self.lin * (impulse / mass.mass_kg);
                *w += mass.inverse * (turn * impulse);
            }
        }
    }

    /// Adds Jᵀ impulse.
    pub(super) fn scatter(&self, impulse: f64, into: &mut [f64]) {
        let mut add = |body: u32, sign: f64, turn: DVec3| {
            let at = 6 * body as usize;
            let (linear, angular) = (self.lin * (sign * impulse), turn * (sign * impulse));
            into[at..at + 6]
                .iter_mut()
                .zip(linear.to_array().into_iter().chain(angular.to_array()))
                .for_each(|(g, part)| *g += part);
        };
        add(self.a, 1.0, self.turn_a);
        if self.b != NOBODY {
            add(self.b, -1.0, self.turn_b);
        }
    }
}
