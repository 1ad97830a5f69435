//! `chart accuracy`: how wrong each method is against an independent answer, and what it costs.

pub(super) mod cantilever;
pub(super) mod catenary;
pub(super) mod diagram;
pub(super) mod elastica;
pub(super) mod four_point;
pub(super) mod frequencies;
mod front;
mod peers;
mod play;
pub(super) mod swing;
