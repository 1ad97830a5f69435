//! Every order of steps of threads that meet in the runtime without waiting, and everything they may see of each other.
//!
//! In: the runtime's own files, over loom's primitives instead of the standard library's. Out: a line for each claim that
//! holds; a claim that does not ends the program with the steps that break it. Never here: other copies of the checked
//! files.
//! With the feature `threads` the same claims are held against real threads, thousands of times, for ThreadSanitizer to watch.

extern crate self as metachron_core;

/// The primitives that the files know as the runtime's `sync`.
#[cfg(not(feature = "threads"))]
mod sync {
    pub use loom::sync::{Arc, Mutex, RwLock, atomic};

    pub mod thread {
        pub use loom::thread::{Thread, current, park, spawn, yield_now};

        /// A sleep that may end at any moment.
        pub fn park_timeout(_span: std::time::Duration) {
            loom::thread::yield_now();
        }
    }
}

/// The runtime's own.
#[cfg(feature = "threads")]
#[path = "../../../crates/runtime/src/lock_free/sync.rs"]
mod sync;

#[path = "../../../crates/runtime/src/lock_free/callers_turn.rs"]
#[expect(dead_code, reason = "a model uses what it needs")]
mod callers_turn;
#[path = "../../../crates/runtime/src/lock_free/worker_wakeup.rs"]
mod worker_wakeup;
#[path = "../../../crates/runtime/src/lock_free/dirty_set.rs"]
mod dirty_set;
#[path = "../../../crates/runtime/src/lock_free/seqlock.rs"]
#[expect(dead_code, reason = "a model uses what it needs")]
mod seqlock;
#[path = "../../../crates/runtime/src/lock_free/slot.rs"]
#[expect(dead_code, reason = "a model uses what it needs")]
mod slot;
#[path = "../../../crates/runtime/src/lock_free/sleep.rs"]
#[expect(dead_code, reason = "a model uses what it needs")]
mod sleep;
#[path = "../../../crates/runtime/src/lock_free/table.rs"]
mod table;
#[path = "../../../agents/core/src/time.rs"]
mod time;

use worker_wakeup::WorkerWakeup;
use dirty_set::DirtySet;
use seqlock::{ReadOutcome, Seqlock};
use slot::SlotWriter;
use sleep::SleepRegistry;
use sync::atomic::{AtomicU32, Ordering};
use sync::{Arc, thread};
pub use time::{SimSpan, SimTime};

/// Stands for the agents' own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct AgentId(pub u32);

fn main() {
    check("a reader sees whole states that only rise, and the newest that was published before", slot_is_read_whole);
    check("a state that a reader keeps is never written to", slot_keeps_what_is_held);
    check("a state that is written and not yet shown is not written to again while it is kept", slot_leaves_what_is_kept);
    check("who takes the news of a state sees it, and no news is lost", news_come_after_the_state);
    check("nobody sleeps through a summons", no_worker_sleeps_through_a_notification);
    check("words are read whole or not at all, and newer ones after those that were seen", words_are_read_whole);
    check("who goes to rest is summoned by whoever wakes it meanwhile", a_wake_meets_a_rest);
    check("who goes to rest is summoned by whoever touches it meanwhile", a_touch_meets_a_rest);
    check("who leads another is summoned by whoever wakes that one meanwhile", a_wake_of_one_who_is_led_meets_a_rest);
    check("what was said before a wake is seen by the turn that heeds it, or the wake stands", a_wake_meets_a_turn);
}

/// Holds a claim against so many runs on real threads.
#[cfg(feature = "threads")]
fn check(claim: &str, model: fn()) {
    const RUNS: u32 = 2000;
    (0..RUNS).for_each(|_| model());
    println!("held {RUNS} times: {claim}");
}

/// Holds a claim against every run in which threads are stopped in the middle at most twice.
#[cfg(not(feature = "threads"))]
fn check(claim: &str, model: fn()) {
    let mut checked = loom::model::Builder::new();
    checked.preemption_bound = Some(2);
    checked.check(model);
    println!("holds: {claim}");
}

/// Publishes two numbers, both the same: a torn state would have two.
fn publish(writer: &mut SlotWriter<[u32; 2]>, value: u32) {
    writer.fill(|state| *state = [value; 2]);
    assert!(writer.publish(), "a cell is free");
}

fn slot_is_read_whole() {
    let mut writer = SlotWriter::new([0; 2]);
    let slot = writer.slot();
    let writing = thread::spawn(move || {
        // more than there are cells: the last ones lie where the first ones lay
        (1..=5).for_each(|value| publish(&mut writer, value));
    });
    let [first, second] = [(); 2].map(|()| {
        let [a, b] = *slot.latest();
        assert_eq!(a, b, "torn");
        a
    });
    assert!(second >= first, "{second} after {first}: a state was seen before it was published");
    writing.join().unwrap();
    assert_eq!(slot.latest()[0], 5);
}

