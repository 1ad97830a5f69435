//! Agents stepped in turn without a runtime: a coupling law is measured alone, each agent in a cluster of its own, without threads.
//!
//! In: agents, their rates, laws, springs and faults. Out: the last published state of each, and sums at a common time. The agent
//! with the earliest time steps next, among equals the lower number; its state is visible immediately, stamped with the end of
//! its step, as in a run whose steps cost nothing, or only when that time has come. Never here: measurements.

use super::penalty::{Overlaps, Penalty};
use glam::DVec3;
use metachron_contact::audit::Member;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::{ContactMemory, Participant};
use metachron_contact::remote::{MacroStep, PairClock, Pairs, Remotes, computes, part};
use metachron_contact::step::ClusterStepper;
use metachron_contact::{Agent, AnchorSpring, Law, Link, Neighbour, StepContext, Stepping};
use metachron_core::{AgentId, Body, Grip, PlainLoop, SimSpan, Snapshot, StepError};
use metachron_geometry::CollisionShape;
use std::sync::Arc;

/// The law of all pairs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) enum PairLaw {
    /// One of the product's.
    Product(Law),
    /// A spring and a damper between newest states.
    Penalty {
        /// N/m.
        stiffness_n_m: f64,
        /// N·s/m.
        damping_n_s_m: f64,
        /// Whether states are brought forward.
        extrapolate: bool,
    },
}

/// Deliberate faults.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in super::super) struct Faults {
    /// Each step is longer or shorter by up to this share.
    pub(in super::super) jitter: f64,
    /// The share of states that never become visible.
    pub(in super::super) loss: f64,
    /// Equal seeds disturb equally.
    pub(in super::super) seed: u64,
    /// Whether a state becomes visible only when its time has come: as where a step takes as long as the time that it covers.
    pub(in super::super) due: bool,
}

/// Agents that see each other.
pub(in super::super) struct StepHarness {
    actors: Vec<Actor>,
    law: PairLaw,
    scene: ClusterScene,
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
    user_springs: Vec<AnchorSpring>,
    links: Vec<Link>,
    /// Its weight, for an audit.
    weight: Weight,
    /// Length of its last step, seconds.
    last_s: f64,
    cluster: Cluster,
}

/// The weight of an agent, as an audit needs it.
#[derive(Debug, Clone, Copy, Default)]
pub(in super::super) struct Weight {
    /// Of a tube, kg/m.
    pub(in super::super) mass_per_length_kg_m: f64,
    /// Of a rigid body, m/s².
    pub(in super::super) gravity: DVec3,
}

/// The cluster of an agent alone.
#[derive(Default)]
struct Cluster {
    memory: ContactMemory,
    grips: Vec<Grip>,
    pairs: Pairs,
    remotes: Remotes,
    stepper: ClusterStepper,
    overlaps: Overlaps,
}

impl StepHarness {
    /// An empty harness whose pairs all touch by `law`.
    pub(in super::super) fn new(law: PairLaw, faults: Faults) -> Self {
        let noise = faults.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        Self { actors: Vec::new(), law, scene: ClusterScene::default(), faults, noise }
    }

