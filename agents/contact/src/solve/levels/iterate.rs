//! The iterate that all levels of a solution share, and the linear step that they take.
//!
//! In: rows and matrices of a problem. Out: impulses, velocities, steps of them, and the momentum left where equations were not
//! solved to their end. Never here: when to stop, how far to step.
//! Theory: `docs/theory/clusters.md`, eq. 8 and 15–17.

use crate::lists::{refill, reset};
use crate::solve::cones::cone::Projection;
use crate::solve::equations::gradients::{Stiffness, Task};
use crate::solve::equations::rows::{Point, Rows};
use crate::solve::equations::skew::{Followed, Skew, follow_pressure, follow_slip};
use crate::solve::equations::system::{StepForm, System};
use crate::solve::statement::problem::Member;
use glam::{DMat3, DVec3};
use metachron_core::ParallelFor;

/// Impulses λ of all rows, the change of velocity of all blocks, and the velocity u of all rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct State {
    pub lambda: Vec<DVec3>,
    pub change: Vec<DVec3>,
    pub velocity: Vec<DVec3>,
    /// Jᵀ λ + r − ⊕A/f Δv: the momentum that no velocity answers yet, r that which free velocities leave. Zero by a factor.
    pub left: Vec<DVec3>,
}

/// A problem on its way to a solution.
#[derive(Debug, Clone, Default)]
pub(crate) struct Iterate {
    pub rows: Rows,
    pub system: System,
    pub state: State,
    /// The step that [`Self::solve`] found.
    pub step: State,
    /// G of each row.
    pub gains: Vec<DMat3>,
    /// The terms that friction which follows pressure adds to G of each row.
    pub skews: Vec<Skew>,
    /// The momentum that free velocities leave unanswered, N·s; empty where they answer all.
    pub unanswered: Vec<DVec3>,
    /// λ + c of each row: the impulse it would have if no velocity changed.
    pub pull: Vec<DVec3>,
    /// Whether velocities are the response to the impulses, and not those of a step.
    pub exact: bool,
    /// Newton steps so far.
    pub steps: usize,
    scratch: Vec<DVec3>,
}

/// A state and compliances to which an iterate can go back.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    state: State,
    compliances: Vec<f64>,
}

/// The outcome of setting impulses by the laws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Refined {
    /// None changed.
    Kept,
    /// Some changed, and velocities answer them.
    Changed,
    /// Velocities do not answer them yet: a step to the end makes them.
    Unanswered,
}

impl State {
    fn resize(&mut self, rows: usize, blocks: usize) {
        for (list, size) in self.lists_mut().into_iter().zip([rows, rows, blocks, blocks]) {
            reset(list, size, DVec3::ZERO);
        }
    }

    fn copy(&mut self, other: &Self) {
        self.lists_mut().into_iter().zip(other.lists()).for_each(|(list, from)| list.clone_from(from));
    }

    /// Lists of rows, then of blocks.
    fn lists(&self) -> [&Vec<DVec3>; 4] {
        [&self.lambda, &self.velocity, &self.change, &self.left]
    }

    fn lists_mut(&mut self) -> [&mut Vec<DVec3>; 4] {
        [&mut self.lambda, &mut self.velocity, &mut self.change, &mut self.left]
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
        reset(&mut self.gains, rows, DMat3::ZERO);
        reset(&mut self.skews, rows, Skew::NONE);
        reset(&mut self.pull, rows, DVec3::ZERO);
        reset(&mut self.scratch, blocks, DVec3::ZERO);
        self.steps = 0;
    }

