//! Asynchronous pairs in runs: each side in a cluster of its own, the same bits on every run, faults on them alone.

use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, Anchor, Archive, Body, PairKind, SimSpan, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_runtime::{
    AgentSpawn, DrawPrice, FACTOR, Faults, Lockstep, Machine, Priority, Run, StepPrice, SystemClock, Threads,
    TimelineCommand,
};
use std::sync::Arc;
use std::time::Duration;

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

fn machine() -> Machine {
    let price = |what: &'static str, base_us| StepPrice { model: what.into(), base_us, unit_us: 0.0 };
    let draw = DrawPrice {
        setup_ms: 0.0,
        pixel_ns: 0.0,
        enlarge_ns: 0.0,
        serial: 0.0,
        objects: Default::default(),
        strokes: Default::default(),
    };
    Machine { cores: 4, steps: vec![price("rigid", 1.0), price(FACTOR, 0.0)], draw, ..Machine::default() }
}

fn body(name: &str, solid: Solid, height_m: f64, mass_kg: f64, rate_hz: f64) -> AgentSpawn {
    let spec = RigidSpec { gravity: GRAVITY, friction: 0.5, ..RigidSpec::free(solid, DVec3::Z * height_m, mass_kg) };
    let scene = Arc::new(ClusterScene::new(&[Obstacle::new("floor", Solid::Plane)]).unwrap());
    AgentSpawn { scene, ..AgentSpawn::alone(name, Box::new(RigidBody::new(spec).unwrap()), rate_hz) }
}

/// A ball over a plate on the floor, by a law.
fn ball_on_plate(law: Law, rates_hz: [f64; 2]) -> Vec<AgentSpawn> {
    let plate = Solid::Box { half_extents_m: DVec3::new(0.1, 0.1, 0.01) };
    let mut plate = body("plate", plate, 0.0101, 1.0, rates_hz[0]);
    plate.laws = vec![(AgentId(1), law)];
    vec![plate, body("ball", Solid::Ball { radius_m: 0.02 }, 0.05, 0.2, rates_hz[1])]
}

fn play(spawns: Vec<AgentSpawn>, seconds: f64) -> Lockstep {
    let mut run = Lockstep::start(spawns, machine()).unwrap();
    run.wait_until(Duration::from_secs_f64(seconds));
    run
}

fn states(run: &Lockstep) -> Vec<Arc<Snapshot>> {
    run.agents().iter().map(|agent| agent.latest()).collect()
}

fn height_m(state: &Snapshot) -> f64 {
    let Body::Rigid(rigid) = &state.body else { panic!("no rigid body") };
    rigid.position.z
}

#[test]
fn a_ball_by_ledger_rests_on_a_plate_with_its_weight_in_a_cluster_of_its_own() {
    for rates in [[60.0, 240.0], [240.0, 60.0], [60.0, 60.0], [1000.0, 60.0]] {
        let mut run = play(ball_on_plate(Law::Ledger, rates), 1.0);
        // the shorter step computes, at equal steps the lower number
        let computing = if rates[1] > rates[0] { 1 } else { 0 };
        let pair = |all: &[Arc<Snapshot>]| {
            let pairs = &all[computing].pairs;
            *pairs.iter().find(|pair| pair.with == AgentId(1 - computing as u32)).unwrap()
        };
        let before = pair(&states(&run));
        let mut depths_m = [f64::INFINITY, f64::NEG_INFINITY];
        for frame in 61..=180 {
            run.wait_until(Duration::from_secs_f64(f64::from(frame) / 60.0));
            let depth_m = 0.04 - height_m(&states(&run)[1]);
            depths_m = [depths_m[0].min(depth_m), depths_m[1].max(depth_m)];
        }
        let all = states(&run);
        let leaders: Vec<_> = all.iter().map(|state| state.cluster.unwrap().leader).collect();
        assert_eq!(leaders, [AgentId(0), AgentId(1)], "{rates:?}");
        let after = pair(&all);
        assert_eq!(after.kind, PairKind::Ledger);
        assert!(all[1 - computing].pairs.iter().all(|pair| pair.with != AgentId(computing as u32)), "{rates:?}");
        // both rest 20 µm deep; at 1000 : 60 Hz the ball is never at rest, and goes a little deeper than it falls in a step of its own
        let stirs_m = if rates[0] == 1000.0 { 1.2 * 9.81 / 3600.0 } else { 1.1e-4 };
        let weight = (after.impulse_n_s - before.impulse_n_s) / (2.0 * 0.2 * 9.81);
        println!("{rates:?}: {depths_m:?} m, {weight}");
        assert!(depths_m[0] > 4e-5 - 2e-4 && depths_m[1] < 4e-5 + stirs_m, "{rates:?}: {depths_m:?} m");
        assert!((weight - 1.0).abs() < 0.01, "{rates:?}: {weight}");
    }
}

#[test]
fn a_pair_without_a_law_is_one_cluster() {
    let run = play(ball_on_plate(Law::Cluster, [60.0, 240.0]), 1.0);
    assert!(states(&run).iter().all(|state| state.cluster.unwrap().leader == AgentId(0)));
}

#[test]
fn two_runs_have_the_same_bits_with_faults_too() {
    let faults = Faults { jitter: 0.2, loss: 0.1, seed: 7 };
    let hash = || {
        let mut spawns = ball_on_plate(Law::Ledger, [60.0, 240.0]);
        spawns.iter_mut().for_each(|spawn| spawn.faults = faults);
        let run = play(spawns, 1.0);
        states(&run).iter().fold(1, |hash, state| state.fold_hash(hash))
    };
    assert_eq!(hash(), hash());
}

