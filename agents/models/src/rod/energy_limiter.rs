//! The last safeguard: removes energy that a substep created from the motion, and conserves momentum.
//!
//! In: a state and the energy to remove. Out: the same state, moving more slowly about its own rigid motion.
//! Never here: the decision to do so. Theory: docs/theory/rod.md, eq. 28.

use super::discretization::Discretization;
use super::state::{RodMaterial, RodState};
use super::sym3::Sym3;
use glam::DVec3;

/// Removes `excess` joules of kinetic energy, or all there is: of all motion where an end is held, else of the motion
/// beside the rigid motion with the same momentum.
pub fn remove(excess: f64, state: &mut RodState, material: &RodMaterial, division: &Discretization) {
    let held = material.held[0] || material.held[1];
    let rigid = if held { Rigid::default() } else { Rigid::of(state, material, division) };
    rigid.add(state, -1.0);
    state.measure_motion(material, division);
    let kinetic = state.kinetic_j;
    let share = if kinetic > 0.0 { (1.0 - excess / kinetic).max(0.0).sqrt() } else { 0.0 };
    state.u.iter_mut().for_each(|u| *u *= share);
    rigid.add(state, 1.0);
    state.measure_motion(material, division);
}

/// A rigid motion: velocity of a centre, and a spin.
#[derive(Debug, Clone, Copy, Default)]
struct Rigid {
    centre: DVec3,
    velocity: DVec3,
    spin: DVec3,
}

impl Rigid {
    /// The rigid motion with the momentum of `state`.
    fn of(state: &RodState, material: &RodMaterial, division: &Discretization) -> Self {
        let mass = material.mu * division.total_m();
        let weighted = division.length.iter().zip(state.x.windows(2)).map(|(&l, x)| (x[0] + x[1]) * (0.5 * l));
        let centre = weighted.sum::<DVec3>() / division.total_m();
        let (linear, angular) = state.momentum(material, division);
        let mut inertia = Sym3::default();
        for (k, &l) in division.length.iter().enumerate() {
            let (a, b) = (state.x[k] - centre, state.x[k + 1] - centre);
            let m = material.mu * l / 6.0;
            let square = m * (a.length_squared() + b.length_squared() + (a + b).length_squared());
            let spread = Sym3::outer(a, -m) + Sym3::outer(b, -m) + Sym3::outer(a + b, -m);
            let own = material.rotary * l;
            inertia += Sym3::identity(square + own) + spread + Sym3::outer(state.t[k], own);
        }
        let about = angular - centre.cross(linear);
        let spin = inertia.inverse().map_or(DVec3::ZERO, |inverse| inverse * about);
        Self { centre, velocity: linear / mass, spin }
    }

    /// Adds `scale` times this motion to the velocities of `state`.
    fn add(&self, state: &mut RodState, scale: f64) {
        for k in 0..state.x.len() {
            state.u[2 * k] += (self.velocity + self.spin.cross(state.x[k] - self.centre)) * scale;
        }
        for k in 0..state.q.len() {
            state.u[2 * k + 1] += self.spin * scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::tests::{free_tube, shake};

    #[test]
    fn removing_energy_keeps_momentum() {
        let tube = free_tube(12);
        let (material, division) = (tube.material(), tube.division());
        let mut state = shake(&tube, 3);
        let (energy, momentum) = (state.kinetic_j, state.momentum(material, division));
        remove(0.3 * energy, &mut state, material, division);
        let (after, kept) = (state.kinetic_j, state.momentum(material, division));
        // rounding of sums of a dozen terms
        assert!((after - 0.7 * energy).abs() < 1e-12 * energy, "{after} of {energy}");
        assert!((kept.0 - momentum.0).length() < 1e-12 * momentum.0.length());
        assert!((kept.1 - momentum.1).length() < 1e-12 * momentum.1.length());
    }
}
