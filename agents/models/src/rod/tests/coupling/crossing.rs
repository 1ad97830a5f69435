//! A tube that falls across another one and lies on it, each by its own clock.

use super::super::reference_spec;
use super::meetings::{GRAVITY, nodes};
use crate::harness::{Faults, Stage};
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use glam::{DVec2, DVec3};
use metachron_contact::audit::{Member, audit};
use metachron_core::{AgentId, SimTime};

/// How the lower and the upper one lie from 1.2 to 2 seconds on.
struct Lying {
    /// The deepest overlap that the owner saw, metres.
    depth_m: f64,
    /// What the lower one bears, in the weight of the upper one.
    borne: f64,
    /// The highest energy since the start above that of the start, in that of the start.
    rise: f64,
    /// How high the two axes are where they cross: the lowest node of the one, the highest of the other, metres.
    height_m: [f64; 2],
}

/// A tube of this radius and wall, metres, and modulus, Pa, in 24 segments.
fn tube(path_m: Vec<DVec3>, (radius_m, wall_m, young_pa): (f64, f64, f64)) -> TubeSpec {
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(radius_m, wall_m, material);
    let base = TubeSpec { friction: 0.4, damping_per_s: 1.0, ..reference_spec(young_pa, 24) };
    TubeSpec { path_m, section, gravity: GRAVITY, ..base }
}

/// The lower one, held at both ends, along x.
fn rope() -> TubeSpec {
    let path_m = vec![DVec3::new(-0.3, 0.0, 0.2), DVec3::new(0.3, 0.0, 0.2)];
    TubeSpec { clamp: [true; 2], ..tube(path_m, (0.014, 0.003, 4e5)) }
}

/// The upper one, held at its start, along y: a hose of 1e5 Pa is clamped, a lever of any modulus turns there.
fn hose(young_pa: f64, lever: bool) -> TubeSpec {
    let path_m = vec![DVec3::new(0.02, -0.2, 0.24), DVec3::new(0.02, 0.2, 0.24)];
    TubeSpec { clamp: [!lever, false], pin: [lever, false], ..tube(path_m, (0.011, 0.002, young_pa)) }
}

/// Lets the hose fall across the rope at these rates, Hz.
fn cross(rates: (f64, f64), hose: TubeSpec, faults: Faults) -> Lying {
    let mut stage = Stage::new(faults);
    let specs = [rope(), hose];
    let [rope, hose] = specs.clone().map(|spec| Tube::new(spec).unwrap());
    let ids = [stage.add(rope, rates.0), stage.add(hose, rates.1)];
    let energy_j = |stage: &Stage| {
        let member = |id: AgentId| {
            let Section { mass_per_length_kg_m, rotary_kg_m, .. } = specs[id.0 as usize].section;
            Member { id, snapshot: stage.newest(id), mass_per_length_kg_m, rotary_kg_m }
        };
        audit(&ids.map(member), SimTime::ZERO, &mut |_, _| 0.0).energy_j
    };
    let first_j = energy_j(&stage);
    let mut rise_j = f64::MIN;
    stage.run(1.2, |stage| rise_j = rise_j.max(energy_j(stage) - first_j));
    let given = |stage: &Stage| -> f64 {
        ids.iter().flat_map(|id| &stage.newest(*id).pairs).map(|pair| pair.impulse_n_s).sum()
    };
    let (before, mut depth_m) = (given(&stage), 0.0_f64);
    stage.run(2.0, |stage| {
        rise_j = rise_j.max(energy_j(stage) - first_j);
        let pairs = ids.iter().flat_map(|id| &stage.newest(*id).pairs);
        depth_m = pairs.map(|pair| pair.penetration_m).fold(depth_m, f64::max);
    });
    let borne = (given(&stage) - before) / 0.8 / (0.4 * specs[1].section.mass_per_length_kg_m * 9.81);
    let near = |id: AgentId| {
        let at = |x: &&DVec3| x.truncate().distance(DVec2::X * 0.02) < 0.03;
        nodes(stage.newest(id)).iter().filter(at).map(|x| x.z)
    };
    let height_m = [near(ids[0]).fold(f64::INFINITY, f64::min), near(ids[1]).fold(f64::NEG_INFINITY, f64::max)];
    Lying { depth_m, borne, rise: rise_j / first_j, height_m }
}

#[test]
fn a_tube_lies_across_another_one_whatever_their_clocks() {
    let held_is_fast = [(1000.0, 200.0), (1000.0, 60.0), (1000.0, 30.0), (200.0, 10.0), (60.0, 5.0)];
    let held_is_slow = [(200.0, 1000.0), (60.0, 360.0), (30.0, 1000.0), (10.0, 1000.0), (10.0, 20.0)];
    // one clock gains on the other, step by step
    let beating = [(240.0, 200.0), (200.0, 240.0), (120.0, 100.0)];
    let equal = [(60.0, 60.0), (30.0, 30.0), (10.0, 10.0)];
    for rates in held_is_fast.into_iter().chain(held_is_slow).chain(beating).chain(equal) {
        let Lying { depth_m, borne, rise, .. } = cross(rates, hose(1e5, false), Faults::default());
        println!("{rates:?}: depth {depth_m:e} borne {borne} rise {rise:e}");
        assert!(depth_m < 2e-3, "{rates:?}: {depth_m} m deep");
        // its clamp bears the rest: a quarter to a third while it still swings
        assert!(borne > 0.6 && borne < 1.1, "{rates:?}: {borne} of its weight");
        assert!(rise < 0.01, "{rates:?}: energy rises by {rise} of the start");
    }
}

