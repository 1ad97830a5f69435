//! The contract of an agent: an object that advances by its own steps; by which laws and links two of them act on each other.
//!
//! In: a step length and the agent's view of the others ([`StepContext`]). Out: a new state and a report of the step.
//! Never here: clocks, threads, files, the GPU. The suite `metachron_models::conformance` tests the promises of every agent.

use crate::Inputs;
use crate::joint::Motor;
use crate::member::ClusterMember;
use crate::motion_bounds::is_within_motion;
use glam::{DQuat, DVec3};
use metachron_core::{
    AgentId, Anchor, Archive, ArchiveError, Body, Removed, Resolution, SimSpan, SimTime, Snapshot, StepError,
    StepReport, unit_rotation,
};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

/// An object that runs by itself, on its own clock.
///
/// Promises, tested for every model: a step advances exactly `dt`; a refused step leaves the state bit for bit;
/// the same calls give the same bits; nothing is allocated once the sizes settle; a state that is not finite is never written.
pub trait Agent: Send {
    /// The model's name: as scenes write it `tube`, `rigid`, `sheet`, `solid`, `rope`, `tool` or `synthetic`, else one of its own.
    fn model(&self) -> &'static str;

    /// How it is stepped: by itself, or in a contact cluster with all that it touches.
    fn stepping(&mut self) -> Stepping<'_>;

    /// The agent as contact clusters step it; `None` for a model that steps itself.
    fn member(&mut self) -> Option<&mut dyn ClusterMember> {
        match self.stepping() {
            Stepping::Cluster(member) => Some(member),
            Stepping::Own(_) => None,
        }
    }

    /// Shifts the agent's own time by `by_s` seconds: later where positive, earlier where negative. Nothing else changes: stored times and
    /// scripts shift along, and no impulse is in flight to or from the agent.
    fn shift_clock(&mut self, _by_s: f64) {}

    /// The resolution that the simulation runs at; `None` for a model that has none.
    fn resolution(&self) -> Option<Resolution> {
        None
    }

    /// Takes the resolution nearest to `wanted` that the agent supports; nothing changes in a model that has none.
    ///
    /// Keeps mass, linear momentum and rest length exactly and angular momentum to O(ε²).
    fn set_resolution(&mut self, wanted: Resolution) {
        let _ = wanted;
    }

    /// Sets the pressure of the agent's filling, inside minus outside, Pa; `false`, and no change, for an agent without
    /// one and for a pressure that it refuses.
    fn set_pressure_pa(&mut self, pressure_pa: f64) -> bool {
        let _ = pressure_pa;
        false
    }

    /// Moves it elsewhere, or gives it another velocity, between two steps; `false`, and no change, for a model that cannot.
    fn set_motion(&mut self, motion: &SetMotion) -> bool {
        let _ = motion;
        false
    }

    /// Removes the cells whose middles are within `carving`, between two steps: the matter removed; `None`, and no change, where there are no
    /// such cells, where none would be left, and for a model without cells.
    fn carve(&mut self, carving: &Carving) -> Option<Removed> {
        let _ = carving;
        None
    }

    /// Takes another state between two steps, as its snapshots publish it: motion that these lack, such as spins of a tube's parts, is zero.
    ///
    /// # Errors
    /// The reason why the state does not fit; nothing is changed then.
    fn set_state(&mut self, state: &Body) -> Result<(), String> {
        let _ = state;
        Err(format!("a {} takes no state", self.model()))
    }

    /// The inputs of users that it takes, the same for as long as it lives: the runtime refuses any command that needs another. A model names
    /// here the springs, forces, torques and poses that its steps look at, and the methods above that it has of its own; by default nothing.
    fn inputs(&self) -> Inputs {
        Inputs::NONE
    }

    /// Writes the state into `into`, all of it except `time`, `clock_offset`, `steps` and `at_rest`, which the runtime stamps.
    fn write_snapshot(&self, into: &mut Snapshot);

