//! The turn of a contact cluster: its leader steps all members as one problem.
//!
//! In: the members at the leader's time, the peers that each of them sees. Out: their new states, their bonds, members
//! that have lost touch.
//! Never here: how members come and go ([`handover`]), what else belongs to a turn ([`turn`]), the problem itself
//! ([`metachron_contact::step`]).

mod attachments;
mod common_time;
mod contacts;
mod exclusion;
mod handover;
mod macro_step;
mod membership;
mod notes;
mod places;
mod solve_budget;
#[cfg(test)]
mod tests;
mod turn;

pub(super) use attachments::JointedTo;
use attachments::{held_by_joints, held_by_links};
pub(super) use handover::{Handover, Led, assign_leaders, close_remaining, hand_over, return_arrivals};
pub(super) use membership::{Epoch, Membership};
pub(super) use places::{Place, Placed, check_places, put_back, take_apart};
pub(super) use solve_budget::SolveBound;
use solve_budget::{FactorPrice, Solved};
pub(super) use turn::Leap;

use crate::agent::handle::Shared;
use crate::commands::loads::{Acting, Loads};
use crate::neighbours::broad_phase::PlannedStep;
use crate::neighbours::observation::{Observer, newest};
use crate::turn::agent_runner::{AgentRunner, StepOutcome};
use crate::turn::helpers::Helped;
use crate::turn::model::contained;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::{ContactMemory, Participant, Role};
use metachron_contact::remote::{Pairs, Remotes};
use metachron_contact::step::{ClusterStepper, Plan, StepDoubling};
use metachron_contact::{Link, Neighbour, StepContext};
use metachron_core::step_doubling::DoublingSchedule;
use metachron_core::{
    AgentId, Archive, ArchiveError, AttachmentEvent, Body, ClusterSolves, ClusterState, ContactState, DisjointSets,
    Grip, JointEffort, PairState, SimSpan, SimTime, Snapshot, Wrench, archive_values,
};
use std::sync::Arc;

/// No overload stretches a macro step beyond this, unless it is longer anyway, seconds.
const STRETCHED_MAX_S: f64 = 1.0 / 60.0;

/// The cluster side of an agent: its contacts, joints and bonds, and the solvers of the steps that it leads.
pub(super) struct MemberState {
    scene: Arc<ClusterScene>,
    /// Joints that hold it to other agents, the torn ones too.
    jointed: Vec<JointedTo>,
    /// Only of one that makes turns.
    stepper: Option<Box<ClusterStepper>>,
    memory: ContactMemory,
    grips: Vec<Grip>,
    pairs: Vec<PairState>,
    contacts: Vec<ContactState>,
    /// The impulse of all contacts on it in the last step, N and N·m.
    wrench: Wrench,
    /// The efforts of its joints in the last step.
    efforts: Vec<JointEffort>,
    /// The events of the attachments that it reports.
    events: Vec<AttachmentEvent>,
    /// Agents that belong into the same cluster, as it sees them.
    bonds: Vec<AgentId>,
    /// Of these the ones that rest: they are woken.
    sleepers: Vec<AgentId>,
    /// Work of its own steps in the last turn, in the unit of its model, and its share of the time of that turn, seconds.
    work: f64,
    work_s: f64,
    /// The time that the turns that it leads took on helpers, as far as it is not accounted for.
    helped: Helped,
    /// Which of the steps that it leads are repeated in halves, and the solver that repeats them.
    schedule: DoublingSchedule,
    doubling: Option<Box<StepDoubling>>,
    /// The error of the last row of repeated steps, metres (control.md, eq. 31).
    drift_m: f64,
    /// How many steps of its own the last step had.
    parts: u32,
    /// Whether its motion asked for more than the last step could be divided into.
    under_resolved: bool,
    /// Its part in the last step, and the solves of the steps that it has led.
    state: Option<ClusterState>,
    solves: ClusterSolves,
    /// The solves of the turn in progress, and the price of factors in the turns that it leads.
    solved: Option<Solved>,
    price: FactorPrice,
    /// Its pairs whose other sides keep clocks of their own; `None` where its scene declares none.
    asynchronous: Option<Box<Pairs>>,
    /// The partners of such pairs as the members that it leads meet them.
    remotes: Option<Box<Remotes>>,
    /// Storage, empty between turns.
    participants: Vec<Participant<'static>>,
    sides: Vec<Option<&'static mut Pairs>>,
    wishes: Vec<Wish>,
    groups: DisjointSets,
    ids: Vec<AgentId>,
}

