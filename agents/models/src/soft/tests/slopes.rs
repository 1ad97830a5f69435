//! What lies on a slope that bends stays where it is, whatever the clocks, and slides where Coulomb says.

use super::*;
use crate::harness::{Faults, Stage};
use crate::rod::Tube;
use crate::rod::{Material, Section, TubeSpec};

/// Faster than this is no rest, m/s.
const CREEP_M_S: f64 = 1e-4;

/// Gravity on a slope of 12° down x: tan 12° = 0.2126.
fn slope() -> DVec3 {
    let (sin, cos) = (libm::sin(12.0_f64.to_radians()), libm::cos(12.0_f64.to_radians()));
    DVec3::new(sin, 0.0, -cos) * 9.81
}

/// A tube between two points, of this radius and wall, metres, and modulus, Pa.
fn tube(ends: [DVec3; 2], (radius_m, wall_m, young_pa): (f64, f64, f64), friction: f64) -> TubeSpec {
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(radius_m, wall_m, material);
    let segments = (ends[0].distance(ends[1]) / 0.016).ceil() as usize;
    TubeSpec { friction, damping_per_s: 2.0, gravity: slope(), ..TubeSpec::free(ends.to_vec(), section, segments) }
}

/// A piece of tube of 10 cm along the slope, a little above z = 0.
fn piece(friction: f64) -> TubeSpec {
    tube([DVec3::new(-0.05, 0.0, 0.0135), DVec3::new(0.05, 0.0, 0.0135)], (0.012, 0.003, 1e6), friction)
}

/// A block whose bottom is held, its top in z = 0.
fn block(friction: f64) -> SoftSpec {
    SoftSpec {
        matter: SoftMatter { young_pa: 2e5, damping_per_s: 3.0, ..MATTER },
        position: DVec3::new(-0.15, -0.15, -0.12),
        held: vec![Side::Bottom],
        friction,
        gravity: slope(),
        ..spec(SoftShape::Box { size_m: DVec3::new(0.3, 0.3, 0.12), segments: [5, 5, 2] })
    }
}

/// A sheet of 40 cm held all around, its top in z = 0.
fn held_sheet() -> SoftSpec {
    SoftSpec {
        matter: SoftMatter { young_pa: 2e6, damping_per_s: 3.0, ..MATTER },
        position: DVec3::new(-0.2, -0.2, -0.002),
        held: vec![Side::Left, Side::Right, Side::Near, Side::Far],
        gravity: slope(),
        ..spec(SoftShape::Sheet { size_m: [0.4, 0.4], thickness_m: 0.004, segments: [8, 8] })
    }
}

/// How far the middle of a body has come down the slope, metres.
fn down(snapshot: &Snapshot) -> f64 {
    match &snapshot.body {
        Body::Curve(curve) => curve.positions[curve.positions.len() / 2].x,
        other => panic!("{other:?}"),
    }
}

/// The speed down the slope in the mean of the time from `from` to `to`, seconds, m/s, seen by both orders of turns at one time.
fn speeds(mut stage: impl FnMut() -> (Stage, AgentId), [from, to]: [f64; 2]) -> [f64; 2] {
    [false, true].map(|at_once| {
        let (mut stage, id) = stage();
        stage.at_once = at_once;
        stage.run(from, |_| {});
        let before = down(stage.newest(id));
        stage.run(to, |_| {});
        (down(stage.newest(id)) - before) / (to - from)
    })
}

/// A tube on a soft body, with the rates of the body and the tube, Hz.
fn laid(tube: TubeSpec, on: SoftSpec, rates: (f64, f64)) -> (Stage, AgentId) {
    let mut stage = Stage::new(Faults::default());
    stage.add(SoftBody::new(on).unwrap(), rates.0);
    let id = stage.add(Tube::new(tube).unwrap(), rates.1);
    (stage, id)
}

#[test]
fn a_tube_on_a_soft_solid_does_not_creep_at_any_rates() {
    for rates in [(240.0, 240.0), (1000.0, 240.0), (240.0, 1000.0), (60.0, 60.0), (30.0, 1000.0), (1000.0, 30.0)] {
        let made = || laid(piece(0.5), block(0.5), rates);
        let speeds = speeds(made, [1.0, 2.0]);
        println!("{rates:?}: {speeds:?} m/s");
        assert!(speeds.iter().all(|v| v.abs() < CREEP_M_S), "{rates:?}: it creeps at {speeds:?} m/s");
    }
}

#[test]
fn a_tube_on_a_sheet_does_not_creep_where_the_sheet_is_not_faster() {
    for rates in [(240.0, 240.0), (60.0, 60.0), (240.0, 1000.0), (60.0, 1000.0)] {
        let made = || laid(piece(0.5), held_sheet(), rates);
        let speeds = speeds(made, [3.0, 4.0]);
        println!("{rates:?}: {speeds:?} m/s");
        assert!(speeds.iter().all(|v| v.abs() < CREEP_M_S), "{rates:?}: it creeps at {speeds:?} m/s");
    }
}

#[test]
fn a_tube_on_a_soft_solid_slides_as_coulomb_says() {
    let wanted = |friction: f64| slope().x + friction * slope().z;
    for rates in [(240.0, 240.0), (1000.0, 240.0), (240.0, 1000.0)] {
        for friction in [0.1, 0.2] {
            let made = || laid(TubeSpec { damping_per_s: 0.0, ..piece(friction) }, block(friction), rates);
            let (early, late) = (speeds(made, [0.1, 0.2]), speeds(made, [0.3, 0.4]));
            let gained = [0, 1].map(|k| (late[k] - early[k]) / 0.2);
            println!("{rates:?}, {friction}: {gained:?} of {} m/s²", wanted(friction));
            // 2 % of what friction takes
            let off = gained.map(|a| (a - wanted(friction)).abs());
            assert!(off.iter().all(|off| *off < 0.02 * friction * 9.6), "{rates:?}, {friction}: {gained:?} m/s²");
        }
    }
}
