//! `chart accuracy`: the error of each method against an independent answer, and its cost.

pub(super) mod beam;
pub(super) mod diagram;
pub(super) mod front;
pub(super) mod peers;
mod play;
pub(super) mod sheet;
pub(super) mod tubes;

use diagram::{Benchmark, Case, Goal};
use play::{Play, metre, reference_tube, slender_tube};
