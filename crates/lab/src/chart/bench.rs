//! Agents stepped in turn without a runtime: a coupling law is measured alone, without islands and without threads.
//!
//! In: agents, their rates, laws, springs and faults. Out: the last published state of each, and sums at a common time. The agent
//! with the earliest time steps next, among equals the lower number; its state is visible immediately, stamped with the end of
//! its step, as in a run whose steps cost nothing, or only when that time has come. Never here: measurements.

use metachron_contact::audit::Member;
use metachron_contact::{Agent, AnchorSpring, Neighbour, StepContext};
use metachron_contact::{Law, Link, OwnershipTraits, keep_step, owns};
use metachron_core::{AgentId, SimSpan, SimTime, Snapshot, StepError};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

/// Deliberate faults.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Faults {
    /// Each step is longer or shorter by up to this share.
    pub(super) jitter: f64,
    /// The share of states that never become visible.
    pub(super) loss: f64,
    /// Equal seeds disturb equally.
    pub(super) seed: u64,
    /// Whether a state becomes visible only when its time has come: as where a step takes as long as the time that it covers.
    pub(super) due: bool,
}

/// Agents that see each other.
pub(super) struct StepHarness {
    actors: Vec<Actor>,
    law: Law,
    faults: Faults,
    noise: u64,
}

/// An agent in the harness.
struct Actor {
    agent: Box<dyn Agent>,
    form: Option<Arc<CollisionShape>>,
    rate_hz: f64,
    /// Its newest state, visible to others or not.
    own: Snapshot,
    /// The state visible to others, and the one visible before.
    shown: [Arc<Snapshot>; 2],
    /// Springs from fixed points.
    hands: Vec<AnchorSpring>,
    links: Vec<Link>,
    /// Mass per length and rotary inertia of a tube.
    weight: [f64; 2],
    /// Length of its last step, seconds.
    last_s: f64,
}

impl StepHarness {
    /// An empty harness whose pairs all touch by `law`.
    pub(super) fn new(law: Law, faults: Faults) -> Self {
        Self { actors: Vec::new(), law, faults, noise: faults.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1 }
    }

    /// Adds an agent that steps `rate_hz` times a second; `weight`: for a tube its mass per length and rotary inertia.
    pub(super) fn add(&mut self, agent: Box<dyn Agent>, rate_hz: f64, weight: [f64; 2]) -> AgentId {
        let mut own = Snapshot::default();
        agent.write_snapshot(&mut own);
        let (form, first) = (agent.form(), Arc::new(own.clone()));
        let shown = [first.clone(), first];
        self.actors.push(Actor {
            agent,
            form,
            rate_hz,
            own,
            shown,
            hands: Vec::new(),
            links: Vec::new(),
            weight,
            last_s: 0.0,
        });
        AgentId(self.actors.len() as u32 - 1)
    }

    /// Attaches fixed springs to an agent.
    pub(super) fn attach_springs(&mut self, id: AgentId, hands: Vec<AnchorSpring>) {
        self.actors[id.0 as usize].hands = hands;
    }

    /// An agent's own newest state, visible to others or not.
    pub(super) fn own(&self, id: AgentId) -> &Snapshot {
        &self.actors[id.0 as usize].own
    }

    /// Length of an agent's last step, seconds.
    pub(super) fn last_s(&self, id: AgentId) -> f64 {
        self.actors[id.0 as usize].last_s
    }

    /// Links `of` to the link's other end; both agents have the link.
    pub(super) fn link(&mut self, of: AgentId, link: Link) {
        self.actors[of.0 as usize].links.push(link);
        let back = Link { other: of, here: link.there, there: link.here, ..link };
        self.actors[link.other.0 as usize].links.push(back);
    }

    /// The shape of an agent.
    pub(super) fn form(&self, id: AgentId) -> Option<&Arc<CollisionShape>> {
        self.actors[id.0 as usize].form.as_ref()
    }

