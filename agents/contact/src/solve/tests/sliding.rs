//! Friction that follows its pressure within a Newton step: a sliding body that leans on itself by that is solved in a
//! few.

use super::{Body, Case, contact, rigid};
use crate::solve::{Report, Settings, Side, Solver};
use glam::DVec3;

const H_S: f64 = 0.01;
const GRAVITY_M_S2: f64 = 9.81;

/// A block of 1 kg, twice as tall as wide, that slides along x at 2 m/s on four corners.
fn sliding(friction: f64) -> Case {
    let half = DVec3::new(0.05, 0.05, 0.1);
    let block = Body { free: vec![DVec3::new(2.0, 0.0, -GRAVITY_M_S2 * H_S), DVec3::ZERO], ..rigid(1.0, half) };
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
    let touches = corners.map(|[x, y]| {
        let arm = DVec3::new(x * half.x, y * half.y, -half.z);
        super::Contact { friction, ..contact([Side::rigid(0, arm), Side::FIXED], DVec3::Z) }
    });
    Case { h_s: H_S, bodies: vec![block], contacts: touches.to_vec(), rows: vec![] }
}

fn solved(case: &Case) -> (Vec<DVec3>, Report) {
    // so hard that the front does not sink by its greater load
    let mut solver = Solver::new(Settings { depth_m: 1e-8, ..Settings::default() });
    case.with(|problem| {
        let solution = solver.solve(problem).unwrap();
        (solution.contacts_n_s.clone(), solution.report)
    })
}

#[test]
fn a_tall_block_that_slides_leans_on_its_front_as_friction_says() {
    for friction in [0.1, 0.3, 0.45] {
        let (given, report) = solved(&sliding(friction));
        let weight = GRAVITY_M_S2 * H_S;
        // half of its height over half of its length: the couple of friction is that of the front over the rear
        let front = 0.25 * weight * (1.0 + 2.0 * friction);
        let rear = 0.25 * weight * (1.0 - 2.0 * friction);
        for (impulse, pressure) in given.iter().zip([rear, rear, front, front]) {
            let wanted = DVec3::new(-friction * pressure, 0.0, pressure);
            assert!((*impulse - wanted).length() < 1e-4 * weight, "{friction}: {impulse} for {wanted}");
        }
        assert!(report.factors <= 6, "{friction}: {report:?}");
    }
}

#[test]
fn what_tips_over_its_front_is_found_too() {
    // beyond half its length over its height the rear is lifted: the front bears more than the weight, as the middle rises
    let (given, report) = solved(&sliding(0.8));
    assert!(given[0].length() + given[1].length() < 1e-9, "{given:?}");
    let front = given[2] + given[3];
    assert!((front.x + 0.8 * front.z).abs() < 1e-6 * front.z, "{front}");
    // about the centre: ω = h (μ H − L) N/I, and the front corner stays on the floor: v + ω × r = 0 along z
    let inertia = (0.05 * 0.05 + 0.1 * 0.1) / 3.0;
    let spin = (0.1 * 0.8 - 0.05) / inertia;
    let pressure = GRAVITY_M_S2 * H_S / (1.0 - 0.05 * spin);
    assert!((front.z - pressure).abs() < 1e-4 * pressure, "{} for {pressure}", front.z);
    assert!(report.factors <= 8, "{report:?}");
}
