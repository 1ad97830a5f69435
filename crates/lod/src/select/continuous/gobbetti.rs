//! Meshes of continuous resolution under a time limit (GB99): the exact optimum in closed form.
//!
//! In: weight, time and limits of every mesh. Out: resolutions r that maximise Σ w √r, and λ.
//! Never here: triangles; the authors' own method is [`super::barrier`]. Theory: `docs/theory/budget.md`, eq. 22 … 24.

use alloc::vec::Vec;

use super::water::{Claim, level};

/// A mesh whose triangle count is free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mesh {
    /// w: benefit at full resolution; ≥ 0, else it counts as 0.
    pub weight: f64,
    /// a: time at full resolution, in the unit of the budget; finite and ≥ 0, else see [`Mesh::sound`].
    pub time: f64,
    /// Least r, `0..=1`: below it fewer triangles save no time.
    pub least: f64,
    /// Most r, `least..=1`.
    pub most: f64,
}

impl Mesh {
    /// The mesh with every invalid number replaced: weight 0, twice the time `prior`, limits inside 0 … 1 and in order.
    #[must_use]
    pub fn sound(self, prior: f64) -> Self {
        let part = |x: f64| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let most = if self.most.is_nan() { 1.0 } else { part(self.most) };
        Self {
            weight: if self.weight > 0.0 { self.weight.min(1e300) } else { 0.0 },
            time: if self.time.is_finite() && self.time >= 0.0 { self.time } else { 2.0 * prior },
            least: part(self.least).min(most),
            most,
        }
    }

    fn claim(&self) -> Claim {
        // r = μ (w/a)², eq. 22
        let growth = if self.time > 0.0 { (self.weight / self.time) * (self.weight / self.time) } else { self.weight };
        Claim { growth, price: self.time, least: self.least, most: self.most }
    }
}

/// Resolutions of all meshes, and the quality of the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolutions {
    /// r of every mesh, in the order given.
    pub r: Vec<f64>,
    /// Σ w √r.
    pub value: f64,
    /// λ: gain of one more unit of time; 0 where every mesh is at its most.
    pub lambda: f64,
    /// Whether the least of every mesh is within the time; if not, `r` is the least.
    pub feasible: bool,
    /// No resolutions within the time have a greater value; 0 where there are none.
    pub upper: f64,
    /// Newton steps taken: 0 for the closed form.
    pub steps: u32,
}

/// Maximises Σ w √r under `fixed` + Σ a r ≤ `time`: exact up to rounding, in linear time. Meshes as [`Mesh::sound`] gives them.
#[must_use]
pub fn closed_form(time: f64, fixed: f64, meshes: &[Mesh]) -> Resolutions {
    let claims: Vec<_> = meshes.iter().map(Mesh::claim).collect();
    let mu = level(time - fixed, &claims);
    let r: Vec<_> = claims.iter().map(|t| mu.map_or(t.least, |mu| t.at(mu))).collect();
    let value = value(meshes, &r);
    let lambda = match mu {
        Some(mu) if mu.is_finite() && mu > 0.0 => 0.5 / libm::sqrt(mu), // μ = 1/(4 λ²)
        _ => 0.0,
    };
    Resolutions { r, value, lambda, feasible: mu.is_some(), upper: if mu.is_some() { value } else { 0.0 }, steps: 0 }
}

pub(crate) fn value(meshes: &[Mesh], r: &[f64]) -> f64 {
    meshes.iter().zip(r).map(|(m, r)| m.weight * libm::sqrt(*r)).sum()
}
