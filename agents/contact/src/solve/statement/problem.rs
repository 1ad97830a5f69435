//! One frictional contact problem over several bodies, as plain data.
//!
//! In: members and contacts at the start of a step. Out: the same with names. Never here: joints (`joint.rs`), search for
//! contacts, state between steps, the solve. Theory: `docs/theory/clusters.md`, section 2.

use super::joint::JointRow;
use super::side::Side;
use crate::push_out::push_out_m_s;
use crate::solve::cones::cone::STICK_SHARE;
use glam::{DMat3, DVec3};
use metachron_core::ParallelFor;
use std::fmt;

/// The share of the slip owed that one step takes back.
pub(crate) const SLIP_SHARE: f64 = 0.2;

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

/// out ← A x of a symmetric matrix of which these blocks are the lower half. Blocks of one row in a row are summed at once.
pub fn multiply(blocks: &[Block], x: &[DVec3], out: &mut [DVec3]) {
    out.fill(DVec3::ZERO);
    for row in blocks.chunk_by(|a, b| a.row == b.row) {
        let at = row[0].row;
        let (here, mut sum) = (x[at], DVec3::ZERO);
        for Block { column, value, .. } in row {
            sum += *value * x[*column];
            if *column != at {
                out[*column] += value.mul_transpose_vec3(here);
            }
        }
        out[at] += sum;
    }
}

/// A factor of a member's own, which it has made for its step already.
pub trait Response: fmt::Debug + Sync {
    /// Replaces impulses on all blocks of the member by the velocities that they give: A⁻¹ of them, to rounding, by the A of its
    /// blocks.
    fn respond(&self, impulses: &mut [DVec3]);
}

/// A body that takes part: how it answers impulses, and how it would move without any.
#[derive(Debug, Clone, Copy)]
pub struct Member<'a> {
    /// The lower half of A = M + h C + h² S: symmetric and positive definite; kg, or kg m² for spins.
    pub blocks: &'a [Block],
    /// The velocity v̂ of each block without the impulses sought: m/s, or 1/s for spins. None of a body that is led.
    pub free: &'a [DVec3],
    /// The momentum that those velocities do not answer yet, A (v − v̂) of the velocity v that the body would have: kg m/s. Empty for none;
    /// it is answered together with the contacts.
    pub unanswered: &'a [DVec3],
    /// Its velocities when the step began, near which gradients look for the answer first; empty where nothing is known.
    pub now: &'a [DVec3],
    /// How much of its own step an impulse moves it by, in fine steps: f ≥ 1 where its step is longer than h, else 1.
    pub share: f64,
    /// The factor of A that it lends; `None` to have A factored here. A lent factor is taken for positive definite.
    pub response: Option<&'a dyn Response>,
}

/// A place where two sides may touch. Velocities are those of side 0 against side 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The two points; one at least must move.
    pub sides: [Side; 2],
    /// From side 1 to side 0, of length 1.
    pub normal: DVec3,
    /// Two directions that make a right-handed frame with the normal, of length 1.
    pub tangents: [DVec3; 2],
    /// The distance along the normal, metres; a depth is negative.
    pub gap_m: f64,
    /// The overlap that counts as apart, metres, ≥ 0: bodies that began inside each other are held where they are, and pushed out
    /// by a row of its own (eq. 2a).
    pub overlap_m: f64,
    /// Coulomb's coefficient μ ≥ 0.
    pub friction: f64,
    /// The speed at which the sides must part at least, m/s, ≥ 0: of an impact the speed that its restitution asks for
    /// (eq. 3b), else 0.
    pub parting_m_s: f64,
    /// The velocity of side 1's surface beyond that of its blocks, as of a conveyor or of a solid that is led along a path, world axes,
    /// m/s.
    pub surface_m_s: DVec3,
    /// The way that a sticking contact has crept and owes back (eq. 13), world axes, metres.
    pub owed_slip_m: DVec3,
    /// The impulse of the last step, world axes, N·s; zero where there is none.
    pub warm_n_s: DVec3,
    /// The load that its compliance is for where that is more, N·s (eq. 5): the most that it has carried lately; 0 for a new contact.
    pub load_n_s: f64,
}

/// All that touch or are joined, at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The step h, seconds, > 0.
    pub h_s: f64,
    /// The bodies.
    pub members: &'a [Member<'a>],
    /// Where they may touch.
    pub contacts: &'a [Contact],
    /// Where they are joined.
    pub rows: &'a [JointRow],
    /// The threads that make large factors: the answer has the same bits by however many.
    pub threads: &'a dyn ParallelFor,
}

impl Contact {
    /// The frame as a matrix of columns: normal, then the two tangents.
    #[must_use]
    pub fn frame(&self) -> DMat3 {
        DMat3::from_cols(self.normal, self.tangents[0], self.tangents[1])
    }

    /// The terms that the gap, the slip owed and a rebound add to the velocity, in the frame (eq. 2, 3, 3b).
    #[must_use]
    pub fn bias_m_s(&self, h_s: f64) -> DVec3 {
        let gap_m = self.gap_m + self.overlap_m;
        let normal = if gap_m >= 0.0 { gap_m / h_s } else { push_out_m_s(gap_m, h_s) };
        let owed = self.owed_slip_m * (SLIP_SHARE / h_s);
        DVec3::new(normal - self.parting_m_s, self.tangents[0].dot(owed), self.tangents[1].dot(owed))
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
