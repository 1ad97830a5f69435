//! Where an agent's matter is and how it moves: the bodies that snapshots hold, and material points of them.
//!
//! In: a model writes its state. Out: points, probes, bounds. Never here: how anything moves.

use crate::AgentId;
use glam::{DQuat, DVec2, DVec3};

/// Position of matter and the fastest speed at which it may leave.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bounds {
    /// The lowest coordinates, metres.
    pub low: DVec3,
    /// The highest coordinates, metres.
    pub high: DVec3,
    /// The largest speed of any point, m/s.
    pub speed_m_s: f64,
}

/// The state of an agent's matter; which one is fixed for an agent's life.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub enum Body {
    /// No matter (a synthetic agent).
    #[default]
    Nothing,
    /// A tube or cable: a framed curve with a radius.
    Curve(CurveState),
    /// A rigid body.
    Rigid(RigidState),
    /// A driven tool with jaws.
    Tool(ToolState),
    /// A sheet, solid or rope: vertices.
    Soft(SoftState),
}

/// The vertices of a soft body. The agent's shape (`metachron_geometry::SurfaceShape`) joins them.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct SoftState {
    /// Positions, metres, world axes.
    pub positions: Vec<DVec3>,
    /// Their velocities, m/s.
    pub velocities: Vec<DVec3>,
    /// The nodes that carry them, as the agent published them; `None` where the vertices are solved for themselves.
    pub nodes: Option<SoftNodes>,
}

/// The nodes of a cage or a lattice, which carry the vertices of a soft body. How many there are changes with its ε.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct SoftNodes {
    /// Positions, metres, world axes.
    pub positions: Vec<DVec3>,
    /// Their velocities, m/s.
    pub velocities: Vec<DVec3>,
}

/// A framed curve of N segments between N + 1 nodes. Positions are in metres, world axes.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct CurveState {
    /// Rest arc length of each node in metres, rising from 0 to the rest length; N + 1 entries.
    pub arc_m: Vec<f64>,
    /// Node positions; N + 1 entries.
    pub positions: Vec<DVec3>,
    /// Node velocities in m/s; N + 1 entries.
    pub velocities: Vec<DVec3>,
    /// Section frames, one per segment: the third axis (z) is the axial director; N entries.
    pub frames: Vec<DQuat>,
    /// Outer radius at each node in metres, the mean of a section that is not round; N + 1 entries.
    pub radii_m: Vec<f64>,
    /// How far the section at each node is from round, metres: in the direction φ of the axes of the segment before it (of the first one at
    /// the first node) the outer radius is larger by x cos 2φ + y sin 2φ. N + 1 entries; none where all sections are round.
    pub flattening_m: Vec<DVec2>,
}

/// The pose and motion of a rigid body, about its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RigidState {
    /// Centre of mass, metres.
    pub position: DVec3,
    /// Rotation from the body's axes to the world's.
    pub rotation: DQuat,
    /// Velocity of the centre of mass, m/s.
    pub velocity: DVec3,
    /// Angular velocity in world axes, rad/s.
    pub spin: DVec3,
}

/// Jaws that pass below this opening grasp.
pub const GRASP_BELOW: f64 = 0.2;

/// A driven tool: the tip between its jaws, the shaft along the tool's own −z.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ToolState {
    /// The point between the jaws, metres.
    pub tip: DVec3,
    /// Where its drive leads that point, metres.
    pub led: DVec3,
    /// Rotation from the tool's axes to the world's.
    pub rotation: DQuat,
    /// Velocity of the tip, m/s.
    pub velocity: DVec3,
    /// Angular velocity in world axes, rad/s.
    pub spin: DVec3,
    /// Opening of the jaws: 0 shut … 1 wide open.
    pub jaw: f64,
    /// The grasp of the jaws, if any.
    pub grasp: Option<Grasp>,
    /// The rigid body that the open jaws are about to grasp, or have just released: it may come between them.
    pub admits: Option<AgentId>,
    /// Magnitude of the force that the grasped body exerts on the tool, newtons.
    pub force_n: f64,
    /// Whether nothing drives it any more: its script has ended without anything holding it back, and no user spring is on it.
    pub is_idle: bool,
}

/// A tool's attachment to a material point of another agent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Grasp {
    /// The grasped agent.
    pub target: AgentId,
    /// The material point grasped.
    pub anchor: Anchor,
    /// Rotational attachment between the jaws; `None` where the body may turn freely.
    pub orientation: Option<GraspOrientation>,
    /// Stiffness of the attachment, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping of the attachment, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

/// Rotational attachment of a rigid body to jaws of length `arm_m` that press along all of it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GraspOrientation {
    /// Rotation from the body's axes to the tool's at which the attachment exerts no torque.
    pub rotation: DQuat,
    /// The resistance to turning about every axis is that of springs and dampers of the grasp's strength at this distance, metres, ≥ 0.
    pub arm_m: f64,
}

