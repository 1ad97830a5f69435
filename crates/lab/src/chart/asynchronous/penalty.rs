//! Penalty contact: a spring and a damper where skins overlap, as in most engines; for comparison with laws that know both sides.
//!
//! In: a place and how its two sides move. Out: the force on one side. Stable only below k = 0.55 μ/τ² for data of age τ. Never here: the
//! other side: it does the same for itself.

use glam::DVec3;
use metachron_contact::Neighbour;
use metachron_contact::member::Participant;
use metachron_contact::remote::PublishedShape;
use metachron_contact::step::KnownImpulse;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{ContactSide, Touch};

/// Below this slip speed, m/s, friction is proportional to the slip.
const STICK_M_S: f64 = 1e-3;

/// A place where two surfaces touch, as one side of it sees the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Approach {
    /// Distance of the surfaces, metres; below zero they overlap.
    pub(in super::super) gap_m: f64,
    /// Unit normal, towards this side.
    pub(in super::super) normal: DVec3,
    /// Velocity of this side relative to the other, m/s.
    pub(in super::super) velocity_m_s: DVec3,
}

/// The force on the side that the normal points to, newtons: the stiffness times the depth, less the damping times
/// the separation speed, never attractive; friction opposes the slip.
pub(in super::super) fn push_off_n(approach: Approach, stiffness_n_m: f64, damping_n_s_m: f64, friction: f64) -> DVec3 {
    let Approach { gap_m, normal, velocity_m_s: velocity } = approach;
    if gap_m >= 0.0 {
        return DVec3::ZERO;
    }
    let parting = velocity.dot(normal);
    let push = (-stiffness_n_m * gap_m - damping_n_s_m * parting).max(0.0);
    let slip = velocity - normal * parting;
    normal * push - slip * (friction * push / slip.length().max(STICK_M_S))
}

/// Overlaps of two skins.
#[derive(Default)]
pub(in super::super) struct Overlaps {
    shape: PublishedShape,
    narrow: NarrowPhaseScratch,
    touches: Vec<Touch>,
}

impl Overlaps {
    /// The impulses by which a member pushes itself off another's newest state in a step of `dt_s` seconds, as known impulses of its cluster.
    pub(in super::super) fn push_off(
        &mut self,
        one: &Participant<'_>,
        other: &Neighbour,
        penalty: &Penalty,
        known: &mut Vec<KnownImpulse>,
    ) {
        let Penalty { stiffness_n_m, damping_n_s_m, extrapolate, dt_s } = *penalty;
        let since_s = if extrapolate { one.context.time.secs_after(other.snapshot.time) } else { 0.0 };
        let (Some(skin), Some(form)) = (one.member.skin(), other.form.as_deref()) else { return };
        let body = &other.snapshot.body;
        if !self.shape.bring(body, since_s) {
            return;
        }
        let Some(theirs) = self.shape.placed(form) else { return };
        touches(&skin, &theirs, 0.0, &mut self.narrow, &mut self.touches);
        let friction = (skin.form.friction * form.friction).sqrt();
        for touch in self.touches.iter().filter(|touch| touch.gap_m < 0.0) {
            let side = one.member.skin_point(&touch.on_a, ContactSide::first(touch.normal)).side;
            let velocity_m_s = side.velocity(one.member.system().velocities) - self.shape.velocity(body, &touch.on_b);
            let approach = Approach { gap_m: touch.gap_m, normal: touch.normal, velocity_m_s };
            let impulse = push_off_n(approach, stiffness_n_m, damping_n_s_m, friction) * dt_s;
            known.push(KnownImpulse { member: 0, side, impulse });
        }
    }
}

/// A penalty law in a step.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Penalty {
    /// Stiffness of the contact, N/m, > 0; stable below 0.55 μ/τ².
    pub(in super::super) stiffness_n_m: f64,
    /// Damping of the contact, N·s/m, ≥ 0.
    pub(in super::super) damping_n_s_m: f64,
    /// Whether the other's state is brought forward to one's own time.
    pub(in super::super) extrapolate: bool,
    /// The step, seconds.
    pub(in super::super) dt_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_penalty_pushes_and_never_pulls() {
        let force = |gap_m: f64, v: f64| {
            push_off_n(Approach { gap_m, normal: DVec3::Z, velocity_m_s: DVec3::Z * v }, 100.0, 10.0, 0.0).z
        };
        assert_eq!(force(0.01, -1.0), 0.0);
        assert_eq!(force(-0.01, 0.0), 1.0);
        assert_eq!(force(-0.01, -0.1), 2.0);
        assert_eq!(force(-0.01, 1.0), 0.0);
    }

    #[test]
    fn friction_is_coulombs_against_the_slip() {
        let slipping = Approach { gap_m: -0.01, normal: DVec3::Z, velocity_m_s: DVec3::X * 0.2 };
        let force = push_off_n(slipping, 100.0, 0.0, 0.5);
        assert!(force.distance(DVec3::new(-0.5, 0.0, 1.0)) < 1e-15); // rounding
    }
}
