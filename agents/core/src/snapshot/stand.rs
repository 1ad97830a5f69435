//! How a body stands on something fixed, as others must know it who push it.
//!
//! In: the places where the ground bears it. Out: what it answers to impulses there. Never here: who pushes.

use crate::Impulse;
use glam::DVec3;

/// Feet whose normals differ by less than 8° stand on one level: the cosine.
const LEVEL: f64 = 0.99;
/// A body whose feet leave the ground or come down on it faster than this does not stand, m/s.
pub const STANDING_M_S: f64 = 0.05;

/// How a body stands on something fixed: pushed towards it, near the middle of its feet, the body does not yield.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    /// Unit normal, from what it stands on towards the body.
    pub normal: DVec3,
    /// The middle of the places where it stands, metres.
    pub centre: DVec3,
    /// A push whose line passes the middle no farther than this does not tip it, metres.
    pub reach_m: f64,
    /// How fast it would fall into the ground without it, m/s², ≥ 0: what is lifted off the ground loses that.
    pub weight_m_s2: f64,
}

impl Stand {
    /// Whether an impulse on a body whose centre of mass is at `centre` only presses it down: its line meets the ground
    /// between the feet (docs/theory/coupling.md, eq. 7a).
    #[must_use]
    pub fn bears(&self, centre: DVec3, impulse: Impulse) -> bool {
        let Self { normal, centre: feet, reach_m, .. } = *self;
        let along = impulse.linear.dot(normal);
        if along >= 0.0 {
            return false;
        }
        let feet = feet - centre;
        let depth = feet.dot(normal);
        let met = (normal.cross(impulse.angular) + (impulse.linear - normal * along) * depth) / along;
        met.distance(feet - normal * depth) <= reach_m
    }

    /// What is left of the change of velocity that impulses made off the ground and of the way that it has carried the body,
    /// where they came `since_s` seconds ago: the ground lets go of what is lifted, and its weight pulls it back
    /// (docs/theory/coupling.md, eq. 7f).
    #[must_use]
    pub fn lifted(&self, [change, way]: [DVec3; 2], since_s: f64) -> [DVec3; 2] {
        let (speed_m_s, height_m) = (change.dot(self.normal), way.dot(self.normal));
        if speed_m_s <= 0.0 || height_m <= 0.0 {
            return [change, way];
        }
        let (slower_m_s, lower_m) = (self.weight_m_s2 * since_s, 0.5 * self.weight_m_s2 * since_s * since_s);
        // it may have come down again
        let lost = if lower_m < height_m { [slower_m_s, lower_m] } else { [speed_m_s, height_m] };
        [change - self.normal * lost[0], way - self.normal * lost[1]]
    }

    /// What the ground leaves of an impulse that it bears, and of the way that it would have carried the body.
    #[must_use]
    pub fn leaves(&self, impulse: Impulse) -> Impulse {
        let linear = impulse.linear - self.normal * impulse.linear.dot(self.normal);
        Impulse { linear, angular: DVec3::ZERO }
    }
}

/// The places where a body stands, as they are found one by one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Footprint {
    normal: Option<DVec3>,
    tilted: bool,
    low: DVec3,
    high: DVec3,
    sum: DVec3,
    last: DVec3,
    count: u32,
}

impl Footprint {
    /// Takes in a `point` that is borne along the unit vector `up`.
    pub fn add(&mut self, point: DVec3, up: DVec3) {
        let first = *self.normal.get_or_insert(up);
        self.tilted |= first.dot(up) < LEVEL;
        if self.count == 0 {
            (self.low, self.high) = (point, point);
        }
        (self.low, self.high) = (self.low.min(point), self.high.max(point));
        (self.sum, self.last, self.count) = (self.sum + point, point, self.count + 1);
    }

    /// The normal of its feet, where there are some and all of them are on one level.
    #[must_use]
    pub fn normal(&self) -> Option<DVec3> {
        self.normal.filter(|_| !self.tilted)
    }

    /// How a body stands there along its `normal`, of so much weight along that, m/s². A square of feet bears pushes as far as half its
    /// side, a triangle less; on one or two feet a body only balances, pushed as far as `balance_m` from their middle.
    #[must_use]
    pub fn stand(&self, normal: DVec3, weight_m_s2: f64, balance_m: f64) -> Stand {
        let spread = self.high - self.low;
        let spread = spread - normal * normal.dot(spread);
        let reach_m = if self.count > 2 { 0.25 * spread.length() } else { balance_m };
        Stand { normal, centre: self.sum / f64::from(self.count.max(1)), reach_m, weight_m_s2 }
    }

    /// Its one or two feet, twice the same for one; `None` for more.
    #[must_use]
    pub fn ends(&self) -> Option<[DVec3; 2]> {
        match self.count {
            1 => Some([self.last; 2]),
            2 => Some([self.sum - self.last, self.last]),
            _ => None,
        }
    }
}
