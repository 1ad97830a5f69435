//! The promises of the solver besides its answers: errors that name the fault, the same bits, no panic.

use super::{Case, contact, is_open, rigid};
use crate::solve::{Block, Hold, JointRow, ProblemError, SIDE_TERMS_MAX, Side, SideTerm, Solver};
use glam::{DMat3, DVec3};
use metachron_core::{PlainLoop, SolveLevel};

/// A box that falls on the floor on three points.
fn case() -> Case {
    let mut body = rigid(1.0, DVec3::splat(0.05));
    body.free[0] = DVec3::new(0.3, 0.1, -0.5);
    let corners = [DVec3::new(-0.05, -0.05, -0.05), DVec3::new(0.05, -0.05, -0.05), DVec3::new(0.0, 0.05, -0.05)];
    let contacts = corners.map(|arm| contact([Side::rigid(0, arm), Side::FIXED], DVec3::Z)).to_vec();
    Case { h_s: 0.01, bodies: vec![body], contacts, rows: Vec::new() }
}

fn refusal(change: impl FnOnce(&mut Case)) -> String {
    let mut case = case();
    change(&mut case);
    let error = case.with(|problem| Solver::default().solve(problem).unwrap_err());
    error.to_string()
}

#[test]
fn what_is_wrong_is_named() {
    let reasons = [
        (refusal(|c| c.h_s = f64::NAN), "step is NaN"),
        (refusal(|c| c.contacts[2].gap_m = f64::NAN), "contact 2: its gap"),
        (refusal(|c| c.contacts[1].friction = -0.1), "contact 1: its friction"),
        (refusal(|c| c.contacts[1].parting_m_s = -0.1), "contact 1: the speed at which it parts"),
        (refusal(|c| c.contacts[1].surface_m_s.x = f64::NAN), "contact 1: its approach or"),
        (refusal(|c| c.rows = vec![JointRow::new(c.contacts[0].sides, Hold::along(DVec3::ONE))]), "row 0: its axis"),
        (refusal(|c| c.rows = vec![JointRow::new(c.contacts[0].sides, Hold::motor(DVec3::X, -1.0))]), "row 0: zero"),
        (refusal(|c| c.contacts[0].normal = DVec3::ZERO), "contact 0: normal and tangents"),
        (refusal(|c| c.contacts[0].sides = [Side::FIXED; 2]), "contact 0: neither side moves"),
        (refusal(|c| c.contacts[0].sides[0].member = 4), "contact 0: a side names a member"),
        (refusal(|c| c.contacts[0].sides[0] = Side::node(0, 7)), "contact 0: a side names a block"),
        (refusal(|c| c.bodies[0].free[1].x = f64::INFINITY), "member 0: a free velocity"),
        (refusal(|c| c.bodies[0].blocks[1].value = DMat3::IDENTITY * -1.0), "not positive definite at block 1"),
        (refusal(|c| c.bodies[0].blocks.clear()), "not positive definite at block 0"),
        (
            refusal(|c| c.bodies[0].blocks.push(Block { row: 0, column: 1, value: DMat3::ZERO })),
            "outside the lower half",
        ),
        (refusal(|c| c.bodies[0].blocks[0].value.y_axis.x = 0.1), "a diagonal block is not symmetric"),
    ];
    for (message, wanted) in reasons {
        assert!(message.contains(wanted), "{message} lacks {wanted}");
    }
    let terms = [SideTerm::weighted(0, 1.0); SIDE_TERMS_MAX + 1];
    assert_eq!(Side::new(0, &terms), Err(ProblemError::LongSide { terms: SIDE_TERMS_MAX + 1 }));
}

#[test]
fn a_refused_problem_leaves_the_solver_fit_for_the_next() {
    let (good, mut bad, mut solver) = (case(), case(), Solver::default());
    let wanted = good.with(|problem| solver.solve(problem).unwrap().clone());
    bad.contacts[0].gap_m = f64::NAN;
    assert!(bad.with(|problem| solver.solve(problem).is_err()));
    assert_eq!(good.with(|problem| solver.solve(problem).unwrap().clone()), wanted);
}

#[test]
fn the_same_problem_gives_the_same_bits() {
    let case = case();
    let solve = || case.with(|problem| Solver::default().solve(problem).unwrap().clone());
    assert_eq!(solve(), solve());
}

#[test]
fn numbers_that_overflow_give_no_impulse_and_are_told() {
    let mut case = case();
    case.bodies[0].free[1] = DVec3::splat(f64::MAX);
    let solution = case.with(|problem| Solver::default().solve(problem).unwrap().clone());
    assert!(is_open(&solution.report));
    assert!(solution.contacts_n_s.iter().all(|p| *p == DVec3::ZERO));
}

#[test]
fn bodies_without_contacts_keep_their_velocities() {
    let case = Case { contacts: Vec::new(), ..case() };
    let solution = case.with(|problem| Solver::default().solve(problem).unwrap().clone());
    assert_eq!(solution.velocities(0), case.bodies[0].free);
    assert_eq!(solution.report.level, SolveLevel::Kept);
}

#[test]
fn gap_depth_and_slip_owed_become_velocities() {
    let free = contact([Side::node(0, 0), Side::FIXED], DVec3::Z);
    let bias = |gap_m: f64, owed_slip_m: DVec3| {
        let contact = crate::solve::Contact { gap_m, owed_slip_m, tangents: [DVec3::X, DVec3::Y], ..free };
        contact.bias_m_s(0.01)
    };
    let close = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-15, "{a} is not {b}");
    close(bias(0.002, DVec3::ZERO), DVec3::X * 0.2); // the whole gap in one step
    close(bias(-0.001, DVec3::ZERO), DVec3::X * -0.02); // a fifth of the depth
    close(bias(-0.1, DVec3::ZERO), DVec3::X * -0.5); // and no faster than this
    close(bias(0.0, DVec3::new(0.001, -0.002, 7.0)), DVec3::new(0.0, 0.02, -0.04)); // a fifth of the slip
}

#[test]
fn a_contact_that_moves_nothing_gives_nothing() {
    let mut case = case();
    case.contacts[0].sides[0] = Side::new(0, &[SideTerm::weighted(0, 0.0)]).unwrap();
    case.contacts[0].gap_m = -0.01;
    let solution = case.with(|problem| Solver::default().solve(problem).unwrap().clone());
    assert_eq!(solution.contacts_n_s[0], DVec3::ZERO);
    assert!(!is_open(&solution.report));
}

#[test]
fn a_slower_member_meets_as_stiff_as_its_own_step_makes_it() {
    // f = 2: its place moves by twice A⁻¹, so half the impulse stops it
    let case = Case { contacts: vec![contact([Side::node(0, 0), Side::FIXED], DVec3::Z)], ..case() };
    let impulse = |share: f64| {
        let members = [crate::solve::Member {
            blocks: &case.bodies[0].blocks,
            free: &case.bodies[0].free,
            unanswered: &[],
            now: &[],
            share,
            response: None,
        }];
        let problem = crate::solve::Problem {
            h_s: 0.01,
            members: &members,
            contacts: &case.contacts,
            rows: &[],
            threads: &PlainLoop,
        };
        Solver::default().solve(&problem).unwrap().contacts_n_s[0].z
    };
    assert!((impulse(1.0) / impulse(2.0) - 2.0).abs() < 1e-3, "{} {}", impulse(1.0), impulse(2.0));
}
