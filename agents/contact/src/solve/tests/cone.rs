//! Projections against their definitions, and the guard of passivity.

use super::{Seeded, contact, diagonal};
use crate::solve::cones::cone::Law;
use crate::solve::levels::iterate::Iterate;
use crate::solve::levels::passivity::guard;
use crate::solve::{Contact, Member, Problem, Side};
use glam::{DMat3, DVec3};
use metachron_core::PlainLoop;

const COUNT: usize = 1000;

fn friction_and_impulse(numbers: &mut Seeded) -> (Law, f64, DVec3) {
    let friction = numbers.unit();
    (Law::Coulomb { friction }, friction, numbers.vector())
}

#[test]
fn the_disc_keeps_the_pressure_and_the_direction_of_friction() {
    let mut numbers = Seeded::new(2);
    for _ in 0..COUNT {
        let (law, friction, z) = friction_and_impulse(&mut numbers);
        let p = law.project(z).value;
        let slip = z.y.hypot(z.z);
        let share = if z.x > 0.0 { (friction * z.x / slip).min(1.0) } else { 0.0 };
        assert!((p - DVec3::new(z.x.max(0.0), share * z.y, share * z.z)).length() < 1e-15, "{z}");
    }
}

/// The slope by differences.
fn differences(project: impl Fn(DVec3) -> DVec3, z: DVec3) -> DMat3 {
    let step = 1e-6;
    let column = |axis: DVec3| (project(z + axis * step) - project(z - axis * step)) / (2.0 * step);
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

#[test]
fn slopes_are_those_of_differences() {
    let mut numbers = Seeded::new(3);
    let mut compared = 0;
    for _ in 0..COUNT {
        let (law, ..) = friction_and_impulse(&mut numbers);
        let z = numbers.vector();
        let bounded = Law::Bounded { limit: 0.5 };
        let between = Law::Between { low: -0.3, high: 0.6 };
        for law in [law, bounded, between] {
            let image = law.project(z);
            let mut wanted = differences(|z| law.project(z).value, z);
            if matches!(law, Law::Coulomb { .. }) && image.slopes.x > 0.0 {
                // the growth of the disc with the pressure is left out
                wanted.x_axis = DVec3::X;
            }
            let off = image.along_axes(image.slopes) - wanted;
            let largest = off.to_cols_array().iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            // a kink between both points of a difference is met once in some ten thousand
            compared += usize::from(largest < 1e-4); // curvature of 1/|z_t| times the step squared
        }
    }
    assert!(compared >= 3 * COUNT - 5, "{compared} of {}", 3 * COUNT);
}

/// A point of 1 kg that meets the floor at 1 m/s, the floor asking for `push_m_s` more.
fn falling(push_m_s: f64) -> Iterate {
    let blocks = [diagonal(0, DVec3::ONE)];
    let members = [Member { blocks: &blocks, free: &FALL, unanswered: &[], now: &[], share: 1.0, response: None }];
    let h_s = 0.01;
    let gap_m = -push_m_s * h_s / 0.2;
    let contacts = [Contact { gap_m, ..contact([Side::node(0, 0), Side::FIXED], DVec3::Z) }];
    let problem = Problem { h_s, members: &members, contacts: &contacts, rows: &[], threads: &PlainLoop };
    let mut iterate = Iterate::default();
    iterate.system.take_members(&problem, &[0]).unwrap();
    iterate.rows.gather(&problem, &[0], &FALL);
    iterate.system.scale_rows(problem.members, &mut iterate.rows);
    iterate.reset(1);
    iterate
}

const FALL: [DVec3; 1] = [DVec3::new(0.0, 0.0, -1.0)];

#[test]
fn an_answer_that_makes_energy_is_shortened_to_one_that_does_not() {
    let mut iterate = falling(0.0);
    // five times the impulse that stops it, so it leaves at four times its speed
    iterate.state.lambda[0] = DVec3::X * 5.0;
    iterate.state.change[0] = DVec3::Z * 5.0;
    iterate.update_velocities();
    let ray = guard(&mut iterate, &[], &FALL);
    assert!((ray.share - 0.2).abs() < 1e-15 && (iterate.state.lambda[0].x - 1.0).abs() < 1e-15);
    assert!((ray.work_j + 0.5).abs() < 1e-15);
}

#[test]
fn the_guard_counts_what_an_inexact_response_made() {
    let mut iterate = falling(0.2);
    // by its impulse it would leave at −0.5 m/s; an inexact solve has it leave at 1.2 m/s, and made 0.22 J, 0.1 of them by push-out
    iterate.state.lambda[0] = DVec3::X * 0.5;
    iterate.state.change[0] = DVec3::Z * 2.2;
    iterate.state.left[0] = DVec3::Z * (0.5 - 2.2);
    iterate.update_velocities();
    let ray = guard(&mut iterate, &[], &FALL);
    let change = iterate.state.change[0].z;
    let made = 0.5 * (change - 1.0).powi(2) - 0.5 - 0.2 * iterate.state.lambda[0].x;
    assert!((ray.share - 2.3 / 4.84).abs() < 1e-12 && (change - 2.2 * ray.share).abs() < 1e-12, "{ray:?}");
    assert!(made < 0.0 && (made - ray.work_j).abs() < 1e-12, "{made} {ray:?}");
}