    /// Writes the state to an archive, or reads it from one, field by field: all that the next bit of a run needs, guesses included, and
    /// nothing that an agent built alike has anyway. It is called between steps.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] by a model that does not save its state, as this one does where a model has nothing else;
    /// [`ArchiveError`] for a state of another agent. After an error of reading, the agent reads the state that it wrote itself just before, and
    /// goes on from that.
    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let _ = archive;
        Err(ArchiveError::Refused { what: format!("model \"{}\"", self.model()) })
    }

    /// Linear momentum (kg·m/s) and angular momentum about the origin (kg·m²/s), in world axes; zero for a model without mass, as of a led body.
    fn momentum(&self) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ZERO)
    }

    /// Total mass in kilograms; zero for a model without mass.
    fn mass_kg(&self) -> f64 {
        0.0
    }

    /// The contact shape; `None` where nothing can touch it. It is the same until [`Self::carve`] or [`Self::archive`] makes another, of the
    /// same kind, with the same traits and numbers of vertices.
    fn form(&self) -> Option<Arc<CollisionShape>> {
        None
    }
}

/// How an agent is stepped.
pub enum Stepping<'a> {
    /// By itself: a model that touches nothing.
    Own(&'a mut dyn OwnSteps),
    /// In a contact cluster, where contacts, joints, links and grasps are solved: alone where nothing touches it.
    Cluster(&'a mut dyn ClusterMember),
}

/// The steps of a model that touches nothing.
pub trait OwnSteps {
    /// Advances the state by exactly `dt`.
    ///
    /// # Errors
    /// [`StepError::BadSpan`] leaves the state untouched. After [`StepError::Diverged`] the agent must not step again;
    /// its last snapshot stays valid.
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError>;
}

/// The other agents and springs that an agent sees while it steps.
#[derive(Debug, Clone, Copy)]
pub struct StepContext<'a> {
    /// The agent that looks.
    pub me: AgentId,
    /// The agent's own time at the start of the step.
    pub time: SimTime,
    /// The agents in possible contact or grasp with this one, in either direction, and those with ledger impulses still to settle.
    pub neighbours: &'a [Neighbour],
    /// Springs of the user on this agent.
    pub user_springs: &'a [AnchorSpring],
    /// Forces of the user on this agent, in the mean of the macro step.
    pub forces: &'a [AnchorForce],
    /// Motors that the user has set, of joints whose first body this agent is.
    pub motors: &'a [SetMotor],
    /// Where the user leads it, at the start of the step; `None` where the user leads it nowhere.
    pub pose: Option<PoseGoal>,
    /// Bilateral couplings with other agents.
    pub links: &'a [Link],
}

/// The newest known state of another agent.
#[derive(Debug, Clone)]
pub struct Neighbour {
    /// The neighbour's number.
    pub id: AgentId,
    /// Its newest published state.
    pub snapshot: Arc<Snapshot>,
    /// Its shape; `None` where the two cannot touch.
    pub form: Option<Arc<CollisionShape>>,
    /// How the two act on each other in contact.
    pub law: Law,
    /// Whether, of an asynchronous pair, the agent that looks computes it ([`crate::remote::computes`]).
    pub computed_here: bool,
    /// Its usual step length, seconds; zero where that does not matter.
    pub step_s: f64,
}

impl Neighbour {
    /// A neighbour that is only looked at: not in contact.
    #[must_use]
    pub const fn observed(id: AgentId, snapshot: Arc<Snapshot>) -> Self {
        Self { id, snapshot, form: None, law: Law::Cluster, computed_here: false, step_s: 0.0 }
    }
}

/// A spring from a moving point of space to a material point of an agent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AnchorSpring {
    /// The agent that pulls; `None` for the user's spring.
    pub by: Option<AgentId>,
    /// The material point that is pulled.
    pub anchor: Anchor,
    /// Position of the spring's other end, metres.
    pub target: DVec3,
    /// Velocity of that end, m/s.
    pub target_velocity: DVec3,
    /// Stiffness, N/m, ≥ 0.
    pub stiffness_n_m: f64,
    /// Damping, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

