//! Agents that are led lose no step and make none twice, wherever they are.

use super::super::{AgentHandle, AgentSpawn, AgentState, AgentStats, Command, Machine, Run, WatchedPoint, state_hash};
use crate::executors::lockstep::Lockstep;
use crate::executors::testing::{
    Dummy, Fault, Log, RecordedStep, Swing, eventually, holders, on_every_executor, system,
};
use metachron_contact::detect::ClusterScene;
use metachron_contact::joint::{Joint, JointKind};
use metachron_core::{AgentId, Resolution, SimSpan, SimTime};
use std::cell::{Cell, RefCell};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

const fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

const RATES: [f64; 6] = [240.0, 1000.0, 60.0, 240.0, 37.0, 500.0];

/// Members that stay at one place.
fn close(log: &Log) -> Vec<AgentSpawn> {
    RATES.iter().map(|hz| named(Dummy::member(20.0, log).at(*hz), *hz)).collect()
}

/// Members that swing through each other at unequal rates, so that they meet and part all the time.
fn crossing(work: f64, log: &Log) -> Vec<AgentSpawn> {
    let swing = |k: usize| Swing { reach_m: 6.0, rate_hz: 0.5 + 0.07 * k as f64, phase: 0.13 * k as f64 };
    let member = |k: usize| Dummy { swing: Some(swing(k)), ..Dummy::member(work, log) };
    RATES.iter().enumerate().map(|(k, hz)| named(member(k).at(*hz), *hz)).collect()
}

fn named(mut spawn: AgentSpawn, hz: f64) -> AgentSpawn {
    spawn.watches = vec![WatchedPoint { at: 0.0, every: SimSpan::from_nanos(10_000_000) }];
    spawn.name = format!("member at {hz}");
    spawn
}

fn lockstep(spawns: Vec<AgentSpawn>, machine: Machine) -> Box<Lockstep> {
    Box::new(Lockstep::start(spawns, machine).unwrap())
}

fn steps_of(log: &Log, id: u32) -> Vec<RecordedStep> {
    log.lock().unwrap_or_else(PoisonError::into_inner).iter().filter(|made| made.id == AgentId(id)).cloned().collect()
}

/// Every step of every agent begins where the one before ended, or later by the time that was dropped or rested; none
/// is missing.
fn assert_whole(log: &Log, stats: &[AgentStats], handles: &[AgentHandle]) {
    for (agent, handle) in stats.iter().zip(handles) {
        let steps = steps_of(log, agent.id.0);
        assert_eq!(steps.len() as u64, agent.steps, "{}", agent.name);
        assert_eq!(handle.latest().steps, agent.steps, "the last state is seen");
        assert!(steps.windows(2).all(|w| w[1].from >= w[0].to), "{}: a step made twice", agent.name);
        let made: u64 = steps.iter().map(|s| s.to.since(s.from).as_nanos()).sum();
        let end = steps.last().map_or(0, |s| s.to.as_nanos());
        let gaps = agent.dropped.as_nanos() + agent.rested.as_nanos();
        assert!(made + gaps >= end, "{}: {made} + {gaps} of {end}", agent.name);
    }
}

/// Plays in slices of 3 ms and counts how often anybody's leader changed.
fn play_counting(run: &mut dyn Run, until_ms: u64) -> usize {
    let led = |run: &dyn Run| run.agents().iter().map(|a| a.stats().led_by).collect::<Vec<_>>();
    let (mut before, mut changes) = (led(run), 0);
    for slice in 1..=until_ms / 3 {
        run.wait_until(ms(slice * 3));
        let now = led(run);
        changes += before.iter().zip(&now).filter(|(a, b)| a != b).count();
        before = now;
    }
    changes
}

