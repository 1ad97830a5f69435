//! How do 180 random stacks fare, at mixed and at equal rates? Prints those that fail, counts of faults, and what a simulated second takes.
//!
//! `random_stacks [last seed] [rate in Hz, or mixed] [first seed]`

#[path = "../tests/clusters/bodies.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod bodies;
#[path = "../tests/clusters/stacks.rs"]
mod stacks;
#[path = "../tests/clusters/table.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod table;

use stacks::{Outcome, Rates, play, stack};
use std::time::Instant;

const SECONDS: f64 = 2.0;

fn main() {
    let mut words = std::env::args().skip(1);
    let last: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(180);
    let rate = words.next();
    let first: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(1);
    let all = [("mixed", Rates::Mixed), ("60", Rates::Equal(60.0)), ("240", Rates::Equal(240.0))];
    for (name, rates) in all.into_iter().filter(|(name, _)| rate.as_deref().is_none_or(|rate| rate == *name)) {
        let started = Instant::now();
        let mut outcomes = vec![];
        for seed in first..=last {
            let outcome = play(&mut stack(seed, rates), SECONDS);
            if outcome.faults.any() || outcome.deepest_m > 2e-3 || outcome.gain_j > 0.02 {
                println!("{name:5} {seed:3} {outcome:?}");
            }
            outcomes.push(outcome);
        }
        let count = |of: fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| of(outcome)).count();
        let sum = |of: fn(&Outcome) -> u32| f64::from(outcomes.iter().map(of).sum::<u32>());
        let (fine_steps, solves) = (sum(|o| o.fine_steps), sum(|o| o.solves));
        println!(
            "{name:5}: {} stacks, {} deeper than 8 mm, {} than 4 mm at the end, {} gain 0.1 J, {} thrown, {} through; \
             factors {:.2} a fine step, convex {:.2} %, cut {:.2} % of solves; {:.3} s a simulated second",
            outcomes.len(),
            count(|o| o.faults.deep),
            count(|o| o.faults.stays_deep),
            count(|o| o.faults.gains),
            count(|o| o.faults.thrown),
            count(|o| o.faults.through),
            sum(|o| o.factors) / fine_steps,
            100.0 * sum(|o| o.convex) / solves,
            100.0 * sum(|o| o.cut) / solves,
            started.elapsed().as_secs_f64() / (SECONDS * outcomes.len() as f64),
        );
    }
}
