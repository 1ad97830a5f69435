//! Mean forces of the energy-momentum rule: their work over a substep is exactly the change of the energies.
//!
//! In: the states at both ends of a substep. Out: the right side of a Newton iteration, in slots. Stretch and shear are
//! quadratic in strains of the segments' own axes, so means of strains and frames suffice (Simo and Tarnow's argument); a joint's
//! rotation vector is not, and its moment is corrected along the turn made (GON96).
//! Never here: damping, the matrix except for external springs, the iteration. Theory: docs/theory/rod.md, eq. 45, 47, 48.

use super::banded_ldl::Row;
use super::rotation::{bend_share, cayley};
use super::state::{Joint, RodMaterial, RodState};
use super::sym3::Sym3;
use super::system::SubstepProblem;
use super::wall::Softening;
use glam::{DMat3, DQuat, DVec3};

/// Below this difference between the turns of a joint's two segments, radians, the work of the joint is indistinguishable from rounding.
const TURN_MIN_RAD: f64 = 1e-6;

/// Fills `rhs` with M (v_n − v) + 2 h f̄, and adds springs to both; `problem.h` is half the substep.
pub fn fill_mean(problem: &SubstepProblem<'_>, now: &RodState, next: &RodState, rows: &mut [Row], rhs: &mut [DVec3]) {
    fill_segments(problem, now, next, rhs);
    fill_joints(problem, now, next, rhs);
    add_springs(problem, now, next, rows, rhs);
}

/// Change of momentum, weight, stretch and shear (eq. 45, 47).
fn fill_segments(problem: &SubstepProblem<'_>, now: &RodState, next: &RodState, rhs: &mut [DVec3]) {
    let RodMaterial { ea, ga, mu, rotary, gravity, .. } = *problem.material;
    let h = problem.h;
    let want = |slot: usize| now.u[slot] - next.u[slot];
    let stiffness = DVec3::new(ga, ga, ea);
    let mut a = want(0);
    rhs[0] = DVec3::ZERO;
    for k in 0..now.q.len() {
        let (l, rest) = (problem.division.length[k], DVec3::Z * problem.division.chord[k]);
        let (before, after) = (DMat3::from_quat(now.q[k]), DMat3::from_quat(next.q[k]));
        let (e0, e1) = (now.e[k], next.e[k]);
        let strains = before.transpose() * e0 + after.transpose() * e1 - rest * 2.0;
        // twice the mean force n̄, as h is half the substep
        let n = (before + after) * (stiffness * strains) * 0.5;
        let weight = gravity * (mu * l);
        let (b, m) = (want(2 * k + 2), mu * l / 6.0);
        rhs[2 * k] += (a * 2.0 + b) * m + (n + weight) * h;
        rhs[2 * k + 2] = (b * 2.0 + a) * m + (weight - n) * h;
        let spin = |w: DVec3, t: DVec3| w + t * t.dot(w);
        let turned = spin(now.u[2 * k + 1], now.t[k]) - spin(next.u[2 * k + 1], next.t[k]);
        rhs[2 * k + 1] = turned * (rotary * l) + (e0 + e1).cross(n) * (0.5 * l * h);
        a = b;
    }
}

/// Bend and twist (eq. 48).
fn fill_joints(problem: &SubstepProblem<'_>, now: &RodState, next: &RodState, rhs: &mut [DVec3]) {
    let SubstepProblem { material, division, .. } = *problem;
    let (count, wall) = (now.q.len(), division.wall);
    let ends = |k: usize| (now.q[k], next.q[k]);
    let soft = |k: usize| now.softening.get(k);
    if material.clamp[0] {
        rhs[1] -= moment(problem, 0, [(wall[0], wall[0]), ends(0)], soft(0)) * problem.h;
    }
    for k in 1..count {
        let m = moment(problem, k, [ends(k - 1), ends(k)], soft(k)) * problem.h;
        rhs[2 * k - 1] += m;
        rhs[2 * k + 1] -= m;
    }
    if material.clamp[1] {
        rhs[2 * count - 1] += moment(problem, count, [ends(count - 1), (wall[1], wall[1])], soft(count)) * problem.h;
    }
}