#[test]
fn a_thousand_moves_lose_no_step_and_make_none_twice() {
    let log = Log::default();
    let mut run = lockstep(crossing(20.0, &log), Machine::two_cores_software());
    let changes = play_counting(&mut *run, 60_000);
    assert!(changes > 1000, "{changes} changes of leaders");
    let handles = run.agents().to_vec();
    let stats = run.shutdown();
    assert_whole(&log, &stats, &handles);
    for (agent, handle) in stats.iter().zip(&handles) {
        assert_eq!(agent.state, AgentState::Running, "{}", agent.name);
        assert_eq!(agent.dropped, SimSpan::ZERO, "{}", agent.name);
        let end = handle.latest().time.as_secs_f64();
        // a slow leader and a slow agent on its way: two of the longest periods behind at most
        assert!((59.94..60.06).contains(&end), "{} has come to {end} s", agent.name);
        assert_eq!(holders(handle), 1, "{} is still somewhere", agent.name);
        let samples = handle.samples(0);
        assert!(samples.windows(2).all(|w| w[1].0 > w[0].0) && samples.len() > 500, "watched wherever it is");
    }
}

#[test]
fn led_runs_are_equal_to_the_bit_with_noise_on() {
    let play = |seed| {
        let machine = Machine { noise_sd: 0.2, seed, ..Machine::two_cores_software() };
        let log = Log::default();
        let mut run = lockstep(crossing(400.0, &log), machine);
        run.wait_until(ms(3000));
        let hash = state_hash(run.agents());
        drop(run);
        let log = log.lock().unwrap();
        (hash, log.iter().map(|made| (made.id, made.from, made.to)).collect::<Vec<_>>())
    };
    assert!(play(3) == play(3));
    assert!(play(3) != play(4), "the noise counts");
}

#[test]
fn members_step_at_their_leaders_times() {
    let log = Log::default();
    let mut run = lockstep(close(&log), Machine::two_cores_software());
    run.wait_until(ms(1000));
    let leaders: Vec<_> = run.agents().iter().map(|a| a.stats().led_by).collect();
    assert_eq!(leaders[0], None);
    assert!(leaders[1..].iter().all(|l| *l == Some(AgentId(0))), "{leaders:?}");
    let times: Vec<_> = run.agents().iter().map(|a| a.latest().time).collect();
    assert!(times.iter().all(|t| *t == times[0]), "{times:?}");
    let stats = run.shutdown();
    assert!(stats.iter().all(|s| s.cpu_s > 0.0));
    // macro steps of 16 of the fastest: the next of the slowest, 27 ms, is no power of two of them
    let late = |id| steps_of(&log, id).iter().filter(|s| s.from >= SimTime::from_nanos(500_000_000)).count();
    assert!((0..6).all(|id| (31 * 16..=32 * 16).contains(&late(id))), "{:?}", [late(0), late(1), late(2)]);
}

#[test]
fn a_led_step_costs_what_its_members_cost() {
    let log = Log::default();
    // 3 ms each: six of them need 18 ms of each 4.17
    let spawns = (0..6).map(|_| Dummy::member(3000.0, &log).at(240.0)).collect();
    let mut run = lockstep(spawns, Machine::two_cores_software());
    run.wait_until(ms(10_000));
    let steps = run.shutdown()[0].steps;
    // side by side on two cores 9 ms a turn
    assert!((1080..=1125).contains(&steps), "{steps}");
}

#[test]
fn agents_that_belong_together_are_led_before_the_first_step() {
    let log = Log::default();
    let at = |z: f64| Dummy { z, ..Dummy::member(20.0, &log) }.at(240.0);
    let mut spawns: Vec<_> = [0.0, 10.0, 20.0, 20.1, 30.0, 40.0].map(at).into();
    let rope = |a, b| Joint::new(AgentId(a), Some(AgentId(b)), JointKind::Rope { length_m: 30.0 });
    let scene = ClusterScene::default().jointed([rope(4, 1), rope(1, 2)].into()).unwrap();
    let scene = Arc::new(scene);
    spawns.iter_mut().for_each(|spawn| spawn.scene = Arc::clone(&scene));
    let mut run = lockstep(spawns, Machine::two_cores_software());
    let leaders = |run: &Lockstep| run.agents().iter().map(|a| a.led_by().map(|id| id.0)).collect::<Vec<_>>();
    // joints hold 1, 2 and 4, and 3 may touch 2
    assert_eq!(leaders(&run), [None, None, Some(1), Some(1), Some(1), None]);
    assert!(log.lock().unwrap().is_empty());
    run.wait_until(ms(1000));
    assert_eq!(leaders(&run), [None, None, Some(1), Some(1), Some(1), None], "however far joints reach");
}