    /// Adds an agent that steps `rate_hz` times a second.
    pub(in super::super) fn add(&mut self, agent: Box<dyn Agent>, rate_hz: f64, weight: Weight) -> AgentId {
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
            user_springs: Vec::new(),
            links: Vec::new(),
            weight,
            last_s: 0.0,
            cluster: Cluster::default(),
        });
        AgentId(self.actors.len() as u32 - 1)
    }

    /// Attaches fixed springs to an agent.
    pub(in super::super) fn attach_springs(&mut self, id: AgentId, user_springs: Vec<AnchorSpring>) {
        self.actors[id.0 as usize].user_springs = user_springs;
    }

    /// An agent's own newest state, visible to others or not.
    pub(in super::super) fn own(&self, id: AgentId) -> &Snapshot {
        &self.actors[id.0 as usize].own
    }

    /// Length of an agent's last step, seconds.
    pub(in super::super) fn last_s(&self, id: AgentId) -> f64 {
        self.actors[id.0 as usize].last_s
    }

    /// Links `of` to the link's other end; both agents have the link.
    pub(in super::super) fn link(&mut self, of: AgentId, link: Link) {
        self.actors[of.0 as usize].links.push(link);
        let back = Link { other: of, here: link.there, there: link.here, ..link };
        self.actors[link.other.0 as usize].links.push(back);
    }

    /// The shape of an agent.
    pub(in super::super) fn form(&self, id: AgentId) -> Option<&Arc<CollisionShape>> {
        self.actors[id.0 as usize].form.as_ref()
    }

    /// The newest own states of all agents, for an audit.
    pub(in super::super) fn members(&self) -> Vec<Member<'_>> {
        let all = (0..).map(AgentId).zip(&self.actors);
        all.map(|(id, actor)| Member {
            id,
            snapshot: &actor.own,
            mass_per_length_kg_m: actor.weight.mass_per_length_kg_m,
        })
        .collect()
    }

    /// The agent that steps next; `None` where all have reached `seconds`.
    pub(in super::super) fn next(&self, seconds: f64) -> Option<AgentId> {
        let first = (0..).zip(&self.actors).min_by_key(|(id, actor)| (actor.own.time, *id));
        first.filter(|(_, actor)| actor.own.time.as_secs_f64() < seconds).map(|(id, _)| AgentId(id))
    }

    /// Makes a step of an agent.
    ///
    /// # Errors
    /// A step that the agent refuses.
    pub(in super::super) fn step(&mut self, me: AgentId) -> Result<(), StepError> {
        let i = me.0 as usize;
        let stretch = 1.0 + self.faults.jitter * (2.0 * self.random() - 1.0);
        let lost = self.random() < self.faults.loss;
        let neighbours = self.neighbours_of(i);
        let actor = &mut self.actors[i];
        let time = actor.own.time;
        let dt = SimSpan::from_secs_f64(stretch / actor.rate_hz).unwrap_or(SimSpan::ZERO);
        let Actor { agent, own, user_springs, links, cluster, weight, .. } = actor;
        let context = StepContext { neighbours: &neighbours, user_springs, links, ..StepContext::alone(me, time) };
        cluster.step(agent.as_mut(), &self.scene, Around { context, law: self.law }, dt)?;
        actor.last_s = dt.as_secs_f64();
        own.clear();
        agent.write_snapshot(own);
        own.pairs.clear();
        own.grips.clone_from(&cluster.grips);
        cluster.pairs.write(own);
        own.time = time + dt;
        if matches!(own.body, Body::Rigid(_)) {
            own.acceleration = weight.gravity;
        }
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
        let (actor, now) = (&self.actors[other], self.actors[me].own.time);
        let early = self.faults.due && actor.shown[0].time > now;
        let seen = Neighbour::observed(AgentId(other as u32), Arc::clone(&actor.shown[usize::from(early)]));
        let clock = |at: usize| PairClock { id: AgentId(at as u32), step_s: self.actors[at].rate_hz.recip() };
        Neighbour {
            form: actor.form.clone(),
            law: if let PairLaw::Product(law) = self.law { law } else { Law::Off },
            computed_here: computes(clock(me), clock(other)),
            step_s: actor.rate_hz.recip(),
            ..seen
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

impl Cluster {
    /// Makes a step of `dt` of an agent that is alone in its cluster; how long it was.
    fn step(
        &mut self,
        agent: &mut dyn Agent,
        scene: &ClusterScene,
        around: Around<'_>,
        dt: SimSpan,
    ) -> Result<(), StepError> {
        let Self { memory, grips, pairs, remotes, stepper, overlaps } = self;
        let Around { context, law } = around;
        let laws: Vec<(AgentId, Law)> = context.neighbours.iter().map(|other| (other.id, other.law)).collect();
        let member = match agent.stepping() {
            Stepping::Own(own) => return own.step(dt, &context).map(drop),
            Stepping::Cluster(member) => member,
        };
        let id = context.me;
        let mut list = vec![Participant {
            id,
            member: member.into(),
            context,
            laws: &laws,
            memory,
            parts: 1,
            alone_s: dt.as_secs_f64(),
            grips,
        }];
        let sides = &mut [Some(pairs)];
        let dt_s = dt.as_secs_f64();
        remotes.join(&mut list, sides, stepper, MacroStep { dt_s, parts: 1 });
        if let PairLaw::Penalty { stiffness_n_m, damping_n_s_m, extrapolate } = law {
            // velocities and skin are those of its last step
            let penalty = Penalty { stiffness_n_m, damping_n_s_m, extrapolate, dt_s };
            for other in context.neighbours {
                overlaps.push_off(&list[0], other, &penalty, &mut stepper.external().known);
            }
        }
        stepper.step(scene, &mut list, dt, &PlainLoop)?;
        part(&list, sides, stepper, dt_s);
        Ok(())
    }
}

/// An agent's step context, and the law of its pairs.
#[derive(Clone, Copy)]
struct Around<'a> {
    context: StepContext<'a>,
    law: PairLaw,
}