#[test]
fn faults_act_on_asynchronous_pairs_alone() {
    let end = |law: Law, faults: Faults| {
        let mut spawns = ball_on_plate(law, [60.0, 240.0]);
        spawns.iter_mut().for_each(|spawn| spawn.faults = faults);
        states(&play(spawns, 0.5)).iter().fold(1, |hash, state| state.fold_hash(hash))
    };
    let faults = Faults { jitter: 0.3, loss: 0.2, seed: 3 };
    assert_eq!(end(Law::Cluster, faults), end(Law::Cluster, Faults::default()));
    assert_ne!(end(Law::Ledger, faults), end(Law::Ledger, Faults::default()));
}

#[test]
fn an_asynchronous_link_joins_no_clusters_and_keeps_its_length_in_a_fall() {
    let (stiffness_n_m, damping_n_s_m) = (200.0, 2.0);
    for law in [Law::Ledger, Law::Tlm { stiffness_n_m, damping_n_s_m }] {
        for rates in [[240.0, 240.0], [120.0, 480.0], [480.0, 120.0]] {
            let mut spawns = vec![
                body("above", Solid::Ball { radius_m: 0.02 }, 1.0, 0.1, rates[0]),
                body("below", Solid::Ball { radius_m: 0.02 }, 0.9, 0.1, rates[1]),
            ];
            let middle = Anchor::Local(DVec3::ZERO);
            let spring = Link::new(AgentId(1), middle, middle, stiffness_n_m);
            spawns[0].attached = vec![Link { damping_n_s_m, rest_m: 0.1, law, ..spring }];
            spawns[0].laws = vec![(AgentId(1), Law::Off)];
            let run = play(spawns, 0.3);
            let all = states(&run);
            for (at, state) in all.iter().enumerate() {
                assert_eq!(state.cluster.unwrap().leader, AgentId(at as u32), "{law:?} {rates:?}");
            }
            // both fall alike, except for the error of their own steps in a fall, g h t/2, until the link takes it
            let length_m = (height_m(&all[0]) - height_m(&all[1])) - 9.81 * 0.3 * time_apart_s(&all);
            assert!((length_m - 0.1).abs() < 2e-3, "{law:?} {rates:?}: {length_m} m");
        }
    }
}

/// How much later the first state is than the second, seconds: it has fallen so much longer.
fn time_apart_s(all: &[Arc<Snapshot>]) -> f64 {
    all[1].time.secs_after(all[0].time)
}

/// Two balls in free space that meet head on, at rates of their own.
fn two_balls() -> Vec<AgentSpawn> {
    let ball = |height_m: f64, mass_kg: f64, speed_m_s: f64| {
        let free = RigidSpec::free(Solid::Ball { radius_m: 0.05 }, DVec3::Z * height_m, mass_kg);
        let spec = RigidSpec { velocity: DVec3::Z * speed_m_s, restitution: 0.5, ..free };
        Box::new(RigidBody::new(spec).unwrap())
    };
    let mut below = AgentSpawn::alone("below", ball(5.0, 1.0, 0.5), 90.0);
    below.laws = vec![(AgentId(1), Law::Ledger)];
    vec![below, AgentSpawn::alone("above", ball(5.13, 0.2, -1.0), 700.0)]
}

fn momentum_n_s(run: &dyn Run) -> f64 {
    let of = |at: usize, mass_kg: f64| match &run.agents()[at].latest().body {
        Body::Rigid(rigid) => mass_kg * rigid.velocity.z,
        _ => panic!("no rigid body"),
    };
    of(0, 1.0) + of(1, 0.2)
}

#[test]
fn a_cut_on_threads_loses_no_momentum_that_is_in_flight_between_two_clocks() {
    let start = || Threads::start(two_balls(), Arc::new(SystemClock::new()), Priority::Normal).unwrap();
    let mut in_flight = 0;
    // they meet after 20 ms
    for cut_ms in 14..44 {
        let mut run = start();
        run.drive(TimelineCommand::Leap(SimSpan::from_millis(cut_ms)));
        let end = run.timeline().until().unwrap();
        while run.agents().iter().any(|agent| agent.latest().moment() < end) {
            run.wait_until(run.now() + Duration::from_micros(100));
        }
        in_flight += u32::from((momentum_n_s(&run) - 0.3).abs() > 1e-3);
        let mut archive = Archive::writer();
        run.save(&mut archive).unwrap();
        let bytes = archive.into_bytes();
        let hashes = [0, 1].map(|_| {
            let mut lockstep = Lockstep::start(two_balls(), machine()).unwrap();
            let absent = &mut |_| unreachable!("no agent joined");
            lockstep.archive(&mut Archive::reader(&bytes), absent).unwrap();
            lockstep.drive(TimelineCommand::Run);
            lockstep.wait_until(lockstep.now() + Duration::from_secs(1));
            let end_n_s = momentum_n_s(&lockstep);
            assert!((end_n_s - 0.3).abs() < 1e-9, "cut after {cut_ms} ms: {end_n_s} N·s");
            states(&lockstep).iter().fold(1, |hash, state| state.fold_hash(hash))
        });
        assert_eq!(hashes[0], hashes[1]);
    }
    assert!(in_flight > 0, "no cut fell between the two sides of an impulse");
}
