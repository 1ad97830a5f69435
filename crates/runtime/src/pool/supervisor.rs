//! Supervisor of a pool's workers: starts, watches, replaces and joins them.
//!
//! In: the pool's shared state. Out: a thread for each worker's place, until the end. A step that does not return costs one agent and one
//! thread: the agent is parked with the reason, and another worker takes the place. Never here: turns.

use super::super::island::{empty_door, empty_rooms};
use super::super::priority::Priority;
use super::shared::PoolState;
use super::watchdog::{TurnUnderWatch, WatchdogWord};
use super::worker::Worker;
use metachron_core::AgentId;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// How long the end of a run waits after the last worker that ended. A step that takes longer counts as hung; its thread is left behind.
const PARTING: Duration = Duration::from_millis(400);

/// A worker is given up when it is found in the same turn this many times in a row: after a suspension of the whole machine it is found so
/// only once.
const LOOKS: u32 = 4;

/// All workers and their state.
pub(super) struct Supervisor {
    hall: Arc<PoolState>,
    posts: Vec<Post>,
    hired: u32,
    patience: Duration,
    priority: Priority,
    sender: Sender<Note>,
    notes: Receiver<Note>,
}

/// A message to the supervisor.
pub(super) enum Note {
    /// The run is to end.
    Stop,
    /// The worker started under this number has ended.
    Ended(u32),
}

/// One worker.
struct Post {
    number: u32,
    desk: Arc<WatchdogWord>,
    thread: Option<JoinHandle<()>>,
    seen: Option<TurnUnderWatch>,
    looks: u32,
}

/// Reports that a worker has ended, for whatever reason.
struct EndNotice {
    number: u32,
    sender: Sender<Note>,
}

impl Drop for EndNotice {
    fn drop(&mut self) {
        // the send fails only after the end, when the report is no longer needed
        let _ = self.sender.send(Note::Ended(self.number));
    }
}

impl Supervisor {
    /// Starts a worker for each of `places`; a step that takes longer than `patience` is given up.
    pub fn hire(hall: Arc<PoolState>, places: usize, patience: Duration, priority: Priority) -> io::Result<Self> {
        let (sender, notes) = channel();
        let mut staff = Self { hall, posts: Vec::new(), hired: 0, patience, priority, sender, notes };
        for at in 0..places {
            match staff.post(at) {
                Ok(post) => staff.posts.push(post),
                Err(error) => {
                    staff.hall.board.stop();
                    staff.dismiss();
                    return Err(error);
                }
            }
        }
        Ok(staff)
    }

    /// The sender for messages to the supervisor.
    pub fn notes(&self) -> Sender<Note> {
        self.sender.clone()
    }

    /// Watches the workers until the run is to end, and ends it.
    pub fn watch(mut self) {
        loop {
            match self.notes.recv_timeout(self.patience / LOOKS) {
                Ok(Note::Stop) => break,
                Ok(Note::Ended(number)) => self.bury(number),
                Err(_) => self.look(),
            }
        }
        self.dismiss();
    }

    fn post(&mut self, at: usize) -> io::Result<Post> {
        let (number, desk) = (self.hired, Arc::new(WatchdogWord::default()));
        self.hired += 1;
        let (hall, farewell) = (Arc::clone(&self.hall), EndNotice { number, sender: self.sender.clone() });
        let body = {
            let (desk, priority) = (Arc::clone(&desk), self.priority);
            move || {
                let _farewell = farewell;
                // a refusal was already reported to the caller of `Priority::ask`
                drop(priority.take());
                Worker::new(hall, at, desk).work();
            }
        };
        let thread = thread::Builder::new().name(format!("pool:{at}")).spawn(body)?;
        Ok(Post { number, desk, thread: Some(thread), seen: None, looks: 0 })
    }

    fn look(&mut self) {
        for at in 0..self.posts.len() {
            let post = &mut self.posts[at];
            let sitting = post.desk.sitting();
            post.looks = if sitting.is_some() && sitting == post.seen { post.looks + 1 } else { 0 };
            post.seen = sitting;
            if let Some(sitting) = sitting.filter(|sitting| post.looks >= LOOKS && post.desk.give_up(*sitting)) {
                self.lose(sitting.whose(), self.patience);
                self.replace(at);
            }
        }
    }

    /// A worker has ended. Before the end of the run that is a bug of metachron, and the other workers must continue.
    fn bury(&mut self, number: u32) {
        let Some(at) = self.posts.iter().position(|post| post.number == number) else { return };
        if let Some(sitting) = self.posts[at].desk.sitting() {
            self.park(sitting.whose(), "its worker broke down, which is a bug in metachron");
        }
        if self.hall.board.stopping() { self.join(number) } else { self.replace(at) }
    }

    /// If the system gives no more threads, the other workers continue without this one.
    fn replace(&mut self, at: usize) {
        if let Ok(post) = self.post(at) {
            self.posts[at] = post;
        }
    }

    fn lose(&self, id: AgentId, patience: Duration) {
        self.park(id, &format!("a step has not ended within {} s", patience.as_secs_f64()));
    }

    /// Parks an agent that is stuck in a turn, and all agents it leads, from outside.
    fn park(&self, id: AgentId, reason: &str) {
        let PoolState { board, handles, .. } = &*self.hall;
        board.close(id);
        let led = || handles.iter().filter(|agent| board.leader(agent.id()) == id);
        led().for_each(|agent| empty_door(&agent.shared));
        led().for_each(|agent| {
            board.close(agent.id());
            agent.shared.gauges.park(reason.to_owned());
            board.news.tell(agent.id());
        });
    }

    fn join(&mut self, number: u32) {
        let post = self.posts.iter_mut().find(|post| post.number == number);
        // a panic outside a turn has been printed, and the other workers must still be joined
        drop(post.and_then(|post| post.thread.take()).map(JoinHandle::join));
    }

    /// Waits for the workers until a timeout, and ends all agents.
    fn dismiss(&mut self) {
        while self.posts.iter().any(|post| post.thread.is_some()) {
            match self.notes.recv_timeout(PARTING) {
                Ok(Note::Ended(number)) => self.join(number),
                Ok(Note::Stop) => {}
                Err(_) => break,
            }
        }
        for post in self.posts.iter().filter(|post| post.thread.is_some()) {
            if let Some(sitting) = post.desk.sitting().filter(|sitting| post.desk.give_up(*sitting)) {
                self.lose(sitting.whose(), PARTING);
            }
        }
        let (timeline, now) = (self.hall.timeline.read(), self.hall.clock.now());
        self.hall.clear(|mut actor| actor.close_account(&timeline, now));
        empty_rooms(&self.hall.handles, &timeline, now);
    }
}
