//! A table on which bodies are put and stepped as one cluster, and measurements of them.

use glam::{DQuat, DVec3};
use metachron_contact::constraint::FailedAttachment;
use metachron_contact::detect::{ClusterScene, LEAST_STEPS_RANGE, SolveBudget};
use metachron_contact::joint::Joint;
use metachron_contact::member::{ContactMemory, Participant, Partner};
use metachron_contact::step::{ClusterReport, ClusterStepper, PairTotal, Plan, StepDoubling};
use metachron_contact::{Agent, AnchorSpring, Law, Link, Neighbour, StepContext};
use metachron_core::{AgentId, Anchor, Grip, PlainLoop, SensorTouch, SimSpan, SimTime, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use std::sync::Arc;

/// Gravity, m/s².
pub const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// A body on the table.
pub struct Placed {
    pub agent: Box<dyn Agent>,
    pub rate_hz: f64,
    /// Whether a part of it is held in place.
    pub held: bool,
    /// Its links, as its scene gives them, and the springs of the user on it.
    pub links: Vec<Link>,
    pub user_springs: Vec<AnchorSpring>,
    memory: ContactMemory,
    grips: Vec<Grip>,
}

/// Bodies on a floor at z = 0.
pub struct Table {
    pub bodies: Vec<Placed>,
    pub time: SimTime,
    /// Whether bodies touch each other.
    pub touching: bool,
    /// Agents outside the cluster that bodies see.
    pub strangers: Vec<Neighbour>,
    /// How long the last macro step was, seconds.
    last_s: f64,
    /// The stepper's allocations in it.
    pub allocations: u64,
    /// Repeats every step in halves, where there is one.
    pub doubling: Option<StepDoubling>,
    scene: ClusterScene,
    stepper: ClusterStepper,
    snapshot: Snapshot,
}

/// The results of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Findings {
    /// The deepest overlap before and within the last half second, metres.
    pub landing_m: f64,
    pub rest_m: f64,
    /// The energy above its running minimum, J.
    pub gain_j: f64,
    /// The load on the floor, or on held bodies, in the last half second, in weights of all free bodies.
    pub weight: f64,
    pub steps: u32,
    pub factors: u32,
    pub unfinished: u32,
    /// The most contacts of a step.
    pub contacts: u32,
    /// The highest place of any centre of mass at the end, and the lowest, metres.
    pub highest_m: f64,
    pub lowest_m: f64,
    /// Factors of the last half second for each fine step.
    pub factors_at_rest: f64,
}

/// A spring whose ends are still to be named.
pub fn spring(stiffness_n_m: f64, damping_n_s_m: f64, rest_m: f64) -> Link {
    let middle = Anchor::Local(DVec3::ZERO);
    Link { damping_n_s_m, rest_m, ..Link::new(AgentId(0), middle, middle, stiffness_n_m) }
}

/// A body with its rate.
pub fn placed(agent: impl Agent + 'static, held: bool) -> Placed {
    let (links, user_springs, memory, grips) = (vec![], vec![], ContactMemory::default(), vec![]);
    Placed { agent: Box::new(agent), rate_hz: 60.0, held, links, user_springs, memory, grips }
}

/// A plane through the origin whose normal is the z that `rotation` leads to.
pub fn plane(rotation: DQuat, friction: f64) -> Obstacle {
    Obstacle { rotation, friction, ..Obstacle::new("floor", Solid::Plane) }
}

impl Table {
    pub fn new(bodies: Vec<Placed>) -> Self {
        Self::among(bodies, &[plane(DQuat::IDENTITY, 0.5)])
    }

    pub fn among(bodies: Vec<Placed>, obstacles: &[Obstacle]) -> Self {
        let scene = ClusterScene::new(obstacles).unwrap();
        let (stepper, snapshot) = (ClusterStepper::default(), Snapshot::default());
        Self {
            bodies,
            time: SimTime::ZERO,
            touching: true,
            strangers: vec![],
            last_s: 0.0,
            allocations: 0,
            doubling: None,
            scene,
            stepper,
            snapshot,
        }
    }

    /// The same with joints between its bodies, which are numbered in their order.
    pub fn jointed(self, joints: impl IntoIterator<Item = Joint>) -> Self {
        Self { scene: self.scene.jointed(joints.into_iter().collect()).unwrap(), ..self }
    }

    /// The same with contacts that rest so deep, metres.
    pub fn resting_at(self, depth_m: f64) -> Self {
        Self { scene: self.scene.resting_at(depth_m).unwrap(), ..self }
    }

    /// The same without time for solves, which are exact all the same: rapier3d steps the rigid bodies that nothing else touches.
    pub fn hurried(mut self) -> Self {
        self.stepper.set_factors_max(Some(0));
        let exact = SolveBudget::Timed { least_steps: *LEAST_STEPS_RANGE.end() };
        Self { scene: self.scene.within(exact).unwrap(), ..self }
    }

