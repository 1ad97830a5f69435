//! Events of a run: attachments that yielded or tore, sensors that were touched.
//!
//! In: the last states of all agents, each of which has all events that the agent reports. Out: events in the order of
//! time, sensors by agents.
//! Never here: forces, names.

use metachron_core::{AgentId, AttachmentEvent, SensorTouch, Snapshot};

/// An event of an attachment in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// The agent that reports it: of a joint the first body, of a coupling the one of lower number, of a tube's own
    /// attachment the tube.
    pub agent: AgentId,
    /// The event, its time and its force.
    pub what: AttachmentEvent,
}

/// The events that the agents in `states`, by rising numbers, report.
pub(super) fn events<'a>(states: impl Iterator<Item = &'a Snapshot>) -> Vec<Event> {
    let reported =
        |(agent, state): (AgentId, &'a Snapshot)| state.events.iter().map(move |&what| Event { agent, what });
    let mut events: Vec<Event> = (0..).map(AgentId).zip(states).flat_map(reported).collect();
    events.sort_by_key(|event| (event.what.at, event.what.attachment, event.what.kind, event.agent));
    events
}

/// A touch of a sensor in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensing {
    /// The agent that reports it: of two the one of lower number.
    pub agent: AgentId,
    /// The other side, and how often it touched.
    pub what: SensorTouch,
}

/// The touches of sensors that the agents in `states`, by rising numbers, report.
pub(super) fn sensed<'a>(states: impl Iterator<Item = &'a Snapshot>) -> Vec<Sensing> {
    let told = |(agent, state): (AgentId, &'a Snapshot)| state.sensed.iter().map(move |&what| Sensing { agent, what });
    (0..).map(AgentId).zip(states).flat_map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::{AttachmentEventKind, AttachmentId, SimTime};

    #[test]
    fn events_of_all_agents_are_in_the_order_of_time() {
        let torn = |number: u32, at_ns: u64| {
            let (attachment, at) = (AttachmentId::Joint(number), SimTime::from_nanos(at_ns));
            AttachmentEvent { attachment, kind: AttachmentEventKind::Tore, with: None, at, force_n: 1.0 }
        };
        let states = [vec![torn(3, 5), torn(0, 9)], vec![], vec![torn(2, 5), torn(1, 1)]];
        let states = states.map(|events| Snapshot { events, ..Snapshot::default() });
        let order: Vec<_> = events(states.iter()).iter().map(|one| (one.agent.0, one.what.attachment)).collect();
        assert_eq!(order, [(2, 1), (2, 2), (0, 3), (0, 0)].map(|(agent, joint)| (agent, AttachmentId::Joint(joint))));
    }
}
