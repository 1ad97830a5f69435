//! Transfers a state from one division of a tube to another.
//!
//! In: the old division and state, the new division. Out: the new state: same length and mass, the same linear momentum to
//! rounding, angular momentum and shape to O(ε²). Never here: when to do it. Theory: docs/theory/rod.md, eq. 25, 30–32.

use super::discretization::{Discretization, densities, place_nodes};
use super::rotation::between;
use super::state::{RodMaterial, RodState};
use glam::{DQuat, DVec3};

/// A state of a tube on the division that it belongs to.
#[derive(Debug, Clone, Copy)]
pub struct MeshedRod<'a> {
    /// The state.
    pub state: &'a RodState,
    /// The division.
    pub division: &'a Discretization,
}

/// Working storage.
#[derive(Debug, Clone, Default)]
pub struct Remesher {
    /// Rotations from rest to now, sampled at the arc lengths `at`.
    rotations: Vec<DQuat>,
    at: Vec<f64>,
    /// Strains beyond rest in the segments' own axes.
    strains: Vec<DVec3>,
    bend: Vec<f64>,
    arcs: Vec<f64>,
}

impl Remesher {
    /// The arc lengths of `count` segments distributed by the present curvature; even where the tube is straight (eq. 25).
    pub fn arcs(&mut self, state: &RodState, old: &Discretization, count: usize) -> &[f64] {
        let last = state.t.len() - 1;
        let turn = |k: usize| if k == 0 || k > last { 0.0 } else { (state.t[k] - state.t[k - 1]).length() };
        self.bend.clear();
        self.bend.extend((0..=last).map(|k| {
            let beside = if k == 0 { turn(1) } else { 0.5 * (turn(k) + turn(k + 1)) };
            beside / old.length[k]
        }));
        densities(&mut self.bend, &old.length);
        place_nodes(&old.arc_m, &self.bend, count, &mut self.arcs);
        &self.arcs
    }

    /// Writes the state of `old` into `to` on division `new`.
    pub fn transfer(&mut self, material: &RodMaterial, old: MeshedRod<'_>, to: &mut RodState, new: &Discretization) {
        to.resize(new.segments());
        self.sample(material, old);
        self.shape(material, old, to, new);
        self.motion(material, old, to, new);
    }

    /// Samples rotations and strains of the old segments relative to rest.
    fn sample(&mut self, material: &RodMaterial, old: MeshedRod<'_>) {
        let MeshedRod { state: from, division: old } = old;
        self.rotations.clear();
        self.at.clear();
        self.strains.clear();
        if material.clamp[0] {
            self.rotations.push(DQuat::IDENTITY); // a wall does not turn
            self.at.push(0.0);
        }
        for k in 0..old.segments() {
            self.rotations.push(from.q[k] * old.frame[k].conjugate());
            self.at.push(old.middle_m(k));
            self.strains.push(from.q[k].conjugate() * from.e[k] - DVec3::Z * old.chord[k]);
        }
        if material.clamp[1] {
            self.rotations.push(DQuat::IDENTITY);
            self.at.push(old.total_m());
        }
    }

    /// Frames by interpolated rotations (eq. 30), positions by summing the strained segments (eq. 31).
    fn shape(&self, material: &RodMaterial, rod: MeshedRod<'_>, to: &mut RodState, new: &Discretization) {
        let MeshedRod { state: from, division: old } = rod;
        to.x[0] = from.x[0];
        for k in 0..new.segments() {
            let s = new.middle_m(k);
            to.q[k] = (self.rotation_at(s) * new.frame[k]).normalize();
            let strain = self.strain_at(old, s) + DVec3::Z * new.chord[k];
            to.x[k + 1] = to.x[k] + to.q[k] * strain * new.length[k];
        }
        self.place(material, rod, to, new);
    }