    /// Links two bodies by a spring, as both of them see it.
    pub fn link(&mut self, ends: [(usize, Anchor); 2], spring: Link) {
        // both ends have each
        let number = self.bodies.iter().map(|body| body.links.len()).sum::<usize>() as u32 / 2;
        for (at, (body, here)) in ends.into_iter().enumerate() {
            let (other, there) = ends[1 - at];
            let link = Link { other: AgentId(other as u32), here, there, number, ..spring };
            self.bodies[body].links.push(link);
        }
    }

    /// The forces by which a body was held at the end of the last step.
    pub fn grips(&self, body: usize) -> &[Grip] {
        &self.bodies[body].grips
    }

    /// The touches of a sensor, or of a body with sensors.
    pub fn sensed(&self, body: usize) -> &[SensorTouch] {
        self.bodies[body].memory.sensed()
    }

    /// The attachments that tore in the last macro step.
    pub fn torn(&self) -> &[FailedAttachment] {
        self.stepper.torn()
    }

    /// The attachments that began to yield in the last macro step.
    pub fn yielded(&self) -> &[FailedAttachment] {
        self.stepper.yielded()
    }

    /// The published states of all bodies, as each other sees them.
    fn published(&self) -> Vec<Neighbour> {
        let of = |(id, body): (u32, &Placed)| {
            let mut snapshot = Snapshot { time: self.time, ..Snapshot::default() };
            body.agent.write_snapshot(&mut snapshot);
            let seen = Neighbour::observed(AgentId(id), Arc::new(snapshot));
            Neighbour { form: body.agent.form(), law: if self.touching { Law::Cluster } else { Law::Off }, ..seen }
        };
        if !self.touching || self.bodies.iter().any(|body| body.agent.model() == "tool") {
            (0..).zip(&self.bodies).map(of).collect()
        } else {
            vec![]
        }
    }

    /// Gives the lowest body one rate and all others another.
    pub fn at_rates(mut self, lowest_hz: f64, others_hz: f64) -> Self {
        for (at, body) in self.bodies.iter_mut().enumerate() {
            body.rate_hz = if at == 0 { lowest_hz } else { others_hz };
        }
        self
    }

    /// Makes one macro step; how long it was, seconds.
    pub fn step(&mut self) -> (ClusterReport, f64) {
        self.step_share(1.0)
    }

    /// The same of a macro step cut to a share of its length.
    pub fn step_share(&mut self, share: f64) -> (ClusterReport, f64) {
        let mut wishes = vec![];
        for body in &mut self.bodies {
            wishes.push((body.agent.member().unwrap().role(), 1.0 / body.rate_hz));
        }
        let plan = Plan::of(wishes.iter().copied());
        let dt = SimSpan::from_secs_f64(share * plan.macro_s).unwrap();
        let mut all = vec![];
        let mut neighbours = self.published();
        neighbours.extend_from_slice(&self.strangers);
        let apart: Vec<_> = (0..self.bodies.len() as u32).map(|id| (AgentId(id), Law::Off)).collect();
        let laws = if self.touching { &[][..] } else { &apart };
        for ((id, body), (role, wanted_s)) in (0..).zip(&mut self.bodies).zip(wishes) {
            let Placed { agent, memory, grips, links, user_springs, .. } = body;
            let context = StepContext {
                neighbours: &neighbours,
                user_springs,
                links,
                ..StepContext::alone(AgentId(id), self.time)
            };
            let member = agent.member().unwrap();
            let parts = plan.parts_in(role, wanted_s);
            all.push(Participant {
                id: AgentId(id),
                member: member.into(),
                context,
                laws,
                memory,
                parts,
                alone_s: wanted_s,
                grips,
            });
        }
        let mut report = ClusterReport::default();
        if let Some(doubling) = &mut self.doubling {
            doubling.begin_row();
            doubling.foresee(&self.scene, &mut all, dt, &PlainLoop).unwrap();
        }
        let mut advance = || report = self.stepper.step(&self.scene, &mut all, dt, &PlainLoop).unwrap();
        self.allocations = allocation_counter::measure(&mut advance).count_total;
        if let Some(doubling) = &mut self.doubling {
            doubling.compare(&all);
        }
        all.iter_mut().for_each(|one| one.member.change(|m| m.adapt()));
        self.time += dt;
        self.last_s = dt.as_secs_f64();
        (report, self.last_s)
    }

    pub fn energy_j(&mut self) -> f64 {
        let Self { bodies, snapshot, .. } = self;
        let of = |body: &Placed| {
            body.agent.write_snapshot(snapshot);
            snapshot.energy_j
        };
        bodies.iter().map(of).collect::<Vec<_>>().iter().sum()
    }