/// A material point of a body: it moves with the matter, whatever the resolution.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Anchor {
    /// The point of a curve's axis at this rest arc length in metres.
    Arc(f64),
    /// A point of a rigid body in its own axes, metres from the centre of mass.
    Local(DVec3),
    /// A vertex of a soft body.
    Vertex(u32),
}

/// The force with which `by` holds this agent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Grip {
    /// The agent that holds; `None` for the user's spring.
    pub by: Option<AgentId>,
    /// The force on this agent, newtons, world axes.
    pub force_n: DVec3,
}

impl Default for RigidState {
    fn default() -> Self {
        Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY, velocity: DVec3::ZERO, spin: DVec3::ZERO }
    }
}

impl CurveState {
    /// Position and velocity of the material point at rest arc length `arc_m`, clamped to the curve's ends;
    /// `None` for a curve without nodes.
    #[must_use]
    pub fn point_at(&self, arc_m: f64) -> Option<(DVec3, DVec3)> {
        let (left, w) = self.locate(arc_m).or_else(|| (!self.positions.is_empty()).then_some((0, 0.0)))?;
        let right = (left + 1).min(self.positions.len() - 1);
        Some((
            self.positions[left].lerp(self.positions[right], w),
            self.velocities[left].lerp(self.velocities[right], w),
        ))
    }
}

impl CurveState {
    /// The segment that contains the material point at rest arc length `arc_m`, and the point's share of it, 0 … 1;
    /// clamped to the curve's ends. `None` for a curve without segments.
    #[must_use]
    pub fn locate(&self, arc_m: f64) -> Option<(usize, f64)> {
        let last = self.arc_m.len().checked_sub(2)?;
        let segment = self.arc_m.partition_point(|&s| s < arc_m).saturating_sub(1).min(last);
        let length = self.arc_m[segment + 1] - self.arc_m[segment];
        let share = if length > 0.0 { ((arc_m - self.arc_m[segment]) / length).clamp(0.0, 1.0) } else { 0.0 };
        Some((segment, share))
    }
}

impl Body {
    /// The state of a tool; `None` for any other body.
    #[must_use]
    pub const fn tool(&self) -> Option<&ToolState> {
        if let Self::Tool(tool) = self { Some(tool) } else { None }
    }

    /// Position and velocity of a material point; `None` where the body has no such point.
    #[must_use]
    pub fn point(&self, anchor: Anchor) -> Option<(DVec3, DVec3)> {
        match (self, anchor) {
            (Self::Curve(curve), Anchor::Arc(arc_m)) => curve.point_at(arc_m),
            (Self::Rigid(body), Anchor::Local(local)) => {
                let arm = body.rotation * local;
                Some((body.position + arm, body.velocity + body.spin.cross(arm)))
            }
            (Self::Tool(tool), Anchor::Local(local)) => {
                let arm = tool.rotation * local;
                Some((tool.tip + arm, tool.velocity + tool.spin.cross(arm)))
            }
            (Self::Soft(soft), Anchor::Vertex(vertex)) => {
                Some((*soft.positions.get(vertex as usize)?, *soft.velocities.get(vertex as usize)?))
            }
            _ => None,
        }
    }

    /// The point a probe at `at` (0 start … 1 end of a curve's rest length) reports: position and velocity.
    /// A soft body reports the vertex at that share of its vertex numbers: its first corner at 0, the opposite one at 1.
    /// Any other body reports its centre of mass or tip.
    #[must_use]
    pub fn probe(&self, at: f64) -> Option<(DVec3, DVec3)> {
        match self {
            Self::Curve(curve) => curve.point_at(at * curve.arc_m.last()?),
            Self::Soft(soft) => {
                let last = soft.positions.len().checked_sub(1)?;
                self.point(Anchor::Vertex((at.clamp(0.0, 1.0) * last as f64).round() as u32))
            }
            Self::Nothing => None,
            _ => self.point(Anchor::Local(DVec3::ZERO)),
        }
    }

    /// Leads it on by its velocities for `ahead_s` seconds; below zero, back. No force acts meanwhile, and a tool does not turn.
    pub fn lead(&mut self, ahead_s: f64) {
        let move_on = |positions: &mut [DVec3], velocities: &[DVec3]| {
            positions.iter_mut().zip(velocities).for_each(|(position, velocity)| *position += *velocity * ahead_s);
        };
        match self {
            Self::Nothing => {}
            Self::Curve(curve) => move_on(&mut curve.positions, &curve.velocities),
            Self::Rigid(rigid) => {
                rigid.position += rigid.velocity * ahead_s;
                rigid.rotation = DQuat::from_scaled_axis(rigid.spin * ahead_s) * rigid.rotation;
            }
            Self::Tool(tool) => tool.tip += tool.velocity * ahead_s,
            Self::Soft(soft) => move_on(&mut soft.positions, &soft.velocities),
        }
    }

