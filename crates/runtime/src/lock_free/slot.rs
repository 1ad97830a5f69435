//! Slot for the newest value only: one writer, any number of readers, non-blocking.
//!
//! In: complete values. Out: the newest of them, shared. A value that was not read before the next one is lost, by design.
//! The writer reuses values that the readers have released, so that nothing is allocated once there are enough of them: one published, one
//! being filled, and one for each held by a reader. Never here: queues, blocking locks.
//!
//! The newest value is in one of a few cells; an index says which. The writer only ever takes a cell that is not the newest, and only if no
//! reader is in it; a reader takes the newest and retries if the index has moved meanwhile. Both only try the cells' locks, so that a
//! thread that is suspended in the middle blocks no other.
//! (arc-swap does this for readers, but its writer visits every thread that ever read: 60 µs per publication with 1000 agents.)

use super::sync::atomic::{AtomicUsize, Ordering};
use super::sync::{Arc, RwLock};
use std::sync::PoisonError;

/// Number of cells. The writer needs one that is not the newest and not just being read; only three readers of one slot that are suspended
/// inside a read (20 ns) of old values leave it none.
const CELLS: usize = 4;

/// The cells and the index of the newest value.
#[derive(Debug)]
pub struct LatestSlot<T> {
    newest: AtomicUsize,
    cells: [RwLock<Option<Arc<T>>>; CELLS],
}

impl<T> LatestSlot<T> {
    fn new(first: T) -> Self {
        Self::holding(Arc::new(first))
    }

    /// A slot whose first value is there already.
    pub(crate) fn holding(first: Arc<T>) -> Self {
        let mut first = Some(first);
        Self { newest: AtomicUsize::new(0), cells: std::array::from_fn(|_| RwLock::new(first.take())) }
    }

    /// The newest value. It does not change while it is held; hold few of them, since the writer must replace the storage of each.
    #[must_use]
    pub fn latest(&self) -> Arc<T> {
        loop {
            let at = self.newest.load(Ordering::Acquire);
            let seen = self.cells[at].try_read().ok().and_then(|cell| cell.clone());
            // a cell that is rewritten before it is the newest again holds a value that is not published yet
            if self.newest.load(Ordering::Acquire) == at
                && let Some(value) = seen
            {
                return value;
            }
        }
    }

    /// Reads a word of it ([`crate::turn::prefetch`]).
    pub(crate) fn fetch(&self) {
        std::hint::black_box(self.newest.load(Ordering::Relaxed));
    }

    /// Makes `value` the newest and collects values that are no longer read; returns `value` if no cell is free.
    fn put(&self, value: Arc<T>, spare: &mut Vec<Arc<T>>) -> Result<(), Arc<T>> {
        let newest = self.newest.load(Ordering::Relaxed);
        let others = (1..CELLS).map(|k| (newest + k) % CELLS);
        let Some((at, mut cell)) = others.filter_map(|at| Some((at, self.cells[at].try_write().ok()?))).next() else {
            return Err(value);
        };
        spare.extend(cell.replace(value));
        drop(cell);
        self.newest.store(at, Ordering::Release);
        // a reader may be in the previous newest cell: then it is emptied when storage is short
        spare.extend(self.take(newest));
        Ok(())
    }

    /// Collects values from cells that are not the newest and that no reader is in.
    fn sweep(&self, spare: &mut Vec<Arc<T>>) {
        let newest = self.newest.load(Ordering::Relaxed);
        spare.extend((1..CELLS).filter_map(|k| self.take((newest + k) % CELLS)));
    }

    /// Frees all values but the newest. Waits for readers in their cells, which leave them in nanoseconds.
    fn clear_others(&self) {
        let newest = self.newest.load(Ordering::Relaxed);
        for at in (1..CELLS).map(|k| (newest + k) % CELLS) {
            drop(self.cells[at].write().unwrap_or_else(PoisonError::into_inner).take());
        }
    }

    fn take(&self, at: usize) -> Option<Arc<T>> {
        self.cells[at].try_write().ok()?.take()
    }
}

