//! The bound of a row's impulse, as a second-order cone, and the place of a row on its way through it.
//!
//! In: the law of a row, impulses and velocities in its frame. Out: points of the cone, gains, steps. Never here: other rows, matrices.
//! Theory: `docs/theory/clusters.md`, eq. C1–C5.

use super::rows::{Point, Row};
use crate::solve::cones::cone::{Law, outer};
use crate::solve::cones::lorentz::{Lorentz, Scaling};
use glam::{DMat3, DVec3};

/// How an impulse λ lies in a second-order cone: l = (h·λ + l₀, T λ + l̄).
///
/// Of Coulomb's cone the head is the radius of its disc, of one bound the way left to it, of two bounds or a ball half of the room
/// between, which no impulse changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chart {
    head: DVec3,
    /// The diagonal of T.
    tail: DVec3,
    at: Lorentz,
}

/// The bound of a row's impulse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum Bound {
    /// It gives nothing.
    #[default]
    Idle,
    /// It gives as much as it takes.
    Free,
    Cone(Chart),
}

/// A row on its way.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Inside {
    pub bound: Bound,
    /// The compliance that it began with: under load it is harder, never softer.
    pub compliance: f64,
    /// The impulse that it began with.
    pub impulse: DVec3,
    /// ŷ: y = h ŷ₀ + T ŷ̄ is the velocity that the law allows.
    pub dual: Lorentz,
    scaling: Scaling,
    /// G of eq. C2.
    pub gain: DMat3,
    /// c of eq. C5 in the cone.
    target: Lorentz,
    /// The steps of l and ŷ.
    pub primal_step: Lorentz,
    pub dual_step: Lorentz,
    /// s of a contact.
    shift: f64,
}

impl Chart {
    /// The direction in the cone of an impulse's change.
    pub fn along(&self, impulse: DVec3) -> Lorentz {
        Lorentz::new(self.head.dot(impulse), self.tail * impulse)
    }

    /// l of an impulse.
    pub fn point(&self, impulse: DVec3) -> Lorentz {
        self.at.plus(self.along(impulse), 1.0)
    }

    /// The velocity that a dual point is.
    fn velocity(&self, dual: Lorentz) -> DVec3 {
        self.head * dual.head + self.tail * dual.tail
    }

    /// (R + d P d)⁻¹ of eq. C2 without any difference of large numbers: P is large along the edge on which points lie, and small across.
    fn gain(&self, scaling: &Scaling, compliance: f64) -> DMat3 {
        let Scaling { t, w, .. } = *scaling;
        let (slope, along) = (w.tail.length(), w.tail.normalize_or_zero());
        let steep = t * (1.0 + 2.0 * slope * slope);
        let across = (DMat3::from_diagonal(self.tail) - outer(along, along)) * (compliance + t).recip();
        let length = self.head.length();
        if length == 0.0 {
            return across + outer(along, along) * (compliance + steep).recip();
        }
        let normal = self.head / length;
        let of_head = compliance / (length * length);
        let det = of_head * compliance + steep * (compliance + of_head) + t * t;
        let both = outer(normal, along) + outer(along, normal);
        across + outer(normal, normal) * ((compliance + steep) / (det * length * length))
            - both * (2.0 * t * w.head * slope / (det * length))
            + outer(along, along) * ((of_head + steep) / det)
    }

    /// The step of ŷ by that of the velocity that it is; where no impulse changes the head, by the step of l.
    pub fn dual_step(&self, velocity: DVec3, inside: &Inside) -> Lorentz {
        let tail = self.tail * velocity;
        let length = self.head.length();
        if length > 0.0 {
            return Lorentz::new(self.head.dot(velocity) / (length * length), tail);
        }
        let Scaling { t, w, .. } = inside.scaling;
        Lorentz::new(inside.target.head - 2.0 * t * w.head * w.tail.dot(inside.primal_step.tail), tail)
    }
}

impl Bound {
    fn of(row: &Row) -> Self {
        let cone = |head, tail, at| Self::Cone(Chart { head, tail, at });
        match row.law {
            Law::Idle => Self::Idle,
            Law::Coulomb { friction } if friction > 0.0 => {
                cone(DVec3::X * friction, DVec3::new(0.0, 1.0, 1.0), Lorentz::default())
            }
            Law::Coulomb { .. } => cone(DVec3::X, DVec3::ZERO, Lorentz::default()),
            Law::Bounded { limit: 0.0 } => Self::Idle,
            Law::Bounded { limit } if limit.is_finite() => {
                cone(DVec3::ZERO, row.held, Lorentz::new(limit, DVec3::ZERO))
            }
            Law::Bounded { .. } => Self::Free,
            Law::Between { low, high } if low == high => Self::Idle,
            Law::Between { low, high } => match (low.is_finite(), high.is_finite()) {
                (true, true) => {
                    let middle = Lorentz::new(0.5 * (high - low), DVec3::X * (-0.5 * (high + low)));
                    cone(DVec3::ZERO, DVec3::X, middle)
                }
                (true, false) => cone(DVec3::X, DVec3::ZERO, Lorentz::new(-low, DVec3::ZERO)),
                (false, true) => cone(DVec3::NEG_X, DVec3::ZERO, Lorentz::new(high, DVec3::ZERO)),
                (false, false) => Self::Free,
            },
        }
    }
}

