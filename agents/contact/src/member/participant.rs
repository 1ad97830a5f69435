//! A body in its cluster's step: its view and memory, how far it is in its own step, and its motion as others see it in a fine step.
//!
//! In: a member, its context, its memory; its velocities at the start of its step and without contact, impulses. Out: which others it may touch, the
//! velocities at which its place moves. Never here: contacts, the problem. Theory: docs/theory/clusters.md, section 9 (eq. 24 to 26).

use crate::StepContext;
use crate::agent::Law;
use crate::lists::{refill, reset};
use crate::member::{ContactMemory, GuardedMember};
use crate::solve::Side;
use glam::DVec3;
use metachron_core::{AgentId, Grip, StepError};
use metachron_geometry::Place;

/// A body in its cluster's step.
pub struct Participant<'a> {
    /// The agent's number.
    pub id: AgentId,
    /// The body.
    pub member: GuardedMember<'a>,
    /// Its surroundings at the start of the macro step.
    pub context: StepContext<'a>,
    /// The laws of its pairs other than [`Law::Cluster`], by rising numbers: a pair with one is not the cluster's.
    pub laws: &'a [(AgentId, Law)],
    /// Its memory of others.
    pub memory: &'a mut ContactMemory,
    /// Its own steps within the macro step: a power of two, at most 16; a rigid body makes the most of its cluster.
    pub parts: u32,
    /// How long a step it makes alone, seconds: so far ahead it looks for others.
    pub alone_s: f64,
    /// The mean forces of springs and grasps on it over the macro step.
    pub grips: &'a mut Vec<Grip>,
}

/// The place of the agent `id` among the participants of a step: two lists one after the other, each by rising numbers, as remote members
/// follow all others.
pub(crate) fn place_of(all: &[Participant<'_>], id: AgentId) -> Option<usize> {
    let here = all.partition_point(|one| !one.member.is_remote());
    let (here, remote) = all.split_at(here);
    let found = here.binary_search_by_key(&id, |one| one.id);
    found.or_else(|_| remote.binary_search_by_key(&id, |one| one.id).map(|at| here.len() + at)).ok()
}

impl Participant<'_> {
    /// How many blocks of three velocities it has.
    #[must_use]
    pub fn size(&self) -> usize {
        self.member.system().velocities.len()
    }

    /// Whether it touches `other` where the two meet. An asynchronous pair whose sides have come into one cluster has one clock in it.
    pub(crate) fn may_touch(&self, other: &Self) -> bool {
        let law = self.laws.binary_search_by_key(&other.id, |(id, _)| *id).ok().map(|at| self.laws[at].1);
        let remote = [self, other].map(|one| one.member.is_remote());
        let off = match remote {
            [true, true] => true,
            [false, false] => law.is_some_and(|law| !law.is_asynchronous()),
            _ => law != Some(Law::Ledger),
        };
        !(off || self.member.passes_through(other.id) || other.member.passes_through(self.id)) && self.meets(other)
    }

    /// Whether neither lets the other pass by its collision groups.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.member.skin().zip(other.member.skin()).is_some_and(|(mine, theirs)| mine.form.meets(theirs.form))
    }
}

