//! Claims about agents in real time, held against every executor that keeps it.

use super::testing::{Dummy, Fault, Log, eventually, holders, on_every_executor, system};
use crate::{AgentState, Clock, Command, ManualClock, Run, TimelineCommand};
use metachron_core::{AgentId, Archive, Resolution, SimSpan, SimTime};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};
use std::time::Duration;

#[test]
fn every_agent_steps_on_its_own_and_the_end_joins_them() {
    on_every_executor(|start| {
        let run = start([30.0, 240.0, 1000.0].map(|hz| Dummy::new(1.0).at(hz)).into(), system());
        eventually("50 steps of each", || run.agents().iter().all(|a| a.stats().steps >= 50));
        let kept = run.agents()[0].clone();
        let stats = run.shutdown();
        assert!(stats.iter().all(|s| s.steps >= 50 && s.state == AgentState::Running && s.cpu_s > 0.0));
        assert_eq!(kept.latest().steps, stats[0].steps, "the last state outlives the run");
        assert_eq!(holders(&kept), 1, "every thread has let go of its agent");
    });
}

#[test]
fn a_broken_agent_is_parked_and_the_others_go_on() {
    on_every_executor(|start| {
        for fault in [Fault::Panic, Fault::NotFinite, Fault::Diverged] {
            let broken = Dummy { fault: Some((3, fault)), ..Dummy::new(1.0) };
            let run = start(vec![broken.at(500.0), Dummy::new(1.0).at(500.0)], system());
            eventually("the fault", || matches!(run.agents()[0].state(), AgentState::Parked(_)));
            let before = run.agents()[1].stats().steps;
            eventually("20 steps after it", || run.agents()[1].stats().steps >= before + 20);
            let stats = run.shutdown();
            assert_eq!((stats[0].steps, &stats[1].state), (2, &AgentState::Running));
        }
    });
}

#[test]
fn an_agent_at_rest_wakes_for_a_command_and_for_a_touch() {
    on_every_executor(|start| {
        let sleepy = Dummy { rest_from: Some(5), ..Dummy::new(1.0) };
        let late = Dummy { touches: Some((1, AgentId(0))), rest_from: Some(1), ..Dummy::new(1.0) };
        let run = start(vec![sleepy.at(500.0), late.at(500.0)], system());
        let agent = run.agents()[0].clone();
        eventually("both at rest", || run.agents().iter().all(|a| a.state() == AgentState::Resting));
        let steps = agent.stats().steps;
        agent.send(Command::resolution(Resolution { eps_m: 0.07, n: 3 })).unwrap();
        eventually("the command", || agent.latest().resolution.is_some_and(|r| r.eps_m == 0.07));
        assert!(agent.stats().steps > steps);
        eventually("rest again", || agent.state() == AgentState::Resting);
        let steps = agent.stats().steps;
        run.agents()[1].send(Command::wake()).unwrap();
        eventually("the touch", || agent.stats().steps > steps);
        run.shutdown();
    });
}

#[test]
fn no_agent_runs_ahead_of_a_clock_that_stands_still() {
    on_every_executor(|start| {
        let clock = Arc::new(ManualClock::new());
        let spawns = vec![Dummy::new(1.0).at(250.0), Dummy::new(1.0).at(100.0)];
        let mut run = start(spawns, Arc::clone(&clock) as Arc<dyn Clock>);
        let covered = |run: &dyn Run, ms: u64| {
            let end = SimTime::from_nanos(ms * 1_000_000);
            eventually("the present is covered", || run.agents().iter().all(|a| a.latest().time >= end));
        };
        for step in 1..=20 {
            clock.advance(Duration::from_millis(20));
            covered(&*run, step * 20);
        }
        run.drive(TimelineCommand::Pause);
        clock.advance(Duration::from_secs(5));
        assert_eq!(run.sim_now(), SimTime::from_nanos(400_000_000));
        run.drive(TimelineCommand::Step(SimSpan::from_nanos(20_000_000)));
        clock.advance(Duration::from_secs(5));
        covered(&*run, 420);
        assert_eq!(run.sim_now(), SimTime::from_nanos(420_000_000));
        let agents: Vec<_> = run.agents().to_vec();
        run.shutdown();
        for agent in agents {
            assert!(agent.latest().time <= SimTime::from_nanos(420_000_000), "a step after the timeline stopped");
        }
    });
}

#[test]
fn a_lag_past_the_cap_is_dropped_once_and_the_agent_is_on_time_again() {
    on_every_executor(|start| {
        let clock = Arc::new(ManualClock::new());
        let run = start(vec![Dummy::new(1.0).at(250.0)], Arc::clone(&clock) as Arc<dyn Clock>);
        let agent = run.agents()[0].clone();
        eventually("the first step", || agent.stats().steps >= 1);
        clock.advance(Duration::from_secs(3));
        eventually("the present is covered", || agent.latest().time >= SimTime::from_nanos(3_000_000_000));
        let stats = run.shutdown().remove(0);
        assert_eq!(stats.dropped, SimSpan::from_nanos(2_996_000_000), "3 s less the step that was made");
        assert_eq!(stats.steps, 2);
    });
}

