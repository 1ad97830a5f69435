//! A block that stands on two tubes: both own their contact with it, and each has a clock of its own.
//!
//! Independent answers: it stands level, at rest, and energy at a common time never rises.

use super::super::reference_spec;
use super::bodies::floor;
use super::meetings::{GRAVITY, RADIUS};
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use glam::DVec3;
use metachron_contact::audit::{Member, audit};
use metachron_core::{AgentId, SimTime};
use metachron_geometry::Solid;

const HALF: DVec3 = DVec3::new(0.06, 0.03, 0.02);
const FALL_M: f64 = 0.005;
const IDS: [AgentId; 3] = [AgentId(0), AgentId(1), AgentId(2)];
/// Clocks agree to within this, seconds: sixtieths are not whole nanoseconds.
const SAME_S: f64 = 1e-5;
/// Rates of the tubes and of the block, Hz.
const RATES: [[f64; 3]; 16] = [
    [1000.0, 1000.0, 1000.0],
    [1000.0, 1000.0, 10.0],
    [100.0, 100.0, 1000.0],
    [60.0, 60.0, 60.0],
    [60.0, 50.0, 1000.0],
    [1000.0, 100.0, 200.0],
    [500.0, 50.0, 25.0],
    [1000.0, 20.0, 1000.0],
    [10.0, 1000.0, 1000.0],
    [1000.0, 10.0, 100.0],
    [10.0, 1000.0, 10.0],
    [1000.0, 60.0, 10.0],
    [200.0, 5.0, 60.0],
    [20.0, 20.0, 1000.0],
    [10.0, 10.0, 1000.0],
    [10.0, 10.0, 10.0],
];

/// How the block lies from two to four seconds on, when all clocks agree.
struct Lying {
    /// Between which heights, metres.
    low_m: f64,
    high_m: f64,
    /// How far its upper face leans, and the deepest overlap that a tube saw, metres.
    lean: f64,
    depth_m: f64,
    /// The highest energy since the start above that of the start, in that of the fall.
    rise: f64,
}

fn tube(x: f64) -> TubeSpec {
    let path_m = vec![DVec3::new(x, -0.1, 0.0), DVec3::new(x, 0.1, 0.0)];
    let base = reference_spec(1e6, 20);
    TubeSpec { path_m, gravity: GRAVITY, friction: 0.5, damping_per_s: 3.0, clamp: [true; 2], ..base }
}

fn block(mass_kg: f64) -> RigidBody {
    let position = DVec3::Z * (HALF.z + RADIUS + FALL_M);
    let free = RigidSpec::free(Solid::Box { half_extents_m: HALF }, position, mass_kg);
    RigidBody::new(RigidSpec { gravity: GRAVITY, ..free }).unwrap()
}

/// The common time, where all clocks agree.
fn common(stage: &Stage) -> Option<SimTime> {
    let times = IDS.map(|id| stage.newest(id).time);
    let (first, last) = (times.into_iter().min()?, times.into_iter().max()?);
    (last.secs_after(first) < SAME_S).then_some(last)
}

fn lie(rates: [f64; 3], mass_kg: f64) -> Lying {
    let mut stage = Stage::new(Faults::default());
    let specs = [-0.04, 0.04].map(tube);
    let (mass_per_length_kg_m, rotary_kg_m) = (specs[0].section.mass_per_length_kg_m, specs[0].section.rotary_kg_m);
    for (spec, hz) in specs.into_iter().zip(rates) {
        stage.add(Tube::new(spec).unwrap(), hz);
    }
    stage.add(block(mass_kg), rates[2]);
    let energy_j = |stage: &Stage, at| {
        let members = IDS.map(|id| Member { id, snapshot: stage.newest(id), mass_per_length_kg_m, rotary_kg_m });
        audit(&members, at, &mut |_, state| -mass_kg * GRAVITY.dot(state.position)).energy_j
    };
    let first_j = energy_j(&stage, SimTime::ZERO);
    let scale_j = mass_kg * GRAVITY.length() * FALL_M;
    let (low_m, high_m) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut lying = Lying { low_m, high_m, lean: 0.0, depth_m: 0.0, rise: f64::MIN };
    stage.run(4.0, |stage| {
        let Some(at) = common(stage) else { return };
        lying.rise = lying.rise.max((energy_j(stage, at) - first_j) / scale_j);
        if at.as_secs_f64() > 2.0 {
            let body = stage.settled(IDS[2], at.as_secs_f64()).state;
            lying.low_m = lying.low_m.min(body.position.z);
            lying.high_m = lying.high_m.max(body.position.z);
            lying.lean = lying.lean.max((body.rotation * DVec3::Z).truncate().length());
            let pairs = IDS.iter().flat_map(|id| &stage.newest(*id).pairs);
            lying.depth_m = pairs.map(|pair| pair.penetration_m).fold(lying.depth_m, f64::max);
        }
    });
    lying
}