/// How far a member is in its own step (eq. 24–26).
#[derive(Debug, Clone, Default)]
pub(crate) struct Progress {
    /// How many steps it makes in the macro step.
    pub parts: u32,
    /// The length of the step that it has begun before all others do, seconds; 0 for none.
    pub begun_s: f64,
    /// Fine steps within its own step, and how many of them have begun.
    pub share: u32,
    pub part: u32,
    /// Its velocities when its step began.
    pub v_start: Vec<DVec3>,
    /// By how much its step would change them without contact.
    pub dv_free: Vec<DVec3>,
    /// The part of that which known impulses from outside make; empty for none.
    pub dv_known: Vec<DVec3>,
    /// Momentum that acts on it from outside over its step, where it leaves its answer to the cluster, N·s; empty for none.
    pub owed_n_s: Vec<DVec3>,
    /// By how much the impulses of contacts and rows have changed them since.
    pub dv_impulses: Vec<DVec3>,
    /// v(p − 1): the velocities by which its place has moved up to this fine step.
    pub v_before: Vec<DVec3>,
    /// v̄(p): its velocities with the impulses that it has been given so far.
    pub v_so_far: Vec<DVec3>,
    /// û: the velocities at which its place moves in this fine step without the impulses sought.
    pub v_predicted: Vec<DVec3>,
    /// The momentum that it does not answer yet (clusters.md, eq. 16a), solved for together with the impulses sought. Empty for none.
    pub unanswered: Vec<DVec3>,
    /// û with the impulses that the last solve found.
    pub v_solved: Vec<DVec3>,
    /// The velocities at which its place moves by that: in the mean of the fine step, of a body that flies.
    pub v_mean: Vec<DVec3>,
    /// Its place in the problem; `None` where no row touches it and it answers all momentum.
    pub place: Option<usize>,
    /// Whether anything has acted on it for a while since its step began, whether a contact or row of the problem has, and whether one does
    /// by the last solve.
    pub touched: bool,
    pub held: bool,
    pub bears: bool,
    /// The changes of its velocities by impacts, at the end of the fine step; empty for none.
    pub dv_impacts: Vec<DVec3>,
    /// How far it is then from where impacts at the start of the step would have brought it, metres and radians (eq.
    /// 27); empty for none.
    pub dx_impacts: Vec<DVec3>,
    /// The greatest strain of its steps that they were not divided for, as a share of the strain that it can take; 0 where they were.
    pub strain_left: f64,
    /// The places of its skin, as a surface, on which contacts have given impulses since its step began.
    pub pressed: Vec<Place>,
    /// Work of its steps within the macro step, in the unit of its model.
    pub work: f64,
    /// Why its last begin or end failed, until that is taken.
    pub failure: Option<StepError>,
}

impl Progress {
    /// Lets a member begin a step, and counts its work.
    pub fn begin(&mut self, member: &mut GuardedMember<'_>, own_s: f64) {
        self.failure = member.begin(own_s).err();
        self.work += member.work();
    }

    /// Begins the step that a member has begun.
    pub fn start(&mut self, member: &GuardedMember<'_>) {
        let (now, free) = (member.system().velocities, member.system().free);
        now.clone_into(&mut self.v_start);
        refill(&mut self.dv_free, free.iter().zip(now).map(|(free, now)| *free - *now));
        reset(&mut self.dv_impulses, now.len(), DVec3::ZERO);
        self.v_before.clone_from(&self.v_start);
        self.owed_n_s.clear();
        self.pressed.clear();
        reset(&mut self.unanswered, member.system().unanswered.len(), DVec3::ZERO);
        (self.touched, self.held) = (false, false);
    }

    /// Notes that a contact or row of the problem acts on it.
    pub fn hold(&mut self) {
        (self.touched, self.held) = (true, true);
    }

    /// Adds the changes of its velocities by known impulses within its step; none where there are none.
    pub fn push(&mut self, change: &[DVec3]) {
        change.clone_into(&mut self.dv_known);
        self.dv_free.iter_mut().zip(change).for_each(|(dv_free, change)| *dv_free += *change);
        self.touched |= !change.is_empty();
    }

    /// Lets known impulses act on it evenly within its step, whose answer is the cluster's to find.
    pub fn owe(&mut self, impulses: &[DVec3]) {
        self.push(&[]);
        self.owed_n_s.extend_from_slice(impulses);
        self.touched = true;
    }

    /// Finds v̄(p), û and the momentum that they leave unanswered, of the fine step that begins (eq. 24).
    pub fn look(&mut self, member: &GuardedMember<'_>) {
        self.dv_impacts.clear();
        self.dx_impacts.clear();
        let (p, shares) = (f64::from(self.part), f64::from(self.share));
        let (each, s) = (shares.recip(), p / shares);
        self.unanswered.iter_mut().zip(member.system().unanswered).for_each(|(r, more)| *r += *more * each);
        self.unanswered.iter_mut().zip(&self.owed_n_s).for_each(|(r, more)| *r += *more * each);
        let changes = self.dv_free.iter().zip(&self.dv_impulses);
        let so_far = |(v, (free, impulses)): (&DVec3, (&DVec3, &DVec3))| *v + *free * s + *impulses;
        refill(&mut self.v_so_far, self.v_start.iter().zip(changes).map(so_far));
        let moves = |(so_far, before): (&DVec3, &DVec3)| *so_far * p - *before * (p - 1.0);
        refill(&mut self.v_predicted, self.v_so_far.iter().zip(&self.v_before).map(moves));
    }

