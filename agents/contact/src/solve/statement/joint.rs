//! A row of a joint: up to three equations between two sides, with bounds of the impulse that keeps them.
//!
//! In: sides, directions, bounds. Out: the same with names. Never here: which rows make up a joint of a model, its state.
//! Theory: `docs/theory/clusters.md`, section 2.

use super::side::Side;
use crate::push_out::push_out_m_s;
use crate::solve::cones::cone::STICK_SHARE;
use glam::{DMat3, DVec3};

/// The directions in which a row holds, and the impulses by which it may.
///
/// Of sides that are points, impulses are N·s and velocities m/s; of sides that are spins, N·m·s and 1/s.
/// A point held in all directions is a spherical joint; with a turn held across an axis, a hinge; a turn held in all directions and
/// a point across an axis are a slide; a point and a turn held in all directions are one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// In all three.
    All {
        /// The most that it gives, ≥ 0; infinite for as much as it takes.
        limit_n_s: f64,
    },
    /// In the two across an axis, which itself is free.
    Across {
        /// The axis, of length 1, world axes.
        axis: DVec3,
        /// The most that it gives, ≥ 0; infinite for as much as it takes.
        limit_n_s: f64,
    },
    /// Along an axis alone: a rod, a motor; with one bound at zero a stop, a rope, a ratchet.
    Along {
        /// The axis, of length 1, world axes.
        axis: DVec3,
        /// The least impulse along the axis on side 0, ≤ 0, infinite for as much as it takes.
        low_n_s: f64,
        /// The most, ≥ 0, likewise.
        high_n_s: f64,
    },
}

/// A row of a joint, of an attachment, a stop or a drive. Velocities are those of side 0 against side 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRow {
    /// The two points, or spins; one at least must move.
    pub sides: [Side; 2],
    /// In which directions, and how strongly.
    pub hold: Hold,
    /// The velocity that the row asks for, world axes, m/s or 1/s; a part in none of its directions has no meaning.
    pub target_m_s: DVec3,
    /// The velocity by which the row gives way for each unit of impulse, 1/kg or 1/(kg m²), > 0; `None` for that of contacts (eq. 5).
    pub compliance_per_kg: Option<f64>,
    /// The impulse of the last step, world axes; zero where there is none.
    pub warm_n_s: DVec3,
    /// The way beyond its target that it has crept while it held, and owes back (eq. 13), world axes, metres or radians.
    pub owed_slip_m: DVec3,
    /// The most that it gives along an axis, as the velocity by which that moves its sides where nothing else holds them, m/s, ≥ 0; infinite for
    /// as much as it takes. Bounds of its own count as well.
    pub limit_m_s: f64,
    /// The contact whose pressure bounds its impulse, where there is one; bounds of its own count as well.
    pub pressed: Option<Pressed>,
}

/// A contact by whose pressure the impulse of a row is bounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressed {
    /// The contact, by its place in the problem.
    pub contact: usize,
    /// The row gives at most this times the contact's impulse along its normal, either way, ≥ 0: metres where it turns.
    pub reach_m: f64,
}

/// A spring with a damper between two points, or two spins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Stiffness k, N/m or N m, ≥ 0.
    pub stiffness_n_m: f64,
    /// Damping c, N s/m or N m s, ≥ 0; one of both above zero.
    pub damping_n_s_m: f64,
    /// From side 1 to side 0, less the rest length, world axes, metres or radians.
    pub stretch_m: DVec3,
}

impl Hold {
    /// All impulses in all three directions.
    pub const ALL: Self = Self::All { limit_n_s: f64::INFINITY };

    /// All impulses across an axis.
    #[must_use]
    pub fn across(axis: DVec3) -> Self {
        Self::Across { axis, limit_n_s: f64::INFINITY }
    }

    /// All impulses along an axis.
    #[must_use]
    pub fn along(axis: DVec3) -> Self {
        Self::Along { axis, low_n_s: f64::NEG_INFINITY, high_n_s: f64::INFINITY }
    }

    /// Impulses that push side 0 along an axis, never back: a stop, or a rope whose axis leads from side 0 to side 1.
    #[must_use]
    pub fn pushing(axis: DVec3) -> Self {
        Self::Along { axis, low_n_s: 0.0, high_n_s: f64::INFINITY }
    }

    /// A motor about or along an axis that gives at most this impulse in a step: its effort times h.
    #[must_use]
    pub fn motor(axis: DVec3, limit_n_s: f64) -> Self {
        Self::Along { axis, low_n_s: -limit_n_s, high_n_s: limit_n_s }
    }

