//! What the agents that joined a world after its start were built from.
//!
//! In: a member each. Out: copies by their order of joining, from any thread. Never here: their states.

use super::scene::Member;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The members that joined a world, in the order of their numbers.
#[derive(Debug, Default)]
pub(super) struct Joined(Mutex<Vec<Member>>);

impl Joined {
    /// Adds the one of the next number.
    pub fn push(&self, member: Member) {
        self.all().push(member);
    }

    /// Takes the last one back: its agent could not be started.
    pub fn pop(&self) {
        self.all().pop();
    }

    /// A copy of one.
    pub fn get(&self, at: usize) -> Option<Member> {
        self.all().get(at).cloned()
    }

    fn all(&self) -> MutexGuard<'_, Vec<Member>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