#[test]
fn a_slow_tube_lies_on_a_fast_one_as_it_does_at_equal_clocks() {
    for (young_pa, lever) in [(5e4, false), (1e5, false), (1e6, false), (1e6, true), (1e7, true)] {
        let at_equal = cross((1000.0, 1000.0), hose(young_pa, lever), Faults::default());
        for rates in [(60.0, 20.0), (240.0, 10.0), (1000.0, 10.0), (100.0, 5.0)] {
            let Lying { depth_m, borne, rise, height_m } = cross(rates, hose(young_pa, lever), Faults::default());
            let off_m = [0, 1].map(|k| (height_m[k] - at_equal.height_m[k]).abs());
            println!(
                "{young_pa:e} {rates:?}: depth {depth_m:.1e} borne {borne:.3} of {:.3} rise {rise:.1e} off {off_m:.4?}",
                at_equal.borne
            );
            assert!(depth_m < 2e-3, "{young_pa} Pa, {rates:?}: {depth_m} m deep");
            assert!((borne - at_equal.borne).abs() < 0.05, "{young_pa} Pa, {rates:?}: {borne} of {}", at_equal.borne);
            // they still swing, each clock with its own damping; one that passed through would be two radii lower
            assert!(off_m.iter().all(|off_m| *off_m < 0.011), "{young_pa} Pa, {rates:?}: {off_m:?} m off");
            assert!(rise < 0.01, "{young_pa} Pa, {rates:?}: energy rises by {rise} of the start");
        }
    }
}

#[test]
fn a_tube_lies_across_one_of_its_rate_whether_it_sees_its_newest_state_or_the_one_before() {
    for (hz, seed) in [240.0, 120.0, 60.0, 20.0].into_iter().flat_map(|hz| [1, 2, 3].map(|seed| (hz, seed))) {
        let faults = Faults { late: 1, seed, ..Faults::default() };
        let Lying { depth_m, borne, rise, .. } = cross((hz, hz), hose(1e5, false), faults);
        println!("{hz}: depth {depth_m:e} borne {borne} rise {rise:e}");
        assert!(depth_m < 2e-3, "{hz} Hz: {depth_m} m deep");
        assert!(borne > 0.6 && borne < 1.1, "{hz} Hz: {borne} of its weight");
        assert!(rise < 0.01, "{hz} Hz: energy rises by {rise} of the start");
    }
}

/// What one of them took late was expected to yield as what it had at once: 1.4 mm deep once a second, 0.5 and 1 mm where steps vary.
#[test]
fn a_tube_lies_across_one_whose_clock_stands_apart_by_part_of_a_step() {
    let drifting = [1e5, 1e6].map(|young_pa| ((240.0, 241.0), young_pa, 0.0, 1e-4));
    let trembling = [((240.0, 240.0), 1e5, 0.01, 2e-4), ((120.0, 120.0), 1e5, 0.01, 6e-4)];
    for (rates, young_pa, jitter, most_m) in drifting.into_iter().chain(trembling) {
        let faults = Faults { jitter, seed: 2, ..Faults::default() };
        let Lying { depth_m, rise, .. } = cross(rates, hose(young_pa, false), faults);
        println!("{rates:?}, {young_pa:e} Pa: depth {depth_m:e} rise {rise:e}");
        assert!(depth_m < most_m, "{rates:?}, {young_pa} Pa: {depth_m} m deep");
        assert!(rise < 0.01, "{rates:?}, {young_pa} Pa: energy rises by {rise} of the start");
    }
}

#[test]
fn a_slow_tube_lies_on_a_fast_one_where_messages_are_late_or_lost() {
    for (rates, seed) in [((1000.0, 10.0), 1), ((240.0, 20.0), 2), ((240.0, 200.0), 3), ((120.0, 100.0), 4)] {
        let faults = Faults { jitter: 0.2, loss: 0.1, seed, ..Faults::default() };
        let Lying { depth_m, borne, rise, .. } = cross(rates, hose(1e5, false), faults);
        println!("{rates:?}: depth {depth_m:e} borne {borne} rise {rise:e}");
        assert!(depth_m < 5e-3, "{rates:?}: {depth_m} m deep");
        assert!(borne > 0.6 && borne < 1.1, "{rates:?}: {borne} of its weight");
        assert!(rise < 0.01, "{rates:?}: energy rises by {rise} of the start");
    }
}
