//! How far a member of a cluster is in its own step, and what others see of it in a fine step.
//!
//! In: its velocities at the start of its step and without contact, impulses. Out: the velocities at which its place moves. Never here:
//! contacts, the problem. Theory: docs/theory/clusters.md, section 9 (eq. 24 to 26).

use super::ClusterMember;
use glam::DVec3;
use metachron_core::StepError;

/// How far a member is in its own step (eq. 24–26).
#[derive(Debug, Clone, Default)]
pub(super) struct Progress {
    /// How many steps it makes in the macro step, where it bends.
    pub parts: u32,
    /// The length of the step that it has begun before all others do, seconds; 0 for none.
    pub begun_s: f64,
    /// Fine steps within its own step, and how many of them have begun.
    pub share: u32,
    pub part: u32,
    /// Its velocities when its step began.
    pub start: Vec<DVec3>,
    /// What its step would have changed them by without contact.
    pub gain: Vec<DVec3>,
    /// The part of that which known impulses from outside make; empty for none.
    pub pushed: Vec<DVec3>,
    /// Momentum that acts on it from outside over its step, where it leaves its answer to the cluster, N·s; empty for none.
    pub owed: Vec<DVec3>,
    /// What the impulses since have changed them by.
    pub given: Vec<DVec3>,
    /// v(p − 1): by which its place has moved so far.
    pub before: Vec<DVec3>,
    /// v̄(p): its velocities with what it has been given so far.
    pub known: Vec<DVec3>,
    /// û: the velocity at which its place moves in this fine step, without the impulses sought.
    pub seen: Vec<DVec3>,
    /// The momentum that it does not answer yet (clusters.md, eq. 16a): what is solved for together with the impulses sought. Empty for none.
    pub unanswered: Vec<DVec3>,
    /// û with the impulses that the last solve found, and the velocity at which its place moves by it: in the mean of the fine step, of a
    /// body that flies.
    pub solved: Vec<DVec3>,
    pub going: Vec<DVec3>,
    /// Its place in the problem; `None` where no row touches it and it answers all momentum.
    pub place: Option<usize>,
    /// Whether anything has acted on it for a while since its step began, whether a contact or row of the problem has, and whether one does
    /// by the last solve.
    pub touched: bool,
    pub held: bool,
    pub bears: bool,
    /// By how much impacts change its velocities at the end of the fine step; empty for none.
    pub jump: Vec<DVec3>,
    /// By how much it is then elsewhere than if they had done so at its start, metres and radians (eq. 27); empty for none.
    pub late: Vec<DVec3>,
    /// Work of its steps within the macro step, in the unit of its model.
    pub work: f64,
    /// Why its last begin or end failed, until that is taken.
    pub failure: Option<StepError>,
}

impl Progress {
    /// Lets a member begin a step, and counts its work.
    pub fn begin(&mut self, member: &mut dyn ClusterMember, own_s: f64) {
        self.failure = member.begin(own_s).err();
        self.work += member.work();
    }

    /// Begins the step that a member has begun.
    pub fn start(&mut self, member: &dyn ClusterMember) {
        let (now, free) = (member.velocities(), member.free());
        self.start.clear();
        self.start.extend_from_slice(now);
        self.gain.clear();
        self.gain.extend(free.iter().zip(now).map(|(free, now)| *free - *now));
        self.given.clear();
        self.given.resize(now.len(), DVec3::ZERO);
        self.before.clone_from(&self.start);
        self.owed.clear();
        self.unanswered.clear();
        self.unanswered.resize(member.unanswered().len(), DVec3::ZERO);
        (self.touched, self.held) = (false, false);
    }

    /// Notes that a contact or row of the problem acts on it.
    pub fn hold(&mut self) {
        (self.touched, self.held) = (true, true);
    }

    /// Adds what known impulses change its velocities by within its step; none where there are none.
    pub fn push(&mut self, change: &[DVec3]) {
        self.pushed.clear();
        self.pushed.extend_from_slice(change);
        self.gain.iter_mut().zip(change).for_each(|(gain, change)| *gain += *change);
        self.touched |= !change.is_empty();
    }

    /// Lets known impulses act on it evenly within its step, whose answer is the cluster's to find.
    pub fn owe(&mut self, impulses: &[DVec3]) {
        self.push(&[]);
        self.owed.extend_from_slice(impulses);
        self.touched = true;
    }

    /// Finds v̄(p), û and what they leave unanswered, of the fine step that begins (eq. 24).
    pub fn look(&mut self, member: &dyn ClusterMember) {
        let Self { share, part, start, gain, given, before, known, seen, unanswered, owed, jump, late, .. } = self;
        jump.clear();
        late.clear();
        let each = f64::from(*share).recip();
        unanswered.iter_mut().zip(member.unanswered()).for_each(|(r, more)| *r += *more * each);
        unanswered.iter_mut().zip(&*owed).for_each(|(r, more)| *r += *more * each);
        let (p, s) = (f64::from(*part), f64::from(*part) / f64::from(*share));
        known.clear();
        known.extend(start.iter().zip(&*gain).zip(&*given).map(|((v, gain), given)| *v + *gain * s + *given));
        seen.clear();
        seen.extend(known.iter().zip(&*before).map(|(known, before)| *known * p - *before * (p - 1.0)));
    }

    /// Finds at which velocity its place moves by the last solve: where it `flies` if nothing holds it, in the mean of the fine step.
    pub fn go(&mut self, flies: bool) {
        self.going.clone_from(&self.solved);
        if flies && !self.touched && !self.bears {
            self.going.iter_mut().zip(&self.gain).for_each(|(going, gain)| *going -= *gain * 0.5);
        }
    }

    /// Takes a share of the velocities that impacts lead to from those solved.
    pub fn strike(&mut self, struck: &[DVec3], share: f64) {
        self.jump.clear();
        self.jump.extend(struck.iter().zip(&self.solved).map(|(struck, solved)| (*struck - *solved) * share));
    }

    /// Lets it be where its flight has brought it, in a step of `h_s` seconds with all impulses `after_s` seconds from its start (eq. 27).
    pub fn fly_on(&mut self, after_s: f64, h_s: f64) {
        let Self { solved, seen, gain, jump, late, going, .. } = self;
        late.clear();
        going.clear();
        for (((solved, jump), seen), gain) in solved.iter().zip(&*jump).zip(&*seen).zip(&*gain) {
            let change = *solved + *jump - *seen;
            late.push(change * -after_s);
            going.push(*seen + change * (1.0 - after_s / h_s) - *gain * 0.5);
        }
        self.bears = false;
    }

    /// Lets it be where the solution of the step leaves it, whose impacts come at the end of its `h_s` seconds.
    pub fn wait(&mut self, h_s: f64) {
        let Self { solved, jump, late, going, .. } = self;
        late.clear();
        late.extend(jump.iter().map(|jump| *jump * -h_s));
        going.clone_from(solved);
        self.bears = true;
    }

    /// Takes the velocities that it has without impulses.
    pub fn go_on(&mut self) {
        self.before.clone_from(&self.known);
    }

    /// Takes the velocities at which its place moves with the impulses found (eq. 25), which leave this unanswered.
    pub fn take(&mut self, left: &[DVec3]) {
        if !self.unanswered.is_empty() {
            self.unanswered.copy_from_slice(left);
        }
        let p = f64::from(self.part);
        for (at, moved) in self.solved.iter().enumerate() {
            let change = (*moved + self.jump.get(at).copied().unwrap_or_default() - self.seen[at]) / p;
            self.given[at] += change;
            self.before[at] = self.known[at] + change;
        }
    }
}
