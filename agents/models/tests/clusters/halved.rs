//! Solids whose cells are halved where something touches them: dents that are smaller than a cell, and how they change while they are touched.

use crate::bodies::{material, rigid, solid};
use crate::table::{Placed, Table, placed};
use glam::DVec3;
use metachron_core::Snapshot;
use metachron_geometry::Solid;
use metachron_models::rigid::{Restraint, RigidBody, RigidSpec};
use metachron_models::soft::{Side, SoftBody, SoftSpec};

/// A block, and where balls press on it: in the middle of a whole cell of 50 mm, beside that, and where four meet, metres.
const SIZE_M: DVec3 = DVec3::new(0.4, 0.4, 0.2);
const TOP_M: f64 = 0.201;
const PRESSED: [DVec3; 3] =
    [DVec3::new(0.025, 0.025, TOP_M), DVec3::new(0.015, 0.035, TOP_M), DVec3::new(0.0, 0.0, TOP_M)];
const BALL_M: f64 = 0.03;

/// A block on a rigid bed with cells of `eps_m`, those longer than `touched_m` halved where it is touched; its skin is one of 12.5 mm.
fn block(eps_m: f64, touched_m: Option<f64>) -> Placed {
    let middle = DVec3::new(0.0, 0.0, TOP_M - 0.5 * SIZE_M.z);
    let lattice = solid(middle, SIZE_M, [32, 32, 16], 1e4);
    let shape = lattice.shape.embedded((eps_m, eps_m)).unwrap();
    let material = metachron_models::soft::SoftMaterial { damping_per_s: 10.0, damping_s: 0.01, ..material(1e4) };
    let spec =
        SoftSpec { shape, material, position: middle, gravity: DVec3::ZERO, held: vec![Side::Bottom], ..lattice };
    placed(SoftBody::new(SoftSpec { eps_touched_m: touched_m, ..spec }).unwrap(), true)
}

/// A ball of 0.25 kg that moves along a vertical line, above a place of the block.
fn ball(above: DVec3) -> Placed {
    let spec = rigid(Solid::Ball { radius_m: BALL_M }, above + DVec3::Z * (BALL_M + 1e-4), 0.25);
    let restraint = Restraint {
        linear_damping_per_s: 4.0,
        locked_translation: [true, true, false],
        locked_rotation: [true; 3],
        ..Restraint::default()
    };
    placed(RigidBody::new(RigidSpec { restraint, ..spec }).unwrap(), false)
}

fn nodes(table: &Table) -> u32 {
    let mut snapshot = Snapshot::default();
    table.bodies[0].agent.write_snapshot(&mut snapshot);
    snapshot.nodes.unwrap()
}

/// How deep a ball is in a block once both rest, metres; the nodes of the block, and the work of its step.
fn dent(above: DVec3, eps_m: f64, touched_m: Option<f64>) -> (f64, u32, f64) {
    let mut table = Table::new(vec![block(eps_m, touched_m), ball(above)]).at_rates(60.0, 120.0);
    while table.time.as_secs_f64() < 5.0 {
        table.step();
    }
    let (at, v) = table.middle(1);
    assert!(v.length() < 1e-4, "{v}");
    let work = table.bodies[0].agent.member().unwrap().work();
    (TOP_M + BALL_M - at.z, nodes(&table), work)
}

#[test]
fn a_dent_smaller_than_a_cell_is_nearly_that_of_fine_cells_at_a_share_of_their_work() {
    for above in PRESSED {
        let [coarse, halved, fine] =
            [(0.05, None), (0.05, Some(0.03)), (0.025, None)].map(|(eps_m, touched_m)| dent(above, eps_m, touched_m));
        println!("{above} coarse {coarse:?}, halved {halved:?}, fine {fine:?}");
        assert!((halved.0 - fine.0).abs() < 0.2 * (coarse.0 - fine.0).abs(), "{coarse:?} {halved:?} {fine:?}");
        assert!(halved.2 < 0.25 * fine.2, "{halved:?} {fine:?}");
    }
}

#[test]
fn cells_are_halved_under_a_ball_and_whole_again_after_it_is_gone() {
    let mut table = Table::new(vec![block(0.05, Some(0.03)), ball(PRESSED[0])]).at_rates(60.0, 120.0);
    let whole = nodes(&table);
    while table.time.as_secs_f64() < 1.0 {
        table.step();
    }
    assert!(nodes(&table) > whole + 50, "{} of {whole}", nodes(&table));
    table.bodies.pop();
    while table.time.as_secs_f64() < 2.4 {
        table.step();
    }
    assert_eq!(nodes(&table), whole);
}
