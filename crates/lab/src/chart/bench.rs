//! Agents stepped as one cluster without a runtime: contact and steps are measured alone, without clocks and threads.
//!
//! In: agents, their rates, springs and forces, static solids. Out: the state of each after every macro step, and the impulses of pairs.
//! Never here: measurements.

use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::{ContactMemory, Participant, Partner};
use metachron_contact::step::{ClusterReport, ClusterStepper, Plan};
use metachron_contact::{Agent, AnchorForce, AnchorSpring, Neighbour, StepContext};
use metachron_core::{AgentId, Grip, PlainLoop, SimSpan, SimTime, Snapshot, StepError, recycled};
use metachron_geometry::Obstacle;

/// Members of one cluster.
pub(crate) struct Cluster {
    pub(crate) members: Vec<Member>,
    pub(crate) scene: ClusterScene,
    pub(crate) stepper: ClusterStepper,
    /// The time of all members.
    pub(crate) time: SimTime,
    /// Storage, empty between steps.
    participants: Vec<Participant<'static>>,
}

/// A member of a cluster.
pub(crate) struct Member {
    pub(crate) agent: Box<dyn Agent>,
    /// The length of a step that it wants, seconds.
    pub(crate) step_s: f64,
    /// Springs from fixed points.
    pub(crate) user_springs: Vec<AnchorSpring>,
    /// Forces on it.
    pub(crate) forces: Vec<AnchorForce>,
    /// Its neighbours outside the cluster.
    pub(crate) neighbours: Vec<Neighbour>,
    memory: ContactMemory,
    grips: Vec<Grip>,
}

impl Cluster {
    pub(crate) fn new(scene: ClusterScene) -> Self {
        let (stepper, time) = (ClusterStepper::default(), SimTime::ZERO);
        Self { members: Vec::new(), scene, stepper, time, participants: Vec::new() }
    }

    /// Adds an agent that wants steps of `step_s` seconds; `None` for one that is no member of clusters.
    pub(crate) fn add(&mut self, mut agent: Box<dyn Agent>, step_s: f64) -> Option<AgentId> {
        agent.member()?;
        let (user_springs, forces, neighbours, memory, grips) = Default::default();
        self.members.push(Member { agent, step_s, user_springs, forces, neighbours, memory, grips });
        Some(AgentId(self.members.len() as u32 - 1))
    }

    /// Makes a macro step as long as its members want, and of at most this length.
    ///
    /// # Errors
    /// A step that a member refuses.
    pub(crate) fn step(&mut self, most: SimSpan) -> Result<ClusterReport, StepError> {
        let Self { members, scene, stepper, time, participants } = self;
        let mut roles = Vec::with_capacity(members.len());
        for one in members.iter_mut() {
            roles.extend(one.agent.member().map(|member| (member.role(), one.step_s)));
        }
        let plan = Plan::of(roles.iter().copied());
        let dt = SimSpan::from_secs_f64(plan.macro_s).map_or(most, |dt| dt.min(most));
        let mut all = recycled(std::mem::take(participants));
        for ((id, one), (role, step_s)) in (0..).map(AgentId).zip(members.iter_mut()).zip(roles) {
            let Member { agent, user_springs, forces, neighbours, memory, grips, .. } = one;
            let context = StepContext { neighbours, user_springs, forces, ..StepContext::alone(id, *time) };
            let parts = plan.parts_in(role, step_s);
            all.extend(agent.member().map(|member| Participant {
                id,
                member: member.into(),
                context,
                laws: &[],
                memory,
                parts,
                alone_s: step_s,
                grips,
            }));
        }
        let outcome = stepper.step(scene, &mut all, dt, &PlainLoop);
        *participants = recycled(all);
        let report = outcome?;
        *time += dt;
        Ok(report)
    }
}

