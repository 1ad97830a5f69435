//! Joints as rows, each against its closed form: held points and turns, slides, motors, stops, ropes.

use crate::solve::tests::{Body, Case, is_open, rigid};
use crate::solve::{Hold, JointRow, Settings, Side, Solution, Solver, Spring, StepForm};
use glam::DVec3;

const H: f64 = 0.01;
const G: f64 = 9.81;
/// The block of a rigid body's spin.
const SPIN: usize = 1;

/// Joints as hard as they become: they give way by a ten-millionth of their load.
fn hard(form: StepForm) -> Settings {
    Settings { tolerance_m_s: 1e-10, depth_m: 1e-12, form, still_m_s: 1e-12, ..Settings::default() }
}

fn solved(bodies: &[Body], rows: Vec<JointRow>) -> Solution {
    let case = Case { h_s: H, bodies: bodies.to_vec(), contacts: Vec::new(), rows };
    let solve = |form| case.with(|problem| Solver::new(hard(form)).solve(problem).unwrap().clone());
    let (solution, other) = (solve(StepForm::Direct), solve(StepForm::Iterative));
    assert!(!is_open(&solution.report), "{:?}", solution.report);
    for k in 0..bodies.len() {
        let pairs = solution.velocities(k).iter().zip(other.velocities(k));
        pairs.for_each(|(a, b)| assert!(a.distance(*b) < 1e-7, "{a} is not {b} in the iterative form"));
    }
    solution
}

/// A bar of 2 kg in the fall, with its inertia about its centre.
fn falling() -> (Body, DVec3) {
    let half = DVec3::new(0.2, 0.03, 0.05);
    let mut body = rigid(2.0, half);
    body.free[0] = DVec3::Z * (-G * H);
    let inertia = body.blocks[1].value;
    (body, DVec3::new(inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z))
}

fn on_ground(side: Side, hold: Hold) -> JointRow {
    JointRow::new([side, Side::FIXED], hold)
}

#[test]
fn a_bar_held_at_a_point_begins_to_swing_as_a_pendulum() {
    let (bar, inertia) = falling();
    let arm = DVec3::new(-0.2, 0.0, 0.0);
    let solution = solved(&[bar], vec![on_ground(Side::rigid(0, arm), Hold::ALL)]);
    let spin = solution.velocities(0)[SPIN];
    let wanted = DVec3::Y * (2.0 * G * 0.2 * H / (inertia.y + 2.0 * 0.04));
    assert!(spin.distance(wanted) < 1e-6, "{spin} is not {wanted}");
}

#[test]
fn a_hinge_turns_about_its_axis_alone() {
    let (bar, inertia) = falling();
    let (arm, axis) = (DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.0, 1.0, 1.0).normalize());
    let rows = vec![on_ground(Side::rigid(0, arm), Hold::ALL), on_ground(Side::node(0, SPIN), Hold::across(axis))];
    let solution = solved(&[bar], rows);
    let spin = solution.velocities(0)[SPIN];
    // torque and inertia about the axis through the point
    let torque = DVec3::X.cross(DVec3::Z * -G).dot(axis) * 2.0 * 0.2;
    let about = (inertia * axis).dot(axis) + 2.0 * axis.cross(DVec3::X * 0.2).length_squared();
    let wanted = axis * (torque / about * H);
    assert!(spin.distance(wanted) < 1e-6, "{spin} is not {wanted}");
}

#[test]
fn a_slide_goes_along_its_axis_and_does_not_turn() {
    let (bar, _) = falling();
    let axis = DVec3::new(3.0, 0.0, -4.0) / 5.0;
    let rows = vec![
        on_ground(Side::rigid(0, DVec3::new(0.1, 0.05, 0.0)), Hold::across(axis)),
        on_ground(Side::node(0, SPIN), Hold::ALL),
    ];
    let solution = solved(&[bar], rows);
    let (velocity, wanted) = (solution.velocities(0), axis * (G * H * 0.8));
    assert!(velocity[0].distance(wanted) < 1e-6 && velocity[SPIN].length() < 1e-6, "{velocity:?}");
}

#[test]
fn two_boxes_held_in_all_directions_are_one_body() {
    let mut boxes = [rigid(1.0, DVec3::splat(0.1)), rigid(1.0, DVec3::splat(0.1))];
    boxes[0].free = vec![DVec3::Y * 3.0, DVec3::ZERO];
    let arm = DVec3::X * 0.1;
    let rows = vec![
        JointRow::new([Side::rigid(0, arm), Side::rigid(1, -arm)], Hold::ALL),
        JointRow::new([Side::node(0, SPIN), Side::node(1, SPIN)], Hold::ALL),
    ];
    let solution = solved(&boxes, rows);
    let as_one = rigid(2.0, DVec3::new(0.2, 0.1, 0.1)).blocks[1].value.z_axis.z;
    let wanted = DVec3::Z * (-0.1 * 3.0 / as_one); // the one that moves lies at −0.1 of the middle
    for k in 0..2 {
        assert!(solution.velocities(k)[SPIN].distance(wanted) < 1e-6);
    }
    let mean = (solution.velocities(0)[0] + solution.velocities(1)[0]) * 0.5;
    assert!(mean.distance(DVec3::Y * 1.5) < 1e-9);
}

