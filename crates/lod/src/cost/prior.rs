//! A substitute for a cost that is not a valid number: twice the typical cost of its class.
//!
//! In: costs of one class as they come. Out: costs that can be compared, and how many were substituted.
//! Never here: a fit. Theory: `docs/theory/budget.md`, eq. 2.

/// The typical cost of levels of one class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    typical: f64,
    made_up: u64,
}

/// Weight of each valid cost in the running mean.
const MEMORY: f64 = 0.05;

impl Prior {
    /// A class with a known `typical` cost; 0 if that is invalid.
    #[must_use]
    pub fn new(typical: f64) -> Self {
        Self { typical: if typical.is_finite() && typical > 0.0 { typical } else { 0.0 }, made_up: 0 }
    }

    /// A cost that can be compared: if finite and ≥ 0 the cost itself, which also updates the typical cost; else twice the typical cost.
    pub fn sound(&mut self, cost: f64) -> f64 {
        if cost.is_finite() && cost >= 0.0 {
            self.typical = if self.typical > 0.0 { self.typical + MEMORY * (cost - self.typical) } else { cost };
            return cost;
        }
        self.made_up += 1;
        2.0 * self.typical
    }

    /// The typical cost of such levels: the valid costs, smoothed.
    #[must_use]
    pub fn typical(&self) -> f64 {
        self.typical
    }

    /// How many costs were substituted.
    #[must_use]
    pub fn made_up(&self) -> u64 {
        self.made_up
    }
}
