//! An independent solution: projected Gauss–Seidel over the dense matrix of all contacts, in as many sweeps as it takes.

use super::{Body, Case, side_velocity};
use crate::solve::Side;
use glam::DVec3;

/// A dense square matrix by rows.
#[derive(Debug, Clone)]
pub struct Dense {
    size: usize,
    values: Vec<f64>,
}

impl Dense {
    pub fn zero(size: usize) -> Self {
        Self { size, values: vec![0.0; size * size] }
    }

    /// The matrix of a body.
    pub fn of(body: &Body) -> Self {
        let mut dense = Dense::zero(3 * body.free.len());
        for block in &body.blocks {
            for i in 0..3 {
                for j in 0..3 {
                    let value = block.value.col(j)[i];
                    *dense.at(3 * block.row + i, 3 * block.column + j) += value;
                    if block.row != block.column {
                        *dense.at(3 * block.column + j, 3 * block.row + i) += value;
                    }
                }
            }
        }
        dense
    }

    pub fn at(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.values[row * self.size + column]
    }

    fn get(&self, row: usize, column: usize) -> f64 {
        self.values[row * self.size + column]
    }

    /// The lower Cholesky factor.
    pub fn factored(mut self) -> Self {
        for i in 0..self.size {
            for j in 0..=i {
                let left = self.get(i, j) - (0..j).map(|k| self.get(i, k) * self.get(j, k)).sum::<f64>();
                *self.at(i, j) = if i == j { left.sqrt() } else { left / self.get(j, j) };
            }
        }
        self
    }

    /// Solves with a factored matrix.
    pub fn solve(&self, x: &mut [f64]) {
        for i in 0..self.size {
            x[i] = (x[i] - (0..i).map(|k| self.get(i, k) * x[k]).sum::<f64>()) / self.get(i, i);
        }
        for i in (0..self.size).rev() {
            x[i] = (x[i] - (i + 1..self.size).map(|k| self.get(k, i) * x[k]).sum::<f64>()) / self.get(i, i);
        }
    }
}

/// The results of the slow method.
pub struct Slow {
    /// Velocities of all blocks, by member.
    pub velocities: Vec<Vec<DVec3>>,
    /// The last sweep's largest change, as a velocity.
    pub change_m_s: f64,
}

/// A contact or row as three scalar lines.
struct Line {
    sides: [Side; 2],
    frame: [DVec3; 3],
    bias: DVec3,
    friction: Option<f64>,
    compliance: f64,
}

fn lines(case: &Case, compliances: &[f64]) -> Vec<Line> {
    let contacts = case.contacts.iter().zip(compliances).map(|(c, &compliance)| Line {
        sides: c.sides,
        frame: [c.normal, c.tangents[0], c.tangents[1]],
        bias: c.bias_m_s(case.h_s),
        friction: Some(c.friction),
        compliance,
    });
    let rows = case.rows.iter().map(|r| Line {
        sides: r.sides,
        frame: DVec3::AXES,
        bias: -r.target_m_s,
        friction: None,
        compliance: r.compliance_per_kg.unwrap(),
    });
    contacts.chain(rows).collect()
}

/// The response of all members to a unit impulse along one direction of a line, as velocities by member.
fn response(case: &Case, factors: &[Dense], sides: &[Side; 2], direction: DVec3) -> Vec<Vec<DVec3>> {
    let mut given: Vec<Vec<f64>> = case.bodies.iter().map(|b| vec![0.0; 3 * b.free.len()]).collect();
    for (side, sign) in sides.iter().zip([1.0, -1.0]) {
        for term in side.terms() {
            let part = term.map.transpose() * direction * sign;
            (0..3).for_each(|i| given[side.member][3 * term.block + i] += part[i]);
        }
    }
    let zero = |g: &Vec<f64>| g.iter().all(|v| *v == 0.0);
    given.iter_mut().zip(factors).filter(|(g, _)| !zero(g)).for_each(|(g, f)| f.solve(g));
    given.iter().map(|g| g.chunks_exact(3).map(DVec3::from_slice).collect()).collect()
}

/// Sweeps until nothing changes by more than `tolerance` (as a velocity), or `sweeps` are done.
pub fn gauss_seidel(case: &Case, compliances: &[f64], sweeps: usize, tolerance: f64) -> Slow {
    let factors: Vec<_> = case.bodies.iter().map(|body| Dense::of(body).factored()).collect();
    let lines = lines(case, compliances);
    let size = 3 * lines.len();
    let responses: Vec<_> = lines.iter().flat_map(|l| l.frame.map(|d| response(case, &factors, &l.sides, d))).collect();
    let relative = |line: &Line, velocities: &[Vec<DVec3>]| {
        side_velocity(&line.sides[0], velocities) - side_velocity(&line.sides[1], velocities)
    };
    let mut w = Dense::zero(size);
    for (column, made) in responses.iter().enumerate() {
        for (row, line) in lines.iter().enumerate() {
            let u = relative(line, made);
            (0..3).for_each(|i| *w.at(3 * row + i, column) = line.frame[i].dot(u));
        }
    }
    let free: Vec<_> = case.bodies.iter().map(|b| b.free.clone()).collect();
    let b: Vec<f64> = lines
        .iter()
        .flat_map(|l| {
            let u = relative(l, &free);
            [0, 1, 2].map(|i| l.frame[i].dot(u) + l.bias[i])
        })
        .collect();
    let (lambda, change_m_s) = sweep(&w, &b, &lines, [sweeps as f64, tolerance]);
    let mut velocities = free;
    for (made, impulse) in responses.iter().zip(&lambda) {
        for (all, new) in velocities.iter_mut().zip(made) {
            all.iter_mut().zip(new).for_each(|(v, dv)| *v += *dv * *impulse);
        }
    }
    Slow { velocities, change_m_s }
}

/// The sweeps themselves, on W + R.
fn sweep(w: &Dense, b: &[f64], lines: &[Line], limits: [f64; 2]) -> (Vec<f64>, f64) {
    let size = b.len();
    let mut lambda = vec![0.0; size];
    let mut change = f64::INFINITY;
    for _ in 0..limits[0] as usize {
        change = 0.0;
        for (k, line) in lines.iter().enumerate() {
            let u = |i: usize, lambda: &[f64]| {
                let row = &w.values[(3 * k + i) * size..(3 * k + i + 1) * size];
                b[3 * k + i]
                    + line.compliance * lambda[3 * k + i]
                    + row.iter().zip(lambda).map(|(w, l)| w * l).sum::<f64>()
            };
            let own = |i: usize| w.get(3 * k + i, 3 * k + i) + line.compliance;
            let before = [lambda[3 * k], lambda[3 * k + 1], lambda[3 * k + 2]];
            let normal = before[0] - u(0, &lambda) / own(0);
            lambda[3 * k] = if line.friction.is_some() { normal.max(0.0) } else { normal };
            // the trace of the tangential block bounds its larger eigenvalue
            let bound = own(1) + own(2);
            let t = [1, 2].map(|i| before[i] - u(i, &lambda) / bound);
            let share = line.friction.map_or(1.0, |mu| (mu * lambda[3 * k] / t[0].hypot(t[1]).max(1e-300)).min(1.0));
            (lambda[3 * k + 1], lambda[3 * k + 2]) = (t[0] * share, t[1] * share);
            (0..3).for_each(|i| change = f64::max(change, (lambda[3 * k + i] - before[i]).abs() * own(i)));
        }
        if change < limits[1] {
            break;
        }
    }
    (lambda, change)
}
