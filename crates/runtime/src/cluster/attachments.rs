//! Joints and links as the attachments that keep agents in one cluster, until they tear.
//!
//! In: an agent's joints and links, its memory of torn ones, the attachments that yielded and tore in a step. Out:
//! agents that belong together, entries in the states of the agents that report them. Never here: forces, when
//! something yields or tears ([`metachron_contact::step`]).

use metachron_contact::member::{ContactMemory, Partner};
use metachron_contact::{Law, Link};
use metachron_core::AgentId;

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