/// The writer of a [`LatestSlot`].
#[derive(Debug)]
pub struct SlotWriter<T> {
    slot: Arc<LatestSlot<T>>,
    spare: Vec<Arc<T>>,
    filled: Option<Arc<T>>,
    made: usize,
}

impl<T: Default> SlotWriter<T> {
    /// A slot whose first value is `first`, and its writer.
    #[must_use]
    pub fn new(first: T) -> Self {
        // one published, one to be filled: allocated one after the other they are on neighbouring pages
        Self { slot: Arc::new(LatestSlot::new(first)), spare: vec![Arc::new(T::default())], filled: None, made: 2 }
    }

    /// Another writer of a slot whose last one writes no more.
    pub(crate) const fn of(slot: Arc<LatestSlot<T>>) -> Self {
        Self { slot, spare: Vec::new(), filled: None, made: 0 }
    }

    /// The slot, for readers.
    #[must_use]
    pub fn slot(&self) -> Arc<LatestSlot<T>> {
        Arc::clone(&self.slot)
    }

    /// Fills a value that nobody else holds, to be published later. `fill` gets an old value and must overwrite all of it. A filled value
    /// that is not yet published is filled again, unless somebody has kept it.
    pub fn fill<R>(&mut self, fill: impl FnOnce(&mut T) -> R) -> R {
        self.spare.extend(self.filled.take());
        let mut free = self.take_spare();
        let result = fill(Arc::get_mut(&mut free).expect("nobody holds a spare value"));
        self.filled = Some(free);
        result
    }

    /// Publishes the value that was filled last; whether it did. It does not if there is none, or if readers suspended in the middle of a
    /// read occupy every cell: then the value stays filled for the next time.
    pub fn publish(&mut self) -> bool {
        let Some(value) = self.filled.take() else { return false };
        self.filled = self.slot.put(value, &mut self.spare).err();
        self.filled.is_none()
    }

    /// Publishes a value that is there already, in place of the newest.
    pub(crate) fn replace(&mut self, value: Arc<T>) {
        let mut left = Some(value);
        while let Some(value) = left {
            // readers suspended in every cell, each of which leaves its cell in nanoseconds
            left = self.slot.put(value, &mut self.spare).err();
        }
    }

    /// Publishes `last` in place of the newest, and keeps nothing else: no more is to be written.
    pub(crate) fn retire(&mut self, last: Arc<T>) {
        self.filled = None;
        self.replace(last);
        self.slot.clear_others();
        self.spare = Vec::new();
    }

    /// The value that is filled and not yet published, to be kept or replaced.
    pub(crate) fn filled_mut(&mut self) -> &mut Option<Arc<T>> {
        &mut self.filled
    }

    /// The value that is filled and not yet published.
    #[must_use]
    pub fn filled(&self) -> Option<&T> {
        self.filled.as_deref()
    }

    /// The value that will be filled next, if one is available.
    #[must_use]
    pub fn spare(&self) -> Option<&T> {
        self.spare.iter().find(|value| Arc::strong_count(value) == 1).map(|value| &**value)
    }

    /// Number of values ever allocated.
    #[must_use]
    pub const fn made(&self) -> usize {
        self.made
    }

    fn take_spare(&mut self) -> Arc<T> {
        self.unread().unwrap_or_else(|| {
            self.slot.sweep(&mut self.spare);
            self.unread().unwrap_or_else(|| {
                self.made += 1;
                Arc::new(T::default())
            })
        })
    }