#[test]
fn a_cluster_rests_as_one_and_wakes_as_one() {
    let log = Log::default();
    let sleepy = |hz| Dummy { rest_from: Some(20), ..Dummy::member(20.0, &log) }.at(hz);
    let mut run = lockstep([250.0, 250.0, 125.0].map(sleepy).into(), Machine::two_cores_software());
    run.wait_until(ms(1000));
    assert!(run.agents().iter().all(|a| a.state() == AgentState::Resting && a.latest().at_rest));
    let steps = |run: &Lockstep| run.agents().iter().map(|a| a.stats().steps).collect::<Vec<_>>();
    let before = steps(&run);
    // the one that is led last gets a command: its leader wakes for it
    run.send(AgentId(2), Command::resolution(Resolution { eps_m: 0.05, n: 1 })).unwrap();
    run.wait_until(ms(1200));
    let after = steps(&run);
    assert!(before.iter().zip(&after).all(|(b, a)| a > b && a - b <= 2), "{before:?} {after:?}");
    assert_eq!(run.agents()[2].latest().resolution.unwrap().eps_m, 0.05);
    assert!(run.agents().iter().all(|a| a.state() == AgentState::Resting));
    let handles = run.agents().to_vec();
    let stats = run.shutdown();
    assert_whole(&log, &stats, &handles);
    assert!(stats.iter().all(|s| s.rested > SimSpan::from_nanos(900_000_000) && s.dropped == SimSpan::ZERO));
}

#[test]
fn a_touch_of_one_that_is_led_wakes_the_cluster() {
    let log = Log::default();
    let sleepy = |hz| Dummy { rest_from: Some(20), ..Dummy::member(20.0, &log) }.at(hz);
    let toucher = Dummy { touches: Some((101, AgentId(1))), ..Dummy::new(20.0) };
    let spawns = vec![sleepy(250.0), sleepy(250.0), toucher.at(100.0)];
    let mut run = lockstep(spawns, Machine::two_cores_software());
    run.wait_until(ms(1000));
    assert_eq!(run.agents()[0].state(), AgentState::Resting);
    run.wait_until(ms(1500));
    assert!(run.agents().iter().all(|a| a.state() == AgentState::Running));
    assert!(!run.agents()[1].latest().at_rest, "what is touched must not be taken for immovable");
}

#[test]
fn a_broken_member_is_parked_alone_and_the_others_go_on() {
    for fault in [Fault::NotFinite, Fault::Diverged, Fault::Panic] {
        for broken in 0..3_u32 {
            let log = Log::default();
            let bonded = |id| Dummy { fault: (id == broken).then_some((60, fault)), ..Dummy::member(20.0, &log) };
            let mut run = lockstep((0..3).map(|id| bonded(id).at(250.0)).collect(), Machine::two_cores_software());
            run.wait_until(ms(2000));
            let states: Vec<_> = run.agents().iter().map(AgentHandle::state).collect();
            let parked = states.iter().filter(|s| matches!(s, AgentState::Parked(_))).count();
            assert_eq!(parked, 1, "{fault:?} of {broken}: {states:?}");
            assert!(matches!(states[broken as usize], AgentState::Parked(_)), "{fault:?} of {broken}: {states:?}");
            for (id, agent) in run.agents().iter().enumerate().filter(|(id, _)| states[*id] == AgentState::Running) {
                let newest = agent.latest();
                assert!(newest.body.is_finite() && newest.time.as_secs_f64() > 1.99, "{fault:?} of {broken}: {id}");
            }
            let kept = run.agents().to_vec();
            drop(run);
            assert!(kept.iter().all(|a| holders(a) == 1));
        }
    }
}

