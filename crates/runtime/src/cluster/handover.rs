//! How agents hand their turns over to a leader and get them back.
//!
//! An agent moves whole: its model, its writer, its metrics, its observer. It waits among the arrivals of the agent that is to lead it, and
//! returns to its own place. The thread that makes a leader's turns looks at the arrivals of all that it leads, so that no agent waits
//! unseen. An agent that makes no more turns is closed: its arrivals return.
//! Never here: steps.

use super::membership::Membership;
use crate::agent::agents::Agents;
use crate::agent::handle::{AgentHandle, Shared};
use crate::records::events::EventKind;
use crate::records::turns::Took;
use crate::time::agent_clock::Timeline;
use crate::turn::agent_runner::AgentRunner;
use crossbeam_utils::atomic::AtomicCell;
use metachron_core::{AgentId, Archive, ArchiveError, DisjointSets, SimTime};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Where agents wait for a leader, and return to.
#[derive(Default)]
pub(in super::super) struct Handover {
    /// Locked without waiting but at the end of a run: an agent that finds it taken tries again after the next turn.
    pub(super) arrivals: Mutex<Vec<Arrival>>,
    pub(super) returned: AtomicCell<Option<Box<AgentRunner>>>,
}

/// An agent that waits to be led, boxed: it is far larger than the word that moves it.
type Arrival = Box<AgentRunner>;

/// The agents that another one leads.
#[derive(Default)]
pub(in super::super) struct Led {
    /// By rising numbers.
    pub(super) agents: Vec<LedAgent>,
    /// All that step as one in this turn, the leader among them.
    pub(super) membership: Membership,
}

/// One that is led.
pub(super) struct LedAgent {
    pub actor: Box<AgentRunner>,
    /// Zero while it stays; else it leaves, together with the agents of the same number.
    pub group: usize,
}

impl Handover {
    /// The agent, if it has returned.
    pub fn take_returned(&self) -> Option<Box<AgentRunner>> {
        self.returned.take()
    }

    fn next_arrival(&self) -> Option<Box<AgentRunner>> {
        self.arrivals.try_lock().ok()?.pop()
    }

    /// Adds `actor` to the arrivals; gives it back if another thread looks at them.
    fn arrive(&self, actor: Box<AgentRunner>) -> Result<(), Box<AgentRunner>> {
        match self.arrivals.try_lock() {
            Ok(mut arrivals) => arrivals.push(actor),
            Err(_) => return Err(actor),
        }
        Ok(())
    }

