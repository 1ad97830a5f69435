//! An agent's publication: its whole visible state at one moment of its own time.
//!
//! In: an agent writes itself into a [`Snapshot`] that is reused (no allocation once the sizes settle).
//! Out: drawing, coupling, probes and hashes read it. Never here: its transport between threads (the runtime does that).

mod lies;
mod stand;
mod tips;

pub use lies::{LiesOn, Upheld};
pub use stand::Stand;
pub(crate) use stand::{Footprint, STANDING_M_S};
pub use tips::Tips;

use crate::coupling::{Ledger, PairState, Rebound, Six, Sprung};
use crate::rod::CurveInertia;
use crate::soft::SoftInertia;
use crate::{AgentId, Rare, Resolution, SimSpan, SimTime};
use glam::{DMat3, DQuat, DVec3};

/// The state an agent last published, stamped with its own time.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// The agent's own time, written by the runtime when it publishes.
    pub time: SimTime,
    /// Delay of its time behind the scene's, written likewise: an agent that cannot keep up with its neighbours continues delayed.
    pub put_off: SimSpan,
    /// Length of its last step where that was shorter than its scene requests ([`crate::Agent::longest_step`]), written likewise; `None`
    /// otherwise.
    pub shorter: Option<SimSpan>,
    /// Number of steps so far.
    pub steps: u64,
    /// The resolution that the simulation runs at; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// Position and motion of the agent's matter.
    pub body: Body,
    /// Mechanical energy in joules: kinetic + elastic + gravity, zero at the origin.
    pub energy_j: f64,
    /// The agent's estimate of its own error, in metres, ≥ 0.
    pub residual_m: f64,
    /// The part of it that steps accumulate in [`crate::DRIFT_S`], metres, ≥ 0; the rest comes from its spacing.
    pub drift_m: f64,
    /// Agents that this one acts on now: they must not sleep meanwhile.
    pub touches: Vec<AgentId>,
    /// Grasp and spring forces on this agent.
    pub grips: Vec<Grip>,
    /// Whether the agent is at rest: others treat it as immovable until they wake it.
    pub at_rest: bool,
    /// Whether a fixed solid supports it: a deformable touched one within the last second, a rigid body stands on one, or tipped within the
    /// last second.
    pub grounded: bool,
    /// Whether it steps in one island with others.
    pub shares: bool,
    /// Its smooth acceleration, m/s², without couplings and impacts. Others predict its motion by it.
    pub acceleration: DVec3,
    /// Its response to impulses.
    pub inertia: Inertia,
    /// Its support by a fixed solid; `None` where there is none, or not on a single level.
    pub stand: Option<Stand>,
    /// Its tipping about an edge or a corner that a fixed solid supports; none where it does not tip.
    pub tips: Rare<Tips>,
    /// Seconds of free flight until a fixed solid may be in its way, ≥ 0; `None` where there is none soon, and where it is not
    /// reported: the body is supported, or held by others.
    pub lands_s: Option<f64>,
    /// Forces and stiffness of the springs from driven points on it; none without such springs, or where no other agent needs them.
    pub sprung: Rare<Sprung>,
    /// Impulses of fixed solids in its last step: it was not in contact before, and late impulses of others may have averted them.
    pub rebound: Rare<Rebound>,
    /// The agent on which it rests, where a fixed solid supports that one.
    pub lies: Rare<LiesOn>,
    /// Its response to impulses within the island that it shares, about its centre of mass: velocities (m/s, rad/s) caused by
    /// impulses (N·s, N·m·s); none where it shares none, or where a fixed solid holds that island.
    pub within: Rare<Six>,
    /// The bounding box of its matter; `None` where nothing of it can be touched.
    pub bounds: Option<Bounds>,
    /// Impulses given to others, in couplings that it owns.
    pub given: Vec<Ledger>,
    /// Impulses taken from others, in couplings that they own.
    pub taken: Vec<Ledger>,
    /// The couplings that it owns.
    pub pairs: Vec<PairState>,
    /// Rigid bodies that it has touched for so long that the two should share one clock.
    pub bonds: Vec<AgentId>,
}

/// A body's response to impulses: its inverse mass, at the time of the snapshot.
#[derive(Debug, Clone, Default)]
pub enum Inertia {
    /// Immovable.
    #[default]
    Immovable,
    /// A rigid body about its centre of mass.
    Rigid {
        /// 1/kg.
        inverse_mass: f64,
        /// 1/(kg·m²), world axes.
        inverse_inertia: DMat3,
    },
    /// A tube.
    Curve(CurveInertia),
    /// A soft body.
    Soft(SoftInertia),
}

/// Position of matter and the fastest speed at which it may leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lowest coordinates, metres.
    pub low: DVec3,
    /// The highest coordinates, metres.
    pub high: DVec3,
    /// The largest speed of any point, m/s.
    pub speed_m_s: f64,
}

