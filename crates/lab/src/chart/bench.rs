//! Agents stepped as one cluster without a runtime: contact and steps are measured alone, without clocks and threads.
//!
//! In: agents, their rates and springs, static solids. Out: the state of each after every macro step, and the impulses of pairs.
//! Never here: measurements.

use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::{ContactMemory, Participant, Partner};
use metachron_contact::step::{ClusterReport, ClusterStepper, Plan};
use metachron_contact::{Agent, AnchorSpring, Neighbour, StepContext};
use metachron_core::{AgentId, Grip, PlainLoop, SimSpan, SimTime, Snapshot, StepError, recycled};
use metachron_geometry::Obstacle;

/// Agents of one cluster.
pub(super) struct StepHarness {
    actors: Vec<Actor>,
    scene: ClusterScene,
    stepper: ClusterStepper,
    time: SimTime,
    report: ClusterReport,
    /// The impulses of all contacts so far, magnitudes summed, N·s.
    impulse_n_s: f64,
    /// Storage, empty between steps.
    participants: Vec<Participant<'static>>,
}

/// An agent in the harness.
struct Actor {
    agent: Box<dyn Agent>,
    step_s: f64,
    own: Snapshot,
    /// Springs from fixed points.
    hands: Vec<AnchorSpring>,
    /// Its neighbours that are not in the harness.
    neighbours: Vec<Neighbour>,
    memory: ContactMemory,
    grips: Vec<Grip>,
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
        Some(Self {
            actors: Vec::new(),
            scene: ClusterScene::new(obstacles).ok()?,
            stepper: ClusterStepper::default(),
            time: SimTime::ZERO,
            report: ClusterReport::default(),
            impulse_n_s: 0.0,
            participants: Vec::new(),
        })
    }

    /// Adds an agent that wants to step `rate_hz` times a second; `None` for one that is no member of clusters.
    pub(super) fn add(&mut self, mut agent: Box<dyn Agent>, rate_hz: f64) -> Option<AgentId> {
        agent.member()?;
        let mut own = Snapshot::default();
        agent.write_snapshot(&mut own);
        self.actors.push(Actor {
            agent,
            step_s: 1.0 / rate_hz,
            own,
            hands: Vec::new(),
            neighbours: Vec::new(),
            memory: ContactMemory::default(),
            grips: Vec::new(),
        });
        Some(AgentId(self.actors.len() as u32 - 1))
    }

    /// Attaches fixed springs to an agent, instead of the springs it had.
    pub(super) fn attach_springs(&mut self, id: AgentId, hands: impl IntoIterator<Item = AnchorSpring>) {
        let actor = &mut self.actors[id.0 as usize];
        actor.hands.clear();
        actor.hands.extend(hands);
    }

    /// Sets the neighbours of an agent that are not in the harness.
    pub(super) fn set_neighbours(&mut self, id: AgentId, neighbours: Vec<Neighbour>) {
        self.actors[id.0 as usize].neighbours = neighbours;
    }

    /// Changes the step that an agent wants, seconds.
    pub(super) fn set_step(&mut self, id: AgentId, step_s: f64) {
        self.actors[id.0 as usize].step_s = step_s;
    }

    /// An agent's newest state.
    pub(super) fn own(&self, id: AgentId) -> &Snapshot {
        &self.actors[id.0 as usize].own
    }

    /// The newest states of all agents.
    pub(super) fn snapshots(&self) -> impl Iterator<Item = &Snapshot> {
        self.actors.iter().map(|actor| &actor.own)
    }

    /// The time of all agents.
    pub(super) const fn time(&self) -> SimTime {
        self.time
    }

    /// Linear momentum of all agents, N·s.
    pub(super) fn momentum_n_s(&self) -> DVec3 {
        self.actors.iter().map(|actor| actor.agent.momentum().0).sum()
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
        let between = self.stepper.totals().iter().filter(|total| matches!(total.partner, Partner::Agent(_)));
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
        while self.time < end {
            self.step_at_most(end.since(self.time))?;
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
        let Self { actors, scene, stepper, time, participants, .. } = self;
        let mut roles = Vec::with_capacity(actors.len());
        for actor in actors.iter_mut() {
            roles.extend(actor.agent.member().map(|member| (member.role(), actor.step_s)));
        }
        let plan = Plan::of(roles.iter().copied());
        let dt = SimSpan::from_secs_f64(plan.macro_s).map_or(most, |dt| dt.min(most));
        let mut all = recycled(std::mem::take(participants));
        for ((id, actor), (role, step_s)) in (0..).map(AgentId).zip(actors.iter_mut()).zip(roles) {
            let Actor { agent, hands, neighbours, memory, grips, .. } = actor;
            let context = StepContext { neighbours, hands, ..StepContext::alone(id, *time) };
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
        self.report = outcome?;
        self.time += dt;
        self.impulse_n_s += self.stepper.totals().iter().map(|total| total.impulse_n_s.length()).sum::<f64>();
        for actor in &mut self.actors {
            actor.agent.write_snapshot(&mut actor.own);
            actor.own.time = self.time;
        }
        Ok(())
    }
}
