//! Coefficients of a machine from a benchmark, by fits that are robust against outliers (FS93, §4).
//!
//! In: samples of work and time. Out: [`Stages`], and how well they predict. Never here: a measurement.
//! Theory: `docs/theory/budget.md`, eq. 42 and 43.

use alloc::vec::Vec;

use super::stages::{Stages, Work};

/// One measured draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The work drawn.
    pub work: Work,
    /// The time it took, > 0.
    pub time: f64,
}

/// Coefficients and the quality of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The coefficients.
    pub stages: Stages,
    /// Half of the samples are predicted to within this fraction of their time.
    pub error50: f64,
    /// 95 % of the samples are predicted to within this fraction of their time.
    pub error95: f64,
    /// Number of samples used: the valid ones.
    pub samples: usize,
}

/// Rounds in which samples find their stage and their weight; both converge well before.
const ROUNDS: usize = 30;
/// An error past this many median errors is down-weighted in proportion (Huber's weight: 95 % as efficient as least squares without
/// outliers).
const WILD: f64 = 1.345 * 1.4826;
/// Least number of samples for a fit.
const LEAST: usize = 8;

/// Parts of the faster stage that may show, to choose among …
pub const SERIAL: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// … where a larger one counts if its error is below this part of the best before.
pub const BETTER: f64 = 0.9;

/// Fits setup + max + serial · min of c₁ polygons + c₂ vertices and c₃ pixels to samples of both stages, for a given `serial`; `None` with fewer
/// than eight valid ones.
///
/// The samples should span polygons where pixels are few, and pixels where polygons are few. If the ratio of vertices to polygons is
/// constant throughout, the two cannot be separated: then c₂ is 0 and c₁ covers both.
#[must_use]
pub fn fit(samples: &[Sample], serial: f64) -> Option<Fit> {
    let number = |x: f64| x.is_finite() && x >= 0.0;
    let sound = |s: &Sample| {
        number(s.work.polygons) && number(s.work.vertices) && number(s.work.pixels) && number(s.time) && s.time > 0.0
    };
    let samples: Vec<_> = samples.iter().copied().filter(sound).collect();
    if samples.len() < LEAST {
        return None;
    }
    let Found { typical, stages } = descend(&samples, Stages { serial, ..start(&samples) });
    let error95 = quantile(samples.iter().map(|s| (stages.time(s.work) / s.time - 1.0).abs()), 0.95);
    Some(Fit { stages, error50: typical, error95, samples: samples.len() })
}

/// Coefficients, and the median of their relative errors.
#[derive(Clone, Copy)]
struct Found {
    typical: f64,
    stages: Stages,
}

/// The best of all rounds from `stages` on.
fn descend(samples: &[Sample], mut stages: Stages) -> Found {
    let mut best = Found { typical: f64::INFINITY, stages };
    for _ in 0..ROUNDS {
        let errors: Vec<_> = samples.iter().map(|s| stages.time(s.work) / s.time - 1.0).collect();
        let typical = quantile(errors.iter().map(|e| e.abs()), 0.5);
        if typical < best.typical {
            best = Found { typical, stages };
        }
        stages = round(samples, &errors, typical, stages);
    }
    best
}

/// Initial guess: both stages as if each were alone, from low quantiles of the time per polygon and per pixel, half the least time as
/// setup.
fn start(samples: &[Sample]) -> Stages {
    let least = quantile(samples.iter().map(|s| s.time), 0.0);
    let per = |count: fn(&Work) -> f64| {
        let many = samples.iter().filter(|s| count(&s.work) > 0.0 && s.time > 2.0 * least);
        quantile(many.map(|s| s.time / count(&s.work)), 0.1)
    };
    Stages { setup: 0.5 * least, polygon: per(|w| w.polygons), vertex: 0.0, pixel: per(|w| w.pixels), serial: 0.0 }
}

/// One least-squares fit of the relative error, each sample in the stage that was slower by the previous fit (eq. 42).
fn round(samples: &[Sample], errors: &[f64], typical: f64, before: Stages) -> Stages {
    let row = |s: &Sample| {
        let (w, hidden) = (s.work, before.serial);
        let (geometry, fill) = if before.is_filling(w) { (hidden, 1.0) } else { (1.0, hidden) };
        [1.0, geometry * w.polygons, geometry * w.vertices, fill * w.pixels]
    };
    let mut sums = [[0.0; 5]; 4];
    for (s, error) in samples.iter().zip(errors) {
        let weight = (WILD * typical / error.abs().max(f64::MIN_POSITIVE)).min(1.0) / (s.time * s.time);
        let x = row(s);
        for (i, line) in sums.iter_mut().enumerate() {
            x.iter().enumerate().for_each(|(j, xj)| line[j] += weight * x[i] * xj);
            line[4] += weight * x[i] * s.time;
        }
    }
    let [setup, polygon, vertex, pixel] = solve_from_zero(sums);
    // a stage without samples keeps its coefficients
    let (geometry, fill) = (sums[1][1] > 0.0, sums[3][3] > 0.0);
    Stages {
        setup,
        polygon: if geometry { polygon } else { before.polygon },
        vertex: if geometry { vertex } else { before.vertex },
        pixel: if fill { pixel } else { before.pixel },
        ..before
    }
}

/// Four non-negative unknowns: a negative result is set to 0 and the rest solved again, vertices first.
fn solve_from_zero(sums: [[f64; 5]; 4]) -> [f64; 4] {
    let mut free = [true; 4];
    loop {
        let x = solve(sums, free);
        let worst = [2, 0, 1, 3].into_iter().find(|&i| free[i] && x[i] < 0.0);
        match worst {
            Some(i) => free[i] = false,
            None => return x,
        }
    }
}

/// Gaussian elimination with pivots from the diagonal; an unknown that is linearly dependent on the others is 0.
fn solve(mut a: [[f64; 5]; 4], free: [bool; 4]) -> [f64; 4] {
    const DETERMINED: f64 = 1e-9;
    let diagonal = [a[0][0], a[1][1], a[2][2], a[3][3]];
    let mut used = [false; 4];
    for i in 0..4 {
        used[i] = free[i] && a[i][i] > DETERMINED * diagonal[i];
        if !used[i] {
            continue;
        }
        let pivot = a[i];
        for (_, line) in a.iter_mut().enumerate().filter(|(k, _)| *k != i) {
            let factor = line[i] / pivot[i];
            line.iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    core::array::from_fn(|i| if used[i] { a[i][4] / a[i][i] } else { 0.0 })
}

/// The quantile `part` of the values; 0 of an empty set.
pub(crate) fn quantile(values: impl Iterator<Item = f64>, part: f64) -> f64 {
    let mut values: Vec<_> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    let at = libm::round(part * values.len().saturating_sub(1) as f64) as usize;
    values.get(at).copied().unwrap_or(0.0)
}
