//! The part of a law's slope that is not symmetric: friction that follows its pressure, and a shift that follows its slip.
//!
//! In: a row and where it is. Out: a matrix of rank one. Never here: equations, and how they are solved (`gradients.rs`).
//! Theory: `docs/theory/clusters.md`, eq. 8b and C3.

use super::rows::{Point, Row};
use crate::solve::cones::cone::{Law, Projection};
use glam::{DMat3, DVec3};

/// By how much the impulse of a row changes beyond its symmetric gain: by `gives` for each unit of the velocity along `sees`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Skew {
    /// In the row's frame.
    pub gives: DVec3,
    /// In the row's frame, 1/kg times the reciprocal unit of `gives`.
    pub sees: DVec3,
}

/// The part of a row's exact slope beyond its symmetric gain.
pub(crate) struct Followed {
    pub skew: Skew,
    pub more: DVec3,
}

impl Skew {
    pub const NONE: Self = Self { gives: DVec3::ZERO, sees: DVec3::ZERO };

    /// The impulse that a row gives less where its velocity changes by this.
    pub fn impulse(&self, velocity: DVec3) -> DVec3 {
        self.gives * self.sees.dot(velocity)
    }
}

/// How the friction of a sliding contact follows its pressure, of a row with this image; `None` for all else.
pub(crate) fn follow_pressure(row: &Row, image: &Projection, pulled: DVec3) -> Option<Followed> {
    let Law::Coulomb { friction } = row.law else { return None };
    let slides = image.slopes.x == 1.0 && image.slopes.y == 0.0 && friction > 0.0;
    let (w, r) = (row.scale, row.compliance);
    let gives = image.axes.y_axis * friction;
    slides.then(|| Followed { skew: Skew { gives, sees: DVec3::X / r }, more: gives * (1.0 - r / w) * pulled.x })
}

/// How the shift of a contact follows its slip, of a row of this gain; `pulled` is the change of its impulse if no velocity changed.
pub(crate) fn follow_slip(row: &Row, at: Point, gain: DMat3, pulled: DVec3) -> Option<Followed> {
    let Law::Coulomb { friction } = row.law else { return None };
    let r = row.compliance;
    let slip = (at.velocity + at.impulse * r).with_x(0.0).try_normalize()?;
    let pushed = gain.x_axis;
    let gives = pushed * (friction / (1.0 + r * friction * slip.dot(pushed)));
    Some(Followed { skew: Skew { gives, sees: slip - gain * slip * r }, more: gives * (-r * slip.dot(pulled)) })
}
