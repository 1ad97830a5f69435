//! Walls that give, under loads of other bodies: how far they flatten, and that contact makes no energy in them.
//! Reference: the thin ring under opposed loads, its collapse under pressure.

use crate::table::{GRAVITY, Placed, Table, placed};
use glam::DVec3;
use metachron_core::{Body, CurveState, Snapshot};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Material, Section, Tube, TubeSpec, WallModel};

const RADIUS_M: f64 = 0.01;
const LENGTH_M: f64 = 0.04;
const MATERIAL: Material = Material { young_pa: 1e6, poisson: 0.3, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };

/// A tube along y whose wall gives, at this x, on the floor, without weight.
fn giving(x_m: f64, wall_m: f64) -> TubeSpec {
    let from = DVec3::new(x_m, -0.5 * LENGTH_M, RADIUS_M);
    TubeSpec {
        wall: WallModel::Gives,
        damping_per_s: 20.0,
        friction: 0.5,
        ..TubeSpec::free(vec![from, from + DVec3::Y * LENGTH_M], Section::hollow(RADIUS_M, wall_m, MATERIAL), 8)
    }
}

/// A plate so high above both tubes.
fn plate(above_m: f64, mass_kg: f64) -> Placed {
    let half_m = DVec3::new(0.06, 0.5 * LENGTH_M, 0.002);
    let solid = Solid::Box { half_extents_m: half_m };
    let spec = RigidSpec::free(solid, DVec3::Z * (2.0 * RADIUS_M + half_m.z + above_m), mass_kg);
    placed(RigidBody::new(RigidSpec { gravity: GRAVITY, friction: 0.5, ..spec }).unwrap(), false)
}

fn curve(table: &Table, body: usize) -> CurveState {
    let mut snapshot = Snapshot::default();
    table.bodies[body].agent.write_snapshot(&mut snapshot);
    let Body::Curve(curve) = snapshot.body else { panic!("a tube is a curve") };
    curve
}

/// By how much two tubes flatten under a plate of this mass, and widen across it, metres.
fn pressed(spec: impl Fn(f64) -> TubeSpec, mass_kg: f64) -> [f64; 2] {
    let tubes = [-0.04, 0.04].map(|x_m| placed(Tube::new(spec(x_m)).unwrap(), false));
    let mut table = Table::new(tubes.into_iter().chain([plate(0.0, mass_kg)]).collect()).at_rates(500.0, 500.0);
    while table.time.as_secs_f64() < 2.0 {
        table.step();
    }
    let lowered_m = 2.0 * RADIUS_M + 0.002 - table.middle(2).0.z;
    let middle = curve(&table, 0);
    [lowered_m, 2.0 * (middle.radii_m[4] - RADIUS_M + middle.flattening_m[4].length())]
}

#[test]
fn a_thin_tube_between_plates_flattens_as_the_ring_does() {
    let wall_m: f64 = 4e-4;
    let plate_n_m = MATERIAL.young_pa * wall_m.powi(3) / 12.0 / (1.0 - MATERIAL.poisson.powi(2));
    let mass_kg = 5e-5;
    let load_n = 0.5 * mass_kg * -GRAVITY.z;
    let unit_m = load_n * (RADIUS_M - 0.5 * wall_m).powi(3) / (plate_n_m * LENGTH_M);
    let [lowered_m, widened_m] = pressed(|x_m| giving(x_m, wall_m), mass_kg);
    // Timoshenko: the ring under two opposed loads comes down by (π/4 − 2/π) P R³/EI and widens by (2/π − 1/2) P R³/EI
    let [down, out] = [lowered_m / unit_m, widened_m / unit_m];
    assert!((down / 0.148_78 - 1.0).abs() < 0.05, "{down} P R³/EI, not 0.1488");
    assert!((out / 0.136_62 - 1.0).abs() < 0.05, "{out} P R³/EI, not 0.1366");
}

#[test]
fn pressure_stiffens_a_tube_against_flattening() {
    let (wall_m, mass_kg): (f64, f64) = (4e-4, 5e-5);
    let ring_pa = 3.0 * MATERIAL.young_pa * wall_m.powi(3)
        / 12.0
        / (1.0 - MATERIAL.poisson.powi(2))
        / (RADIUS_M - 0.5 * wall_m).powi(3);
    let [soft_m, _] = pressed(|x_m| giving(x_m, wall_m), mass_kg);
    // the resistance is 9π E'I/R³ + 3π p: as much again at the pressure 3 E'I/R³ that would collapse the ring from
    // outside
    let pressure_pa = 2.0 * ring_pa;
    let [stiff_m, _] = pressed(|x_m| TubeSpec { pressure_pa, ..giving(x_m, wall_m) }, mass_kg);
    let widened_m =
        2.0 * pressure_pa * RADIUS_M * RADIUS_M * (1.0 - 0.5 * MATERIAL.poisson) / (MATERIAL.young_pa * wall_m);
    let ratio = (stiff_m + widened_m) / soft_m;
    assert!((ratio * 3.0 - 1.0).abs() < 0.05, "flattened {ratio} of what it does without pressure, not a third");
}

#[test]
fn a_plate_that_falls_on_tubes_gains_no_energy_from_their_walls() {
    // the thin one without gas is crushed flat
    for (wall_m, sealed) in [(4e-4, true), (4e-4, false), (2e-3, true), (2e-3, false)] {
        let spec = |x_m: f64| TubeSpec { damping_per_s: 0.0, sealed, ..giving(x_m, wall_m) };
        let tubes = [-0.04, 0.04].map(|x_m| placed(Tube::new(spec(x_m)).unwrap(), false));
        let falling = plate(0.04, 0.02);
        let mut table = Table::new(tubes.into_iter().chain([falling]).collect()).at_rates(500.0, 500.0);
        let found = table.play(1.5);
        let fall_j = 0.02 * 9.81 * 0.04;
        assert!(found.gain_j < 1e-3 * fall_j, "{} J of {fall_j} J gained", found.gain_j);
        assert!(found.rest_m < 1e-4, "{} m deep at rest", found.rest_m);
    }
}
