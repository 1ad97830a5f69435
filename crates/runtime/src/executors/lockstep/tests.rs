//! Claims about runs in virtual time; claims about turns hold for every executor, which all make the same.

use super::super::testing::{Dummy, Fault};
use super::*;
use crate::{AgentState, Command, Demand, Governor, Keyed, SendError, TurnMeasure, state_hash};
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, Anchor, Resolution, SimSpan, SimTime};

const fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

const fn sim_ms(n: u64) -> SimTime {
    SimTime::from_nanos(n * 1_000_000)
}

fn lockstep(spawns: Vec<AgentSpawn>) -> Box<Lockstep> {
    Box::new(Lockstep::start(spawns, Machine::two_cores_software()).unwrap())
}

fn noisy(seed: u64) -> Machine {
    Machine { noise_sd: 0.2, seed, ..Machine::two_cores_software() }
}

/// Four agents of 240 Hz that need 0.5 ms each, and one more whose step costs `work` µs.
fn five_agents(work: f64, machine: Machine) -> Vec<AgentStats> {
    let mut spawns: Vec<_> = (0..4).map(|_| Dummy::new(500.0).at(240.0)).collect();
    spawns.push(Dummy::new(work).at(240.0));
    let mut run = Box::new(Lockstep::start(spawns, machine).unwrap());
    run.wait_until(ms(10_000));
    run.shutdown()
}

#[test]
fn an_overloaded_agent_leaves_the_others_their_rates() {
    for machine in [Machine::two_cores_software(), noisy(5)] {
        // 4 ms of 4.17 is a full load; ten times that cannot be kept
        let (before, after) = (five_agents(4_000.0, machine.clone()), five_agents(40_000.0, machine));
        for (b, a) in before.iter().zip(&after).take(4) {
            let change = a.steps as f64 / b.steps as f64 - 1.0;
            assert!(change.abs() < 0.01, "{} -> {} steps", b.steps, a.steps);
            assert_eq!(a.dropped, SimSpan::ZERO);
        }
        assert!(after[4].mean_hz < 30.0, "{} Hz", after[4].mean_hz);
        assert!(after[4].dropped > SimSpan::ZERO);
    }
}

#[test]
fn an_overloaded_agent_lags_no_more_than_the_cap_however_long_it_runs() {
    let mut run = lockstep(vec![Dummy::new(40_000.0).at(240.0)]);
    for second in 1..=20 {
        run.wait_until(ms(1000 * second));
        let agent = &run.agents()[0];
        let newest = agent.latest();
        // the cap, the step that began below it, and the one under way: 100 + 40 + 40 ms
        assert!(agent.age_s(&newest, run.sim_now()) <= 0.18, "second {second}");
    }
    let stats = run.shutdown().remove(0);
    let dt_ns = stats.dt.as_nanos();
    // all time is stepped, dropped, or lag below the bound above
    let covered = stats.steps * dt_ns + stats.dropped.as_nanos();
    assert!(20_000_000_000 - covered < 180_000_000, "covered {covered} ns");
    assert_eq!(stats.misses, stats.steps);
}

#[test]
fn a_load_that_fits_keeps_its_rate_under_noise() {
    let stats = five_agents(1_000.0, noisy(3));
    for agent in stats {
        // 240 Hz in whole nanoseconds over 10 s, and the step under way
        assert!((2399..=2401).contains(&agent.steps), "{} steps", agent.steps);
        assert!((agent.mean_hz - 240.0).abs() < 0.1, "{} Hz", agent.mean_hz);
        assert!((agent.rate_hz - 240.0).abs() < 2.0, "one step more or less in half a second: {} Hz", agent.rate_hz);
        assert_eq!(agent.dropped, SimSpan::ZERO);
    }
}

/// A run of linked agents with a frame loop; its end in one number.
fn eventful_run(seed: u64) -> (u64, Vec<u64>) {
    let rates = [1000.0, 240.0, 60.0, 37.0, 10.0];
    let mut spawns: Vec<_> = rates.iter().map(|hz| Dummy::new(2e5 / hz).at(*hz)).collect();
    for (at, spawn) in spawns.iter_mut().enumerate() {
        spawn.links = (0..5).filter(|k| *k != at as u32).map(AgentId).collect();
    }
    let mut run = Box::new(Lockstep::start(spawns, noisy(seed)).unwrap());
    for frame in 1..=120_u64 {
        run.wait_until(Duration::from_nanos(frame * 16_666_667));
        run.spend(run.machine().frame_time(4e-3, frame, Duration::ZERO));
        if frame == 60 {
            run.send(AgentId(1), Command::resolution(Resolution { eps_m: 0.02, n: 2 })).unwrap();
        }
    }
    let hash = state_hash(run.agents());
    (hash, run.shutdown().iter().map(|s| s.steps).collect())
}

