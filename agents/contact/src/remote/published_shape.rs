//! The matter of an agent outside a cluster: its skin and its points, as published in its snapshot and as predicted.
//!
//! In: published bodies, velocities. Out: placed skins, points, which slots an impulse at a site acts on. Never here: how it answers impulses.

use glam::{DQuat, DVec3};
use metachron_core::{Anchor, Body, Impulse, LocalBlock, Site};
use metachron_geometry::{CollisionShape, Place, PlacedShape, ShapeKind, ShapePose};

/// How a body moves as a whole.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub velocity_m_s: DVec3,
    pub spin_rad_s: DVec3,
}

impl Motion {
    /// The motion of a published body; `None` for a deformable.
    pub fn of(body: &Body) -> Option<Self> {
        let (velocity_m_s, spin_rad_s) = match body {
            Body::Rigid(rigid) => (rigid.velocity, rigid.spin),
            Body::Tool(tool) => (tool.velocity, tool.spin),
            _ => return None,
        };
        Some(Self { velocity_m_s, spin_rad_s })
    }

    /// The velocity of a point at an arm from its centre, m/s.
    pub fn at(&self, arm_m: DVec3) -> DVec3 {
        self.velocity_m_s + self.spin_rad_s.cross(arm_m)
    }
}

/// The matter of another agent, where it is as far as it is known.
#[derive(Debug, Clone, Default)]
pub struct PublishedShape {
    /// Centre of mass or tip, of a body that moves as a whole.
    pub(crate) centre: DVec3,
    pub(crate) rotation: DQuat,
    jaw: Option<f64>,
    /// Nodes or vertices, and how they move without a block, m/s.
    pub(crate) points: Vec<DVec3>,
    pub(crate) drift: Vec<DVec3>,
    radii_m: Vec<f64>,
    pub(crate) arc_m: Vec<f64>,
}

impl PublishedShape {
    /// Takes in a published body, `since_s` seconds later as its velocities lead it; whether it has matter.
    pub fn bring(&mut self, body: &Body, since_s: f64) -> bool {
        let known = self.take(body);
        self.go_on(Motion::of(body), since_s);
        known
    }

    /// Moves its points by their drift, and all of it as it moves as a whole, for some seconds.
    pub(crate) fn go_on(&mut self, whole: Option<Motion>, for_s: f64) {
        self.drift.iter().zip(&mut self.points).for_each(|(v, x)| *x += *v * for_s);
        let Some(Motion { velocity_m_s, spin_rad_s }) = whole else { return };
        for (slot, velocity) in [(0, velocity_m_s), (1, spin_rad_s)] {
            self.shift(&LocalBlock { slot, velocity, acceleration: DVec3::ZERO }, DVec3::ZERO, for_s);
        }
    }

    /// The velocity of a point of its skin, as published, m/s.
    #[must_use]
    pub fn velocity(&self, body: &Body, place: &Place) -> DVec3 {
        let of = |point: u32| self.drift.get(point as usize).copied().unwrap_or(DVec3::ZERO);
        match *place {
            Place::Point(point) => Motion::of(body).map_or(DVec3::ZERO, |whole| whole.at(point - self.centre)),
            Place::Chain { segment, share, .. } => of(segment).lerp(of(segment + 1), share),
            Place::Surface { vertices, shares } => {
                vertices.into_iter().zip(shares).map(|(vertex, share)| of(vertex) * share).sum()
            }
        }
    }

    /// Takes in a published body; whether it has matter.
    pub(crate) fn take(&mut self, body: &Body) -> bool {
        self.points.clear();
        self.drift.clear();
        self.arc_m.clear();
        self.jaw = None;
        match body {
            Body::Nothing => return false,
            Body::Rigid(rigid) => (self.centre, self.rotation) = (rigid.position, rigid.rotation),
            Body::Tool(tool) => (self.centre, self.rotation, self.jaw) = (tool.tip, tool.rotation, Some(tool.jaw)),
            Body::Curve(curve) => {
                self.points.extend_from_slice(&curve.positions);
                self.drift.extend_from_slice(&curve.velocities);
                self.radii_m.clone_from(&curve.radii_m);
                self.arc_m.extend_from_slice(&curve.arc_m);
            }
            Body::Soft(soft) => {
                self.points.extend_from_slice(&soft.positions);
                self.drift.extend_from_slice(&soft.velocities);
            }
        }
        true
    }

