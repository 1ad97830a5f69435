//! Bounds of impulses in interior points: each kind of row against its closed form, and the promises of a solve that ends early.

use crate::solve::cones::lorentz::{Lorentz, Scaling};
use crate::solve::tests::random::{COUNT, distance, miss, random_case, solved, velocities};
use crate::solve::tests::{Case, Seeded, contact, is_open, rigid};
use crate::solve::{Hold, JointRow, Settings, Side, Solution};
use glam::DVec3;
use metachron_core::SolveLevel;

const H_S: f64 = 0.01;
const G: f64 = 9.81;
const MASS: f64 = 2.0;

/// A box that moves at `free_m_s`, held at its centre by one row.
fn held(hold: Hold, free_m_s: DVec3, factors_max: Option<u32>) -> Solution {
    let mut body = rigid(MASS, DVec3::splat(0.1));
    body.free[0] = free_m_s;
    let row = JointRow { compliance_per_kg: Some(1e-6), ..JointRow::new([Side::node(0, 0), Side::FIXED], hold) };
    let case = Case { h_s: H_S, bodies: vec![body], contacts: vec![], rows: vec![row] };
    solved(&case, Settings { factors_max, ..Settings::default() })
}

#[test]
fn every_bound_gives_what_it_takes_or_all_it_has() {
    let (down, weight) = (DVec3::Z * (-G * H_S), MASS * G * H_S);
    let aslant = DVec3::new(0.6, 0.0, -0.8) * (G * H_S);
    let rows = [
        ("a stop that lets go", Hold::pushing(DVec3::Z), -down, DVec3::ZERO),
        ("a stop that is met", Hold::pushing(DVec3::Z), down, DVec3::Z * weight),
        ("a rope that is taut", Hold::pushing(DVec3::NEG_Z), -down, DVec3::Z * -weight),
        ("a motor at its effort", Hold::motor(DVec3::Z, 0.4 * weight), down, DVec3::Z * (0.4 * weight)),
        ("a motor that holds", Hold::motor(DVec3::Z, 3.0 * weight), -down, DVec3::Z * -weight),
        (
            "a drive with unlike bounds",
            Hold::Along { axis: DVec3::Z, low_n_s: -5.0, high_n_s: 0.3 * weight },
            down,
            DVec3::Z * (0.3 * weight),
        ),
        ("a weight over its yield", Hold::ALL.limited(0.9 * weight), down, DVec3::Z * (0.9 * weight)),
        ("a weight under its yield", Hold::ALL.limited(1.1 * weight), down, DVec3::Z * weight),
        ("a yield aslant", Hold::ALL.limited(0.9 * weight), aslant, aslant / (-G * H_S) * (0.9 * weight)),
        ("an attachment to its last", Hold::ALL, down, DVec3::Z * weight),
        ("a slide over its yield", Hold::across(DVec3::X).limited(0.5 * weight), aslant, DVec3::Z * (0.5 * weight)),
        ("a row that may give nothing", Hold::ALL.limited(0.0), down, DVec3::ZERO),
    ];
    for (name, hold, free_m_s, wanted_n_s) in rows {
        for (factors_max, slack) in [(Some(8), 1e-3), (None, 1e-4)] {
            let solution = held(hold, free_m_s, factors_max);
            let given = solution.rows_n_s[0];
            assert!(
                (given - wanted_n_s).length() < slack * weight,
                "{name}, {factors_max:?}: {given} for {wanted_n_s}"
            );
            assert!(given.length() <= hold.most_n_s(given) * (1.0 + 1e-12), "{name}: {given}");
            let answered = free_m_s + given / MASS;
            assert!(solution.velocities(0)[0].distance(answered) < 1e-14, "{name}: momentum is not balanced");
            assert!(factors_max.is_some() || !is_open(&solution.report), "{name}: {:?}", solution.report);
        }
    }
}

#[test]
fn a_solve_that_ends_early_is_safe_and_more_factors_come_nearer() {
    let budgets = [1, 3, 5, 8, 12];
    let (mut off, mut finished) = ([0.0; 5], [0; 5]);
    for seed in 0..COUNT {
        let case = random_case(seed);
        let exact = velocities(&case, &solved(&case, Settings::default()));
        for (k, most) in budgets.into_iter().enumerate() {
            let solution = solved(&case, Settings { factors_max: Some(most), ..Settings::default() });
            let report = solution.report;
            assert!(report.factors <= most as usize && report.work_j < 1e-11, "{seed}: {report:?}");
            // that all impulses lie in their cones
            miss(&case, &solution);
            finished[k] += usize::from(report.level != SolveLevel::Interior);
            off[k] += distance(&exact, &velocities(&case, &solution)).max(1e-6).ln();
        }
    }
    let off = off.map(|sum| (sum / COUNT as f64).exp());
    println!("off by {off:?} m/s in the mean, {finished:?} of {COUNT} finished");
    assert!(off.windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{off:?}");
}

#[test]
fn a_landing_of_a_box_keeps_its_momentum_at_every_budget() {
    let mut body = rigid(MASS, DVec3::splat(0.1));
    body.free = vec![DVec3::new(0.3, 0.1, -2.0), DVec3::new(1.0, -2.0, 0.5)];
    let corners = [[-0.1, -0.1], [0.1, -0.1], [-0.1, 0.1], [0.1, 0.1]];
    let touches = corners.map(|[x, y]| contact([Side::rigid(0, DVec3::new(x, y, -0.1)), Side::FIXED], DVec3::Z));
    let case = Case { h_s: H_S, bodies: vec![body.clone()], contacts: touches.to_vec(), rows: vec![] };
    for factors_max in [Some(0), Some(1), Some(3), Some(5), None] {
        let solution = solved(&case, Settings { factors_max, ..Settings::default() });
        let given: DVec3 = solution.contacts_n_s.iter().sum();
        let gained = (solution.velocities(0)[0] - body.free[0]) * MASS;
        assert!(gained.distance(given) < 1e-13, "{factors_max:?}: {gained} by {given}");
        assert!(solution.report.work_j < 1e-12, "{:?}", solution.report);
    }
}

/// A point inside the cone.
fn inside(numbers: &mut Seeded) -> Lorentz {
    let tail = numbers.vector();
    Lorentz::new(tail.length() + 0.01 + numbers.unit(), tail)
}

#[test]
fn a_scaling_takes_one_point_to_the_other_and_a_reach_ends_at_the_edge() {
    let mut numbers = Seeded::new(4);
    for _ in 0..1000 {
        let (l, y) = (inside(&mut numbers), inside(&mut numbers));
        let scaling = Scaling::of(l, y);
        let there = scaling.scale(scaling.scale(l)).plus(y, -1.0);
        assert!(there.head.abs() + there.tail.length() < 1e-12 * (1.0 + scaling.t), "{l:?} {y:?}");
        let step = Lorentz::new(numbers.between(-3.0, 1.0), numbers.vector() * 2.0);
        let reach = l.reach(step);
        if reach.is_finite() {
            let edge = l.plus(step, reach);
            assert!((edge.head - edge.tail.length()).abs() < 1e-9 * (1.0 + edge.head.abs()), "{l:?} {step:?}");
            let before = l.plus(step, 0.99 * reach);
            assert!(before.head > before.tail.length());
        }
    }
}
