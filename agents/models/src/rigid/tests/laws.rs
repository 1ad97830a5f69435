//! Rigid bodies that act on each other by other laws than the ledger.

use super::*;
use crate::harness::{Faults, Stage};
use metachron_contact::{Law, Link};
use metachron_core::PairKind;

const RADIUS: f64 = 0.05;

/// Two balls of 0.1 kg and 0.3 kg that fly at each other at 1 m/s: their velocities at the end, and the most kinetic energy
/// on the way, as a share of that at the start.
fn collide(law: Law, rates: [f64; 2], faults: Faults) -> ([f64; 2], f64, Stage) {
    let mut stage = Stage::new(faults);
    let make = |x: f64, speed: f64, mass_kg: f64| {
        let solid = Solid::Ball { radius_m: RADIUS };
        let thrown = RigidSpec {
            velocity: DVec3::X * speed,
            mass_kg,
            gravity: DVec3::ZERO,
            friction: 0.0,
            ..spec(solid, DVec3::X * x)
        };
        RigidBody::new(thrown).unwrap()
    };
    let ids = [(stage.add(make(-0.06, 0.75, 0.1), rates[0])), stage.add(make(0.06, -0.25, 0.3), rates[1])];
    stage.law(ids[0], ids[1], law);
    let start = 0.5 * (0.1 * 0.75 * 0.75 + 0.3 * 0.25 * 0.25);
    let mut most = 0.0_f64;
    stage.run(1.0, |stage| {
        let kinetic: f64 = ids.map(|id| stage.settled(id, 0.0).kinetic_j()).iter().sum();
        most = most.max(kinetic / start);
    });
    (ids.map(|id| stage.settled(id, 1.0).state.velocity.x), most, stage)
}

#[test]
fn a_penalty_at_fine_steps_is_an_elastic_blow() {
    let law = Law::Penalty { stiffness_n_m: 500.0, damping_n_s_m: 0.0, extrapolate: true };
    let ([first, second], _, stage) = collide(law, [10_000.0, 10_000.0], Faults::default());
    let kinds = [(0, 1), (1, 0)]
        .map(|(a, b)| stage.newest(AgentId(a)).pairs.iter().find(|pair| pair.with == AgentId(b)).map(|pair| pair.kind));
    assert!(kinds.contains(&Some(PairKind::PenaltyExtrapolated)), "{kinds:?}");
    // in the frame of their common centre the two swap their signs; stale by a step in some 100 of a half swing
    assert!((first + 0.75).abs() < 0.03 && (second - 0.25).abs() < 0.03, "{first} {second}");
}

#[test]
fn a_stiff_penalty_from_stale_states_gains_energy_and_the_ledger_does_not() {
    let penalty = Law::Penalty { stiffness_n_m: 5000.0, damping_n_s_m: 0.0, extrapolate: false };
    let (_, most, _) = collide(penalty, [1000.0, 60.0], Faults::default());
    assert!(most > 1.05, "{most}");
    let (_, most, _) = collide(Law::Cluster, [1000.0, 60.0], Faults::default());
    assert!(most < 1.0 + 1e-9, "{most}");
}

#[test]
fn wave_variables_never_gain_energy_in_contact_and_part_the_two() {
    for rates in [[1000.0, 1000.0], [1000.0, 60.0], [60.0, 1000.0], [240.0, 10.0]] {
        for stiffness_n_m in [50.0, 5000.0] {
            let law = Law::Tlm { stiffness_n_m, damping_n_s_m: 0.0 };
            let faults = Faults { jitter: 0.2, loss: 0.02, late: 0, seed: 3 };
            let ([first, second], most, stage) = collide(law, rates, faults);
            println!("{rates:?}, {stiffness_n_m} N/m: {first} {second}, {most}");
            assert!(most < 1.01, "{rates:?}, {stiffness_n_m} N/m: {most}");
            assert!(first <= second + 1e-3, "{rates:?}, {stiffness_n_m} N/m: {first} m/s through {second} m/s");
            let pair = stage.newest(AgentId(0)).pairs.iter().find(|pair| pair.with == AgentId(1)).copied();
            assert!(pair.is_none_or(|pair| pair.kind == PairKind::Tlm && pair.parasitic_kg > 0.0));
        }
    }
}

