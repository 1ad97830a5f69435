//! Changes made by the previous substep: required by two-step methods, and useful as a guess of the next state.
//!
//! In: the states at both ends of a substep. Out: the state from which a backward difference of second order is one step of
//! implicit Euler. Never here: the choice of method without a past. Theory: docs/theory/rod.md, eq. 43, 44.

use super::rotation::{exp, log, unit};
use super::state::RodState;
use glam::DVec3;

/// Changes over the last substep, in slots.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct History {
    /// Changes of node positions, metres, and of segment frames, radians in world axes.
    way: Vec<DVec3>,
    /// Changes of velocities, m/s and rad/s.
    gain: Vec<DVec3>,
    /// The length of that substep, seconds; zero where there is no past.
    span_s: f64,
    /// Energy that backward differences have lost since velocities last jumped, and may regain, J.
    reserve_j: f64,
}

impl History {
    /// Stores the changes of a substep of `h` seconds.
    pub fn record(&mut self, from: &RodState, to: &RodState, h: f64) {
        self.span_s = h;
        self.gain.clear();
        self.gain.extend(to.u.iter().zip(&from.u).map(|(b, a)| *b - *a));
        self.way.clear();
        for k in 0..to.q.len() {
            self.way.push(to.x[k] - from.x[k]);
            self.way.push(log(to.q[k] * from.q[k].conjugate()));
        }
        let last = to.x.len() - 1;
        self.way.push(to.x[last] - from.x[last]);
    }

    /// Copies another past, into the existing storage.
    pub fn copy_from(&mut self, other: &Self) {
        self.way.clone_from(&other.way);
        self.gain.clone_from(&other.gain);
        (self.span_s, self.reserve_j) = (other.span_s, other.reserve_j);
    }

    /// Discards the past: velocities have jumped, or the tube was divided anew.
    pub fn forget(&mut self) {
        (self.span_s, self.reserve_j) = (0.0, 0.0);
    }

    /// Energy that a substep may regain, J: backward differences alternately lose and regain it, and lose on the whole.
    pub fn reserve_j(&self) -> f64 {
        self.reserve_j
    }

    /// Books the rise of energy of a substep, J; a loss is stored for later.
    pub fn spend(&mut self, rise_j: f64) {
        self.reserve_j = (self.reserve_j - rise_j).max(0.0);
    }

    /// Predicted change of velocity in the next `h` seconds, by linear extrapolation.
    pub fn expected(&self, slot: usize, h: f64) -> DVec3 {
        if self.span_s > 0.0 { self.gain[slot] * (h / self.span_s) } else { DVec3::ZERO }
    }

    /// Writes the state from which a step of implicit Euler of the returned length, seconds, is a backward difference over
    /// this substep of `h` seconds and the one before it (eq. 43); implicit Euler itself where there is none.
    pub fn start(&self, now: &RodState, into: &mut RodState, h: f64) -> f64 {
        let ratio = if self.span_s > 0.0 { h / self.span_s } else { 0.0 };
        let (first, third) = ((1.0 + 2.0 * ratio) / (1.0 + ratio), ratio * ratio / (1.0 + ratio));
        let share = third / first;
        into.resize(now.q.len());
        into.x.copy_from_slice(&now.x);
        into.q.copy_from_slice(&now.q);
        into.u.copy_from_slice(&now.u);
        if share > 0.0 {
            into.x.iter_mut().zip(self.way.iter().step_by(2)).for_each(|(x, way)| *x += *way * share);
            let turns = self.way.iter().skip(1).step_by(2);
            into.q.iter_mut().zip(turns).for_each(|(q, turn)| *q = unit(exp(*turn * share) * *q));
            into.u.iter_mut().zip(&self.gain).for_each(|(u, gain)| *u += *gain * share);
        }
        h / first
    }
}
