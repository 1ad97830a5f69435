//! The turn of a contact cluster: its leader steps all members as one problem.
//!
//! In: the members at the leader's time, what each of them sees. Out: their new states, who each is bonded with, who has lost touch.
//! Never here: how members come and go ([`super::island`]), the problem itself ([`metachron_contact::stepper`]).

use super::agent_runner::{AgentRunner, StepOutcome};
use super::broad_phase::PlannedStep;
use super::observation::Observer;
use metachron_contact::stepper::{
    ClusterReport, ClusterScene, ClusterStepper, ContactMemory, PairTotal, Participant, Partner, Plan, Role,
    StepDoubling,
};
use metachron_contact::{Law, Link, Neighbour, StepContext};
use metachron_core::step_doubling::{DoublingSchedule, drift_m};
use metachron_core::{
    AgentId, Body, ClusterSolves, ClusterState, Grip, PairKind, PairState, SimSpan, SimTime, Snapshot, StepReport,
};
use std::sync::Arc;

/// No overload stretches a macro step beyond this, unless it is longer anyway, seconds.
const STRETCHED_MAX_S: f64 = 1.0 / 60.0;

/// What an agent brings into the cluster that it is stepped in.
pub(super) struct ClusterSeat {
    scene: Arc<ClusterScene>,
    /// Only of one that makes turns.
    stepper: Option<Box<ClusterStepper>>,
    memory: ContactMemory,
    grips: Vec<Grip>,
    pairs: Vec<PairState>,
    /// Agents that belong into the same cluster, as it sees them.
    bonds: Vec<AgentId>,
    /// Of these the ones that rest: they are woken.
    sleepers: Vec<AgentId>,
    /// Work of its own steps in the last turn, in the unit of its model.
    work: f64,
    /// Which of the steps that it leads are repeated in halves, and by what.
    schedule: DoublingSchedule,
    doubling: Option<Box<StepDoubling>>,
    /// How far the repeated steps of the present row left it from the finer ones, metres, and the error of the last row (control.md, eq. 31).
    apart_m: f64,
    drift_m: f64,
    /// Its part in the last step, and how those were solved that it has led.
    state: Option<ClusterState>,
    solves: ClusterSolves,
    /// Storage, empty between turns.
    participants: Vec<Participant<'static>>,
    wishes: Vec<Wish>,
    groups: Vec<usize>,
    ids: Vec<AgentId>,
}

/// The step that a member wants.
#[derive(Debug, Clone, Copy)]
struct Wish {
    role: Role,
    step_s: f64,
}

/// What the steps of a member cost in a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MemberCost {
    pub model: &'static str,
    /// In the unit of the model.
    pub work: f64,
}

/// How long the step of a cluster may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Span {
    /// As its members want, stretched by this factor, ≥ 1.
    Wanted(f64),
    /// No longer than this, to come to a given time.
    AtMost(SimSpan),
}

/// A bug: only agents with a seat are stepped in clusters.
const NO_SEAT: &str = "has no seat in a cluster";

impl std::fmt::Debug for ClusterSeat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClusterSeat").field("bonds", &self.bonds).finish_non_exhaustive()
    }
}

impl ClusterSeat {
    /// A seat in the clusters of `scene`.
    pub fn new(scene: Arc<ClusterScene>) -> Self {
        Self {
            scene,
            stepper: None,
            memory: ContactMemory::default(),
            grips: Vec::new(),
            pairs: Vec::new(),
            bonds: Vec::new(),
            sleepers: Vec::new(),
            work: 0.0,
            schedule: DoublingSchedule::default(),
            doubling: None,
            apart_m: 0.0,
            drift_m: 0.0,
            state: None,
            solves: ClusterSolves::default(),
            participants: Vec::new(),
            wishes: Vec::new(),
            groups: Vec::new(),
            ids: Vec::new(),
        }
    }

    /// Completes a state that its agent has just written.
    pub fn complete(&self, into: &mut Snapshot) {
        into.grips.clone_from(&self.grips);
        into.pairs.clone_from(&self.pairs);
        into.bonds.clone_from(&self.bonds);
        into.touches.clone_from(&self.sleepers);
        into.cluster = self.state;
        into.drift_m += self.drift_m;
        into.residual_m += self.drift_m;
    }

    /// What repeats the step that it leads next, its `steps`-th, in halves where that is due.
    fn repeats(&mut self, steps: u64, me: AgentId) -> Option<Box<StepDoubling>> {
        self.schedule.begins(steps, me);
        self.schedule.is_on().then(|| self.doubling.take().unwrap_or_default())
    }

