//! What members of a cluster say of the error of their steps, against closed forms and finer steps; and that saying it changes nothing.

use crate::bodies::{block, cloth, cube, rigid, rope, slab, tube};
use crate::table::{GRAVITY, Placed, Table, placed, plane};
use glam::{DQuat, DVec3};
use metachron_contact::stepper::StepDoubling;
use metachron_core::Snapshot;
use metachron_core::step_doubling::{DRIFT_S, drift_m};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};

fn watched(bodies: Vec<Placed>) -> Table {
    let mut table = Table::new(bodies);
    table.doubling = Some(StepDoubling::default());
    table
}

/// The error in a tenth of a second that the last step of a table estimates for a body, metres.
fn drift_of_m(table: &Table, body: usize, step_s: f64) -> f64 {
    drift_m(table.doubling.as_ref().unwrap().apart_m()[body], 1, step_s)
}

#[test]
fn what_bends_and_falls_says_half_g_h_t_and_what_is_rigid_nothing() {
    let high = DVec3::Z * 2.0;
    for rate_hz in [60.0, 240.0] {
        let apart = |at: f64| high + DVec3::X * at;
        let bodies = vec![
            cube(high, 0.06),
            tube(apart(0.5), DVec3::X * 0.1, 0.005),
            block(apart(1.0), DVec3::splat(0.03), 1.0, 0.3),
        ];
        let mut table = watched(bodies).at_rates(rate_hz, rate_hz);
        for _ in 0..4 {
            let (_, step_s) = table.step();
            let exact_m = 0.5 * -GRAVITY.z * step_s * DRIFT_S;
            for body in [0, 1] {
                let off = drift_of_m(&table, body, step_s) / exact_m - 1.0;
                assert!(off.abs() < 1e-6, "{rate_hz} Hz, body {body}: off by {off}");
            }
            assert!(drift_of_m(&table, 2, step_s) < 1e-12);
        }
    }
}

#[test]
fn a_box_that_slides_says_how_far_its_steps_lead_it_wrong() {
    // on a slope it gains a: a step of h leaves it ½ a h² too far
    let rotation = DQuat::from_rotation_y(0.3);
    let half_m = DVec3::splat(0.03);
    for rate_hz in [60.0, 240.0] {
        let spec = rigid(Solid::Box { half_extents_m: half_m }, rotation * DVec3::Z * 0.03, 1.0);
        let body = placed(RigidBody::new(RigidSpec { rotation, friction: 0.1, ..spec }).unwrap(), false);
        let mut table = Table::among(vec![body], &[plane(rotation, 0.1)]).at_rates(rate_hz, rate_hz);
        table.doubling = Some(StepDoubling::default());
        let mut step_s = 0.0;
        for _ in 0..60 {
            step_s = table.step().1;
        }
        let exact_m = 0.5 * -GRAVITY.z * (0.3_f64.sin() - 0.1 * 0.3_f64.cos()) * step_s * DRIFT_S;
        let drift_of_m = drift_of_m(&table, 0, step_s);
        assert!((drift_of_m / exact_m - 1.0).abs() < 0.05, "{rate_hz} Hz: {drift_of_m} of {exact_m}");
    }
}

#[test]
fn a_repeated_step_leaves_no_trace() {
    let half = DVec3::new(0.1, 0.0, 0.0);
    let bodies = || {
        vec![
            slab(false, 1e5),
            rope(DVec3::Z * 0.06, half, 0.006, 1e5),
            cloth(DVec3::Z * 0.08, 0.2, 6),
            block(DVec3::Z * 0.12, DVec3::splat(0.02), 0.3, 0.3),
        ]
    };
    let (mut plain, mut watched) =
        (Table::new(bodies()).at_rates(60.0, 240.0), watched(bodies()).at_rates(60.0, 240.0));
    for step in 0..60 {
        plain.step();
        watched.step();
        for (body, (a, b)) in plain.bodies.iter().zip(&watched.bodies).enumerate() {
            let state = |placed: &Placed| {
                let mut snapshot = Snapshot::default();
                placed.agent.write_snapshot(&mut snapshot);
                // all digits of all numbers
                format!("{:?}", snapshot.body)
            };
            assert_eq!(state(a), state(b), "body {body} after step {step}");
        }
    }
}
