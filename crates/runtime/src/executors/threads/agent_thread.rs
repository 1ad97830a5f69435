//! The thread of one agent: turn after turn, and sleep between them.
//!
//! In: an agent that is given to it, or returns from its leader. Out: its turns; the agent again where the thread is asked to end. Never here: how threads begin and
//! end.

use crate::agent::handle::Shared;
use crate::cluster::{Handover, hand_over};
use crate::records::turns::Took;
use crate::time::agent_clock::{SharedTimeline, Timeline};
use crate::time::clock::Clock;
use crate::time::cpu::CpuBatch;
use crate::turn::agent_runner::{AgentRunner, Next};
use crate::turn::turn_order::{Held, PartKind, TurnOrder, in_force};
use crate::turn::turn_parts::Begun;
use crate::turn::watchdog::{Watchdog, WatchdogWord};
use crossbeam_utils::atomic::AtomicCell;
use metachron_core::AgentId;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

/// An agent that is behind keeps its core for this long, then yields it: of a thousand threads that have more to do than two cores can, each waits
/// for tenths of a second then. The system's own slices, milliseconds each, would let it wait for seconds.
pub(super) const CATCH_UP_MAX: Duration = Duration::from_micros(20);

/// Working state of an agent's thread.
pub(super) struct AgentThread {
    pub clock: Arc<dyn Clock>,
    pub timeline: Arc<SharedTimeline>,
    pub batch: CpuBatch,
    pub order: Option<Arc<TurnOrder>>,
    /// How long it has made turns since it last slept or yielded its core.
    pub awake: Duration,
    pub watchdog: Watchdog,
    pub word: Arc<WatchdogWord>,
    pub turns: u32,
    pub given: Given,
}

/// The agent that a thread is to take up.
pub(super) type Given = Arc<AtomicCell<Option<Box<AgentRunner>>>>;

impl AgentThread {
    /// The thread's main loop: turn after turn until the agent is asked to end, or is parked. While it is led, its leader has the actor.
    pub fn run(mut self, shared: &Shared) -> Option<Box<AgentRunner>> {
        let mut here = None;
        while !(shared.sleep.stopping() && shared.sleep.end_if_stopping(|| self.word.leave())) {
            here = match here {
                Some(actor) => match self.make_own_turns(actor) {
                    Some(actor) if actor.is_parked() => return actor.kept(),
                    moved => moved,
                },
                None => self.wait_for(shared.handover()),
            };
        }
        // it may have been given just before
        here = here.or_else(|| self.given.take());
        here.iter_mut().for_each(|actor| self.settle(actor));
        here
    }

    /// Makes the turns of `actor` until it hands them over (`None`), is asked to end, or is parked.
    fn make_own_turns(&mut self, mut actor: Box<AgentRunner>) -> Option<Box<AgentRunner>> {
        let sleep = Arc::clone(&actor.shared.sleep);
        let mut next = self.take_up(&mut actor);
        while !sleep.stopping() {
            next = match next {
                Next::Due => self.wait_or_turn(&mut actor),
                Next::Rest => self.rest(&mut actor),
                Next::Join(leader) => {
                    self.settle(&mut actor);
                    actor = self.hand_over(actor, leader).err()?;
                    Next::Due
                }
                Next::Parked => {
                    self.settle(&mut actor);
                    break;
                }
            };
        }
        Some(actor)
    }

    /// How `actor` goes on, of which this thread has just taken the turns.
    fn take_up(&mut self, actor: &mut AgentRunner) -> Next {
        let order = in_force(&mut self.order);
        let mut held = order.as_deref().map(TurnOrder::hold);
        let (timeline, now) = (self.timeline.read(), self.clock.now());
        if let (Some(held), true) = (&mut held, actor.open.is_some()) {
            held.note(PartKind::Show, actor.id(), now);
        }
        actor.next(&timeline, now)
    }

    /// Hands `actor` over to `leader`, if that admits it now.
    fn hand_over(&mut self, actor: Box<AgentRunner>, leader: AgentId) -> Result<(), Box<AgentRunner>> {
        let order = in_force(&mut self.order);
        let mut held = order.as_deref().map(TurnOrder::hold);
        held.iter_mut().for_each(|held| held.note(PartKind::Join, actor.id(), self.clock.now()));
        hand_over(actor, leader)
    }

    /// Waits until the agent is given to it, or returns from its leader.
    fn wait_for(&self, handover: Option<&Handover>) -> Option<Box<AgentRunner>> {
        let returned = self.given.take().or_else(|| handover.and_then(Handover::take_returned));
        if returned.is_none() {
            thread::park();
        }
        returned
    }

    /// Makes a turn if one is due, else sleeps until it is. A wake in between ends the sleep early, which is harmless.
    pub fn wait_or_turn(&mut self, actor: &mut AgentRunner) -> Next {
        let order = in_force(&mut self.order);
        let held = order.as_deref().map(TurnOrder::hold);
        let timeline = self.timeline.read();
        let now = self.clock.now();
        match actor.pace.due(&timeline) {
            Some(due) if due <= now && self.awake >= CATCH_UP_MAX => {
                drop(held);
                thread::yield_now();
                self.awake = Duration::ZERO;
                Next::Due
            }
            Some(due) if due <= now => self.turn(actor, &timeline, now, held),
            Some(due) => {
                drop(held);
                self.awake = Duration::ZERO;
                thread::park_timeout(due - now);
                Next::Due
            }
            None => {
                drop(held);
                self.settle(actor);
                thread::park();
                Next::Due
            }
        }
    }

    fn rest(&mut self, actor: &mut AgentRunner) -> Next {
        let order = in_force(&mut self.order);
        let mut held = order.as_deref().map(TurnOrder::hold);
        let (timeline, now) = (self.timeline.read(), self.clock.now());
        if actor.try_wake(&timeline, now) {
            held.iter_mut().for_each(|held| held.note(PartKind::Wake, actor.id(), now));
            return Next::Due;
        }
        drop(held);
        self.settle(actor);
        thread::park();
        Next::Rest
    }

    fn turn(&mut self, actor: &mut AgentRunner, timeline: &Timeline, began: Duration, held: Option<Held<'_>>) -> Next {
        self.batch.open();
        let started = Instant::now();
        self.turns = self.turns.wrapping_add(1);
        let watched = self.word.begin(self.turns, actor.id());
        let Begun { effort, mut held } = actor.begin_in(timeline, began, held);
        if !self.word.end(watched) {
            self.watchdog.resume(actor.id());
        }
        let now = self.clock.now();
        held.iter_mut().for_each(|held| held.note_end(now));
        let next = match effort {
            None => Next::Parked,
            Some(_) => {
                let turn_s = now.saturating_sub(began).as_secs_f64();
                actor.finish(timeline, Took { begun: began, ended: now }, turn_s)
            }
        };
        drop(held);
        let wall = started.elapsed();
        actor.count(wall);
        self.awake += wall;
        if self.batch.add(wall) {
            self.settle(actor);
        }
        next
    }

    fn settle(&mut self, actor: &mut AgentRunner) {
        if !self.batch.is_empty() {
            actor.settle(self.batch.close());
        }
    }
}
