//! Settings of the policies that choose levels, and the feedback law with its gains.
//!
//! In: a name, gains. Out: settings for [`crate::control::PictureControl`]. Never here: a choice.

use crate::control::prices::price::Prices;
use crate::cost::benefit::Sliders;
use crate::{grisoni, log_law};

/// The policy that chooses the level of every visible object. Theory and papers: `docs/theory/budget.md`.
pub use metachron_core::kinds::PolicyKind as Policy;

/// A difference that the hysteresis of (MB97, §7), of benefits, and of (GB99), of resolutions, ignores.
const SAME: f64 = 0.05;

/// How much each factor counts in the benefit of a level where neither scene nor user says: size, accuracy and importance in full. With
/// the benefit as printed that is all, as in the timed test of (FS93, §7); else motion counts by half: moving objects are judged less
/// strictly than resting ones. The distance from the middle of the picture counts for (GB99), and hysteresis for it and (MB97).
pub(crate) const fn usual_sliders(policy: Policy) -> Sliders {
    let motion = if policy.has_printed_benefit() { 0.0 } else { 0.5 };
    let (focus, hysteresis) = match policy {
        Policy::Convex | Policy::ConvexBarrier => (1.0, SAME),
        Policy::Hierarchical => (0.0, SAME),
        _ => (0.0, 0.0),
    };
    Sliders { size: 1.0, accuracy: 1.0, importance: 1.0, focus, motion, hysteresis }
}

/// The prices that the policy uses: by area for Robin Hood (RH05), else two stages (FS93). The default uses the stages too: areas that
/// objects occlude from each other are priced in full, and its γ is fitted to the remainder (control.md, section 7).
pub(crate) fn prices(policy: Policy, known: &Prices) -> Prices {
    if policy == Policy::RobinHood { *known } else { known.by_lines() }
}

/// The feedback law and its gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// The law as printed (GDC04, eq. 1), on ε̂ = 40 ε/L.
    Printed {
        /// α: change of ε̂ for each frame per second that is missing, > 0. Past 2/(df/dε̂) the loop oscillates without end.
        alpha: f64,
        /// β: change of ρ for each unit of ε̂, > 0.
        beta: f64,
    },
    /// The law on the logarithm of the measured time (control.md, eq. 7).
    Corrected {
        /// κ, within [`KAPPA`](metachron_core::gains::KAPPA): the share of an error that one frame removes.
        kappa: f64,
        /// λ, within [`LEAD`](metachron_core::gains::LEAD): the share of an error's change that one frame adds; above 0 it is a PI law that cannot wind up.
        lead: f64,
        /// The fraction of the frame that is left free, within [`MARGIN`](metachron_core::gains::MARGIN): T_set = (1 − margin) T.
        margin: f64,
    },
}

impl Law {
    /// The printed law with the gains of (GDC04).
    pub const PRINTED: Self = Self::Printed { alpha: 1e-4, beta: 5.0 };

    /// The corrected law; a tenth of the frame stays free: work that scatters by 5 % then misses (exceeds 1.05 T) in fewer than 1 frame in
    /// 100.
    pub const CORRECTED: Self = Self::Corrected { kappa: 0.5, lead: 0.0, margin: 0.1 };

    /// Target work as a fraction of the frame's time: T_set/T.
    #[must_use]
    pub fn set_share(self) -> f64 {
        match self {
            Self::Printed { .. } => 1.0,
            Self::Corrected { margin, .. } if margin.is_finite() => 1.0 - margin.clamp(0.0, 0.9),
            Self::Corrected { .. } => 0.9,
        }
    }

    /// Whether `other` is the same law, with whatever gains.
    #[must_use]
    pub const fn is_same_law(&self, other: &Self) -> bool {
        matches!(
            (self, other),
            (Self::Printed { .. }, Self::Printed { .. }) | (Self::Corrected { .. }, Self::Corrected { .. })
        )
    }

    pub(crate) fn log_gains(self) -> log_law::Gains {
        let default = log_law::Gains::default();
        match self {
            Self::Corrected { kappa, lead, .. } => log_law::Gains { kappa, lead, ..default },
            Self::Printed { .. } => default,
        }
    }

    pub(crate) fn printed_gains(self) -> grisoni::Gains {
        match self {
            Self::Printed { alpha, beta } => grisoni::Gains { alpha, beta },
            Self::Corrected { .. } => grisoni::Gains::default(),
        }
    }
}

impl Default for Law {
    fn default() -> Self {
        Self::CORRECTED
    }
}