#[test]
fn two_runs_are_equal_to_the_bit_with_noise_on() {
    let first = eventful_run(7);
    assert_eq!(first, eventful_run(7));
    assert_ne!(first.0, eventful_run(8).0, "another seed is another run");
}

#[test]
fn a_state_on_time_covers_the_present() {
    let mut run = lockstep(vec![Dummy::new(100.0).at(250.0)]);
    run.wait_until(ms(1000));
    let newest = run.agents()[0].latest();
    assert_eq!(newest.time, sim_ms(1000));
    assert_eq!(run.agents()[0].age_s(&newest, run.sim_now()), 0.0);
}

#[test]
fn a_state_is_seen_when_its_cost_has_passed() {
    let mut run = lockstep(vec![Dummy::new(3_000.0).at(100.0)]);
    run.wait_until(ms(2));
    assert_eq!(run.agents()[0].latest().time, SimTime::ZERO);
    run.wait_until(ms(3));
    assert_eq!(run.agents()[0].latest().time, sim_ms(10));
}

#[test]
fn pause_freezes_and_a_single_step_advances_exactly_one_frame_span() {
    let mut run = lockstep(vec![Dummy::new(100.0).at(250.0), Dummy::new(100.0).at(125.0)]);
    run.wait_until(ms(402));
    run.drive(TimelineCommand::Pause);
    let times = |run: &Lockstep| run.agents().iter().map(|a| a.latest().time).collect::<Vec<_>>();
    assert_eq!(times(&run), [sim_ms(404), sim_ms(408)]);
    run.wait_until(ms(2000));
    assert_eq!(run.sim_now(), sim_ms(402));
    assert_eq!(times(&run), [sim_ms(404), sim_ms(408)]);
    run.drive(TimelineCommand::Step(SimSpan::from_nanos(16_000_000)));
    run.wait_until(ms(3000));
    assert_eq!(run.sim_now(), sim_ms(418));
    assert_eq!(times(&run), [sim_ms(420), sim_ms(424)], "four steps of 4 ms, two of 8 ms");
    run.drive(TimelineCommand::Run);
    run.wait_until(ms(3084));
    assert_eq!(times(&run), [sim_ms(504), sim_ms(504)]);
    assert!(run.shutdown().iter().all(|s| s.dropped == SimSpan::ZERO), "a pause is no lateness");
}

#[test]
fn half_speed_makes_half_the_steps() {
    let mut run = lockstep(vec![Dummy::new(100.0).at(250.0)]);
    run.drive(TimelineCommand::Speed(0.5));
    run.wait_until(ms(2000));
    assert_eq!(run.agents()[0].latest().time, sim_ms(1000));
    let stats = run.shutdown().remove(0);
    assert!((stats.rate_hz - 250.0).abs() < 2.0, "rates are a simulated second's: {}", stats.rate_hz);
}

#[test]
fn rest_stops_the_steps_and_a_command_wakes() {
    let sleepy = Dummy { rest_from: Some(10), ..Dummy::new(100.0) };
    let mut run = lockstep(vec![sleepy.at(250.0)]);
    run.wait_until(ms(1000));
    let agent = run.agents()[0].clone();
    assert_eq!((agent.state(), agent.stats().steps), (AgentState::Resting, 10));
    assert_eq!(agent.age_s(&agent.latest(), run.sim_now()), 0.0, "a state at rest still holds");
    agent.send(Command::resolution(Resolution { eps_m: 0.05, n: 1 })).unwrap();
    run.wait_until(ms(2000));
    let stats = agent.stats();
    assert_eq!((stats.steps, stats.state), (11, AgentState::Resting), "it obeyed and rests again");
    assert_eq!(stats.resolution.unwrap().eps_m, 0.05);
    assert_eq!(agent.latest().time, sim_ms(1004));
    assert_eq!(stats.dropped, SimSpan::ZERO);
    assert_eq!(stats.rested, SimSpan::from_nanos(960_000_000));
}