/// A clock that can be set back: [`Clock`] forbids it, a broken machine does it.
#[derive(Default)]
struct BrokenClock(AtomicU64);

impl Clock for BrokenClock {
    fn now(&self) -> Duration {
        Duration::from_millis(self.0.load(SeqCst))
    }
}

#[test]
fn a_clock_that_falls_back_holds_agents_until_it_is_where_it_was_and_costs_them_nothing() {
    on_every_executor(|start| {
        let (clock, rates) = (Arc::new(BrokenClock::default()), [250.0, 100.0]);
        let run = start(rates.map(|hz| Dummy::new(1.0).at(hz)).into(), Arc::clone(&clock) as Arc<dyn Clock>);
        let ms = |n: u64| SimTime::from_nanos(n * 1_000_000);
        for (wall_ms, reached_ms) in [(40, 40), (15, 40), (30, 40), (60, 60)] {
            clock.0.store(wall_ms, SeqCst);
            let made = |a: &crate::AgentHandle| a.latest().time;
            eventually("what was released is made", || run.agents().iter().all(|a| made(a) >= ms(reached_ms)));
            // the step released at the latest time ever shown is the last one
            assert!(run.agents().iter().zip([4, 10]).all(|(a, dt)| made(a) <= ms(reached_ms + dt)), "at {wall_ms} ms");
        }
        let kept = run.agents().to_vec();
        for (agent, stats) in kept.iter().zip(run.shutdown()) {
            assert_eq!((stats.dropped, &stats.state), (SimSpan::ZERO, &AgentState::Running));
            assert_eq!(agent.latest().time.as_nanos(), stats.steps * stats.dt.as_nanos());
        }
    });
}

#[test]
fn a_run_that_is_dropped_ends_its_threads() {
    on_every_executor(|start| {
        let run =
            start(vec![Dummy::new(1.0).at(500.0), Dummy { rest_from: Some(1), ..Dummy::new(1.0) }.at(500.0)], system());
        let kept: Vec<_> = run.agents().to_vec();
        drop(run);
        assert!(kept.iter().all(|a| holders(a) == 1));
    });
}

#[test]
fn of_those_that_joined_and_left_nothing_is_kept_but_their_numbers() {
    on_every_executor(|start| {
        let (log, mut crowd) = (Log::default(), VecDeque::new());
        let mut run = start(vec![Dummy::new(1.0).at(100.0)], system());
        for _ in 0..500 {
            crowd.push_back(run.add(Dummy::member(1.0, &log).at(1000.0)).unwrap().id());
            if crowd.len() > 3 {
                run.remove(crowd.pop_front().unwrap()).unwrap();
            }
        }
        crowd.into_iter().for_each(|id| run.remove(id).unwrap());
        let left = || run.agents().iter().skip(1);
        eventually("their models are freed", || Arc::strong_count(&log) == 1);
        assert!(left().all(|agent| agent.live().is_none() && agent.state() == AgentState::Gone));
        assert_eq!((left().count(), run.agents()[0].state()), (500, AgentState::Running));
    });
}

#[test]
fn a_cut_waits_for_the_steps_in_progress_however_long_they_take() {
    on_every_executor(|start| {
        let log = Log::default();
        let slow = Dummy { fault: Some((3, Fault::Slow)), log: Some(Arc::clone(&log)), ..Dummy::new(1.0) };
        let mut run = start(vec![Dummy::new(1.0).at(500.0), slow.at(500.0)], system());
        eventually("its slow step", || log.lock().unwrap().len() == 3);
        // whether its model can be saved is another matter
        let _ = run.save(&mut Archive::writer());
        eventually("it goes on", || run.agents()[1].stats().steps > 5);
        run.shutdown().iter().for_each(|stats| assert_eq!(stats.state, AgentState::Running));
    });
}

#[test]
fn the_end_of_a_run_waits_for_no_step_that_never_returns() {
    on_every_executor(|start| {
        let log = Log::default();
        let hung = Dummy { fault: Some((3, Fault::Hang)), log: Some(Arc::clone(&log)), ..Dummy::new(1.0) };
        let run = start(vec![Dummy::new(1.0).at(500.0), hung.at(500.0)], system());
        eventually("it hangs", || log.lock().unwrap().len() == 3);
        let stats = run.shutdown();
        assert_eq!((&stats[0].state, stats[1].steps), (&AgentState::Running, 2));
        assert_eq!(stats[1].state, AgentState::Parked("a step did not end within 0.4 s".into()));
    });
}
