//! Reads a synthetic agent of a scene file as a [`SyntheticSpec`].

use super::objects::ModelContext;
use crate::check::Checker;
use crate::format::{SYNTHETIC, SyntheticFile};
use metachron_core::ResolutionRange;
use metachron_models::synthetic::SyntheticSpec;

/// Default spacing, metres.
const EPS_DEFAULT_M: f64 = 0.01;

/// Reads a synthetic agent, and the resolutions that it may take.
pub(super) fn build(
    c: &mut Checker<'_, '_>,
    file: &SyntheticFile,
    context: &ModelContext<'_>,
) -> (SyntheticSpec, ResolutionRange) {
    let place = context.place;
    let usual = (EPS_DEFAULT_M, EPS_DEFAULT_M);
    let eps_m = file.eps_m.map_or(usual, |eps| c.ends(place, "eps_m", eps, SYNTHETIC));
    let spec = SyntheticSpec {
        cost_us: c.number(place, "cost_us", file.cost_us, SYNTHETIC),
        cost_order: c.optional(place, "cost_order", file.cost_order, SYNTHETIC).unwrap_or(1.0),
        error_m: c.optional(place, "error_m", file.error_m, SYNTHETIC).unwrap_or(0.0),
        error_order: c.optional(place, "error_order", file.error_order, SYNTHETIC).unwrap_or(2.0),
    };
    (spec, ResolutionRange { eps_m, n: context.levels })
}
