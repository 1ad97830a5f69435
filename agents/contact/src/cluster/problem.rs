//! One frictional contact problem over several bodies, as plain data.
//!
//! In: what members, contacts and joints are at the start of a step. Out: the same with names. Never here: search for contacts,
//! state between steps, the solve. Theory: `docs/theory/clusters.md`, section 2.

use super::side::Side;
use crate::contact::push_out_m_s;
use glam::{DMat3, DVec3};

/// The share of the slip owed that one step takes back.
const SLIP_SHARE: f64 = 0.2;
/// A contact sticks while its friction is below this share of the most that Coulomb allows.
const STICK_SHARE: f64 = 0.999;

/// A 3 × 3 block of a member's matrix, in or below its diagonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// The row of blocks.
    pub row: usize,
    /// The column of blocks, at most `row`.
    pub column: usize,
    /// Its numbers; two entries with one place add up.
    pub value: DMat3,
}

/// A body that takes part: how it answers impulses, and how it would move without any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member<'a> {
    /// The lower half of A = M + h C + h² S: symmetric and positive definite; kg, or kg m² for spins.
    pub blocks: &'a [Block],
    /// The velocity v̂ of each block without the impulses sought: m/s, or 1/s for spins.
    pub free: &'a [DVec3],
    /// How much of its own step an impulse moves it by, in fine steps: f ≥ 1 where its step is longer than h, else 1.
    pub share: f64,
}

/// A place where two sides may touch. Velocities are those of side 0 against side 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// What the place is called from step to step; the solver only hands it on.
    pub key: u64,
    /// The two points; one at least must move.
    pub sides: [Side; 2],
    /// From side 1 to side 0, of length 1.
    pub normal: DVec3,
    /// Two directions that make a right-handed frame with the normal, of length 1.
    pub tangents: [DVec3; 2],
    /// The distance along the normal, metres; a depth is negative.
    pub gap_m: f64,
    /// Coulomb's coefficient μ ≥ 0.
    pub friction: f64,
    /// The way that a sticking contact has crept and owes back (eq. 13), world axes, metres.
    pub owed_slip_m: DVec3,
    /// The impulse of the last step, world axes, N·s; zero where there is none.
    pub warm_n_s: DVec3,
}

/// A joint, an attachment or a drive: three equations without a cone. Velocities are those of side 0 against side 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BilateralRow {
    /// What the row is called from step to step; the solver only hands it on.
    pub key: u64,
    /// The two points; one at least must move.
    pub sides: [Side; 2],
    /// The velocity that the row asks for, world axes, m/s.
    pub target_m_s: DVec3,
    /// The velocity by which the row gives way for each N·s, 1/kg, > 0; `None` for the compliance of contacts (eq. 5).
    pub compliance_per_kg: Option<f64>,
    /// The most impulse that it gives, N·s, ≥ 0; `None` for as much as it takes.
    pub limit_n_s: Option<f64>,
    /// The impulse of the last step, world axes, N·s; zero where there is none.
    pub warm_n_s: DVec3,
}

/// A spring with a damper between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Stiffness k, N/m, ≥ 0.
    pub stiffness_n_m: f64,
    /// Damping c, N s/m, ≥ 0; one of both above zero.
    pub damping_n_s_m: f64,
    /// From the point of side 1 to that of side 0, less the rest length, world axes, metres.
    pub stretch_m: DVec3,
}

/// All that touch or are joined, at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Problem<'a> {
    /// The step h, seconds, > 0.
    pub h_s: f64,
    /// The bodies.
    pub members: &'a [Member<'a>],
    /// Where they may touch.
    pub contacts: &'a [Contact],
    /// Where they are joined.
    pub rows: &'a [BilateralRow],
}

impl Contact {
    /// The frame as a matrix of columns: normal, then the two tangents.
    #[must_use]
    pub fn frame(&self) -> DMat3 {
        DMat3::from_cols(self.normal, self.tangents[0], self.tangents[1])
    }

    /// What the gap and the slip owed add to the velocity, in the frame (eq. 2, 3).
    #[must_use]
    pub fn bias_m_s(&self, h_s: f64) -> DVec3 {
        let normal = if self.gap_m >= 0.0 { self.gap_m / h_s } else { push_out_m_s(self.gap_m, h_s) };
        let owed = self.owed_slip_m * (SLIP_SHARE / h_s);
        DVec3::new(normal, self.tangents[0].dot(owed), self.tangents[1].dot(owed))
    }

    /// The slip owed after a step that gave `impulse_n_s` and left the sides `velocity_m_s` against each other (eq. 13).
    #[must_use]
    pub fn owed_slip_after(&self, impulse_n_s: DVec3, velocity_m_s: DVec3, h_s: f64) -> DVec3 {
        let along = impulse_n_s.dot(self.normal);
        let friction = (impulse_n_s - self.normal * along).length();
        if along > 0.0 && friction < STICK_SHARE * self.friction * along {
            let slip = velocity_m_s - self.normal * velocity_m_s.dot(self.normal);
            self.owed_slip_m + slip * h_s
        } else {
            DVec3::ZERO
        }
    }
}

impl BilateralRow {
    /// The same row as a spring that is implicit at both ends (eq. 14).
    #[must_use]
    pub fn with_spring(self, spring: Spring, h_s: f64) -> Self {
        let Spring { stiffness_n_m: k, damping_n_s_m: c, stretch_m } = spring;
        let compliance = 1.0 / (h_s * h_s * k + h_s * c);
        Self { compliance_per_kg: Some(compliance), target_m_s: stretch_m * (-h_s * k * compliance), ..self }
    }
}
