//! Claims about threads alone; `live_tests.rs` holds the claims about every executor.

use super::super::archive::refuse_absent;
use super::super::testing::{Dummy, Log, eventually, running};
use super::agent_thread::CATCH_UP_MAX;
use super::*;
use crate::time::clock::ManualClock;
use crate::turn::agent_runner::Next;
use crate::{AgentState, EventKind, SystemClock};

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

#[test]
fn an_agent_that_is_behind_yields_its_core_after_a_while_and_goes_on() {
    let AssembledRun { mut actors, all } = assemble(vec![Dummy::new(1.0).at(1e5)], Helpers::none()).unwrap();
    let mut actor = actors[0].take().unwrap();
    let (clock, timeline) = (Arc::new(ManualClock::new()), Arc::new(SharedTimeline::new()));
    timeline.drive(Duration::ZERO, TimelineCommand::Run);
    clock.advance(Duration::from_millis(50));
    let (batch, awake, word) = (CpuBatch::default(), Duration::ZERO, Arc::default());
    let watchdog = Watchdog::new(&all.handles, StallLimit::default());
    let mut thread =
        AgentThread { clock, timeline, batch, order: None, awake, watchdog, word, turns: 0, given: Arc::default() };
    let mut steps_after = |awake: Duration| {
        thread.awake = awake;
        assert_eq!(thread.wait_or_turn(&mut actor), Next::Due);
        (all.handles[0].steps(), thread.awake.is_zero())
    };
    assert_eq!(steps_after(Duration::ZERO), (1, false));
    assert_eq!(steps_after(CATCH_UP_MAX), (1, true), "others come first");
    assert_eq!(steps_after(Duration::ZERO), (2, false));
}

/// With the system's slices alone, of milliseconds, one in ten of them makes all of the turns that are counted here.
#[test]
fn agents_that_are_all_behind_take_turns() {
    let spawns = (0..200).map(|_| Dummy::new(1.0).at(1e5)).collect();
    let run = running(Threads::start(spawns, Arc::new(SystemClock::new()), Priority::Normal).unwrap());
    let steps = || run.agents().iter().map(AgentHandle::steps).collect::<Vec<_>>();
    eventually("all have begun", || steps().iter().all(|made| *made > 0));
    let (before, each) = (steps(), 1000);
    let made = || steps().iter().zip(&before).map(|(now, then)| now - then).collect::<Vec<_>>();
    eventually("they have gone on", || made().iter().sum::<u64>() >= 200 * each);
    let least = made().into_iter().min();
    assert!(least >= Some(each / 10), "{least:?} of {each} turns");
}

/// A system without threads to give.
fn refuse(_: thread::Builder, _: Body) -> io::Result<JoinHandle<Option<Box<AgentRunner>>>> {
    Err(io::Error::from(io::ErrorKind::WouldBlock))
}

#[test]
fn no_agent_is_lost_where_the_system_gives_no_thread() {
    let log = Log::default();
    let mut spawns: Vec<_> = (0..3).map(|_| Dummy::new(1.0).at(200.0)).collect();
    // one of them leads the other
    spawns.extend((0..2).map(|_| Dummy::member(1.0, &log).at(200.0)));
    let mut run = *running(Threads::start(spawns, Arc::new(SystemClock::new()), Priority::Normal).unwrap());
    let steps = |run: &Threads| run.agents().iter().map(AgentHandle::steps).collect::<Vec<_>>();
    eventually("all have begun", || steps(&run).iter().all(|made| *made > 0));
    let mut reader: Vec<_> = run.agents().iter().map(AgentHandle::listen).collect();
    let given = std::mem::replace(&mut run.spawner, refuse);
    let mut archive = Archive::writer();
    run.save(&mut archive).unwrap();
    let bytes = archive.into_bytes();
    for (agent, reader) in run.agents().iter().zip(&mut reader) {
        let AgentState::Parked(reason) = agent.state() else { panic!("{:?}", agent.state()) };
        assert!(reason.contains("refused a thread for agent:"), "{reason}");
        let mut told = false;
        agent.read_events(reader, |event| told |= event.kind == EventKind::Parked);
        assert!(told, "{}", agent.name());
    }
    // nor does one that joins leave anything behind
    assert!(matches!(run.add(Dummy::new(1.0).at(200.0)), Err(RunError::NoThread { .. })));
    assert_eq!(run.agents()[5].state(), AgentState::Gone);
    // they come back with a state that is read
    run.spawner = given;
    run.archive(&mut Archive::reader(&bytes), &mut refuse_absent).unwrap();
    let before = steps(&run);
    eventually("they go on", || steps(&run).iter().zip(&before).take(5).all(|(now, then)| now > then));
    assert!(run.agents().iter().take(5).all(|agent| agent.state() == AgentState::Running));
}
