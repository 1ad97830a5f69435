//! An agent without physics for the tests of this room: it counts, drifts towards its neighbours and fails on demand.

use super::spawn::AgentSpawn;
use glam::{DQuat, DVec3};
use metachron_agents::{
    Agent, AgentId, Body, N_MAX, Resolution, ResolutionRange, RigidState, SimSpan, Snapshot, StepError, StepReport,
    Surroundings,
};

/// What goes wrong at a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// The state is no number.
    NotFinite,
    /// The model gives up.
    Diverged,
    /// The model has a bug.
    Panic,
}

/// The test agent.
#[derive(Debug, Clone)]
pub(super) struct Dummy {
    /// The work each step reports; with the model "synthetic", microseconds.
    pub work: f64,
    /// At rest from this step on, while no hand pulls.
    pub rest_from: Option<u64>,
    /// Fails at this step.
    pub fault: Option<(u64, Fault)>,
    /// Whom it acts on, from which step on.
    pub touches: Option<(u64, AgentId)>,
    pub resolution: Resolution,
    pub steps: u64,
    pub x: f64,
}

impl Dummy {
    /// One that takes `work` microseconds a step.
    pub fn new(work: f64) -> Self {
        let resolution = Resolution { eps_m: 0.01, n: 1 };
        Self { work, rest_from: None, fault: None, touches: None, resolution, steps: 0, x: 0.0 }
    }

    /// On its way into a run at this rate, its step fixed.
    pub fn at(self, rate_hz: f64) -> AgentSpawn {
        let dt = SimSpan::from_secs_f64(1.0 / rate_hz).unwrap();
        AgentSpawn {
            name: format!("dummy at {rate_hz}"),
            agent: Box::new(self),
            rate_hz,
            dt,
            dt_range: (dt, dt),
            range: Some(ResolutionRange { eps_m: (0.001, 0.1), n: (0, N_MAX) }),
            links: Vec::new(),
            watches: Vec::new(),
            governor: None,
        }
    }
}

impl Agent for Dummy {
    fn model(&self) -> &'static str {
        "synthetic"
    }

    fn step(&mut self, dt: SimSpan, around: &Surroundings<'_>) -> Result<StepReport, StepError> {
        self.steps += 1;
        let dt_s = dt.as_secs_f64();
        let met = around.neighbours.iter().filter_map(|n| n.snapshot.body.probe(0.0)).map(|(at, _)| at.x);
        let pulled = around.pulls().map(|p| p.target.x);
        self.x += dt_s * (1.0 + met.chain(pulled).map(|x| x - self.x).sum::<f64>());
        match self.fault.filter(|(step, _)| *step == self.steps) {
            Some((_, Fault::NotFinite)) => self.x = f64::NAN,
            Some((_, Fault::Diverged)) => {
                return Err(StepError::Diverged { model: "synthetic", dt_s, what: "on demand".into() });
            }
            Some((_, Fault::Panic)) => panic!("on demand"),
            None => {}
        }
        let at_rest = self.rest_from.is_some_and(|from| self.steps >= from);
        Ok(StepReport { work: self.work, substeps: 1, at_rest })
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(self.resolution)
    }

    fn retune(&mut self, wanted: Resolution) {
        self.resolution = wanted;
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        let position = DVec3::X * self.x;
        into.body = Body::Rigid(RigidState { position, rotation: DQuat::IDENTITY, ..RigidState::default() });
        into.steps = self.steps;
        into.resolution = Some(self.resolution);
        into.touches.extend(self.touches.filter(|(from, _)| self.steps >= *from).map(|(_, id)| id));
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ZERO)
    }

    fn mass_kg(&self) -> f64 {
        0.0
    }
}
