//! Words that one thread writes and any thread reads whole, without waiting: a version before and after them tells (a seqlock).
//!
//! In: all words at once. Out: all words of one writing, or word that they are just being written. The words are atomic, so that
//! a reader in the middle of a writing reads old and new ones, which it throws away, and nothing undefined.
//! Never here: what the words mean, how often a reader tries again.

use super::sync::atomic::{AtomicU64, Ordering, fence};

/// `N` words and their version.
#[derive(Debug)]
pub(super) struct Seqlock<const N: usize> {
    /// The version that the writer has come to, for it alone: so it never loads what it stores, and loom sees every order (it
    /// overlooks those in which a store comes right after its own thread's load).
    reached: AtomicU64,
    /// Odd while the words are being written; zero before the first writing.
    version: AtomicU64,
    words: [AtomicU64; N],
}

/// What a reader finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Glance<const N: usize> {
    /// Nothing was ever written.
    Nothing,
    /// The newest whole writing.
    Whole([u64; N]),
    /// A writer stands in the middle of a writing, or came to one meanwhile.
    Torn,
}

impl<const N: usize> Seqlock<N> {
    /// Nothing is written yet.
    pub fn new() -> Self {
        Self {
            reached: AtomicU64::new(0),
            version: AtomicU64::new(0),
            words: std::array::from_fn(|_| AtomicU64::new(0)),
        }
    }

    /// Writes `words`; from one thread at a time.
    pub fn write(&self, words: [u64; N]) {
        let version = self.reached.load(Ordering::Relaxed);
        self.reached.store(version.wrapping_add(2), Ordering::Relaxed);
        self.version.store(version.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (word, value) in self.words.iter().zip(words) {
            word.store(value, Ordering::Relaxed);
        }
        self.version.store(version.wrapping_add(2), Ordering::Release);
    }

    /// Looks once.
    pub fn read(&self) -> Glance<N> {
        let version = self.version.load(Ordering::Acquire);
        if version == 0 {
            return Glance::Nothing;
        }
        let words = std::array::from_fn(|k| self.words[k].load(Ordering::Relaxed));
        fence(Ordering::Acquire);
        let is_whole = version.is_multiple_of(2) && self.version.load(Ordering::Relaxed) == version;
        if is_whole { Glance::Whole(words) } else { Glance::Torn }
    }
}

impl<const N: usize> Default for Seqlock<N> {
    fn default() -> Self {
        Self::new()
    }
}
