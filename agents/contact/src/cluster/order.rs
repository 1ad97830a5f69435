//! The order in which a sparse matrix is eliminated: minimum degree on the quotient graph (GL89).
//!
//! In: the neighbours of each node. Out: the nodes in their order. Never here: numbers of the matrix.
//! Degrees are exact, and the lowest node of the least degree goes first, so the order depends on the graph alone.

use std::collections::BTreeSet;

/// The graph while it is eliminated: nodes that are left, and cliques that eliminated ones have left behind.
struct Quotient {
    /// The nodes that each node is joined to outside of cliques.
    nodes: Vec<Vec<usize>>,
    /// The cliques that each node is in, by the node that made them.
    cliques: Vec<Vec<usize>>,
    /// The nodes of each clique.
    members: Vec<Vec<usize>>,
    gone: Vec<bool>,
    marks: Vec<usize>,
    mark: usize,
}

/// The order of least degree of a graph, given by the neighbours of each node in any order.
pub(super) fn minimum_degree(neighbours: Vec<Vec<usize>>) -> Vec<usize> {
    let size = neighbours.len();
    let mut graph = Quotient {
        nodes: neighbours,
        cliques: vec![Vec::new(); size],
        members: vec![Vec::new(); size],
        gone: vec![false; size],
        marks: vec![0; size],
        mark: 0,
    };
    let mut degrees: Vec<usize> = (0..size).map(|node| graph.reach(node).len()).collect();
    let mut open: BTreeSet<_> = degrees.iter().copied().zip(0..size).collect();
    let mut order = Vec::with_capacity(size);
    while let Some((_, node)) = open.pop_first() {
        order.push(node);
        for touched in graph.eliminate(node) {
            open.remove(&(degrees[touched], touched));
            degrees[touched] = graph.reach(touched).len();
            open.insert((degrees[touched], touched));
        }
    }
    order
}

impl Quotient {
    /// The nodes left that `node` is joined to, through cliques too.
    fn reach(&mut self, node: usize) -> Vec<usize> {
        self.mark += 1;
        self.marks[node] = self.mark;
        let through = self.cliques[node].iter().flat_map(|&clique| &self.members[clique]);
        let mut found = Vec::new();
        for &other in self.nodes[node].iter().chain(through) {
            if !self.gone[other] && self.marks[other] != self.mark {
                self.marks[other] = self.mark;
                found.push(other);
            }
        }
        found
    }

    /// Takes a node out: those it reached become a clique, which takes up all cliques that it was in. Returns them.
    fn eliminate(&mut self, node: usize) -> Vec<usize> {
        let reached = self.reach(node);
        self.gone[node] = true;
        let taken = std::mem::take(&mut self.cliques[node]);
        taken.iter().for_each(|&clique| self.members[clique].clear());
        for &other in &reached {
            let Self { nodes, cliques, members, marks, mark, .. } = self;
            // what the new clique joins needs no edge of its own
            nodes[other].retain(|&next| next != node && marks[next] != *mark);
            cliques[other].retain(|&clique| !members[clique].is_empty());
            cliques[other].push(node);
        }
        self.members[node].clone_from(&reached);
        reached
    }
}

#[cfg(test)]
mod tests {
    use super::minimum_degree;

    #[test]
    fn a_star_is_eliminated_from_its_points() {
        let order = minimum_degree(vec![vec![1, 2, 3, 4], vec![0], vec![0], vec![0], vec![0]]);
        assert_eq!(order[..3], [1, 2, 3]);
    }

    #[test]
    fn a_chain_is_eliminated_from_an_end() {
        let order = minimum_degree(vec![vec![3], vec![2], vec![1, 3], vec![2, 0]]);
        assert_eq!(order, [0, 1, 2, 3]);
    }
}
