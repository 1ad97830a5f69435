//! The level n that each tube is drawn at: by the mean of its ρ, whatever policy has chosen its polygons.
//!
//! In: objects in view, the levels chosen for them. Out: the same with tubes at the n that they hold. Never here: how many polygons a tube has.
//! Theory: `docs/theory/control.md`, section 3.

use crate::control::demand::level;
use crate::control::demand::plan::{LevelDemand, SizedView};
use crate::control::demand::view::Kind;
use crate::hysteresis::MeanLevel;
use metachron_core::AgentId;

/// The levels n of the tubes in view that have room to hold one, each by the mean of its ρ.
#[derive(Debug, Clone, Default)]
pub(super) struct TubeLevels {
    /// In the order in which objects are given.
    of: Vec<(AgentId, MeanLevel)>,
}

impl TubeLevels {
    /// Draws tubes at the n that they hold, and with as many polygons as were chosen, to the rounding of one interval; a mean is over `frames`.
    pub fn hold(&mut self, views: &[SizedView], levels: &mut [LevelDemand], frames: f64) {
        self.of.resize(views.len(), (AgentId(0), MeanLevel::default()));
        for ((SizedView { view, .. }, drawn), (of, held)) in views.iter().zip(levels).zip(&mut self.of) {
            if *of != view.id || !view.visible {
                (*of, *held) = (view.id, MeanLevel::default());
            }
            let Kind::Tube { length_m, radius_m } = view.kind else { continue };
            // where ε has no room n makes the polygons
            let finer_than_asked = drawn.resolution.eps_m < view.range.eps_m.0;
            if !(view.visible && drawn.polygons > 0.0) || level::is_narrow(view.range) || finer_than_asked {
                continue;
            }
            let rho = level::tube_rho(drawn.polygons, length_m, radius_m, view.range);
            let n = held.floor(rho, frames);
            if n != drawn.resolution.n {
                drawn.resolution = level::tube_cut(view.range, length_m, drawn.polygons, n);
                drawn.polygons = level::polygons(view, drawn.resolution);
                // an n that the range of ε does not allow now is not come back to
                held.set(drawn.resolution.n);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::demand::level::{Cut, LastCut, Span};
    use crate::control::demand::view::ObjectView;
    use metachron_core::ResolutionRange;
    use std::f64::consts::TAU;

    #[test]
    fn polygons_that_swing_by_a_factor_of_three_leave_n_and_are_met_by_the_spacing() {
        let range = ResolutionRange { eps_m: (5e-4, 0.02), n: (0, 10) };
        let kind = Kind::Tube { length_m: 1.5, radius_m: 0.015 };
        let view = ObjectView { range, pixels: 1e9, distance_m: 0.5, ..ObjectView::plain(0, kind) };
        let seen = SizedView { view, span: Span::of(&view) };
        for start in 0..60 {
            let (middle, mut tubes) = (3000.0 * 1.05_f64.powi(start), TubeLevels::default());
            let mut ns = Vec::new();
            for k in 0..600 {
                let wish = middle * libm::exp(0.55 * libm::sin(TAU * f64::from(k) / 60.0));
                let Cut { resolution, polygons } = LastCut::default().choose(&view, seen.span, wish);
                let mut levels = [LevelDemand { id: view.id, resolution, polygons, shading: view.shading.1 }];
                tubes.hold(&[seen], &mut levels, 120.0);
                let [LevelDemand { resolution, polygons: drawn, .. }] = levels;
                assert!(
                    (drawn - polygons).abs() <= 12.0 * f64::from(1_u32 << resolution.n),
                    "{wish}: {drawn} {polygons}"
                );
                assert!((5e-4..=0.02).contains(&resolution.eps_m) && drawn == level::polygons(&view, resolution));
                ns.push(resolution.n);
            }
            ns.dedup();
            // the first values are a mean of few
            assert!(ns.len() <= 3, "{middle}: {ns:?}");
        }
    }
}
