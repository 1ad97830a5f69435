//! Bodies that begin inside each other: they are pushed out gently, and never against a joint with more than a bounded force.

use crate::bodies::{block, rigid};
use crate::joints::{party, state};
use crate::table::{Table, plane};
use glam::{DQuat, DVec3};
use metachron_contact::joint::{Joint, JointKind};
use metachron_core::AgentId;
use metachron_geometry::Solid;
use metachron_models::rigid::RigidSpec;

/// The fastest push-out, m/s.
const PUSH_OUT_M_S: f64 = 0.5;

/// Five capsules on hinges; every second one lies 4 cm inside the next but one, and no hinge lets them apart.
fn links() -> (Table, Vec<f64>) {
    let masses: Vec<_> = (0..5).map(|i| 2.0 * 0.6_f64.powi(i)).collect();
    let middles: Vec<_> = [-0.0038, -0.0121, -0.0164, 0.0032, -0.0081]
        .into_iter()
        .enumerate()
        .map(|(i, x)| DVec3::new(x, 0.0, 2.0 - 0.06 * i as f64))
        .collect();
    let specs = middles
        .iter()
        .zip(&masses)
        .map(|(middle, mass)| rigid(Solid::Capsule { radius_m: 0.05, half_height_m: 0.03 }, *middle, *mass));
    let hinges = (0..5).map(|i| {
        let axis = [DVec3::Z, DVec3::Y, DVec3::X, DVec3::Y, DVec3::X][i];
        let kind = JointKind::Revolute { axis, range_rad: None, motor: None };
        let anchor_b_m = if i == 0 { middles[0] } else { middles[i] - middles[i - 1] };
        Joint { anchor_b_m, ..Joint::new(AgentId(i as u32), (i > 0).then(|| AgentId(i as u32 - 1)), kind) }
    });
    (party(specs, hinges, 240.0), masses)
}

#[test]
fn links_that_no_joint_lets_apart_make_no_energy_and_are_solved_in_few_factors() {
    let (mut table, masses) = links();
    // of each pair that overlaps: ½ m (0.5 m/s)² of its reduced mass
    let bound_j: f64 = (0..3).map(|i| masses[i] * masses[i + 2] / (masses[i] + masses[i + 2])).sum::<f64>()
        * (0.5 * PUSH_OUT_M_S * PUSH_OUT_M_S);
    let start_j = table.energy_j();
    let (mut factors, mut most_j) = (0, start_j);
    for _ in 0..120 {
        let (report, _) = table.step();
        factors += report.factors;
        most_j = f64::max(most_j, table.energy_j());
    }
    assert!(most_j - start_j < bound_j, "{} of at most {bound_j} J", most_j - start_j);
    assert!(factors < 120 * 4, "{factors} factors in 120 steps");
}

#[test]
fn two_free_bodies_part_no_faster_than_the_push_out_and_keep_their_momentum() {
    let half = DVec3::splat(0.05);
    let specs = [(0.0, 1.0), (0.09, 4.0)]
        .map(|(x, mass)| RigidSpec::free(Solid::Box { half_extents_m: half }, DVec3::new(x, 0.0, 1.0), mass));
    let mut table = party(specs, [], 240.0);
    let mut fastest_m_s = 0.0_f64;
    for _ in 0..120 {
        table.step();
        let [a, b] = [0, 1].map(|body| state(&table, body).velocity);
        assert!((a + b * 4.0).length() < 1e-12, "momentum {}", a + b * 4.0);
        fastest_m_s = fastest_m_s.max((b - a).length());
    }
    let gap_m = state(&table, 1).position.x - state(&table, 0).position.x - 0.1;
    // 1 cm at 240 Hz asks for 0.48 m/s in the first step
    assert!(fastest_m_s < PUSH_OUT_M_S && gap_m > 0.0, "{fastest_m_s} m/s, {gap_m} m apart");
}

#[test]
fn a_box_that_begins_inside_the_floor_comes_out_and_lies_on_it() {
    for rate_hz in [60.0, 240.0] {
        let body = block(DVec3::Z * 0.03, DVec3::splat(0.05), 2.0, 0.3);
        let mut table = Table::among(vec![body], &[plane(DQuat::IDENTITY, 0.5)]);
        table.bodies.iter_mut().for_each(|body| body.rate_hz = rate_hz);
        for _ in 0..(2.0 * rate_hz) as u32 {
            table.step();
        }
        let now = state(&table, 0);
        assert!((now.position.z - 0.05).abs() < 1e-4, "{rate_hz} Hz: at {}", now.position.z);
        assert!(now.velocity.length() < 1e-4);
    }
}
