//! The iterate that both ways to a solution share, and the linear step that both take.
//!
//! In: rows and matrices of a problem. Out: impulses, velocities, steps of them, and what momentum lacks where equations were not
//! solved to their end.
//! Never here: when to stop, how far to step.
//! Theory: `docs/theory/clusters.md`, eq. 8 and 15–17.

use super::cone::{Form, Projection};
use super::gradients::{Stiffness, Task};
use super::problem::Member;
use super::rows::{Point, Rows};
use super::skew::{Followed, Linear, Residuals, Skew, Sliding};
use super::system::{StepForm, System};
use glam::{DMat3, DVec3};
use metachron_core::ParallelFor;

/// The share of the step to a convex pass's own impulses that a look at it may leave, before it is found exactly.
const LOOK_SHARE: f64 = 0.01;
/// The share of impulses from which on unanswered ones are not rounding that keeps a solve from its goal.
const UNANSWERED: f64 = 1e-6;
/// The share of what an inexact step may leave that friction may be off by from what its pressure allows.
const FOLLOW_SHARE: f64 = 0.1;

/// Impulses λ of all rows, the change of velocity of all blocks, and the velocity u of all rows.
#[derive(Debug, Clone, Default)]
pub(super) struct State {
    pub lambda: Vec<DVec3>,
    pub change: Vec<DVec3>,
    pub velocity: Vec<DVec3>,
    /// Jᵀ λ + r − ⊕A/f Δv: the momentum that no velocity answers yet, r that which free velocities leave. Zero by a factor.
    pub left: Vec<DVec3>,
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
    /// What friction that follows pressure adds to G of each row.
    pub skews: Vec<Skew>,
    residuals: Residuals,
    /// What free velocities leave unanswered, N·s; empty where they answer all.
    pub unanswered: Vec<DVec3>,
    /// λ + c of each row: the impulse it would have if no velocity changed.
    pub pull: Vec<DVec3>,
    /// Whether velocities are those that the impulses make, and not those of a step.
    pub exact: bool,
    /// Newton steps so far.
    pub steps: usize,
    scratch: Vec<DVec3>,
}

/// Impulses and compliances to which an iterate can go back.
#[derive(Debug, Clone, Default)]
pub(super) struct Kept {
    lambda: Vec<DVec3>,
    compliances: Vec<f64>,
}

/// What became of impulses when they were made those that laws ask for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Refined {
    /// None changed.
    Kept,
    /// Some changed, and velocities answer them.
    Changed,
    /// Velocities do not answer them yet: a step to the end makes them.
    Unanswered,
}

/// Where the impulses that a velocity asks for would lead.
#[derive(Debug, Clone, Copy)]
pub(super) struct Led {
    /// The largest difference of a row's velocity along each of its axes, m/s.
    pub off: DVec3,
    /// The size of the gradient of eq. 10 (eq. 15), √J.
    pub gradient: f64,
    /// Whether the equations for it have been solved.
    pub answered: bool,
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
        let lists = [
            (&mut self.lambda, rows),
            (&mut self.velocity, rows),
            (&mut self.change, blocks),
            (&mut self.left, blocks),
        ];
        for (list, size) in lists {
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
        self.skews.clear();
        self.skews.resize(rows, Skew::NONE);
        self.pull.clear();
        self.pull.resize(rows, DVec3::ZERO);
        self.scratch.clear();
        self.scratch.resize(blocks, DVec3::ZERO);
        self.steps = 0;
    }

    /// Takes up what the members' free velocities leave unanswered.
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

