//! Where the runners of all agents are: at home, with a leader, or on the way to one or back.
//!
//! In: the places of a run between events. Out: all runners, by their numbers, each with its place; and the same again from that.
//! Never here: why an agent is led ([`super::seats`]).

use super::super::agent_runner::AgentRunner;
use super::super::agents::Agents;
use super::seats::Seat;
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
    /// Among those that wait to be led by this agent; so many are before it.
    Waiting { leader: AgentId, before: usize },
    /// On its way home.
    Returning,
}

/// Takes all runners from their places, by rising numbers. `home` are those that make turns of their own.
pub(in super::super) fn take_apart(
    home: impl Iterator<Item = Option<Box<AgentRunner>>>,
    handles: &Agents,
) -> Vec<Placed> {
    let mut all = Vec::with_capacity(handles.len());
    home.flatten().for_each(|runner| take(runner, Place::Home, &mut all));
    for (handle, handover) in handles.iter().filter_map(|handle| Some((handle, handle.shared.handover()?))) {
        let mut arrivals = handover.arrivals.lock().unwrap_or_else(PoisonError::into_inner);
        for (before, runner) in arrivals.drain(..).enumerate() {
            take(runner, Place::Waiting { leader: handle.id(), before }, &mut all);
        }
        handover.returned.take().into_iter().for_each(|runner| take(runner, Place::Returning, &mut all));
    }
    all.sort_unstable_by_key(|placed| placed.runner.id());
    all
}

fn take(mut runner: Box<AgentRunner>, place: Place, all: &mut Vec<Placed>) {
    let leader = runner.id();
    let led = runner.led.seats.drain(..);
    all.extend(led.map(|Seat { actor, group }| Placed { runner: actor, place: Place::Led { leader, group } }));
    all.push(Placed { runner, place });
}

/// Checks that places which were read are such as runners can have.
pub(in super::super) fn check_places(places: &[Place], all: &[Placed]) -> Result<(), ArchiveError> {
    let leads = |leader: AgentId| all.get(leader.0 as usize).is_some_and(|at| at.runner.shared.handover().is_some());
    let is_led = |at: usize| matches!(places[at], Place::Led { .. });
    let is_sound = |(at, place): (usize, &Place)| match *place {
        Place::Home => true,
        Place::Led { leader, .. } => leads(leader) && !is_led(leader.0 as usize) && (leader.0 as usize) < at,
        Place::Waiting { leader, .. } => leads(leader) && leader.0 as usize != at,
        Place::Returning => all[at].runner.shared.handover().is_some(),
    };
    if places.len() == all.len() && places.iter().enumerate().all(is_sound) {
        return Ok(());
    }
    let (found, expected) = ("one that no agent can have".to_owned(), format!("{} places", all.len()));
    Err(ArchiveError::Mismatch { what: "the place of an agent", found, expected })
}

/// Puts all runners back to their places. Out: for each agent the runner that is at home.
pub(in super::super) fn put_back(all: Vec<Placed>, handles: &Agents) -> Vec<Option<Box<AgentRunner>>> {
    let mut homes: Vec<Option<Box<AgentRunner>>> = handles.iter().map(|_| None).collect();
    let (led, mut others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|placed| matches!(placed.place, Place::Led { .. }));
    for Placed { runner, place } in led {
        let Place::Led { leader, group } = place else { continue };
        // both lists rise by numbers
        if let Ok(at) = others.binary_search_by_key(&leader, |placed| placed.runner.id()) {
            others[at].runner.led.seats.push(Seat { actor: runner, group });
        }
    }
    others.sort_by_key(|placed| match placed.place {
        Place::Waiting { before, .. } => before,
        _ => 0,
    });
    for Placed { runner, place } in others {
        let id = runner.id();
        let whose = if let Place::Waiting { leader, .. } = place { leader } else { id };
        let handover = handles[whose.0 as usize].shared.handover();
        match (place, handover) {
            (Place::Waiting { .. }, Some(to)) => {
                to.arrivals.lock().unwrap_or_else(PoisonError::into_inner).push(runner);
            }
            (Place::Returning, Some(home)) => home.returned.store(Some(runner)),
            _ => homes[id.0 as usize] = Some(runner),
        }
    }
    homes
}
