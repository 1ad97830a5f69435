//! The tube's own estimate of its error in space, metres.
//!
//! In: a state. Out: the largest sagitta between a chord and the bent curve. Never here: errors in time.
//! Theory: docs/theory/rod.md, eq. 29.

use super::discretization::Discretization;
use super::state::{Joint, RodMaterial, RodState};

/// max over joints of |κ − κ₀| l̄²/8: second order in ε, zero in the stress-free state (eq. 29).
pub fn estimate_m(state: &RodState, material: &RodMaterial, division: &Discretization) -> f64 {
    let count = division.segments();
    let inner = (1..count).map(|k| (k, state.q[k - 1], state.q[k]));
    let start = material.clamp[0].then(|| (0, division.wall[0], state.q[0]));
    let end = material.clamp[1].then(|| (count, state.q[count - 1], division.wall[1]));
    let sagitta = |(k, before, after)| {
        let joint = Joint::between(division, k, before, after);
        // at a wall l̄ is half a segment; the wall mirrors the other half
        let reach = if k == 0 || k == count { 2.0 } else { 1.0 } / division.joint[k];
        let curvature = joint.strain.length() * division.joint[k];
        curvature * reach * reach / 8.0
    };
    inner.chain(start).chain(end).map(sagitta).fold(0.0, f64::max)
}
