//! Policies that choose a cut through groups of objects, a file an author.
//!
//! In: a tree of groups. Out: the nodes that are drawn. Never here: objects without groups.

pub mod half;
pub mod maciel;
pub mod mason;
pub mod mason_flat;
pub mod tree;
pub mod tree_exact;
