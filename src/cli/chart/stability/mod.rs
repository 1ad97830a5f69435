//! `chart stability`: where methods fail, and whether this one does.

mod common;
mod hanging;
pub(super) mod incline;
pub(super) mod tube_map;