    /// Finds at which velocity its place moves by the last solve: where it `flies` if nothing holds it, in the mean of the fine step.
    pub fn go(&mut self, flies: bool) {
        self.v_mean.clone_from(&self.v_solved);
        if flies && !self.touched && !self.bears {
            self.v_mean.iter_mut().zip(&self.dv_free).for_each(|(v_mean, dv_free)| *v_mean -= *dv_free * 0.5);
        }
    }

    /// Takes a share of the velocities that impacts lead to from those solved.
    pub fn strike(&mut self, struck: &[DVec3], share: f64) {
        let changes = struck.iter().zip(&self.v_solved).map(|(struck, v_solved)| (*struck - *v_solved) * share);
        refill(&mut self.dv_impacts, changes);
    }

    /// Lets it be where its flight has brought it, in a step of `h_s` seconds with all impulses `after_s` seconds from its start (eq. 27).
    pub fn fly_on(&mut self, after_s: f64, h_s: f64) {
        let Self { v_solved, v_predicted, dv_free, dv_impacts, dx_impacts, v_mean, .. } = self;
        dx_impacts.clear();
        v_mean.clear();
        for (((v_solved, dv_impacts), v_predicted), dv_free) in
            v_solved.iter().zip(&*dv_impacts).zip(&*v_predicted).zip(&*dv_free)
        {
            let change = *v_solved + *dv_impacts - *v_predicted;
            dx_impacts.push(change * -after_s);
            v_mean.push(*v_predicted + change * (1.0 - after_s / h_s) - *dv_free * 0.5);
        }
        self.bears = false;
    }

    /// Lets it be where the solution of the step leaves it, whose impacts come at the end of its `h_s` seconds.
    pub fn wait(&mut self, h_s: f64) {
        let Self { v_solved, dv_impacts, dx_impacts, v_mean, .. } = self;
        refill(dx_impacts, dv_impacts.iter().map(|dv_impacts| *dv_impacts * -h_s));
        v_mean.clone_from(v_solved);
        self.bears = true;
    }

    /// Takes the velocities that it has without impulses.
    pub fn go_on(&mut self) {
        self.v_before.clone_from(&self.v_so_far);
    }

    /// Takes the velocities at which its place moves with the impulses found (eq. 25), which leave this unanswered.
    pub fn take(&mut self, left: &[DVec3]) {
        if !self.unanswered.is_empty() {
            self.unanswered.copy_from_slice(left);
        }
        let p = f64::from(self.part);
        for (at, moved) in self.v_solved.iter().enumerate() {
            let change = (*moved + self.dv_impacts.get(at).copied().unwrap_or_default() - self.v_predicted[at]) / p;
            self.dv_impulses[at] += change;
            self.v_before[at] = self.v_so_far[at] + change;
        }
    }
}

/// The velocity of side 0 against side 1 with the velocities `of` members, m/s.
pub(crate) fn relative<'a>(sides: &[Side; 2], of: impl Fn(usize) -> &'a [DVec3]) -> DVec3 {
    velocity(&sides[0], &of) - velocity(&sides[1], &of)
}

/// The velocity of a side with the velocities `of` its members, m/s; zero for one that does not move.
pub(crate) fn velocity<'a>(side: &Side, of: impl Fn(usize) -> &'a [DVec3]) -> DVec3 {
    if side.terms().is_empty() {
        return DVec3::ZERO;
    }
    let own = side.velocity(of(side.member));
    side.second().map_or(own, |part| own + part.velocity(of(part.member)))
}
