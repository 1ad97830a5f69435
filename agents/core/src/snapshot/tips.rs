//! How a body tips over an edge or a corner that something fixed bears, as others must know it who push it.
//!
//! In: where its feet are, its weight. Out: what its feet give against an impulse, how it turns. Never here: who pushes.
//! Theory: docs/theory/coupling.md, eq. 7n.

use crate::{Impulse, Twist};
use glam::{DMat3, DVec3};

/// Two feet that answer each other more nearly alike than this are one.
const ALIKE: f64 = 1e-6;

/// A body whose middle is not over its one or two feet: it turns over them. They push, and slide freely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tips {
    /// Unit normal, from what it stands on towards the body.
    pub normal: DVec3,
    /// Its feet from its centre of mass, metres; twice the same for one.
    pub feet: [DVec3; 2],
    /// How it would fall without its feet, m/s².
    pub gravity: DVec3,
    /// How its weight makes it turn, rad/s²; how its centre moves is the snapshot's acceleration.
    pub turning: DVec3,
}

impl Tips {
    /// The same with how it turns by its weight, and how its centre accelerates, where its inverse mass and inertia are `inverse`; `None`
    /// where its weight does not press it on a foot.
    #[must_use]
    pub fn fall(self, inverse: (f64, DMat3)) -> Option<(Self, DVec3)> {
        let weight = Impulse { linear: self.gravity / inverse.0, angular: DVec3::ZERO };
        let held = self.hold(inverse, weight);
        let turning = inverse.1 * held.angular;
        (held != weight).then_some((Self { turning, ..self }, held.linear * inverse.0))
    }

    /// The velocities that an impulse causes, m/s and rad/s; whether the feet are taken to be `pressed`, if that is known.
    #[must_use]
    pub fn answer(&self, inverse: (f64, DMat3), [linear, angular]: Twist, pressed: Option<bool>) -> Twist {
        let free = Impulse { linear, angular };
        let all = match pressed {
            Some(true) => self.pin(inverse, free),
            Some(false) => free,
            None => self.hold(inverse, free),
        };
        [all.linear * inverse.0, inverse.1 * all.angular]
    }

    /// An impulse about the centre of mass together with what the feet give against it: whoever would go into the ground does not, and
    /// nobody is held down.
    #[must_use]
    pub fn hold(&self, inverse: (f64, DMat3), impulse: Impulse) -> Impulse {
        let [a, b] = self.feet;
        let (at_a, at_b) = (self.goes_in(inverse, a, impulse), self.goes_in(inverse, b, impulse));
        let (aa, ab, bb) = self.feet_yield(inverse);
        if self.is_pressed(inverse, impulse) {
            self.pin(inverse, impulse)
        } else if at_a > 0.0 && at_b * aa <= at_a * ab {
            impulse + self.push(a, at_a / aa)
        } else if at_b > 0.0 && at_a * bb <= at_b * ab {
            impulse + self.push(b, at_b / bb)
        } else {
            impulse
        }
    }

    /// Whether an impulse only presses it on its feet.
    #[must_use]
    pub fn is_pressed(&self, inverse: (f64, DMat3), impulse: Impulse) -> bool {
        self.gives(inverse, impulse).iter().all(|n_s| *n_s >= 0.0)
    }

    /// The same where the feet can pull as well: linear.
    fn pin(&self, inverse: (f64, DMat3), impulse: Impulse) -> Impulse {
        let [of_a, of_b] = self.gives(inverse, impulse);
        impulse + self.push(self.feet[0], of_a) + self.push(self.feet[1], of_b)
    }

    /// What each foot gives so that it stays on its level, N·s.
    fn gives(&self, inverse: (f64, DMat3), impulse: Impulse) -> [f64; 2] {
        let [at_a, at_b] = self.feet.map(|foot| self.goes_in(inverse, foot, impulse));
        let (aa, ab, bb) = self.feet_yield(inverse);
        let both = aa * bb - ab * ab;
        if both > ALIKE * aa * bb {
            [at_a * bb - at_b * ab, at_b * aa - at_a * ab].map(|of| of / both)
        } else {
            [0.5 * at_a / aa; 2]
        }
    }

    /// How the feet yield to a push on the first, on the other, and the one to a push on the other, 1/kg.
    fn feet_yield(&self, inverse: (f64, DMat3)) -> (f64, f64, f64) {
        let [a, b] = self.feet;
        let yields = |at: DVec3, by: DVec3| -self.goes_in(inverse, at, self.push(by, 1.0));
        (yields(a, a), yields(a, b), yields(b, b))
    }

    /// How fast an impulse drives the body into the ground at `foot`, m/s.
    fn goes_in(&self, (inverse_mass, inverse_inertia): (f64, DMat3), foot: DVec3, impulse: Impulse) -> f64 {
        -self.normal.dot(impulse.linear * inverse_mass + (inverse_inertia * impulse.angular).cross(foot))
    }

