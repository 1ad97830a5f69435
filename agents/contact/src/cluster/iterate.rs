//! The iterate that both ways to a solution share, and the linear step that both take.
//!
//! In: rows and matrices of a problem. Out: impulses, velocities, and steps of them. Never here: when to stop, how far to step.
//! Theory: `docs/theory/clusters.md`, eq. 8.

use super::cone::Projection;
use super::rows::{Point, Rows};
use super::system::System;
use glam::{DMat3, DVec3};

/// Impulses λ of all rows, the change of velocity of all blocks, and the velocity u of all rows.
#[derive(Debug, Clone, Default)]
pub(super) struct State {
    pub lambda: Vec<DVec3>,
    pub change: Vec<DVec3>,
    pub velocity: Vec<DVec3>,
}

/// A problem on its way to a solution.
#[derive(Debug, Clone, Default)]
pub(super) struct Iterate {
    pub rows: Rows,
    pub system: System,
    pub state: State,
    /// The step that [`Self::step`] found.
    pub step: State,
    /// G of each row.
    pub gains: Vec<DMat3>,
    /// λ + c of each row: the impulse it would have if no velocity changed.
    pub pull: Vec<DVec3>,
    /// Factors so far.
    pub factors: usize,
    /// Whether the structure of the matrix is that of these rows.
    coupled: bool,
    scratch: Vec<DVec3>,
}

/// Impulses and compliances to which an iterate can go back.
#[derive(Debug, Clone)]
pub(super) struct Kept {
    lambda: Vec<DVec3>,
    compliances: Vec<f64>,
}

/// The quadratic part of eq. 10 along the step d.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadratic {
    /// Δvᵀ A d.
    pub cross: f64,
    /// dᵀ A d.
    pub curve: f64,
}

impl State {
    fn resize(&mut self, rows: usize, blocks: usize) {
        for (list, size) in [(&mut self.lambda, rows), (&mut self.velocity, rows), (&mut self.change, blocks)] {
            list.clear();
            list.resize(size, DVec3::ZERO);
        }
    }

    /// A row's impulse and velocity.
    pub fn point(&self, row: usize) -> Point {
        Point { impulse: self.lambda[row], velocity: self.velocity[row] }
    }
}

impl Iterate {
    /// Starts anew for the rows as they are, from rest.
    pub fn reset(&mut self, blocks: usize) {
        let rows = self.rows.len();
        self.state.resize(rows, blocks);
        self.step.resize(rows, blocks);
        self.gains.clear();
        self.gains.resize(rows, DMat3::ZERO);
        self.pull.clear();
        self.pull.resize(rows, DVec3::ZERO);
        self.scratch.clear();
        self.scratch.resize(blocks, DVec3::ZERO);
        self.factors = 0;
        self.coupled = false;
    }

    /// Velocities as the impulses make them: exact momentum.
    pub fn respond(&mut self) {
        self.rows.scatter(&self.state.lambda, &mut self.state.change);
        self.system.respond(&mut self.state.change);
        self.update_velocities();
    }

    /// What [`Self::restore`] goes back to.
    pub fn keep(&self) -> Kept {
        let compliances = self.rows.rows.iter().map(|row| row.compliance).collect();
        Kept { lambda: self.state.lambda.clone(), compliances }
    }

    /// Goes back to impulses and compliances as they were.
    pub fn restore(&mut self, kept: &Kept) {
        self.state.lambda.clone_from(&kept.lambda);
        self.restore_compliances(kept);
        self.respond();
    }

    /// Goes back to compliances as they were, and stays where it is.
    pub fn restore_compliances(&mut self, kept: &Kept) {
        self.rows.rows.iter_mut().zip(&kept.compliances).for_each(|(row, compliance)| row.compliance = *compliance);
    }

    /// u = b + J Δv.
    pub fn update_velocities(&mut self) {
        self.rows.velocities(&self.state.change, &mut self.state.velocity);
        self.state.velocity.iter_mut().zip(&self.rows.rows).for_each(|(u, row)| *u += row.free);
    }

    /// The gain and the pull of a row, from its image under a projection at `scale` (eq. 8).
    pub fn linearise(&mut self, row: usize, image: &Projection, scale: f64) {
        let yielding = self.rows.rows[row].compliance / scale;
        let slopes = image.slopes;
        // (I − D (1 − R/w))⁻¹ along each axis of the slope D
        let factor = (DVec3::ONE - slopes + slopes * yielding).recip();
        let lambda = self.state.lambda[row];
        self.gains[row] = image.along_axes(slopes * factor / scale);
        let missing = image.axes.mul_transpose_vec3(image.value - lambda);
        self.pull[row] = lambda + image.axes * (missing * factor);
    }

    /// The step of eq. 8 from gains and pulls; `false` where there is none.
    pub fn take_step(&mut self) -> bool {
        let Self { rows, system, state, step, scratch, .. } = self;
        if !self.coupled {
            system.couple(rows);
            self.coupled = true;
        }
        self.factors += 1;
        if !system.factor(rows, &self.gains) {
            return false;
        }
        rows.scatter(&self.pull, &mut step.change);
        system.multiply(&state.change, scratch);
        step.change.iter_mut().zip(&*scratch).for_each(|(right, av)| *right -= *av);
        system.solve(&mut step.change);
        rows.velocities(&step.change, &mut step.velocity);
        for row in 0..rows.len() {
            step.lambda[row] = self.pull[row] - self.gains[row] * step.velocity[row] - state.lambda[row];
        }
        step.change.iter().all(|v| v.is_finite())
    }

    /// The energy of the members along the step; Δvᵀ A Δv is the same everywhere and left out.
    pub fn quadratic(&mut self) -> Quadratic {
        let Self { system, state, step, scratch, .. } = self;
        system.multiply(&step.change, scratch);
        let against = |list: &[DVec3]| list.iter().zip(&*scratch).map(|(x, ad)| x.dot(*ad)).sum();
        Quadratic { cross: against(&state.change), curve: against(&step.change) }
    }

    /// Goes a share of the step.
    pub fn advance(&mut self, share: f64) {
        let Self { state, step, .. } = self;
        let lists = [
            (&mut state.lambda, &step.lambda),
            (&mut state.change, &step.change),
            (&mut state.velocity, &step.velocity),
        ];
        for (list, by) in lists {
            list.iter_mut().zip(by).for_each(|(value, by)| *value += *by * share);
        }
    }
}
