//! A fast body meets the bodies on its way, is not held by those beside it, and does not pass through itself.

use crate::bodies::{cloth, rigid, sheet, solid, tube};
use crate::table::{GRAVITY, Placed, Table, placed};
use glam::DVec3;
use metachron_core::{Body, Snapshot};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};
use metachron_models::soft::{Side, SoftBody, SoftSpec};

/// A ball of 50 g that flies down from `above_m`.
fn bullet(above_m: f64, speed_m_s: f64) -> Placed {
    let spec = rigid(Solid::Ball { radius_m: 0.01 }, DVec3::new(0.003, 0.0, above_m), 0.05);
    placed(RigidBody::new(RigidSpec { velocity: DVec3::Z * -speed_m_s, gravity: DVec3::ZERO, ..spec }).unwrap(), false)
}

/// The height of the lowest node, vertex or middle of the first body, metres.
fn lowest_m(table: &mut Table) -> f64 {
    let mut snapshot = Snapshot::default();
    table.bodies[0].agent.write_snapshot(&mut snapshot);
    let places = match &snapshot.body {
        Body::Soft(soft) => &soft.positions[..],
        Body::Curve(curve) => &curve.positions[..],
        _ => return table.middle(0).0.z,
    };
    places.iter().map(|at| at.z).fold(f64::INFINITY, f64::min)
}

/// Whether the bullet is still above its target, 0.1 s later, at each pair of rates.
fn stays_above(name: &str, target: impl Fn() -> Placed, speed_m_s: f64) {
    for rates in [(30.0, 240.0), (240.0, 60.0), (60.0, 60.0), (240.0, 240.0), (1000.0, 1000.0)] {
        let mut table = Table::among(vec![target(), bullet(0.5, speed_m_s)], &[]).at_rates(rates.0, rates.1);
        let made = table.play(0.1).gain_j;
        let (at, _) = table.middle(1);
        let aim_m = lowest_m(&mut table);
        assert!(at.z > aim_m, "{name} {rates:?}: it went through to {at} from {aim_m} m");
        assert!(made < 1e-3, "{name} {rates:?}: {made} J made");
    }
}

#[test]
fn a_bullet_does_not_pass_through_a_soft_solid() {
    let target = || placed(SoftBody::new(solid(DVec3::ZERO, DVec3::splat(0.1), [4; 3], 1e5)).unwrap(), false);
    stays_above("solid", target, 30.0);
}

#[test]
fn a_bullet_does_not_pass_through_a_sheet() {
    let held = || SoftSpec { held: vec![Side::Left, Side::Right], ..sheet(DVec3::ZERO, 0.4, 8) };
    stays_above("sheet", || placed(SoftBody::new(held()).unwrap(), true), 50.0);
}

#[test]
fn a_bullet_does_not_pass_through_a_plate() {
    let solid = Solid::Box { half_extents_m: DVec3::new(0.1, 0.1, 0.0025) };
    let spec = || RigidSpec { gravity: DVec3::ZERO, ..rigid(solid.clone(), DVec3::ZERO, 0.5) };
    stays_above("plate", || placed(RigidBody::new(spec()).unwrap(), false), 50.0);
}

#[test]
fn a_bullet_does_not_pass_through_a_tube() {
    stays_above("tube", || tube(DVec3::ZERO, DVec3::X * 0.2, 0.005), 50.0);
}

#[test]
fn what_flies_past_is_not_held_by_what_it_never_reaches() {
    // the plane of the plate's upper face, far beyond its edge, would stop it
    let solid = Solid::Box { half_extents_m: DVec3::new(0.1, 0.1, 0.0025) };
    for rate_hz in [60.0, 240.0] {
        let plate = rigid(solid.clone(), DVec3::X * 0.115, 0.5);
        let plate = placed(RigidBody::new(RigidSpec { gravity: DVec3::ZERO, ..plate }).unwrap(), false);
        let mut table = Table::among(vec![plate, bullet(0.5, 50.0)], &[]).at_rates(rate_hz, rate_hz);
        table.play(0.1);
        let ((plate, _), (at, velocity)) = (table.middle(0), table.middle(1));
        assert!((velocity - DVec3::Z * -50.0).length() < 1e-9, "{rate_hz} Hz: it flies on by {velocity}");
        assert!(plate.distance(DVec3::X * 0.115) < 1e-12 && at.z < -4.0);
    }
}

#[test]
fn what_bends_meets_what_flies_at_it_however_light() {
    let mut table = Table::among(vec![cloth(DVec3::ZERO, 0.3, 6), bullet(0.5, 30.0)], &[]);
    let momentum = |table: &Table| table.bodies.iter().map(|body| body.agent.momentum().0).sum::<DVec3>();
    let start = momentum(&table);
    while table.time.as_secs_f64() < 0.05 {
        table.step();
        let time_s = table.time.as_secs_f64();
        let cloth_kg = table.bodies[0].agent.mass_kg();
        let drift = (momentum(&table) - start - GRAVITY * cloth_kg * time_s).length();
        assert!(drift < 1e-9 * start.length(), "{drift} of {start}");
    }
    assert!(table.middle(1).1.z > -29.0, "nothing braked it");
}

/// A soft tube of 1 m in two turns above each other, 5 mm apart.
fn coil(segments: usize) -> Placed {
    let path_m: Vec<_> = (0..=64)
        .map(|i| {
            let turn = f64::from(i) / 64.0;
            let angle = 2.0 * std::f64::consts::TAU * turn;
            DVec3::new(0.08 * angle.cos(), 0.08 * angle.sin(), 0.0062 + 0.03 * turn)
        })
        .collect();
    let material = Material { young_pa: 1e5, poisson: 0.3, density_kg_m3: 1000.0, shear_factor: 0.9 };
    let spec = TubeSpec::free(path_m, Section::hollow(0.005, 0.005, material), segments);
    let spec = TubeSpec { gravity: GRAVITY, friction: 0.5, damping_per_s: 2.0, self_contact: true, ..spec };
    placed(Tube::new(spec).unwrap(), false)
}

#[test]
fn a_tube_lies_on_itself() {
    for (segments, rate_hz) in [(40, 60.0), (40, 240.0), (100, 240.0)] {
        let mut table = Table::new(vec![coil(segments)]).at_rates(rate_hz, rate_hz);
        let found = table.play(2.0);
        let (middle, _) = table.middle(0);
        assert!(found.rest_m < 5e-5 && found.landing_m < 3.5e-4, "{segments}, {rate_hz} Hz: {found:?}");
        assert!((found.weight - 1.0).abs() < 1e-2 && found.gain_j < 1e-3, "{segments}, {rate_hz} Hz: {found:?}");
        // two layers of 1 cm, not one
        assert!(middle.z > 0.008, "{segments}, {rate_hz} Hz: its middle is at {middle}");
    }
}