#[test]
fn in_real_time_agents_come_and_go_and_no_step_is_lost() {
    on_every_executor(|start| {
        let log = Log::default();
        let run = start(crossing(20.0, &log), system());
        let leaders = || run.agents().iter().map(AgentHandle::led_by).collect::<Vec<_>>();
        let (moves, before) = (Cell::new(0), RefCell::new(leaders()));
        eventually("a hundred moves", || {
            let old = before.replace(leaders());
            moves.set(moves.get() + before.borrow().iter().zip(&old).filter(|(new, old)| new != old).count());
            moves.get() >= 100
        });
        let handles = run.agents().to_vec();
        let stats = run.shutdown();
        assert_whole(&log, &stats, &handles);
        assert!(handles.iter().all(|a| holders(a) == 1), "every thread has let go of every agent");
        let number = |name: &str| RATES.iter().position(|hz| name == format!("agent:member at {hz}"));
        for made in log.lock().unwrap().iter() {
            // 0 and 3 have one name; workers of a pool have none of an agent
            assert!(number(&made.thread).is_none_or(|at| at <= made.id.0 as usize), "{made:?}: a leader is lower");
        }
    });
}

#[test]
fn a_run_that_ends_while_agents_are_led_ends_all_of_them() {
    on_every_executor(|start| {
        for drop_it in [true, false] {
            let log = Log::default();
            let run = start(close(&log), system());
            let kept = run.agents().to_vec();
            eventually("all are led by the first", || kept[1..].iter().all(|a| a.led_by() == Some(AgentId(0))));
            let steps = kept[5].stats().steps;
            kept[5].send(Command::resolution(Resolution { eps_m: 0.07, n: 3 })).unwrap();
            eventually("a command reaches a led agent", || {
                kept[5].latest().resolution.is_some_and(|r| r.eps_m == 0.07)
            });
            assert!(kept[5].stats().steps >= steps);
            if drop_it {
                drop(run);
            } else {
                let stats = run.shutdown();
                assert_whole(&log, &stats, &kept);
            }
            assert!(kept.iter().all(|a| holders(a) == 1));
        }
    });
}

#[test]
fn a_panic_in_a_led_turn_stops_nobody_else() {
    on_every_executor(|start| {
        let log = Log::default();
        let bonded = |id| Dummy { fault: (id == 1).then_some((50, Fault::Panic)), ..Dummy::member(20.0, &log) };
        let mut spawns: Vec<_> = (0..3).map(|id| bonded(id).at(500.0)).collect();
        spawns.push(Dummy { z: 90.0, ..Dummy::member(20.0, &log) }.at(500.0));
        let run = start(spawns, system());
        eventually("the panic", || matches!(run.agents()[1].state(), AgentState::Parked(_)));
        let before = run.agents()[2].stats().steps;
        let stopped = || matches!(run.agents()[2].state(), AgentState::Parked(_));
        eventually("the others go on", || run.agents()[2].stats().steps > before + 20 || stopped());
        let before = run.agents()[3].stats().steps;
        eventually("and strangers", || run.agents()[3].stats().steps > before + 20);
    });
}

#[test]
fn a_cluster_rests_and_wakes_as_one_in_real_time() {
    on_every_executor(|start| {
        let log = Log::default();
        let sleepy = |hz| Dummy { rest_from: Some(20), ..Dummy::member(20.0, &log) }.at(hz);
        let run = start([500.0, 250.0, 125.0].map(sleepy).into(), system());
        let all_rest = || run.agents().iter().all(|a| a.state() == AgentState::Resting && a.latest().at_rest);
        for round in 1..=20_u8 {
            eventually("all rest", all_rest);
            let steps = run.agents()[0].stats().steps;
            let eps_m = f64::from(round) * 1e-3;
            run.send(AgentId(2), Command::resolution(Resolution { eps_m, n: 1 })).unwrap();
            eventually("the one led last obeys", || {
                run.agents()[2].latest().resolution.is_some_and(|r| r.eps_m == eps_m)
            });
            // a leader shows its own state, and counts its step, after the states of all it leads
            eventually("its leader woke for it", || run.agents()[0].stats().steps > steps);
        }
        let handles = run.agents().to_vec();
        let stats = run.shutdown();
        assert_whole(&log, &stats, &handles);
    });
}
