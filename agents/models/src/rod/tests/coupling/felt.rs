//! What a tube says that its contacts weigh, against a dense solve of its own system.

use super::super::{millis, reference_spec};
use super::Prop;
use super::meetings::RADIUS;
use crate::rod::Tube;
use crate::rod::TubeSpec;
use crate::rod::banded_ldl::Row;
use glam::{DMat3, DVec3};
use metachron_contact::{Agent, Neighbour, StepContext};
use metachron_core::{AgentId, SimTime, Snapshot};
use metachron_geometry::Solid;
use std::sync::Arc;

const SEGMENTS: usize = 24;
const BALL_KG: f64 = 0.2;

/// The matrix of a tube's step as it is, number by number.
fn dense(rows: &[Row]) -> Vec<Vec<f64>> {
    let mut all = vec![vec![0.0; 3 * rows.len()]; 3 * rows.len()];
    let mut set = |i: usize, j: usize, block: DMat3| {
        for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
            all[3 * i + a][3 * j + b] = block.col(b)[a];
            all[3 * j + b][3 * i + a] = block.col(b)[a];
        }
    };
    for (i, row) in rows.iter().enumerate() {
        set(i, i, row.diag.full());
        (1..=i.min(1)).for_each(|_| set(i, i - 1, row.near));
        (2..=i.min(2)).for_each(|_| set(i, i - 2, row.far.full()));
    }
    all
}

/// Gaussian elimination with pivots.
fn solve(mut a: Vec<Vec<f64>>, mut r: Vec<f64>) -> Vec<f64> {
    let n = r.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, pivot);
        r.swap(k, pivot);
        let (head, row) = (r[k], a[k].clone());
        for i in k + 1..n {
            let share = a[i][k] / row[k];
            (k..n).for_each(|j| a[i][j] -= share * row[j]);
            r[i] -= share * head;
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k][j] * r[j]).sum();
        r[k] = (r[k] - known) / a[k][k];
    }
    r
}

/// How a tube that is clamped at its start gives way to a ball that comes down on it at `x_m`, 1/kg: as it says, and by the dense solve.
fn felt(x_m: f64, young_pa: f64) -> ([f64; 2], f64) {
    let spec = TubeSpec { clamp: [true, false], friction: 0.0, ..reference_spec(young_pa, SEGMENTS) };
    let mut tube = Tube::new(spec).unwrap();
    let mut ball = Prop::new(Solid::Ball { radius_m: 0.02 }, BALL_KG, DVec3::new(x_m, 0.0, RADIUS + 0.0201), 0.0);
    ball.state.velocity = DVec3::NEG_Z;
    let mut seen = Snapshot::default();
    ball.write_snapshot(&mut seen);
    let near = Neighbour { form: ball.form(), owned: true, ..Neighbour::observed(AgentId(3), Arc::new(seen)) };
    let neighbours = std::slice::from_ref(&near);
    tube.step(millis(4.0), &StepContext { neighbours, ..StepContext::alone(AgentId(0), SimTime::ZERO) }).unwrap();
    let mut told = Snapshot::default();
    tube.write_snapshot(&mut told);
    let rows = tube.step_by(0.004, |stepper, _, _, _| stepper.rows.clone());
    let (segment, share) = tube.division().locate(x_m);
    let mut push = vec![0.0; 3 * rows.len()];
    (push[6 * segment + 2], push[6 * segment + 8]) = (1.0 - share, share);
    let answer = solve(dense(&rows), push);
    let way = answer[6 * segment + 2] * (1.0 - share) + answer[6 * segment + 8] * share;
    (told.pairs[0].inverse_mass_per_kg.unwrap(), way)
}

#[test]
fn a_ball_feels_of_a_tube_what_a_dense_solve_of_its_step_gives() {
    for (x_m, young_pa) in [(1.0, 1e6), (0.97, 1e6), (0.5, 1e6), (1.0, 1e8), (0.3, 1e5)] {
        let ([tube, ball], want) = felt(x_m, young_pa);
        println!("{x_m} m, {young_pa} Pa: {tube} and {ball}, dense {want}");
        // f64: some hundred roundings, condition of a stiff tube's step below 1e5
        assert!((tube / want - 1.0).abs() < 1e-9, "{x_m} m, {young_pa} Pa: {tube}/kg, dense {want}/kg");
        assert!((ball * BALL_KG - 1.0).abs() < 1e-12, "{ball}/kg of a ball of {BALL_KG} kg");
    }
}