/// The solvers of the steps that an agent leads, and of the steps that repeat them.
pub(super) struct Steppers {
    stepper: Option<Box<ClusterStepper>>,
    doubling: Option<Box<StepDoubling>>,
}

/// The step that a member wants.
#[derive(Debug, Clone, Copy)]
struct Wish {
    role: Role,
    step_s: f64,
}

/// The cost of a member's steps in a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MemberCost {
    pub model: &'static str,
    /// In the unit of the model.
    pub work: f64,
}

/// How long a step may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Span {
    /// As long as the agent that makes it wants; a cluster's is stretched as its leader's is longer than usual.
    Wanted(SimSpan),
    /// No longer than this, to come to a given time.
    AtMost(SimSpan),
}

/// A step that is to be made, by an agent that has looked around.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepPlan {
    dt: SimSpan,
    /// Which steps the members of its cluster make in it; `None` of an agent that is no member of any.
    members: Option<Plan>,
    /// The most steps of each of its solves.
    factors_max: Option<u32>,
}

impl StepPlan {
    /// Its length.
    pub const fn dt(&self) -> SimSpan {
        self.dt
    }

    /// The most steps of each of its solves; `None` for as many as the laws take.
    pub const fn factors_max(&self) -> Option<u32> {
        self.factors_max
    }

    /// The same with solves of at most so many steps.
    pub const fn within(self, factors_max: Option<u32>) -> Self {
        Self { factors_max, ..self }
    }
}

/// A bug: only members are stepped in clusters.
const NOT_A_MEMBER: &str = "is not a member of clusters";

impl std::fmt::Debug for MemberState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MemberState").field("bonds", &self.bonds).finish_non_exhaustive()
    }
}

impl MemberState {
    /// The state of a member in the clusters of `scene`, of which `jointed` are its joints; `asynchronous` of an agent that has pairs with clocks
    /// of their own.
    pub fn new(scene: Arc<ClusterScene>, jointed: Vec<JointedTo>, asynchronous: bool) -> Self {
        Self {
            asynchronous: asynchronous.then(Box::default),
            remotes: None,
            sides: Vec::new(),
            scene,
            jointed,
            stepper: None,
            memory: ContactMemory::default(),
            grips: Vec::new(),
            pairs: Vec::new(),
            contacts: Vec::new(),
            wrench: Wrench::default(),
            efforts: Vec::new(),
            events: Vec::new(),
            bonds: Vec::new(),
            sleepers: Vec::new(),
            work: 0.0,
            work_s: 0.0,
            helped: Helped::default(),
            schedule: DoublingSchedule::default(),
            doubling: None,
            drift_m: 0.0,
            parts: 1,
            under_resolved: false,
            state: None,
            solves: ClusterSolves::default(),
            solved: None,
            price: FactorPrice::default(),
            participants: Vec::new(),
            wishes: Vec::new(),
            groups: DisjointSets::default(),
            ids: Vec::new(),
        }
    }