    /// Removes all arrivals.
    fn clear(&self) -> Vec<Arrival> {
        std::mem::take(&mut *self.arrivals.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Shared {
    pub fn handover(&self) -> Option<&Handover> {
        self.identity.handover.as_ref()?.downcast_ref()
    }
}

impl AgentHandle {
    /// The runner, if it has returned from a leader.
    pub(crate) fn take_returned(&self) -> Option<Box<AgentRunner>> {
        self.live()?.handover()?.take_returned()
    }
}

impl Led {
    /// Writes or reads the membership as it was last noted; the agents themselves are archived by their own.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.membership)
    }

    pub fn is_empty(&self) -> bool {
        self.agents.is_empty()
    }

    pub fn len(&self) -> usize {
        self.agents.len()
    }

    pub fn ids(&self) -> impl Iterator<Item = AgentId> {
        self.agents.iter().map(|member| member.actor.id())
    }

    pub fn each(&mut self, mut visit: impl FnMut(&mut AgentRunner)) {
        self.agents.iter_mut().for_each(|member| visit(&mut member.actor));
    }

    /// All of them, by rising numbers.
    pub fn all(&self) -> impl Iterator<Item = &AgentRunner> {
        self.agents.iter().map(|member| &*member.actor)
    }

    /// The members at `time`, by rising numbers.
    pub fn members_at(&mut self, time: SimTime) -> impl Iterator<Item = &mut AgentRunner> {
        self.agents.iter_mut().map(|member| &mut *member.actor).filter(move |actor| actor.pace.time() == time)
    }

    /// Visits the members at `time`, each with all that step as one.
    pub fn each_at(&mut self, time: SimTime, mut visit: impl FnMut(&mut AgentRunner, &Membership)) {
        let Self { agents, membership } = self;
        let here = agents.iter_mut().filter(|member| member.actor.pace.time() == time);
        here.for_each(|member| visit(&mut member.actor, membership));
    }

    /// All that step as one, the leader among them, when that was last noted.
    pub const fn membership(&self) -> &Membership {
        &self.membership
    }

    /// Notes which agents step as one with `leader` at `time`.
    pub fn note_membership(&mut self, leader: AgentId, time: SimTime) {
        let Self { agents, membership } = self;
        membership.set(leader, agents.iter().filter(|s| s.actor.pace.time() == time).map(|s| s.actor.id()));
    }

    /// Notes which of the members at `time` still belong together: the leader is the first of `sets`, they follow by
    /// rising numbers.
    pub fn note_groups(&mut self, time: SimTime, sets: &mut DisjointSets) {
        let members = self.agents.iter_mut().filter(|member| member.actor.pace.time() == time);
        members.zip(1..).for_each(|(member, place)| member.group = sets.lowest(place));
    }

    /// Lets parked agents return.
    pub fn release_parked(&mut self) {
        self.agents.extract_if(.., |member| member.actor.is_parked()).for_each(|mut member| {
            if member.actor.shared.gauges.has_left() {
                member.actor.vanish();
                member.actor.forget();
            }
            member.actor.return_turns();
        });
    }

    /// Lets the members return that have refused the step that was made last, each by itself.
    pub(super) fn release_refusing(&mut self) {
        let refusing = self.agents.extract_if(.., |member| member.actor.model.take_refused());
        refusing.for_each(|member| member.actor.return_turns());
    }

    /// Adds `actor` and all it leads.
    fn admit(&mut self, mut actor: Box<AgentRunner>) {
        // where it will be when it makes its own turns again is not known
        actor.was_near = None;
        self.agents.append(&mut actor.led.agents);
        self.agents.push(LedAgent { actor, group: 0 });
        self.agents.sort_unstable_by_key(|member| member.actor.id());
    }
}

impl AgentRunner {
    /// Leads its arrivals and the arrivals of the agents that it leads.
    pub fn admit_arrivals(&mut self) {
        let mut at = 0;
        while let Some(actor) = self.next_arrival() {
            self.admit(actor);
        }
        // an arrival may have arrivals of its own
        while at < self.led.len() {
            let arrived = self.led.agents[at].actor.next_arrival();
            at = if let Some(actor) = arrived {
                self.admit(actor);
                0
            } else {
                at + 1
            };
        }
    }

    fn next_arrival(&self) -> Option<Box<AgentRunner>> {
        self.shared.handover()?.next_arrival()
    }

    fn admit(&mut self, actor: Box<AgentRunner>) {
        let (me, sleep) = (self.id(), Arc::clone(&self.shared.sleep));
        std::iter::once(actor.id()).chain(actor.led.ids()).for_each(|id| sleep.follow(id, Some(me)));
        std::iter::once(&*actor).chain(actor.led.all()).for_each(|joining| joining.record_event(EventKind::Joined(me)));
        self.led.admit(actor);
    }

    /// Lets the members return that have lost touch with it.
    pub fn part(&mut self) {
        if self.led.is_empty() {
            return;
        }
        let leaving = self.led.agents.extract_if(.., |member| member.group != 0);
        let mut leaving: Vec<LedAgent> = leaving.collect();
        leaving.sort_unstable_by_key(|member| (member.group, member.actor.id()));
        return_groups(leaving);
    }

    /// Shows the last states of the agents that it leads and lets them return: it makes no more turns.
    pub fn disband(&mut self, timeline: &Timeline, wall: Duration) {
        self.conclude_led(timeline, Took { begun: wall, ended: wall });
        self.release_together();
        if self.shared.gauges.has_left() {
            self.forget();
        }
    }

    /// Lets all it leads return, each by itself: agents that belong together find together again.
    pub fn release_all(&mut self) {
        self.led.agents.drain(..).for_each(|member| member.actor.return_turns());
    }

    /// Lets all it leads return, led by the lowest of them: they go on as one without it.
    pub(super) fn release_together(&mut self) {
        let mut leaving: Vec<LedAgent> = self.led.agents.drain(..).collect();
        leaving.iter_mut().for_each(|member| member.group = 1);
        return_groups(leaving);
    }

    /// Admits nobody any more.
    pub fn close(&self) {
        self.shared.sleep.close(self.id());
        return_arrivals(&self.shared);
    }

    /// Makes its own turns again, and lets all it leads make theirs.
    fn return_turns(mut self: Box<Self>) {
        let (id, shared) = (self.id(), Arc::clone(&self.shared));
        self.led.ids().for_each(|led| shared.sleep.follow(led, Some(id)));
        self.record_event(EventKind::Left);
        shared.sleep.follow(id, None);
        self.settle(1.0);
        if let Some(handover) = shared.handover() {
            // its place is free: there is only one of it
            drop(handover.returned.swap(Some(self)));
        }
        shared.sleep.notify(id);
    }

    /// The agent that should lead it: of the leaders of the agents that it, or one it leads, is bonded with, the lowest
    /// number. An agent at another time would make up for that alone, and is not led before the two have come together.
    pub fn seek_leader(&self) -> Option<AgentId> {
        self.shared.handover()?;
        let led = self.led.agents.iter().map(|member| &*member.actor);
        let leaders = std::iter::once(self).chain(led).filter_map(AgentRunner::bonded_leader);
        leaders.min().filter(|leader| *leader < self.id() && self.is_at_the_time_of(*leader))
    }

    /// The leader with the lowest number of the agents that this one is bonded with, whichever side says so.
    fn bonded_leader(&self) -> Option<AgentId> {
        let (me, sleep) = (self.id(), &self.shared.sleep);
        let newest = self.shared.slot.latest();
        let own = newest.bonds.iter().copied();
        let theirs = self.observer.neighbours().iter().filter(|n| n.snapshot.bonds.contains(&me)).map(|n| n.id);
        let open =
            |id: &AgentId| !sleep.is_closed(*id) && self.peers.get(*id).is_some_and(|peer| peer.handover().is_some());
        own.chain(theirs).map(|id| sleep.leader(id)).filter(open).min()
    }
}

/// Lets groups of equal number return, each led by its lowest.
fn return_groups(leaving: Vec<LedAgent>) {
    let mut leaving = leaving.into_iter().peekable();
    while let Some(LedAgent { actor: mut leader, group }) = leaving.next() {
        while let Some(next) = leaving.next_if(|member| member.group == group) {
            leader.led.admit(next.actor);
        }
        leader.return_turns();
    }
}

/// Hands `actor`, and all it leads, over to `leader`; gives it back if that admits nobody now.
pub(in super::super) fn hand_over(actor: Box<AgentRunner>, leader: AgentId) -> Result<(), Box<AgentRunner>> {
    let (id, sleep, peers) = (actor.id(), Arc::clone(&actor.shared.sleep), Arc::clone(&actor.peers));
    let leads = peers.get(leader);
    let Some(handover) = leads.as_ref().and_then(|leads| leads.handover()) else { return Err(actor) };
    sleep.follow(id, Some(leader));
    if let Err(actor) = handover.arrive(actor) {
        sleep.follow(id, None);
        return Err(actor);
    }
    // the leader may have been closed just before: one of the two sides sees the runners left among its arrivals
    if sleep.is_closed(leader) {
        handover.clear().into_iter().for_each(AgentRunner::return_turns);
    }
    sleep.wake(leader);
    Ok(())
}

/// Seats agents that belong together before the first step: agents that may touch in it, and agents that links or
/// joints connect. For each place in the list, the agent that makes turns of its own.
pub(in super::super) fn assign_leaders(mut actors: Vec<AgentRunner>) -> Vec<Option<Box<AgentRunner>>> {
    let mut sets = DisjointSets::of(actors.len());
    for (at, actor) in actors.iter_mut().enumerate().filter(|(_, actor)| actor.shared.handover().is_some()) {
        for other in actor.look_first() {
            sets.join(at, other.0 as usize);
        }
    }
    let mut places: Vec<_> = actors.into_iter().map(|actor| Some(Box::new(actor))).collect();
    for at in 0..places.len() {
        let leader = sets.lowest(at);
        let leads = |place: &Option<Box<AgentRunner>>| place.as_ref().is_some_and(|actor| !actor.is_parked());
        if at != leader
            && leads(&places[at])
            && leads(&places[leader])
            && let Some(actor) = places[at].take()
            && let Some(leader) = &mut places[leader]
        {
            leader.admit(actor);
        }
    }
    places
}

/// Lets the arrivals of an agent that makes no more turns return.
pub(in super::super) fn return_arrivals(shared: &Shared) {
    shared.handover().into_iter().flat_map(Handover::clear).for_each(AgentRunner::return_turns);
}

/// Completes the metrics of the agents that are among arrivals or have returned when nobody looks any more.
pub(in super::super) fn close_remaining(handles: &Agents, timeline: &Timeline, now: Duration) {
    for shared in handles.iter().filter_map(AgentHandle::live) {
        let Some(handover) = shared.handover() else { continue };
        let left = handover.clear().into_iter().chain(handover.take_returned());
        left.for_each(|mut actor| actor.close_account(timeline, now));
    }
}
