//! The linear system of one Newton iteration: A Δ = r with A = M + h (c M + D) + h² K.
//!
//! In: the state at the start of the step, the iterate it is linearised about. Out: rows and right side, in slots.
//! Never here: acceptance of the result ([`super::step`]). Theory: docs/theory/rod.md, eq. 11–15, 19–24.

use super::anchor_springs::NodeSpring;
use super::banded_ldl::Row;
use super::discretization::Discretization;
use super::spec::Integrator;
use super::state::{RodMaterial, RodState};
use super::sym3::Sym3;
use super::wall::Softening;
use glam::{DMat3, DQuat, DVec3};

/// All inputs of a substep except the state.
#[derive(Clone, Copy)]
pub struct SubstepProblem<'a> {
    /// The material.
    pub material: &'a RodMaterial,
    /// The division.
    pub division: &'a Discretization,
    /// Attachments.
    pub springs: &'a [NodeSpring],
    /// The substep, seconds.
    pub h: f64,
    /// Time integrator.
    pub integrator: Integrator,
}

/// Newton's iteration: the iterate and the start of the substep.
#[derive(Clone, Copy)]
pub struct Iterate<'a> {
    /// The state at the start of the substep.
    pub start: &'a RodState,
    /// The state linearised about: the start itself in the first iteration.
    pub at: &'a RodState,
    /// Whether `at` is the start: velocities since the start then count as zero.
    pub first: bool,
}

impl Iterate<'_> {
    fn moved(&self, slot: usize) -> DVec3 {
        if self.first { DVec3::ZERO } else { self.at.u[slot] }
    }
}

/// Fills `rows` and `rhs` (eq. 11–15, 19–24).
pub fn assemble(problem: &SubstepProblem<'_>, iterate: &Iterate<'_>, rows: &mut Vec<Row>, rhs: &mut Vec<DVec3>) {
    fill_matrix(problem, iterate.at, rows, rhs);
    fill_right_side(problem, iterate, rhs);
    add_springs(problem, iterate, rows, rhs);
    hold_ends(problem.material, rows, rhs);
}

/// Fills `rows` with stiffness and mass about `at`, and sizes `rhs` (eq. 12–15).
pub fn fill_matrix(problem: &SubstepProblem<'_>, at: &RodState, rows: &mut Vec<Row>, rhs: &mut Vec<DVec3>) {
    rows.resize(at.u.len(), Row::ZERO);
    rhs.resize(at.u.len(), DVec3::ZERO);
    fill_segments(problem, at, rows);
    fill_joints(problem, at, rows);
}

/// Mass, stretch and shear: D = (GA − b) I + (EA − GA) t tᵀ is the clamped stiffness (eq. 12, 13).
fn fill_segments(problem: &SubstepProblem<'_>, at: &RodState, rows: &mut [Row]) {
    let RodMaterial { ea, ga, mu, rotary, damping, .. } = *problem.material;
    let (h2, slow) = (problem.h * problem.h, 1.0 + problem.h * damping);
    let (sixth, turn) = (slow * mu / 6.0, slow * rotary);
    let count = at.q.len();
    let rows = &mut rows[..2 * count + 1];
    let (length, t, e, b) = (&problem.division.length[..count], &at.t[..count], &at.e[..count], &at.b[..count]);
    rows[0] = Row::ZERO;
    for k in 0..count {
        let (l, t, u) = (length[k], t[k], e[k]);
        let (a, d) = (h2 * (ga - b[k]), h2 * (ea - ga));
        let w = t.cross(u);
        let mass = sixth * l;
        let stiffness = (Sym3::identity(a) + Sym3::outer(t, d)) * (1.0 / l);
        rows[2 * k].diag += stiffness + Sym3::identity(2.0 * mass);
        let spin = Sym3::identity(turn * l + l * a * u.length_squared()) + Sym3::outer(t, turn * l);
        let cross = cross_matrix(u * a);
        rows[2 * k + 1] = Row {
            diag: spin + Sym3::outer(u, -l * a) + Sym3::outer(w, l * d),
            near: cross - product(w * d, t),
            far: Sym3::ZERO,
        };
        rows[2 * k + 2] = Row {
            diag: stiffness + Sym3::identity(2.0 * mass),
            near: cross + product(t * d, w),
            far: Sym3::identity(mass) + stiffness * -1.0,
        };
    }
}