    /// Takes up the momentum that the members' free velocities leave unanswered.
    pub fn take_unanswered(&mut self, members: &[Member<'_>]) {
        self.unanswered.clear();
        if members.iter().all(|member| member.unanswered.is_empty()) {
            return;
        }
        for member in members {
            let none = member.free.len() - member.unanswered.len();
            self.unanswered.extend(member.unanswered.iter().chain(std::iter::repeat_n(&DVec3::ZERO, none)));
        }
    }

    /// Jᵀ λ + r of the impulses as they are, into `scratch`.
    fn scatter_given(&mut self) {
        let Self { rows, state, unanswered, scratch, .. } = self;
        rows.scatter(&state.lambda, scratch);
        scratch.iter_mut().zip(&*unanswered).for_each(|(given, more)| *given += *more);
    }

    /// Starts from where members go on as they were.
    pub fn guess(&mut self, members: &[Member<'_>]) {
        let mut start = 0;
        for member in members {
            let change = &mut self.state.change[start..start + member.free.len()];
            change.iter_mut().zip(member.now).zip(member.free).for_each(|((x, now), free)| *x = *now - *free);
            start += member.free.len();
        }
    }

    /// Velocities that a Newton step may start from: as the impulses make them where that takes a factor alone, else as members go on.
    pub fn begin(&mut self, members: &[Member<'_>]) {
        self.scatter_given();
        let Self { system, state, scratch, .. } = self;
        system.begin(members, &mut Task { right: scratch, x: &mut state.change, left: &mut state.left, goal: 0.0 });
        self.exact = self.state.left.iter().all(|left| *left == DVec3::ZERO);
        self.update_velocities();
    }

    /// Velocities as the impulses make them: momentum to rounding by a factor, else to the share of it that is wanted (eq. 17).
    pub fn respond(&mut self, members: &[Member<'_>]) {
        self.scatter_given();
        let Self { system, state, scratch, .. } = self;
        system.respond(members, &mut Task { right: scratch, x: &mut state.change, left: &mut state.left, goal: 0.0 });
        self.exact = true;
        self.update_velocities();
    }

    /// Sets impulses by the laws, and velocities by the impulses where a factor makes them. Returns the outcome.
    pub fn refine(&mut self, members: &[Member<'_>]) -> Refined {
        if self.system.form == StepForm::Direct {
            if !self.obey() {
                return Refined::Kept;
            }
            self.respond(members);
            return Refined::Changed;
        }
        self.scatter_given();
        let Self { state, scratch, .. } = &mut *self;
        state.left.iter_mut().zip(&*scratch).for_each(|(left, before)| *left -= *before);
        let changed = self.obey();
        self.scatter_given();
        let Self { system, state, scratch, .. } = &mut *self;
        state.left.iter_mut().zip(&*scratch).for_each(|(left, now)| *left += *now);
        self.exact = system.members.measure(&state.left).fastest_m_s <= system.still_m_s;
        match (self.exact, changed) {
            (false, _) => Refined::Unanswered,
            (true, true) => Refined::Changed,
            (true, false) => Refined::Kept,
        }
    }

    /// Sets impulses by the laws at the velocities as they are; returns whether any changed.
    fn obey(&mut self) -> bool {
        let Self { rows, state, .. } = self;
        let mut any = false;
        for (row, (impulse, velocity)) in rows.rows.iter().zip(state.lambda.iter_mut().zip(&state.velocity)) {
            let asked = row.natural_map(Point { impulse: *impulse, velocity: *velocity }).value;
            any |= asked != *impulse;
            *impulse = asked;
        }
        any
    }

    /// Bounds rows by the pressure of their contacts now.
    pub fn press(&mut self) {
        self.rows.press(&self.state.lambda);
    }

    /// Projects impulses on their laws; returns whether any changed.
    pub fn allow(&mut self) -> bool {
        self.press();
        let mut any = false;
        for (row, impulse) in self.rows.rows.iter().zip(&mut self.state.lambda) {
            let allowed = row.law.project(*impulse).value;
            any |= allowed != *impulse;
            *impulse = allowed;
        }
        any
    }

    /// Stores the state to which [`Self::go_back`] goes back.
    pub fn keep(&self, kept: &mut Kept) {
        kept.state.copy(&self.state);
        refill(&mut kept.compliances, self.rows.rows.iter().map(|row| row.compliance));
    }

    /// Goes back to where it was.
    pub fn go_back(&mut self, kept: &Kept) {
        self.exact = false;
        self.state.copy(&kept.state);
        self.rows.rows.iter_mut().zip(&kept.compliances).for_each(|(row, compliance)| row.compliance = *compliance);
        self.press();
    }

    /// u = b + J Δv.
    pub fn update_velocities(&mut self) {
        self.rows.velocities(&self.state.change, &mut self.state.velocity);
        self.state.velocity.iter_mut().zip(&self.rows.rows).for_each(|(u, row)| *u += row.free);
    }

    /// The gain and the pull of a row from its image under the projection (eq. 8), with how its friction follows its pressure (eq. 8b).
    pub fn linearise(&mut self, row: usize, image: &Projection) {
        let of = &self.rows.rows[row];
        let yielding = of.compliance / of.scale;
        let slopes = image.slopes;
        // (I − P′ (1 − R/w))⁻¹ along each axis of the slope P′
        let factor = (DVec3::ONE - slopes + slopes * yielding).recip();
        let missing = image.axes.mul_transpose_vec3(image.value - self.state.lambda[row]);
        let pulled = image.axes * (missing * factor);
        let followed = follow_pressure(of, image, pulled);
        self.gains[row] = image.along_axes(slopes * factor / of.scale);
        self.pull(row, pulled, followed);
    }

    /// The gain of a row that misses this velocity, and its pull, with how its shift follows its slip where that is followed (eq. C3).
    pub fn pull_on(&mut self, row: usize, missing: DVec3, gain: DMat3, follows: bool) {
        let pulled = gain * missing;
        let at = self.state.point(row);
        let followed = if follows { follow_slip(&self.rows.rows[row], at, gain, pulled) } else { None };
        self.gains[row] = gain;
        self.pull(row, pulled, followed);
    }

    fn pull(&mut self, row: usize, pulled: DVec3, followed: Option<Followed>) {
        let Followed { skew, more } = followed.unwrap_or(Followed { skew: Skew::NONE, more: DVec3::ZERO });
        self.skews[row] = skew;
        self.pull[row] = self.state.lambda[row] + pulled + more;
    }

    /// Finds the momentum that velocities leave unanswered, where impulses have been changed without them.
    pub fn remeasure(&mut self) {
        self.exact = false;
        self.scatter_given();
        let Self { system, state, step, scratch, .. } = self;
        system.members.multiply(&state.change, &mut step.left);
        let sides = scratch.iter().zip(&step.left);
        state.left.iter_mut().zip(sides).for_each(|(left, (given, av))| *left = *given - *av);
    }

    /// ‖F‖ of eq. 16, √J. A factor leaves √Σ w |λ − P|² of it.
    pub fn missed(&self) -> f64 {
        let of_rows = self.rows.rows.iter().enumerate().map(|(k, row)| {
            let at = self.state.point(k);
            row.scale * (at.impulse - row.natural_map(at).value).length_squared()
        });
        (of_rows.sum::<f64>() + self.system.members.measure(&self.state.left).squared).sqrt()
    }

    /// Jᵀ (λ + c) + r − ⊕A/f Δv into `scratch`.
    fn pull_on_members(&mut self) {
        let Self { rows, system, state, step, unanswered, scratch, .. } = self;
        rows.scatter(&self.pull, scratch);
        scratch.iter_mut().zip(&*unanswered).for_each(|(given, more)| *given += *more);
        // `left` serves as storage
        system.members.multiply(&state.change, &mut step.left);
        scratch.iter_mut().zip(&step.left).for_each(|(right, av)| *right -= *av);
    }

    /// Factors ⊕A/f + JᵀGJ of the gains as they are, or its counterpart for gradients; `false` where rounding leaves
    /// none.
    pub fn factor(&mut self, threads: &dyn ParallelFor) -> bool {
        self.steps += 1;
        self.system.factor(Stiffness { rows: &self.rows, gains: &self.gains, skews: &self.skews, threads })
    }

    /// The step of eq. 8 from gains and pulls by the last factor; `goal` says how much of a right side of a size may be left, in √J. `false`
    /// where there is none.
    pub fn solve(&mut self, threads: &dyn ParallelFor, goal: impl Fn(f64) -> f64) -> bool {
        self.pull_on_members();
        let Self { rows, system, state, step, scratch, .. } = self;
        let goal = goal(system.members.measure(scratch).root());
        step.change.fill(DVec3::ZERO);
        let contacts = Stiffness { rows, gains: &self.gains, skews: &self.skews, threads };
        system.solve(contacts, &mut Task { right: scratch, x: &mut step.change, left: &mut step.left, goal });
        // the rest from before is part of the right side, and goes
        step.left.iter_mut().zip(&state.left).for_each(|(left, before)| *left -= *before);
        rows.velocities(&step.change, &mut step.velocity);
        for row in 0..rows.len() {
            let velocity = step.velocity[row];
            let given = self.gains[row] * velocity + self.skews[row].impulse(velocity);
            step.lambda[row] = self.pull[row] - given - state.lambda[row];
        }
        let finite = step.change.iter().chain(&step.lambda).all(|v| v.is_finite());
        if !finite {
            // no share of it, not even none, is of use to a later look
            step.resize(self.rows.len(), self.scratch.len());
        }
        finite
    }

    /// A⁻¹ r of the momentum that free velocities leave unanswered, as the storage of a step; with its residual.
    pub fn complete(&mut self, members: &[Member<'_>]) {
        let Self { system, step, unanswered, .. } = self;
        step.change.fill(DVec3::ZERO);
        step.left.fill(DVec3::ZERO);
        if !unanswered.is_empty() {
            let State { change: x, left, .. } = step;
            // nothing else than rounding ends this: a residual would be energy that is not counted
            let still_m_s = std::mem::take(&mut system.still_m_s);
            system.respond(members, &mut Task { right: unanswered, x, left, goal: 0.0 });
            system.still_m_s = still_m_s;
        }
    }

    /// A share of all impulses, and of their changes and residuals beside those that [`Self::complete`] found.
    pub fn shorten(&mut self, share: f64) {
        let State { lambda, change, left, .. } = &mut self.state;
        lambda.iter_mut().for_each(|impulse| *impulse *= share);
        for (list, own) in [(change, &self.step.change), (left, &self.step.left)] {
            list.iter_mut().zip(own).for_each(|(value, own)| *value = *own + (*value - *own) * share);
        }
        self.update_velocities();
    }

    /// Goes a share of the step.
    pub fn advance(&mut self, share: f64) {
        self.exact = false;
        for (list, by) in self.state.lists_mut().into_iter().zip(self.step.lists()) {
            list.iter_mut().zip(by).for_each(|(value, by)| *value += *by * share);
        }
    }
}
