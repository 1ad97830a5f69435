//! Benefit per cost, ordered exactly.
//!
//! In: two integers. Out: a total order without rounding. Never here: a division.
//! Theory: `docs/theory/budget.md`, eq. 3.

use core::cmp::{Ordering, Reverse};

/// Benefit per tick. A free gain is above every other ratio, no gain below every other: 0/0 is 0.
#[derive(Debug, Clone, Copy)]
pub struct Ratio {
    /// The gain.
    pub benefit: u64,
    /// The cost, ticks.
    pub cost: u64,
}

impl Ratio {
    /// The ratio as a number: infinite where a gain is free.
    #[must_use]
    pub fn value(self) -> f64 {
        if self.benefit == 0 { 0.0 } else { self.benefit as f64 / self.cost as f64 }
    }

    fn class(self) -> u8 {
        match self {
            Self { benefit: 0, .. } => 0,
            Self { cost: 0, .. } => 2,
            _ => 1,
        }
    }
}

impl Ord for Ratio {
    fn cmp(&self, other: &Self) -> Ordering {
        let across = |a: &Self, b: &Self| u128::from(a.benefit) * u128::from(b.cost);
        self.class().cmp(&other.class()).then_with(|| match self.class() {
            1 => across(self, other).cmp(&across(other, self)),
            _ => Ordering::Equal,
        })
    }
}

impl PartialOrd for Ratio {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ratio {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ratio {}

/// A position in the order in which choices are tried: lesser ranks come first.
///
/// Greater ratio, then lower cost, then lower id, then lower level; `object` only distinguishes equal ids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Rank {
    ratio: Reverse<Ratio>,
    cost: u64,
    id: u64,
    pub level: u32,
    pub object: u32,
}

impl Rank {
    pub(crate) fn new(ratio: Ratio, id: u64, object: usize, level: u32) -> Self {
        Self { ratio: Reverse(ratio), cost: ratio.cost, id, level, object: object as u32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_beyond_the_precision_of_doubles_are_distinguished() {
        let (a, b) = (Ratio { benefit: (1 << 53) + 1, cost: 1 << 53 }, Ratio { benefit: 1, cost: 1 });
        assert!(a > b, "as doubles both are {} {}", a.value(), b.value());
    }

    #[test]
    fn free_gain_is_above_all_and_no_gain_below_all() {
        let free = Ratio { benefit: 1, cost: 0 };
        let nothing = Ratio { benefit: 0, cost: 0 };
        let some = Ratio { benefit: 1, cost: u64::MAX };
        assert!(free > some && some > nothing);
        assert!(nothing == Ratio { benefit: 0, cost: 7 });
    }
}