/// The state of an agent's matter; which one is fixed for an agent's life.
#[derive(Debug, Clone, Default)]
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

/// The vertices of a soft body. Its connectivity never changes ([`crate::coupling::SurfaceForm`]).
#[derive(Debug, Clone, Default)]
pub struct SoftState {
    /// Positions, metres, world axes.
    pub positions: Vec<DVec3>,
    /// Their velocities, m/s.
    pub velocities: Vec<DVec3>,
}

/// A framed curve of N segments between N + 1 nodes. Positions are in metres, world axes.
#[derive(Debug, Clone, Default)]
pub struct CurveState {
    /// Rest arc length of each node in metres, rising from 0 to the rest length; N + 1 entries.
    pub arc_m: Vec<f64>,
    /// Node positions; N + 1 entries.
    pub positions: Vec<DVec3>,
    /// Node velocities in m/s; N + 1 entries.
    pub velocities: Vec<DVec3>,
    /// Section frames, one per segment: the third axis (z) is the axial director; N entries.
    pub frames: Vec<DQuat>,
    /// Outer radius at each node in metres; N + 1 entries.
    pub radii_m: Vec<f64>,
}

/// The pose and motion of a rigid body, about its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// A driven tool: the tip between its jaws, the shaft along the tool's own −z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolState {
    /// The point between the jaws, metres.
    pub tip: DVec3,
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
    pub lets_in: Option<AgentId>,
    /// Magnitude of the force that the grasped body exerts on the tool, newtons.
    pub force_n: f64,
    /// Whether nothing drives it any more: its script has ended without anything holding it back, and no user spring is on it.
    pub is_left: bool,
}

/// A tool's attachment to a material point of another agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// The grasped agent.
    pub target: AgentId,
    /// The material point grasped.
    pub anchor: Anchor,
    /// Rotational attachment between the jaws; `None` where the body may turn freely.
    pub clasp: Option<Clasp>,
    /// Stiffness of the attachment, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping of the attachment, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

/// Rotational attachment of a rigid body to jaws of length `arm_m` that press along all of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clasp {
    /// Rotation from the body's axes to the tool's at which the attachment exerts no torque.
    pub rotation: DQuat,
    /// The resistance to turning about every axis is that of springs and dampers of the grasp's strength at this distance, metres, ≥ 0.
    pub arm_m: f64,
}

/// A material point of a body: it moves with the matter, whatever the resolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    /// The point of a curve's axis at this rest arc length in metres.
    Arc(f64),
    /// A point of a rigid body in its own axes, metres from the centre of mass.
    Local(DVec3),
    /// A vertex of a soft body.
    Vertex(u32),
}

