//! Reads a synthetic agent of a scene file as a [`SyntheticSpec`].

use crate::format::{OneOrRange, SyntheticFile};
use metachron_models::synthetic::SyntheticSpec;

/// Default spacing, metres.
const EPS_DEFAULT_M: f64 = 0.01;

/// Reads a synthetic agent, and the spacings that it may take.
pub(super) fn build(file: &SyntheticFile) -> (SyntheticSpec, (f64, f64)) {
    let spec = SyntheticSpec {
        cost_us: file.cost_us,
        cost_order: file.cost_order.unwrap_or(1.0),
        error_m: file.error_m.unwrap_or(0.0),
        error_order: file.error_order.unwrap_or(2.0),
    };
    (spec, file.eps_m.map_or((EPS_DEFAULT_M, EPS_DEFAULT_M), OneOrRange::ends))
}
