//! What to believe of a cost that is no number: twice what such costs are as a rule.
//!
//! In: costs of one class as they come. Out: costs that can be compared, and how many had to be made up.
//! Never here: a fit. Theory: `docs/theory/budget.md`, eq. 2.

/// What levels of one class cost as a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    typical: f64,
    made_up: u64,
}

/// How much each sound cost moves what is typical.
const MEMORY: f64 = 0.05;

impl Prior {
    /// A class of which `typical` is known beforehand; 0 where that is none.
    #[must_use]
    pub fn new(typical: f64) -> Self {
        Self { typical: if typical.is_finite() && typical > 0.0 { typical } else { 0.0 }, made_up: 0 }
    }

    /// A cost that can be compared: itself where it is finite and ≥ 0, and then it teaches what is typical; else twice that.
    pub fn sound(&mut self, cost: f64) -> f64 {
        if cost.is_finite() && cost >= 0.0 {
            self.typical = if self.typical > 0.0 { self.typical + MEMORY * (cost - self.typical) } else { cost };
            return cost;
        }
        self.made_up += 1;
        2.0 * self.typical
    }

    /// What such levels cost as a rule: the last good value, smoothed.
    #[must_use]
    pub fn typical(&self) -> f64 {
        self.typical
    }

    /// How many costs had to be made up.
    #[must_use]
    pub fn made_up(&self) -> u64 {
        self.made_up
    }
}
