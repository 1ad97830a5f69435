//! A body in its cluster's step, with what it sees and remembers.
//!
//! In: a member, its context, its memory. Out: which others it may touch. Never here: the step.

use crate::StepContext;
use crate::law::Law;
use crate::member::{ClusterMember, ContactMemory, GuardedMember};
use metachron_core::{AgentId, Grip};

/// A body in its cluster's step.
pub struct Participant<'a> {
    /// The agent's number.
    pub id: AgentId,
    /// The body.
    pub member: GuardedMember<'a>,
    /// What it sees at the start of the macro step.
    pub context: StepContext<'a>,
    /// The laws of its pairs other than [`Law::Cluster`], by rising numbers: a pair with one is not the cluster's.
    pub laws: &'a [(AgentId, Law)],
    /// What it remembers of others.
    pub memory: &'a mut ContactMemory,
    /// Its own steps within the macro step: a power of two, at most 16; a rigid body makes the most of its cluster.
    pub parts: u32,
    /// How long a step it makes alone, seconds: so far ahead it looks for others.
    pub alone_s: f64,
    /// The forces of springs and grasps on it in the last fine step.
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
        self.member.velocities().len()
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
        !(off || self.member.spares(other.id) || other.member.spares(self.id)) && self.meets(other)
    }

    /// Whether neither lets the other pass by its collision groups.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.member.skin().zip(other.member.skin()).is_some_and(|(mine, theirs)| mine.form.meets(theirs.form))
    }
}
