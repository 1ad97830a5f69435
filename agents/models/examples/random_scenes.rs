//! How do random scenes fare? Prints the scenes that fail, counts of faults, and the cost of a simulated second.
//!
//! `random_scenes [stacks-mixed | stacks-60 | stacks-240 | pairs | tips | piles] [last number] [first number]`

#[path = "../tests/clusters/bodies.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod bodies;
#[path = "../tests/clusters/sets.rs"]
mod sets;
#[path = "../tests/clusters/stacks.rs"]
mod stacks;
#[path = "../tests/clusters/table.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod table;

use sets::{PAIRS, PILES, TIPS, Verdict};
use stacks::{Outcome, Rates, play, stack};
use std::time::Instant;

const SECONDS: f64 = 2.0;
const STACKS: u64 = 180;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, otherwise: u64| words.get(at).and_then(|word| word.parse().ok()).unwrap_or(otherwise);
    let is_asked = |name: &str| words.first().is_none_or(|word| word == name);
    let all = [("stacks-mixed", Rates::Mixed), ("stacks-60", Rates::Equal(60.0)), ("stacks-240", Rates::Equal(240.0))];
    for (name, rates) in all.into_iter().filter(|(name, _)| is_asked(name)) {
        play_stacks(name, rates, number(2, 1)..=number(1, STACKS));
    }
    type Set = (&'static str, fn(u64) -> Verdict, u64);
    let sets: [Set; 3] = [("pairs", sets::pair, PAIRS), ("tips", sets::tip, TIPS), ("piles", sets::pile, PILES)];
    for (name, of, count) in sets.into_iter().filter(|(name, ..)| is_asked(name)) {
        play_set(name, of, number(2, 0)..number(1, count));
    }
}

fn play_set(name: &str, of: fn(u64) -> Verdict, numbers: std::ops::Range<u64>) {
    let started = Instant::now();
    let verdicts: Vec<(u64, Verdict)> = numbers.map(|number| (number, of(number))).collect();
    for (number, Verdict { deepest_m, end_m, gain_j, .. }) in verdicts.iter().filter(|(_, verdict)| verdict.is_bad()) {
        println!(
            "{name} {number:4}: {:.1} mm deep, {:.1} at the end, {gain_j:.3} J made",
            deepest_m * 1e3,
            end_m * 1e3
        );
    }
    let count = |of: fn(&Verdict) -> bool| verdicts.iter().filter(|(_, verdict)| of(verdict)).count();
    let seconds = started.elapsed().as_secs_f64();
    println!(
        "{name}: {} scenes, {} deeper than 8 mm, {} than 5 mm at the end, {} fly, fall through or gain; {seconds:.0} s",
        verdicts.len(),
        count(Verdict::is_deep),
        count(Verdict::stays_deep),
        count(Verdict::flies),
    );
}

fn play_stacks(name: &str, rates: Rates, seeds: std::ops::RangeInclusive<u64>) {
    let started = Instant::now();
    let mut outcomes = vec![];
    for seed in seeds {
        let outcome = play(&mut stack(seed, rates), SECONDS);
        if outcome.faults.any() || outcome.deepest_m > 2e-3 || outcome.gain_j > 0.02 {
            println!("{name} {seed:3} {outcome:?}");
        }
        outcomes.push(outcome);
    }
    let count = |of: fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| of(outcome)).count();
    let sum = |of: fn(&Outcome) -> u32| f64::from(outcomes.iter().map(of).sum::<u32>());
    let (fine_steps, solves) = (sum(|o| o.fine_steps), sum(|o| o.solves));
    println!(
        "{name}: {} stacks, {} deeper than 8 mm, {} than 4 mm at the end, {} gain 0.1 J, {} thrown, {} through; \
         factors {:.2} a fine step, unfinished {:.2} % of solves; {:.3} s a simulated second",
        outcomes.len(),
        count(|o| o.faults.deep),
        count(|o| o.faults.stays_deep),
        count(|o| o.faults.gains),
        count(|o| o.faults.thrown),
        count(|o| o.faults.through),
        sum(|o| o.factors) / fine_steps,
        100.0 * sum(|o| o.unfinished) / solves,
        started.elapsed().as_secs_f64() / (SECONDS * outcomes.len() as f64),
    );
}