/// Agents of one cluster, and their newest states.
pub(super) struct StepHarness {
    cluster: Cluster,
    own: Vec<Snapshot>,
    report: ClusterReport,
    /// The impulses of all contacts so far, magnitudes summed, N·s.
    impulse_n_s: f64,
}

/// Sums over the pairs of the last macro step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PairSums {
    /// The deepest overlap, metres.
    pub(super) depth_m: f64,
    pub(super) contacts: u32,
}

impl StepHarness {
    /// An empty harness among static solids; `None` where one of these is invalid.
    pub(super) fn among(obstacles: &[Obstacle]) -> Option<Self> {
        let cluster = Cluster::new(ClusterScene::new(obstacles).ok()?);
        Some(Self { cluster, own: Vec::new(), report: ClusterReport::default(), impulse_n_s: 0.0 })
    }

    /// Adds an agent that wants to step `rate_hz` times a second; `None` for one that is no member of clusters.
    pub(super) fn add(&mut self, agent: Box<dyn Agent>, rate_hz: f64) -> Option<AgentId> {
        let mut own = Snapshot::default();
        agent.write_snapshot(&mut own);
        let id = self.cluster.add(agent, 1.0 / rate_hz)?;
        self.own.push(own);
        Some(id)
    }

    /// An agent, and what acts on it.
    pub(super) fn member(&mut self, id: AgentId) -> &mut Member {
        &mut self.cluster.members[id.0 as usize]
    }

    /// An agent's newest state.
    pub(super) fn own(&self, id: AgentId) -> &Snapshot {
        &self.own[id.0 as usize]
    }

    /// The newest states of all agents.
    pub(super) fn snapshots(&self) -> impl Iterator<Item = &Snapshot> {
        self.own.iter()
    }

    /// The time of all agents.
    pub(super) const fn time(&self) -> SimTime {
        self.cluster.time
    }

    /// Linear momentum of all agents, N·s.
    pub(super) fn momentum_n_s(&self) -> DVec3 {
        self.cluster.members.iter().map(|one| one.agent.momentum().0).sum()
    }

    /// The impulses of all contacts so far, magnitudes summed over pairs and macro steps, N·s.
    pub(super) const fn impulse_n_s(&self) -> f64 {
        self.impulse_n_s
    }

    /// How the last macro step was made.
    pub(super) const fn report(&self) -> &ClusterReport {
        &self.report
    }

    /// Sums over the pairs of agents in the last macro step.
    pub(super) fn pairs(&self) -> PairSums {
        let between = self.cluster.stepper.totals().iter().filter(|total| matches!(total.partner, Partner::Agent(_)));
        between.fold(PairSums::default(), |sum, total| PairSums {
            depth_m: sum.depth_m.max(total.depth_m),
            contacts: sum.contacts + total.contacts,
        })
    }

    /// Makes macro steps up to `seconds`.
    ///
    /// # Errors
    /// A step that a member refuses.
    pub(super) fn run_to(&mut self, seconds: f64) -> Result<(), StepError> {
        let end = SimTime::ZERO + SimSpan::from_secs_f64(seconds).unwrap_or(SimSpan::ZERO);
        while self.cluster.time < end {
            self.step_at_most(end.since(self.cluster.time))?;
        }
        Ok(())
    }

    /// Makes a macro step as long as its members want.
    ///
    /// # Errors
    /// A step that a member refuses.
    pub(super) fn step(&mut self) -> Result<(), StepError> {
        self.step_at_most(SimSpan::from_nanos(u64::MAX))
    }

    /// Makes a macro step of at most this length.
    fn step_at_most(&mut self, most: SimSpan) -> Result<(), StepError> {
        self.report = self.cluster.step(most)?;
        let impulses = self.cluster.stepper.totals().iter().map(|total| total.impulse_n_s.length());
        self.impulse_n_s += impulses.sum::<f64>();
        for (one, own) in self.cluster.members.iter().zip(&mut self.own) {
            one.agent.write_snapshot(own);
            own.time = self.cluster.time;
        }
        Ok(())
    }
}