    /// Notes with whom it belongs into one cluster.
    fn bond(&mut self, observer: &Observer, links: &[Link]) {
        self.bonds.clear();
        self.bonds.extend_from_slice(observer.near());
        let linked = links.iter().filter(|link| link.law == Law::Ledger).map(|link| link.other);
        self.bonds.extend(linked.chain(observer.neighbours().iter().filter_map(|n| holds(n, observer.me()))));
        self.bonds.sort_unstable();
        self.bonds.dedup();
        self.sleepers.clear();
        let rests = |id: &AgentId| observer.neighbours().iter().any(|n| n.id == *id && n.snapshot.at_rest);
        self.sleepers.extend(self.bonds.iter().copied().filter(rests));
    }

    /// Notes what a pair gave each other in a step of `dt_s` seconds.
    fn note_pair(&mut self, total: &PairTotal, with: AgentId, dt_s: f64) {
        let at = self.pairs.iter().position(|pair| pair.with == with).unwrap_or_else(|| {
            self.pairs.push(PairState::new(with, PairKind::Cluster));
            self.pairs.len() - 1
        });
        let pair = &mut self.pairs[at];
        let impulse_n_s = total.impulse_n_s.length();
        (pair.contacts, pair.force_n) = (total.contacts, impulse_n_s / dt_s);
        pair.penetration_m = total.depth_m;
        pair.impulse_n_s += impulse_n_s;
    }
}

/// The agent on the other side of a grasp that joins `neighbour` and `me`.
fn holds(neighbour: &Neighbour, me: AgentId) -> Option<AgentId> {
    let Body::Tool(tool) = &neighbour.snapshot.body else { return None };
    tool.grasp.filter(|grasp| grasp.target == me).map(|_| neighbour.id)
}

impl AgentRunner {
    /// Steps all that it leads and that are at its time, with itself, as one problem.
    ///
    /// # Errors
    /// The reason why a member cannot go on: all that belong to the cluster stop with it.
    pub fn step_cluster(&mut self, span: Span) -> Result<StepOutcome, String> {
        let (id, time, steps) = (self.shared.id, self.pace.time(), self.metrics.steps());
        self.company.gather_fellows(id, time);
        let (plan, dt) = self.plan(span)?;
        self.look(time, dt);
        let Some(seat) = &mut self.cluster else { return Err(NO_SEAT.to_owned()) };
        let mut list = emptied(std::mem::take(&mut seat.participants));
        let mut stepper = seat.stepper.take().unwrap_or_default();
        let mut doubling = seat.repeats(steps, id);
        let (scene, wishes) = (Arc::clone(&seat.scene), std::mem::take(&mut seat.wishes));
        let mut company = std::mem::take(&mut self.company);
        let all = std::iter::once(&mut *self).chain(company.seats_at(time));
        let parts = wishes.iter().map(|wish| plan.parts_in(wish.role, wish.step_s));
        list.extend(all.zip(parts).filter_map(|(actor, parts)| actor.participant(time, parts)));
        // a finer step that diverges says nothing of this one
        let extra = doubling.as_mut().and_then(|doubling| doubling.foresee(&scene, &mut list, dt).ok());
        let outcome = stepper.step(&scene, &mut list, dt);
        if let (Some(doubling), Ok(report)) = (&mut doubling, &outcome) {
            doubling.compare(&list, report.dt);
        }
        let at_rest = list.iter().all(|one| one.member.is_calm());
        let list = emptied(list);
        self.company = company;
        if let Some(seat) = &mut self.cluster {
            (seat.participants, seat.wishes) = (list, wishes);
        }
        let report = outcome.map_err(|error| error.to_string())?;
        let dt = report.dt;
        if let Some(doubling) = doubling {
            self.note_errors(doubling, time, dt);
        }
        self.note_pairs(&stepper, time, dt);
        self.note_solves(&report, plan, dt);
        self.find_groups(time + dt);
        if let Some(seat) = &mut self.cluster {
            seat.stepper = Some(stepper);
        }
        let report = StepReport { work: report.work + extra.unwrap_or(0.0), substeps: report.fine_steps, at_rest };
        Ok(StepOutcome { report, dt })
    }

