//! Coulomb's law on a slope: how fast each model slides on a plane and on a skin, and that it stays where it sticks.

use crate::bodies::{leaning, material, rigid, rope, sheet, solid, tube};
use crate::table::{GRAVITY, Placed, Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{Side, SoftBody, SoftMaterial, SoftSpec};

const SLOPE_RAD: f64 = 0.21;
/// How far all start above their slope, metres.
const START_M: f64 = 1e-4;
/// The friction of all bodies.
const OWN: f64 = 0.5;

fn lean() -> DQuat {
    DQuat::from_rotation_y(SLOPE_RAD)
}

fn downhill() -> DVec3 {
    lean() * DVec3::X
}

/// The models, each lying at `x` along the slope on a surface at `z` above the plane.
fn bodies(x: f64, z: f64) -> Vec<(&'static str, Placed)> {
    let at = |up: f64| DVec3::new(x, 0.0, z + START_M + up);
    let along = |half: f64| lean() * DVec3::X * half;
    let half_extents_m = DVec3::new(0.03, 0.03, 0.02);
    let cuboid = rigid(Solid::Box { half_extents_m }, lean() * at(0.02), 0.3);
    let soft = |spec: SoftSpec| placed(SoftBody::new(leaning(spec, lean())).unwrap(), false);
    vec![
        ("box", placed(RigidBody::new(RigidSpec { rotation: lean(), ..cuboid }).unwrap(), false)),
        ("soft cube", soft(solid(at(0.03), DVec3::splat(0.06), [3; 3], 1e5))),
        ("sheet", soft(sheet(at(0.002), 0.1, 5))),
        ("rope", rope(lean() * at(0.006), along(0.04), 0.006, 1e6)),
        ("tube", tube(lean() * at(0.01), along(0.04), 0.01)),
    ]
}

/// The acceleration downhill between two times, as a share of Coulomb's.
fn share_of_coulomb(table: &mut Table, body: usize, friction: f64, [from_s, to_s]: [f64; 2]) -> f64 {
    let mut at = |seconds: f64| {
        while table.time.as_secs_f64() < seconds - 1e-9 {
            table.step();
        }
        (table.time.as_secs_f64(), table.middle(body).1.dot(downhill()))
    };
    let ((t1, v1), (t2, v2)) = (at(from_s), at(to_s));
    let wanted = -GRAVITY.z * (libm::sin(SLOPE_RAD) - friction * libm::cos(SLOPE_RAD));
    (v2 - v1) / (t2 - t1) / wanted
}

#[test]
fn every_model_slides_down_a_plane_as_fast_as_coulomb_says() {
    for (name, body) in bodies(0.0, 0.0) {
        let mut table = Table::among(vec![body], &[plane(lean(), 0.02)]);
        let share = share_of_coulomb(&mut table, 0, 0.1, [0.5, 1.0]);
        assert!((share - 1.0).abs() < 1e-2, "{name}: {share}");
    }
}

#[test]
fn every_model_slides_down_a_skin_as_fast_as_coulomb_says() {
    for number in 0..5 {
        let stiff = SoftMaterial { young_pa: 1e7, ..material(1e7) };
        let slope = solid(DVec3::new(0.1, 0.0, -0.02), DVec3::new(0.6, 0.16, 0.04), [15, 4, 1], 1e7);
        let slope = SoftSpec { material: stiff, friction: 0.02, held: vec![Side::Bottom], ..slope };
        let slope = placed(SoftBody::new(leaning(slope, lean())).unwrap(), true);
        let (name, body) = bodies(-0.1, 0.0).swap_remove(number);
        let mut table = Table::among(vec![slope, body], &[]);
        let share = share_of_coulomb(&mut table, 1, 0.1, [0.2, 0.6]);
        assert!((share - 1.0).abs() < 1e-2, "{name}: {share}");
    }
}

#[test]
fn every_model_stays_on_a_plane_where_friction_is_enough() {
    for (name, body) in bodies(0.0, 0.0) {
        let mut table = Table::among(vec![body], &[plane(lean(), OWN)]);
        let mut at = |seconds: f64| {
            while table.time.as_secs_f64() < seconds - 1e-9 {
                table.step();
            }
            table.middle(0).0.dot(downhill())
        };
        let creep_m_s = at(2.0) - at(1.0);
        assert!(creep_m_s.abs() < 1e-5, "{name} creeps by {creep_m_s} m/s");
    }
}