#[test]
fn a_block_stands_on_two_tubes_of_any_clocks() {
    for rates in RATES {
        let Lying { low_m, high_m, lean, depth_m, rise } = lie(rates, 0.1);
        let hop_m = high_m - low_m;
        println!(
            "{rates:?}: rise {rise:.1e}, hops {hop_m:.1e} m above {low_m:.4} m, leans {lean:.1e}, {depth_m:.1e} m deep"
        );
        assert!(rise < 0.01, "{rates:?}: energy rises by {rise} of that of the fall");
        assert!(hop_m < 1e-4 && depth_m < 1e-4, "{rates:?}: it hops by {hop_m} m, {depth_m} m deep");
        assert!(lean < 3e-3, "{rates:?}: it leans by {lean}");
        // the tubes sag by less than 2 mm under it
        assert!((low_m - HALF.z - RADIUS).abs() < 3e-3, "{rates:?}: it lies at {low_m} m");
    }
}

/// A tube of 20 cm on the floor.
pub(super) fn laid(x: f64) -> TubeSpec {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let path_m = vec![DVec3::new(x, -0.1, 0.01), DVec3::new(x, 0.1, 0.01)];
    let free = TubeSpec::free(path_m, Section::hollow(0.01, 0.002, material), 8);
    TubeSpec { friction: 0.5, damping_per_s: 2.0, gravity: GRAVITY, obstacles: [floor()].into(), ..free }
}

/// Either tube took what the other gave for lasting evenly and not for blows, and both set right at once what the box had tipped by: it
/// rocked ever more, was thrown off or fell between them.
#[test]
fn a_box_on_two_tubes_that_lie_on_the_floor_stays_on_them() {
    let slow = [[60.0, 60.0, 60.0], [60.0, 60.0, 240.0], [120.0, 120.0, 120.0]];
    for (rates, mass_kg, fall_m) in slow.into_iter().flat_map(|r| [(r, 0.5, 1e-4), (r, 10.0, 1e-4), (r, 2.0, 0.03)]) {
        let mut stage = Stage::new(Faults::default());
        stage.at_once = true;
        for (x, hz) in [-0.03, 0.03].into_iter().zip(rates) {
            stage.add(Tube::new(laid(x)).unwrap(), hz);
        }
        let solid = Solid::Box { half_extents_m: DVec3::new(0.05, 0.04, 0.02) };
        let free = RigidSpec::free(solid, DVec3::Z * (0.04 + fall_m), mass_kg);
        let spec = RigidSpec { gravity: GRAVITY, friction: 0.5, obstacles: [floor()].into(), ..free };
        let id = stage.add(RigidBody::new(spec).unwrap(), rates[2]);
        let (mut depth_m, mut tank_j) = (0.0_f64, 0.0_f64);
        stage.run(3.0, |stage| {
            let pairs = || IDS[..2].iter().flat_map(|id| &stage.newest(*id).pairs);
            depth_m = pairs().map(|pair| pair.penetration_m).fold(depth_m, f64::max);
            tank_j = pairs().filter_map(|pair| pair.tank_j).fold(tank_j, f64::min);
        });
        let at = stage.settled(id, 3.0).state.position;
        println!("{rates:?}, {mass_kg} kg from {fall_m} m: at {at}, {depth_m} m deep, {tank_j} J");
        // it falls through a step of its own before it reads what bears it
        let step_m = 9.81 / (rates[2] * rates[2]);
        assert!(at.truncate().length() < 2e-4, "{rates:?}, {mass_kg} kg from {fall_m} m: it has gone to {at}");
        assert!((at.z - 0.04).abs() < 2e-4 + step_m, "{rates:?}, {mass_kg} kg from {fall_m} m: it is at {at}");
        // what the two give first neither of them knows: it errs by its own fall in a step (eq. 7g)
        let late_m = 1.3 * 9.81 / (rates[0] * rates[0]);
        assert!(depth_m < 2e-4 + late_m, "{rates:?}, {mass_kg} kg from {fall_m} m: {depth_m} m deep");
        let end_m = IDS[..2].iter().flat_map(|id| &stage.newest(*id).pairs).map(|pair| pair.penetration_m);
        assert!(end_m.fold(0.0, f64::max) < 1e-4, "{rates:?}, {mass_kg} kg from {fall_m} m: deep in the end");
        assert!(tank_j > -0.15 * mass_kg, "{rates:?}, {mass_kg} kg from {fall_m} m: {tank_j} J");
    }
}