/// A force on a material point of an agent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AnchorForce {
    /// The material point that it acts on.
    pub anchor: Anchor,
    /// The force, world axes, N.
    pub force_n: DVec3,
    /// A torque besides, world axes, N·m: without effect where no block of the body is a spin ([`crate::member::Attachments::turn`]).
    pub torque_n_m: DVec3,
}

/// A motor in the place of the one that the scene gives a joint.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SetMotor {
    /// The joint's number in the scene.
    pub joint: u32,
    /// Its motor; `None` for none.
    pub motor: Option<Motor>,
}

/// A pose that a body is led to, which itself moves on.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PoseGoal {
    /// Where the origin of its axes is to be, metres.
    pub position_m: DVec3,
    /// From its axes to the world's.
    pub rotation: DQuat,
    /// How the origin moves on, m/s.
    pub velocity_m_s: DVec3,
    /// How the axes turn on, world axes, rad/s.
    pub spin_rad_s: DVec3,
}

impl PoseGoal {
    /// The motion of a body that is led there at once.
    #[must_use]
    pub const fn motion(&self) -> SetMotion {
        let Self { position_m, rotation, velocity_m_s, spin_rad_s } = *self;
        SetMotion {
            position_m: Some(position_m),
            rotation: Some(rotation),
            velocity_m_s: Some(velocity_m_s),
            spin_rad_s: Some(spin_rad_s),
        }
    }

    /// Where it is `t_s` seconds later.
    #[must_use]
    pub fn after(&self, t_s: f64) -> Self {
        let rotation = (DQuat::from_scaled_axis(self.spin_rad_s * t_s) * self.rotation).normalize();
        Self { position_m: self.position_m + self.velocity_m_s * t_s, rotation, ..*self }
    }

    /// Whether it stays where it is.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.velocity_m_s == DVec3::ZERO && self.spin_rad_s == DVec3::ZERO
    }
}

/// Another place or velocity for an agent. A field that is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct SetMotion {
    /// Where the origin of a rigid body's axes is, or the centre of mass of a deformable, metres.
    pub position_m: Option<DVec3>,
    /// The rotation of a rigid body, from its axes to the world's; by how much a deformable is turned about its centre of mass.
    pub rotation: Option<DQuat>,
    /// The velocity of its centre of mass, m/s: of a deformable, of all its matter.
    pub velocity_m_s: Option<DVec3>,
    /// Its spin about its centre of mass, world axes, rad/s.
    pub spin_rad_s: Option<DVec3>,
}

impl SetMotion {
    /// Whether a body can be moved so: all numbers are within [`MOTION_MAX`](crate::MOTION_MAX), and the rotation is neither zero nor not finite.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let vectors = [self.position_m, self.velocity_m_s, self.spin_rad_s];
        vectors.into_iter().flatten().all(is_within_motion) && self.rotation.is_none_or(|q| unit_rotation(q).is_some())
    }
}

/// A region of space, world axes: all that is within a radius of a line. A ball where both its ends are one point.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Carving {
    /// One end of the line, metres.
    pub from_m: DVec3,
    /// The other end, metres.
    pub to_m: DVec3,
    /// The radius, metres, > 0.
    pub radius_m: f64,
}

impl Carving {
    /// Whether every number is finite, and the radius above zero.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.from_m.is_finite() && self.to_m.is_finite() && self.radius_m.is_finite() && self.radius_m > 0.0
    }

    /// Whether a point is in it.
    #[must_use]
    pub fn holds(&self, point_m: DVec3) -> bool {
        let (line, to) = (self.to_m - self.from_m, point_m - self.from_m);
        let share = if line == DVec3::ZERO { 0.0 } else { (to.dot(line) / line.length_squared()).clamp(0.0, 1.0) };
        (to - line * share).length_squared() <= self.radius_m * self.radius_m
    }
}

/// Beyond this age a tool's motion is no longer extrapolated, in seconds: a stopped tool must not drag a grasped body along.
const EXTRAPOLATION_MAX_S: f64 = 0.1;

