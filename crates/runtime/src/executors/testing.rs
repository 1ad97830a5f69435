//! An agent without physics for the runtime's tests: it counts, drifts towards its neighbours and fails on demand; as a member of clusters
//! it moves as it is led.

use super::pool::Pool;
use crate::agent::agent_spawn::AgentSpawn;
use crate::turn::watchdog::StallLimit;
use crate::{AgentHandle, Clock, Priority, Run, SystemClock, Threads, TimelineCommand};
use glam::{DQuat, DVec3};
use metachron_contact::member::{ClusterMember, MemberMotion, Role, SkinPoint, StepEnd};
use metachron_contact::remote::{GivenAt, Ledgers};
use metachron_contact::solve::Side;
use metachron_contact::{Agent, Input, Inputs, OwnSteps, StepContext, Stepping};
use metachron_core::{
    AgentId, Body, Bounds, N_MAX, Resolution, ResolutionRange, RigidState, SimSpan, SimTime, Snapshot, StepError,
    StepReport,
};
use metachron_core::{Archive, ArchiveError, Impulse, Site, archive_values};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape};
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Starts a run in real time.
pub(crate) type Start = fn(Vec<AgentSpawn>, Arc<dyn Clock>) -> Box<dyn Run>;

/// Every executor in real time; pools with fewer and with more workers than a small machine has cores.
const LIVE: [(&str, Start); 4] = [
    ("threads", |spawns, clock| running(Threads::start(spawns, clock, Priority::Normal).unwrap())),
    ("pool of one", |spawns, clock| pool(spawns, clock, 1)),
    ("pool of two", |spawns, clock| pool(spawns, clock, 2)),
    ("pool of five", |spawns, clock| pool(spawns, clock, 5)),
];

fn pool(spawns: Vec<AgentSpawn>, clock: Arc<dyn Clock>, workers: usize) -> Box<dyn Run> {
    running(
        Pool::with_workers(spawns, clock, workers, StallLimit::of(Duration::from_secs(60)), Priority::Normal).unwrap(),
    )
}

/// Starts the time of a run.
pub(crate) fn running<R: Run + 'static>(mut run: R) -> Box<R> {
    run.drive(TimelineCommand::Run);
    Box::new(run)
}

/// Tests a claim on every executor in real time.
pub(crate) fn on_every_executor(claim: impl Fn(Start)) {
    for (name, start) in LIVE {
        // shown if the claim fails
        println!("{name}");
        claim(start);
    }
}

/// The machine's own clock.
pub(crate) fn system() -> Arc<dyn Clock> {
    Arc::new(SystemClock::new())
}

/// How many hold the data that an agent shares.
pub(crate) fn holders(agent: &AgentHandle) -> usize {
    agent.live().map_or(0, |shared| Arc::strong_count(&shared))
}

/// Waits for progress; the deadline only ends a test that hangs.
pub(crate) fn eventually(what: &str, done: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !done() {
        assert!(Instant::now() < deadline, "never happened: {what}");
        thread::yield_now();
    }
}

/// A failure of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The state is not finite.
    NotFinite,
    /// The model returns an error.
    Diverged,
    /// The model panics.
    Panic,
    /// The step does not return.
    Hang,
    /// The step takes longer than the end of a run waits for it.
    Slow,
}

/// How a member moves along z: up and down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Swing {
    pub reach_m: f64,
    pub rate_hz: f64,
    /// In turns.
    pub phase: f64,
}

/// One step that was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RecordedStep {
    pub id: AgentId,
    pub from: SimTime,
    pub to: SimTime,
    pub thread: String,
    /// The neighbours it saw.
    pub saw: Vec<AgentId>,
}

/// All steps made by any agent.
pub(crate) type Log = Arc<Mutex<Vec<RecordedStep>>>;

/// The test agent. Its snapshot reports the impulse taken as energy and the impulse given as residual.
#[derive(Debug)]
pub(crate) struct Dummy {
    /// The work each step reports; with the model "synthetic", microseconds.
    pub work: f64,
    /// At rest from this step on, unless the user spring pulls.
    pub rest_from: Option<u64>,
    /// Fails at this step.
    pub fault: Option<(u64, Fault)>,
    /// The agent it acts on, and from which step on.
    pub touches: Option<(u64, AgentId)>,
    pub resolution: Resolution,
    pub steps: u64,
    pub x: f64,
    /// It has a form: a ball of this radius that moves along z with this speed.
    pub ball: Option<(f64, f64)>,
    /// It is a member of clusters, touched by nothing.
    pub is_member: bool,
    /// How it moves as a member; it stays where it is without.
    pub swing: Option<Swing>,
    /// It gives one newton second to everybody near, at each of its first so many steps; not as a member.
    pub impulses: u64,
    /// Impulses along x taken, newton seconds.
    pub taken: f64,
    /// Impulses along x given.
    pub given: f64,
    pub ledgers: Ledgers,
    pub log: Option<Log>,
    pub me: AgentId,
    pub time: SimTime,
    /// Position of its matter along z.
    pub z: f64,
    pub form: Option<Arc<CollisionShape>>,
    /// The record of its steps as a member, and of the macro step until it is written.
    pub next: Option<RecordedStep>,
    pub made: Mutex<Vec<RecordedStep>>,
    pub kept: Kept,
}

