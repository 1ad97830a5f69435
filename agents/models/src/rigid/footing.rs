//! How a body stands on fixed solids, or tips over an edge or a corner on them.
//!
//! In: where it touches them. Out: what others have to know of that to push it. Never here: contacts that it solves.
//! Theory: docs/theory/coupling.md, eq. 7a and 7n.

use super::RigidBody;
use super::company::placed;
use glam::DVec3;
use metachron_core::Impulse;
use metachron_core::snapshot::{Footprint, STANDING_M_S};
use metachron_core::{Stand, Tips};
use metachron_geometry::Place;

/// Places nearer than this to a fixed solid carry, beside the skin, metres.
pub(super) const FEET_M: f64 = 2e-5;
/// On one or two feet a body only balances: pushed no farther from them than this, in its radii.
const BALANCE_RADII: f64 = 0.05;

impl RigidBody {
    /// How it stands on fixed solids, or tips over them.
    pub(super) fn footing(&mut self) -> (Option<Stand>, Option<Tips>) {
        let Some(print) = self.footprint() else { return (None, None) };
        let Some(normal) = print.normal() else { return (None, None) };
        let balance_m = BALANCE_RADII * self.world.mover.radius_m;
        if let Some(feet) = print.ends()
            && leans_m(self.motion.position, feet, normal) > balance_m
        {
            return (None, self.tip(normal, feet));
        }
        let stands = normal.dot(self.motion.velocity).abs() < STANDING_M_S;
        let weight_m_s2 = (-self.gravity.dot(normal)).max(0.0);
        (stands.then(|| print.stand(normal, weight_m_s2, balance_m)), None)
    }

    /// How it tips over `feet`, where it does and nobody whose world it shares holds it: it accelerates by that.
    fn tip(&mut self, normal: DVec3, feet: [DVec3; 2]) -> Option<Tips> {
        let Self { motion, spread, .. } = self;
        let (arms, spin) = (feet.map(|foot| foot - motion.position), motion.spin(spread));
        let stay = arms.iter().all(|arm| normal.dot(motion.velocity + spin.cross(*arm)).abs() < STANDING_M_S);
        if self.at_rest || self.held_up || !self.ties.is_empty() || !stay {
            return None;
        }
        let tips = Tips { normal, feet: arms, gravity: self.gravity, turning: DVec3::ZERO };
        let (tips, acceleration) = tips.fall(motion.inverse_inertia(spread))?;
        self.acceleration = acceleration;
        Some(tips)
    }

    /// What the feet over which it tips leave of the way on which an impulse has carried it.
    pub(super) fn hold(&self, carried: Impulse) -> Impulse {
        self.tips.map_or(carried, |tips| tips.hold(self.motion.inverse_inertia(&self.spread), carried))
    }

    /// The places where it touches fixed solids; `None` where one is no point of it.
    fn footprint(&mut self) -> Option<Footprint> {
        let Self { motion, world, company, meeting, obstacles, .. } = self;
        let (_, _, _, room, form) = company.split();
        let mine = placed(form, motion);
        let mut print = Footprint::default();
        for solid in obstacles.iter() {
            solid.touches(&mine, 2.0 * world.mover.skin_m() + FEET_M, room, &mut meeting.touches);
            for touch in &meeting.touches {
                let Place::Point(point) = touch.on_a else { return None };
                print.add(point, touch.normal);
            }
        }
        Some(print)
    }
}

/// How far what is at `centre` is from being over the line between two `feet`, metres.
fn leans_m(centre: DVec3, [a, b]: [DVec3; 2], normal: DVec3) -> f64 {
    let flat = |v: DVec3| v - normal * normal.dot(v);
    let (arm, span) = (flat(centre - a), flat(b - a));
    let share = (arm.dot(span) / span.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    arm.distance(span * share)
}
