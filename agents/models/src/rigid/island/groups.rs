//! Who hangs together: connected components by union and find.
//!
//! In: pairs that touch or are jointed. Out: a number for each member, equal within a component. Never here: contacts.

/// A forest over the members 0 … n − 1; nothing is allocated once the size settles.
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    /// Everybody apart, `count` members.
    pub(super) fn scatter(&mut self, count: usize) {
        self.parent.clear();
        self.parent.extend(0..count as u32);
    }

    /// `a` and `b` hang together.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // the lower number stays the root, so that the answer does not depend on the order of the pairs
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// The lowest member of the component of `a`.
    pub(super) fn root(&mut self, mut a: u32) -> u32 {
        while self.parent[a as usize] != a {
            let above = self.parent[self.parent[a as usize] as usize];
            self.parent[a as usize] = above;
            a = above;
        }
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_those_of_a_walk_along_the_edges() {
        for seed in 0..50_u32 {
            let count = 30;
            let edges: Vec<(u32, u32)> = (0..20_u32)
                .map(|i| seed.wrapping_mul(2_654_435_761).wrapping_add(i.wrapping_mul(40_503).wrapping_mul(seed + 7)))
                .map(|bits| ((bits >> 8) % count, (bits >> 16) % count))
                .collect();
            let mut groups = Groups::default();
            groups.scatter(count as usize);
            edges.iter().for_each(|&(a, b)| groups.join(a, b));
            // the other way: the lowest number is passed along every edge until nothing changes
            let mut lowest: Vec<u32> = (0..count).collect();
            for _ in 0..count {
                for &(a, b) in &edges {
                    let low = lowest[a as usize].min(lowest[b as usize]);
                    (lowest[a as usize], lowest[b as usize]) = (low, low);
                }
            }
            (0..count).for_each(|i| assert_eq!(groups.root(i), lowest[i as usize], "seed {seed}, member {i}"));
        }
    }
}
