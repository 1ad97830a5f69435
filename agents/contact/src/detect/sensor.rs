//! Pairs of a cluster that touch and of which one side is a sensor.
//!
//! In: members with the velocities they would have. Out: pairs that touch where a fine step begins, or that meet on their way through it.
//! Never here: forces, how often a pair has touched (`member/memory.rs`).

use crate::detect::pair::{Against, MET_M, Pair, Reaching, Round};
use crate::detect::reach::FAR_M;
use crate::detect::{Meeting, Passage, Search};
use crate::member::memory::Partner;
use glam::{DQuat, DVec3};
use metachron_geometry::narrow_phase::touches;
use metachron_geometry::{CollisionShape, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape};

/// A pair that touches, of which one side only senses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sensed {
    /// The participant that remembers it: the lower number.
    pub member: usize,
    pub partner: Partner,
}

impl Search {
    /// Finds all such pairs, of members that are near each other and of members with static solids.
    pub fn sense(&mut self, round: &Round<'_, '_>) {
        self.sensed.clear();
        let Round { scene, all, .. } = *round;
        let is_sensor = |member: usize| all[member].member.skin().is_some_and(|skin| skin.form.traits.is_sensor);
        if !(scene.has_sensors() || (0..all.len()).any(is_sensor)) {
            return;
        }
        let near = std::mem::take(&mut self.near);
        for &[a, b] in &near {
            if (is_sensor(a) || is_sensor(b))
                && all[a].may_touch(&all[b])
                && !scene.lets_through([all[a].id, all[b].id])
            {
                self.sense_pair(round, Pair { member: a, against: Against::Member(b) }, Partner::Agent(all[b].id));
            }
        }
        self.near = near;
        for (member, one) in all.iter().enumerate() {
            let Some(form) = one.member.skin().map(|skin| skin.form) else { continue };
            for (number, solid) in (0..).zip(scene.statics()) {
                let sensed = form.senses(&solid.form) && form.meets(&solid.form);
                if sensed && !scene.has_passage(Passage { body: one.id, solid: number }) {
                    let pair = Pair { member, against: Against::Static { number, solid } };
                    self.sense_pair(round, pair, Partner::Static(number));
                }
            }
        }
        self.sensed.sort_unstable_by_key(|sensed| (sensed.member, sensed.partner));
    }

    /// Takes up a pair if it touches.
    fn sense_pair(&mut self, round: &Round<'_, '_>, pair: Pair<'_>, partner: Partner) {
        let (bounds, their_m_s) = match pair.against {
            Against::Own => return,
            Against::Static { solid, .. } => (solid.bounds(), 0.0),
            Against::Member(other) => match self.boxes.of(other) {
                Some(there) => (there.skin, there.speed_m_s),
                None => return,
            },
        };
        let Some(here) = self.boxes.of(pair.member) else { return };
        let way_m = (here.speed_m_s + their_m_s) * round.h_s;
        if !here.skin.grown(way_m + MET_M).meets(bounds) {
            return;
        }
        self.touches.clear();
        let swept_m = (way_m > FAR_M).then_some(MET_M);
        let Meeting { after_s, .. } = self.touch(round, pair, Reaching { reach_m: MET_M, swept_m });
        let meets = after_s > 0.0 && after_s < round.h_s;
        if meets || self.touches.iter().any(|touch| touch.gap_m <= MET_M) || self.holds(round, pair) {
            self.sensed.push(Sensed { member: pair.member, partner });
        }
    }

    /// Whether one of a pair is inside the other, by a point of it: deep inside another body a skin has no places.
    fn holds(&mut self, round: &Round<'_, '_>, pair: Pair<'_>) -> bool {
        let Self { touches: into, scratch, point, .. } = self;
        let Some(here) = round.all[pair.member].member.skin() else { return false };
        into.clear();
        let there = match pair.against {
            Against::Own => return false,
            Against::Static { solid, .. } => solid.placed(),
            Against::Member(other) => match round.all[other].member.skin() {
                Some(there) => there,
                None => return false,
            },
        };
        if let Some(inside) = point.at(&here) {
            match pair.against {
                Against::Static { solid, .. } => solid.touches(&inside, 0.0, scratch, into),
                _ => _ = touches(&inside, &there, 0.0, scratch, into),
            }
        }
        if let Some(inside) = point.at(&there).filter(|_| into.is_empty()) {
            touches(&inside, &here, 0.0, scratch, into);
        }
        into.iter().any(|touch| touch.gap_m < 0.0)
    }
}

/// A point as a ball that is as good as none.
pub(crate) struct Point(Option<CollisionShape>);

impl Default for Point {
    fn default() -> Self {
        let ball = SolidShape::new(Solid::Ball { radius_m: MET_M }, DVec3::ZERO);
        Self(ball.ok().map(|ball| CollisionShape::new(ShapeKind::Solid(ball), 0.0)))
    }
}

impl Point {
    /// The ball at a point of a body; at a point of its surface where one is known, as a centre of mass may lie outside
    /// the shape.
    fn at(&self, body: &PlacedShape<'_>) -> Option<PlacedShape<'_>> {
        let position = match (body.view, &body.form.kind) {
            (ShapePose::Solid { position, rotation }, ShapeKind::Solid(SolidShape { solid, com_local, .. })) => {
                position + rotation * (corner(solid).unwrap_or(*com_local) - *com_local)
            }
            (ShapePose::Solid { position, .. }, _) => position,
            (ShapePose::Tool { tip, .. }, _) => tip,
            (ShapePose::Chain { positions, .. }, _) => *positions.first()?,
            (ShapePose::Surface(positions), ShapeKind::Surface(skin)) => positions[*skin.vertices.first()? as usize],
            _ => return None,
        };
        let view = ShapePose::Solid { position, rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: self.0.as_ref()?, view })
    }
}

/// A point of the skin of a solid that is made of points, in the solid's own axes.
fn corner(solid: &Solid) -> Option<DVec3> {
    match solid {
        Solid::Hull { points_m } => points_m.first().copied(),
        Solid::Mesh { points_m, triangles } => points_m.get(triangles.first()?[0] as usize).copied(),
        _ => None,
    }
}