    /// The same with impulses of at most `limit_n_s`, in whatever direction it holds.
    #[must_use]
    pub fn limited(self, limit_n_s: f64) -> Self {
        match self {
            Self::All { limit_n_s: own } => Self::All { limit_n_s: own.min(limit_n_s) },
            Self::Across { axis, limit_n_s: own } => Self::Across { axis, limit_n_s: own.min(limit_n_s) },
            Self::Along { axis, low_n_s, high_n_s } => {
                Self::Along { axis, low_n_s: low_n_s.max(-limit_n_s), high_n_s: high_n_s.min(limit_n_s) }
            }
        }
    }

    /// The most that it gives in the direction of an impulse, N·s; infinite for as much as it takes.
    #[must_use]
    pub fn most_n_s(&self, impulse_n_s: DVec3) -> f64 {
        match *self {
            Self::All { limit_n_s } | Self::Across { limit_n_s, .. } => limit_n_s,
            Self::Along { axis, low_n_s, high_n_s } => {
                if impulse_n_s.dot(axis) < 0.0 {
                    -low_n_s
                } else {
                    high_n_s
                }
            }
        }
    }

    /// The part of a velocity in the directions in which it holds.
    #[must_use]
    pub fn held_part(&self, velocity_m_s: DVec3) -> DVec3 {
        match *self {
            Self::All { .. } => velocity_m_s,
            Self::Across { axis, .. } => velocity_m_s - axis * velocity_m_s.dot(axis),
            Self::Along { axis, .. } => axis * velocity_m_s.dot(axis),
        }
    }

    /// Orthonormal columns, the axis first.
    pub(crate) fn frame(&self) -> DMat3 {
        match *self {
            Self::All { .. } => DMat3::IDENTITY,
            Self::Across { axis, .. } | Self::Along { axis, .. } => {
                let side = axis.any_orthonormal_vector();
                DMat3::from_cols(axis, side, axis.cross(side))
            }
        }
    }

    /// 1 for each direction of the frame in which the row holds, else 0.
    pub(crate) fn held(&self) -> DVec3 {
        match self {
            Self::All { .. } => DVec3::ONE,
            Self::Across { .. } => DVec3::new(0.0, 1.0, 1.0),
            Self::Along { .. } => DVec3::X,
        }
    }
}

impl JointRow {
    /// A row at rest, with the compliance of contacts and no impulse of a last step.
    #[must_use]
    pub fn new(sides: [Side; 2], hold: Hold) -> Self {
        let (target_m_s, warm_n_s, owed_slip_m) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let limit_m_s = f64::INFINITY;
        Self { sides, hold, target_m_s, compliance_per_kg: None, warm_n_s, owed_slip_m, limit_m_s, pressed: None }
    }

    /// The same row as a spring that is implicit at both ends (eq. 14).
    #[must_use]
    pub fn with_spring(self, spring: Spring, h_s: f64) -> Self {
        let Spring { stiffness_n_m: k, damping_n_s_m: c, stretch_m } = spring;
        let compliance = 1.0 / (h_s * h_s * k + h_s * c);
        Self { compliance_per_kg: Some(compliance), target_m_s: stretch_m * (-h_s * k * compliance), ..self }
    }

    /// The same row with the way left to a stop, or the slack of a rope, along the axis of [`Hold::pushing`]: a gap may
    /// close within the step, and a way past the stop is taken back as of a contact (eq. 2).
    #[must_use]
    pub fn with_gap(self, gap_m: f64, h_s: f64) -> Self {
        let opening = if gap_m >= 0.0 { -gap_m / h_s } else { -push_out_m_s(gap_m, h_s) };
        let axis = self.hold.frame().x_axis;
        Self { target_m_s: axis * opening, ..self }
    }

    /// The way owed after a step that gave `impulse_n_s` and left the sides `velocity_m_s` against each other, `most_n_s` being the most that
    /// the row could give (eq. 13).
    #[must_use]
    pub fn owed_slip_after(&self, impulse_n_s: DVec3, velocity_m_s: DVec3, most_n_s: f64, h_s: f64) -> DVec3 {
        let holds = impulse_n_s.length() < STICK_SHARE * most_n_s;
        if holds { self.owed_slip_m + self.hold.held_part(velocity_m_s - self.target_m_s) * h_s } else { DVec3::ZERO }
    }
}
