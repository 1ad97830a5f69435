//! Where the runners of all agents are: at home, with a leader, or on the way to one or back.
//!
//! In: the places of a run between events. Out: all runners, by their numbers, each with its place; and the same again from that.
//! Never here: why an agent is led ([`super::handover`]).

use super::handover::LedAgent;
use crate::agent::agents::Agents;
use crate::agent::handle::AgentHandle;
use crate::turn::agent_runner::AgentRunner;
use metachron_core::{AgentId, ArchiveError};
use std::sync::PoisonError;

/// A runner that was taken from its place.
pub(in super::super) struct Placed {
    pub runner: Box<AgentRunner>,
    pub place: Place,
}

/// Where a runner is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(in super::super) enum Place {
    /// It makes its own turns.
    Home,
    /// With its leader; in which group it leaves, zero for none.
    Led { leader: AgentId, group: usize },
    /// Among the agents that wait to be led by this one; so many are before it.
    Waiting { leader: AgentId, before: usize },
    /// On its way home.
    Returning,
}

impl Place {
    /// The agent that leads it, or that it waits for.
    pub const fn leader(self) -> Option<AgentId> {
        match self {
            Self::Led { leader, .. } | Self::Waiting { leader, .. } => Some(leader),
            Self::Home | Self::Returning => None,
        }
    }
}

/// Takes all runners from their places, for each number its own; `None` of an agent that has left and is not kept.
/// `home` are the runners that make turns of their own.
pub(in super::super) fn take_apart(
    home: impl Iterator<Item = Option<Box<AgentRunner>>>,
    handles: &Agents,
) -> Vec<Option<Placed>> {
    let mut all: Vec<Option<Placed>> = handles.iter().map(|_| None).collect();
    home.flatten().for_each(|runner| take(runner, Place::Home, &mut all));
    for shared in handles.iter().filter_map(AgentHandle::live) {
        let Some(handover) = shared.handover() else { continue };
        let mut arrivals = handover.arrivals.lock().unwrap_or_else(PoisonError::into_inner);
        for (before, runner) in arrivals.drain(..).enumerate() {
            take(runner, Place::Waiting { leader: shared.id, before }, &mut all);
        }
        handover.returned.take().into_iter().for_each(|runner| take(runner, Place::Returning, &mut all));
    }
    all
}

fn take(mut runner: Box<AgentRunner>, place: Place, all: &mut [Option<Placed>]) {
    let leader = runner.id();
    let led = runner.led.agents.drain(..);
    let led = led.map(|LedAgent { actor, group }| (actor, Place::Led { leader, group })).collect::<Vec<_>>();
    for (runner, place) in led.into_iter().chain([(runner, place)]) {
        let at = runner.id().0 as usize;
        all[at] = runner.kept().map(|runner| Placed { runner, place });
    }
}

/// Checks that places are such as the runners of the agents that are there can have.
///
/// # Errors
/// [`ArchiveError::Mismatch`].
pub(in super::super) fn check_places(places: &[Place], all: &[Option<&AgentRunner>]) -> Result<(), ArchiveError> {
    let has_handover =
        |at: usize| all.get(at).and_then(Option::as_ref).is_some_and(|runner| runner.shared.handover().is_some());
    let leads = |leader: AgentId| has_handover(leader.0 as usize);
    let is_led = |at: usize| matches!(places[at], Place::Led { .. });
    let is_sound = |(at, place): (usize, &Place)| match *place {
        Place::Home => true,
        Place::Led { leader, .. } => leads(leader) && !is_led(leader.0 as usize) && (leader.0 as usize) < at,
        Place::Waiting { leader, .. } => leads(leader) && leader.0 as usize != at,
        Place::Returning => has_handover(at),
    };
    if places.len() == all.len() && places.iter().enumerate().all(is_sound) {
        return Ok(());
    }
    let (found, expected) = ("one that no agent can have".to_owned(), format!("{} places", all.len()));
    Err(ArchiveError::Mismatch { what: "the place of an agent", found, expected })
}

/// Puts all runners back to their places. Out: for each agent the runner that is at home.
pub(in super::super) fn put_back(all: Vec<Option<Placed>>, handles: &Agents) -> Vec<Option<Box<AgentRunner>>> {
    let mut homes: Vec<Option<Box<AgentRunner>>> = handles.iter().map(|_| None).collect();
    let (led, mut others): (Vec<_>, Vec<_>) =
        all.into_iter().flatten().partition(|placed| matches!(placed.place, Place::Led { .. }));
    for Placed { runner, place } in led {
        let Place::Led { leader, group } = place else { continue };
        // both lists rise by numbers
        if let Ok(at) = others.binary_search_by_key(&leader, |placed| placed.runner.id()) {
            others[at].runner.led.agents.push(LedAgent { actor: runner, group });
        }
    }
    others.sort_by_key(|placed| match placed.place {
        Place::Waiting { before, .. } => before,
        _ => 0,
    });
    for Placed { runner, place } in others {
        let id = runner.id();
        let whose = if let Place::Waiting { leader, .. } = place { leader } else { id };
        let there = handles[whose.0 as usize].live();
        match (place, there.as_ref().and_then(|shared| shared.handover())) {
            (Place::Waiting { .. }, Some(to)) => {
                to.arrivals.lock().unwrap_or_else(PoisonError::into_inner).push(runner);
            }
            (Place::Returning, Some(home)) => home.returned.store(Some(runner)),
            _ => homes[id.0 as usize] = Some(runner),
        }
    }
    homes
}
