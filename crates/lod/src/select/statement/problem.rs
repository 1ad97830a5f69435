//! The problem statement: objects with levels, a budget, and whether an object may be left out.
//!
//! In: costs in whole ticks and benefits. Out: a [`Problem`] that every policy answers with a [`Selection`].
//! Never here: how a level is chosen. Theory: `docs/theory/budget.md`, eq. 1 and 2.

use alloc::vec::Vec;

use super::linear;

/// The level an object gets; `None` where it is left out.
pub type Level = Option<u32>;

/// Upper limit of one cost or benefit: sums over half a million objects stay exact.
const MOST: u64 = 1 << 44;

/// Cost and benefit of a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Entry {
    /// Time, in whole ticks (nanoseconds or microseconds), `0..=2^44`.
    pub cost: u64,
    /// Benefit, in a unit that all objects share, `0..=2^44`.
    pub benefit: u64,
}

impl Entry {
    /// A level that costs `cost` ticks and has this `benefit`; both are clamped to 2^44.
    #[must_use]
    pub fn new(cost: u64, benefit: u64) -> Self {
        Self { cost: cost.min(MOST), benefit: benefit.min(MOST) }
    }

    /// A level from measured numbers, and whether its cost was valid.
    ///
    /// The cost is rounded up, so that a choice that fits in ticks fits in time; a cost that is NaN, infinite or negative counts as twice
    /// `prior` (the typical cost of levels of this kind, finite, ≥ 0). A benefit that is NaN or negative is 0; it is rounded down.
    #[must_use]
    pub fn measured(cost_ticks: f64, benefit: f64, prior_ticks: f64) -> (Self, bool) {
        let sound = cost_ticks.is_finite() && cost_ticks >= 0.0;
        let cost = if sound { cost_ticks } else { 2.0 * prior_ticks };
        // a cast of floats saturates, and maps NaN and negative values to 0
        (Self::new(libm::ceil(cost) as u64, benefit as u64), sound)
    }
}

/// Whether an object may be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// An object may be left out at no cost (F&S).
    AtMostOne,
    /// Every object has one level; the cheapest set may then be over the budget, and is returned as infeasible.
    ExactlyOne,
}

/// Objects with levels, and the budget: a multiple-choice knapsack.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    mode: Mode,
    budget: u64,
    ids: Vec<u64>,
    starts: Vec<usize>,
    entries: Vec<Entry>,
}

impl Problem {
    /// A problem without objects. `budget` in ticks; a negative one is 0.
    #[must_use]
    pub fn new(mode: Mode, budget: i64) -> Self {
        Self { mode, budget: budget.max(0) as u64, ids: Vec::new(), starts: alloc::vec![0], entries: Vec::new() }
    }

    /// Adds an object with its levels, coarsest first. `id` breaks ties, so it must not change between frames.
    ///
    /// An object without levels is never drawn, in either mode.
    pub fn push(&mut self, id: u64, levels: &[Entry]) {
        self.ids.push(id);
        self.entries.extend(levels.iter().map(|e| Entry::new(e.cost, e.benefit)));
        self.starts.push(self.entries.len());
    }

    /// Number of objects.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there is no object.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Whether objects may be left out.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The budget, ticks.
    #[must_use]
    pub fn budget(&self) -> u64 {
        self.budget
    }

    /// The levels of the object pushed as number `object`, coarsest first.
    #[must_use]
    pub fn levels(&self, object: usize) -> &[Entry] {
        &self.entries[self.starts[object]..self.starts[object + 1]]
    }

    /// The id of the object pushed as number `object`.
    #[must_use]
    pub fn id(&self, object: usize) -> u64 {
        self.ids[object]
    }

    /// Cost and benefit of an object at a level; nothing where it is left out.
    #[must_use]
    pub fn entry(&self, object: usize, level: Level) -> Entry {
        level.map_or(Entry::default(), |l| self.levels(object)[l as usize])
    }

    /// The cheapest state of an object: left out if that is allowed, else its cheapest level.
    #[must_use]
    pub fn least(&self, object: usize) -> Level {
        let cheapest =
            |levels: &[Entry]| (0..levels.len()).min_by_key(|&l| (levels[l].cost, u64::MAX - levels[l].benefit));
        match self.mode {
            Mode::AtMostOne => None,
            Mode::ExactlyOne => cheapest(self.levels(object)).map(|l| l as u32),
        }
    }

    /// The cheapest state of every object: the cheapest answer.
    #[must_use]
    pub fn cheapest(&self) -> Vec<Level> {
        (0..self.len()).map(|i| self.least(i)).collect()
    }

    /// Cost of a choice, ticks.
    #[must_use]
    pub fn cost(&self, levels: &[Level]) -> u64 {
        levels.iter().enumerate().map(|(i, &l)| self.entry(i, l).cost).sum()
    }

    /// Benefit of a choice.
    #[must_use]
    pub fn value(&self, levels: &[Level]) -> u64 {
        levels.iter().enumerate().map(|(i, &l)| self.entry(i, l).benefit).sum()
    }

    /// A choice with its cost, value and certificate. `levels` has one entry per object, each an existing level.
    #[must_use]
    pub fn judge(&self, levels: Vec<Level>) -> Selection {
        let upper = linear::linear(self).map_or(0.0, |l| l.value);
        self.certified(levels, upper)
    }

    /// The cheapest set as the answer if even that is over the budget; `None` if it fits.
    pub(crate) fn infeasible(&self) -> Option<Selection> {
        let cheapest = self.cheapest();
        (self.cost(&cheapest) > self.budget).then(|| self.certified(cheapest, 0.0))
    }

    /// A choice with a certificate that is known already.
    pub(crate) fn certified(&self, levels: Vec<Level>, upper: f64) -> Selection {
        let (value, cost) = (self.value(&levels), self.cost(&levels));
        Selection { levels, value, cost, feasible: cost <= self.budget, upper }
    }

    /// The numbers of the objects in the order of their ids.
    pub(crate) fn by_id(&self) -> Vec<usize> {
        let mut order: Vec<_> = (0..self.len()).collect();
        order.sort_by_key(|&i| (self.ids[i], i));
        order
    }
}

/// A level for every object, and its certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// One entry per object, in the order in which they were pushed.
    pub levels: Vec<Level>,
    /// Sum of the benefits.
    pub value: u64,
    /// Sum of the costs, ticks.
    pub cost: u64,
    /// Whether the cost is within the budget. A policy that obeys the budget gives `false` only if even the cheapest set is over it.
    pub feasible: bool,
    /// The certificate: no choice within the budget has a greater value. 0 where there is no such choice.
    pub upper: f64,
}

impl Selection {
    /// Upper bound of the relative loss against the optimum: 0 is proven optimal. 0 if there is nothing to gain or to compare.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.upper > 0.0 { (1.0 - self.value as f64 / self.upper).max(0.0) } else { 0.0 }
    }

    /// The better of two answers: feasible first, then greater value, then lower cost; `self` in a tie.
    #[must_use]
    pub fn or_better(self, other: Self) -> Self {
        let rank = |s: &Self| (s.feasible, s.value, u64::MAX - s.cost);
        if rank(&other) > rank(&self) { other } else { self }
    }
}
