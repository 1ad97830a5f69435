//! The peers that agents see, when, and which of their states reach them.

use super::*;
use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::spawn::assemble;
use crate::cluster::Span;
use crate::executors::lockstep::Lockstep;
use crate::executors::testing::{Dummy, Log, RecordedStep, eventually, on_every_executor, system};
use crate::time::faults::Faults;
use crate::turn::helpers::Helpers;
use crate::{AgentState, Machine, Run};
use metachron_contact::Link;
use metachron_core::{Anchor, SimSpan};
use std::time::Duration;

const fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

fn lockstep(spawns: Vec<AgentSpawn>) -> Box<Lockstep> {
    Box::new(Lockstep::start(spawns, Machine::two_cores_software()).unwrap())
}

/// A ball of 0.1 m at height `z` that climbs at this speed.
fn ball(z: f64, speed_m_s: f64, log: &Log) -> Dummy {
    Dummy { ball: Some((0.1, speed_m_s)), z, log: Some(Arc::clone(log)), ..Dummy::new(20.0) }
}

fn steps_of(log: &Log, id: u32) -> Vec<RecordedStep> {
    log.lock().unwrap().iter().filter(|made| made.id == AgentId(id)).cloned().collect()
}

fn crowded(spawns: Vec<AgentSpawn>) -> bool {
    let run = assemble(spawns, Helpers::none()).unwrap();
    run.actors[0].as_ref().unwrap().peers.broad_phase.get().is_some()
}

#[test]
fn a_run_without_possible_contact_has_no_broad_phase() {
    let log = Log::default();
    let two = || vec![ball(0.0, 0.0, &log).at(240.0), ball(0.0, 0.0, &log).at(240.0)];
    assert!(crowded(two()));
    assert!(!crowded(vec![ball(0.0, 0.0, &log).at(240.0), Dummy::new(1.0).at(240.0)]), "only one has a form");
    let mut off = two();
    off[1].laws = vec![(AgentId(0), Law::Off)];
    assert!(!crowded(off), "the only pair is off");
}

#[test]
fn passing_agents_see_each_other_while_near() {
    let log = Log::default();
    let mut run = lockstep(vec![ball(0.0, 0.0, &log).at(240.0), ball(-5.0, 5.0, &log).at(1000.0)]);
    run.wait_until(ms(2000));
    for (me, other) in [(0, AgentId(1)), (1, AgentId(0))] {
        let steps = steps_of(&log, me);
        // the flyer is 5 m/s · t − 5 m high; the skins are 0.2 m nearer
        let gap_m = |made: &RecordedStep| (5.0 * made.from.as_secs_f64() - 5.0).abs() - 0.2;
        for made in &steps {
            assert!(made.saw.is_empty() || made.saw == [other], "{made:?}");
            let seen = !made.saw.is_empty();
            // four steps at 8 m/s, 5 mm, and the flyer's last step
            assert!(seen || gap_m(made) > 0.0, "{me} is blind at {} m", gap_m(made));
            assert!(!seen || gap_m(made) < 0.2, "{me} sees too far: {} m", gap_m(made));
        }
        assert!(steps.iter().any(|made| !made.saw.is_empty()));
    }
}

#[test]
fn an_impulse_of_a_bullet_reaches_a_slow_agent_it_has_long_passed() {
    for faults in [Faults::default(), Faults { jitter: 0.2, loss: 0.5, seed: 4 }] {
        let log = Log::default();
        // 20 m/s are 2 m in one step of the slow one; it gives until it has passed, 0.2 m beyond
        let bullet = Dummy { impulses: 460, ..ball(-9.0, 20.0, &log) };
        let mut spawns = vec![ball(0.0, 0.0, &log).at(10.0), bullet.at(1000.0)];
        spawns.iter_mut().for_each(|spawn| spawn.faults = faults);
        let mut run = lockstep(spawns);
        run.wait_until(ms(3000));
        let (slow, bullet) = (run.agents()[0].latest(), run.agents()[1].latest());
        assert!(bullet.residual_m > 0.0, "it gave");
        assert_eq!(slow.energy_j, bullet.residual_m, "all of it was taken, and once");
        let last = |id| steps_of(&log, id).pop().unwrap();
        assert!(last(0).saw.is_empty() && last(1).saw.is_empty(), "the account is settled and closed");
    }
}

#[test]
fn an_impulse_wakes_its_receiver() {
    let log = Log::default();
    let sleepy = Dummy { rest_from: Some(5), ..ball(0.0, 0.0, &log) };
    let giver = Dummy { impulses: 260, ..ball(-2.5, 5.0, &log) };
    let mut run = lockstep(vec![sleepy.at(240.0), giver.at(500.0)]);
    run.wait_until(ms(300));
    assert_eq!(run.agents()[0].state(), AgentState::Resting);
    assert!(run.agents()[0].latest().at_rest);
    run.wait_until(ms(2000));
    let (slept, gave) = (run.agents()[0].latest(), run.agents()[1].latest());
    assert!(gave.residual_m > 0.0 && slept.energy_j == gave.residual_m, "{} of {}", slept.energy_j, gave.residual_m);
    assert_eq!(run.agents()[0].state(), AgentState::Resting, "and sleeps again");
}