    /// Makes impulses those that laws ask for, and velocities theirs where a factor makes them. Returns what that came to.
    pub fn refine(&mut self, form: Form, members: &[Member<'_>]) -> Refined {
        if self.system.form == StepForm::Direct {
            if !self.obey(form) {
                return Refined::Kept;
            }
            self.respond(members);
            return Refined::Changed;
        }
        self.scatter_given();
        let Self { state, scratch, .. } = &mut *self;
        state.left.iter_mut().zip(&*scratch).for_each(|(left, before)| *left -= *before);
        let changed = self.obey(form);
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

    /// Makes impulses those that laws ask for at the velocities as they are; returns whether any was not.
    fn obey(&mut self, form: Form) -> bool {
        let Self { rows, state, .. } = self;
        let mut any = false;
        for (row, (impulse, velocity)) in rows.rows.iter().zip(state.lambda.iter_mut().zip(&state.velocity)) {
            let asked = row.natural_map(form, Point { impulse: *impulse, velocity: *velocity }).value;
            any |= asked != *impulse;
            *impulse = asked;
        }
        any
    }

    /// Bounds rows by what presses their contacts now.
    pub fn press(&mut self) {
        self.rows.press(&self.state.lambda);
    }

    /// Makes impulses those that laws allow; returns whether any was not.
    pub fn allow(&mut self) -> bool {
        self.press();
        let mut any = false;
        for (row, impulse) in self.rows.rows.iter().zip(&mut self.state.lambda) {
            let allowed = row.law.project(Form::Disc, *impulse).value;
            any |= allowed != *impulse;
            *impulse = allowed;
        }
        any
    }

    /// Whether velocities answer the impulses: not where a matrix is none of a body.
    pub fn answered(&mut self) -> bool {
        self.scatter_given();
        let Self { system, state, scratch, .. } = self;
        let given = system.members.measure(scratch).root();
        let left = system.members.measure(&state.left);
        left.fastest_m_s <= system.still_m_s || left.root() <= UNANSWERED * given
    }

    /// Stores what [`Self::restore`] goes back to.
    pub fn keep(&self, kept: &mut Kept) {
        kept.lambda.clone_from(&self.state.lambda);
        kept.compliances.clear();
        kept.compliances.extend(self.rows.rows.iter().map(|row| row.compliance));
    }

    /// Goes back to impulses and compliances as they were.
    pub fn restore(&mut self, members: &[Member<'_>], kept: &Kept) {
        self.state.lambda.clone_from(&kept.lambda);
        self.restore_compliances(kept);
        self.respond(members);
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
        // (I − P′ (1 − R/w))⁻¹ along each axis of the slope P′
        let factor = (DVec3::ONE - slopes + slopes * yielding).recip();
        let lambda = self.state.lambda[row];
        self.gains[row] = image.along_axes(slopes * factor / scale);
        let missing = image.axes.mul_transpose_vec3(image.value - lambda);
        self.pull[row] = lambda + image.axes * (missing * factor);
        self.skews[row] = Skew::NONE;
    }

    /// Whether steps know how friction follows its pressure: where a factor is at hand.
    pub fn follows_pressure(&self) -> bool {
        self.system.form == StepForm::Direct
    }

    /// Adds to a row's gain and pull how its friction follows its pressure (eq. 8b).
    pub fn follow_pressure(&mut self, row: usize, form: Form, image: &Projection) {
        let at = self.state.point(row);
        let linear = Linear { image, gain: self.gains[row], pulled: self.pull[row] - at.impulse };
        if let Some(Followed { skew, more }) = linear.follow(&self.rows.rows[row], form, at) {
            self.skews[row] = skew;
            self.pull[row] += more;
        }
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

    /// Where the pulls as impulses would lead from here: `step` has the change of velocities. The first look is a rough one.
    pub fn look_ahead(&mut self, members: &[Member<'_>], exactly: bool) -> Led {
        self.rows.scatter(&self.pull, &mut self.scratch);
        let pulled = self.system.members.measure(&self.scratch).root();
        self.pull_on_members();
        let Self { rows, system, step, scratch, .. } = self;
        let gradient = system.members.measure(scratch).root();
        let goal = if exactly { 0.0 } else { LOOK_SHARE * gradient };
        if !exactly {
            step.change.fill(DVec3::ZERO);
        }
        system.respond(members, &mut Task { right: scratch, x: &mut step.change, left: &mut step.left, goal });
        rows.velocities(&step.change, &mut step.velocity);
        let left = system.members.measure(&step.left);
        let answered = left.fastest_m_s <= system.still_m_s || left.root() <= goal.max(UNANSWERED * pulled);
        Led { off: step.velocity.iter().fold(DVec3::ZERO, |worst, u| worst.max(u.abs())), gradient, answered }
    }

    /// Takes the pulls as impulses, with the velocities that [`Self::look_ahead`] found.
    pub fn take_pulls(&mut self) {
        self.exact = false;
        let Self { state, step, .. } = self;
        state.lambda.clone_from(&self.pull);
        state.left.clone_from(&step.left);
        state.change.iter_mut().zip(&step.change).for_each(|(v, by)| *v += *by);
        self.update_velocities();
    }

    /// The step of eq. 8 from gains and pulls, of which up to `goal` may be left, in √J; `false` where there is none.
    pub fn take_step(&mut self, goal: f64, threads: &dyn ParallelFor) -> bool {
        self.steps += 1;
        self.pull_on_members();
        let Self { rows, system, state, step, scratch, .. } = self;
        step.change.fill(DVec3::ZERO);
        let contacts = Stiffness { rows, gains: &self.gains, threads };
        let solved =
            system.step(contacts, &mut Task { right: scratch, x: &mut step.change, left: &mut step.left, goal });
        let sliding = Sliding { rows, skews: &self.skews, goal: FOLLOW_SHARE * goal };
        self.residuals.correct(&sliding, &mut step.change, |x| system.solve_again(x));
        // what was left before is part of the right side, and goes
        step.left.iter_mut().zip(&state.left).for_each(|(left, before)| *left -= *before);
        rows.velocities(&step.change, &mut step.velocity);
        for row in 0..rows.len() {
            step.lambda[row] = self.pull[row] - self.gains[row] * step.velocity[row] - state.lambda[row];
        }
        for (row, impulse) in self.residuals.impulses(&self.skews) {
            step.lambda[row] -= impulse;
        }
        let finite = solved && step.change.iter().all(|v| v.is_finite());
        if !finite {
            // no share of it, not even none, is of use to a later look
            step.resize(self.rows.len(), self.scratch.len());
        }
        finite
    }

    /// The energy of the members along the step; Δvᵀ A Δv is the same everywhere and left out.
    pub fn quadratic(&mut self) -> Quadratic {
        let Self { system, state, step, unanswered, scratch, .. } = self;
        system.members.multiply(&step.change, scratch);
        let dot = |a: &[DVec3], b: &[DVec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
        let cross = dot(&state.change, scratch) - dot(unanswered, &step.change);
        Quadratic { cross, curve: dot(&step.change, scratch) }
    }

    /// A⁻¹ r of what free velocities leave unanswered, as the storage of a step; what that leaves too.
    pub fn complete(&mut self, members: &[Member<'_>]) {
        let Self { system, step, unanswered, .. } = self;
        step.change.fill(DVec3::ZERO);
        step.left.fill(DVec3::ZERO);
        if !unanswered.is_empty() {
            let State { change: x, left, .. } = step;
            system.respond(members, &mut Task { right: unanswered, x, left, goal: 0.0 });
        }
    }

    /// A share of all impulses, and of what they changed and left beside what [`Self::complete`] found.
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
        let Self { state, step, .. } = self;
        let lists = [
            (&mut state.lambda, &step.lambda),
            (&mut state.change, &step.change),
            (&mut state.velocity, &step.velocity),
            (&mut state.left, &step.left),
        ];
        for (list, by) in lists {
            list.iter_mut().zip(by).for_each(|(value, by)| *value += *by * share);
        }
    }
}
