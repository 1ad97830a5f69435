//! A tube's publication: its snapshot, and the way back from one.
//!
//! In: a tube between two steps. Out: its curve, or the tube with another. Never here: steps.

use super::residual;
use super::state::RodState;
use super::tube::Tube;
use crate::set_motion::check_nodes;
use glam::DVec3;
use metachron_core::{Bounds, CurveState, Snapshot, unit_rotation};

/// The bounding box of a tube in this state that is nowhere wider than `radius_m`.
pub fn bounds(state: &RodState, radius_m: f64) -> Bounds {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for x in &state.x {
        (low, high) = (low.min(*x), high.max(*x));
    }
    let speed = state.u.iter().step_by(2).map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
    Bounds { low: low - radius_m, high: high + radius_m, speed_m_s: speed }
}

impl Tube {
    /// Writes everything except the time.
    pub(super) fn publish(&self, into: &mut Snapshot) {
        into.clear();
        into.resolution = Some(self.resolution);
        into.nodes = Some(self.now.x.len() as u32);
        into.energy_j = self.energy_j();
        into.residual_m = residual::estimate_m(&self.now, &self.material, &self.division);
        (into.at_rest, into.acceleration) = (self.at_rest, self.acceleration);
        into.bounds = Some(bounds(&self.now, self.widest_m()));
        self.publish_curve(into);
    }

    /// Takes the curve of another state: its sections stay as they are.
    ///
    /// # Errors
    /// The reason why the curve does not fit; nothing is changed then.
    pub(super) fn take_curve(&mut self, curve: &CurveState) -> Result<(), String> {
        let (last, held) = (self.now.x.len() - 1, self.material.held);
        let is_held = |node: usize| node == 0 && held[0] || node == last && held[1];
        check_nodes(&self.now.x, [&curve.positions, &curve.velocities], is_held)?;
        if curve.frames.len() != self.now.q.len() {
            let (found, parts) = (curve.frames.len(), self.now.q.len());
            return Err(format!("the state has {found} frames; the tube has {parts} segments"));
        }
        if let Some(at) = curve.frames.iter().position(|q| unit_rotation(*q).is_none()) {
            return Err(format!("frame {at} of the state is no rotation"));
        }
        let Self { now, material, division, .. } = self;
        for (node, (x, v)) in curve.positions.iter().zip(&curve.velocities).enumerate() {
            if !is_held(node) {
                (now.x[node], now.u[2 * node]) = (*x, *v);
            }
        }
        for (part, q) in curve.frames.iter().enumerate() {
            let is_clamped = part == 0 && material.clamp[0] || part + 1 == last && material.clamp[1];
            if !is_clamped {
                (now.q[part], now.u[2 * part + 1]) = (q.normalize(), DVec3::ZERO);
            }
        }
        now.strain(material, division);
        self.begin_anew();
        Ok(())
    }

    fn publish_curve(&self, into: &mut Snapshot) {
        let curve = into.body.curve_mut();
        curve.arc_m.clone_from(&self.division.arc_m);
        curve.positions.clone_from(&self.now.x);
        curve.velocities.clear();
        curve.velocities.extend(self.now.u.iter().step_by(2));
        curve.frames.clone_from(&self.now.q);
        curve.radii_m.clear();
        curve.flattening_m.clear();
        if let Some(wall) = &self.wall {
            curve.radii_m.extend((0..wall.now.shape.len()).map(|node| wall.mean_m(node)));
            curve.flattening_m.extend((0..wall.now.shape.len()).map(|node| wall.flattening_m(node)));
        } else {
            curve.radii_m.extend(self.division.arc_m.iter().map(|&s| self.radius_at_m(s)));
        }
    }
}
