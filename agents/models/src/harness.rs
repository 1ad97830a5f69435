//! Agents with different clocks on one thread, for tests of couplings: whoever's time is earliest steps next.
//!
//! In: agents, their rates, laws and links; faults on purpose. Out: their snapshots, and sums at a common time with the
//! impulses that are still on their way. Never here: threads, pacing, wall time.

use glam::{DMat3, DVec3};
use metachron_contact::audit::{Member, settled};
use metachron_contact::{Agent, AnchorSpring, Neighbour, StepContext};
use metachron_contact::{Law, Link, OwnershipTraits, acknowledged, keep_step, owns};
use metachron_core::Impulse;
use metachron_core::{AgentId, Inertia, RigidState, SimSpan, SimTime, Snapshot};
use std::sync::Arc;

/// What goes wrong between agents.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Faults {
    /// Each step is longer or shorter by up to this share.
    pub jitter: f64,
    /// The share of publications that nobody ever sees.
    pub loss: f64,
    /// A reader sees a state up to this many publications old, never mind what it saw before.
    pub late: usize,
    /// Where the random numbers start.
    pub seed: u64,
}

/// Agents that see each other.
pub(crate) struct Stage {
    actors: Vec<Actor>,
    laws: Vec<(AgentId, AgentId, Law)>,
    faults: Faults,
    noise: u64,
    looked: bool,
    /// Whether nobody sees what others make of a step before their own that begins at the same time: as the executors have it.
    pub at_once: bool,
}

struct Actor {
    agent: Box<dyn Agent>,
    rate_hz: f64,
    /// How far it is ahead of those who are not.
    lead_s: f64,
    time: SimTime,
    published: Vec<Arc<Snapshot>>,
    /// When the step to the newest of these began.
    begun: Option<SimTime>,
    hands: Vec<AnchorSpring>,
    links: Vec<Link>,
}

/// A rigid body at a time that is not its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Settled {
    pub state: RigidState,
    pub mass_kg: f64,
    pub inertia: DMat3,
}

impl Settled {
    pub(crate) fn kinetic_j(&self) -> f64 {
        let spin = self.state.spin;
        0.5 * (self.mass_kg * self.state.velocity.length_squared() + spin.dot(self.inertia * spin))
    }

    /// Linear momentum, and angular momentum about the origin.
    pub(crate) fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.state.velocity * self.mass_kg;
        (linear, self.state.position.cross(linear) + self.inertia * self.state.spin)
    }
}

impl Stage {
    pub(crate) fn new(faults: Faults) -> Self {
        let noise = faults.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        Self { actors: vec![], laws: vec![], faults, noise, looked: false, at_once: false }
    }

    /// Adds an agent that steps `rate_hz` times a second.
    pub(crate) fn add(&mut self, agent: impl Agent + 'static, rate_hz: f64) -> AgentId {
        self.add_boxed(Box::new(agent), rate_hz)
    }

    /// The same of an agent of any model.
    pub(crate) fn add_boxed(&mut self, agent: Box<dyn Agent>, rate_hz: f64) -> AgentId {
        let mut snapshot = Snapshot::default();
        agent.write_snapshot(&mut snapshot);
        let published = vec![Arc::new(snapshot)];
        let (hands, links) = (vec![], vec![]);
        self.actors.push(Actor {
            agent,
            rate_hz,
            lead_s: 0.0,
            time: SimTime::ZERO,
            published,
            begun: None,
            hands,
            links,
        });
        AgentId(self.actors.len() as u32 - 1)
    }

    pub(crate) fn law(&mut self, a: AgentId, b: AgentId, law: Law) {
        self.laws.push((a, b, law));
    }

    pub(crate) fn hold(&mut self, id: AgentId, hand: AnchorSpring) {
        self.actors[id.0 as usize].hands.push(hand);
    }