/// Bend and twist about the joint's mean director, without their geometric terms (eq. 14).
fn fill_joints(problem: &SubstepProblem<'_>, at: &RodState, rows: &mut [Row]) {
    let SubstepProblem { material, division, .. } = *problem;
    let (h2, count) = (problem.h * problem.h, at.q.len());
    let soft = |k: usize, axis: DVec3| {
        let axes = if k == 0 { division.wall[0] } else { at.q[k - 1] };
        softened(&at.softening[k], axes, axis) * (h2 * division.joint[k] * material.ei)
    };
    let stiffness = |k: usize, axis: DVec3| {
        let size = axis.length_squared();
        let scale = h2 * division.joint[k];
        let twist = if size > 0.0 { scale * (material.gj - material.ei) / size } else { 0.0 };
        let round = Sym3::identity(scale * material.ei) + Sym3::outer(axis, twist);
        if at.softening.is_empty() { round } else { round + soft(k, axis) }
    };
    if material.clamp[0] {
        rows[1].diag += stiffness(0, at.t[0]);
    }
    for k in 1..count {
        let joint = stiffness(k, at.t[k - 1] + at.t[k]);
        rows[2 * k - 1].diag += joint;
        rows[2 * k + 1].diag += joint;
        rows[2 * k + 1].far = joint * -1.0;
    }
    if material.clamp[1] {
        rows[2 * count - 1].diag += stiffness(count, at.t[count - 1]);
    }
}

/// The part that the softening of a section adds to its relative bend stiffness (eq. 62), in world axes, from the axes
/// of the segment before it. Across the mean director it takes away no more than there is.
fn softened(softening: &Softening, axes: DQuat, director: DVec3) -> Sym3 {
    let Softening { mean, oval } = *softening;
    let across = |v: DVec3| v - director * (director.dot(v) / director.length_squared().max(f64::MIN_POSITIVE));
    let (x, y) = (across(axes * DVec3::X), across(axes * DVec3::Y));
    let (sum, difference) = (x + y, x - y);
    let straight = Sym3::outer(x, mean - 1.0 + oval.x) + Sym3::outer(y, mean - 1.0 - oval.x);
    straight + Sym3::outer(sum, 0.5 * oval.y) + Sym3::outer(difference, -0.5 * oval.y)
}

/// r = M (v_n − v_i) − h c M v_i + h f (eq. 11), the spin of v_n turned by its own gyroscopic torque (eq. 19).
fn fill_right_side(problem: &SubstepProblem<'_>, iterate: &Iterate<'_>, rhs: &mut [DVec3]) {
    let RodMaterial { mu, rotary, damping, .. } = *problem.material;
    let (h, slow) = (problem.h, 1.0 + problem.h * damping);
    let (start, force) = (iterate.start, &iterate.at.force);
    let count = start.q.len();
    let want = |slot: usize| start.u[slot] - iterate.moved(slot) * slow;
    let mut a = want(0);
    rhs[0] = force[0] * h;
    for k in 0..count {
        let l = problem.division.length[k];
        let b = want(2 * k + 2);
        let m = mu * l / 6.0;
        rhs[2 * k] += (a * 2.0 + b) * m;
        rhs[2 * k + 2] = force[2 * k + 2] * h + (b * 2.0 + a) * m;
        let t = iterate.at.t[k];
        let spin = gyrate(start.u[2 * k + 1], t, h) - iterate.moved(2 * k + 1) * slow;
        rhs[2 * k + 1] = force[2 * k + 1] * h + (spin + t * t.dot(spin)) * (rotary * l);
        a = b;
    }
}

/// Applies the gyroscopic torque to a spin over `h`: turns it about t by t·ω h, energy unchanged (eq. 19).
#[inline]
pub fn gyrate(w: DVec3, t: DVec3, h: f64) -> DVec3 {
    let a = 0.5 * h * t.dot(w);
    let side = t.cross(w);
    w + (side + t.cross(side) * a) * (2.0 * a / (1.0 + a * a))
}

/// Attachments, linearised at the predicted position so that a slack one acts within the step in which it tightens (eq. 21–23).
pub fn add_springs(problem: &SubstepProblem<'_>, iterate: &Iterate<'_>, rows: &mut [Row], rhs: &mut [DVec3]) {
    let h = problem.h;
    for spring in problem.springs {
        let slot = 2 * spring.node;
        let ahead = if iterate.first { iterate.start.u[slot] * h } else { DVec3::ZERO };
        let linear = spring.linear(iterate.at.x[spring.node] + ahead);
        rows[slot].diag += linear.stiffness * (h * h) + Sym3::identity(h * linear.damping);
        let force = linear.force + linear.stiffness * ahead - iterate.moved(slot) * linear.damping;
        rhs[slot] += force * h;
    }
}

/// Removes the positions of held ends from the system: their velocity is zero under any load.
pub fn hold_ends(material: &RodMaterial, rows: &mut [Row], rhs: &mut [DVec3]) {
    let last = rows.len() - 1;
    if material.held[0] {
        rows[0].diag = Sym3::identity(1.0);
        rows[1].near = DMat3::ZERO;
        rows[2].far = Sym3::ZERO;
        rhs[0] = DVec3::ZERO;
    }
    if material.held[1] {
        rows[last] = Row { diag: Sym3::identity(1.0), ..Row::ZERO };
        rhs[last] = DVec3::ZERO;
    }
}

#[inline]
fn cross_matrix(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}

/// a bᵀ.
#[inline]
fn product(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
