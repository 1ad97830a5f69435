//! Springs that pull a rigid body: linearly implicit, stable at any stiffness, whatever the other end weighs.
//!
//! In: the motion, the springs, a step. Out: the velocities after the step and the force of each spring.
//! Never here: contacts; positions stay.
//!
//! With the generalised velocity u = (v, ω), the point Jacobian G = (1, −r×) and the spring's force at the *end* of the step,
//! M (u⁺ − u) = h M g + Σ Gᵀ h (k (x + h ẋ − p − h G u⁺) + c (ẋ − G u⁺)): one symmetric 6×6 system. The turning of r under
//! a force f adds the stiffness max(r·f, 0)(1 − r̂ r̂ᵀ) against turning, taken at the force of a first pass. A stiff spring
//! therefore never blows up: past k ≈ m/h² it simply carries its point to the target within the step.

use super::mass::Spread;
use super::motion::Motion;
use crate::{Anchor, Grip, Pull};
use glam::{DMat3, DVec3};

/// A spring on this body, and how its other end yields.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tie {
    /// The spring; its target is where the other end is now.
    pub pull: Pull,
    /// The distance at which it pulls nothing, metres, ≥ 0.
    pub rest_m: f64,
    /// Inverse mass of the other end, 1/kg; zero where that end is led.
    pub yields: DMat3,
    /// The impulse it gave this body in the last part, N·s.
    pub impulse: DVec3,
}

impl Tie {
    /// A spring whose other end is led.
    pub(super) const fn led(pull: Pull) -> Self {
        Self { pull, rest_m: 0.0, yields: DMat3::ZERO, impulse: DVec3::ZERO }
    }

    /// Where on the body it pulls, from the centre of mass: only an anchor in the body's own axes is a point of it.
    pub(super) fn arm(&self, motion: &Motion) -> Option<DVec3> {
        match self.pull.anchor {
            Anchor::Local(local) => Some(motion.rotation * local),
            Anchor::Arc(_) | Anchor::Vertex(_) => None,
        }
    }
}

/// Changes the velocities by gravity and the springs over `h` seconds; writes each spring's impulse, and its force for those
/// who hold the body.
///
/// Nothing is written and `false` returned where no spring holds a point of this body.
pub(super) fn pull(
    motion: &mut Motion,
    body: &Spread,
    (ties, gravity): (&mut [Tie], DVec3),
    h: f64,
    grips: &mut Vec<Grip>,
) -> bool {
    if !ties.iter().any(|tie| tie.arm(motion).is_some()) {
        return false;
    }
    let spin = motion.spin(body);
    let mut change = [0.0; 6];
    for pass in 0..2 {
        let mut system = System::mass(motion, body, gravity * h);
        for tie in ties.iter() {
            let Some(r) = tie.arm(motion) else { continue };
            let point_velocity = motion.velocity + spin.cross(r);
            let spring = Spring::new(tie, motion.position + r, point_velocity, h);
            system.add_spring(r, spring.resistance, spring.impulse);
            if pass > 0 {
                let force = spring.after(change, r) / h;
                let stiffness = r.dot(force).max(0.0);
                system.add_turning(r, h * h * stiffness, spin);
            }
        }
        change = system.solve();
    }
    grips.clear();
    for tie in ties.iter_mut() {
        let Some(r) = tie.arm(motion) else { continue };
        let spring = Spring::new(tie, motion.position + r, motion.velocity + spin.cross(r), h);
        tie.impulse = spring.after(change, r);
        grips.push(Grip { by: tie.pull.by, force_n: tie.impulse / h });
    }
    motion.velocity += DVec3::new(change[0], change[1], change[2]);
    let spin_change = DVec3::new(change[3], change[4], change[5]);
    motion.angular += motion.inertia_times(body, spin_change);
    true
}

/// A spring over one step: impulse = `impulse` − `resistance` × change of the point's velocity.
struct Spring {
    impulse: DVec3,
    resistance: DMat3,
}

impl Spring {
    /// The spring of `tie` on a point that moves with `velocity`. An end that yields by W makes R to (1 + R W)⁻¹ R.
    fn new(tie: &Tie, point: DVec3, velocity: DVec3, h: f64) -> Self {
        let (k, c) = (tie.pull.stiffness_n_m, tie.pull.damping_n_s_m);
        let slip = tie.pull.target_velocity - velocity;
        let (impulse, resistance) = if tie.rest_m > 0.0 {
            let along = (tie.pull.target - point).normalize_or(DVec3::Z);
            let stretch = (tie.pull.target - point).length() - tie.rest_m;
            let closing = slip.dot(along);
            let size = h * (k * (stretch + h * closing) + c * closing);
            (along * size, DMat3::from_cols(along * along.x, along * along.y, along * along.z))
        } else {
            (h * (k * (tie.pull.target + h * slip - point) + c * slip), DMat3::IDENTITY)
        };
        let resistance = resistance * (h * (h * k + c));
        if tie.yields == DMat3::ZERO {
            return Self { impulse, resistance };
        }
        let softer = (DMat3::IDENTITY + resistance * tie.yields).inverse();
        Self { impulse: softer * impulse, resistance: softer * resistance }
    }

