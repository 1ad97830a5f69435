//! An agent without physics for the runtime's tests: it counts, drifts towards its neighbours and fails on demand.

use super::pool::Pool;
use super::spawn::AgentSpawn;
use super::{Clock, Priority, Run, SystemClock, Threads, TimelineCommand};
use glam::{DQuat, DVec3};
use metachron_contact::Exchange;
use metachron_contact::{Agent, IslandMember, StepContext};
use metachron_core::{
    AgentId, Body, Bounds, N_MAX, Resolution, ResolutionRange, RigidState, SimSpan, SimTime, Snapshot, StepError,
    StepReport,
};
use metachron_core::{Impulse, Site};
use metachron_geometry::Solid;
use metachron_geometry::{CollisionShape, ShapeKind, SolidShape};
use rapier3d::geometry::SharedShape;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Starts a run in real time.
pub(super) type Start = fn(Vec<AgentSpawn>, Arc<dyn Clock>) -> Box<dyn Run>;

/// Every executor in real time; pools with fewer and with more workers than a small machine has cores.
const LIVE: [(&str, Start); 4] = [
    ("threads", |spawns, clock| running(Threads::start(spawns, clock, Priority::Normal).unwrap())),
    ("pool of one", |spawns, clock| pool(spawns, clock, 1)),
    ("pool of two", |spawns, clock| pool(spawns, clock, 2)),
    ("pool of five", |spawns, clock| pool(spawns, clock, 5)),
];

fn pool(spawns: Vec<AgentSpawn>, clock: Arc<dyn Clock>, workers: usize) -> Box<dyn Run> {
    running(Pool::with_workers(spawns, clock, workers, Duration::from_secs(60), Priority::Normal).unwrap())
}

/// Starts the time of a run.
pub(super) fn running<R: Run + 'static>(mut run: R) -> Box<R> {
    run.drive(TimelineCommand::Run);
    Box::new(run)
}

/// Tests a claim on every executor in real time.
pub(super) fn on_every_executor(claim: impl Fn(Start)) {
    for (name, start) in LIVE {
        // shown if the claim fails
        println!("{name}");
        claim(start);
    }
}

/// The machine's own clock.
pub(super) fn system() -> Arc<dyn Clock> {
    Arc::new(SystemClock::new())
}

/// Waits for progress; the deadline only ends a test that hangs.
pub(super) fn eventually(what: &str, done: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !done() {
        assert!(Instant::now() < deadline, "never happened: {what}");
        thread::yield_now();
    }
}

/// A failure of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// The state is not finite.
    NotFinite,
    /// The model returns an error.
    Diverged,
    /// The model panics.
    Panic,
    /// The step does not return.
    Hang,
}

/// Whether two agents, by rising numbers, are bonded at a time.
pub(super) type Bond = fn(u32, u32, SimTime) -> bool;

/// One step that was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RecordedStep {
    pub id: AgentId,
    pub from: SimTime,
    pub to: SimTime,
    pub thread: String,
    /// The neighbours it saw, and whether it was to act on them.
    pub saw: Vec<(AgentId, bool)>,
}

/// All steps made by any agent.
pub(super) type Log = Arc<Mutex<Vec<RecordedStep>>>;

/// The test agent. Its snapshot reports the impulse taken as energy and the impulse given as residual.
#[derive(Debug, Clone)]
pub(super) struct Dummy {
    /// The work each step reports; with the model "synthetic", microseconds.
    pub work: f64,
    /// At rest from this step on, unless the user spring pulls.
    pub rest_from: Option<u64>,
    /// Fails at this step.
    pub fault: Option<(u64, Fault)>,
    /// Up to this step none is longer than this.
    pub short: Option<(u64, SimSpan)>,
    /// The agent it acts on, and from which step on.
    pub touches: Option<(u64, AgentId)>,
    pub resolution: Resolution,
    pub steps: u64,
    pub x: f64,
    /// It has a form: a ball of this radius that moves along z with this speed.
    pub ball: Option<(f64, f64)>,
    /// The agents to which it is bonded.
    pub bond: Option<Bond>,
    /// It gives one newton second to every peer whose pair it owns, at each of its first so many steps.
    pub impulses: u64,
    /// Impulses along x taken, newton seconds.
    pub taken: f64,
    /// Impulses along x given.
    pub given: f64,
    pub exchange: Exchange,
    pub log: Option<Log>,
    pub me: AgentId,
    pub time: SimTime,
    /// Position of its matter along z.
    pub z: f64,
}

impl Dummy {
    /// An agent that reports work of `work` microseconds per step.
    pub fn new(work: f64) -> Self {
        Self {
            work,
            rest_from: None,
            fault: None,
            short: None,
            touches: None,
            resolution: Resolution { eps_m: 0.01, n: 1 },
            steps: 0,
            x: 0.0,
            ball: None,
            bond: None,
            impulses: 0,
            taken: 0.0,
            given: 0.0,
            exchange: Exchange::wary(),
            log: None,
            me: AgentId(0),
            time: SimTime::ZERO,
            z: 0.0,
        }
    }

    /// An agent that is bonded to others as `bond` says, and whose steps are recorded in `log`.
    pub fn bonded(work: f64, bond: Bond, log: &Log) -> Self {
        Self { ball: Some((0.1, 0.0)), bond: Some(bond), log: Some(Arc::clone(log)), ..Self::new(work) }
    }

    /// A spawn at this rate with a fixed step.
    pub fn at(self, rate_hz: f64) -> AgentSpawn {
        let range = Some(ResolutionRange { eps_m: (0.001, 0.1), n: (0, N_MAX) });
        AgentSpawn { range, ..AgentSpawn::alone(format!("dummy at {rate_hz}"), Box::new(self), rate_hz) }
    }