    /// Links `of` with the link's other end; both know it.
    pub(crate) fn link(&mut self, of: AgentId, link: Link) {
        self.actors[of.0 as usize].links.push(link);
        let back = Link { other: of, here: link.there, there: link.here, ..link };
        self.actors[link.other.0 as usize].links.push(back);
    }

    /// The newest state of an agent, seen or not.
    pub(crate) fn newest(&self, id: AgentId) -> &Snapshot {
        self.actors[id.0 as usize].published.last().expect("published when it was added")
    }

    /// What an agent weighs, kg.
    pub(crate) fn mass_kg(&self, id: AgentId) -> f64 {
        self.actors[id.0 as usize].agent.mass_kg()
    }

    /// Changes what others see of an agent.
    pub(crate) fn spoil(&mut self, id: AgentId, change: impl FnOnce(&mut Snapshot)) {
        let last = self.actors[id.0 as usize].published.last_mut().expect("published when it was added");
        change(Arc::make_mut(last));
    }

    /// From now on `id` is `lead_s` seconds ahead of those of whom nothing is said.
    pub(crate) fn lead(&mut self, id: AgentId, lead_s: f64) {
        self.actors[id.0 as usize].lead_s = lead_s;
    }

    /// The agent itself.
    pub(crate) fn agent_mut(&mut self, id: AgentId) -> &mut dyn Agent {
        &mut *self.actors[id.0 as usize].agent
    }

