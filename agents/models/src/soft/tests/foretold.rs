//! What a soft body tells of its next step, and who relies on it.

use super::meetings::floor;
use super::*;
use crate::harness::{Faults, Stage};
use crate::soft::SoftInertia;
use metachron_contact::Neighbour;
use metachron_contact::beside::leaves_behind;
use metachron_contact::{Law, Link};
use metachron_core::{Anchor, ImpulseResponse};
use std::sync::Arc;

const BALL: SoftShape = SoftShape::Ball { radius_m: 0.035, segments: 4 };

/// Another soft body, out of reach, with steps of 1/60 s that owns the pair or not.
fn another(owned: bool, told_s: f64) -> Neighbour {
    let mut snapshot = Snapshot::default();
    snapshot.body.soft_mut();
    snapshot.inertia.response_mut::<SoftInertia>().span_s = told_s;
    Neighbour { owned, step_s: 1.0 / 60.0, ..Neighbour::observed(AgentId(1), Arc::new(snapshot)) }
}

fn told(body: &SoftBody) -> SoftInertia {
    let mut snapshot = Snapshot::default();
    body.write_snapshot(&mut snapshot);
    assert!(snapshot.inertia.response().is_some(), "{:?}", snapshot.inertia);
    std::mem::take(snapshot.inertia.response_mut())
}

/// One of 16 parts answered a blow as free vertices do, for the whole step in which it was not known.
#[test]
fn a_step_that_was_divided_foretells_a_whole_one() {
    let h = 1.0 / 60.0;
    let beside = [another(false, 0.0)];
    let around = StepContext { neighbours: &beside, ..StepContext::alone(AgentId(0), SimTime::ZERO) };
    let mut shaken = shaken(BALL);
    shaken.velocities.iter_mut().for_each(|v| *v *= 100.0);
    let report = shaken.step(dt(h), &around).unwrap();
    assert!(report.substeps > 1, "it is not divided");
    // a body that stands still in the same shape makes an undivided step from there
    let mut still = SoftBody::new(spec(BALL)).unwrap();
    (still.positions, still.mesh) = (shaken.positions.clone(), shaken.mesh.clone());
    still.predict(h).unwrap();
    let told = told(&shaken);
    assert!((told.span_s - h).abs() < 1e-8, "it foretells {} s", told.span_s); // whole nanoseconds
    for vertex in [0, 31, 62, 124] {
        let mut answers = [vec![DVec3::ZERO; 125], vec![DVec3::ZERO; 125]];
        answers.iter_mut().for_each(|list| list[vertex] = DVec3::new(0.1, 0.2, 0.3));
        told.respond(&mut answers[0], false);
        still.system.respond(&mut answers[1]);
        for (told, made) in answers[0].iter().zip(&answers[1]) {
            assert!(told.distance(*made) < 1e-6 * answers[1][vertex].length(), "{told} for {made}"); // h in nanoseconds
        }
    }
}

/// A body may owe its owner a step as long as those that it makes, not as those that it would make alone: 18 ms of forecasts for 1 ms.
#[test]
fn who_pushes_a_soft_body_is_no_farther_ahead_of_it_than_it_foretells() {
    let other = AgentId(1);
    let here = Anchor::Vertex(0);
    let link =
        [Link { other, here, there: here, stiffness_n_m: 1.0, damping_n_s_m: 0.0, rest_m: 0.0, law: Law::Cluster }];
    for (told_s, ahead_s, waits) in
        [(1e-3, 0.9e-3, false), (1e-3, 1.1e-3, true), (0.01, 0.009, false), (0.01, 0.011, true), (0.0, 0.018, false)]
    {
        let time = SimTime::ZERO + dt(ahead_s);
        let around = StepContext { links: &link, ..StepContext::alone(AgentId(0), time) };
        let neighbour = another(true, told_s);
        let found = leaves_behind(&neighbour, (dt(1.0 / 60.0), neighbour.step_s), &around, || None);
        assert_eq!(found, waits, "{ahead_s} s ahead of steps of {told_s} s");
    }
}

/// A soft block comes down on a soft ball on the floor, each by its own clock: how deep it lies from one second to two, metres, and the
/// least that the tank held, J.
fn pressed(rates: (f64, f64)) -> [f64; 2] {
    let made = |shape, young_pa, position| SoftSpec {
        matter: SoftMatter { young_pa, density_kg_m3: 1050.0, damping_per_s: 3.0, ..MATTER },
        gravity: G,
        position,
        obstacles: [floor()].into(),
        ..spec(shape)
    };
    let mut stage = Stage::new(Faults::default());
    stage.at_once = true;
    let block = SoftShape::Box { size_m: DVec3::new(0.1, 0.1, 0.05), segments: [4, 4, 2] };
    let ball = stage.add(SoftBody::new(made(BALL, 1e5, DVec3::Z * 0.036)).unwrap(), rates.0);
    let block = stage.add(SoftBody::new(made(block, 5e4, DVec3::new(-0.05, -0.05, 0.085))).unwrap(), rates.1);
    let owner = stage.owner([ball, block]);
    let (mut deep_m, mut tank_j) = (0.0_f64, f64::INFINITY);
    stage.run(1.0, |_| {});
    stage.run(2.0, |stage| {
        for pair in &stage.newest(owner).pairs {
            deep_m = deep_m.max(pair.penetration_m);
            tank_j = pair.tank_j.map_or(tank_j, |left| left.min(tank_j));
        }
    });
    [deep_m, tank_j]
}

/// The floor gives the ball 39 m/s²; told no more than 30 of them the block expected it to yield, and was 2 to 7 mm deep.
#[test]
fn a_soft_block_lies_on_a_soft_ball_on_the_floor() {
    let rates = [60.0, 61.0, 62.0].map(|rate| (60.0, rate)).into_iter();
    for rates in rates.chain([(61.0, 60.0), (100.0, 101.0), (120.0, 121.0), (240.0, 60.0), (60.0, 240.0)]) {
        let [deep_m, tank_j] = pressed(rates);
        println!("{rates:?}: {deep_m:.2e} m deep, {tank_j:.2e} J");
        // a tenth of an edge of 14 mm, and of the 0.07 J of the fall what a tank may lend
        assert!(deep_m < 1.4e-3 && tank_j > -0.03, "{rates:?}: {deep_m} m deep, {tank_j} J in the tank");
    }
}