fn slot_keeps_what_is_held() {
    let mut writer = SlotWriter::new([0; 2]);
    let slot = writer.slot();
    let reader = thread::spawn(move || {
        let held = slot.latest();
        let before = *held;
        thread::yield_now();
        assert_eq!(*held, before);
    });
    (1..=3).for_each(|value| publish(&mut writer, value));
    reader.join().unwrap();
}

fn slot_leaves_what_is_kept() {
    let mut writer = SlotWriter::new([0; 2]);
    writer.fill(|state| *state = [1; 2]);
    // as a checkpoint does that is taken between two turns
    let kept = Arc::clone(writer.filled_mut().as_ref().unwrap());
    let keeper = thread::spawn(move || {
        assert_eq!(*kept, [1; 2]);
        thread::yield_now();
        assert_eq!(*kept, [1; 2]);
    });
    writer.fill(|state| *state = [2; 2]);
    assert!(writer.publish(), "a cell is free");
    (3..=4).for_each(|value| publish(&mut writer, value));
    keeper.join().unwrap();
    assert_eq!(*writer.slot().latest(), [4; 2]);
}

fn news_come_after_the_state() {
    let (set, state) = (Arc::new(DirtySet::default()), Arc::new(AtomicU32::new(0)));
    set.reach(2);
    let teller = {
        let (set, state) = (Arc::clone(&set), Arc::clone(&state));
        thread::spawn(move || {
            for value in 1..=2 {
                state.store(value, Ordering::Relaxed);
                set.mark(AgentId(1));
            }
        })
    };
    let mut seen = 0;
    set.take(|_| seen = state.load(Ordering::Relaxed));
    teller.join().unwrap();
    // whatever was missed is there now
    set.take(|_| seen = state.load(Ordering::Relaxed));
    assert_eq!(seen, 2);
}

fn no_worker_sleeps_through_a_notification() {
    let wakeup = Arc::new(WorkerWakeup::new(1, 1));
    let worker = {
        let wakeup = Arc::clone(&wakeup);
        thread::spawn(move || {
            wakeup.register(0);
            let mut answered = 0;
            while answered == 0 {
                // without end: a summons that is lost leaves it asleep, which the checker finds
                wakeup.sleep(0, None);
                answered += wakeup.take_notified(|_| ());
            }
        })
    };
    wakeup.notify(AgentId(0));
    worker.join().unwrap();
}

fn words_are_read_whole() {
    let lock = Arc::new(Seqlock::<2>::new());
    let writer = {
        let lock = Arc::clone(&lock);
        thread::spawn(move || (1..=2).for_each(|value| lock.write([value; 2])))
    };
    let mut last = 0;
    for _ in 0..2 {
        if let ReadOutcome::Complete([a, b]) = lock.read() {
            assert_eq!(a, b, "torn");
            assert!(a >= last, "{a} after {last}");
            last = a;
        }
    }
    writer.join().unwrap();
    assert_eq!(lock.read(), ReadOutcome::Complete([2, 2]));
}

const LEADER: AgentId = AgentId(0);
const LED: AgentId = AgentId(1);

/// One goes to rest, and leads another, while `disturb` does something about it: in the end it must not rest unsummoned.
fn meets_a_rest(disturb: fn(&SleepRegistry)) {
    let sleep = Arc::new(SleepRegistry::new(2));
    let disturber = {
        let sleep = Arc::clone(&sleep);
        thread::spawn(move || disturb(&sleep))
    };
    // it takes in the one it leads, then it lies down
    sleep.follow(LED, Some(LEADER));
    let rests = sleep.try_rest(LEADER, std::iter::once(LED), SimTime::ZERO);
    disturber.join().unwrap();
    let summoned = sleep.take_notified();
    assert!(!rests || summoned, "it sleeps for good");
    assert!(!rests || sleep.take_wake(LEADER), "it would lie down again");
}

fn a_wake_meets_a_rest() {
    meets_a_rest(|sleep| sleep.wake(LEADER));
}

fn a_touch_meets_a_rest() {
    meets_a_rest(|sleep| sleep.touch(LEADER, SimTime::ZERO));
}

fn a_wake_of_one_who_is_led_meets_a_rest() {
    meets_a_rest(|sleep| sleep.wake(LED));
}

fn a_wake_meets_a_turn() {
    let (sleep, letter) = (Arc::new(SleepRegistry::new(1)), Arc::new(AtomicU32::new(0)));
    let sender = {
        let (sleep, letter) = (Arc::clone(&sleep), Arc::clone(&letter));
        thread::spawn(move || {
            letter.store(1, Ordering::Relaxed);
            sleep.wake(LEADER);
        })
    };
    sleep.clear_wake(LEADER);
    let read = letter.load(Ordering::Relaxed) == 1;
    sender.join().unwrap();
    assert!(read || sleep.is_woken(LEADER), "the letter lies unread");
}
