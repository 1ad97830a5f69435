//! How often is a world lost, and an object parked, where it is saved and put back while objects join, leave and jump, and where eight threads call
//! it at once?
//!
//! `cargo run --release -p metachron-world --example rewinds -- CHECKPOINTS RESTORES SECONDS [EXECUTOR]`: so many on each executor, or on that
//! one, then so long with eight threads. It ends with an error where a world was lost, an object parked, or a thread did not return.

mod driver;

use driver::{Amount, Tally, churn, storm};
use metachron_world::kinds::ExecutorKind;
use std::time::{Duration, Instant};

fn main() -> Result<(), String> {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|text| text.parse().ok()).collect();
    let [checkpoints, restores, seconds] = numbers[..] else {
        return Err("expected CHECKPOINTS RESTORES SECONDS, three whole numbers".to_owned());
    };
    let only = std::env::args().nth(4);
    let name = |executor: ExecutorKind| format!("{executor:?}").to_lowercase();
    println!("what    executor  checkpoints  restores  changes    calls  wall s  lost  parked");
    let mut faults = 0;
    let mut executors = vec![ExecutorKind::Threads, ExecutorKind::Pool, ExecutorKind::Lockstep];
    executors.retain(|executor| only.as_ref().is_none_or(|only| *only == name(*executor)));
    if executors.is_empty() {
        return Err(format!("the executor is {}; expected threads, pool or lockstep", only.unwrap_or_default()));
    }
    for executor in executors {
        let began = Instant::now();
        if checkpoints > 0 {
            let amount = Amount { checkpoints, restores: restores.max(1), change_every: 16 };
            faults += print("churn", executor, &churn(executor, amount, 1), began);
        }
        let began = Instant::now();
        if seconds > 0 {
            let tally = storm(executor, 8, u64::MAX, Duration::from_secs(seconds), 1);
            faults += print("storm", executor, &tally, began);
        }
    }
    if faults == 0 { Ok(()) } else { Err(format!("{faults} faults")) }
}

/// Prints a line, and the failures; how many these were.
fn print(what: &str, executor: ExecutorKind, tally: &Tally, began: Instant) -> usize {
    let Tally { checkpoints, restores, changes, calls, lost, parked } = tally;
    println!(
        "{what:<7} {:<9} {checkpoints:>11} {restores:>9} {changes:>8} {calls:>8} {:>7.1} {:>5} {:>7}",
        format!("{executor:?}").to_lowercase(),
        began.elapsed().as_secs_f64(),
        lost.len(),
        parked.len()
    );
    lost.iter().chain(parked).for_each(|fault| println!("  {fault}"));
    lost.len() + parked.len()
}