/// By how many seconds the motion of a tool, published at `published`, is extrapolated to reach `time`.
pub fn tool_extrapolation_s(time: SimTime, published: SimTime) -> f64 {
    time.secs_after(published).clamp(-EXTRAPOLATION_MAX_S, EXTRAPOLATION_MAX_S)
}

impl<'a> StepContext<'a> {
    /// The context of a step at `time` without neighbours, springs and links, for tests and for agents that nothing acts on.
    #[must_use]
    pub fn alone(me: AgentId, time: SimTime) -> Self {
        Self { me, time, neighbours: &[], user_springs: &[], forces: &[], motors: &[], pose: None, links: &[] }
    }

    /// Every spring on this agent: the user's, and the grasps of tools, with their tips extrapolated to `time`.
    pub fn anchor_springs(&self) -> impl Iterator<Item = AnchorSpring> + 'a {
        let (me, time) = (self.me, self.time);
        let grasps = self.neighbours.iter().filter_map(move |other| {
            let Body::Tool(tool) = &other.snapshot.body else { return None };
            let grasp = tool.grasp.filter(|g| g.target == me)?;
            let age_s = tool_extrapolation_s(time, other.snapshot.time);
            Some(AnchorSpring {
                by: Some(other.id),
                anchor: grasp.anchor,
                target: tool.tip + tool.velocity * age_s,
                target_velocity: tool.velocity,
                stiffness_n_m: grasp.stiffness_n_m,
                damping_n_s_m: grasp.damping_n_s_m,
            })
        });
        self.user_springs.iter().copied().chain(grasps)
    }
}

/// How two agents act on each other where they touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Law {
    /// Both are solved in one problem by the contact cluster that steps them: the default.
    #[default]
    Cluster,
    /// Asynchronous: one side computes the impulses and books them in a ledger, the other takes them in its next step.
    Ledger,
    /// Wave variables on a line between the two: passive whatever the delay, at the price of a mass k T².
    Tlm {
        /// Stiffness of the line, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping beside it, N·s/m, ≥ 0.
        damping_n_s_m: f64,
    },
    /// No contact: the two pass through each other.
    Off,
}

impl Law {
    /// Whether the two sides keep clocks of their own, each seeing the other's newest published state.
    #[must_use]
    pub const fn is_asynchronous(self) -> bool {
        matches!(self, Self::Ledger | Self::Tlm { .. })
    }
}

/// A persistent bilateral coupling between a point of this agent and one of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The agent on the other side.
    pub other: AgentId,
    /// The point of this agent.
    pub here: Anchor,
    /// The point of the other.
    pub there: Anchor,
    /// Stiffness, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
    /// The distance at which it exerts no force, metres, ≥ 0.
    pub rest_m: f64,
    /// [`Law::Cluster`], [`Law::Ledger`] or [`Law::Tlm`].
    pub law: Law,
    /// Its number in the scene, by which both ends know it.
    pub number: u32,
    /// The force above which it tears, N, > 0: the mean over a macro step of its cluster. Infinite where it never does; an asynchronous
    /// link never does.
    pub tears_above_n: f64,
    /// The force that it gives at most, N, > 0, below that at which it tears: a greater load moves the place at which it holds, or
    /// lengthens it. Infinite where it never yields; an asynchronous link never does.
    pub yields_above_n: f64,
}

impl Link {
    /// A spring from `here` to a point `there` of `other` with this stiffness, N/m, > 0: number 0, without damping or a length at rest, in one
    /// problem with all that touches, which neither tears nor yields.
    #[must_use]
    pub const fn new(other: AgentId, here: Anchor, there: Anchor, stiffness_n_m: f64) -> Self {
        Self {
            other,
            here,
            there,
            stiffness_n_m,
            damping_n_s_m: 0.0,
            rest_m: 0.0,
            law: Law::Cluster,
            number: 0,
            tears_above_n: f64::INFINITY,
            yields_above_n: f64::INFINITY,
        }
    }
}