    /// A spare value that no reader holds.
    fn unread(&mut self) -> Option<Arc<T>> {
        // no reader can acquire a value that is in no cell any more
        let at = self.spare.iter().position(|value| Arc::strong_count(value) == 1)?;
        Some(self.spare.swap_remove(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    fn writer() -> SlotWriter<Vec<u64>> {
        SlotWriter::new(vec![0; 64])
    }

    fn put(writer: &mut SlotWriter<Vec<u64>>, value: u64) {
        writer.fill(|block| {
            block.clear();
            block.resize(64, value);
        });
        writer.publish();
    }

    #[test]
    fn the_newest_value_wins() {
        let mut writer = writer();
        let slot = writer.slot();
        put(&mut writer, 1);
        put(&mut writer, 2);
        assert_eq!(slot.latest()[0], 2);
    }

    #[test]
    fn a_kept_value_never_changes() {
        let mut writer = writer();
        let slot = writer.slot();
        put(&mut writer, 1);
        let kept = slot.latest();
        for value in 2..100 {
            put(&mut writer, value);
        }
        assert!(kept.iter().all(|&v| v == 1));
    }

    #[test]
    fn a_value_filled_and_not_published_is_not_seen() {
        let mut writer = writer();
        let slot = writer.slot();
        writer.fill(|block| *block = vec![9]);
        assert_eq!(slot.latest()[0], 0);
        assert_eq!(writer.filled().unwrap()[0], 9);
        assert!(writer.publish());
        assert!(!writer.publish(), "once");
        assert_eq!(slot.latest()[0], 9);
    }

    #[test]
    fn a_filled_value_that_somebody_has_kept_is_not_written_to() {
        let mut writer = writer();
        writer.fill(|block| *block = vec![1]);
        let kept = writer.filled_mut().clone().unwrap();
        writer.fill(|block| *block = vec![2]);
        assert_eq!((kept[0], writer.filled().unwrap()[0]), (1, 2));
        assert!(writer.publish());
        writer.fill(|block| *block = vec![3]);
        assert_eq!((kept[0], writer.slot().latest()[0]), (1, 2));
    }

    #[test]
    fn nothing_is_allocated_after_warm_up() {
        let mut writer = writer();
        let slot = writer.slot();
        let mut kept = [slot.latest(), slot.latest(), slot.latest()];
        let mut rounds = |values: std::ops::Range<u64>| {
            for value in values {
                put(&mut writer, value);
                kept[value as usize % 3] = slot.latest();
            }
        };
        let warm_up = allocation_counter::measure(|| rounds(0..10));
        let after = allocation_counter::measure(|| rounds(10..10_000));
        assert!(warm_up.count_total > 0, "the counter counts");
        assert_eq!(after.count_total, 0, "{after:?}");
        // one published, one being filled, three held
        assert!(writer.made() <= 5, "made {}", writer.made());
    }

    #[test]
    fn readers_stopped_in_every_cell_stop_neither_the_writer_nor_each_other() {
        let mut writer = writer();
        let slot = writer.slot();
        put(&mut writer, 1);
        let stopped: Vec<_> = slot.cells.iter().map(|cell| cell.read().unwrap()).collect();
        writer.fill(|block| block.fill(2));
        assert!(!writer.publish(), "no cell is free");
        assert_eq!(slot.latest()[0], 1);
        drop(stopped);
        assert!(writer.publish(), "what was filled is still there");
        assert_eq!(slot.latest()[0], 2);
    }

    #[test]
    fn a_reader_on_another_thread_sees_whole_values_that_only_rise() {
        let mut writer: SlotWriter<Block> = SlotWriter::new(Block::default());
        let slot = writer.slot();
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let readers: Vec<_> = (0..2)
                .map(|_| {
                    scope.spawn(|| {
                        let (mut last, mut reads) = (0, 0_u64);
                        while !done.load(Ordering::Acquire) || reads == 0 {
                            let seen = slot.latest();
                            assert!(seen.0.iter().all(|&v| v == seen.0[0]), "torn");
                            assert!(seen.0[0] >= last, "fell from {last} to {}", seen.0[0]);
                            last = seen.0[0];
                            reads += 1;
                        }
                        last
                    })
                })
                .collect();
            for value in 1..=200_000 {
                writer.fill(|block| block.0.fill(value));
                writer.publish();
            }
            done.store(true, Ordering::Release);
            for reader in readers {
                assert!(reader.join().unwrap() <= 200_000);
            }
        });
        assert_eq!(slot.latest().0[0], 200_000);
        // one published, one being filled, and one for each of two readers: held, or in the cell it is reading
        assert!(writer.made() <= 4, "made {}", writer.made());
    }

    struct Block([u64; 64]);

    impl Default for Block {
        fn default() -> Self {
            Self([0; 64])
        }
    }
}
