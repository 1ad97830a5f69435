//! `chart policies`: the papers' experiments on frame budgets, on numeric scenes with a declared machine, and live.

pub(super) mod compared;
pub(super) mod live;
mod numeric;
pub(super) mod papers;
pub(super) mod plates;
mod played;
