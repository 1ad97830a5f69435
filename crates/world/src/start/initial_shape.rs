//! The shape of an agent or of a static solid in its starting pose.
//!
//! In: a member of the scene, an obstacle. Out: its form, its pose and a box around it.
//! Never here: detection of contacts.

use crate::description::scene::{Member, Spec};
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_core::{AgentId, Body, CurveState, Snapshot, SoftState};
use metachron_geometry::{CollisionShape, PlacedShape, ShapeKind, ShapePose, SolidShape};
use metachron_geometry::{Obstacle, Solid, ToolShape};
use metachron_models::rod::Tube;
use metachron_models::soft::SoftBody;

/// Half the size of the slab that replaces a plane, in multiples of a figure's half diagonal plus its distance from the plane.
const SLAB_SHARE: f64 = 4.0;
/// No part of a tool is farther from its tip than the length of its shaft plus this many shaft radii.
const TOOL_TIP_RADII: f64 = 12.0;

/// An agent's shape in its starting pose.
pub(super) struct StartShape {
    pub id: AgentId,
    pub form: CollisionShape,
    place: Pose,
    pub low: DVec3,
    pub high: DVec3,
}

#[derive(Clone)]
enum Pose {
    Solid(DVec3, DQuat),
    Chain(CurveState),
    Soft(SoftState),
    Tool(DVec3, DQuat, f64),
}

impl StartShape {
    pub fn box_touches(&self, other: &Self, reach_m: f64) -> bool {
        self.low.cmple(other.high + reach_m).all() && other.low.cmple(self.high + reach_m).all()
    }

    /// The same, moved by `by_m`.
    pub fn shifted(&self, by_m: DVec3) -> Self {
        let mut place = self.place.clone();
        match &mut place {
            Pose::Solid(at, _) | Pose::Tool(at, ..) => *at += by_m,
            Pose::Chain(CurveState { positions, .. }) | Pose::Soft(SoftState { positions, .. }) => {
                positions.iter_mut().for_each(|point| *point += by_m);
            }
        }
        Self { id: self.id, form: self.form.clone(), place, low: self.low + by_m, high: self.high + by_m }
    }

    /// Direction back along the shaft of a tool; `None` for other agents.
    pub fn shaft_direction(&self) -> Option<DVec3> {
        if let Pose::Tool(_, rotation, _) = &self.place { Some(*rotation * DVec3::NEG_Z) } else { None }
    }

    /// A static solid in its pose, if this figure may be inside it. A plane becomes a slab below this figure with its top at the plane.
    /// Meshes are left out: a figure inside one may be in its hollow.
    pub fn obstacle_shape(&self, obstacle: &Obstacle) -> Option<Self> {
        if matches!(obstacle.solid, Solid::Mesh { .. }) {
            return None;
        }
        let rotation = obstacle.rotation.normalize();
        let (middle, half) = ((self.low + self.high) * 0.5, (self.high - self.low) * 0.5);
        let (solid, place) = if matches!(obstacle.solid, Solid::Plane) {
            let up = rotation * DVec3::Z;
            let height = up.dot(middle - obstacle.position);
            if height > up.abs().dot(half) {
                return None;
            }
            let deep = SLAB_SHARE * (half.length() + height.abs());
            (Solid::Box { half_extents_m: DVec3::splat(deep) }, middle - up * (height + deep))
        } else {
            (obstacle.solid.clone(), obstacle.position)
        };
        let form = SolidShape::new(solid, DVec3::ZERO).ok()?;
        let radius = DVec3::splat(form.radius_m);
        let form = CollisionShape { traits: obstacle.traits, ..CollisionShape::new(ShapeKind::Solid(form), 0.0) };
        let fixed =
            Self { id: self.id, form, place: Pose::Solid(place, rotation), low: place - radius, high: place + radius };
        self.box_touches(&fixed, 0.0).then_some(fixed)
    }

    pub fn placed(&self) -> PlacedShape<'_> {
        let view = match &self.place {
            Pose::Solid(position, rotation) => ShapePose::Solid { position: *position, rotation: *rotation },
            Pose::Chain(curve) => ShapePose::Chain { positions: &curve.positions, radii_m: &curve.radii_m },
            Pose::Soft(soft) => ShapePose::Surface(&soft.positions),
            Pose::Tool(tip, rotation, jaw) => ShapePose::Tool { tip: *tip, rotation: *rotation, jaw: *jaw },
        };
        PlacedShape { form: &self.form, view }
    }
}

/// The shape of an agent at its start; `None` for one without contact.
pub(crate) fn shape(member: &Member) -> Option<StartShape> {
    let traits = member.spec.traits();
    let form = |kind| CollisionShape { traits, ..CollisionShape::new(kind, 0.0) };
    let (kind, place, low, high) = match &member.spec {
        Spec::Rigid(spec) => {
            let solid = SolidShape::new(spec.solid.clone(), DVec3::ZERO).ok()?;
            let (radius, at) = (DVec3::splat(solid.radius_m), spec.position);
            (ShapeKind::Solid(solid), Pose::Solid(at, spec.rotation.normalize()), at - radius, at + radius)
        }
        Spec::Tube(spec) => {
            let mut start = Snapshot::default();
            Tube::new(spec.clone()).ok()?.write_snapshot(&mut start);
            let Body::Curve(curve) = start.body else { return None };
            let radius = DVec3::splat(curve.radii_m.iter().copied().fold(0.0, f64::max));
            let low = curve.positions.iter().copied().reduce(DVec3::min)? - radius;
            let high = curve.positions.iter().copied().reduce(DVec3::max)? + radius;
            // held ends have no effect on overlap
            (ShapeKind::Chain, Pose::Chain(curve), low, high)
        }
        Spec::Soft(spec) => {
            let body = SoftBody::new(spec.clone()).ok()?;
            let Body::Soft(soft) = body.start() else { return None };
            let low = soft.positions.iter().copied().reduce(DVec3::min)?;
            let high = soft.positions.iter().copied().reduce(DVec3::max)?;
            let kind = body.form()?.kind.clone();
            (kind, Pose::Soft(soft), low, high)
        }
        Spec::Tool(spec) => {
            let (key, shape) = (spec.keyframes.first()?, ToolShape::default());
            let reach = DVec3::splat(shape.shaft_length_m + TOOL_TIP_RADII * shape.shaft_radius_m);
            let tip = key.tip_m + spec.starts_off_m;
            (ShapeKind::Tool(shape), Pose::Tool(tip, spec.start_rotation(), key.jaw), tip - reach, tip + reach)
        }
        Spec::Synthetic(_) | Spec::Custom(_) => return None,
    };
    Some(StartShape { id: member.id, form: form(kind), place, low, high })
}
