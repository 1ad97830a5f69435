//! What lies on tubes that own the contact stays where it is, whatever the clocks, and slides where Coulomb says.

use super::super::reference_spec;
use super::meetings::{GRAVITY, RADIUS};
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};
use glam::{DVec2, DVec3};
use metachron_core::{AgentId, Body, Snapshot};
use metachron_geometry::Solid;

/// Faster than this is no rest, m/s.
const CREEP_M_S: f64 = 1e-4;
/// Half of a cube.
const CUBE: DVec3 = DVec3::splat(0.04);
/// Half of a plate that reaches far beyond the tubes.
const PLATE: DVec3 = DVec3::new(0.04, 0.3, 0.01);

/// Gravity on a slope of 12° down `along`, which lies across z: tan 12° = 0.2126.
fn slope(along: DVec3) -> DVec3 {
    let (sin, cos) = (libm::sin(12.0_f64.to_radians()), libm::cos(12.0_f64.to_radians()));
    (along * sin - DVec3::Z * cos) * 9.81
}

/// Where the middle of a body is, metres.
fn middle(snapshot: &Snapshot) -> DVec3 {
    match &snapshot.body {
        Body::Rigid(body) => body.position,
        Body::Curve(curve) => curve.positions[curve.positions.len() / 2],
        other => panic!("{other:?}"),
    }
}

/// A box of 0.1 kg, half of it given and where it begins along y, and the friction of everything.
struct Load {
    half: DVec3,
    y: f64,
    friction: f64,
}

impl Load {
    /// On two tubes of this modulus along y that are clamped at both ends, with the rates of the tubes and the box, Hz.
    fn on_tubes(&self, young_pa: f64, gravity: DVec3, rates: (f64, f64)) -> (Stage, AgentId) {
        let Self { half, y, friction } = *self;
        let mut stage = Stage::new(Faults::default());
        for x in [-0.025, 0.025] {
            let path_m = vec![DVec3::new(x, -0.1, 0.0), DVec3::new(x, 0.1, 0.0)];
            let base = TubeSpec { damping_per_s: 3.0, clamp: [true; 2], ..reference_spec(young_pa, 20) };
            stage.add(Tube::new(TubeSpec { path_m, gravity, friction, ..base }).unwrap(), rates.0);
        }
        let position = DVec3::new(0.0, y, half.z + RADIUS + 1e-4);
        let free = RigidSpec::free(Solid::Box { half_extents_m: half }, position, 0.1);
        let id = stage.add(RigidBody::new(RigidSpec { gravity, friction, ..free }).unwrap(), rates.1);
        (stage, id)
    }
}

/// The mean velocity of the middle of a body from one time to another, seconds, m/s, seen by both orders of turns at one time.
fn velocities(stage: impl Fn() -> (Stage, AgentId), [from, to]: [f64; 2]) -> [DVec3; 2] {
    [false, true].map(|at_once| {
        let (mut stage, id) = stage();
        stage.at_once = at_once;
        stage.run(from, |_| {});
        let (before, began) = (middle(stage.newest(id)), stage.newest(id).time);
        stage.run(to, |_| {});
        (middle(stage.newest(id)) - before) / stage.newest(id).time.secs_after(began)
    })
}

#[test]
fn a_cube_on_two_tubes_of_a_slope_does_not_creep() {
    let cube = Load { half: CUBE, y: 0.0, friction: 0.5 };
    let slow = [(60.0, 60.0), (60.0, 61.0), (60.0, 240.0), (240.0, 60.0)];
    let rates = slow.into_iter().chain([(240.0, 240.0), (1000.0, 240.0), (240.0, 1000.0)]);
    for (rates, down) in rates.flat_map(|rates| [DVec3::X, DVec3::Y].map(|down| (rates, down))) {
        let creep = velocities(|| cube.on_tubes(1e6, slope(down), rates), [2.0, 4.0]).map(DVec3::length);
        println!("{rates:?} down {down}: {creep:?} m/s");
        assert!(creep.iter().all(|v| *v < CREEP_M_S), "{rates:?} down {down}: it creeps at {creep:?} m/s");
    }
}

#[test]
fn a_plate_slides_down_two_tubes_as_coulomb_says() {
    let gravity = slope(DVec3::Y);
    for rates in [(240.0, 240.0), (60.0, 60.0), (1000.0, 240.0), (240.0, 1000.0)] {
        for friction in [0.15, 0.18] {
            let plate = Load { half: PLATE, y: -0.06, friction };
            let made = || plate.on_tubes(1e8, gravity, rates);
            let [early, late] = [[0.1, 0.2], [0.3, 0.4]].map(|span| velocities(made, span));
            let (wanted, gained) = (gravity.y + friction * gravity.z, [0, 1].map(|k| (late[k] - early[k]).y / 0.2));
            println!("{rates:?}, {friction}: {gained:?} of {wanted} m/s²");
            // 2 % of what friction takes
            let off = gained.map(|a| (a - wanted).abs());
            let most = 0.02 * friction * -gravity.z;
            assert!(off.iter().all(|off| *off < most), "{rates:?}, {friction}: {gained:?} of {wanted} m/s²");
        }
    }
}

/// A tube of 30 cm laid across the middle of one that is held at both ends, with the rate of both, Hz.
fn tube_across(hz: f64) -> (Stage, [AgentId; 2]) {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let made = |path_m: Vec<DVec3>, (radius_m, wall_m): (f64, f64), held: bool| {
        let section = Section::hollow(radius_m, wall_m, material);
        let base = TubeSpec { friction: 0.5, damping_per_s: 2.0, gravity: GRAVITY, ..reference_spec(1e6, 24) };
        Tube::new(TubeSpec { path_m, section, clamp: [held; 2], ..base }).unwrap()
    };
    let mut stage = Stage::new(Faults::default());
    let lower = made(vec![DVec3::X * -0.2, DVec3::X * 0.2], (0.014, 0.003), true);
    let upper = made(vec![DVec3::new(0.0, -0.15, 0.026), DVec3::new(0.0, 0.15, 0.026)], (0.011, 0.002), false);
    let ids = [stage.add(lower, hz), stage.add(upper, hz)];
    (stage, ids)
}

#[test]
fn a_tube_laid_across_a_held_one_stays_on_it() {
    for hz in [60.0, 240.0, 1000.0] {
        for at_once in [false, true] {
            let (mut stage, [_, upper]) = tube_across(hz);
            stage.at_once = at_once;
            stage.run(3.0, |_| {});
            let laid = middle(stage.newest(upper));
            stage.run(10.0, |_| {});
            let at = middle(stage.newest(upper));
            println!("{hz} Hz, {at_once}: from {laid} to {at}");
            // it still rolls to and fro along the other by a tenth of a millimetre
            let gone: DVec2 = (at - laid).truncate();
            assert!(gone.length() < 7.0 * CREEP_M_S, "{hz} Hz, {at_once}: it went from {laid} to {at} m in 7 s");
        }
    }
}
