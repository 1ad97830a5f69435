//! A table with an entry for each agent of a run, which grows as agents join and never moves.
//!
//! The model checker does not explore it: an agent joins before any other thread knows its number.
//! In: room for one more. Out: entries by the numbers of agents, from any thread, without waiting. Never here: what an entry is.

use std::sync::atomic::{
    AtomicUsize,
    Ordering::{Acquire, Release},
};

/// Entries of a page: allocated together, so that a table of thousands is hardly larger than a vector.
const PAGE: usize = 64;

/// One entry for each agent.
#[derive(Debug)]
pub(crate) struct Table<T> {
    pages: boxcar::Vec<Box<[T]>>,
    count: AtomicUsize,
}

impl<T: Default> Table<T> {
    /// A table of so many entries.
    pub fn of(count: usize) -> Self {
        let table = Self { pages: boxcar::Vec::new(), count: AtomicUsize::new(0) };
        (0..count).for_each(|_| table.grow());
        table
    }

    /// Adds an entry; from one thread at a time.
    pub fn grow(&self) {
        let count = self.len();
        if count.is_multiple_of(PAGE) {
            self.pages.push(std::iter::repeat_with(T::default).take(PAGE).collect());
        }
        self.count.store(count + 1, Release);
    }
}

impl<T> Table<T> {
    pub fn len(&self) -> usize {
        self.count.load(Acquire)
    }

    pub fn get(&self, at: usize) -> Option<&T> {
        if at < self.len() { self.pages.get(at / PAGE)?.get(at % PAGE) } else { None }
    }

    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.pages.iter().flat_map(|(_, page)| page.iter()).take(self.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;
    use std::sync::atomic::Ordering::Relaxed;

    #[test]
    fn a_table_grows_while_it_is_read_and_its_entries_stay() {
        let table = Table::<AtomicU64>::of(3);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for at in 3..500 {
                    table.grow();
                    table.get(at).unwrap().store(at as u64, Relaxed);
                }
            });
            while table.len() < 500 {
                assert!(table.iter().count() >= 3 && table.get(table.len() + 1000).is_none());
                std::thread::yield_now();
            }
        });
        assert!((3..500).all(|at| table.get(at).unwrap().load(Relaxed) == at as u64));
        assert_eq!(table.iter().count(), 500);
    }
}
