//! The stress in a tube, in a state that it has published.
//!
//! In: a tube of the specification of the one that published it, and the curve. Out: a number for every node. Never here: steps, damping.
//! Theory: docs/theory/rod.md, eq. 5–9.

use super::discretization::Discretization;
use super::rotation::director;
use super::spec::Section;
use super::state::Joint;
use super::tube::Tube;
use glam::DVec3;
use metachron_core::CurveState;

impl Tube {
    /// The greatest von Mises stress in the section at every node of a curve that a tube of the same specification published, Pa, ≥ 0: of stretch,
    /// bending and twist beyond rest, of a round section. `None` where it is no such curve.
    #[must_use]
    pub fn von_mises_pa(&self, curve: &CurveState) -> Option<Vec<f64>> {
        let CurveState { arc_m, positions, frames, radii_m, .. } = curve;
        let last = frames.len();
        if last == 0 || [arc_m.len(), positions.len(), radii_m.len()].iter().any(|count| *count != last + 1) {
            return None;
        }
        let mut division = Discretization::default();
        division.rebuild(&self.skeleton, arc_m);
        let Section { young_pa, poisson, .. } = self.spec.section;
        let extension = |k: usize| {
            let along = director(frames[k]).dot(positions[k + 1] - positions[k]);
            along / division.length[k] - division.chord[k]
        };
        let of_node = |k: usize| {
            let (left, right) = (k.saturating_sub(1), k.min(last - 1));
            let axis = director(frames[left]);
            let before = if k == 0 { division.wall[0] } else { frames[left] };
            let after = if k == last { division.wall[1] } else { frames[right] };
            let is_free = k == 0 && !self.material.clamp[0] || k == last && !self.material.clamp[1];
            let bent = if is_free { DVec3::ZERO } else { Joint::between(&division, k, before, after).curvature() };
            let twist = axis.dot(bent);
            let outer = (bent - axis * twist).length() * radii_m[k];
            let along_pa = young_pa * (0.5 * (extension(left) + extension(right)).abs() + outer);
            let across_pa = 0.5 * young_pa / (1.0 + poisson) * twist * radii_m[k];
            along_pa.hypot(3.0_f64.sqrt() * across_pa)
        };
        Some((0..=last).map(of_node).collect())
    }
}