/// The force with which `by` holds this agent.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// Position and velocity of a material point; `None` where the body has no such point.
    #[must_use]
    pub fn point(&self, anchor: Anchor) -> Option<(DVec3, DVec3)> {
        match (self, anchor) {
            (Self::Curve(curve), Anchor::Arc(arc_m)) => curve.point_at(arc_m),
            (Self::Rigid(body), Anchor::Local(local)) => {
                let arm = body.rotation * local;
                Some((body.position + arm, body.velocity + body.spin.cross(arm)))
            }
            (Self::Tool(tool), Anchor::Local(local)) => Some((tool.tip + tool.rotation * local, tool.velocity)),
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
            }
            Self::Rigid(b) => {
                b.position.is_finite() && b.rotation.is_finite() && b.velocity.is_finite() && b.spin.is_finite()
            }
            Self::Tool(t) => {
                [t.tip, t.velocity, t.spin].iter().all(|v| v.is_finite()) && t.rotation.is_finite() && t.jaw.is_finite()
            }
            Self::Soft(s) => s.positions.iter().chain(&s.velocities).all(|p| p.is_finite()),
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

impl Inertia {
    /// The inertia of a soft body to write into; reuses the storage if this is one already.
    pub fn soft_mut(&mut self) -> &mut SoftInertia {
        if !matches!(self, Self::Soft(_)) {
            *self = Self::Soft(SoftInertia::default());
        }
        match self {
            Self::Soft(soft) => soft,
            _ => unreachable!("made a soft body above"),
        }
    }

    /// The inertia of a tube to write into; reuses the storage if this is one already.
    pub fn curve_mut(&mut self) -> &mut CurveInertia {
        if !matches!(self, Self::Curve(_)) {
            *self = Self::Curve(CurveInertia::default());
        }
        match self {
            Self::Curve(curve) => curve,
            _ => unreachable!("made a curve above"),
        }
    }
}

impl Snapshot {
    /// Empties what an agent may leave unset, keeping the storage. Ledgers stay, for agents with ledgers to overwrite:
    /// their storage is nested.
    pub fn clear(&mut self) {
        self.touches.clear();
        self.grips.clear();
        (self.at_rest, self.shares, self.acceleration, self.bounds) = (false, false, DVec3::ZERO, None);
        (self.stand, self.grounded) = (None, false);
        self.tips.set(None);
        self.drift_m = 0.0;
        self.sprung.set(None);
        self.rebound.set(None);
        self.lies.set(None);
        self.within.set(None);
        self.pairs.clear();
        self.bonds.clear();
    }

    /// The scene time that it belongs to: its own time plus its delay.
    #[must_use]
    pub fn moment(&self) -> SimTime {
        self.time + self.put_off
    }

    /// Its usual step length, seconds, where its scene requests `wanted_s`.
    #[must_use]
    pub fn step_s(&self, wanted_s: f64) -> f64 {
        self.shorter.map_or(wanted_s, SimSpan::as_secs_f64)
    }

    /// Whether every number that others use is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.body.is_finite()
            && self.acceleration.is_finite()
            && self.sprung.get().is_none_or(Sprung::is_finite)
            && self.rebound.get().is_none_or(Rebound::is_finite)
            && self.lies.get().is_none_or(LiesOn::is_finite)
            && self.within.get().is_none_or(Six::is_finite)
            && self.tips.get().is_none_or(Tips::is_finite)
            && self.grips.iter().all(|grip| grip.force_n.is_finite())
            && self.given.iter().all(Ledger::is_finite)
    }

    /// Folds every bit of the state into `hash` (FNV-1a, 64 bits): equal hashes mean bit-identical runs.
    #[must_use]
    pub fn fold_hash(&self, hash: u64) -> u64 {
        let mut fold = Fold(hash);
        fold.word(self.time.as_nanos());
        fold.word(self.steps);
        match &self.body {
            Body::Nothing => {}
            Body::Curve(c) => {
                c.positions.iter().chain(&c.velocities).for_each(|v| fold.vector(*v));
                c.frames.iter().for_each(|q| fold.rotation(*q));
                c.radii_m.iter().for_each(|r| fold.word(r.to_bits()));
            }
            Body::Rigid(b) => {
                [b.position, b.velocity, b.spin].into_iter().for_each(|v| fold.vector(v));
                fold.rotation(b.rotation);
            }
            Body::Tool(t) => {
                [t.tip, t.velocity].into_iter().for_each(|v| fold.vector(v));
                fold.rotation(t.rotation);
                fold.word(t.jaw.to_bits());
            }
            Body::Soft(s) => s.positions.iter().chain(&s.velocities).for_each(|v| fold.vector(*v)),
        }
        fold.0
    }
}

/// The empty hash that [`Snapshot::fold_hash`] starts from (FNV-1a offset basis).
pub const HASH_START: u64 = 0xcbf2_9ce4_8422_2325;

struct Fold(u64);

impl Fold {
    fn word(&mut self, word: u64) {
        const FNV_PRIME: u64 = 0x0100_0000_01b3;
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(FNV_PRIME);
        }
    }

    fn vector(&mut self, v: DVec3) {
        v.to_array().into_iter().for_each(|x| self.word(x.to_bits()));
    }

    fn rotation(&mut self, q: DQuat) {
        q.to_array().into_iter().for_each(|x| self.word(x.to_bits()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> CurveState {
        CurveState {
            arc_m: vec![0.0, 1.0, 3.0],
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::X * 3.0],
            velocities: vec![DVec3::ZERO, DVec3::Z, DVec3::Z],
            frames: vec![DQuat::IDENTITY; 2],
            radii_m: vec![0.1; 3],
        }
    }

    #[test]
    fn a_probe_reads_the_material_point_at_its_share_of_the_rest_length() {
        let body = Body::Curve(line());
        assert_eq!(body.probe(0.5).unwrap().0, DVec3::X * 1.5);
        assert_eq!(body.probe(0.0).unwrap().0, DVec3::ZERO);
        assert_eq!(body.probe(1.0).unwrap().0, DVec3::X * 3.0);
        assert_eq!(body.probe(9.0).unwrap().0, DVec3::X * 3.0);
    }

    #[test]
    fn an_empty_curve_has_no_point() {
        assert_eq!(Body::Curve(CurveState::default()).probe(0.5), None);
    }

    #[test]
    fn one_changed_bit_changes_the_hash() {
        let mut snapshot = Snapshot { body: Body::Curve(line()), ..Snapshot::default() };
        let before = snapshot.fold_hash(HASH_START);
        snapshot.body.curve_mut().positions[1].y = f64::MIN_POSITIVE;
        assert_ne!(before, snapshot.fold_hash(HASH_START));
    }
}
