//! The linear relaxation: the value that could be reached if the last step could be taken in part.
//!
//! In: a [`Problem`]. Out: an upper bound on every answer, and λ, the gain of one more tick. Never here: an answer that can be drawn.
//! Theory: `docs/theory/budget.md`, eq. 6, after (SZ79).

use super::hull::{Hulls, Step};
use super::problem::Problem;

/// The optimum of the relaxation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// No answer within the budget has a greater value.
    pub value: f64,
    /// λ: gain per tick of the step that no longer fits whole; 0 where everything fits.
    pub lambda: f64,
}

/// The bound of a problem, without levels that can never fit; `None` if even the cheapest set is over the budget.
#[must_use]
pub fn linear(problem: &Problem) -> Option<Linear> {
    problem.infeasible().is_none().then(|| split(problem, &Hulls::of(problem)).0)
}

/// The bound, and the steps that the relaxation takes whole.
pub(crate) fn split<'a>(problem: &Problem, hulls: &'a Hulls) -> (Linear, &'a [Step]) {
    let (mut value, mut cost) = (problem.value(&hulls.bases), problem.cost(&hulls.bases));
    for (taken, step) in hulls.steps.iter().enumerate() {
        if cost + step.gain.cost > problem.budget() {
            let lambda = step.gain.value();
            let bound = value as f64 + lambda * (problem.budget() - cost) as f64;
            return (Linear { value: bound, lambda }, &hulls.steps[..taken]);
        }
        (value, cost) = (value + step.gain.benefit, cost + step.gain.cost);
    }
    (Linear { value: value as f64, lambda: 0.0 }, &hulls.steps)
}