    /// The material point nearest to a place, metres: of a curve the nearest of its axis, of a soft body its nearest vertex, of a rigid body or
    /// a tool the place itself, which moves with it. `None` where there is no matter.
    #[must_use]
    pub fn anchor_near(&self, place_m: DVec3) -> Option<Anchor> {
        let nearest = |count: usize, distance2: &dyn Fn(usize) -> f64| {
            (0..count).min_by(|a, b| distance2(*a).total_cmp(&distance2(*b)))
        };
        match self {
            Self::Nothing => None,
            Self::Rigid(rigid) => Some(Anchor::Local(rigid.rotation.inverse() * (place_m - rigid.position))),
            Self::Tool(tool) => Some(Anchor::Local(tool.rotation.inverse() * (place_m - tool.tip))),
            Self::Soft(soft) => {
                let vertex = nearest(soft.positions.len(), &|k| soft.positions[k].distance_squared(place_m))?;
                Some(Anchor::Vertex(vertex as u32))
            }
            Self::Curve(curve) => {
                let share = |k: usize| {
                    let (from, along) = (curve.positions[k], curve.positions[k + 1] - curve.positions[k]);
                    ((place_m - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
                };
                let foot = |k: usize| curve.positions[k].lerp(curve.positions[k + 1], share(k));
                let segments = curve.positions.len().saturating_sub(1);
                let k = nearest(segments, &|k| foot(k).distance_squared(place_m))?;
                Some(Anchor::Arc(curve.arc_m[k] + (curve.arc_m[k + 1] - curve.arc_m[k]) * share(k)))
            }
        }
    }

    /// Whether every number is finite. A body that is not finite is never published.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Nothing => true,
            Self::Curve(c) => {
                c.positions.iter().all(|p| p.is_finite())
                    && c.velocities.iter().all(|v| v.is_finite())
                    && c.frames.iter().all(|q| q.is_finite())
                    && c.radii_m.iter().all(|r| r.is_finite())
                    && c.flattening_m.iter().all(|f| f.is_finite())
            }
            Self::Rigid(b) => {
                b.position.is_finite() && b.rotation.is_finite() && b.velocity.is_finite() && b.spin.is_finite()
            }
            Self::Tool(t) => {
                [t.tip, t.velocity, t.spin].iter().all(|v| v.is_finite()) && t.rotation.is_finite() && t.jaw.is_finite()
            }
            Self::Soft(s) => {
                let nodes = s.nodes.iter().flat_map(|nodes| nodes.positions.iter().chain(&nodes.velocities));
                s.positions.iter().chain(&s.velocities).chain(nodes).all(|p| p.is_finite())
            }
        }
    }

    /// The soft body to write into; reuses the storage if this is one already.
    pub fn soft_mut(&mut self) -> &mut SoftState {
        if !matches!(self, Self::Soft(_)) {
            *self = Self::Soft(SoftState::default());
        }
        match self {
            Self::Soft(soft) => soft,
            _ => unreachable!("made a soft body above"),
        }
    }

    /// The curve to write into; reuses the storage if this is one already.
    pub fn curve_mut(&mut self) -> &mut CurveState {
        if !matches!(self, Self::Curve(_)) {
            *self = Self::Curve(CurveState::default());
        }
        match self {
            Self::Curve(curve) => curve,
            _ => unreachable!("made a curve above"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent() -> CurveState {
        CurveState {
            arc_m: vec![0.0, 1.0, 3.0],
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 0.0)],
            velocities: vec![DVec3::ZERO, DVec3::Z, DVec3::Z],
            ..CurveState::default()
        }
    }

    fn turning() -> RigidState {
        RigidState { position: DVec3::X, velocity: DVec3::Y, spin: DVec3::Z, ..RigidState::default() }
    }

    #[test]
    fn a_body_goes_on_as_it_moves() {
        let mut body = Body::Rigid(turning());
        body.lead(0.5);
        let Body::Rigid(led) = body else { panic!("{body:?}") };
        assert_eq!(led.position, DVec3::new(1.0, 0.5, 0.0));
        // half a second at 1 rad/s
        assert!((led.rotation * DVec3::X).distance(DVec3::new(0.5_f64.cos(), 0.5_f64.sin(), 0.0)) < 1e-15);
        let mut body = Body::Curve(bent());
        body.lead(0.5);
        assert_eq!(body.curve_mut().positions, [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.5), DVec3::new(1.0, 2.0, 0.5)]);
    }

    #[test]
    fn the_nearest_material_point_is_where_it_is_seen() {
        let place = DVec3::new(1.2, 0.5, 0.0);
        // a quarter of the second segment, which is 2 m long
        assert_eq!(Body::Curve(bent()).anchor_near(place), Some(Anchor::Arc(1.5)));
        let rigid = Body::Rigid(RigidState { rotation: DQuat::from_rotation_z(0.7), ..turning() });
        let found = rigid.point(rigid.anchor_near(place).unwrap()).unwrap();
        assert!(found.0.distance(place) < 1e-15);
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let soft = Body::Soft(SoftState { velocities: vec![DVec3::ZERO; 3], positions, nodes: None });
        assert_eq!(soft.anchor_near(place), Some(Anchor::Vertex(1)));
        assert_eq!(Body::Nothing.anchor_near(place), None);
        assert_eq!(Body::Curve(CurveState::default()).anchor_near(place), None);
    }
}