    fn write_down(&self, to: SimTime, context: &StepContext<'_>) {
        let Some(log) = &self.log else { return };
        let thread = thread::current().name().unwrap_or_default().to_owned();
        let saw = context.neighbours.iter().map(|n| (n.id, n.owned && n.form.is_some())).collect();
        log.lock().unwrap().push(RecordedStep { id: context.me, from: context.time, to, thread, saw });
    }

    fn exchange_impulses(&mut self, context: &StepContext<'_>, dt_s: f64) {
        let taken = &mut self.taken;
        self.exchange.open(context);
        self.exchange.take(context, context.time, |_, _, impulse, _| *taken += impulse.linear.x);
        if self.steps <= self.impulses {
            for other in context.neighbours.iter().filter(|n| n.owned && n.form.is_some()) {
                let push = Impulse { linear: DVec3::X, angular: DVec3::ZERO };
                self.exchange.give(other.id, Site::Whole, 0.0, push);
                self.given += 1.0;
            }
        }
        self.exchange.close(context, dt_s);
    }
}

/// Writes the group of every agent but the first of `ids` into `apart`: zero is bonded to the first.
fn groups(bond: Bond, ids: impl Fn(usize) -> AgentId, count: usize, time: SimTime, apart: &mut Vec<u32>) {
    apart.extend(0..count as u32);
    for _ in 0..count {
        for (i, j) in (0..count).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let (a, b) = (ids(i).0.min(ids(j).0), ids(i).0.max(ids(j).0));
            if bond(a, b, time) {
                let least = apart[i].min(apart[j]);
                (apart[i], apart[j]) = (least, least);
            }
        }
    }
    apart.remove(0);
}

impl Agent for Dummy {
    fn model(&self) -> &'static str {
        "synthetic"
    }

    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let dt_s = dt.as_secs_f64();
        match self.fault.filter(|(step, _)| *step == self.steps + 1) {
            Some((_, Fault::NotFinite)) => self.x = f64::NAN,
            Some((_, Fault::Diverged)) => {
                return Err(StepError::Diverged { model: "synthetic", dt_s, what: "on demand".into() });
            }
            Some((_, Fault::Panic)) => panic!("on demand"),
            Some((_, Fault::Hang)) => {
                self.write_down(context.time, context);
                loop {
                    thread::park();
                }
            }
            None => {}
        }
        self.steps += 1;
        let met = context.neighbours.iter().filter_map(|n| n.snapshot.body.probe(0.0)).map(|(at, _)| at.x);
        let pulled = context.anchor_springs().map(|p| p.target.x);
        self.x += dt_s * (1.0 + met.chain(pulled).map(|x| x - self.x).sum::<f64>());
        self.exchange_impulses(context, dt_s);
        (self.me, self.time) = (context.me, context.time + dt);
        self.z += dt_s * self.ball.map_or(0.0, |(_, speed_m_s)| speed_m_s);
        self.write_down(self.time, context);
        let at_rest = self.rest_from.is_some_and(|from| self.steps >= from);
        Ok(StepReport { work: self.work, substeps: 1, at_rest })
    }

    fn longest_step(&self, dt: SimSpan, _context: &StepContext<'_>) -> SimSpan {
        let shorter = self.short.filter(|(until, _)| self.steps < *until);
        shorter.map_or(dt, |(_, span)| dt.min(span))
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(self.resolution)
    }

    fn set_resolution(&mut self, wanted: Resolution) {
        self.resolution = wanted;
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        let position = DVec3::new(self.x, 0.0, self.z);
        into.body = Body::Rigid(RigidState { position, rotation: DQuat::IDENTITY, ..RigidState::default() });
        into.steps = self.steps;
        into.resolution = Some(self.resolution);
        (into.energy_j, into.residual_m) = (self.taken, self.given);
        into.touches.extend(self.touches.filter(|(from, _)| self.steps >= *from).map(|(_, id)| id));
        // the published bounds do not follow x, so that tests can place them
        into.bounds = self.ball.map(|(radius_m, speed_m_s)| {
            let (centre, half) = (DVec3::Z * self.z, DVec3::splat(radius_m));
            Bounds { low: centre - half, high: centre + half, speed_m_s: speed_m_s.abs() }
        });
        self.exchange.write(into);
        if let Some(bond) = self.bond {
            let others = (0..16).filter(|k| *k != self.me.0);
            into.bonds.extend(others.filter(|k| bond(self.me.0.min(*k), self.me.0.max(*k), self.time)).map(AgentId));
        }
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ZERO)
    }

    fn mass_kg(&self) -> f64 {
        0.0
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        self.ball.map(|(radius_m, _)| {
            let solid = Solid::Ball { radius_m };
            let shape = SharedShape::ball(radius_m as f32);
            let kind = ShapeKind::Solid(SolidShape { solid, shape, com_local: DVec3::ZERO, radius_m });
            Arc::new(CollisionShape { kind, friction: 0.0, restitution: 0.0 })
        })
    }

    fn step_island(
        &mut self,
        dt: SimSpan,
        context: &StepContext<'_>,
        others: &mut [IslandMember<'_>],
        apart: &mut Vec<u32>,
    ) -> Result<StepReport, StepError> {
        let Some(bond) = self.bond else { return Err(StepError::Alone { model: "synthetic" }) };
        let mut report = self.step(dt, context)?;
        for other in others.iter_mut() {
            let one = other.agent.step(dt, &other.context)?;
            report.work += one.work;
            report.at_rest &= one.at_rest;
        }
        let ids = |k: usize| if k == 0 { context.me } else { others[k - 1].id };
        groups(bond, ids, others.len() + 1, context.time + dt, apart);
        Ok(report)
    }
}