#[test]
fn laws_and_attachments_are_known_on_both_sides() {
    let log = Log::default();
    let mut spawns: Vec<_> = (0..4).map(|_| ball(0.0, 0.0, &log).at(240.0)).collect();
    let line = Law::Tlm { stiffness_n_m: 10.0, damping_n_s_m: 1.0 };
    spawns[2].laws = vec![(AgentId(0), line), (AgentId(1), Law::Off)];
    let link = Link::new(AgentId(3), Anchor::Arc(0.5), Anchor::Arc(0.25), 10.0);
    spawns[1].attached = vec![link];
    let mut run = assemble(spawns, Helpers::none()).unwrap();
    let mut seen = |id: usize| {
        let actor = run.actors[id].as_mut().unwrap();
        actor.step_alone(Span::AtMost(SimSpan::from_nanos(4_000_000)), None).unwrap();
        let met = actor.observer.neighbours().iter().map(|n| (n.id.0, n.law, n.form.is_some()));
        (met.collect::<Vec<_>>(), actor.links.clone())
    };
    let ledger = Law::Cluster;
    assert_eq!(seen(0), (vec![(1, ledger, true), (2, line, true), (3, ledger, true)], vec![]));
    assert_eq!(seen(1), (vec![(3, ledger, true), (0, ledger, true)], vec![link]), "links come first");
    assert_eq!(seen(2), (vec![(0, line, true), (3, ledger, true)], vec![]));
    let back = Link { other: AgentId(1), here: link.there, there: link.here, ..link };
    assert_eq!(seen(3), (vec![(1, ledger, true), (0, ledger, true), (2, ledger, true)], vec![back]));
}

/// The lengths of an agent's steps, in the order they were made.
fn spans(log: &Log) -> Vec<u64> {
    steps_of(log, 0).iter().map(|made| made.to.since(made.from).as_nanos()).collect()
}

#[test]
fn jitter_spreads_the_steps_equally_on_every_executor() {
    let faults = Faults { jitter: 0.2, loss: 0.3, seed: 11 };
    let disturbed = |log: &Log| AgentSpawn { faults, ..ball(0.0, 0.0, log).at(250.0) };
    let virtually = Log::default();
    let mut run = lockstep(vec![disturbed(&virtually)]);
    run.wait_until(ms(1000));
    let end = run.shutdown().remove(0);
    let steps = steps_of(&virtually, 0);
    assert!(steps.windows(2).all(|w| w[0].to == w[1].from), "each begins where the last one ended");
    assert!((240..=260).contains(&end.steps), "250 on the mean: {}", end.steps);
    assert!(spans(&virtually).iter().all(|ns| (3_200_000..=4_800_000).contains(ns)));
    on_every_executor(|start| {
        let really = Log::default();
        let run = start(vec![disturbed(&really)], system());
        eventually("fifty steps", || run.agents()[0].stats().steps >= 50);
        drop(run);
        assert_eq!(spans(&virtually)[..50], spans(&really)[..50]);
    });
}

#[test]
fn a_lost_state_is_never_visible_and_the_last_one_always() {
    let log = Log::default();
    let mut spawn = ball(0.0, 0.0, &log).at(250.0);
    spawn.faults = Faults { jitter: 0.0, loss: 0.5, seed: 2 };
    let mut run = lockstep(vec![spawn]);
    let mut seen = Vec::new();
    for turn in 1..=1000 {
        run.wait_until(ms(4 * turn - 1));
        seen.push(run.agents()[0].latest().steps);
    }
    seen.dedup();
    // 1000 tosses: 500, deviation 16, five of them
    assert!((420..=580).contains(&seen.len()), "{}", seen.len());
    let kept = run.agents()[0].clone();
    assert_eq!(run.shutdown()[0].steps, kept.latest().steps);
}

#[test]
fn invalid_faults_and_unknown_peers_are_refused() {
    let refuse = |change: fn(&mut AgentSpawn)| {
        let mut spawn = Dummy::new(1.0).at(60.0);
        change(&mut spawn);
        Lockstep::start(vec![spawn], Machine::default()).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(refuse(|s| s.faults.loss = 1.0).contains("loss 1 must"));
    assert!(refuse(|s| s.faults.jitter = f64::NAN).contains("dummy at 60"));
    assert!(refuse(|s| s.laws = vec![(AgentId(4), Law::Off)]).contains("agent 4"));
}

#[test]
fn touching_and_led_agents_allocate_nothing() {
    let quiet = |dummy: Dummy| Dummy { log: None, impulses: u64::MAX, ..dummy };
    let log = Log::default();
    let mut spawns: Vec<_> =
        (0..4).map(|k| Dummy { log: None, z: 0.15 * f64::from(k), ..Dummy::member(20.0, &log) }.at(240.0)).collect();
    spawns.extend([1000.0, 37.0].map(|hz| quiet(ball(1.3, 0.0, &log)).at(hz)));
    let mut run = lockstep(spawns);
    // a ledger turns its page once a second, and that page is new: here that is after 1.0, 2.0, … s
    let warm_up = allocation_counter::measure(|| run.wait_until(ms(4500)));
    assert!(warm_up.count_total > 0, "the counter counts");
    assert_eq!(run.agents()[3].stats().led_by, Some(AgentId(0)));
    assert!(run.agents()[5].latest().energy_j > 100.0, "they trade");
    let count = allocation_counter::measure(|| run.wait_until(ms(4950)));
    assert_eq!(count.count_total, 0, "{count:?}");
}