#[test]
fn a_touched_agent_wakes_and_stays_awake_while_it_is_touched() {
    let sleepy = Dummy { rest_from: Some(10), ..Dummy::new(100.0) };
    let toucher = Dummy { touches: Some((101, AgentId(0))), ..Dummy::new(100.0) };
    let mut run = lockstep(vec![sleepy.at(250.0), toucher.at(100.0)]);
    run.wait_until(ms(1000));
    assert_eq!(run.agents()[0].state(), AgentState::Resting);
    run.wait_until(ms(2000));
    let stats = run.agents()[0].stats();
    assert_eq!(stats.state, AgentState::Running);
    // the touch is published 0.1 ms after 1 s; 250 steps a second from there
    assert!((259..=261).contains(&stats.steps), "{} steps", stats.steps);
}

#[test]
fn a_user_spring_pulls_until_its_release_and_keeps_the_agent_awake() {
    let sleepy = Dummy { rest_from: Some(1), ..Dummy::new(100.0) };
    let mut run = lockstep(vec![sleepy.at(250.0)]);
    run.wait_until(ms(100));
    let pull = AnchorSpring {
        by: None,
        anchor: Anchor::Local(DVec3::ZERO),
        target: DVec3::X * 1000.0,
        target_velocity: DVec3::ZERO,
        stiffness_n_m: 1.0,
        damping_n_s_m: 0.0,
    };
    run.send(AgentId(0), Command::Spring(Keyed::first(Some(pull)))).unwrap();
    run.wait_until(ms(600));
    let pulled = run.agents()[0].latest();
    assert_eq!(run.agents()[0].stats().steps, 126);
    // x' = 1 + 1000 - x over 0.5 s gives 1001 (1 - e^-0.5) = 394; first-order steps of 4 ms: 0.4 % of it
    assert!((pulled.body.probe(0.0).unwrap().0.x - 394.0).abs() < 2.0);
    run.send(AgentId(0), Command::Spring(Keyed::first(None))).unwrap();
    run.wait_until(ms(1600));
    assert_eq!(run.agents()[0].state(), AgentState::Resting);
}

#[test]
fn a_command_to_an_unknown_agent_is_an_error() {
    let run = lockstep(vec![Dummy::new(1.0).at(60.0)]);
    assert_eq!(run.send(AgentId(9), Command::wake()), Err(SendError::NoAgent(AgentId(9))));
}

#[test]
fn a_failed_agent_is_parked_with_the_reason_and_the_others_go_on() {
    for (fault, reason) in
        [(Fault::NotFinite, "is not finite"), (Fault::Diverged, "on demand"), (Fault::Panic, "panicked")]
    {
        let broken = Dummy { fault: Some((5, fault)), ..Dummy::new(100.0) };
        let mut well = Dummy::new(100.0).at(250.0);
        well.links = vec![AgentId(0)];
        let mut run = lockstep(vec![broken.at(250.0), well]);
        run.wait_until(ms(1000));
        let AgentState::Parked(why) = run.agents()[0].state() else { panic!("{fault:?} was not parked") };
        assert!(why.contains(reason), "{why}");
        assert_eq!(run.agents()[0].latest().time, sim_ms(16), "the state before the fault stands");
        assert!(run.agents()[0].latest().body.is_finite());
        let well = &run.agents()[1];
        assert_eq!((well.stats().steps, well.latest().body.is_finite()), (250, true));
    }
}

#[test]
fn an_agent_that_starts_broken_never_runs() {
    let broken = Dummy { x: f64::NAN, ..Dummy::new(1.0) };
    let mut run = lockstep(vec![broken.at(60.0)]);
    run.wait_until(ms(100));
    let stats = run.shutdown().remove(0);
    assert_eq!(stats.steps, 0);
    assert!(matches!(stats.state, AgentState::Parked(_)));
}

#[test]
fn the_frame_shares_the_cores_with_the_agents() {
    let mut alone = lockstep(Vec::new());
    alone.spend(ms(10));
    assert_eq!(alone.now(), ms(10));
    // three agents that never finish: four jobs on two cores
    let mut crowded = lockstep((0..3).map(|_| Dummy::new(1e9).at(60.0)).collect());
    crowded.wait_until(ms(1));
    crowded.spend(ms(10));
    assert_eq!(crowded.now(), ms(21));
}