impl Inside {
    pub fn of(row: &Row) -> Self {
        Self { compliance: row.compliance, ..Self::default() }
    }

    /// Pushes an impulse and its dual point about `by_m_s` into their cones.
    pub fn enter(&mut self, row: &Row, at: Point, by_m_s: f64) {
        (self.bound, self.impulse, self.shift) = (Bound::of(row), at.impulse, row.shift(at));
        let Bound::Cone(chart) = self.bound else { return };
        let velocity = at.velocity + at.impulse * row.compliance + DVec3::X * self.shift;
        let by_n_s = by_m_s / row.scale;
        let (point, length) = (chart.point(at.impulse), chart.head.length());
        if length > 0.0 {
            let short = (point.tail.length() - point.head).max(0.0) / length;
            self.impulse += chart.head * ((short + by_n_s) / length);
            let tail = chart.tail * velocity;
            let head = chart.head.dot(velocity) / (length * length);
            self.dual = Lorentz::new(head.max(tail.length()) + by_m_s / length, tail);
        } else {
            // a row that is not at its bound leaves no velocity
            let asked = at.impulse - velocity / row.scale;
            let tail = chart.tail * (row.law.project(asked).value - asked) * row.scale;
            let size = point.tail.length();
            let most = size.min(point.head - by_n_s.min(0.5 * point.head));
            if size > most {
                self.impulse += chart.tail * point.tail * (most / size - 1.0);
            }
            let room = point.head - most;
            self.dual = Lorentz::new(tail.length() + by_m_s * (by_n_s / room).min(1.0), tail);
        }
    }

    /// Takes up bounds that have moved; returns by how much the impulse has to change with them.
    pub fn follow(&mut self, row: &Row) -> f64 {
        let before = std::mem::replace(&mut self.bound, Bound::of(row));
        match (before, self.bound) {
            (Bound::Cone(before), Bound::Cone(now)) if before.at.head != now.at.head => now.at.head / before.at.head,
            _ => 1.0,
        }
    }

    /// Lets the shift of a contact follow its slip; returns the power that this adds, λ_n |Δs|.
    pub fn shift(&mut self, row: &Row, at: Point) -> f64 {
        let before = std::mem::replace(&mut self.shift, row.shift(at));
        at.impulse.x.abs() * (self.shift - before).abs()
    }

    /// Finds scaling and gain; returns l·ŷ.
    pub fn scale(&mut self, row: &Row, impulse: DVec3) -> f64 {
        let Bound::Cone(chart) = self.bound else {
            let free = self.bound == Bound::Free;
            self.gain = if free { DMat3::from_diagonal(row.held / row.compliance) } else { DMat3::ZERO };
            return 0.0;
        };
        let point = chart.point(impulse);
        self.scaling = Scaling::of(point, self.dual);
        self.gain = chart.gain(&self.scaling, row.compliance);
        point.dot(self.dual)
    }

    /// The predictor's target: the edge.
    pub fn aim_at_the_edge(&mut self) {
        self.target = Lorentz::default().plus(self.dual, -1.0);
    }

    /// The corrector's: a point with l·ŷ = `centre_j`, less the second-order term of the predictor's steps.
    pub fn aim_inside(&mut self, impulse: DVec3, centre_j: f64) {
        let Bound::Cone(chart) = self.bound else { return };
        let more = self.scaling.second_order(self.primal_step, self.dual_step);
        let centre = chart.point(impulse).inverse();
        let target = Lorentz::default().plus(centre, centre_j).plus(self.dual, -1.0);
        self.target = if more.is_finite() { target.plus(more, -1.0) } else { target };
    }

    /// r_p of eq. C3.
    pub fn off(&self, row: &Row, at: Point) -> DVec3 {
        let yielding = at.velocity + at.impulse * row.compliance;
        match self.bound {
            Bound::Idle => DVec3::ZERO,
            Bound::Free => yielding * row.held,
            Bound::Cone(chart) => yielding + DVec3::X * self.shift - chart.velocity(self.dual),
        }
    }

    /// c − r_p.
    pub fn missing(&self, row: &Row, at: Point) -> DVec3 {
        let target = if let Bound::Cone(chart) = self.bound { chart.velocity(self.target) } else { DVec3::ZERO };
        target - self.off(row, at)
    }

    /// Goes a share of the dual point's step.
    pub fn advance(&mut self, share: f64) {
        self.dual = self.dual.plus(self.dual_step, share);
    }
}
