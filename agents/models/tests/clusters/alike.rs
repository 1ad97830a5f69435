//! One box on the floor rests as deep and drifts as little alone, beside deformables, and in a heap; and a box that
//! sticks on a skin stays.

use crate::bodies::{block, cube, leaning, rigid, rope, sheet, solid, tube};
use crate::table::{Placed, Table, placed};
use glam::{DQuat, DVec3};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{Side, SoftBody, SoftSpec};

const HALF_M: f64 = 0.02;

fn the_box() -> Placed {
    block(DVec3::Z * (HALF_M + 1e-3), DVec3::splat(HALF_M), 0.3, 0.2)
}

/// Its height above the floor less half its edge, and how far it has slid, metres, once all has come to rest.
fn rest_of_the_box(others: Vec<Placed>) -> (f64, f64) {
    let bodies = std::iter::once(the_box()).chain(others).collect();
    let mut table = Table::new(bodies);
    table.play(1.0);
    let start = table.middle(0).0;
    table.play(3.0);
    let end = table.middle(0).0;
    (end.z - HALF_M, (end - start).truncate().length())
}

#[test]
fn a_box_rests_alike_alone_beside_what_bends_and_in_a_heap() {
    let beside = DVec3::new(0.1, 0.0, 0.0);
    let heap = || {
        // five stacks of four around it, the nearest 2 mm away
        let places = (0..20).map(|i| (i / 4, i % 4));
        let boxes = places.map(|(stack, level)| {
            let angle = f64::from(stack) * std::f64::consts::TAU / 5.0;
            let around = DVec3::new(angle.cos(), angle.sin(), 0.0) * 0.07;
            block(around + DVec3::Z * (HALF_M + 1e-3 + f64::from(level) * 0.0405), DVec3::splat(HALF_M), 0.3, angle)
        });
        boxes.collect::<Vec<_>>()
    };
    let cases = [
        ("alone", vec![]),
        ("beside a soft cube", vec![cube(DVec3::new(0.0515, 0.0, 0.0305), 0.06)]),
        (
            "beside a rope and a tube",
            vec![
                rope(beside + DVec3::Z * 0.01, DVec3::Y * 0.1, 0.008, 1e5),
                tube(-beside + DVec3::Z * 0.01, DVec3::Y * 0.1, 0.008),
            ],
        ),
        ("in a heap of twenty", heap()),
    ];
    for (name, others) in cases {
        let (height_m, slid_m) = rest_of_the_box(others);
        // contacts rest 20 µm deep at most
        assert!((-21e-6..0.0).contains(&height_m), "{name}: {height_m} m");
        assert!(slid_m < 2e-5, "{name}: it slides by {slid_m} m in two seconds");
    }
}

#[test]
fn what_sticks_on_a_leaning_skin_creeps_by_no_more_than_a_hundredth_of_a_millimetre_a_second() {
    // tan 0.3 = 0.31, friction 0.5
    let rotation = DQuat::from_rotation_y(0.3);
    let up = rotation * DVec3::Z;
    type Ground = fn(DQuat) -> Placed;
    let grounds: [(&str, Ground); 2] = [
        ("slab", |rotation| {
            let spec = solid(DVec3::Z * 0.025, DVec3::new(0.2, 0.2, 0.05), [6, 6, 2], 1e5);
            placed(SoftBody::new(leaning(SoftSpec { held: vec![Side::Bottom], ..spec }, rotation)).unwrap(), true)
        }),
        ("sheet", |rotation| {
            let held = vec![Side::Left, Side::Right];
            let spec = SoftSpec { held, ..sheet(DVec3::Z * 0.048, 0.2, 8) };
            placed(SoftBody::new(leaning(spec, rotation)).unwrap(), true)
        }),
    ];
    for (ground, made) in grounds {
        for what in ["box", "cube", "rope"] {
            let high_m = 0.0505;
            let body = match what {
                "box" => {
                    let spec = rigid(Solid::Box { half_extents_m: DVec3::splat(HALF_M) }, up * (high_m + HALF_M), 0.1);
                    placed(RigidBody::new(RigidSpec { rotation, friction: 0.5, ..spec }).unwrap(), false)
                }
                "cube" => {
                    let spec = solid(DVec3::Z * (high_m + 0.02), DVec3::splat(0.04), [3; 3], 1e5);
                    placed(SoftBody::new(leaning(spec, rotation)).unwrap(), false)
                }
                _ => rope(up * (high_m + 0.006), DVec3::Y * 0.06, 0.005, 1e5),
            };
            let mut table = Table::among(vec![made(rotation), body], &[]);
            table.play(4.0);
            let start = table.middle(1).0;
            table.play(5.0);
            let crept_m = (table.middle(1).0 - start).length();
            assert!(crept_m < 1e-5, "{what} on a {ground} creeps by {crept_m} m in a second");
        }
    }
}
