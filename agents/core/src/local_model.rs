//! How a body answers one partner of an asynchronous pair until its next state: the local model that it publishes.
//!
//! In: the state of a body's cluster at the end of its step. Out: the same for a partner with another clock, or a
//! device. Never here: how a partner uses it. Theory: docs/theory/coupling.md, section 3.

use crate::{AgentId, SimTime};
use glam::{DMat3, DVec3};

/// A block of three velocities of a body: that of a vertex, a node or a centre of mass (m/s), or a spin (rad/s).
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct LocalBlock {
    /// The block as the published body counts it: a vertex of a soft body; of a tube nodes and segments in turn, 2 k and 2 k + 1; of a rigid
    /// body or tool its centre, 0, and its spin, 1.
    pub slot: u32,
    /// Its velocity at the time of the snapshot.
    pub velocity: DVec3,
    /// How it changes a second, with the forces of all partners going on, m/s² or rad/s².
    pub acceleration: DVec3,
}

/// The effect of a partner on the body in its last step.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LocalPartner {
    /// The partner.
    pub id: AgentId,
    /// The partner's own time in the reading by which the body took impulses last.
    pub read: SimTime,
    /// The force or torque that it is expected to go on exerting on each block, N or N·m.
    pub forces: Vec<DVec3>,
}

/// A body as its partners need it: where they may touch it or are linked to it.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct LocalModel {
    /// The length of the body's step, over which it spreads the impulses that it takes, seconds, > 0.
    pub step_s: f64,
    /// Whether contacts or springs of its cluster held it in the last step: a held body forgets an impulse within a step, a free one keeps it.
    pub held: bool,
    /// The blocks that may move under the partners' impulses.
    pub blocks: Vec<LocalBlock>,
    /// W of these blocks, row by row, with the contacts of the body's cluster held: velocities per impulse, 1/kg and 1/(kg·m²).
    pub compliance: Vec<DMat3>,
    /// Its partners, by rising numbers.
    pub partners: Vec<LocalPartner>,
}

impl LocalModel {
    /// Takes over `from`, in the storage that is there.
    pub fn copy_from(&mut self, from: &Self) {
        (self.step_s, self.held) = (from.step_s, from.held);
        self.blocks.clone_from(&from.blocks);
        self.compliance.clone_from(&from.compliance);
        self.partners.truncate(from.partners.len());
        for (at, partner) in from.partners.iter().enumerate() {
            match self.partners.get_mut(at) {
                Some(place) => {
                    (place.id, place.read) = (partner.id, partner.read);
                    place.forces.clone_from(&partner.forces);
                }
                None => self.partners.push(partner.clone()),
            }
        }
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let of = |block: &LocalBlock| [block.velocity, block.acceleration].iter().all(|v| v.is_finite());
        let forces = self.partners.iter().flat_map(|partner| &partner.forces);
        self.step_s.is_finite()
            && forces.into_iter().all(|force| force.is_finite())
            && self.blocks.iter().all(of)
            && self.compliance.iter().all(|w| w.is_finite())
    }
}