/// The state from which a macro step of a member may begin again.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Kept {
    /// Into the macro step, seconds.
    after_s: f64,
    steps: u64,
    x: f64,
    z: f64,
}

impl Dummy {
    /// An agent that reports work of `work` microseconds per step.
    pub fn new(work: f64) -> Self {
        Self {
            work,
            rest_from: None,
            fault: None,
            touches: None,
            resolution: Resolution { eps_m: 0.01, n: 1 },
            steps: 0,
            x: 0.0,
            ball: None,
            is_member: false,
            swing: None,
            impulses: 0,
            taken: 0.0,
            given: 0.0,
            ledgers: Ledgers::default(),
            log: None,
            me: AgentId(0),
            time: SimTime::ZERO,
            z: 0.0,
            form: None,
            next: None,
            made: Mutex::default(),
            kept: Kept::default(),
        }
    }

    /// A member of clusters that stays where it is, whose steps are recorded in `log`.
    pub fn member(work: f64, log: &Log) -> Self {
        Self { ball: Some((0.1, 0.0)), is_member: true, log: Some(Arc::clone(log)), ..Self::new(work) }
    }

    /// A spawn at this rate with a fixed step.
    pub fn at(mut self, rate_hz: f64) -> AgentSpawn {
        self.form = self.ball.map(|(radius_m, _)| ball_form(radius_m));
        let range = Some(ResolutionRange { eps_m: (0.001, 0.1), n: (0, N_MAX) });
        AgentSpawn { range, ..AgentSpawn::alone(format!("dummy at {rate_hz}"), Box::new(self), rate_hz) }
    }

    fn record(&self, to: SimTime, context: &StepContext<'_>) {
        if let Some(log) = &self.log {
            log.lock().unwrap().push(RecordedStep { to, ..recorded(context) });
        }
    }

    /// Fails if it is to.
    fn fail(&mut self, dt_s: f64) -> Result<(), StepError> {
        match self.fault.filter(|(step, _)| *step == self.steps + 1) {
            Some((_, Fault::NotFinite)) => self.x = f64::NAN,
            Some((_, Fault::Diverged)) => {
                return Err(StepError::Diverged { model: "synthetic", dt_s, what: "on demand".into() });
            }
            Some((_, Fault::Panic)) => panic!("on demand"),
            Some((_, Fault::Hang)) => loop {
                thread::park();
            },
            Some((_, Fault::Slow)) => thread::sleep(Duration::from_millis(600)),
            None => {}
        }
        Ok(())
    }

    fn speed_m_s(&self) -> f64 {
        let swing = self.swing.map(|swing| swing.reach_m * TAU * swing.rate_hz);
        swing.or(self.ball.map(|(_, speed_m_s)| speed_m_s)).unwrap_or(0.0).abs()
    }

    fn exchange_impulses(&mut self, context: &StepContext<'_>, dt_s: f64) {
        let taken = &mut self.taken;
        self.ledgers.open(context);
        self.ledgers.take(context, dt_s, |new| *taken += new.impulse.linear.x);
        self.ledgers.settle();
        if self.steps <= self.impulses {
            for other in context.neighbours.iter().filter(|n| n.form.is_some()) {
                let push = Impulse { linear: DVec3::X, angular: DVec3::ZERO };
                let at = GivenAt { site: Site::Whole, time: context.time, after_s: 0.0 };
                self.ledgers.give(other.id, at, push);
                self.given += 1.0;
            }
        }
    }
}

/// A step that begins.
fn recorded(context: &StepContext<'_>) -> RecordedStep {
    let thread = thread::current().name().unwrap_or_default().to_owned();
    let saw = context.neighbours.iter().map(|n| n.id).collect();
    RecordedStep { id: context.me, from: context.time, to: context.time, thread, saw }
}

fn ball_form(radius_m: f64) -> Arc<CollisionShape> {
    let solid = SolidShape::new(Solid::Ball { radius_m }, DVec3::ZERO).unwrap();
    Arc::new(CollisionShape::new(ShapeKind::Solid(solid), 0.0))
}

