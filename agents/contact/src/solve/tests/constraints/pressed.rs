//! Rows bounded by the pressure of a contact: friction about its normal, in both forms, and in random piles.

use crate::solve::tests;
use crate::solve::tests::{Body, Case, Seeded, contact, is_open, rigid};
use crate::solve::{Hold, JointRow, Pressed, Settings, Side, Solver, StepForm};
use glam::DVec3;

const H_S: f64 = 0.01;
const G: f64 = 9.81;
/// The block of a rigid body's spin.
const SPIN: usize = 1;

/// Friction about the normal of a contact of bodies that turn as a whole.
fn spin_of(contact: usize, sides: [Side; 2], normal: DVec3, reach_m: f64) -> JointRow {
    let pressed = Some(Pressed { contact, reach_m });
    JointRow { pressed, ..JointRow::new(sides, Hold::motor(normal, f64::INFINITY)) }
}

#[test]
fn a_body_on_one_point_loses_its_spin_by_reach_times_its_weight_in_both_forms() {
    let (mass, reach_m) = (2.0, 0.01);
    let body = Body { free: vec![DVec3::Z * (-G * H_S), DVec3::Z * 3.0], ..rigid(mass, DVec3::splat(0.1)) };
    let inertia = body.blocks[SPIN].value.z_axis.z;
    let touch = contact([Side::rigid(0, DVec3::Z * -0.1), Side::FIXED], DVec3::Z);
    let row = spin_of(0, [Side::node(0, SPIN), Side::FIXED], DVec3::Z, reach_m);
    for (spin, form) in [(3.0, StepForm::Direct), (-3.0, StepForm::Iterative), (0.01, StepForm::Direct)] {
        let body = Body { free: vec![body.free[0], DVec3::Z * spin], ..body.clone() };
        let case = Case { h_s: H_S, bodies: vec![body], contacts: vec![touch], rows: vec![row] };
        let mut solver = Solver::new(Settings { form, ..Settings::default() });
        let (after, report) = case.with(|problem| {
            let solution = solver.solve(problem).unwrap();
            (solution.velocities(0)[SPIN].z, solution.report)
        });
        let most = reach_m * mass * G * H_S / inertia;
        let wanted = spin - spin.clamp(-most, most);
        // a row that holds gives way by v_s, 4e-4 a second
        assert!(
            (after - wanted).abs() < 5e-4 && !is_open(&report),
            "{spin}, {form:?}: {after}, {wanted} wanted, {report:?}"
        );
        assert!(after * spin >= -1e-9, "nothing turns back");
    }
}

#[test]
fn a_row_that_is_pressed_gives_no_more_than_its_own_bounds_allow() {
    let (mass, reach_m, spin) = (2.0, 0.01, 3.0);
    let body = Body { free: vec![DVec3::Z * (-G * H_S), DVec3::Z * spin], ..rigid(mass, DVec3::splat(0.1)) };
    let inertia = body.blocks[SPIN].value.z_axis.z;
    let touch = contact([Side::rigid(0, DVec3::Z * -0.1), Side::FIXED], DVec3::Z);
    let pressed = reach_m * mass * G * H_S;
    for (own, wanted) in [(0.25 * pressed, 0.25 * pressed), (4.0 * pressed, pressed), (0.0, 0.0)] {
        for factors_max in [None, Some(8)] {
            let hold = Hold::motor(DVec3::Z, own);
            let row = JointRow { hold, ..spin_of(0, [Side::node(0, SPIN), Side::FIXED], DVec3::Z, reach_m) };
            let case = Case { h_s: H_S, bodies: vec![body.clone()], contacts: vec![touch], rows: vec![row] };
            let mut solver = Solver::new(Settings { factors_max, ..Settings::default() });
            let after = case.with(|problem| solver.solve(problem).unwrap().velocities(0)[SPIN].z);
            let given = inertia * (spin - after);
            // the contact gives way by v_s, and presses by that much less
            assert!((given - wanted).abs() < 1e-2 * pressed, "{own}, {factors_max:?}: {given} of {wanted}");
        }
    }
}

/// Boxes on each other and on the ground, on one to three points each, spinning.
fn pile(seed: u64) -> Case {
    let mut random = Seeded::new(seed);
    let count = 1 + random.below(4);
    let (mut contacts, mut rows, mut bodies) = (vec![], vec![], vec![]);
    for k in 0..count {
        let mass = 10.0_f64.powf(random.between(-1.0, 1.0));
        let free = vec![random.vector() * 0.3 - DVec3::Z * (G * H_S), random.vector() * 5.0];
        bodies.push(Body { free, ..rigid(mass, DVec3::splat(0.1)) });
        for _ in 0..1 + random.below(3) {
            let at = DVec3::new(random.between(-0.1, 0.1), random.between(-0.1, 0.1), -0.1);
            let below = if k == 0 { Side::FIXED } else { Side::rigid(k - 1, at.with_z(0.1)) };
            let under = if k == 0 { Side::FIXED } else { Side::node(k - 1, SPIN) };
            let normal = (DVec3::Z + random.vector() * 0.2).normalize();
            let friction = random.between(0.1, 0.8);
            let reach_m = friction * random.between(0.005, 0.1);
            rows.push(spin_of(contacts.len(), [Side::node(k, SPIN), under], normal, reach_m));
            contacts.push(tests::Contact { friction, ..contact([Side::rigid(k, at), below], normal) });
        }
    }
    Case { h_s: H_S, bodies, contacts, rows }
}

#[test]
fn in_random_piles_no_spin_gives_more_than_its_pressure_and_what_slips_gives_all_of_it() {
    let mut factors = 0;
    for seed in 0..300 {
        let case = pile(seed);
        let mut solver = Solver::new(Settings::default());
        case.with(|problem| {
            let solution = solver.solve(problem).unwrap();
            factors += solution.report.factors;
            assert!(!is_open(&solution.report), "{seed}: {:?}", solution.report);
            assert!(solution.report.work_j < 1e-9, "{seed}: {:?}", solution.report);
            for (k, row) in case.rows.iter().enumerate() {
                let normal = case.contacts[k].normal;
                let spin = |at: usize| match row.sides[at].terms() {
                    [] => DVec3::ZERO,
                    _ => solution.velocities(row.sides[at].member)[SPIN],
                };
                let slips = (spin(0) - spin(1)).dot(normal);
                let (given, most) = (
                    solution.rows_n_s[k].dot(normal),
                    row.pressed.unwrap().reach_m * solution.contacts_n_s[k].dot(normal),
                );
                assert!(given.abs() <= most + 1e-7, "{seed}: {given} N m s of {most}");
                // v_s of a row that holds, and a tolerance
                let holds = slips.abs() < 1e-3;
                assert!(
                    holds || (given + most * slips.signum()).abs() < 1e-6 + 1e-4 * most,
                    "{seed}: {slips} rad/s by {given} of {most}"
                );
            }
        });
    }
    // 12.7 factors in the mean measured
    assert!(factors < 300 * 15, "{factors} factors");
}