    /// Position and velocity of the middle of a body.
    pub fn middle(&mut self, body: usize) -> (DVec3, DVec3) {
        self.bodies[body].agent.write_snapshot(&mut self.snapshot);
        use metachron_core::Body;
        let mean = |list: &[DVec3]| list.iter().sum::<DVec3>() / list.len() as f64;
        match &self.snapshot.body {
            Body::Rigid(state) => (state.position, state.velocity),
            Body::Soft(soft) => (mean(&soft.positions), mean(&soft.velocities)),
            Body::Curve(curve) => (mean(&curve.positions), mean(&curve.velocities)),
            _ => (DVec3::ZERO, DVec3::ZERO),
        }
    }

    /// The mean upward force of contacts of a body, the lower number of two, in the last macro step, N.
    pub fn given_n(&self, body: usize, partner: Partner) -> f64 {
        self.given_n_along(body, partner, DVec3::Z)
    }

    /// The same along another axis.
    pub fn given_n_along(&self, body: usize, partner: Partner, axis: DVec3) -> f64 {
        let of_pair = self.stepper.totals().iter().filter(|total| total.member == body && total.partner == partner);
        of_pair.map(|total| total.impulse_n_s.dot(axis)).sum::<f64>() / self.last_s
    }

    /// How easily a body, the lower number of two, and its partner give way where they press most, 1/kg.
    pub fn inverse_mass_per_kg(&self, body: usize, partner: Partner) -> [f64; 2] {
        let of_pair = |total: &&PairTotal| total.member == body && total.partner == partner;
        self.stepper.totals().iter().find(of_pair).and_then(|total| total.inverse_mass_per_kg).unwrap_or([f64::NAN; 2])
    }

    /// Where the points are that a body publishes.
    pub fn points(&mut self, body: usize) -> Vec<DVec3> {
        self.bodies[body].agent.write_snapshot(&mut self.snapshot);
        match &self.snapshot.body {
            metachron_core::Body::Rigid(state) => vec![state.position],
            metachron_core::Body::Soft(soft) => soft.positions.clone(),
            metachron_core::Body::Curve(curve) => curve.positions.clone(),
            _ => vec![],
        }
    }

    /// Where a material point is.
    pub fn place(&mut self, body: usize, anchor: Anchor) -> DVec3 {
        self.bodies[body].agent.member().unwrap().attachments().unwrap().anchor(anchor).unwrap().position
    }

    /// The upward impulse of the last macro step by the floor, or by held bodies.
    fn borne_n_s(&self) -> f64 {
        let holds = self.bodies.iter().any(|body| body.held);
        let of = |total: &PairTotal| {
            let mine = total.impulse_n_s.z;
            match total.partner {
                Partner::Static(_) if !holds => mine,
                Partner::Agent(other) if holds => {
                    match (self.bodies[total.member].held, self.bodies[other.0 as usize].held) {
                        (true, false) => -mine,
                        (false, true) => mine,
                        _ => 0.0,
                    }
                }
                _ => 0.0,
            }
        };
        self.stepper.totals().iter().map(of).sum()
    }

    /// Plays for some seconds.
    pub fn play(&mut self, seconds: f64) -> Findings {
        self.play_by(seconds, || 1.0)
    }

    /// Plays for some seconds in macro steps of these shares of their length.
    pub fn play_by(&mut self, seconds: f64, mut share: impl FnMut() -> f64) -> Findings {
        let mut findings = Findings::default();
        let mut least_j = self.energy_j();
        let (mut borne_n_s, mut last_s, mut last_factors, mut last_steps) = (0.0, 0.0, 0, 0);
        while self.time.as_secs_f64() < seconds {
            let rests = self.time.as_secs_f64() > seconds - 0.5;
            let (report, dt_s) = self.step_share(share());
            let energy_j = self.energy_j();
            findings.gain_j = findings.gain_j.max(energy_j - least_j);
            least_j = least_j.min(energy_j);
            findings.steps += report.fine_steps;
            findings.factors += report.factors;
            findings.unfinished += report.unfinished;
            findings.contacts = findings.contacts.max(report.contacts);
            if rests {
                findings.rest_m = findings.rest_m.max(report.depth_m);
                borne_n_s += self.borne_n_s();
                last_s += dt_s;
                last_factors += report.factors;
                last_steps += report.fine_steps;
            } else {
                findings.landing_m = findings.landing_m.max(report.depth_m);
            }
        }
        let free_kg: f64 = self.bodies.iter().filter(|body| !body.held).map(|body| body.agent.mass_kg()).sum();
        findings.weight = borne_n_s / (last_s * free_kg * -GRAVITY.z);
        findings.factors_at_rest = f64::from(last_factors) / f64::from(last_steps);
        let heights: Vec<f64> = (0..self.bodies.len()).map(|body| self.middle(body).0.z).collect();
        findings.highest_m = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        findings.lowest_m = heights.iter().copied().fold(f64::INFINITY, f64::min);
        findings
    }
}