    /// The impulse where the body's velocities change so, at a point `r` from its centre.
    fn after(&self, change: [f64; 6], r: DVec3) -> DVec3 {
        self.impulse - self.resistance * point(change, r)
    }
}

/// The change of a point's velocity.
fn point(change: [f64; 6], r: DVec3) -> DVec3 {
    DVec3::new(change[0], change[1], change[2]) + DVec3::new(change[3], change[4], change[5]).cross(r)
}

/// A symmetric positive system for the change of (v, ω).
struct System {
    matrix: [[f64; 6]; 6],
    right: [f64; 6],
}

impl System {
    fn mass(motion: &Motion, body: &Spread, fall: DVec3) -> Self {
        let mut matrix = [[0.0; 6]; 6];
        for i in 0..3 {
            matrix[i][i] = body.mass_kg;
            let column = motion.inertia_times(body, DVec3::AXES[i]);
            (0..3).for_each(|j| matrix[3 + j][3 + i] = column[j]);
        }
        let p = fall * body.mass_kg;
        Self { matrix, right: [p.x, p.y, p.z, 0.0, 0.0, 0.0] }
    }

    fn add_spring(&mut self, r: DVec3, resistance: DMat3, impulse: DVec3) {
        // the rows of Gᵀ: forces pass as they are, torques as r ×
        let rows: [DVec3; 6] = std::array::from_fn(|i| match i {
            0..3 => DVec3::AXES[i],
            _ => DVec3::AXES[i - 3].cross(r),
        });
        for i in 0..6 {
            for j in 0..6 {
                self.matrix[i][j] += rows[i].dot(resistance * rows[j]);
            }
            self.right[i] += rows[i].dot(impulse);
        }
    }

    /// Stiffness (times h²) against turning across r.
    fn add_turning(&mut self, r: DVec3, stiffness: f64, spin: DVec3) {
        let axis = r.normalize_or_zero();
        let resist = stiffness * (spin - axis * axis.dot(spin));
        for i in 0..3 {
            for j in 0..3 {
                let unit = if i == j { 1.0 } else { 0.0 };
                self.matrix[3 + i][3 + j] += stiffness * (unit - axis[i] * axis[j]);
            }
            self.right[3 + i] -= resist[i];
        }
    }

    /// Solves by LDLᵀ without pivots: the matrix is positive definite.
    fn solve(mut self) -> [f64; 6] {
        let a = &mut self.matrix;
        for j in 0..6 {
            let d = a[j][j] - (0..j).map(|k| a[j][k] * a[j][k] * a[k][k]).sum::<f64>();
            a[j][j] = d;
            for i in j + 1..6 {
                let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k] * a[k][k]).sum();
                a[i][j] = (a[i][j] - sum) / d;
            }
        }
        let mut x = self.right;
        for i in 0..6 {
            x[i] -= (0..i).map(|k| a[i][k] * x[k]).sum::<f64>();
        }
        for i in (0..6).rev() {
            x[i] = x[i] / a[i][i] - (i + 1..6).map(|k| a[k][i] * x[k]).sum::<f64>();
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_solves_its_system() {
        let body =
            Spread { mass_kg: 2.0, com: DVec3::ZERO, moments: DVec3::new(0.1, 0.2, 0.3), axes: glam::DQuat::IDENTITY };
        let motion = Motion {
            position: DVec3::ONE,
            rotation: glam::DQuat::from_rotation_x(0.4),
            velocity: DVec3::X,
            angular: DVec3::Y,
        };
        let build = || {
            let mut system = System::mass(&motion, &body, DVec3::Z);
            system.add_spring(DVec3::new(0.1, -0.2, 0.3), DMat3::IDENTITY * 40.0, DVec3::new(1.0, 2.0, 3.0));
            system.add_turning(DVec3::new(0.1, -0.2, 0.3), 0.5, DVec3::ONE);
            system
        };
        let x = build().solve();
        let System { matrix, right } = build();
        for i in 0..6 {
            let left: f64 = (0..6).map(|j| matrix[i][j] * x[j]).sum();
            assert!((left - right[i]).abs() < 1e-12, "row {i}: {left} is not {}", right[i]); // rounding of numbers near 10
        }
    }
}
