//! Disjoint sets of places 0 … n − 1 (union–find): which of them belong together.
//!
//! In: pairs that belong together. Out: for each place the lowest of its set. Never here: what the places are.

/// Sets of places, each named by the lowest of them.
#[derive(Debug, Clone, Default)]
pub struct DisjointSets {
    /// A lower place of the same set; the place itself where it is the lowest.
    above: Vec<usize>,
}

impl DisjointSets {
    /// Sets of `count` places, each by itself.
    #[must_use]
    pub fn of(count: usize) -> Self {
        Self { above: (0..count).collect() }
    }

    /// Makes every one of `count` places a set of its own, in the storage that is there.
    pub fn reset(&mut self, count: usize) {
        self.above.clear();
        self.above.extend(0..count);
    }

    /// Number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.above.len()
    }

    /// Whether there is no place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.above.is_empty()
    }

    /// Merges the sets of two places; whether they were two. A pair of one set closes a ring of the pairs so far.
    ///
    /// # Panics
    /// Where one of them is no place.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.lowest(a), self.lowest(b));
        self.above[a.max(b)] = a.min(b);
        a != b
    }

    /// The lowest place of the set of `at`.
    ///
    /// # Panics
    /// Where `at` is no place.
    pub fn lowest(&mut self, mut at: usize) -> usize {
        while self.above[at] != at {
            self.above[at] = self.above[self.above[at]];
            at = self.above[at];
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::DisjointSets;

    #[test]
    fn places_that_are_joined_in_any_order_have_one_lowest() {
        let mut sets = DisjointSets::default();
        for pairs in [[(5, 3), (3, 1), (4, 2)], [(1, 3), (4, 2), (3, 5)], [(1, 5), (2, 4), (5, 3)]] {
            sets.reset(6);
            assert!(pairs.into_iter().all(|(a, b)| sets.join(a, b)), "no ring so far");
            assert!(!sets.join(5, 1), "a ring");
            assert_eq!([0, 1, 2, 3, 4, 5].map(|at| sets.lowest(at)), [0, 1, 2, 1, 2, 1]);
        }
    }
}
