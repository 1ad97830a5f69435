//! What only threads do; `live_tests.rs` holds what every executor does.

use super::super::SystemClock;
use super::super::testing::{Dummy, eventually, running};
use super::*;

#[test]
fn too_many_agents_for_threads_are_refused() {
    let spawns = (0..=THREADS_MAX).map(|_| Dummy::new(1.0).at(1.0)).collect();
    let Err(error) = Threads::start(spawns, Arc::new(SystemClock::new()), Priority::Normal) else { panic!("accepted") };
    assert!(matches!(error, RunError::TooMany { agents: 1001, most: 1000 }), "{error}");
}

#[test]
fn threads_of_those_that_have_left_are_joined() {
    let first = vec![Dummy::new(1.0).at(60.0)];
    let mut run = *running(Threads::start(first, Arc::new(SystemClock::new()), Priority::Normal).unwrap());
    for _ in 0..20 {
        let id = run.add(Dummy::new(1.0).at(500.0)).unwrap().id();
        run.remove(id).unwrap();
    }
    eventually("they have left", || run.agents().iter().skip(1).all(|agent| agent.live().is_none()));
    while run.threads.len() > 1 {
        run.join_ended();
        thread::yield_now();
    }
    assert!(run.ended_agents.is_empty());
}

#[test]
fn threads_carry_the_names_of_their_agents() {
    let run = Threads::start(vec![Dummy::new(1.0).at(60.0)], Arc::new(SystemClock::new()), Priority::Normal).unwrap();
    let names: Vec<_> = run.threads.values().filter_map(|t| t.thread.thread().name()).collect();
    assert_eq!(names, ["agent:dummy at 60"]);
}