    /// Completes a state that its agent has just written.
    pub fn complete(&self, into: &mut Snapshot) {
        into.grips.clone_from(&self.grips);
        into.pairs.clone_from(&self.pairs);
        into.contacts.clone_from(&self.contacts);
        into.contact_wrench = self.wrench;
        into.efforts.clone_from(&self.efforts);
        into.events.clone_from(&self.events);
        into.sensed.clear();
        into.sensed.extend_from_slice(self.memory.sensed());
        into.bonds.clone_from(&self.bonds);
        into.touches.clone_from(&self.sleepers);
        into.cluster = self.state;
        into.drift_m += self.drift_m;
        into.residual_m += self.drift_m;
        if let Some(pairs) = &self.asynchronous {
            pairs.write(into);
        }
    }

    /// Notes that its body was put where no step has led it.
    pub fn note_placed(&mut self) {
        self.memory.note_placed();
    }

    /// Forgets the history of contacts on edges and triangles of skins.
    pub fn forget_features(&mut self) {
        self.memory.forget_features();
    }

    /// Writes or reads the memory of earlier turns that the next turns need.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(
            archive,
            self.memory,
            self.grips,
            self.pairs,
            self.contacts,
            self.wrench,
            self.efforts,
            self.events
        )?;
        archive_values!(archive, self.bonds, self.sleepers)?;
        archive_values!(archive, self.work, self.work_s, self.schedule, self.drift_m, self.state, self.solves)?;
        archive_values!(archive, self.solved, self.price, self.under_resolved)?;
        archive.option(&mut self.stepper, Box::default, |stepper, archive| stepper.archive(archive))?;
        archive.option(&mut self.doubling, Box::default, |doubling, archive| doubling.archive(archive))?;
        archive.option(&mut self.asynchronous, Box::default, |pairs, archive| pairs.archive(archive))?;
        archive.option(&mut self.remotes, Box::default, |remotes, archive| remotes.archive(archive))
    }

    /// Takes out the solvers of its steps and of their repetition: a state that is read makes them anew.
    pub fn take_steppers(&mut self) -> Steppers {
        Steppers { stepper: self.stepper.take(), doubling: self.doubling.take() }
    }

    /// Puts that back.
    pub fn put_steppers(&mut self, Steppers { stepper, doubling }: Steppers) {
        (self.stepper, self.doubling) = (stepper, doubling);
    }

    /// The time that the turns that it leads took on helpers, as far as it is not accounted for.
    pub const fn helped(&self) -> Helped {
        self.helped
    }

    /// Takes that time, to account for it.
    pub fn take_helped(&mut self) -> Helped {
        std::mem::take(&mut self.helped)
    }

    /// The doubling that repeats the step that it leads next, its `steps`-th, in halves; `None` where doubling is off.
    fn repeats(&mut self, steps: u64, me: AgentId) -> Option<Box<StepDoubling>> {
        let begins = self.schedule.begins(steps, me);
        self.schedule.is_on().then(|| {
            let mut doubling = self.doubling.take().unwrap_or_default();
            if begins {
                doubling.begin_row();
            }
            doubling
        })
    }

    /// Notes the agents that belong into its cluster: not partners of asynchronous pairs, which only see each other.
    fn bond(&mut self, observer: &Observer, grasped: Option<AgentId>, links: &[Link], mine: &Shared) {
        let is_apart = |id: AgentId| mine.law(id).is_asynchronous();
        self.bonds.clear();
        self.bonds.extend(observer.near().iter().copied().filter(|id| !is_apart(*id)));
        self.bonds.extend(held_by_joints(&self.jointed, &self.memory).chain(grasped));
        self.bonds.extend(held_by_links(links, &self.memory));
        self.bonds.extend(observer.neighbours().iter().filter_map(|n| holds(n, observer.me())));
        self.bonds.sort_unstable();
        self.bonds.dedup();
        self.sleepers.clear();
        let rests = |id: &AgentId| observer.neighbours().iter().any(|n| n.id == *id && n.snapshot.at_rest);
        self.sleepers.extend(self.bonds.iter().copied().filter(rests));
    }
}

