//! Restitution and moving surfaces: impacts in closed form.

use super::{Body, Case, contact, is_open, rigid, side_velocity};
use crate::solve::{Contact, Settings, Side, Solution, Solver};
use glam::DVec3;

/// Contacts as hard as they become, so that an impact gives way by a ten-millionth of its speed.
const HARD: Settings = Settings {
    tolerance_m_s: 1e-10,
    depth_m: 1e-12,
    form: crate::solve::StepForm::Direct,
    still_m_s: 1e-12,
    factors_max: None,
};

fn solved(case: &Case) -> Solution {
    let solution = case.with(|problem| Solver::new(HARD).solve(problem).unwrap().clone());
    assert!(!is_open(&solution.report), "{:?}", solution.report);
    solution
}

/// A contact that parts at `restitution` times the speed at which the bodies close as they are.
fn closing(bodies: &[Body], contact: Contact, restitution: f64) -> Contact {
    let free: Vec<_> = bodies.iter().map(|body| body.free.clone()).collect();
    let relative = side_velocity(&contact.sides[0], &free) - side_velocity(&contact.sides[1], &free);
    let closing_m_s = -(relative - contact.surface_m_s).dot(contact.normal);
    Contact { parting_m_s: restitution * closing_m_s.max(0.0), ..contact }
}

/// Balls in a row along x, each touching the next.
fn row_of_balls(masses: &[f64], speeds: &[f64], restitution: f64) -> Case {
    let mut bodies: Vec<_> = masses.iter().map(|&mass| rigid(mass, DVec3::splat(0.05))).collect();
    bodies.iter_mut().zip(speeds).for_each(|(body, &speed)| body.free[0].x = speed);
    let touching = |k: usize| {
        let arm = DVec3::X * 0.05;
        let sides = [Side::rigid(k + 1, -arm), Side::rigid(k, arm)];
        closing(&bodies, Contact { friction: 0.0, ..contact(sides, DVec3::X) }, restitution)
    };
    let contacts = (0..masses.len() - 1).map(touching).collect();
    Case { h_s: 0.01, bodies, contacts, rows: Vec::new() }
}

fn speeds(solution: &Solution, count: usize) -> Vec<f64> {
    (0..count).map(|k| solution.velocities(k)[0].x).collect()
}

/// Kinetic energy of rigid bodies with these velocities, J.
fn energy(case: &Case, velocities: impl Fn(usize) -> Vec<DVec3>) -> f64 {
    let of = |(k, body): (usize, &Body)| {
        let v = velocities(k);
        body.blocks.iter().map(|b| v[b.row].dot(b.value * v[b.column]) * 0.5).sum::<f64>()
    };
    case.bodies.iter().enumerate().map(of).sum()
}

fn gained(case: &Case, solution: &Solution) -> f64 {
    energy(case, |k| solution.velocities(k).to_vec()) - energy(case, |k| case.bodies[k].free.clone())
}

#[test]
fn two_bodies_part_at_newtons_speed() {
    for mass in [1.0, 10.0, 1000.0] {
        for restitution in [0.0, 0.3, 0.5, 0.8, 1.0] {
            let case = row_of_balls(&[1.0, mass], &[1.0, -0.5], restitution);
            let solution = solved(&case);
            let (mean, parting) = ((1.0 - 0.5 * mass) / (1.0 + mass), restitution * 1.5);
            let wanted = [mean - parting * mass / (1.0 + mass), mean + parting / (1.0 + mass)];
            for (v, wanted) in speeds(&solution, 2).iter().zip(wanted) {
                assert!((v - wanted).abs() < 1e-6, "{mass}, {restitution}: {v} is not {wanted}");
            }
        }
    }
}

#[test]
fn three_balls_of_a_cradle_keep_momentum_and_gain_no_energy() {
    for restitution in [0.0, 0.5, 1.0] {
        let case = row_of_balls(&[1.0; 3], &[1.0, 0.0, 0.0], restitution);
        let solution = solved(&case);
        let v = speeds(&solution, 3);
        // one impact for all: the first parts at e, the others stay together
        let wanted = [(1.0 - 2.0 * restitution) / 3.0, (1.0 + restitution) / 3.0, (1.0 + restitution) / 3.0];
        assert!(v.iter().zip(wanted).all(|(v, w)| (v - w).abs() < 1e-6), "{restitution}: {v:?}");
        assert!(gained(&case, &solution) < 1e-7);
    }
}

#[test]
fn a_conveyor_takes_a_box_along() {
    let (h_s, friction, belt) = (0.01, 0.3, DVec3::new(0.4, 0.2, 0.0));
    let mut velocity = [DVec3::ZERO; 2];
    let mut solver = Solver::new(HARD);
    let mut step = |velocity: &mut [DVec3; 2]| {
        let mut body = rigid(2.0, DVec3::splat(0.1));
        body.free = vec![velocity[0] - DVec3::Z * (9.81 * h_s), velocity[1]];
        let corner = |x: f64, y: f64| {
            let side = [Side::rigid(0, DVec3::new(x, y, 0.0)), Side::FIXED];
            Contact { friction, surface_m_s: belt, ..contact(side, DVec3::Z) }
        };
        let contacts = vec![corner(-0.1, -0.1), corner(0.1, -0.1), corner(-0.1, 0.1), corner(0.1, 0.1)];
        let case = Case { h_s, bodies: vec![body], contacts, rows: Vec::new() };
        let solution = case.with(|problem| solver.solve(problem).unwrap().clone());
        *velocity = [solution.velocities(0)[0], solution.velocities(0)[1]];
        solution.contacts_m_s[0]
    };
    for k in 1..=10 {
        let slip = step(&mut velocity);
        let wanted = belt.normalize() * (friction * 9.81 * h_s * f64::from(k));
        assert!(velocity[0].distance(wanted) < 1e-6, "{} is not {wanted}", velocity[0]);
        assert!(slip.distance(wanted - belt) < 1e-6);
    }
    (0..20).for_each(|_| {
        step(&mut velocity);
    });
    assert!(velocity[0].distance(belt) < 1e-6, "{}", velocity[0]);
}

#[test]
fn a_surface_that_is_led_against_a_body_pushes_it() {
    let case = Case {
        h_s: 0.01,
        bodies: vec![rigid(2.0, DVec3::splat(0.1))],
        contacts: vec![Contact {
            surface_m_s: DVec3::Z * 0.7,
            ..contact([Side::rigid(0, DVec3::ZERO), Side::FIXED], DVec3::Z)
        }],
        rows: Vec::new(),
    };
    let solution = solved(&case);
    assert!((solution.velocities(0)[0].z - 0.7).abs() < 1e-6);
    assert!(solution.contacts_m_s[0].length() < 1e-6);
    assert!((solution.contacts_n_s[0].z - 1.4).abs() < 2e-6);
}
