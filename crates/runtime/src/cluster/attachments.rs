//! Joints and links as what keeps agents in one cluster, until they tear.
//!
//! In: an agent's joints and links, its memory of what has torn, what yielded and tore in a step. Out: agents that belong together, entries in the states
//! of those that tell of it. Never here: forces, when something yields or tears ([`metachron_contact::step`]).

use super::AgentRunner;
use crate::records::events::{AgentEvent, EventKind};
use metachron_contact::constraint::FailedAttachment;
use metachron_contact::member::{ContactMemory, Partner};
use metachron_contact::step::ClusterStepper;
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, AttachmentEvent, AttachmentEventKind, AttachmentId, SimSpan};

/// A joint between an agent and another.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct JointedTo {
    /// The joint's number in the scene.
    pub number: u32,
    pub other: AgentId,
}

/// The agents that `joints` hold to one of this memory.
pub(super) fn held_by_joints<'a>(
    joints: &'a [JointedTo],
    memory: &'a ContactMemory,
) -> impl Iterator<Item = AgentId> + 'a {
    let holding = |joint: &&JointedTo| !memory.has_torn(Partner::Joint(joint.number));
    joints.iter().filter(holding).map(|joint| joint.other)
}

/// The agents that `links` hold to one of this memory in its cluster.
pub(super) fn held_by_links<'a>(links: &'a [Link], memory: &'a ContactMemory) -> impl Iterator<Item = AgentId> + 'a {
    let holding = |link: &&Link| link.law == Law::Cluster && !memory.has_torn(Partner::Link(link.number));
    links.iter().filter(holding).map(|link| link.other)
}

impl AgentRunner {
    /// Hands what yielded and tore in the last step, of `dt`, to the members that tell of it.
    pub(super) fn note_events(&mut self, stepper: &ClusterStepper, dt: SimSpan) {
        if stepper.held_fast() {
            return;
        }
        let (at, mut ids) = (self.pace.scene_time() + dt, Vec::new());
        self.each_member(|actor| ids.push(actor.shared.id));
        let mut places = 0..;
        self.each_member(|actor| {
            let (Some(place), Some(seat)) = (places.next(), &mut actor.cluster) else { return };
            let yielded = stepper.yielded().iter().map(|one| (one, AttachmentEventKind::Yielded));
            let all = yielded.chain(stepper.torn().iter().map(|one| (one, AttachmentEventKind::Tore)));
            for (failed, kind) in all.filter(|(one, _)| one.member == place) {
                let FailedAttachment { other, partner, force_n, .. } = *failed;
                let attachment = match partner {
                    Partner::Link(number) => AttachmentId::Coupling(number),
                    Partner::Joint(number) => AttachmentId::Joint(number),
                    Partner::Attachment(number) => AttachmentId::Part(number),
                    _ => continue,
                };
                let with = other.map(|other| ids[other]);
                seat.events.push(AttachmentEvent { attachment, kind, with, at, force_n });
                actor.shared.streams.event(&AgentEvent { at: actor.pace.time() + dt, kind: EventKind::AttachmentGave });
            }
        });
    }
}
