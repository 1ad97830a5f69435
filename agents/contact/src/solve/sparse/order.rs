//! The order in which a sparse matrix is eliminated: approximate minimum degree on the quotient graph (GL89), (ADD96).
//!
//! In: the neighbours of each node. Out: the nodes in their order. Never here: numbers of the matrix.
//! Nodes that are to come late come after all others, so that the elimination before them stays when they change.
//! Nodes that cannot be told apart go together; of equal degrees the lowest node goes first, so the order depends on the graph alone.

use std::collections::BTreeSet;

/// The graph while it is eliminated: nodes that are left, and cliques that eliminated ones have left behind.
struct Quotient<'a> {
    /// The nodes that come after all others; none where it is empty.
    late: &'a [bool],
    /// The nodes that each node is joined to outside of cliques; they may be gone.
    nodes: Vec<Vec<usize>>,
    /// The cliques that each node is in, by the node that made them; they may be empty.
    cliques: Vec<Vec<usize>>,
    /// The nodes of each clique, and how many they stand for.
    members: Vec<Vec<usize>>,
    sizes: Vec<usize>,
    /// How many nodes each one stands for; none once it is gone.
    weights: Vec<usize>,
    /// The nodes that go with each one, right after it.
    followers: Vec<Vec<usize>>,
    /// The most that the nodes left are joined to, each counted with the nodes that it stands for.
    degrees: Vec<usize>,
    /// Nodes left, by degree.
    open: BTreeSet<Ranked>,
    left: usize,
    marks: Vec<usize>,
    mark: usize,
    /// How much of each clique lies outside of the newest one, where that has been counted in this turn.
    outside: Vec<usize>,
    counted: Vec<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Ranked {
    late: bool,
    degree: usize,
    node: usize,
}

/// The order of least degree of a graph, given by the neighbours of each node by rising numbers, first of the nodes that are not `late`,
/// then of these; an empty list has none.
pub(super) fn minimum_degree(neighbours: &[Vec<usize>], late: &[bool]) -> Vec<usize> {
    let mut graph = Quotient::new(neighbours, late);
    let mut order = Vec::with_capacity(neighbours.len());
    let mut waiting = Vec::new();
    while let Some(Ranked { node, .. }) = graph.open.pop_first() {
        graph.eliminate(node);
        waiting.push(node);
        while let Some(node) = waiting.pop() {
            order.push(node);
            waiting.append(&mut graph.followers[node]);
        }
    }
    order
}

impl<'a> Quotient<'a> {
    fn new(neighbours: &[Vec<usize>], late: &'a [bool]) -> Self {
        let size = neighbours.len();
        let degrees: Vec<_> = neighbours.iter().map(Vec::len).collect();
        let ranked = |(node, &degree): (usize, &usize)| Ranked { late: is_late(late, node), degree, node };
        Self {
            late,
            nodes: neighbours.to_vec(),
            cliques: vec![Vec::new(); size],
            members: vec![Vec::new(); size],
            sizes: vec![0; size],
            weights: vec![1; size],
            followers: vec![Vec::new(); size],
            open: degrees.iter().enumerate().map(ranked).collect(),
            degrees,
            left: size,
            marks: vec![0; size],
            mark: 0,
            outside: vec![0; size],
            counted: vec![0; size],
        }
    }

    /// The nodes left that `node` is joined to, through cliques too; they bear the newest mark.
    fn reach(&mut self, node: usize) -> Vec<usize> {
        self.mark += 1;
        self.marks[node] = self.mark;
        let through = self.cliques[node].iter().flat_map(|&clique| &self.members[clique]);
        let mut found = Vec::new();
        for &other in self.nodes[node].iter().chain(through) {
            if self.weights[other] > 0 && self.marks[other] != self.mark {
                self.marks[other] = self.mark;
                found.push(other);
            }
        }
        found
    }

    /// Takes a node out, with all that it stands for: those it reached become a clique, which takes up all cliques that it was in.
    fn eliminate(&mut self, node: usize) {
        let mut reached = self.reach(node);
        self.left -= self.weights[node];
        self.weights[node] = 0;
        for clique in std::mem::take(&mut self.cliques[node]) {
            self.members[clique].clear();
        }
        self.nodes[node].clear();
        self.count_outside(&reached);
        let reached_weight: usize = reached.iter().map(|&other| self.weights[other]).sum();
        for &other in &reached {
            self.open.remove(&self.ranked(other));
            self.join(other, node, reached_weight);
        }
        self.merge_alike(&mut reached, node);
        for &other in &reached {
            self.open.insert(self.ranked(other));
        }
        self.sizes[node] = reached.iter().map(|&other| self.weights[other]).sum();
        self.members[node] = reached;
    }