    /// The body's skin there.
    #[must_use]
    pub fn placed<'a>(&'a self, form: &'a CollisionShape) -> Option<PlacedShape<'a>> {
        let Self { centre: position, rotation, points, radii_m, .. } = self;
        let view = match &form.kind {
            ShapeKind::Solid(_) => ShapePose::Solid { position: *position, rotation: *rotation },
            ShapeKind::Tool(_) => ShapePose::Tool { tip: *position, rotation: *rotation, jaw: self.jaw? },
            ShapeKind::Chain => ShapePose::Chain { positions: points, radii_m },
            ShapeKind::Surface(_) => ShapePose::Surface(points),
        };
        Some(PlacedShape { form, view })
    }

    /// The place of the point that a slot is about; `None` of a spin, and of a body that moves as a whole.
    pub(crate) fn point_of(&self, slot: u32) -> Option<usize> {
        let place = if self.arc_m.is_empty() { Some(slot) } else { (slot.is_multiple_of(2)).then_some(slot / 2) };
        place.map(|place| place as usize).filter(|place| *place < self.points.len())
    }

    pub(crate) fn point(&self, slot: u32) -> Option<DVec3> {
        self.point_of(slot).map(|place| self.points[place])
    }

    pub(crate) fn fastest(&self) -> impl Iterator<Item = f64> + '_ {
        self.drift.iter().map(|v| v.length())
    }

    pub(crate) fn locate(&self, arc_m: f64) -> Option<(usize, f64)> {
        let last = self.arc_m.len().checked_sub(2)?;
        let segment = self.arc_m.partition_point(|&s| s < arc_m).saturating_sub(1).min(last);
        let length = self.arc_m[segment + 1] - self.arc_m[segment];
        Some((segment, if length > 0.0 { ((arc_m - self.arc_m[segment]) / length).clamp(0.0, 1.0) } else { 0.0 }))
    }

    /// Moves the part of the body that a block stands for, by its velocity for some seconds and by `way`; points have
    /// moved by their drift already.
    pub(crate) fn shift(&mut self, block: &LocalBlock, way: DVec3, for_s: f64) {
        match (self.point_of(block.slot), self.points.is_empty(), block.slot) {
            (Some(place), ..) => self.points[place] += (block.velocity - self.drift[place]) * for_s + way,
            (None, true, 0) => self.centre += block.velocity * for_s + way,
            (None, true, _) => {
                let turn = block.velocity * for_s + way;
                if turn != DVec3::ZERO {
                    self.rotation = (DQuat::from_scaled_axis(turn) * self.rotation).normalize();
                }
            }
            // a tube's segments turn with their nodes
            (None, false, _) => {}
        }
    }

    /// Visits the shares of slots in an impulse at a site.
    pub(crate) fn visit_blocks(&self, site: Site, impulse: Impulse, mut visit: impl FnMut(u32, DVec3)) {
        match site {
            Site::Whole => {
                visit(0, impulse.linear);
                visit(1, impulse.angular);
            }
            Site::Vertex(vertex) => visit(vertex, impulse.linear),
            Site::Arc(arc_m) => {
                let Some((segment, share)) = self.locate(arc_m) else { return };
                let slot = 2 * segment as u32;
                visit(slot, impulse.linear * (1.0 - share));
                visit(slot + 1, impulse.angular);
                visit(slot + 2, impulse.linear * share);
            }
        }
    }
}

/// The material point of a site.
pub(crate) fn anchor_of(site: Site) -> Anchor {
    match site {
        Site::Whole => Anchor::Local(DVec3::ZERO),
        Site::Arc(arc_m) => Anchor::Arc(arc_m),
        Site::Vertex(vertex) => Anchor::Vertex(vertex),
    }
}
