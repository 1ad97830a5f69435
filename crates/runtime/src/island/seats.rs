//! How agents move between their own turns and those of a leader.
//!
//! An agent moves whole: its model, its writer, its account, its ear. It comes in by the door of the one it follows, and comes
//! back by its own home; whoever makes a leader's turns looks at the doors of all it leads, so that nobody waits at a door
//! that is not looked at. A door that is shut sends everybody home again.
//! Never here: steps.

use super::super::agent_clock::Timeline;
use super::super::agent_runner::AgentRunner;
use super::super::fellows::Fellows;
use super::super::handle::{AgentHandle, Shared};
use crossbeam::atomic::AtomicCell;
use metachron_contact::IslandMember;
use metachron_core::{AgentId, SimTime};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Where agents come and go.
#[derive(Default)]
pub(in super::super) struct Seating {
    /// Nobody waits for this lock but at the end of a run: who finds it taken tries again after the next turn.
    door: Mutex<Vec<Guest>>,
    home: AtomicCell<Option<Box<AgentRunner>>>,
}

impl std::fmt::Debug for Seating {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Seating").finish_non_exhaustive()
    }
}

/// Who waits at a door: an agent is far larger than the word that moves it.
type Guest = Box<AgentRunner>;

/// Those an agent leads.
#[derive(Default)]
pub(in super::super) struct Company {
    /// By rising numbers.
    pub(super) seats: Vec<Seat>,
    /// All that step as one in this turn.
    pub(super) fellows: Fellows,
    /// What became of them, as the model says it.
    pub(in super::super) apart: Vec<u32>,
    /// Storage, empty between turns.
    pub(super) companions: Vec<IslandMember<'static>>,
}

/// One that is led.
pub(super) struct Seat {
    pub actor: Box<AgentRunner>,
    /// Zero while it stays; else it leaves, with those of the same number.
    pub apart: u32,
}

impl Seating {
    /// The agent, if it has come home.
    pub fn come_home(&self) -> Option<Box<AgentRunner>> {
        self.home.take()
    }

    /// Somebody who waits at the door.
    fn knock(&self) -> Option<Box<AgentRunner>> {
        self.door.try_lock().ok()?.pop()
    }

    /// Waits at the door; gives `actor` back if somebody stands in it.
    fn wait(&self, actor: Box<AgentRunner>) -> Result<(), Box<AgentRunner>> {
        match self.door.try_lock() {
            Ok(mut door) => door.push(actor),
            Err(_) => return Err(actor),
        }
        Ok(())
    }