/// The spin that a motor of 2 N m leaves a wheel about z, which it is to bring to 10 1/s, and the motor's impulse.
fn motor(start: f64) -> (f64, f64) {
    let mut wheel = rigid(2.0, DVec3::splat(0.1));
    wheel.free[SPIN] = DVec3::Z * start;
    let target_m_s = DVec3::Z * 10.0;
    let row = JointRow { target_m_s, ..on_ground(Side::node(0, SPIN), Hold::motor(DVec3::Z, 2.0 * H)) };
    let solution = solved(&[wheel], vec![row]);
    (solution.velocities(0)[SPIN].z, solution.rows_n_s[0].z)
}

#[test]
fn a_motor_reaches_its_speed_or_gives_its_limit() {
    let inertia = rigid(2.0, DVec3::splat(0.1)).blocks[1].value.z_axis.z;
    let (spin, given) = motor(9.5);
    assert!((spin - 10.0).abs() < 1e-5 && (given - 0.5 * inertia).abs() < 1e-6, "{spin} {given}");
    for (start, sign) in [(2.0, 1.0), (30.0, -1.0)] {
        let (spin, given) = motor(start);
        assert!((given - sign * 0.02).abs() < 1e-12, "{given}");
        assert!((spin - start - sign * 0.02 / inertia).abs() < 1e-9, "{spin}");
    }
}

#[test]
fn a_stop_lets_go_what_leaves_it_and_ends_what_comes() {
    let stop = |spin: f64, gap: f64| {
        let mut wheel = rigid(2.0, DVec3::splat(0.1));
        wheel.free[SPIN] = DVec3::Z * spin;
        // the angle may not grow past the stop, so it pushes back
        let row = on_ground(Side::node(0, SPIN), Hold::pushing(-DVec3::Z)).with_gap(gap, H);
        solved(&[wheel], vec![row]).velocities(0)[SPIN].z
    };
    assert!((stop(3.0, 0.02) - 2.0).abs() < 1e-6); // the way left, in one step
    assert_eq!(stop(1.0, 0.02), 1.0);
    assert_eq!(stop(-3.0, 0.0), -3.0);
    assert!((stop(1.0, -0.01) + 0.2).abs() < 1e-6); // a fifth of the way past the stop
}

#[test]
fn a_rope_holds_along_itself_once_it_is_taut() {
    let rope = |slack: f64| {
        let mut ball = rigid(0.5, DVec3::splat(0.02));
        ball.free[0] = DVec3::new(0.7, 0.0, -2.0);
        let row = on_ground(Side::rigid(0, DVec3::ZERO), Hold::pushing(DVec3::Z)).with_gap(slack, H);
        solved(&[ball], vec![row]).velocities(0)[0]
    };
    assert!(rope(0.005).distance(DVec3::new(0.7, 0.0, -0.5)) < 1e-6);
    assert_eq!(rope(0.03), DVec3::new(0.7, 0.0, -2.0));
}

#[test]
fn a_torsion_spring_along_an_axis_is_implicit_at_its_end() {
    let mut wheel = rigid(2.0, DVec3::splat(0.1));
    wheel.free[SPIN] = DVec3::new(1.0, 2.0, 3.0);
    let inertia = wheel.blocks[1].value.z_axis.z;
    let (k, c, stretch) = (5.0, 0.1, 0.2);
    let spring = Spring { stiffness_n_m: k, damping_n_s_m: c, stretch_m: DVec3::new(7.0, 7.0, stretch) };
    let row = on_ground(Side::node(0, SPIN), Hold::along(DVec3::Z)).with_spring(spring, H);
    let solution = solved(&[wheel], vec![row]);
    let wanted = (inertia * 3.0 - H * k * stretch) / (inertia + H * H * k + H * c);
    let spin = solution.velocities(0)[SPIN];
    assert!(spin.distance(DVec3::new(1.0, 2.0, wanted)) < 1e-6, "{spin} is not {wanted}");
}

#[test]
fn a_bob_on_a_rod_swings_with_its_period() {
    let (h_s, length) = (5e-4, 0.5);
    let mut solver = Solver::new(hard(StepForm::Direct));
    let (mut place, mut velocity) = (DVec3::new(0.01, 0.0, -length), DVec3::ZERO);
    let (mut time, mut crossings) = (0.0, Vec::new());
    while crossings.len() < 3 {
        let mut bob = rigid(0.2, DVec3::splat(0.01));
        bob.free[0] = velocity - DVec3::Z * (G * h_s);
        let (axis, error) = (place.normalize(), place.length() - length);
        let target_m_s = axis * (-0.2 * error / h_s);
        let row = JointRow { target_m_s, ..on_ground(Side::rigid(0, DVec3::ZERO), Hold::along(axis)) };
        let case = Case { h_s, bodies: vec![bob], contacts: Vec::new(), rows: vec![row] };
        velocity = case.with(|problem| solver.solve(problem).unwrap().velocities(0)[0]);
        let before = place.x;
        place += velocity * h_s;
        if before > 0.0 && place.x <= 0.0 {
            crossings.push(time + h_s * before / (before - place.x));
        }
        time += h_s;
    }
    let period = (crossings[2] - crossings[0]) / 2.0;
    let wanted = std::f64::consts::TAU * (length / G).sqrt() * (1.0 + 4e-4 / 16.0); // an amplitude of 0.02
    assert!((period / wanted - 1.0).abs() < 2e-4, "{period} is not {wanted}");
}
