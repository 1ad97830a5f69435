//! The rows of a contact problem: Jacobian, free velocities, laws, scales and compliances of all contacts and rows of joints.
//!
//! In: a problem. Out: products with J and Jᵀ, and the data that each row needs for its law, in its own frame (x along
//! the normal).
//! Never here: matrices of members, impulses. Theory: `docs/theory/clusters.md`, eq. 1–6.

use crate::solve::cones::cone::{Law, Projection, tangential};
use crate::solve::statement::joint::{Hold, JointRow, Pressed};
use crate::solve::statement::problem::{Contact, Problem, SLIP_SHARE};
use crate::solve::statement::side::{Side, SidePart};
use glam::{DMat3, DVec3};
use std::ops::Range;

/// The least and the most compliance of a contact, in shares of its scale (eq. 5).
const COMPLIANCE_MIN: f64 = 1e-7;
const COMPLIANCE_MAX: f64 = 1e-3;
/// A compliance gives way by up to this many times the wanted velocity before it is made harder.
const HARDEN_PAST: f64 = 2.0;
/// The least scale, 1/kg: a row between parts that cannot move has none, and gets no impulse.
const SCALE_MIN: f64 = 1e-12;

/// The share of one block in the velocity of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    /// The block, counted over all members.
    pub block: usize,
    /// From the block's velocity to the row's frame.
    pub map: DMat3,
}

/// One contact or row of a joint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub law: Law,
    /// Columns in world axes.
    pub frame: DMat3,
    /// 1 for each axis that the law is about; along the others nothing is given or seen.
    pub held: DVec3,
    /// The terms that gap, slip owed, rebound or target add to the velocity.
    pub bias: DVec3,
    /// The velocity of a surface beyond that of its blocks, taken from the velocity.
    surface: DVec3,
    /// b of eq. 1: velocity without impulses, bias included.
    pub free: DVec3,
    /// w of eq. 6, 1/kg.
    pub scale: f64,
    /// R of eq. 5, 1/kg.
    pub compliance: f64,
    /// The most that it gives along its axis, as the velocity by which that moves its sides alone.
    limit_m_s: f64,
    /// A compliance that is given and does not follow the load.
    given: Option<f64>,
    start: usize,
    end: usize,
}

/// An impulse of a row, and its velocity with all impulses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub impulse: DVec3,
    pub velocity: DVec3,
}

/// All rows, contacts first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    pub rows: Vec<Row>,
    /// How many of them are contacts.
    pub contacts: usize,
    terms: Vec<Term>,
    /// Rows that are bounded by the pressure of a contact.
    pressed: Vec<PressedRow>,
}

/// A row that gives at most a multiple of the pressure of a contact.
#[derive(Debug, Clone, Copy)]
struct PressedRow {
    row: usize,
    contact: usize,
    reach_m: f64,
    /// The bounds of its own.
    low: f64,
    high: f64,
}

impl Row {
    fn new(law: Law, frame: DMat3, bias: DVec3) -> Self {
        Self {
            law,
            frame,
            held: DVec3::ONE,
            bias,
            surface: DVec3::ZERO,
            free: DVec3::ZERO,
            scale: 0.0,
            compliance: 0.0,
            limit_m_s: f64::INFINITY,
            given: None,
            start: 0,
            end: 0,
        }
    }

    fn of_contact(contact: &Contact, problem: &Problem<'_>) -> Self {
        let frame = contact.frame();
        let surface = frame.transpose() * contact.surface_m_s;
        let law = Law::Coulomb { friction: contact.friction };
        Self { surface, ..Self::new(law, frame, contact.bias_m_s(problem.h_s)) }
    }

    fn of_joint(joint: &JointRow, h_s: f64) -> Self {
        let (frame, held) = (joint.hold.frame(), joint.hold.held());
        let law = match joint.hold {
            Hold::All { limit_n_s } | Hold::Across { limit_n_s, .. } => Law::Bounded { limit: limit_n_s },
            Hold::Along { low_n_s, high_n_s, .. } => Law::Between { low: low_n_s, high: high_n_s },
        };
        let owed = joint.owed_slip_m * (SLIP_SHARE / h_s);
        let bias = frame.transpose() * (owed - joint.target_m_s) * held;
        Self { held, limit_m_s: joint.limit_m_s, given: joint.compliance_per_kg, ..Self::new(law, frame, bias) }
    }

    /// P(z) of eq. 7 at an iterate; where it gives the impulse back, the law holds.
    #[inline]
    pub fn natural_map(&self, at: Point) -> Projection {
        self.law.project(at.impulse - (at.velocity + at.impulse * self.compliance) / self.scale)
    }

    /// s = μ |ũ_t| of a contact, which makes its law one of complementarity of cones (SF98); zero of all else.
    pub fn shift(&self, at: Point) -> f64 {
        match self.law {
            Law::Coulomb { friction } => friction * tangential(at.velocity + at.impulse * self.compliance),
            _ => 0.0,
        }
    }

    /// By how much s changes with ũ.
    pub fn shift_by(&self, at: Point, velocity: DVec3) -> f64 {
        match self.law {
            Law::Coulomb { friction } => {
                let slip = (at.velocity + at.impulse * self.compliance).with_x(0.0);
                friction * slip.normalize_or_zero().dot(velocity)
            }
            _ => 0.0,
        }
    }

