//! Claims about pools alone; `live_tests.rs` holds the claims about every executor.

use super::super::testing::{Dummy, Fault, Log, eventually, running, system};
use super::*;
use crate::lock_free::sleep::SleepRegistry;
use crate::records::governor::{Demand, Governor, TurnMeasure};
use crate::{AgentHandle, AgentState, Command};
use metachron_core::{AgentId, SimTime};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

fn pool(spawns: Vec<AgentSpawn>, workers: usize, limit: Duration) -> Box<Pool> {
    running(Pool::with_workers(spawns, system(), workers, StallLimit::of(limit), Priority::Normal).unwrap())
}

const LONG: Duration = Duration::from_secs(60);
const SHORT: Duration = Duration::from_millis(200);

fn stalled(agent: &AgentHandle) -> bool {
    agent.state() == AgentState::Stalled
}

#[test]
fn a_step_that_never_returns_stalls_its_agent_only() {
    for workers in [1, 3] {
        let hung = |step| Dummy { fault: Some((step, Fault::Hang)), ..Dummy::new(1.0) };
        let mut spawns: Vec<_> = (0..20).map(|_| Dummy::new(1.0).at(200.0)).collect();
        // more of them than workers
        (0..4).for_each(|k| spawns[5 * k] = hung(3 + k as u64).at(200.0));
        let run = pool(spawns, workers, SHORT);
        let is_hung = |at: usize| at.is_multiple_of(5);
        let each = |wanted: bool| run.agents().iter().enumerate().filter(move |(at, _)| is_hung(*at) == wanted);
        eventually("all four are stalled", || each(true).all(|(_, agent)| stalled(agent)));
        let before = run.agents().iter().map(|a| a.stats().steps).collect::<Vec<_>>();
        eventually("the others go on", || each(false).all(|(at, a)| a.stats().steps >= before[at] + 20));
        let stats = run.shutdown();
        for (at, agent) in stats.iter().enumerate() {
            let state = AgentState::Parked("a step did not end within 0.4 s".into());
            assert_eq!(agent.state, if is_hung(at) { state } else { AgentState::Running }, "{at} of {workers}");
        }
    }
}

#[test]
fn agents_led_by_a_hung_agent_are_stalled_with_it() {
    let log = Log::default();
    let bonded = |id: u32| Dummy { fault: (id == 0).then_some((100, Fault::Hang)), ..Dummy::member(1.0, &log) };
    let mut spawns: Vec<_> = (0..3).map(|id| bonded(id).at(500.0)).collect();
    spawns.push(Dummy::new(1.0).at(500.0));
    let run = pool(spawns, 2, SHORT);
    eventually("they are one", || run.agents().iter().skip(1).take(2).all(|a| a.led_by() == Some(AgentId(0))));
    eventually("all three are stalled", || run.agents().iter().take(3).all(stalled));
    let before = run.agents()[3].stats().steps;
    eventually("an unrelated agent goes on", || run.agents()[3].stats().steps >= before + 20);
    assert_eq!(run.shutdown()[3].state, AgentState::Running);
}

#[test]
fn one_worker_is_enough_for_a_thousand_and_none_starves() {
    let run = pool((0..1000).map(|k| Dummy::new(1.0).at(5.0 + f64::from(k % 7))).collect(), 1, LONG);
    eventually("three turns of each", || run.agents().iter().all(|a| a.stats().steps >= 3));
    let stats = run.shutdown();
    assert!(stats.iter().all(|s| s.state == AgentState::Running));
}

#[test]
fn an_idle_worker_makes_the_turns_that_a_busy_one_cannot() {
    let log = Log::default();
    let logged = || Dummy { log: Some(Arc::clone(&log)), ..Dummy::new(1.0) };
    let hung = Dummy { fault: Some((3, Fault::Hang)), ..logged() };
    let mut spawns = vec![hung.at(100.0)];
    spawns.extend((1..8).map(|_| logged().at(100.0)));
    let run = pool(spawns, 2, LONG);
    eventually("all others go on", || run.agents().iter().skip(1).all(|a| a.stats().steps >= 20));
    drop(run);
    let threads: BTreeSet<_> = log.lock().unwrap().iter().map(|made| made.thread.clone()).collect();
    assert_eq!(threads.into_iter().collect::<Vec<_>>(), ["pool:0", "pool:1"]);
}