    /// Restores held ends, or the centre of mass where none is held.
    fn place(&self, material: &RodMaterial, rod: MeshedRod<'_>, to: &mut RodState, new: &Discretization) {
        let MeshedRod { state: from, division: old } = rod;
        let gap = from.x[old.segments()] - to.x[new.segments()];
        match material.held {
            [true, false] => {}
            [false, true] => to.x.iter_mut().for_each(|x| *x += gap),
            [true, true] => {
                let total = new.total_m();
                to.x.iter_mut().zip(&new.arc_m).for_each(|(x, s)| *x += gap * (s / total));
                to.x[new.segments()] = from.x[old.segments()];
            }
            [false, false] => {
                let shift = centre(from, old) - centre(to, new);
                to.x.iter_mut().for_each(|x| *x += shift);
            }
        }
    }

    /// Velocities by interpolation, then the missing momentum spread evenly over the free nodes (eq. 32).
    fn motion(&self, material: &RodMaterial, rod: MeshedRod<'_>, to: &mut RodState, new: &Discretization) {
        let MeshedRod { state: from, division: old } = rod;
        let count = new.segments();
        for (k, &s) in new.arc_m.iter().enumerate() {
            let (left, w) = old.locate(s);
            to.u[2 * k] = from.u[2 * left].lerp(from.u[2 * left + 2], w);
        }
        for k in 0..count {
            let (left, w) = bracket(old.segments(), |i| old.middle_m(i), new.middle_m(k));
            let right = (left + 1).min(old.segments() - 1);
            to.u[2 * k + 1] = from.u[2 * left + 1].lerp(from.u[2 * right + 1], w.clamp(0.0, 1.0));
        }
        let free = |k: usize| !(material.held[0] && k == 0 || material.held[1] && k == count);
        let share = |k: usize| {
            let before = if k > 0 { new.length[k - 1] } else { 0.0 };
            0.5 * (before + if k < count { new.length[k] } else { 0.0 })
        };
        let mass: f64 = (0..=count).filter(|&k| free(k)).map(share).sum();
        // twice: the second pass removes the rounding error of the first
        for _ in 0..2 {
            let missing = (flow(from, old) - flow(to, new)) / mass;
            (0..=count).filter(|&k| free(k)).for_each(|k| to.u[2 * k] += missing);
        }
    }

    fn rotation_at(&self, s: f64) -> DQuat {
        let (left, w) = bracket(self.at.len(), |i| self.at[i], s);
        let right = (left + 1).min(self.at.len() - 1);
        between(self.rotations[left], self.rotations[right], w)
    }

    fn strain_at(&self, old: &Discretization, s: f64) -> DVec3 {
        let (left, w) = bracket(old.segments(), |i| old.middle_m(i), s);
        let right = (left + 1).min(old.segments() - 1);
        self.strains[left].lerp(self.strains[right], w.clamp(0.0, 1.0))
    }
}

/// The interval of the `count` rising values `at` that contains or is nearest to `s`, and the share of it at `s`.
fn bracket(count: usize, at: impl Fn(usize) -> f64, s: f64) -> (usize, f64) {
    let (mut low, mut high) = (0, count - 1);
    while low + 1 < high {
        let middle = (low + high) / 2;
        if at(middle) <= s { low = middle } else { high = middle }
    }
    let size = at(high) - at(low);
    (low, if size > 0.0 { (s - at(low)) / size } else { 0.0 })
}

fn centre(state: &RodState, division: &Discretization) -> DVec3 {
    let sum: DVec3 = division.length.iter().zip(state.x.windows(2)).map(|(&l, x)| (x[0] + x[1]) * (0.5 * l)).sum();
    sum / division.total_m()
}

/// Linear momentum over mass per length, m²/s.
fn flow(state: &RodState, division: &Discretization) -> DVec3 {
    division.length.iter().enumerate().map(|(k, &l)| (state.u[2 * k] + state.u[2 * k + 2]) * (0.5 * l)).sum()
}
