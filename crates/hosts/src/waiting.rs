//! Calls that wait for the ones before them.
//!
//! In: calls, each with the name of its peer and its bytes. Out: the same, of one peer after the other, and those that found no room. Never here: which
//! peers may call, what a call says.
//!
//! Where there is no room, the newest calls of the peer with the most of it go: the longest queue is dropped from (SLSC99). A peer that takes less than
//! its even part of the room never loses a call to another one.

use crate::wire::MESSAGE_MAX;
use std::collections::{BTreeMap, VecDeque};
use std::ops::Bound::{Excluded, Unbounded};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// So many calls wait, of so many bytes together.
pub(crate) const CALLS_WAITING: usize = 256;
const ROOM: usize = 2 * MESSAGE_MAX;
/// The room that a call takes beside its bytes: [`CALLS_WAITING`] empty ones fill it.
const HEAD: usize = ROOM / CALLS_WAITING;

/// Calls of peers that wait.
#[derive(Debug)]
pub(crate) struct Waiting<T> {
    queues: Mutex<Queues<T>>,
    came: Condvar,
}

#[derive(Debug)]
struct Queues<T> {
    /// Of each peer of which a call waits.
    of_peers: BTreeMap<String, Queue<T>>,
    /// The peer of the call that was taken last.
    last: String,
}

/// The calls of a peer, and the room that each and all of them take.
#[derive(Debug)]
struct Queue<T> {
    calls: VecDeque<(T, usize)>,
    room: usize,
}

impl<T> Waiting<T> {
    pub fn new() -> Self {
        Self { queues: Mutex::new(Queues { of_peers: BTreeMap::new(), last: String::new() }), came: Condvar::new() }
    }

    fn queues(&self) -> MutexGuard<'_, Queues<T>> {
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets a call wait; returns those that have no room any more, the call itself if it is of the peer with the most.
    pub fn push(&self, peer: &str, call: T, bytes: usize) -> Vec<T> {
        let mut queues = self.queues();
        let empty = || Queue { calls: VecDeque::new(), room: 0 };
        let queue = queues.of_peers.entry(peer.to_owned()).or_insert_with(empty);
        queue.calls.push_back((call, HEAD + bytes));
        queue.room += HEAD + bytes;
        let surplus = std::iter::from_fn(|| queues.drop_from_longest()).collect();
        self.came.notify_one();
        surplus
    }

    /// The next call: the oldest of the next peer; `None` where none comes within `patience`.
    pub fn pop(&self, patience: Duration) -> Option<T> {
        let waited = self.came.wait_timeout_while(self.queues(), patience, |queues| queues.of_peers.is_empty());
        let (mut queues, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let after = queues.of_peers.range::<str, _>((Excluded(&*queues.last), Unbounded)).next();
        queues.last = after.or_else(|| queues.of_peers.first_key_value())?.0.clone();
        let peer = queues.last.clone();
        queues.take(&peer, VecDeque::pop_front)
    }
}

impl<T> Queues<T> {
    /// The newest call of the peer with the most room, where all together have more than there is.
    fn drop_from_longest(&mut self) -> Option<T> {
        let rooms = self.of_peers.values().map(|queue| queue.room);
        if rooms.sum::<usize>() <= ROOM {
            return None;
        }
        let longest = self.of_peers.iter().max_by_key(|(_, queue)| queue.room)?.0.clone();
        self.take(&longest, VecDeque::pop_back)
    }

    /// Takes a call out of the queue of a peer.
    fn take(&mut self, peer: &str, end: impl Fn(&mut VecDeque<(T, usize)>) -> Option<(T, usize)>) -> Option<T> {
        let queue = self.of_peers.get_mut(peer)?;
        let (call, room) = end(&mut queue.calls)?;
        queue.room -= room;
        if queue.calls.is_empty() {
            self.of_peers.remove(peer);
        }
        Some(call)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_that_floods_loses_its_own_calls_and_delays_another_by_one() {
        let waiting = Waiting::new();
        let mut lost = Vec::new();
        for number in 0..1000 {
            lost.extend(waiting.push("flood", ("flood", number), 0));
        }
        assert_eq!(lost.len(), 1000 - CALLS_WAITING);
        for number in 0..80 {
            let dropped = waiting.push("calm", ("calm", number), 1000);
            assert!(dropped.iter().all(|(peer, _)| *peer == "flood"));
        }
        // long messages instead of many
        assert!(waiting.push("long", ("long", 0), MESSAGE_MAX / 2).iter().all(|(peer, _)| *peer == "flood"));
        assert_eq!(waiting.push("long", ("long", 1), MESSAGE_MAX), [("long", 1)]);
        let taken: Vec<_> = std::iter::from_fn(|| waiting.pop(Duration::ZERO)).collect();
        let calm: Vec<_> = taken.iter().filter(|(peer, _)| *peer == "calm").map(|(_, number)| *number).collect();
        assert_eq!(calm, (0..80).collect::<Vec<_>>(), "in order, and none is lost");
        let at = |number| taken.iter().position(|call| *call == ("calm", number)).unwrap();
        assert!((1..50).all(|number| at(number) - at(number - 1) <= 3), "one call of each other peer between two");
    }
}
