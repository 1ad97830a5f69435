//! `chart stability`: where methods fail, and whether this program's methods do.

pub(super) mod capstan;
pub(super) mod clocks;
pub(super) mod common;
pub(super) mod hanging;
pub(super) mod heavy;
pub(super) mod incline;
pub(super) mod pairs;
pub(super) mod tube_map;