#[test]
fn a_link_by_wave_variables_swings_and_stays_bounded() {
    for rates in [[1000.0, 1000.0], [1000.0, 240.0], [60.0, 1000.0]] {
        let mut stage = Stage::new(Faults::default());
        let make = |x: f64, speed: f64| {
            let solid = Solid::Ball { radius_m: 0.01 };
            let thrown = RigidSpec {
                velocity: DVec3::X * speed,
                mass_kg: 0.2,
                gravity: DVec3::ZERO,
                ..spec(solid, DVec3::X * x)
            };
            RigidBody::new(thrown).unwrap()
        };
        let (first, second) = (stage.add(make(0.0, 0.0), rates[0]), stage.add(make(0.3, 0.5), rates[1]));
        let centre = Anchor::Local(DVec3::ZERO);
        let law = Law::Tlm { stiffness_n_m: 40.0, damping_n_s_m: 0.0 };
        let link = Link {
            other: second,
            here: centre,
            there: centre,
            stiffness_n_m: 40.0,
            damping_n_s_m: 0.0,
            rest_m: 0.3,
            law,
        };
        stage.link(first, link);
        let (mut most, mut farthest, mut nearest) = (0.0_f64, 0.0_f64, f64::INFINITY);
        stage.run(3.0, |stage| {
            let ends = [first, second].map(|id| stage.settled(id, stage.newest(first).time.as_secs_f64()));
            most = most.max(ends[0].kinetic_j() + ends[1].kinetic_j());
            let apart = ends[1].state.position.x - ends[0].state.position.x;
            (farthest, nearest) = (farthest.max(apart), nearest.min(apart));
        });
        println!("{rates:?}: {most} J of 0.025, {nearest} … {farthest} m");
        assert!(most < 0.025 * 1.01, "{rates:?}: {most} J");
        assert!(farthest > 0.305 && farthest < 0.4 && nearest > 0.2, "{rates:?}: {nearest} … {farthest} m");
    }
}

#[test]
fn a_link_by_wave_variables_comes_to_rest_at_its_length_where_it_is_damped() {
    for (rates, rest_m) in
        [([1000.0, 1000.0], 0.1), ([1000.0, 240.0], 0.1), ([100.0, 1000.0], 0.1), ([1000.0, 240.0], 0.0)]
    {
        let mut stage = Stage::new(Faults::default());
        let make = |x: f64| {
            let solid = Solid::Ball { radius_m: 0.01 };
            RigidBody::new(RigidSpec { mass_kg: 0.2, gravity: DVec3::ZERO, ..spec(solid, DVec3::X * x) }).unwrap()
        };
        let (first, second) = (stage.add(make(0.0), rates[0]), stage.add(make(0.3), rates[1]));
        stage.law(first, second, Law::Off);
        let centre = Anchor::Local(DVec3::ZERO);
        let law = Law::Tlm { stiffness_n_m: 40.0, damping_n_s_m: 2.0 };
        let (stiffness_n_m, damping_n_s_m) = (40.0, 2.0);
        stage.link(
            first,
            Link { other: second, here: centre, there: centre, stiffness_n_m, damping_n_s_m, rest_m, law },
        );
        stage.run(4.0, |_| {});
        let ends = [first, second].map(|id| stage.settled(id, 4.0).state);
        let apart = ends[0].position.distance(ends[1].position);
        println!("{rates:?}, rest {rest_m} m: {apart} m, {} {}", ends[0].velocity, ends[1].velocity);
        // what moved before both ends had heard of the line
        assert!((apart - rest_m).abs() < 2e-3, "{rates:?}: {apart} m for {rest_m} m");
        let drift = (ends[0].velocity + ends[1].velocity).length() * 0.2;
        // eight newtons pulled at first
        assert!(drift < 2e-3, "{rates:?}: {drift} kg m/s out of nothing");
    }
}

/// Weight over stiffness is how deep a body lies in what stands, and it goes no deeper, whether it lies on a point or on a face.
#[test]
fn wave_variables_bear_a_body_on_one_that_stands() {
    let ball = Solid::Ball { radius_m: RADIUS };
    let small = Solid::Box { half_extents_m: DVec3::splat(RADIUS) };
    let rates = [[1000.0, 240.0], [240.0, 1000.0], [240.0, 240.0]];
    for (solid, rates) in [ball, small].into_iter().flat_map(|solid| rates.map(|rates| (solid.clone(), rates))) {
        let mut stage = Stage::new(Faults::default());
        let table = RigidSpec { mass_kg: 2.0, obstacles: [floor(0.5)].into(), sleep: false, ..cube(0.1, UP * 0.1) };
        let above = RigidSpec { mass_kg: 0.1, sleep: false, ..spec(solid.clone(), UP * 0.2501) };
        let table = stage.add(RigidBody::new(table).unwrap(), rates[0]);
        let above = stage.add(RigidBody::new(above).unwrap(), rates[1]);
        stage.law(table, above, Law::Tlm { stiffness_n_m: 500.0, damping_n_s_m: 2.0 });
        let (mut early, mut late) = (0.0, 0.0);
        stage.run(4.0, |stage| {
            let now = stage.newest(table).time.as_secs_f64();
            let [low, high] = [table, above].map(|id| stage.settled(id, now).state.position.z);
            (early, late) =
                if now < 2.0 { (0.25 - (high - low) - 0.1, late) } else { (early, 0.25 - (high - low) - 0.1) };
        });
        println!("{solid:?} {rates:?}: {early} m deep after 2 s, {late} m after 4 s");
        // its weight over the stiffness is 2 mm
        assert!(early < 4e-3 && late < 4e-3 && late > -4e-3, "{solid:?} {rates:?}: {early} m, {late} m");
    }
}
