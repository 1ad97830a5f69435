//! What an agent publishes: its whole visible state at one moment of its own time.
//!
//! In: an agent writes itself into a [`Snapshot`] that is used again and again (no allocation once the sizes settle).
//! Out: drawing, coupling, probes and hashes read it. Never here: how it travels between threads (the runtime does that).

mod lies;
mod stand;
mod tips;

pub use lies::{LiesOn, Upheld};
pub use stand::Stand;
pub(crate) use stand::{Footprint, STANDING_M_S};
pub use tips::Tips;

use crate::coupling::{Ledger, PairState, Rebound, Six, Sprung};
use crate::{AgentId, ImpulseResponse, Rare, Resolution, SimSpan, SimTime};
use glam::{DMat3, DQuat, DVec3};
use std::any::Any;

/// The state an agent last published, stamped with its own time.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// The agent's own time, written by the runtime when it publishes.
    pub time: SimTime,
    /// How far behind the scene its time may lie, written like it: who cannot keep up beside others lives on, later.
    pub put_off: SimSpan,
    /// How long its last step was where that was shorter than its scene wants ([`crate::Agent::longest_step`]), written like its time; `None`
    /// elsewhere.
    pub shorter: Option<SimSpan>,
    /// How many steps led here.
    pub steps: u64,
    /// The resolution the simulation holds; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// Where the agent's matter is and how it moves.
    pub body: Body,
    /// Mechanical energy in joules: kinetic + elastic + gravity, zero at the origin.
    pub energy_j: f64,
    /// The agent's estimate of its own error, in metres, ≥ 0.
    pub residual_m: f64,
    /// The part of it that steps make in [`crate::DRIFT_S`], metres, ≥ 0; the rest is what its spacing leaves.
    pub drift_m: f64,
    /// Agents this one acts on now: they must not rest meanwhile.
    pub touches: Vec<AgentId>,
    /// Forces by which others hold this agent.
    pub grips: Vec<Grip>,
    /// Whether the agent is at rest: others take it for immovable until they wake it.
    pub at_rest: bool,
    /// Whether something fixed bears it: what bends has touched some within a second, a rigid body stands, or has tipped within one.
    pub grounded: bool,
    /// Whether it steps in one world with others.
    pub shares: bool,
    /// Its smooth acceleration, m/s²: without what couplings and blows did. Others expect it to go on like this.
    pub acceleration: DVec3,
    /// How it answers impulses.
    pub inertia: Inertia,
    /// How it stands on something fixed; `None` where it does not, or not on one level.
    pub stand: Option<Stand>,
    /// How it tips over an edge or a corner that something fixed bears; none where it does not.
    pub tips: Rare<Tips>,
    /// In how many seconds of free flight something fixed may be in its way, ≥ 0; `None` where nothing is soon, and where that is not
    /// told: it stands, or others hold it.
    pub lands_s: Option<f64>,
    /// How springs on led points hold it; none where none do, or where nobody would have to know.
    pub sprung: Rare<Sprung>,
    /// What fixed solids gave it in its last step: it was not there before, and late impulses may have spared it.
    pub rebound: Rare<Rebound>,
    /// On whom it lies, where something fixed holds that one up.
    pub lies: Rare<LiesOn>,
    /// How it answers impulses among those whose world it shares, about its centre of mass: velocities (m/s, rad/s) of impulses (N·s,
    /// N·m·s); none where it shares none, or where something fixed holds that world.
    pub within: Rare<Six>,
    /// The box around its matter; `None` where nothing of it can be touched.
    pub bounds: Option<Bounds>,
    /// What it has given to others, in couplings that it owns.
    pub given: Vec<Ledger>,
    /// What it has taken from others, in couplings that they own.
    pub taken: Vec<Ledger>,
    /// The couplings that it owns.
    pub pairs: Vec<PairState>,
    /// Rigid bodies that it has touched for so long that the two should share one clock.
    pub bonds: Vec<AgentId>,
}

/// How a body answers impulses: its inverse mass, at the time of the snapshot.
#[derive(Debug, Clone, Default)]
pub enum Inertia {
    /// Nothing moves it.
    #[default]
    Immovable,
    /// A rigid body about its centre of mass.
    Rigid {
        /// 1/kg.
        inverse_mass: f64,
        /// 1/(kg·m²), world axes.
        inverse_inertia: DMat3,
    },
    /// A deformable: the factor of its own step.
    Deformable(Box<dyn ImpulseResponse>),
}