    /// What the ground gives at `foot`.
    fn push(&self, foot: DVec3, n_s: f64) -> Impulse {
        Impulse { linear: self.normal * n_s, angular: foot.cross(self.normal) * n_s }
    }

    /// Whether all of it is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        [self.normal, self.feet[0], self.feet[1], self.turning, self.gravity].iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half extents of a box of 0.5 kg that stands on the edge at −x, −z.
    const HALF: DVec3 = DVec3::new(0.05, 0.04, 0.02);
    const MASS_KG: f64 = 0.5;

    fn inverse() -> (f64, DMat3) {
        let DVec3 { x, y, z } = HALF;
        let moments = DVec3::new(y * y + z * z, x * x + z * z, x * x + y * y) * (MASS_KG / 3.0);
        (MASS_KG.recip(), DMat3::from_diagonal(moments.recip()))
    }

    const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

    fn over(feet: [DVec3; 2]) -> (Tips, DVec3) {
        let tips = Tips { normal: DVec3::Z, feet, gravity: GRAVITY, turning: DVec3::ZERO };
        tips.fall(inverse()).unwrap()
    }

    fn on_edge() -> (Tips, DVec3) {
        over([-1.0, 1.0].map(|side| DVec3::new(-HALF.x, side * HALF.y, -HALF.z)))
    }

    /// The velocity of the point at `arm` from the centre along z by a push of 1 N·s there, times the mass.
    fn gives(tips: &Tips, arm: DVec3) -> f64 {
        let [v, w] = tips.answer(inverse(), [DVec3::Z, arm.cross(DVec3::Z)], None);
        (v + w.cross(arm)).z * MASS_KG
    }

    #[test]
    fn a_box_on_an_edge_falls_about_it_as_a_pendulum_does_whose_foot_slides() {
        let (tips, acceleration) = on_edge();
        // m z̈ a + I α = m g a with z̈ = a α, about the edge at a
        let inertia = (HALF.x * HALF.x + HALF.z * HALF.z) / 3.0;
        let alpha = 9.81 * HALF.x / (HALF.x * HALF.x + inertia);
        assert!(tips.turning.distance(DVec3::Y * alpha) < 1e-9 * alpha, "{tips:?}, not {alpha}");
        assert!(acceleration.distance(DVec3::NEG_Z * HALF.x * alpha) < 1e-9, "{acceleration}");
    }

    #[test]
    fn a_push_that_presses_its_edge_meets_a_lever_and_one_that_lifts_it_the_free_body() {
        let (tips, _) = on_edge();
        let inertia = (HALF.x * HALF.x + HALF.z * HALF.z) / 3.0;
        let lever = |x: f64| (HALF.x + x).powi(2) / (HALF.x * HALF.x + inertia);
        let free = |x: f64| 1.0 + x * x / inertia;
        for x in [0.025, 0.04, 0.05] {
            let given = gives(&tips, DVec3::new(x, 0.0, -HALF.z));
            assert!((given - lever(x)).abs() < 1e-9, "{x}: {given}, not {}", lever(x));
        }
        for x in [-0.04, -0.01, 0.015] {
            let given = gives(&tips, DVec3::new(x, 0.0, -HALF.z));
            assert!((given - free(x)).abs() < 1e-9, "{x}: {given}, not {}", free(x));
        }
    }

    #[test]
    fn no_foot_holds_the_body_down_and_none_goes_in() {
        let (tips, _) = on_edge();
        let (inverse_mass, inverse_inertia) = inverse();
        for at in [[0.04, 0.03], [0.04, 0.04], [0.02, -0.04], [-0.03, 0.04], [0.05, 0.0]] {
            for up in [-1.0, 1.0] {
                let (arm, linear) = (DVec3::new(at[0], at[1], 0.0), DVec3::new(0.3, 0.1, up));
                let impulse = Impulse { linear, angular: arm.cross(linear) };
                let held = tips.hold((inverse_mass, inverse_inertia), impulse);
                assert!((held - impulse).linear.z >= 0.0, "{at:?}: {held:?}");
                for foot in tips.feet {
                    let v = held.linear * inverse_mass + (inverse_inertia * held.angular).cross(foot);
                    assert!(v.z > -1e-9, "{at:?}, {up}: {v}");
                }
            }
        }
    }

    #[test]
    fn one_foot_told_twice_is_one() {
        let foot = DVec3::new(-HALF.x, HALF.y, -HALF.z);
        let (tips, acceleration) = over([foot; 2]);
        let at_foot = acceleration + tips.turning.cross(foot);
        assert!(at_foot.z.abs() < 1e-9 && acceleration.z < 0.0, "{at_foot}");
        assert!(Tips { gravity: DVec3::Z, ..tips }.fall(inverse()).is_none(), "nothing presses it there");
    }
}
