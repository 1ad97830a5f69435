//! Agents with clocks of their own, each a cluster by itself, that see each other's published states.

use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::{ContactMemory, Participant};
use metachron_contact::remote::{MacroStep, PairClock, Pairs, Remotes, computes, part};
use metachron_contact::step::ClusterStepper;
use metachron_contact::{Agent, AnchorSpring, Law, Link, Neighbour, StepContext};
use metachron_core::{AgentId, Body, Grip, Ledger, PlainLoop, RigidState, SimSpan, SimTime, Snapshot};
use metachron_geometry::Obstacle;
use std::sync::Arc;

/// Gravity, m/s².
pub const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// Changes a state that an agent is about to publish.
pub type Tamper = fn(&mut dyn Agent, &mut Snapshot);

/// An agent with its clock.
pub struct Clocked {
    pub agent: Box<dyn Agent>,
    pub rate_hz: f64,
    pub user_springs: Vec<AnchorSpring>,
    pub links: Vec<Link>,
    pub time: SimTime,
    /// Its newest state, and the one that others see: the newest whose time has come, or the newest.
    pub own: Snapshot,
    shown: [Arc<Snapshot>; 2],
    memory: ContactMemory,
    grips: Vec<Grip>,
    pairs: Pairs,
    remotes: Remotes,
    stepper: ClusterStepper,
    /// Its allocations in its last step.
    pub allocations: u64,
}

/// Agents among static solids; all pairs are asynchronous.
pub struct Clocks {
    pub all: Vec<Clocked>,
    pub law: Law,
    scene: ClusterScene,
    /// Whether a state is seen only when its time has come, as where a step takes as long as the time that it covers.
    pub due: bool,
    /// A change of the states that partners see, for comparison.
    pub tamper: Option<Tamper>,
}

impl Clocks {
    pub fn new(law: Law, obstacles: &[Obstacle]) -> Self {
        Self { all: vec![], law, scene: ClusterScene::new(obstacles).unwrap(), due: false, tamper: None }
    }

    pub fn add(&mut self, agent: impl Agent + 'static, rate_hz: f64) -> usize {
        let mut own = Snapshot::default();
        agent.write_snapshot(&mut own);
        let shown = Arc::new(own.clone());
        self.all.push(Clocked {
            agent: Box::new(agent),
            rate_hz,
            user_springs: vec![],
            links: vec![],
            time: SimTime::ZERO,
            own,
            shown: [shown.clone(), shown],
            memory: ContactMemory::default(),
            grips: vec![],
            pairs: Pairs::default(),
            remotes: Remotes::default(),
            stepper: ClusterStepper::default(),
            allocations: 0,
        });
        self.all.len() - 1
    }

    /// Links two agents, as both see it.
    pub fn link(&mut self, ends: [usize; 2], link: Link) {
        // both ends have each
        let number = self.all.iter().map(|one| one.links.len()).sum::<usize>() as u32 / 2;
        let link = Link { number, ..link };
        let back = Link { other: AgentId(ends[0] as u32), here: link.there, there: link.here, ..link };
        self.all[ends[0]].links.push(Link { other: AgentId(ends[1] as u32), ..link });
        self.all[ends[1]].links.push(back);
    }

    fn neighbours(&self, me: usize) -> Vec<Neighbour> {
        let clock = |at: usize| PairClock { id: AgentId(at as u32), step_s: self.all[at].rate_hz.recip() };
        let others = (0..self.all.len()).filter(|other| *other != me);
        let of = |other: usize| {
            let one = &self.all[other];
            let early = self.due && one.shown[0].time > self.all[me].time;
            let seen = Neighbour::observed(AgentId(other as u32), Arc::clone(&one.shown[usize::from(early)]));
            Neighbour {
                form: one.agent.form(),
                law: self.law,
                computed_here: computes(clock(me), clock(other)),
                step_s: one.rate_hz.recip(),
                ..seen
            }
        };
        others.map(of).collect()
    }

    /// The agent that steps next makes its step.
    pub fn step(&mut self) -> usize {
        let me = (0..self.all.len()).min_by_key(|at| (self.all[*at].time, *at)).unwrap();
        let neighbours = self.neighbours(me);
        let laws: Vec<_> =
            (0..self.all.len()).filter(|at| *at != me).map(|at| (AgentId(at as u32), self.law)).collect();
        let Self { all, scene, .. } = self;
        let Clocked {
            agent,
            rate_hz,
            user_springs,
            links,
            time,
            own,
            memory,
            grips,
            pairs,
            remotes,
            stepper,
            allocations,
            ..
        } = &mut all[me];
        let id = AgentId(me as u32);
        let dt = SimSpan::from_secs_f64(1.0 / *rate_hz).unwrap();
        let context = StepContext { neighbours: &neighbours, user_springs, links, ..StepContext::alone(id, *time) };
        let mut list: Vec<Participant<'_>> = Vec::with_capacity(8);
        let member = agent.member().unwrap();
        list.push(Participant {
            id,
            member: member.into(),
            context,
            laws: &laws,
            memory,
            parts: 1,
            alone_s: dt.as_secs_f64(),
            grips,
        });
        let sides = [Some(&mut *pairs)];
        let round = move || {
            let (mut list, mut sides) = (list, sides);
            let sides = &mut sides[..];
            remotes.join(&mut list, sides, stepper, MacroStep { dt_s: dt.as_secs_f64(), parts: 1 });
            stepper.step(scene, &mut list, dt, &PlainLoop).unwrap();
            part(&list, sides, stepper, dt.as_secs_f64());
        };
        *allocations = allocation_counter::measure(round).count_total;
        *time += dt;
        own.clear();
        agent.write_snapshot(own);
        own.pairs.clear();
        pairs.write(own);
        own.time = *time;
        let mut shown = own.clone();
        let one = &mut all[me];
        if let Some(tamper) = self.tamper {
            tamper(one.agent.as_mut(), &mut shown);
        }
        one.shown.swap(0, 1);
        one.shown[0] = Arc::new(shown);
        me
    }

    /// Plays until all have come to some time, and looks after every step.
    pub fn play(&mut self, seconds: f64, mut look: impl FnMut(&Self, usize)) {
        while self.all.iter().any(|one| one.time.as_secs_f64() < seconds - 1e-9) {
            let me = self.step();
            look(self, me);
        }
    }

    pub fn rigid(&self, at: usize) -> RigidState {
        let Body::Rigid(state) = self.all[at].own.body else { panic!("not rigid") };
        state
    }

    /// The impulse in flight to an agent, N·s.
    pub fn in_flight(&self, to: usize) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (from, one) in self.all.iter().enumerate() {
            let given = one.own.given.iter().find(|ledger| ledger.with == AgentId(to as u32));
            let taken = self.all[to].own.taken.iter().find(|ledger| ledger.with == AgentId(from as u32));
            let add = |ledger: &Ledger| ledger.beyond(taken, SimTime::ZERO, |_, impulse, _| sum += impulse.linear);
            given.into_iter().for_each(add);
        }
        sum
    }
}
