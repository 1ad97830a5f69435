//! Seqlock: words that one thread writes and any thread reads consistently, without waiting, checked by a version before and after.
//!
//! In: all words together. Out: all words of one write, or the report that a write is in progress. The words are atomic, so that a reader
//! in the middle of a write reads a mix of old and new ones, which it discards, without undefined behaviour.
//! Never here: the meaning of the words, how often a reader retries.

use super::sync::atomic::{AtomicU64, Ordering, fence};

/// `N` words and their version.
#[derive(Debug)]
pub(crate) struct Seqlock<const N: usize> {
    /// The writer's copy of its version: so it never loads a word that it stores, and loom explores every order (it
    /// misses orders in which a store comes right after a load by the same thread).
    reached: AtomicU64,
    /// Odd while the words are being written; zero before the first write.
    version: AtomicU64,
    words: [AtomicU64; N],
}

/// Result of a read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReadOutcome<const N: usize> {
    /// Nothing was ever written.
    Empty,
    /// The newest complete write.
    Complete([u64; N]),
    /// A write was in progress, or began meanwhile.
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

    /// Forgets the words written; from the writer, while nobody reads.
    pub fn clear(&self) {
        self.reached.store(0, Ordering::Relaxed);
        self.version.store(0, Ordering::Release);
    }

    /// Tries to read once.
    pub fn read(&self) -> ReadOutcome<N> {
        self.read_at(self.version.load(Ordering::Acquire))
    }

    /// Tries to read the write of this number, counted from 1: [`ReadOutcome::Torn`] where it is gone, or not there yet.
    pub fn read_write(&self, number: u64) -> ReadOutcome<N> {
        let version = self.version.load(Ordering::Acquire);
        if version == number.wrapping_mul(2) { self.read_at(version) } else { ReadOutcome::Torn }
    }

    /// Reads, where the version was this before.
    fn read_at(&self, version: u64) -> ReadOutcome<N> {
        if version == 0 {
            return ReadOutcome::Empty;
        }
        let words = std::array::from_fn(|k| self.words[k].load(Ordering::Relaxed));
        fence(Ordering::Acquire);
        let is_whole = version.is_multiple_of(2) && self.version.load(Ordering::Relaxed) == version;
        if is_whole { ReadOutcome::Complete(words) } else { ReadOutcome::Torn }
    }
}

impl<const N: usize> Default for Seqlock<N> {
    fn default() -> Self {
        Self::new()
    }
}