    /// The newest own states of all agents, for an audit.
    pub(super) fn members(&self) -> Vec<Member<'_>> {
        let all = (0..).map(AgentId).zip(&self.actors);
        all.map(|(id, actor)| Member {
            id,
            snapshot: &actor.own,
            mass_per_length_kg_m: actor.weight[0],
            rotary_kg_m: actor.weight[1],
        })
        .collect()
    }

    /// The agent that steps next; `None` where all have reached `seconds`.
    pub(super) fn next(&self, seconds: f64) -> Option<AgentId> {
        let first = (0..).zip(&self.actors).min_by_key(|(id, actor)| (actor.own.time, *id));
        first.filter(|(_, actor)| actor.own.time.as_secs_f64() < seconds).map(|(id, _)| AgentId(id))
    }

    /// Lets every agent look around before the first step.
    pub(super) fn start(&mut self) {
        for i in 0..self.actors.len() {
            let me = AgentId(i as u32);
            let neighbours = self.neighbours_of(i);
            let actor = &mut self.actors[i];
            let dt = SimSpan::from_secs_f64(1.0 / actor.rate_hz).unwrap_or(SimSpan::ZERO);
            let (time, hands, links) = (actor.own.time, &actor.hands, &actor.links);
            actor.agent.observe(dt, &StepContext { me, time, neighbours: &neighbours, hands, links });
            actor.agent.write_snapshot(&mut actor.own);
            let shown = Arc::new(actor.own.clone());
            actor.shown = [Arc::clone(&shown), shown];
        }
    }

    /// Makes a step of an agent.
    ///
    /// # Errors
    /// A step that the agent refuses.
    pub(super) fn step(&mut self, me: AgentId) -> Result<(), StepError> {
        let i = me.0 as usize;
        let stretch = 1.0 + self.faults.jitter * (2.0 * self.random() - 1.0);
        let lost = self.random() < self.faults.loss;
        let neighbours = self.neighbours_of(i);
        let actor = &mut self.actors[i];
        let time: SimTime = actor.own.time;
        let dt = SimSpan::from_secs_f64(stretch / actor.rate_hz).unwrap_or(SimSpan::ZERO);
        let context = StepContext { me, time, neighbours: &neighbours, hands: &actor.hands, links: &actor.links };
        let wanted = dt;
        let dt = actor.agent.longest_step(wanted, &context);
        actor.agent.step(dt, &context)?;
        actor.last_s = dt.as_secs_f64();
        actor.agent.write_snapshot(&mut actor.own);
        (actor.own.time, actor.own.shortened_step) = (time + dt, (dt < wanted).then_some(dt));
        if !lost {
            actor.shown.swap(0, 1);
            actor.shown[0] = Arc::new(actor.own.clone());
        }
        Ok(())
    }

    /// All other agents as neighbours of one.
    fn neighbours_of(&self, me: usize) -> Vec<Neighbour> {
        (0..self.actors.len()).filter(|&other| other != me).map(|other| self.neighbour_of(me, other)).collect()
    }

    /// Another agent as a neighbour of one.
    fn neighbour_of(&self, me: usize, other: usize) -> Neighbour {
        let standing = |i: usize| {
            let actor = &self.actors[i];
            OwnershipTraits::new(AgentId(i as u32), actor.agent.model(), actor.rate_hz, actor.form.as_deref())
        };
        let (actor, now) = (&self.actors[other], self.actors[me].own.time);
        let early = self.faults.due && actor.shown[0].time > now;
        let snapshot = &actor.shown[usize::from(early)];
        let linked = actor.links.iter().any(|link| link.other == AgentId(me as u32) && link.law == Law::Cluster);
        Neighbour {
            id: AgentId(other as u32),
            step_s: snapshot.step_s(1.0 / actor.rate_hz),
            snapshot: Arc::clone(snapshot),
            form: actor.form.clone(),
            law: self.law,
            owned: owns(standing(me), standing(other), linked),
            computed_here: false,
            in_step: keep_step(standing(me), standing(other), linked),
        }
    }

    /// A number in 0 … 1, the same on every run.
    fn random(&mut self) -> f64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        (self.noise >> 11) as f64 / (1_u64 << 53) as f64
    }
}