/// Demands once a resolution beyond its agent's range, and counts its questions.
struct Greedy {
    asked: u32,
}

impl Governor for Greedy {
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand {
        assert!((measure.work_s - 1e-4).abs() < 1e-12, "the declared price");
        assert!((measure.wanted_period_s - 0.004).abs() < 1e-12);
        self.asked += 1;
        if self.asked < 10 {
            return Demand::default();
        }
        assert!(self.asked == 10 || measure.dt == SimSpan::from_nanos(8_000_000));
        let resolution = Some(Resolution { eps_m: 55.0, n: 0 });
        Demand { dt: SimSpan::from_secs_f64(0.9), resolution }
    }
}

#[test]
fn a_governors_demand_is_obeyed_within_the_range() {
    let mut spawn = Dummy::new(100.0).at(250.0);
    spawn.dt_range.1 = SimSpan::from_nanos(8_000_000);
    spawn.governor = Some(Box::new(Greedy { asked: 0 }));
    let mut run = lockstep(vec![spawn]);
    run.wait_until(ms(1000));
    let stats = run.shutdown().remove(0);
    assert_eq!(stats.state, AgentState::Running);
    assert_eq!(stats.dt, SimSpan::from_nanos(8_000_000));
    assert_eq!(stats.resolution.unwrap(), Resolution { eps_m: 0.1, n: 0 });
    assert_eq!(stats.steps, 10 + 120);
}

#[test]
fn an_invalid_agent_is_refused_with_its_name() {
    let refuse = |change: fn(&mut AgentSpawn)| {
        let mut spawn = Dummy::new(1.0).at(60.0);
        change(&mut spawn);
        Lockstep::start(vec![spawn], Machine::default()).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(refuse(|s| s.rate_hz = f64::NAN).contains("dummy at 60"));
    assert!(refuse(|s| s.dt_range.0 = SimSpan::ZERO).contains("dummy at 60"));
    assert!(refuse(|s| s.dt_range.1 = SimSpan::from_nanos(2_000_000_000)).contains("2 s"));
    assert!(refuse(|s| s.links = vec![AgentId(3)]).contains("agent 3"));
}

#[test]
fn cpu_time_is_measured_in_virtual_time_too() {
    let stats = five_agents(100.0, Machine::default());
    let cpu_s: f64 = stats.iter().map(|s| s.cpu_s).sum();
    // 12,000 turns were really made, in far less than the 10 s of virtual time of two cores
    assert!(cpu_s > 0.0 && cpu_s < 10.0, "{cpu_s}");
}

#[test]
fn ages_that_were_used_are_reported() {
    let run = lockstep(vec![Dummy::new(1.0).at(60.0)]);
    let agent = &run.agents()[0];
    (0..100).for_each(|k| agent.record_age(f64::from(k) * 1e-3));
    agent.record_age(f64::NAN);
    let age = agent.stats().age;
    // 1 % of resolution, one rank in a hundred
    assert!((age.p50_s - 0.0495).abs() < 1.5e-3 && (age.p99_s - 0.098).abs() < 2e-3, "{age:?}");
}

#[test]
fn nothing_is_allocated_once_a_run_has_warmed_up() {
    let mut spawns: Vec<_> = [1000.0, 240.0, 60.0].map(|hz| Dummy::new(200.0).at(hz)).into();
    spawns.push(Dummy::new(40_000.0).at(240.0));
    spawns.iter_mut().for_each(|s| s.links = (0..4).map(AgentId).collect());
    let mut run = Box::new(Lockstep::start(spawns, noisy(2)).unwrap());
    let frames = |run: &mut Lockstep, frames: std::ops::Range<u64>| {
        for frame in frames {
            run.wait_until(ms(frame * 17));
            for agent in run.agents() {
                agent.record_age(agent.age_s(&agent.latest(), run.sim_now()));
            }
            run.spend(ms(2));
        }
    };
    // longer lags and ages come up in the first seconds, and each doubling gets its page of counters once
    let warm_up = allocation_counter::measure(|| frames(&mut run, 1..300));
    assert!(warm_up.count_total > 0, "the counter counts");
    let count = allocation_counter::measure(|| frames(&mut run, 300..840));
    assert_eq!(count.count_total, 0, "{count:?}");
}
