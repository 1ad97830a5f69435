//! Passes of an incremental search: one rise, then as many falls as needed (FS93, §6; MB97, §4).
//!
//! In: a search whose objects or nodes rise and fall. Out: how many passes it took, and whether it converged. Never
//! here: the objects, the answer.

/// A search from the choice of the frame before.
pub(crate) trait Search {
    /// Whether the present choice costs more than the budget.
    fn is_over(&self) -> bool;
    /// Lets the object or node rise that gains most; gives its index, `None` where none can.
    fn rise(&mut self) -> Option<usize>;
    /// Lets the one fall that loses least; gives its index, `None` where none can.
    fn fall(&mut self) -> Option<usize>;
    /// Stores the present choice where it fits and is the best so far.
    fn keep_best(&mut self);
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Convergence {
    /// Passes made.
    pub passes: u32,
    /// Whether it converged; otherwise the limit of passes was reached.
    pub settled: bool,
}

/// Makes passes until one rises and falls in the same pass, `most` of them at most.
pub(crate) fn converge(search: &mut impl Search, most: u32) -> Convergence {
    let (mut passes, mut settled) = (0, false);
    while !settled && passes < most {
        passes += 1;
        settled = pass(search);
    }
    Convergence { passes, settled }
}

/// One pass; gives whether it was the last.
fn pass(search: &mut impl Search) -> bool {
    let risen = search.rise();
    let mut last = risen.is_none() && !search.is_over();
    while search.is_over() {
        let fallen = search.fall();
        last |= fallen.is_none() || fallen == risen;
        if fallen.is_none() {
            break;
        }
    }
    search.keep_best();
    last
}