    /// How much of each clique of these nodes lies outside of them.
    fn count_outside(&mut self, reached: &[usize]) {
        for &other in reached {
            for &clique in self.cliques[other].iter().filter(|&&clique| !self.members[clique].is_empty()) {
                if self.counted[clique] != self.mark {
                    self.counted[clique] = self.mark;
                    self.outside[clique] = self.sizes[clique];
                }
                self.outside[clique] -= self.weights[other];
            }
        }
    }

    /// Puts a node that bears the newest mark into the new clique: cliques within that one go, and its degree is counted anew.
    fn join(&mut self, other: usize, clique: usize, reached_weight: usize) {
        let Self { nodes, cliques, members, weights, marks, mark, outside, .. } = self;
        cliques[other].retain(|&known| {
            if outside[known] == 0 {
                members[known].clear();
            }
            !members[known].is_empty()
        });
        // a node that the new clique joins needs no edge of its own
        nodes[other].retain(|&next| weights[next] > 0 && marks[next] != *mark);
        let beside = reached_weight - weights[other];
        let through: usize = cliques[other].iter().map(|&known| outside[known]).sum();
        let straight: usize = nodes[other].iter().map(|&next| weights[next]).sum();
        let degree = (beside + through + straight).min(self.degrees[other] + beside);
        self.degrees[other] = degree.min(self.left - weights[other]);
        cliques[other].push(clique);
    }

    /// Nodes with the same neighbours become one; nodes that are joined to the new clique alone go with the node that made it.
    fn merge_alike(&mut self, reached: &mut Vec<usize>, made_by: usize) {
        reached.sort_by_cached_key(|&node| (self.alike(node), node));
        for (at, &first) in reached.iter().enumerate() {
            if self.weights[first] == 0 {
                continue;
            }
            let alone = self.nodes[first].is_empty() && self.cliques[first] == [made_by];
            if alone && is_late(self.late, first) == is_late(self.late, made_by) {
                self.left -= self.weights[first];
                self.follow(first, made_by);
                continue;
            }
            for &second in &reached[at + 1..] {
                if self.weights[second] == 0 {
                    continue;
                }
                if self.alike(second) != self.alike(first) {
                    break;
                }
                if self.nodes[second] == self.nodes[first] && self.cliques[second] == self.cliques[first] {
                    self.weights[first] += self.weights[second];
                    self.degrees[first] -= self.weights[second].min(self.degrees[first]);
                    self.follow(second, first);
                }
            }
        }
        reached.retain(|&node| self.weights[node] > 0);
    }

    /// Equal for nodes with the same neighbours of which both or none come late.
    fn alike(&self, node: usize) -> [usize; 4] {
        let sum = self.nodes[node].iter().chain(&self.cliques[node]).sum();
        [sum, self.nodes[node].len(), self.cliques[node].len(), usize::from(is_late(self.late, node))]
    }

    fn ranked(&self, node: usize) -> Ranked {
        Ranked { late: is_late(self.late, node), degree: self.degrees[node], node }
    }

    /// Has a node go right after another.
    fn follow(&mut self, node: usize, leader: usize) {
        self.weights[node] = 0;
        self.nodes[node].clear();
        self.cliques[node].clear();
        self.followers[leader].push(node);
    }
}

fn is_late(late: &[bool], node: usize) -> bool {
    late.get(node).is_some_and(|late| *late)
}

#[cfg(test)]
mod tests {
    use super::minimum_degree;

    #[test]
    fn a_star_is_eliminated_from_its_points() {
        let order = minimum_degree(&[vec![1, 2, 3, 4], vec![0], vec![0], vec![0], vec![0]], &[]);
        assert_eq!(order[..3], [1, 2, 3]);
    }

    #[test]
    fn a_chain_is_eliminated_from_an_end() {
        let order = minimum_degree(&[vec![3], vec![2], vec![1, 3], vec![2, 0]], &[]);
        assert_eq!(order[..2], [0, 1]);
    }

    #[test]
    fn every_node_of_a_lattice_goes_once() {
        let side = 9;
        let neighbours: Vec<Vec<usize>> = (0..side * side)
            .map(|i| {
                let near =
                    |j: &usize| i != *j && (i % side).abs_diff(j % side) <= 1 && (i / side).abs_diff(j / side) <= 1;
                (0..side * side).filter(near).collect()
            })
            .collect();
        let mut order = minimum_degree(&neighbours, &[]);
        order.sort_unstable();
        assert!(order.into_iter().eq(0..side * side));
        // late nodes come after all others
        let late: Vec<bool> = (0..side * side).map(|i| i % 5 == 2).collect();
        let mut order = minimum_degree(&neighbours, &late);
        assert!(order.iter().map(|&node| late[node]).is_sorted(), "{order:?}");
        order.sort_unstable();
        assert!(order.into_iter().eq(0..side * side));
    }
}
