//! Tubes and rigid bodies, each owning the pair in its turn, and laws that need no ledger.

use super::super::{millis, reference_spec};
use super::Prop;
use super::meetings::{GRAVITY, RADIUS, bar, nodes, thrown};
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::TubeSpec;
use glam::{DQuat, DVec3};
use metachron_contact::Law;
use metachron_contact::{Agent, Neighbour, StepContext};
use metachron_core::{AgentId, Body, SimTime, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use std::sync::Arc;

/// A floor at z = 0.
pub(super) fn floor() -> Obstacle {
    Obstacle {
        name: String::new(),
        solid: Solid::Plane,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    }
}

/// A box of half height 2 cm, 10 cm long and wide, with its middle at `position`.
pub(super) fn block(mass_kg: f64, position: DVec3, gravity: DVec3) -> RigidBody {
    let solid = Solid::Box { half_extents_m: DVec3::new(0.05, 0.05, 0.02) };
    RigidBody::new(dropped(solid, mass_kg, position, gravity)).unwrap()
}

/// A solid that is let go at `position`, above a floor where there is gravity.
pub(super) fn dropped(solid: Solid, mass_kg: f64, position: DVec3, gravity: DVec3) -> RigidSpec {
    let obstacles = if gravity == DVec3::ZERO { Arc::from([]) } else { Arc::from([floor()]) };
    RigidSpec { gravity, obstacles, ..RigidSpec::free(solid, position, mass_kg) }
}

fn lowest_over(stage: &Stage, tube: AgentId, block: AgentId) -> f64 {
    let Body::Rigid(body) = &stage.newest(block).body else { panic!("a body") };
    let near = nodes(stage.newest(tube)).iter().filter(|x| (x.x - body.position.x).abs() < 0.04);
    near.map(|x| x.z - body.position.z - 0.02 - RADIUS).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_tube_lies_over_a_block_on_the_floor_at_any_rates() {
    let equal = [(250.0, 250.0), (60.0, 60.0)];
    let apart = [(1000.0, 60.0), (500.0, 10.0), (120.0, 1000.0), (60.0, 1000.0), (30.0, 1000.0), (20.0, 240.0)];
    for rates in equal.into_iter().chain(apart) {
        let mut stage = Stage::new(Faults::default());
        let path_m = vec![DVec3::new(-0.15, 0.0, 0.07), DVec3::new(0.15, 0.0, 0.07)];
        let base = TubeSpec { friction: 0.5, damping_per_s: 3.0, ..reference_spec(1e6, 30) };
        let tube = stage.add(Tube::new(TubeSpec { path_m, gravity: GRAVITY, ..base }).unwrap(), rates.0);
        let block = stage.add(block(0.3, DVec3::Z * 0.0201, GRAVITY), rates.1);
        stage.run(3.0, |_| {});
        let gap = lowest_over(&stage, tube, block);
        let fast = stage.newest(tube).bounds.unwrap().speed_m_s;
        let Body::Rigid(body) = &stage.newest(block).body else { panic!("a body") };
        println!("{rates:?}: gap {gap} fast {fast} block {} {}", body.position, body.velocity.length());
        assert!(gap > -5e-3 && gap < 2e-3, "{rates:?}: {gap} m over the block");
        // between two steps at 60 Hz it falls up to 0.16 m/s faster
        assert!(fast < 5e-2, "{rates:?}: still moves at {fast} m/s");
        assert!((body.position.z - 0.02).abs() < 1e-3, "{rates:?}: the block is at {}", body.position);
    }
}

#[test]
fn a_tube_thrown_at_a_block_keeps_the_momentum_of_both_whoever_owns_the_pair() {
    for rates in [(1000.0, 1000.0), (1000.0, 60.0), (60.0, 1000.0), (250.0, 100.0), (1000.0, 10.0), (10.0, 1000.0)] {
        let mut stage = Stage::new(Faults::default());
        let path = vec![DVec3::new(-0.2, 0.01, 0.06), DVec3::new(0.22, 0.01, 0.06)];
        let tube = stage.add(thrown(path, 20, DVec3::new(0.1, 0.0, -1.0)), rates.0);
        let block = stage.add(block(0.1, DVec3::ZERO, DVec3::ZERO), rates.1);
        let start = stage.momentum();
        let first = stage.newest(tube).energy_j;
        let mut drift = 0.0_f64;
        stage.run(0.5, |stage| drift = drift.max((stage.momentum() - start).length() / start.length()));
        let last = (stage.newest(tube).energy_j + stage.settled(block, 0.5).kinetic_j()) / first;
        let down = stage.settled(block, 0.5).state.velocity.z;
        println!("{rates:?}: drift {drift:e} last {last} down {down}");
        assert!(down < -0.2, "{rates:?}: they never met");
        assert!(drift < 1e-6, "{rates:?}: momentum drifts by {drift}"); // the block's own world is in single precision
        assert!(last < 1.01, "{rates:?}: energy ends at {last}");
    }
}

#[test]
fn a_tube_that_starts_inside_a_bar_comes_out_slowly() {
    let mut stage = Stage::new(Faults::default());
    let deep = RADIUS + 0.02 - 0.008;
    let path = vec![DVec3::new(-0.2, 0.0, deep), DVec3::new(0.2, 0.0, deep)];
    let tube = stage.add(thrown(path, 20, DVec3::ZERO), 500.0);
    let bar = stage.add(bar(0.1, DVec3::ZERO, 0.5), 100.0);
    let mut least = f64::INFINITY;
    stage.run(1.0, |stage| {
        let pair = stage.newest(tube).pairs.first().and_then(|pair| pair.tank_j);
        least = least.min(pair.unwrap_or(least));
    });
    let energy = stage.newest(tube).energy_j + stage.settled(bar, 1.0).kinetic_j();
    let apart = nodes(stage.newest(tube))[10].z - stage.settled(bar, 1.0).state.position.z;
    println!("energy {energy} least {least} apart {apart} of {}", RADIUS + 0.02);
    assert!(least < f64::INFINITY, "no tank is told");
    assert!(apart > RADIUS + 0.02 - 1e-3, "still {apart} m apart");
    // reduced mass 43 g; no push-out is faster than half a metre a second
    assert!(energy < 0.5 * 0.043 * 0.25, "{energy} J from a push-out");
}

#[test]
fn a_penalty_bears_a_tube_by_its_stiffness_times_its_depth() {
    let mut stage = Stage::new(Faults::default());
    let path_m = vec![DVec3::new(-0.1, 0.0, 0.04), DVec3::new(0.1, 0.0, 0.04)];
    let base = TubeSpec { friction: 0.0, damping_per_s: 10.0, ..reference_spec(1e8, 10) };
    // without friction: explicit as it is, it would chatter
    let weight = 0.2 * base.section.mass_per_length_kg_m * 9.81;
    let tube = stage.add(Tube::new(TubeSpec { path_m, gravity: GRAVITY, ..base }).unwrap(), 500.0);
    let table = Solid::Box { half_extents_m: DVec3::new(0.3, 0.3, 0.02) };
    let table = stage.add(Prop::new(table, f64::INFINITY, DVec3::ZERO, 0.5), 100.0);
    stage.law(tube, table, Law::Penalty { stiffness_n_m: 20.0, damping_n_s_m: 0.2, extrapolate: false });
    stage.run(3.0, |_| {});
    let pair = stage.newest(tube).pairs[0];
    println!("{pair:?} weight {weight}");
    assert!((pair.force_n / weight - 1.0).abs() < 0.02, "{} N bear {weight} N", pair.force_n);
    // all places alike: n k d = weight, as the tube is stiff
    let carried = f64::from(pair.contacts) * 20.0 * pair.penetration_m;
    assert!(carried > 0.9 * weight && carried < 1.3 * weight, "{carried} N");
    assert!(stage.newest(tube).given.iter().all(|ledger| ledger.pages.iter().all(|p| p.entries.is_empty())));
}

#[test]
fn wave_variables_part_a_tube_and_a_block_without_gaining_energy() {
    for rates in [(500.0, 500.0), (500.0, 60.0), (60.0, 500.0)] {
        let mut stage = Stage::new(Faults::default());
        let path = vec![DVec3::new(-0.2, 0.0, 0.05), DVec3::new(0.2, 0.0, 0.05)];
        let tube = stage.add(thrown(path, 20, DVec3::Z * -0.3), rates.0);
        let block = stage.add(block(0.1, DVec3::ZERO, DVec3::ZERO), rates.1);
        stage.law(tube, block, Law::Tlm { stiffness_n_m: 100.0, damping_n_s_m: 0.0 });
        let first = stage.newest(tube).energy_j;
        let (mut most, mut extra) = (0.0_f64, 0.0_f64);
        stage.run(1.0, |stage| {
            let now = stage.newest(tube).energy_j + stage.settled(block, 1.0).kinetic_j();
            most = most.max(now / first);
            extra = stage.newest(tube).pairs.first().map_or(extra, |pair| pair.parasitic_kg.max(extra));
        });
        let down = stage.settled(block, 1.0).state.velocity.z;
        println!("{rates:?}: most {most} down {down} extra {extra}");
        assert!(down < -0.02, "{rates:?}: they never met: {down}");
        assert!(extra > 0.0, "{rates:?}: the line's own mass is not told");
        assert!(most < 1.05, "{rates:?}: energy rises to {most}");
    }
}

#[test]
fn a_law_that_is_off_lets_them_pass() {
    let mut stage = Stage::new(Faults::default());
    let path = vec![DVec3::new(-0.2, 0.0, 0.05), DVec3::new(0.2, 0.0, 0.05)];
    let tube = stage.add(thrown(path, 20, DVec3::Z * -1.0), 500.0);
    let bar = stage.add(bar(0.1, DVec3::ZERO, 0.5), 100.0);
    stage.law(tube, bar, Law::Off);
    stage.run(0.2, |_| {});
    assert!((nodes(stage.newest(tube))[10].z + 0.15).abs() < 1e-9);
}

#[test]
fn a_tube_knocks_at_a_sleeper_that_owns_the_pair() {
    let path = vec![DVec3::new(-0.2, 0.0, 0.05), DVec3::new(0.2, 0.0, 0.05)];
    let mut tube = thrown(path, 20, DVec3::Z * -1.0);
    let sleeper = bar(0.1, DVec3::ZERO, 0.5);
    let mut seen = Snapshot::default();
    sleeper.write_snapshot(&mut seen);
    for (at_rest, knocks) in [(true, true), (false, false)] {
        let snapshot = Arc::new(Snapshot { at_rest, ..seen.clone() });
        let near = Neighbour { form: sleeper.form(), ..Neighbour::observed(AgentId(3), snapshot) };
        let neighbours = std::slice::from_ref(&near);
        let around = StepContext { neighbours, ..StepContext::alone(AgentId(0), SimTime::ZERO) };
        tube.step(millis(10.0), &around).unwrap();
        let mut shown = Snapshot::default();
        tube.write_snapshot(&mut shown);
        assert_eq!(shown.touches.contains(&AgentId(3)), knocks, "at rest {at_rest}");
    }
}
