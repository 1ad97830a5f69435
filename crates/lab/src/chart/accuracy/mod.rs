//! `chart accuracy`: the error of each method against an independent answer, and its cost.

pub(super) mod beam;
pub(super) mod buckling;
pub(super) mod cantilever;
pub(super) mod catenary;
pub(super) mod diagram;
pub(super) mod elastica;
pub(super) mod end_moment;
pub(super) mod four_point;
pub(super) mod frequencies;
pub(super) mod front;
pub(super) mod helix;
pub(super) mod inflation;
pub(super) mod peers;
mod play;
pub(super) mod sheet;
pub(super) mod swing;
