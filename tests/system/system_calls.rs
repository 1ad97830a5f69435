//! The system calls of threads that make turns: to wait for the next one, and next to nothing else.
//!
//! `strace` writes down every call of the program's threads, which have names. Where it is not installed, or may not trace,
//! these tests say so and pass, unless `METACHRON_REQUIRE_STRACE=1`.

use crate::play::{Folder, cleaned, number, program};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsStr;

/// Eight agents of next to no work, a tube that swings and a ball that falls, at 200 Hz each.
fn company() -> Folder {
    let cheap =
        |k: u32| format!("[[object]]\nname = \"cheap{k}\"\nmodel = \"synthetic\"\ncost_us = 5\nrate_hz = 200\n");
    let tube = "[[object]]\nname = \"tube\"\nmodel = \"tube\"\npath_m = [[0, 0, 1], [1, 0, 1]]\nclamp = [\"start\"]\n\
                radius_m = 0.01\nyoung_pa = 1e6\ndensity_kg_m3 = 1e3\nsegments = 16\nrate_hz = 200\n";
    let ball = "[[object]]\nname = \"ball\"\nmodel = \"rigid\"\nshape = \"ball\"\nradius_m = 0.1\nposition_m = [5, 0, 1]\n\
                rate_hz = 200\n";
    Folder::with(&((0..8).map(cheap).collect::<String>() + tube + ball))
}

/// Whether calls can be traced here.
fn can_trace() -> bool {
    let tried = cleaned("strace").args(["-f", "-o", "/dev/null", "true"]).output();
    let can = tried.as_ref().is_ok_and(|done| done.status.success());
    let required = std::env::var("METACHRON_REQUIRE_STRACE").is_ok_and(|value| value == "1");
    assert!(can || !required, "strace is required, and does not trace: {tried:?}");
    if !can {
        eprintln!("system calls are not counted: strace is not installed, or may not trace");
    }
    can
}

/// The calls of each thread whose name begins with `called`, in their order.
fn calls<'t>(trace: &'t str, called: &str) -> Vec<Vec<&'t str>> {
    let mut threads: BTreeMap<&str, (bool, Vec<&str>)> = BTreeMap::new();
    let named = format!("prctl(PR_SET_NAME, \"{called}");
    for (thread, line) in trace.lines().filter_map(|line| line.split_once(' ')) {
        // a line that is no call is a call's end, a signal or a thread's end
        let Some((name, _)) = line.trim_start().split_once('(').filter(|(name, _)| is_name(name)) else { continue };
        let (is_one, calls) = threads.entry(thread).or_default();
        *is_one |= line.trim_start().starts_with(&named);
        calls.push(name);
    }
    threads.into_values().filter(|(is_one, _)| *is_one).map(|(_, calls)| calls).collect()
}

fn is_name(text: &str) -> bool {
    text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// Plays the company on `executor` and gives how many turns were made, and the calls of the threads that made them.
fn played(executor: &str, called: &str) -> (f64, Vec<Vec<String>>) {
    let (scene, program) = (company(), program());
    let trace = scene.file("trace");
    let traced = [OsStr::new("-f"), OsStr::new("-o"), trace.as_ref(), program.get_program()];
    let run = ["run", scene.scene(), "--headless", "--json", "-q", "--size", "16x16", "--seconds", "2"];
    let done = cleaned("strace").args(traced).args(run).args(["--executor", executor]).output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    let turns = report["agents"].as_array().unwrap().iter().map(|agent| number(agent, "/steps")).sum();
    let trace = String::from_utf8_lossy(&std::fs::read(trace).unwrap()).into_owned();
    let owned = |calls: Vec<&str>| calls.into_iter().map(str::to_owned).collect();
    (turns, calls(&trace, called).into_iter().map(owned).collect())
}

/// Of the calls of some threads, the ones that wait and the ones that do not; calls in the first and the last quarter
/// of a thread's calls do not belong to steady turns.
fn steady(threads: &[Vec<String>]) -> (usize, BTreeMap<&str, usize>) {
    let (mut waits, mut others) = (0, BTreeMap::new());
    for name in threads.iter().flat_map(|calls| &calls[calls.len() / 4..calls.len() * 3 / 4]) {
        match name.as_str() {
            // a yield is a wait of no length
            "futex" | "sched_yield" => waits += 1,
            other => *others.entry(other).or_insert(0) += 1,
        }
    }
    (waits, others)
}

/// Holds that the threads of `executor` whose names begin with `called` ask for a wait a turn at the most, and in the long run
/// for nothing else; there are no more of them than `most`.
fn only_waits(executor: &str, called: &str, most: usize) {
    if !can_trace() {
        return;
    }
    let (turns, threads) = played(executor, called);
    assert!(threads.len() <= most, "{executor}: {} threads", threads.len());
    let (waits, others) = steady(&threads);
    assert!(turns > 1000.0 && waits > 100, "{executor}: {turns} turns and {waits} waits of {} threads", threads.len());
    let all: usize = threads.iter().flatten().filter(|name| *name == "futex").count();
    // until all are there, and at the end, each waits a few times more
    assert!(all as f64 <= turns + 20.0 * threads.len() as f64, "{executor}: {all} waits in {turns} turns");
    // the clock of a thread's CPU time is read twice every 256 turns or every half second: 2 in 100 turns of 200 Hz
    let rest: usize = others.values().sum();
    assert!(rest as f64 <= turns / 25.0, "{executor}: in half of {turns} turns {others:?}");
}

#[test]
fn a_steady_turn_on_a_thread_of_its_own_asks_the_system_for_its_wait_alone() {
    only_waits("threads", "agent:", 10);
}

#[test]
fn workers_of_a_pool_ask_the_system_for_less_than_a_wait_a_turn() {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    // a worker for each, and the thread that watches over them; nobody takes the place of one that ends with the run
    only_waits("pool", "pool:", cores + 1);
}

#[test]
fn of_a_trace_every_call_of_the_threads_asked_for_is_counted() {
    let trace = "7  prctl(PR_SET_NAME, \"agent:a\") = 0\n8  prctl(PR_SET_NAME, \"frames\") = 0\n\
                 7  futex(0x1, FUTEX_WAIT_PRIVATE, 1, NULL <unfinished ...>\n8  futex(0x1, FUTEX_WAKE_PRIVATE, 1) = 1\n\
                 7  <... futex resumed>) = 0\n7  --- SIGCHLD {si_signo=SIGCHLD} ---\n7  openat(AT_FDCWD, \"a(b\") = 3\n\
                 7  +++ exited with 0 +++\n";
    assert_eq!(calls(trace, "agent:"), [["prctl", "futex", "openat"]]);
}
