//! Where two solids touch, as their pair remembers it: in the axes of the second, to move along with both.
//!
//! In: where the two are, and were. Out: the places now, if they are still known. Never here: how places are found, which pairs are asked for.
//! Theory: docs/theory/contact.md, section 1.

use glam::{DQuat, DVec3};
use metachron_geometry::{Place, ShapePose, Touch};

/// How far a point of one solid may have gone against the other since their places were found, metres: the gap below which sides have met.
pub(crate) const MOVED_M: f64 = 1e-6;

/// Where a solid is.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Pose {
    pub position: DVec3,
    pub rotation: DQuat,
}

/// Two solids: the pose of the first in the axes of the second, and that of the second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwoSolids {
    pub first: Pose,
    second: Pose,
    /// No point of the first is farther from its middle, metres.
    radius_m: f64,
}

/// All places of a pair that were nearer than a reach when it was searched last; none before. Where there are none the reach is as far as
/// the two are known to be apart.
#[derive(Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct FoundPlaces {
    /// The pose of the first solid then, in the axes of the second.
    pub first: Pose,
    pub reach_m: f64,
    /// The places, in the axes of the second solid.
    pub touches: Vec<Touch>,
}

impl Pose {
    pub const HERE: Self = Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// `None` for a shape that is no solid.
    fn of(view: ShapePose<'_>) -> Option<Self> {
        match view {
            ShapePose::Solid { position, rotation } => Some(Self { position, rotation }),
            _ => None,
        }
    }

    pub fn to_world(self, point: DVec3) -> DVec3 {
        self.position + self.rotation * point
    }

    pub fn to_local(self, point: DVec3) -> DVec3 {
        self.rotation.conjugate() * (point - self.position)
    }
}

impl TwoSolids {
    /// Two placed shapes, the second of a static solid where it is `None`; `None` where one is no solid.
    pub fn of(first: ShapePose<'_>, second: Option<ShapePose<'_>>, radius_m: f64) -> Option<Self> {
        let (first, second) = (Pose::of(first)?, second.map_or(Some(Pose::HERE), Pose::of)?);
        let turned = second.rotation.conjugate() * first.rotation;
        let first = Pose { position: second.to_local(first.position), rotation: turned };
        Some(Self { first, second, radius_m })
    }

    /// How far at most a point of the first has gone against the second since it was at `then`, metres.
    fn moved_m(&self, then: Pose) -> f64 {
        let turned = self.first.rotation * then.rotation.conjugate();
        let angle_rad = 2.0 * DVec3::new(turned.x, turned.y, turned.z).length();
        self.first.position.distance(then.position) + angle_rad * self.radius_m
    }

    /// A place in the axes of the second, into the world's; `by` moves a point that is fixed to the first.
    pub fn placed(&self, touch: &Touch, by: impl Fn(DVec3) -> DVec3) -> Touch {
        let Touch { on_a: Place::Point(a), on_b: Place::Point(b), .. } = *touch else { return *touch };
        let moved = by(a);
        Touch {
            normal: self.second.rotation * touch.normal,
            gap_m: touch.gap_m + touch.normal.dot(moved - a),
            on_a: Place::Point(self.second.to_world(moved)),
            on_b: Place::Point(self.second.to_world(b)),
            ..*touch
        }
    }

    /// A place of the world, in the axes of the second.
    pub fn unplaced(&self, touch: &Touch) -> Touch {
        let local = |place: Place| match place {
            Place::Point(point) => Place::Point(self.second.to_local(point)),
            other => other,
        };
        let normal = self.second.rotation.conjugate() * touch.normal;
        Touch { normal, on_a: local(touch.on_a), on_b: local(touch.on_b), ..*touch }
    }
}

impl Clone for FoundPlaces {
    fn clone(&self) -> Self {
        let Self { first, reach_m, touches } = self;
        Self { first: *first, reach_m: *reach_m, touches: touches.clone() }
    }

    // into storage that is there
    fn clone_from(&mut self, from: &Self) {
        (self.first, self.reach_m) = (from.first, from.reach_m);
        self.touches.clone_from(&from.touches);
    }
}

impl FoundPlaces {
    /// Whether they are all within `reach_m` that there are now.
    pub fn last(&self, solids: &TwoSolids, reach_m: f64) -> bool {
        let moved_m = solids.moved_m(self.first);
        reach_m + moved_m.max(MOVED_M) <= self.reach_m && (moved_m < MOVED_M || self.touches.is_empty())
    }
}
