//! Axis-aligned boxes.
//!
//! In: points. Out: the box around them. Never here: speeds ([`metachron_core::Bounds`] has them).

use glam::{DMat3, DQuat, DVec3};

/// An axis-aligned box, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Its lowest coordinates.
    pub low: DVec3,
    /// Its highest coordinates.
    pub high: DVec3,
}

impl Aabb {
    /// The smallest box that contains all `points`.
    #[must_use]
    pub fn of(points: &[DVec3]) -> Self {
        let (low, high) =
            points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
        Self { low, high }
    }

    /// The cube about `centre` whose sides are `half_m` from it, metres.
    #[must_use]
    #[inline]
    pub fn about(centre: DVec3, half_m: f64) -> Self {
        Self { low: centre - half_m, high: centre + half_m }
    }

    /// The box without bounds.
    #[must_use]
    #[inline]
    pub const fn everywhere() -> Self {
        Self { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY }
    }

    /// The smallest box that contains both.
    #[must_use]
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Whether the two have a point in common.
    #[must_use]
    #[inline]
    pub fn meets(self, other: Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// The same with every side moved out by `by_m` metres.
    #[must_use]
    #[inline]
    pub fn grown(self, by_m: f64) -> Self {
        Self { low: self.low - by_m, high: self.high + by_m }
    }

    /// The box around this one in axes with this origin and this rotation to those of the box.
    #[must_use]
    pub fn seen_from(self, origin: DVec3, rotation: DQuat) -> Self {
        let back = DMat3::from_quat(rotation.conjugate());
        let (middle, half) = (back * ((self.low + self.high) * 0.5 - origin), (self.high - self.low) * 0.5);
        let half = back.x_axis.abs() * half.x + back.y_axis.abs() * half.y + back.z_axis.abs() * half.z;
        Self { low: middle - half, high: middle + half }
    }
}