impl Agent for Dummy {
    fn model(&self) -> &'static str {
        "synthetic"
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.steps, self.x, self.z, self.taken, self.given, self.ledgers)
    }

    fn inputs(&self) -> Inputs {
        Inputs::of(&[Input::Spring, Input::Force, Input::Resolution])
    }

    fn resolution(&self) -> Option<Resolution> {
        Some(self.resolution)
    }

    fn set_resolution(&mut self, wanted: Resolution) {
        self.resolution = wanted;
    }

    fn stepping(&mut self) -> Stepping<'_> {
        if self.is_member { Stepping::Cluster(self) } else { Stepping::Own(self) }
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        let position = DVec3::new(self.x, 0.0, self.z);
        into.body = Body::Rigid(RigidState { position, rotation: DQuat::IDENTITY, ..RigidState::default() });
        into.resolution = Some(self.resolution);
        (into.energy_j, into.residual_m) = (self.taken, self.given);
        into.touches.extend(self.touches.filter(|(from, _)| self.steps >= *from).map(|(_, id)| id));
        // the published bounds do not follow x, so that tests can place them
        into.bounds = self.ball.map(|(radius_m, _)| {
            let (centre, half) = (DVec3::Z * self.z, DVec3::splat(radius_m));
            Bounds { low: centre - half, high: centre + half, speed_m_s: self.speed_m_s() }
        });
        self.ledgers.write(into);
        if let Some(log) = &self.log {
            let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
            log.lock().unwrap_or_else(PoisonError::into_inner).append(&mut made);
        }
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        self.form.clone()
    }
}

impl OwnSteps for Dummy {
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let dt_s = dt.as_secs_f64();
        if [Fault::Hang, Fault::Slow].map(|fault| Some((self.steps + 1, fault))).contains(&self.fault) {
            self.record(context.time, context);
        }
        self.fail(dt_s)?;
        self.steps += 1;
        let met = context.neighbours.iter().filter_map(|n| n.snapshot.body.probe(0.0)).map(|(at, _)| at.x);
        let pulled = context.anchor_springs().map(|p| p.target.x);
        self.x += dt_s * (1.0 + met.chain(pulled).map(|x| x - self.x).sum::<f64>());
        self.exchange_impulses(context, dt_s);
        (self.me, self.time) = (context.me, context.time + dt);
        self.z += dt_s * self.ball.map_or(0.0, |(_, speed_m_s)| speed_m_s);
        self.record(self.time, context);
        let at_rest = self.rest_from.is_some_and(|from| self.steps >= from);
        Ok(StepReport { work: self.work, substeps: 1, at_rest })
    }
}

impl ClusterMember for Dummy {
    fn role(&self) -> Role {
        Role::Kinematic
    }

    fn look(&mut self, context: &StepContext<'_>, _dt_s: f64) {
        (self.me, self.time, self.kept.after_s) = (context.me, context.time, 0.0);
        self.made.lock().unwrap().clear();
        if self.log.is_some() {
            self.next = Some(recorded(context));
        }
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        self.fail(h_s)
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let view = ShapePose::Solid { position: DVec3::Z * self.z, rotation: DQuat::IDENTITY };
        Some(PlacedShape { form: self.form.as_deref()?, view })
    }

    fn skin_point(&self, _place: &Place, _contact: ContactSide) -> SkinPoint {
        Side::FIXED.into()
    }

    fn keep(&mut self) {
        self.kept = Kept { after_s: self.kept.after_s, steps: self.steps, x: self.x, z: self.z };
    }

    fn go_back(&mut self) {
        (self.steps, self.x, self.z, self.kept.after_s) = (self.kept.steps, self.kept.x, self.kept.z, 0.0);
        self.made.lock().unwrap().clear();
    }

    fn end(&mut self, &StepEnd { h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        self.steps += 1;
        let from = self.time + SimSpan::from_secs_f64(self.kept.after_s).unwrap();
        self.kept.after_s += h_s;
        self.x += h_s;
        let now = self.time + SimSpan::from_secs_f64(self.kept.after_s).unwrap();
        if let Some(Swing { reach_m, rate_hz, phase }) = self.swing {
            self.z = reach_m * libm::sin(TAU * (now.as_secs_f64() * rate_hz + phase));
        }
        if let Some(step) = &self.next {
            self.made.lock().unwrap().push(RecordedStep { from, to: now, ..step.clone() });
        }
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        self.rest_from.is_some_and(|from| self.steps >= from)
    }

    fn work(&self) -> f64 {
        self.work
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }
}

impl MemberMotion for Dummy {
    fn passes_through(&self, _other: AgentId) -> bool {
        true
    }

    fn speed_bound(&self, _v: &[DVec3]) -> f64 {
        self.speed_m_s()
    }
}
