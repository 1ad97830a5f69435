//! The thread that looks whether turns of agents' threads last too long.
//!
//! In: the turn of each thread. Out: judgements of the watchdog, four times within the time that a turn may last. Never
//! here: their consequences.

use super::agent_thread::Given;
use crate::agent::spawn::RunError;
use crate::turn::agent_runner::AgentRunner;
use crate::turn::watchdog::{Seen, Watchdog, WatchdogWord};
use metachron_core::AgentId;
use std::collections::BTreeMap;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// A thread that gives back its agent when it ends, if it has it.
pub(super) struct Ended {
    pub thread: JoinHandle<Option<Box<AgentRunner>>>,
    pub word: Arc<WatchdogWord>,
    pub given: Given,
}

/// The turns in progress of the agents' threads, for the watching thread.
pub(super) type Words = Arc<Mutex<BTreeMap<AgentId, Arc<WatchdogWord>>>>;

/// Starts the thread that looks whether turns last too long; it ends when the sender sends, or is dropped.
pub(super) fn watch(watchdog: Watchdog, words: Words) -> Result<Sender<()>, RunError> {
    let (unwatched, end) = channel();
    let body = move || {
        // by the word, as a thread that takes another's place counts its turns anew
        let mut seen: BTreeMap<AgentId, (Arc<WatchdogWord>, Seen)> = BTreeMap::new();
        while end.recv_timeout(watchdog.limit.interval()) == Err(RecvTimeoutError::Timeout) {
            let words = words.lock().unwrap_or_else(PoisonError::into_inner).clone();
            seen.retain(|id, (word, _)| words.get(id).is_some_and(|now| Arc::ptr_eq(now, word)));
            for (id, word) in words {
                let (word, seen) = seen.entry(id).or_insert_with(|| (word, Seen::default()));
                watchdog.judge(word, seen);
            }
        }
    };
    let name = "agents:watch".to_owned();
    let thread = thread::Builder::new().name(name.clone()).spawn(body);
    thread.map(|_| unwatched).map_err(|error| RunError::NoThread { name, error })
}
