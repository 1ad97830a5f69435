//! A cube held by friction between two fingers on springs: it neither slips nor creeps, and they bear its weight.

use crate::bodies::{rigid, solid};
use crate::table::{Placed, Table, placed};
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::Anchor;
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{SoftBody, SoftMaterial, SoftSpec};

const FRICTION: f64 = 0.8;
/// Each finger closes this far in this time, waits, and rises at this speed for one second.
const CLOSE_M: f64 = 0.0037;
const CLOSE_S: f64 = 0.2;
const LIFT_S: [f64; 2] = [0.4, 1.4];
const LIFT_M_S: f64 = 0.05;

/// Where the middle of a finger is led, relative to its start, and how fast, at a time; `side` leads to the cube.
fn led(side: f64, seconds: f64) -> (DVec3, DVec3) {
    let closing = side * CLOSE_M / CLOSE_S * DVec3::X;
    let risen_s = (seconds - LIFT_S[0]).clamp(0.0, LIFT_S[1] - LIFT_S[0]);
    let lift = LIFT_M_S * DVec3::Z;
    let speed = |from: f64, to: f64, velocity: DVec3| {
        if (from..to).contains(&(seconds + 1e-9)) { velocity } else { DVec3::ZERO }
    };
    let velocity = speed(0.0, CLOSE_S, closing) + speed(LIFT_S[0], LIFT_S[1], lift);
    (closing * seconds.min(CLOSE_S) + lift * risen_s, velocity)
}

/// The points that springs of 100 N/m hold each finger by: 400 N/m together, and stiff against turning.
fn anchors() -> [DVec3; 4] {
    [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]].map(|signs| DVec3::from_array(signs.map(f64::from)) * 0.04)
}

fn finger(x: f64) -> Placed {
    let half_extents_m = DVec3::new(0.01, 0.02, 0.02);
    let spec = rigid(Solid::Box { half_extents_m }, DVec3::new(x, 0.0, 0.03), 0.1);
    placed(RigidBody::new(RigidSpec { friction: FRICTION, ..spec }).unwrap(), false)
}

struct Grip {
    slip_m: f64,
    creep_m_s: f64,
    risen_m: f64,
}

fn grip(cube: Placed, cube_hz: f64, fingers_hz: f64) -> Grip {
    let starts = [-0.0262, 0.0262];
    let bodies = vec![cube, finger(starts[0]), finger(starts[1])];
    let mut table = Table::new(bodies).at_rates(cube_hz, fingers_hz);
    let mut aside = |seconds: f64| {
        while table.time.as_secs_f64() < seconds - 1e-9 {
            let now_s = table.time.as_secs_f64();
            for (finger, (start, side)) in starts.into_iter().zip([1.0, -1.0]).enumerate() {
                let (way, velocity) = led(side, now_s);
                let middle = DVec3::new(start, 0.0, 0.03) + way;
                let spring = |local: DVec3| AnchorSpring {
                    by: None,
                    anchor: Anchor::Local(local),
                    target: middle + local,
                    target_velocity: velocity,
                    stiffness_n_m: 100.0,
                    damping_n_s_m: 1.0,
                };
                table.bodies[finger + 1].user_springs = anchors().map(spring).to_vec();
            }
            table.step();
        }
        let height = |table: &mut Table, body: usize| table.middle(body).0.z;
        let cube_m = height(&mut table, 0);
        (cube_m, cube_m - 0.5 * (height(&mut table, 1) + height(&mut table, 2)))
    };
    let (start_m, before) = aside(0.39);
    let mut slip_m = 0.0_f64;
    for tenth in 4..20 {
        slip_m = slip_m.max((aside(0.1 * f64::from(tenth)).1 - before).abs());
    }
    let (_, early) = aside(1.9);
    let (end_m, late) = aside(3.4);
    Grip { slip_m: slip_m.max((late - before).abs()), creep_m_s: (late - early) / 1.5, risen_m: end_m - start_m }
}

#[test]
fn a_rigid_cube_is_lifted_without_slip_or_creep() {
    for (cube_hz, fingers_hz) in [(60.0, 60.0), (240.0, 240.0), (60.0, 500.0)] {
        let spec = rigid(Solid::Box { half_extents_m: DVec3::splat(0.015) }, DVec3::new(0.0, 0.0, 0.0151), 0.05);
        let cube = placed(RigidBody::new(RigidSpec { friction: FRICTION, ..spec }).unwrap(), false);
        let Grip { slip_m, creep_m_s, risen_m } = grip(cube, cube_hz, fingers_hz);
        assert!(slip_m <= 2e-5 && creep_m_s.abs() <= 1e-6, "slip {slip_m} m, creep {creep_m_s} m/s");
        assert!((risen_m - 0.05).abs() < 1e-3, "{risen_m}");
    }
}

#[test]
fn a_soft_cube_is_lifted_without_creep() {
    for (cube_hz, fingers_hz) in [(60.0, 60.0), (60.0, 240.0)] {
        let spec = solid(DVec3::new(0.0, 0.0, 0.0151), DVec3::splat(0.03), [3; 3], 1e5);
        let material = SoftMaterial { density_kg_m3: 1850.0, ..spec.material };
        let cube = placed(SoftBody::new(SoftSpec { friction: FRICTION, material, ..spec }).unwrap(), false);
        let Grip { slip_m, creep_m_s, risen_m } = grip(cube, cube_hz, fingers_hz);
        // it sags in the fingers
        assert!(slip_m <= 1e-4 && creep_m_s.abs() <= 1e-6, "slip {slip_m} m, creep {creep_m_s} m/s");
        assert!((risen_m - 0.05).abs() < 1e-3, "{risen_m}");
    }
}
