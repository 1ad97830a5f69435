//! The tube as compliant constraints (XPBD, MMC16), projected one by one from one end to the other and back.
//!
//! In: a state and the velocities without elasticity. Out: the velocities that lead to the projected nodes and
//! frames. Never here: gravity, external springs, contact. Theory: docs/theory/rod.md, eq. 41, 42.

use super::discretization::Discretization;
use super::rotation::{bend_share, exp, log, unit};
use super::state::{DividedRod, RodMaterial, RodState};
use super::sym3::Sym3;
use glam::{DQuat, DVec3};

/// Working storage.
#[derive(Debug, Clone, Default)]
pub struct Projector {
    x: Vec<DVec3>,
    q: Vec<DQuat>,
    /// Accumulated multipliers of stretch and shear, in each segment's own axes.
    pull: Vec<DVec3>,
    /// Accumulated multipliers of bend and twist, in the axes of the segment before each joint.
    turn: Vec<DVec3>,
    /// Changes of velocity by the last projection, in slots.
    gain: Vec<DVec3>,
}

/// Constants of a projection.
struct Constants<'a> {
    material: &'a RodMaterial,
    division: &'a Discretization,
    /// 1/h².
    rate2: f64,
}

impl Projector {
    /// Projects the state that `velocities` reach from `now` in `h` seconds, and corrects them to reach the projected one.
    pub fn project(&mut self, now: &RodState, velocities: &mut [DVec3], rod: DividedRod<'_>, h: f64) {
        let constants = Constants { material: rod.material, division: rod.division, rate2: 1.0 / (h * h) };
        let count = now.q.len();
        self.predict(now, velocities, h);
        for k in 0..count {
            self.joint(k, &constants);
            self.segment(k, &constants);
        }
        self.joint(count, &constants);
        for k in (0..count).rev() {
            self.segment(k, &constants);
            self.joint(k, &constants);
        }
        self.gain.iter_mut().step_by(2).for_each(|way| *way /= h);
        for k in 0..count {
            self.gain[2 * k + 1] = log(self.q[k] * now.q[k].conjugate()) / h - velocities[2 * k + 1];
        }
        velocities.iter_mut().zip(&self.gain).for_each(|(v, gain)| *v += *gain);
    }

    fn predict(&mut self, now: &RodState, velocities: &[DVec3], h: f64) {
        let count = now.q.len();
        self.x.clear();
        self.x.extend(now.x.iter().zip(velocities.iter().step_by(2)).map(|(x, v)| *x + *v * h));
        self.q.clear();
        self.q.extend(now.q.iter().zip(velocities.iter().skip(1).step_by(2)).map(|(q, w)| unit(exp(*w * h) * *q)));
        self.pull.clear();
        self.pull.resize(count, DVec3::ZERO);
        self.turn.clear();
        self.turn.resize(count + 1, DVec3::ZERO);
        self.gain.clear();
        self.gain.resize(2 * count + 1, DVec3::ZERO);
    }

    /// Moves a node, and sums up its displacement: differences of positions would round its momentum.
    fn shift(&mut self, node: usize, way: DVec3) {
        self.x[node] += way;
        self.gain[2 * node] += way;
    }

    /// C = Rᵀ u − s₀ ẑ with compliance K⁻¹/l (eq. 41).
    fn segment(&mut self, k: usize, constants: &Constants<'_>) {
        let RodMaterial { ea, ga, rotary, .. } = *constants.material;
        let (l, q) = (constants.division.length[k], self.q[k]);
        let u = q.conjugate() * ((self.x[k + 1] - self.x[k]) / l);
        let (wa, wb) = (constants.inverse_mass(k), constants.inverse_mass(k + 1));
        let compliance = DVec3::new(1.0 / ga, 1.0 / ga, 1.0 / ea) * (constants.rate2 / l);
        let own = 1.0 / (rotary * l);
        let turned = Sym3::outer(DVec3::new(0.0, u.z, -u.y), own)
            + Sym3::outer(DVec3::new(-u.z, 0.0, u.x), own)
            + Sym3::outer(DVec3::new(u.y, -u.x, 0.0), 0.5 * own);
        let whole = turned + Sym3::identity((wa + wb) / (l * l)) + Sym3::diagonal(compliance);
        let Some(inverse) = whole.inverse() else { return };
        let wrong = u - DVec3::Z * constants.division.chord[k] + compliance * self.pull[k];
        let given = inverse * -wrong;
        self.pull[k] += given;
        let way = q * given / l;
        self.shift(k, way * -wa);
        self.shift(k + 1, way * wb);
        let about = given.cross(u) * DVec3::new(own, own, 0.5 * own);
        self.q[k] = unit(exp(q * about) * q);
    }

    /// C = log(R_{k−1}ᵀ R_k) − ψ⁰ with compliance l̄ B⁻¹; at an end only where a wall clamps it (eq. 42).
    fn joint(&mut self, k: usize, constants: &Constants<'_>) {
        let RodMaterial { ei, gj, rotary, clamp, .. } = *constants.material;
        let count = self.q.len();
        if (k == 0 && !clamp[0]) || (k == count && !clamp[1]) {
            return;
        }
        let Discretization { wall, joint, bend, length, .. } = constants.division;
        let before = if k == 0 { wall[0] } else { self.q[k - 1] };
        let after = if k == count { wall[1] } else { self.q[k] };
        let theta = log(before.conjugate() * after);
        let compliance = DVec3::new(1.0 / ei, 1.0 / ei, 1.0 / gj) * (constants.rate2 / joint[k]);
        let own = |segment: usize, moves: bool| if moves { 1.0 / (rotary * length[segment]) } else { 0.0 };
        let (wa, wb) = (own(k.saturating_sub(1), k > 0), own(k.min(count - 1), k < count));
        let shape = DVec3::new(1.0, 1.0, 0.5);
        let wrong = theta - bend[k] + compliance * self.turn[k];
        let given = -wrong / (shape * (wa + wb) + compliance);
        self.turn[k] += given;
        // the gradient of the rotation vector (eq. 6)
        let across = theta.cross(given);
        let moment = given + across * 0.5 + theta.cross(across) * bend_share(theta.length_squared());
        if k > 0 {
            let turn = before * (moment * shape * -wa);
            self.q[k - 1] = unit(exp(turn) * before);
        }
        if k < count {
            let own_axes = after.conjugate() * (before * moment);
            self.q[k] = unit(exp(after * (own_axes * shape * wb)) * after);
        }
    }
}

impl Constants<'_> {
    /// Inverse mass of a node; zero where it is held.
    fn inverse_mass(&self, node: usize) -> f64 {
        let (length, held) = (&self.division.length, self.material.held);
        if (node == 0 && held[0]) || (node == length.len() && held[1]) {
            return 0.0;
        }
        let beside = [node.checked_sub(1), Some(node)].into_iter().flatten();
        2.0 / (self.material.mu * beside.filter_map(|k| length.get(k)).sum::<f64>())
    }
}