    /// How many steps each member makes, and the length of the macro step.
    fn plan(&mut self, span: Span) -> Result<(Plan, SimSpan), String> {
        let time = self.pace.time();
        let Some(mut wishes) = self.cluster.as_mut().map(|seat| std::mem::take(&mut seat.wishes)) else {
            return Err(NO_SEAT.to_owned());
        };
        wishes.clear();
        wishes.extend(self.wish());
        wishes.extend(self.company.seats_at(time).filter_map(Self::wish));
        let plan = Plan::of(wishes.iter().map(|wish| (wish.role, wish.step_s)));
        let macro_s = match span {
            Span::Wanted(factor) => (plan.macro_s * factor).min(plan.macro_s.max(STRETCHED_MAX_S)),
            Span::AtMost(most) => plan.macro_s.min(most.as_secs_f64()),
        };
        if let Some(seat) = &mut self.cluster {
            seat.wishes = wishes;
        }
        let dt = SimSpan::from_secs_f64(macro_s).filter(|dt| *dt > SimSpan::ZERO);
        // what is left to a given time is taken whole, not as seconds
        let dt = match span {
            Span::AtMost(most) if plan.macro_s >= most.as_secs_f64() => Some(most),
            _ => dt,
        };
        Ok((plan, dt.unwrap_or(self.pace.wanted())))
    }