/// Where matter is and how fast it may leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lowest coordinates, metres.
    pub low: DVec3,
    /// The highest coordinates, metres.
    pub high: DVec3,
    /// No point moves faster, m/s.
    pub speed_m_s: f64,
}

/// The state of an agent's matter; which one is fixed for an agent's life.
#[derive(Debug, Clone, Default)]
pub enum Body {
    /// Nothing to see (a synthetic agent).
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

/// The vertices of a soft body. What joins them never changes ([`crate::coupling::SurfaceForm`]).
#[derive(Debug, Clone, Default)]
pub struct SoftState {
    /// Where they are, metres, world axes.
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
    /// Section frames, one a segment: the third axis (z) is the axial director; N entries.
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

/// Jaws that pass below this opening grasp.
pub const GRASP_BELOW: f64 = 0.2;

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
    /// What the jaws hold.
    pub grasp: Option<Grasp>,
    /// The rigid body that the open jaws are about to take, or have just let go: it may come between them.
    pub lets_in: Option<AgentId>,
    /// Magnitude of the force that what is held exerts on the tool, newtons.
    pub force_n: f64,
    /// Whether nothing leads it on: it has come to the end of its script, which nothing holds it back from, and no hand has it.
    pub is_left: bool,
}

/// A tool's hold on a material point of another agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Who is held.
    pub target: AgentId,
    /// Which material point of it.
    pub anchor: Anchor,
    /// How it is kept from turning between the jaws; `None` where it may.
    pub clasp: Option<Clasp>,
    /// Stiffness of the hold, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping of the hold, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

/// How jaws keep a rigid body from turning: they are as long as `arm_m`, and bear on all of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clasp {
    /// Rotation from the body's axes to the tool's in which the hold turns nothing.
    pub rotation: DQuat,
    /// The hold resists turning about every axis as springs and dampers of its own strength do at this distance, metres, ≥ 0.
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

/// The force by which `by` holds this agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// Who holds; `None` is the user's hand.
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
    /// The segment that holds the material point at rest arc length `arc_m`, and how far along it the point lies, 0 … 1;
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
    /// A soft body reports the vertex at that share of their numbers: of its first corner at 0, of the opposite one at 1.
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

    /// Whether every number is finite. A body that is not is never published.
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

    /// The soft body to write into, keeping its storage when this is one already.
    pub fn soft_mut(&mut self) -> &mut SoftState {
        if !matches!(self, Self::Soft(_)) {
            *self = Self::Soft(SoftState::default());
        }
        match self {
            Self::Soft(soft) => soft,
            _ => unreachable!("made a soft body above"),
        }
    }

    /// The curve to write into, keeping its storage when this is a curve already.
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
    /// The response of a deformable; `None` of any other body.
    #[must_use]
    pub fn response(&self) -> Option<&dyn ImpulseResponse> {
        match self {
            Self::Deformable(response) => Some(response.as_ref()),
            _ => None,
        }
    }

    /// A model's own response to write into, keeping its storage when it is one of that type already.
    pub fn response_mut<R: ImpulseResponse + Default>(&mut self) -> &mut R {
        if !matches!(self, Self::Deformable(response) if (response.as_ref() as &dyn Any).is::<R>()) {
            *self = Self::Deformable(Box::<R>::default());
        }
        match self {
            Self::Deformable(response) => {
                (response.as_mut() as &mut dyn Any).downcast_mut().expect("of this type since above")
            }
            _ => unreachable!("made a deformable above"),
        }
    }
}

impl Snapshot {
    /// Empties what an agent may leave unsaid, keeping the storage. Ledgers stay for an agent that has some to write over:
    /// theirs is storage within storage.
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

    /// The moment of the scene that it belongs to: its own time, and how far that has been put off.
    #[must_use]
    pub fn moment(&self) -> SimTime {
        self.time + self.put_off
    }

    /// How long its steps are as a rule, seconds, where its scene wants `wanted_s`.
    #[must_use]
    pub fn step_s(&self, wanted_s: f64) -> f64 {
        self.shorter.map_or(wanted_s, SimSpan::as_secs_f64)
    }

    /// Whether every number that others act on is finite.
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