    /// By how much the law is missed at an iterate with this image under P, m/s (eq. 9).
    pub fn miss(&self, impulse: DVec3, image: DVec3) -> f64 {
        self.scale * (impulse - image).abs().max_element()
    }

    /// The compliance that gives way by `yield_m_s` under a load (eq. 5).
    pub fn compliance_under(&self, load_n_s: f64, yield_m_s: f64) -> f64 {
        let (least, most) = (COMPLIANCE_MIN * self.scale, COMPLIANCE_MAX * self.scale);
        self.given.unwrap_or_else(|| (yield_m_s / load_n_s).clamp(least, most))
    }

    /// The compliance, made harder where it gives way too far under an impulse.
    pub fn hardened(&self, impulse: DVec3, yield_m_s: f64) -> f64 {
        let load = impulse.length();
        if self.given.is_none() && self.compliance * load > HARDEN_PAST * yield_m_s {
            self.compliance_under(load, yield_m_s)
        } else {
            self.compliance
        }
    }
}

impl Rows {
    /// Takes up the rows of a problem whose member i has its first block at `offsets[i]`, and the velocities without impulses.
    pub fn gather(&mut self, problem: &Problem<'_>, offsets: &[usize], free: &[DVec3]) {
        self.rows.clear();
        self.terms.clear();
        self.pressed.clear();
        self.contacts = problem.contacts.len();
        for contact in problem.contacts {
            self.push(Row::of_contact(contact, problem), &contact.sides, offsets);
        }
        for joint in problem.rows {
            let row = Row::of_joint(joint, problem.h_s);
            if let (Some(Pressed { contact, reach_m }), Law::Between { low, high }) = (joint.pressed, row.law) {
                self.pressed.push(PressedRow { row: self.rows.len(), contact, reach_m, low, high });
            }
            self.push(row, &joint.sides, offsets);
        }
        for k in 0..self.rows.len() {
            let moving = self.velocity(k, free) - self.rows[k].surface;
            self.rows[k].free = self.rows[k].bias + moving;
        }
    }

    /// Appends a row; of two terms with one block the sum.
    fn push(&mut self, row: Row, sides: &[Side; 2], offsets: &[usize]) {
        let start = self.terms.len();
        let to_frame = DMat3::from_diagonal(row.held) * row.frame.transpose();
        for (side, sign) in sides.iter().zip([1.0, -1.0]) {
            for SidePart { member, terms } in side.parts() {
                for term in terms {
                    let (block, map) = (offsets[member] + term.block, to_frame * term.map * sign);
                    match self.terms[start..].iter_mut().find(|t| t.block == block) {
                        Some(known) => known.map += map,
                        None => self.terms.push(Term { block, map }),
                    }
                }
            }
        }
        self.rows.push(Row { start, end: self.terms.len(), ..row });
    }

    /// Bounds rows by the pressure of their contacts in these impulses, and by their own bounds.
    pub fn press(&mut self, impulses: &[DVec3]) {
        for &PressedRow { row, contact, reach_m, low, high } in &self.pressed {
            // one that nothing answers is idle
            if let Law::Between { low: least, high: most } = &mut self.rows[row].law {
                let pressed = reach_m * impulses[contact].x.max(0.0);
                (*least, *most) = (low.max(-pressed), high.min(pressed));
            }
        }
    }

    /// Sets the scale of a row from the trace of its block of W; one that nothing answers is idle.
    pub fn set_scale(&mut self, row: usize, trace: f64) {
        let row = &mut self.rows[row];
        let scale = trace / row.held.element_sum();
        // also where it is not a number
        let moves = scale > SCALE_MIN;
        row.scale = if moves { scale } else { 1.0 };
        row.law = match row.law {
            _ if !moves => Law::Idle,
            Law::Between { low, high } => {
                let most = row.limit_m_s / scale;
                Law::Between { low: low.max(-most), high: high.min(most) }
            }
            law => law,
        };
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// The blocks that move a row.
    pub fn terms(&self, row: usize) -> &[Term] {
        &self.terms[self.rows[row].start..self.rows[row].end]
    }

    /// The terms of all rows, and which of them are a row's.
    pub fn all_terms(&self) -> &[Term] {
        &self.terms
    }

    pub fn range(&self, row: usize) -> Range<usize> {
        self.rows[row].start..self.rows[row].end
    }

    /// One row of J x.
    pub fn velocity(&self, row: usize, x: &[DVec3]) -> DVec3 {
        self.terms(row).iter().map(|term| term.map * x[term.block]).sum()
    }

    /// J x.
    pub fn velocities(&self, x: &[DVec3], out: &mut [DVec3]) {
        out.iter_mut().enumerate().for_each(|(row, out)| *out = self.velocity(row, x));
    }

    /// Jᵀ λ.
    pub fn scatter(&self, impulses: &[DVec3], out: &mut [DVec3]) {
        out.fill(DVec3::ZERO);
        for (row, impulse) in impulses.iter().enumerate().filter(|(_, impulse)| **impulse != DVec3::ZERO) {
            self.add_impulse(row, *impulse, out);
        }
    }

    /// out ← out + Jᵀ λ of one row.
    pub fn add_impulse(&self, row: usize, impulse: DVec3, out: &mut [DVec3]) {
        for term in self.terms(row) {
            out[term.block] += term.map.mul_transpose_vec3(impulse);
        }
    }
}