    /// What it brings into a step from `time`, of which it makes so many parts.
    fn participant(&mut self, time: SimTime, parts: u32) -> Option<Participant<'_>> {
        let id = self.shared.id;
        let Self { agent, observer, hands, links, peers, cluster, .. } = self;
        let ClusterSeat { memory, grips, .. } = &mut **cluster.as_mut()?;
        let context = StepContext { me: id, time, neighbours: observer.neighbours(), hands, links };
        let laws = peers.get(id).map_or(&[][..], |peer| &peer.laws);
        Some(Participant { id, member: agent.member()?, context, laws, memory, parts, grips })
    }

    fn wish(&mut self) -> Option<Wish> {
        let step_s = self.pace.wanted().as_secs_f64();
        self.agent.member().map(|member| Wish { role: member.role(), step_s })
    }

    /// Looks around for itself and for all that step with it.
    fn look(&mut self, time: SimTime, dt: SimSpan) {
        let step = PlannedStep { start: self.pace.scene_time(), dt };
        let Self { observer, company, peers, writer, links, cluster, .. } = self;
        observer.update(peers, writer, step, company.all_fellows());
        if let Some(seat) = cluster {
            seat.bond(observer, links);
        }
        company.each_at(time, |actor, fellows| {
            let Self { observer, peers, writer, links, cluster, .. } = actor;
            observer.update(peers, writer, step, fellows);
            if let Some(seat) = cluster {
                seat.bond(observer, links);
            }
        });
    }

    /// Notes how the step was made and solved.
    fn note_solves(&mut self, report: &ClusterReport, plan: Plan, dt: SimSpan) {
        let (leader, time, step_s) = (self.shared.id, self.pace.time(), dt.as_secs_f64());
        let note = |actor: &mut Self, solves: Option<ClusterSolves>| {
            let parts = actor.wish().map_or(1, |wish| plan.parts_in(wish.role, wish.step_s));
            if let Some(seat) = &mut actor.cluster {
                seat.state = Some(ClusterState { leader, parts, step_s, solves });
            }
        };
        let Some(seat) = &mut self.cluster else { return };
        let ClusterReport { contacts, factors, passes, cut, depth_m, .. } = *report;
        let solves = &mut seat.solves;
        solves.contacts = contacts;
        solves.problems += u64::from(report.fine_steps);
        solves.factors += u64::from(factors);
        solves.passes += u64::from(passes);
        solves.cut += u64::from(cut);
        (solves.depth_m, solves.deepest_m) = (depth_m, solves.deepest_m.max(depth_m));
        let solves = Some(*solves);
        note(self, solves);
        let mut company = std::mem::take(&mut self.company);
        company.seats_at(time).for_each(|actor| note(actor, None));
        self.company = company;
    }

    /// Hands every member how far a step of `dt` is from the same in halves.
    fn note_errors(&mut self, doubling: Box<StepDoubling>, time: SimTime, dt: SimSpan) {
        let Some(seat) = &mut self.cluster else { return };
        let is_first = seat.schedule.span_s() == 0.0;
        let span_s = seat.schedule.finish_step(dt.as_secs_f64()).then_some(seat.schedule.span_s());
        if doubling.apart_m().is_empty() {
            seat.schedule.cancel();
        }
        let mut apart_m = doubling.apart_m().iter();
        let mut note = |actor: &mut Self| {
            if let (Some(seat), Some(apart_m)) = (&mut actor.cluster, apart_m.next()) {
                seat.apart_m = if is_first { *apart_m } else { seat.apart_m + apart_m };
                if let Some(span_s) = span_s {
                    seat.drift_m = drift_m(seat.apart_m, 1, span_s);
                }
            }
        };
        note(self);
        let mut company = std::mem::take(&mut self.company);
        company.seats_at(time).for_each(&mut note);
        self.company = company;
        if let Some(seat) = &mut self.cluster {
            seat.doubling = Some(doubling);
        }
    }

    /// Hands every pair what it gave each other, and every member its work.
    fn note_pairs(&mut self, stepper: &ClusterStepper, time: SimTime, dt: SimSpan) {
        let (dt_s, now) = (dt.as_secs_f64(), time + dt);
        let mut place = 0;
        let mut note = |actor: &mut Self| {
            let (me, Some(seat)) = (place, &mut actor.cluster) else { return };
            seat.pairs.retain_mut(|pair| {
                (pair.contacts, pair.force_n, pair.penetration_m) = (0, 0.0, 0.0);
                seat.memory.near(now).any(|id| id == pair.with)
            });
            for total in stepper.totals().iter().filter(|total| total.member == me) {
                if let Partner::Agent(with) = total.partner {
                    seat.note_pair(total, with, dt_s);
                }
            }
            seat.work = stepper.work_of(me);
            place += 1;
        };
        note(self);
        let mut company = std::mem::take(&mut self.company);
        company.seats_at(time).for_each(&mut note);
        self.company = company;
    }

    /// Finds who has lost touch: numbers of groups of those that still belong together, zero for the leader's own.
    fn find_groups(&mut self, now: SimTime) {
        let Some(mut groups) = self.cluster.as_mut().map(|seat| std::mem::take(&mut seat.groups)) else { return };
        let (id, time) = (self.shared.id, self.pace.time());
        let mut company = std::mem::take(&mut self.company);
        let mut ids = self.cluster.as_mut().map(|seat| std::mem::take(&mut seat.ids)).unwrap_or_default();
        ids.clear();
        ids.push(id);
        ids.extend(company.seats_at(time).map(|actor| actor.shared.id));
        groups.clear();
        groups.extend(0..ids.len());
        let mut join = |place: usize, actor: &Self| {
            let Some(seat) = &actor.cluster else { return };
            let tied = actor.links.iter().filter(|link| link.law == Law::Ledger).map(|link| link.other);
            for other in seat.memory.near(now).chain(tied).chain(seat.bonds.iter().copied()) {
                if let Ok(other) = ids.binary_search(&other) {
                    let (a, b) = (top(&groups, place), top(&groups, other));
                    groups[a.max(b)] = a.min(b);
                }
            }
        };
        join(0, self);
        company.seats_at(time).enumerate().for_each(|(place, actor)| join(place + 1, actor));
        company.apart.clear();
        company.apart.extend((1..ids.len()).map(|place| top(&groups, place) as u32));
        company.note_apart(time);
        self.company = company;
        if let Some(seat) = &mut self.cluster {
            (seat.groups, seat.ids) = (groups, ids);
        }
    }

    /// What the last turn cost of its own body and of each that it leads.
    pub fn member_costs(&self) -> impl Iterator<Item = MemberCost> + '_ {
        std::iter::once(self)
            .chain(self.company.all())
            .filter_map(|actor| Some(MemberCost { model: actor.shared.model, work: actor.cluster.as_ref()?.work }))
    }

    /// Stops all that step with it: they rest.
    pub fn rest_members(&mut self) {
        let time = self.pace.time();
        let rest = |actor: &mut Self| {
            actor.agent.member().into_iter().for_each(|member| member.rest());
            actor.cluster.iter_mut().for_each(|seat| seat.drift_m = 0.0);
        };
        rest(self);
        self.company.seats_at(time).for_each(rest);
    }
}

/// The lowest place that belongs together with `at`.
fn top(groups: &[usize], mut at: usize) -> usize {
    while groups[at] != at {
        at = groups[at];
    }
    at
}

/// The storage of `participants` for other ones.
fn emptied<'b>(mut participants: Vec<Participant<'_>>) -> Vec<Participant<'b>> {
    participants.clear();
    // nothing is left to be mapped; the standard library collects in place, so that the storage stays
    participants.into_iter().map(|_| unreachable!("cleared above")).collect()
}
