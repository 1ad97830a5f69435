//! An order of bodies in which those that act on each other stand near each other: Cuthill and McKee's, reversed (CM69).
//!
//! In: how many bodies there are, and pairs of them. Out: the place of each. Never here: the matrix that is factored in it.
//! A stack or a chain becomes a line whatever its bodies' numbers are, so that its factor is as narrow as two bodies.

/// Places of bodies; nothing is allocated once the sizes settle.
#[derive(Debug, Clone, Default)]
pub(super) struct Order {
    /// Every pair from both sides, sorted.
    pairs: Vec<(u32, u32)>,
    /// Where the pairs of each body start, and the end of the last.
    start: Vec<u32>,
    /// Bodies in the order in which they are found.
    found: Vec<u32>,
    place: Vec<u32>,
}

/// A body that has not been found.
const NOWHERE: u32 = u32::MAX;

impl Order {
    /// Orders `bodies` bodies.
    pub(super) fn find(&mut self, bodies: usize, pairs: impl Iterator<Item = (u32, u32)>) {
        self.list(bodies, pairs);
        self.found.clear();
        self.place.clear();
        self.place.resize(bodies, NOWHERE);
        let mut seen = 0;
        while let Some(body) = (0..bodies as u32).filter(|&b| self.is_lost(b)).min_by_key(|&b| (self.degree(b), b)) {
            self.take(body);
            while seen < self.found.len() {
                self.take_neighbours(self.found[seen]);
                seen += 1;
            }
        }
        let last = bodies as u32;
        self.found.iter().zip(1..).for_each(|(&body, rank)| self.place[body as usize] = last - rank);
    }

    /// The place of each body.
    pub(super) fn places(&self) -> &[u32] {
        &self.place
    }

    fn list(&mut self, bodies: usize, pairs: impl Iterator<Item = (u32, u32)>) {
        self.pairs.clear();
        self.pairs.extend(pairs.flat_map(|(a, b)| [(a, b), (b, a)]));
        self.pairs.sort_unstable();
        self.pairs.dedup();
        self.start.clear();
        self.start.resize(bodies + 1, 0);
        self.pairs.iter().for_each(|pair| self.start[pair.0 as usize + 1] += 1);
        (0..bodies).for_each(|body| self.start[body + 1] += self.start[body]);
    }

    /// Takes those next to `body` that have not been found, those with the fewest neighbours first.
    fn take_neighbours(&mut self, body: u32) {
        let first = self.found.len();
        for at in self.start[body as usize]..self.start[body as usize + 1] {
            let other = self.pairs[at as usize].1;
            if self.is_lost(other) {
                self.take(other);
            }
        }
        let Self { found, start, .. } = self;
        found[first..].sort_unstable_by_key(|&b| (start[b as usize + 1] - start[b as usize], b));
    }

    fn take(&mut self, body: u32) {
        self.place[body as usize] = 0;
        self.found.push(body);
    }

    fn is_lost(&self, body: u32) -> bool {
        self.place[body as usize] == NOWHERE
    }

    fn degree(&self, body: u32) -> u32 {
        self.start[body as usize + 1] - self.start[body as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How far apart the two of any pair stand, at most.
    fn width(order: &Order, pairs: &[(u32, u32)]) -> u32 {
        let place = |body: u32| order.places()[body as usize];
        pairs.iter().map(|&(a, b)| place(a).abs_diff(place(b))).max().unwrap_or(0)
    }

    #[test]
    fn a_line_of_bodies_stays_a_line_whatever_their_numbers_are() {
        let name = |i: u32| i * 17 % 40;
        let pairs: Vec<_> = (1..40).map(|i| (name(i), name(i - 1))).collect();
        let mut order = Order::default();
        order.find(40, pairs.iter().copied());
        assert_eq!(width(&order, &pairs), 1);
        let mut places = order.places().to_vec();
        places.sort_unstable();
        assert!(places.into_iter().eq(0..40), "everybody has a place of its own");
    }

    #[test]
    fn a_wall_is_as_wide_as_its_shorter_side_and_lone_bodies_have_places() {
        let (long, short) = (12, 3);
        let name = |i: u32, j: u32| (i * short + j) * 23 % (long * short);
        let mut pairs = Vec::new();
        for i in 0..long {
            pairs.extend((1..short).map(|j| (name(i, j), name(i, j - 1))));
            pairs.extend((0..short).filter(|_| i > 0).map(|j| (name(i, j), name(i - 1, j))));
        }
        let mut order = Order::default();
        order.find((long * short + 2) as usize, pairs.iter().copied());
        assert!(width(&order, &pairs) <= short + 1, "{}", width(&order, &pairs));
        assert!(order.places().iter().all(|&place| place < long * short + 2));
    }
}