/// Twice the mean moment of joint `k` between two segments, each given as (before, after).
fn moment(
    problem: &SubstepProblem<'_>,
    k: usize,
    [left, right]: [(DQuat, DQuat); 2],
    softening: Option<&Softening>,
) -> DVec3 {
    let SubstepProblem { material, division, .. } = *problem;
    let joints = [Joint::between(division, k, left.0, right.0), Joint::between(division, k, left.1, right.1)];
    let own = [left.0.conjugate() * joints[0].strain, left.1.conjugate() * joints[1].strain];
    let strains = own[0] + own[1];
    let bend = softening.map_or(strains.truncate(), |softening| softening.of(strains.truncate()));
    let sum = DVec3::new(material.ei, material.ei, material.gj) * division.joint[k] * bend.extend(strains.z);
    let m = (left.0 * sum + left.1 * sum) * 0.5;
    let theta = (joints[0].theta + joints[1].theta) * 0.5;
    let across = theta.cross(m);
    let guess = m + across * 0.5 + theta.cross(across) * bend_share(theta.length_squared());
    let made = cayley(right.1 * right.0.conjugate()) - cayley(left.1 * left.0.conjugate());
    let size = made.length_squared();
    if size < TURN_MIN_RAD * TURN_MIN_RAD {
        return guess;
    }
    guess + made * ((sum.dot(own[1] - own[0]) - guess.dot(made)) / size)
}

/// Attachments: the mean of the forces at both ends of the substep, corrected along the displacement so that work equals energy change.
fn add_springs(problem: &SubstepProblem<'_>, now: &RodState, next: &RodState, rows: &mut [Row], rhs: &mut [DVec3]) {
    let h = problem.h;
    for spring in problem.springs {
        let (k, slot) = (spring.node, 2 * spring.node);
        let (before, after) = (spring.linear(now.x[k]), spring.linear(next.x[k]));
        let (way, sum) = (next.x[k] - now.x[k], before.force + after.force);
        let size = way.length_squared();
        let lack = 2.0 * (spring.energy_j(now.x[k]) - spring.energy_j(next.x[k])) - sum.dot(way);
        let right = if size > TURN_MIN_RAD * TURN_MIN_RAD { way * (lack / size) } else { DVec3::ZERO };
        rows[slot].diag += after.stiffness * (h * h) + Sym3::identity(h * after.damping);
        rhs[slot] += (sum + right - (now.u[slot] + next.u[slot]) * after.damping) * h;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::tests::{free_tube, shake};

    #[test]
    fn mean_forces_do_work_equal_to_the_energy_change_and_keep_momentum() {
        let tube = free_tube(9);
        let (material, division) = (tube.material(), tube.division());
        let (mut now, mut next) = (shake(&tube, 3), shake(&tube, 8));
        // elasticity only: both velocities are zero
        now.u.fill(DVec3::ZERO);
        next.u.fill(DVec3::ZERO);
        let problem = SubstepProblem { material, division, springs: &[], h: 1.0, integrator: Default::default() };
        let (mut rows, mut rhs) = (vec![Row::ZERO; now.u.len()], vec![DVec3::ZERO; now.u.len()]);
        fill_mean(&problem, &now, &next, &mut rows, &mut rhs);
        let mut work = 0.0;
        let (mut push, mut turn) = (DVec3::ZERO, DVec3::ZERO);
        for k in 0..now.x.len() {
            work += 0.5 * rhs[2 * k].dot(next.x[k] - now.x[k]);
            push += rhs[2 * k];
            turn += ((now.x[k] + next.x[k]) * 0.5).cross(rhs[2 * k]);
        }
        for k in 0..now.q.len() {
            work += 0.5 * rhs[2 * k + 1].dot(cayley(next.q[k] * now.q[k].conjugate()));
            turn += rhs[2 * k + 1];
        }
        let size = now.elastic_j + next.elastic_j;
        let change = next.elastic_j - now.elastic_j;
        assert!((work + change).abs() < 1e-12 * size, "{work} J of work for {change} J"); // rounding of sums of 30 terms
        let forces: f64 = rhs.iter().map(|f| f.length()).sum();
        assert!(push.length() < 1e-12 * forces && turn.length() < 1e-12 * forces, "{push}, {turn} of {forces}");
    }
}
