//! Meshes of continuous resolution by interior point, as in (GB99): a logarithmic barrier method that can be stopped at any time.
//!
//! In: the meshes of [`super::gobbetti`] and a number of Newton steps. Out: resolutions within the time, and a bound.
//! Never here: a clock; a time limit is given as a number of steps, so that equal inputs give bit-identical results.
//! Theory: `docs/theory/budget.md`, eq. 29 … 31.
//!
//! The unknown is r, not √r as in the paper: then the time constraint is linear. Along a curved constraint Newton's steps shrink with the
//! barrier, and 500 meshes took more than a hundred steps; here they take 10 to 25.

use alloc::vec::Vec;

use super::gobbetti::{Mesh, Resolutions, value};

/// Stopping criteria.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Newton steps, each linear in the number of meshes: the time limit.
    pub steps: u32,
    /// Stops when the bound is within this fraction of the value; > 0.
    pub tolerance: f64,
}

impl Default for Limits {
    /// A hundredth, in at most 60 steps: twice the number that thousands of meshes need.
    fn default() -> Self {
        Self { steps: 60, tolerance: 0.01 }
    }
}

/// Factor by which the barrier is lowered once a centre is found.
const LOWER: f64 = 0.1;

/// A point counts as centred when the Newton decrement², in units of ε, is below this: full steps converge quadratically there.
const CENTRED: f64 = 0.25;

/// Fraction of the distance to the nearest constraint that a step may go.
const TO_WALL: f64 = 0.95;

/// Maximises Σ w √r under `fixed` + Σ a r ≤ `time` from `last`, the resolutions of the frame before (empty for a cold start).
///
/// The result is within the time whenever a feasible one exists, however few the steps. Meshes as [`Mesh::sound`] gives them.
#[must_use]
pub fn interior_point(time: f64, fixed: f64, meshes: &[Mesh], last: &[f64], limits: Limits) -> Resolutions {
    let budget = time - fixed;
    let least: f64 = meshes.iter().map(|m| m.time * m.least).sum();
    if least > budget || budget.is_nan() {
        let r: Vec<_> = meshes.iter().map(|m| m.least).collect();
        return Resolutions { value: value(meshes, &r), r, lambda: 0.0, feasible: false, upper: 0.0, steps: 0 };
    }
    let mut path = Path::from(budget, meshes, last);
    let mut steps = 0;
    while steps < limits.steps && !path.is_near(limits.tolerance) {
        steps += 1;
        path.step();
    }
    let (r, lambda, upper) = (path.resolutions(), path.lambda, path.upper);
    Resolutions { value: value(meshes, &r), r, lambda, feasible: true, upper, steps }
}

/// A mesh whose resolution is free.
#[derive(Clone, Copy)]
struct Free {
    mesh: Mesh,
    at: usize,
    r: f64,
}

/// One mesh's part of a Newton step: gradient, diagonal of the Hessian, price.
type Terms = (f64, f64, f64);

struct Path<'a> {
    meshes: &'a [Mesh],
    free: Vec<Free>,
    /// Time available to the free meshes.
    budget: f64,
    /// Value of the other meshes.
    settled: f64,
    epsilon: f64,
    upper: f64,
    lambda: f64,
}

impl<'a> Path<'a> {
    fn from(budget: f64, meshes: &'a [Mesh], last: &[f64]) -> Self {
        let start = |at: usize, m: &Mesh| crate::within(*last.get(at).unwrap_or(&m.most), m.least, m.most);
        let free: Vec<_> = meshes
            .iter()
            .enumerate()
            .filter(|(_, m)| is_free(m))
            .map(|(at, &mesh)| Free { mesh, at, r: start(at, &mesh) })
            .collect();
        let others = || meshes.iter().filter(|m| !is_free(m));
        let budget = budget - others().map(|m| m.time * at_rest(m)).sum::<f64>();
        let settled = others().map(|m| m.weight * libm::sqrt(at_rest(m))).sum();
        let mut path = Self { meshes, free, budget, settled, epsilon: 0.0, upper: f64::INFINITY, lambda: 0.0 };
        if !last.is_empty() {
            path.make_feasible();
        }
        path.move_inside();
        path.epsilon = path.worth() / (4.0 * path.free.len().max(1) as f64);
        path.certify();
        path
    }

    fn worth(&self) -> f64 {
        self.free.iter().map(|f| f.mesh.weight * libm::sqrt(f.r)).sum()
    }

    fn slack(&self) -> f64 {
        self.budget - self.free.iter().map(|f| f.mesh.time * f.r).sum::<f64>()
    }

    /// Sets meshes to their least resolution, worst benefit per cost first, until the start is within the time (GB99).
    fn make_feasible(&mut self) {
        let mut slack = self.slack();
        let merit = |f: &Free| f.mesh.weight / (f.mesh.time * libm::sqrt(f.r.max(f64::MIN_POSITIVE)));
        let mut order: Vec<_> = (0..self.free.len()).collect();
        order.sort_by(|&a, &b| merit(&self.free[a]).total_cmp(&merit(&self.free[b])).then(a.cmp(&b)));
        for i in order {
            if slack >= 0.0 {
                return;
            }
            let f = &mut self.free[i];
            slack += f.mesh.time * (f.r - f.mesh.least);
            f.r = f.mesh.least;
        }
    }