    /// Everybody who waits at the door.
    fn clear(&self) -> Vec<Guest> {
        std::mem::take(&mut *self.door.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Company {
    pub fn is_empty(&self) -> bool {
        self.seats.is_empty()
    }

    pub fn len(&self) -> usize {
        self.seats.len()
    }

    pub fn ids(&self) -> impl Iterator<Item = AgentId> {
        self.seats.iter().map(|seat| seat.actor.id())
    }

    pub fn each(&mut self, mut visit: impl FnMut(&mut AgentRunner)) {
        self.seats.iter_mut().for_each(|seat| visit(&mut seat.actor));
    }

    /// Those it leads.
    pub fn all(&self) -> impl Iterator<Item = &AgentRunner> {
        self.seats.iter().map(|seat| &*seat.actor)
    }

    /// Who stepped as one when that was last found out; `None` where nobody is led.
    pub fn fellows(&self) -> Option<&Fellows> {
        (!self.is_empty()).then_some(&self.fellows)
    }

    /// Visits those it leads, each with all that step as one.
    pub fn each_beside(&mut self, mut visit: impl FnMut(&mut AgentRunner, &Fellows)) {
        self.seats.iter_mut().for_each(|seat| visit(&mut seat.actor, &self.fellows));
    }

    /// Those at `time`, by rising numbers.
    pub fn seats_at(&mut self, time: SimTime) -> impl Iterator<Item = &mut AgentRunner> {
        self.seats.iter_mut().map(|seat| &mut *seat.actor).filter(move |actor| actor.pace.time() == time)
    }

    /// Visits those at `time`, each with all that step as one.
    pub fn each_at(&mut self, time: SimTime, mut visit: impl FnMut(&mut AgentRunner, &Fellows)) {
        let Self { seats, fellows, .. } = self;
        let here = seats.iter_mut().filter(|seat| seat.actor.pace.time() == time);
        here.for_each(|seat| visit(&mut seat.actor, fellows));
    }

    /// All that stepped as one, its leader among them, when that was last found out.
    pub const fn all_fellows(&self) -> &Fellows {
        &self.fellows
    }

    /// Those at `time`.
    pub(super) fn at(&self, time: SimTime) -> impl Iterator<Item = &Seat> {
        self.seats.iter().filter(move |seat| seat.actor.pace.time() == time)
    }

    pub fn gather_fellows(&mut self, leader: AgentId, time: SimTime) {
        let Self { seats, fellows, .. } = self;
        fellows.gather(leader, seats.iter().filter(|s| s.actor.pace.time() == time).map(|s| s.actor.id()));
    }

    /// Notes for those at `time` what the model said became of them.
    pub fn note_apart(&mut self, time: SimTime) {
        let said = self.apart.iter().copied().chain(std::iter::repeat(0));
        let seats = self.seats.iter_mut().filter(|seat| seat.actor.pace.time() == time);
        seats.zip(said).for_each(|(seat, apart)| seat.apart = apart);
    }

    /// Sends home those that have given up.
    pub(super) fn dismiss_parked(&mut self) {
        self.seats.extract_if(.., |seat| seat.actor.is_parked()).for_each(|seat| seat.actor.go_home());
    }

    /// Takes in `actor` and all it leads.
    fn admit(&mut self, mut actor: Box<AgentRunner>) {
        // where it will be when it makes its own turns again nobody knows
        actor.beside = None;
        self.seats.append(&mut actor.company.seats);
        self.seats.push(Seat { actor, apart: 0 });
        self.seats.sort_unstable_by_key(|seat| seat.actor.id());
    }
}

impl AgentRunner {
    /// Takes in those who wait at its door and at the doors of those it leads.
    pub fn take_in(&mut self) {
        let mut at = 0;
        while let Some(actor) = self.knock() {
            self.admit(actor);
        }
        // who comes in may have somebody at the door himself
        while at < self.company.len() {
            let arrived = self.company.seats[at].actor.knock();
            at = if let Some(actor) = arrived {
                self.admit(actor);
                0
            } else {
                at + 1
            };
        }
    }

    /// Somebody who waits at its door.
    fn knock(&self) -> Option<Box<AgentRunner>> {
        self.shared.seating.as_ref()?.knock()
    }

    fn admit(&mut self, actor: Box<AgentRunner>) {
        let (me, sleep) = (self.id(), Arc::clone(&self.shared.sleep));
        std::iter::once(actor.id()).chain(actor.company.ids()).for_each(|id| sleep.follow(id, Some(me)));
        self.company.admit(actor);
    }

    /// Sends home those who have lost touch with it.
    pub fn part(&mut self) {
        if self.company.is_empty() {
            return;
        }
        let leaving = self.company.seats.extract_if(.., |seat| seat.apart != 0);
        let mut leaving: Vec<Seat> = leaving.collect();
        leaving.sort_unstable_by_key(|seat| (seat.apart, seat.actor.id()));
        send_home(leaving);
    }

    /// Shows the last states of those it leads and sends them home, for it has given up.
    pub fn disband(&mut self, timeline: &Timeline, wall: Duration) {
        self.conclude_led(timeline.sim_at(wall), 0.0);
        self.scatter();
    }

    /// Sends home all it leads, each by itself: who belongs together finds together again.
    pub fn scatter(&mut self) {
        self.company.seats.drain(..).for_each(|seat| seat.actor.go_home());
    }

    /// Takes nobody in any more.
    pub fn shut_door(&self) {
        self.shared.sleep.close(self.id());
        empty_door(&self.shared);
    }

    /// Makes its own turns again, and those of all it leads.
    fn go_home(mut self: Box<Self>) {
        let (id, shared) = (self.id(), Arc::clone(&self.shared));
        self.company.ids().for_each(|led| shared.sleep.follow(led, Some(id)));
        shared.sleep.follow(id, None);
        self.settle(1.0);
        if let Some(seating) = &shared.seating {
            // its place is free: there is only one of it
            drop(seating.home.swap(Some(self)));
        }
        shared.sleep.notify(id);
    }

    /// Whom it should hand its turns to: the leader with the lowest number of those that it, or one it leads, is bonded with. Who is at
    /// another time would make up for that alone, and is not led before they have come together.
    pub fn seek_leader(&self) -> Option<AgentId> {
        self.shared.seating.as_ref()?;
        let led = self.company.seats.iter().map(|seat| &*seat.actor);
        let leaders = std::iter::once(self).chain(led).filter_map(AgentRunner::bonded_leader);
        leaders.min().filter(|leader| *leader < self.id() && self.is_at_the_time_of(*leader))
    }

    /// The leader with the lowest number of those this agent is bonded with, whichever side says so.
    fn bonded_leader(&self) -> Option<AgentId> {
        let (me, sleep) = (self.id(), &self.shared.sleep);
        let newest = self.shared.slot.latest();
        let said = newest.bonds.iter().copied();
        let heard = self.observer.neighbours().iter().filter(|n| n.snapshot.bonds.contains(&me)).map(|n| n.id);
        let open =
            |id: &AgentId| !sleep.is_closed(*id) && self.peers.get(*id).is_some_and(|p| p.shared.seating.is_some());
        said.chain(heard).map(|id| sleep.leader(id)).filter(open).min()
    }
}

/// Sends home groups of equal number, each led by its lowest.
fn send_home(leaving: Vec<Seat>) {
    let mut leaving = leaving.into_iter().peekable();
    while let Some(Seat { actor: mut leader, apart }) = leaving.next() {
        while let Some(next) = leaving.next_if(|seat| seat.apart == apart) {
            leader.company.admit(next.actor);
        }
        leader.go_home();
    }
}

/// Hands `actor`, and all it leads, over to `leader`; gives it back if that takes nobody in now.
pub(in super::super) fn move_in(actor: Box<AgentRunner>, leader: AgentId) -> Result<(), Box<AgentRunner>> {
    let (id, sleep, peers) = (actor.id(), Arc::clone(&actor.shared.sleep), Arc::clone(&actor.peers));
    let Some(seating) = peers.get(leader).and_then(|peer| peer.shared.seating.as_ref()) else { return Err(actor) };
    sleep.follow(id, Some(leader));
    if let Err(actor) = seating.wait(actor) {
        sleep.follow(id, None);
        return Err(actor);
    }
    // the door may have been shut just before: one of the two sides sees who is left outside
    if sleep.is_closed(leader) {
        seating.clear().into_iter().for_each(AgentRunner::go_home);
    }
    sleep.wake(leader);
    Ok(())
}

/// Seats agents that belong `together` before the first step: for each place in the list, the agent that makes turns of its own.
pub(in super::super) fn assign(
    actors: Vec<AgentRunner>,
    together: &[Option<AgentId>],
) -> Vec<Option<Box<AgentRunner>>> {
    let leaders = leaders(together);
    let mut places: Vec<_> = actors.into_iter().map(|actor| Some(Box::new(actor))).collect();
    for (at, leader) in leaders.into_iter().enumerate().filter(|(at, leader)| at != leader) {
        let parked = |place: &Option<Box<AgentRunner>>| place.as_ref().is_none_or(|actor| actor.is_parked());
        if !parked(&places[at])
            && !parked(&places[leader])
            && let Some(actor) = places[at].take()
            && let Some(leader) = &mut places[leader]
        {
            leader.admit(actor);
        }
    }
    places
}

/// For each place the lowest number of all that hang together with it.
fn leaders(together: &[Option<AgentId>]) -> Vec<usize> {
    let mut up: Vec<usize> = (0..together.len()).collect();
    let top = |up: &[usize], mut at: usize| {
        while up[at] != at {
            at = up[at];
        }
        at
    };
    for (at, other) in together.iter().enumerate() {
        let Some(other) = other.map(|id| id.0 as usize).filter(|other| *other < together.len()) else { continue };
        let (a, b) = (top(&up, at), top(&up, other));
        up[a.max(b)] = a.min(b);
    }
    (0..together.len()).map(|at| top(&up, at)).collect()
}

/// Sends home those who wait at the door of one whose turns nobody makes any more.
pub(in super::super) fn empty_door(shared: &Shared) {
    shared.seating.iter().flat_map(Seating::clear).for_each(AgentRunner::go_home);
}

/// Ends the lives of those who wait at doors or have come home when nobody looks any more.
pub(in super::super) fn empty_rooms(handles: &[AgentHandle], timeline: &Timeline, now: Duration) {
    let seatings = handles.iter().filter_map(|handle| handle.shared.seating.as_ref());
    for seating in seatings {
        let left = seating.clear().into_iter().chain(seating.come_home());
        left.for_each(|mut actor| actor.close_account(timeline, now));
    }
}