    /// Changes what goes wrong from now on.
    pub(crate) fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
    }

    /// Steps everybody up to `seconds`, and looks at the stage after every step.
    pub(crate) fn run(&mut self, seconds: f64, mut look: impl FnMut(&Self)) {
        self.look();
        loop {
            let late_s = |i: &usize| self.actors[*i].time.as_secs_f64() - self.actors[*i].lead_s;
            let next = (0..self.actors.len()).min_by(|i, j| late_s(i).total_cmp(&late_s(j))).expect("an agent");
            if self.actors[next].time.as_secs_f64() >= seconds {
                return;
            }
            self.step(next);
            look(self);
        }
    }

    /// Everybody looks around, before the first step.
    fn look(&mut self) {
        if std::mem::replace(&mut self.looked, true) {
            return;
        }
        for i in 0..self.actors.len() {
            let me = AgentId(i as u32);
            let dt = SimSpan::from_secs_f64(1.0 / self.actors[i].rate_hz).expect("a rate");
            let neighbours: Vec<_> =
                (0..self.actors.len()).filter(|&j| j != i).map(|j| self.sight(me, AgentId(j as u32))).collect();
            let Actor { agent, time, hands, links, published, .. } = &mut self.actors[i];
            agent.observe(dt, &StepContext { me, time: *time, neighbours: &neighbours, hands, links });
            let mut snapshot = Snapshot::default();
            agent.write_snapshot(&mut snapshot);
            published.push(Arc::new(snapshot));
        }
    }

    fn step(&mut self, i: usize) {
        let me = AgentId(i as u32);
        let stretch = 1.0 + self.faults.jitter * (2.0 * self.random() - 1.0);
        let dt = SimSpan::from_secs_f64(stretch / self.actors[i].rate_hz).expect("a rate");
        let neighbours: Vec<_> =
            (0..self.actors.len()).filter(|&j| j != i).map(|j| self.sight(me, AgentId(j as u32))).collect();
        let lost = self.random() < self.faults.loss;
        let actor = &mut self.actors[i];
        let around =
            StepContext { me, time: actor.time, neighbours: &neighbours, hands: &actor.hands, links: &actor.links };
        let wanted = dt;
        let dt = actor.agent.longest_step(wanted, &around);
        actor.agent.step(dt, &around).expect("a step that succeeds");
        let began = actor.time;
        actor.time += dt;
        let mut snapshot = Snapshot::default();
        actor.agent.write_snapshot(&mut snapshot);
        (snapshot.time, snapshot.shortened_step) = (actor.time, (dt < wanted).then_some(dt));
        if !lost {
            actor.published.push(Arc::new(snapshot));
            actor.begun = Some(began);
        }
        let keep = self.faults.late + 2;
        let surplus = self.actors[i].published.len().saturating_sub(keep);
        self.actors[i].published.drain(..surplus);
    }

    /// How `me` sees another.
    fn sight(&mut self, me: AgentId, id: AgentId) -> Neighbour {
        let late = (self.random() * (self.faults.late as f64 + 1.0)) as usize;
        let actor = &self.actors[id.0 as usize];
        let unseen = self.at_once && actor.begun.is_some_and(|begun| begun >= self.actors[me.0 as usize].time);
        let newest = actor.published.len() - 1 - usize::from(unseen);
        let snapshot = actor.published[newest.saturating_sub(late)].clone();
        let pair = self.laws.iter().find(|(a, b, _)| (*a, *b) == (me, id) || (*a, *b) == (id, me));
        let law = pair.map_or(Law::Cluster, |(_, _, law)| *law);
        let (mine, its, linked) = (self.standing(me), self.standing(id), self.are_linked(me, id));
        let (owned, in_step) = (owns(mine, its, linked), keep_step(mine, its, linked));
        let step_s = snapshot.step_s(1.0 / actor.rate_hz);
        Neighbour { id, snapshot, form: actor.agent.form(), law, owned, computed_here: false, in_step, step_s }
    }

    fn standing(&self, id: AgentId) -> OwnershipTraits {
        let actor = &self.actors[id.0 as usize];
        OwnershipTraits::new(id, actor.agent.model(), actor.rate_hz, actor.agent.form().as_deref())
    }

    fn are_linked(&self, me: AgentId, other: AgentId) -> bool {
        self.actors[me.0 as usize].links.iter().any(|link| link.other == other && link.law == Law::Cluster)
    }

    /// Which of two owns their pair.
    pub(crate) fn owner(&self, [a, b]: [AgentId; 2]) -> AgentId {
        if owns(self.standing(a), self.standing(b), self.are_linked(a, b)) { a } else { b }
    }

    /// Everything that others have given to `id` and its own newest state does not know.
    pub(crate) fn on_their_way(&self, id: AgentId, at: SimTime, mut visit: impl FnMut(Impulse, Impulse)) {
        let newest = self.newest(id);
        for other in (0..self.actors.len()).map(|j| AgentId(j as u32)).filter(|j| *j != id) {
            let seen = Neighbour::observed(other, Arc::new(newest.clone()));
            for ledger in self.newest(other).given.iter().filter(|ledger| ledger.with == id) {
                ledger.since(acknowledged(&seen, other), at, |_, sum, carried| visit(sum, carried));
            }
        }
    }

    /// A rigid body at `seconds`, with everything that is on its way to it.
    pub(crate) fn settled(&self, id: AgentId, seconds: f64) -> Settled {
        let Inertia::Rigid { inverse_mass, inverse_inertia } = self.newest(id).inertia else { panic!("a rigid body") };
        let member = |id| Member { id, snapshot: self.newest(id), mass_per_length_kg_m: 0.0, rotary_kg_m: 0.0 };
        let members: Vec<_> = (0..self.actors.len()).map(|i| member(AgentId(i as u32))).collect();
        let at = SimTime::ZERO + SimSpan::from_secs_f64(seconds).expect("a time");
        let state = settled(&member(id), &members, at).expect("a rigid body");
        Settled { state, mass_kg: inverse_mass.recip(), inertia: inverse_inertia.inverse() }
    }

    /// The linear momentum of everybody, with everything that is on its way.
    pub(crate) fn momentum(&self) -> DVec3 {
        let mut total = DVec3::ZERO;
        for (i, actor) in self.actors.iter().enumerate() {
            total += actor.agent.momentum().0;
            self.on_their_way(AgentId(i as u32), actor.time, |sum, _| total += sum.linear);
        }
        total
    }

    /// A number in 0 … 1.
    fn random(&mut self) -> f64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        (self.noise >> 11) as f64 / (1_u64 << 53) as f64
    }
}