    /// Moves the start away from every constraint: slightly towards the middle, then all in one ratio towards the least until a quarter of
    /// the budget is free.
    fn move_inside(&mut self) {
        for f in &mut self.free {
            let margin = 0.1 * (f.mesh.most - f.mesh.least);
            f.r = crate::within(f.r, f.mesh.least + margin, f.mesh.most - margin);
        }
        let least: f64 = self.free.iter().map(|f| f.mesh.time * f.mesh.least).sum();
        let (room, used) = (self.budget - least, self.budget - self.slack() - least);
        let part = if used > 0.75 * room { (0.75 * room / used).max(0.0) } else { 1.0 };
        self.free.iter_mut().for_each(|f| f.r = f.mesh.least + part * (f.r - f.mesh.least));
    }

    /// One Newton step of −Σ w √r − ε [log slack + Σ log(r − least) + Σ log(most − r)] (eq. 29).
    fn step(&mut self) {
        let (slack, eps) = (self.slack(), self.epsilon);
        if self.free.is_empty() || slack <= 0.0 {
            return;
        }
        let terms = |f: &Free| -> Terms {
            let (down, up) = (1.0 / (f.r - f.mesh.least), 1.0 / (f.mesh.most - f.r));
            let slope = 0.5 * f.mesh.weight / libm::sqrt(f.r);
            let gradient = -slope + eps * (f.mesh.time / slack - down + up);
            (gradient, 0.5 * slope / f.r + eps * (down * down + up * up), f.mesh.time)
        };
        // Hessian = diagonal + (ε/s²) a aᵀ, inverted by two sums (eq. 30)
        let rank_one = eps / (slack * slack);
        let (a_g, a_a) =
            self.free.iter().map(terms).fold((0.0, 0.0), |(ag, aa), (g, d, a)| (ag + a * g / d, aa + a * a / d));
        let shift = rank_one * a_g / (1.0 + rank_one * a_a);
        let move_of = |(g, d, a): Terms| -(g - shift * a) / d;
        let decrement: f64 = -self.free.iter().map(terms).map(|t| t.0 * move_of(t)).sum::<f64>();
        let moves: Vec<_> = self.free.iter().map(|f| move_of(terms(f))).collect();
        self.advance(slack, &moves);
        self.certify();
        if decrement <= CENTRED * eps {
            self.epsilon *= LOWER;
        }
    }

    /// Takes the full step if that stays inside, else most of the distance to the nearest constraint.
    fn advance(&mut self, slack: f64, moves: &[f64]) {
        let to_wall = |(f, dr): (&Free, &f64)| match *dr {
            dr if dr > 0.0 => (f.mesh.most - f.r) / dr,
            dr if dr < 0.0 => (f.mesh.least - f.r) / dr,
            _ => f64::INFINITY,
        };
        let wall = self.free.iter().zip(moves).map(to_wall).fold(f64::INFINITY, f64::min);
        let taken: f64 = self.free.iter().zip(moves).map(|(f, dr)| f.mesh.time * dr).sum();
        let wall = if taken > 0.0 { wall.min(slack / taken) } else { wall };
        let length = (TO_WALL * wall).min(1.0);
        if length.is_finite() {
            self.free.iter_mut().zip(moves).for_each(|(f, dr)| f.r += length * dr);
        }
    }

    /// An upper bound valid at any point (eq. 31): λ = ε/slack prices the time, and each mesh is optimised on its own.
    fn certify(&mut self) {
        let slack = self.slack();
        let lambda = if slack > 0.0 { self.epsilon / slack } else { 0.0 };
        let best = |f: &Free| {
            let root = 0.5 * f.mesh.weight / (lambda * f.mesh.time);
            let r = crate::within(root * root, f.mesh.least, f.mesh.most);
            f.mesh.weight * libm::sqrt(r) - lambda * f.mesh.time * r
        };
        let upper = self.settled + lambda * self.budget + self.free.iter().map(best).sum::<f64>();
        if upper < self.upper {
            (self.upper, self.lambda) = (upper, lambda);
        }
    }

    fn is_near(&self, tolerance: f64) -> bool {
        self.upper - self.settled - self.worth() <= tolerance * self.upper
    }

    fn resolutions(&self) -> Vec<f64> {
        let mut r: Vec<_> = self.meshes.iter().map(at_rest).collect();
        self.free.iter().for_each(|f| r[f.at] = crate::within(f.r, f.mesh.least, f.mesh.most));
        r
    }
}

/// Whether the mesh has a trade-off between time and benefit.
fn is_free(m: &Mesh) -> bool {
    m.most > m.least && m.time > 0.0 && m.weight > 0.0
}

/// The resolution of a mesh without a trade-off: the most if it costs nothing and has a weight, or the least.
fn at_rest(m: &Mesh) -> f64 {
    if m.time > 0.0 || m.weight == 0.0 { m.least } else { m.most }
}