#[test]
fn thousands_of_sleepers_wake_at_once_and_sleep_again() {
    let sleepy = |_| Dummy { rest_from: Some(2), ..Dummy::new(1.0) }.at(1000.0);
    let run = pool((0..3000).map(sleepy).collect(), 2, LONG);
    let all_rest = |steps: u64| {
        let done = |a: &AgentHandle| a.state() == AgentState::Resting && a.latest().steps >= steps;
        eventually("all rest", || run.agents().iter().all(done));
    };
    all_rest(2);
    for round in 1..=3 {
        run.agents().iter().for_each(|agent| agent.send(Command::wake()).unwrap());
        all_rest(2 + round);
    }
    // a wake may find an agent ahead of the present, which has no rest behind it
    let stats = run.shutdown();
    assert!(stats.iter().all(|s| s.steps >= 5) && stats.iter().any(|s| s.rested.as_nanos() > 0));
}

#[test]
fn a_pause_holds_thousands_and_a_step_moves_them_by_its_span() {
    let mut run = pool((0..1000).map(|_| Dummy::new(1.0).at(100.0)).collect(), 2, LONG);
    eventually("all run", || run.agents().iter().all(|a| a.stats().steps >= 1));
    run.drive(TimelineCommand::Pause);
    let stopped = run.sim_now();
    let span = SimTime::from_nanos(50_000_000).since(SimTime::ZERO);
    run.drive(TimelineCommand::Step(span));
    let end = stopped + span;
    eventually("the step is made", || run.agents().iter().all(|a| a.latest().time >= end));
    // the step's states may be there before its time has come
    assert!(run.sim_now() <= end);
    let kept = run.agents().to_vec();
    run.shutdown();
    // a step that begins before the end ends after it, by less than its own length
    let last = end + SimTime::from_nanos(10_000_000).since(SimTime::ZERO);
    assert!(kept.iter().all(|a| a.latest().time < last));
}

#[test]
fn an_empty_run_begins_and_ends() {
    let run = pool(Vec::new(), 4, LONG);
    assert!(run.agents().is_empty());
    assert!(run.shutdown().is_empty());
}

/// A governor that is still in a turn when the run is to be cut, and saves nothing.
struct Lingers(Arc<SleepRegistry>, Arc<AtomicBool>);

impl Governor for Lingers {
    fn after_step(&mut self, _: &TurnMeasure) -> Demand {
        while self.1.load(Relaxed) && !self.0.stopping() {
            thread::yield_now();
        }
        if self.1.swap(false, Relaxed) {
            // the other workers end meanwhile
            thread::sleep(SHORT);
        }
        Demand::default()
    }

    fn archive(&mut self, _: &mut Archive<'_>) -> Result<(), ArchiveError> {
        Ok(())
    }
}

#[test]
fn a_cut_waits_for_a_late_turn_that_has_ended_but_for_its_governor() {
    let late = || Dummy { fault: Some((3, Fault::Slow)), ..Dummy::new(1.0) };
    let mut run = pool(vec![Dummy::new(1.0).at(200.0)], 2, SHORT);
    let lingers = Arc::new(AtomicBool::new(false));
    let governor = Box::new(Lingers(Arc::clone(&run.all.sleep), Arc::clone(&lingers)));
    let spawn = AgentSpawn { governor: Some(governor), ..late().at(200.0) };
    let id = run.add(spawn).unwrap().id();
    eventually("its step lasts too long", || stalled(&run.agents()[id.0 as usize]));
    lingers.store(true, Relaxed);
    eventually("its step ends", || !stalled(&run.agents()[id.0 as usize]));
    run.save(&mut Archive::writer()).unwrap();
    assert!(!lingers.load(Relaxed), "it was in its turn");
    let before = run.agents()[id.0 as usize].steps();
    eventually("it goes on", || run.agents()[id.0 as usize].steps() > before);
}
