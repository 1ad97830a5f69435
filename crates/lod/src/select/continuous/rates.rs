//! Simulation rates under one load: minimises Σ w/f with Σ c f within the load.
//!
//! In: weight, time of a step and limits of every agent. Out: rates f, and λ.
//! Never here: the content of a step. Theory: `docs/theory/budget.md`, eq. 25.

use alloc::vec::Vec;

use super::water::{Claim, level};

/// An agent whose rate is free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agent {
    /// w: the agent's error at one step a second; ≥ 0.
    pub weight: f64,
    /// c: time of one step, seconds; ≥ 0.
    pub step_s: f64,
    /// Least rate, steps a second; ≥ 0.
    pub least_hz: f64,
    /// Most rate, steps a second; ≥ `least_hz`.
    pub most_hz: f64,
}

/// Rates of all agents.
#[derive(Debug, Clone, PartialEq)]
pub struct Rates {
    /// f of every agent, steps a second, in the order given.
    pub f_hz: Vec<f64>,
    /// Σ w/f over the agents with a positive weight.
    pub error: f64,
    /// λ: decrease of the error per additional unit of load; 0 where every agent is at its most.
    pub lambda: f64,
    /// Whether the least rate of every agent is within the load; if not, `f_hz` is the least.
    pub feasible: bool,
}

/// Minimises Σ w/f under Σ c f ≤ `load` (seconds of steps in a second): exact up to rounding, in linear time.
#[must_use]
pub fn rates(load: f64, agents: &[Agent]) -> Rates {
    // f = √(w/(λ c)) inside its limits: a level ν = 1/√λ for all
    let claim = |a: &Agent| {
        let growth = if a.step_s > 0.0 { libm::sqrt(a.weight / a.step_s) } else { a.weight };
        Claim { growth, price: a.step_s, least: a.least_hz, most: a.most_hz }
    };
    let claims: Vec<_> = agents.iter().map(claim).collect();
    let nu = level(load, &claims);
    let f_hz: Vec<_> = claims.iter().map(|t| nu.map_or(t.least, |nu| t.at(nu))).collect();
    let error = agents.iter().zip(&f_hz).filter(|(a, _)| a.weight > 0.0).map(|(a, f)| a.weight / f).sum();
    let lambda = nu.map_or(0.0, |nu| if nu > 0.0 { 1.0 / (nu * nu) } else { 0.0 });
    Rates { f_hz, error, lambda, feasible: nu.is_some() }
}
