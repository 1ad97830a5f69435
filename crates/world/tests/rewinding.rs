//! Worlds that go back: however often, whatever joins, leaves and jumps meanwhile and whoever calls, no world is lost and no object parked; what
//! is refused changes nothing; readers of events learn that the world went back.

#[path = "../examples/rewinds/driver.rs"]
mod driver;

use driver::{Amount, Tally, churn, storm};
use metachron_world::kinds::ExecutorKind;
use std::time::Duration;

const EXECUTORS: [ExecutorKind; 3] = [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool];

fn nothing_wrong(executor: ExecutorKind, tally: &Tally) {
    assert!(tally.lost.is_empty() && tally.parked.is_empty(), "{executor:?}: {tally:?}");
}

#[test]
fn no_checkpoint_and_no_way_back_loses_a_world_or_an_object() {
    for executor in EXECUTORS {
        let amount = Amount { checkpoints: 1500, restores: 300, change_every: 3 };
        let tally = churn(executor, amount, 11);
        assert_eq!((tally.checkpoints, tally.restores), (1500, 300), "{executor:?}: {tally:?}");
        nothing_wrong(executor, &tally);
    }
}

#[test]
fn eight_threads_call_whatever_they_like() {
    for executor in EXECUTORS {
        let tally = storm(executor, 8, 400, Duration::from_secs(60), 3);
        assert!(tally.restores > 0 && tally.changes > 0, "{executor:?}: {tally:?}");
        nothing_wrong(executor, &tally);
    }
}
