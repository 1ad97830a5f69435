//! The bodies of an island while it steps: the leader's own, and those of its companions.
//!
//! In: the leader, its companions and what each of them sees. Out: access by seat. Never here: physics.

use crate::rigid::RigidBody;
use metachron_contact::{IslandMember, StepContext};
use metachron_core::{AgentId, StepError};

/// Everybody who shares the step: seat 0 leads, seat k is the k-th companion.
pub(super) struct Crew<'a, 'c> {
    leader: &'a mut RigidBody,
    around: &'a StepContext<'a>,
    others: &'a mut [IslandMember<'c>],
}

impl<'a, 'c> Crew<'a, 'c> {
    /// # Errors
    /// [`StepError::Alone`] where a companion is no rigid body.
    pub(super) fn new(
        leader: &'a mut RigidBody,
        around: &'a StepContext<'a>,
        others: &'a mut [IslandMember<'c>],
    ) -> Result<Self, StepError> {
        if others.iter_mut().all(|other| rigid(other).is_some()) {
            Ok(Self { leader, around, others })
        } else {
            Err(StepError::Alone { model: "rigid" })
        }
    }

    /// How many they are.
    pub(super) fn len(&self) -> usize {
        1 + self.others.len()
    }

    /// Who sits there.
    pub(super) fn id(&self, seat: usize) -> AgentId {
        if seat == 0 { self.around.me } else { self.others[seat - 1].id }
    }

    /// The body in `seat`, and what it sees.
    pub(super) fn body(&mut self, seat: usize) -> (&mut RigidBody, &StepContext<'_>) {
        if seat == 0 {
            return (self.leader, self.around);
        }
        let other = &mut self.others[seat - 1];
        let around = &other.context;
        let body = other.agent.island_body().and_then(|body| body.downcast_mut());
        (body.expect("every companion was found to be rigid"), around)
    }
}

/// The rigid body of a companion, if it is one.
fn rigid<'a>(other: &'a mut IslandMember<'_>) -> Option<&'a mut RigidBody> {
    other.agent.island_body()?.downcast_mut()
}