/// The agent on the other side of a grasp that joins `neighbour` and `me`.
fn holds(neighbour: &Neighbour, me: AgentId) -> Option<AgentId> {
    let Body::Tool(tool) = &neighbour.snapshot.body else { return None };
    tool.grasp.filter(|grasp| grasp.target == me).map(|_| neighbour.id)
}

/// The users' commands that act on an agent in a step of `dt` from `time`.
fn prepared(loads: &mut Option<Box<Loads>>, time: SimTime, dt: SimSpan) -> &Acting {
    static NOTHING: Acting = Acting::NOTHING;
    let Some(loads) = loads else { return &NOTHING };
    loads.prepare(time, dt);
    loads.acting()
}

impl AgentRunner {
    /// Steps it with all that it leads and that are at its time, each solve by at most so many steps; an agent that is no member of clusters by
    /// itself.
    ///
    /// # Errors
    /// The reason why one of them cannot go on.
    pub fn step_alone(&mut self, span: Span, factors_max: Option<u32>) -> Result<StepOutcome, String> {
        let plan = self.plan_step(span)?;
        self.make_step(plan.within(factors_max))
    }

    /// Looks around before such a step: all that it depends on is known then, whatever others do meanwhile.
    ///
    /// # Errors
    /// The reason why it cannot be made.
    pub fn plan_step(&mut self, span: Span) -> Result<StepPlan, String> {
        let time = self.pace.time();
        if self.cluster.is_none() {
            let (Span::Wanted(dt) | Span::AtMost(dt)) = span;
            let step = PlannedStep { start: self.pace.scene_time(), dt };
            self.observe(step, &Membership::default());
            return Ok(StepPlan { dt, members: None, factors_max: None });
        }
        self.led.note_membership(self.shared.id, time);
        let (plan, dt) = self.plan(span)?;
        self.look(time, dt);
        Ok(StepPlan { dt, members: Some(plan), factors_max: None })
    }

    /// Makes the step that was planned: reads and writes nothing of others.
    ///
    /// # Errors
    /// The reason why one of them cannot go on.
    pub fn make_step(&mut self, step: StepPlan) -> Result<StepOutcome, String> {
        let StepPlan { dt, members, factors_max } = step;
        if let Some(plan) = members {
            return self.step_cluster(plan, factors_max, dt);
        }
        let (me, time, neighbours) = (self.shared.id, self.pace.time(), self.observer.neighbours());
        let Acting { springs: user_springs, forces, motors, pose } = prepared(&mut self.loads, time, dt);
        let context =
            StepContext { me, time, neighbours, user_springs, forces, motors, pose: *pose, links: &self.links };
        let report = self.model.step(dt, &context)?;
        let done = &self.shared.gauges.work;
        done.set(done.get() + report.work);
        Ok(StepOutcome { report, dt })
    }

    /// Calls `visit` with itself and with each that it leads and that is at its time, by rising numbers.
    fn each_member(&mut self, mut visit: impl FnMut(&mut Self)) {
        let time = self.pace.time();
        visit(self);
        self.led.members_at(time).for_each(visit);
    }

    /// How many steps each member makes, and the length of the macro step.
    fn plan(&mut self, span: Span) -> Result<(Plan, SimSpan), String> {
        let time = self.pace.time();
        let Some(mut wishes) = self.cluster.as_mut().map(|member| std::mem::take(&mut member.wishes)) else {
            return Err(NOT_A_MEMBER.to_owned());
        };
        wishes.clear();
        wishes.extend(self.wish());
        wishes.extend(self.led.members_at(time).filter_map(Self::wish));
        let plan = Plan::of(wishes.iter().map(|wish| (wish.role, wish.step_s)));
        let macro_s = match span {
            // an agent alone goes as far as its clock lets it
            Span::Wanted(span) if wishes.len() == 1 => span.as_secs_f64(),
            Span::Wanted(span) => {
                let factor = (span.as_secs_f64() / self.pace.wanted().as_secs_f64()).max(1.0);
                (plan.macro_s * factor).min(plan.macro_s.max(STRETCHED_MAX_S))
            }
            Span::AtMost(most) => plan.macro_s.min(most.as_secs_f64()),
        };
        if let Some(member) = &mut self.cluster {
            member.wishes = wishes;
        }
        if let Some(broken) = self.model.broken().or_else(|| self.led.all().find_map(|actor| actor.model.broken())) {
            return Err(broken.to_owned());
        }
        let dt = SimSpan::from_secs_f64(macro_s).filter(|dt| *dt > SimSpan::ZERO);
        // the rest up to a given time is taken whole, not as seconds
        let dt = match span {
            Span::AtMost(most) if plan.macro_s >= most.as_secs_f64() => Some(most),
            _ => dt,
        };
        Ok((plan, dt.unwrap_or(self.pace.wanted())))
    }

    fn wish(&mut self) -> Option<Wish> {
        let step_s = self.pace.wanted().as_secs_f64();
        let Self { model, .. } = self;
        let wished = contained(|| Ok(model.member()?.map(|member| Wish { role: member.role(), step_s })));
        wished.unwrap_or_else(|reason| {
            model.note_unwound(&reason);
            None
        })
    }

    /// Looks around before the first step: the agents with which it begins in one cluster.
    pub fn look_first(&mut self) -> &[AgentId] {
        let step = PlannedStep { start: self.pace.scene_time(), dt: self.pace.dt() };
        self.look_among(step, &Membership::default());
        self.cluster.as_ref().map_or(&[], |member| &member.bonds)
    }

    /// Looks around for itself and for all that step with it.
    fn look(&mut self, time: SimTime, dt: SimSpan) {
        let step = PlannedStep { start: self.pace.scene_time(), dt };
        let mut led = std::mem::take(&mut self.led);
        self.look_among(step, led.membership());
        led.each_at(time, |actor, membership| actor.look_among(step, membership));
        self.led = led;
    }

    /// Reads its neighbours before a `step` that it makes with `members`.
    fn observe(&mut self, step: PlannedStep, members: &Membership) {
        self.observer.update(&self.peers, &self.writer, step, members);
    }

    /// The same, and notes the agents that belong into its cluster.
    fn look_among(&mut self, step: PlannedStep, members: &Membership) {
        self.observe(step, members);
        let now = self.pace.time();
        let Self { shared, observer, peers, writer, links, cluster, .. } = self;
        let Some(member) = cluster else { return };
        let grasped = newest(writer, |mine| mine.body.tool().and_then(|tool| tool.grasp)).map(|grasp| grasp.target);
        member.bond(observer, grasped, links, shared);
        // a new member stays for at least 0.2 s: two bodies that change clusters in turn would never be stepped
        // together
        let MemberState { memory, bonds, .. } = &mut **member;
        bonds.iter().for_each(|id| memory.meet(*id, now));
        // one of shorter steps does not look as far ahead, and has to hear of it before it steps past
        if let Some(broad_phase) = peers.broad_phase.get() {
            observer.near().iter().for_each(|id| broad_phase.call(*id, observer.me()));
        }
    }

    /// The cost of the last turn, for its own body and each that it leads.
    pub fn member_costs(&self) -> impl Iterator<Item = MemberCost> + '_ {
        std::iter::once(self)
            .chain(self.led.all())
            .filter_map(|actor| Some(MemberCost { model: actor.shared.model(), work: actor.cluster.as_ref()?.work }))
    }

    /// Stops all that step with it: they rest.
    pub fn rest_members(&mut self) {
        self.each_member(|actor| {
            let rested = contained(|| {
                actor.model.member()?.into_iter().for_each(|mut member| member.change(|m| m.sleep()));
                Ok(())
            });
            // it is parked where its state is written
            rested.unwrap_or_else(|reason| actor.model.note_unwound(&reason));
            actor.cluster.iter_mut().for_each(|member| member.drift_m = 0.0);
        });
    }
}
