//! The policies that choose levels, by name, and the feedback law with its gains.
//!
//! In: a name, gains. Out: settings for [`crate::control::PictureControl`]. Never here: a choice.

use crate::control::prices::price::Prices;
use crate::cost::benefit::Sliders;
use crate::{grisoni, log_law};

/// The policy that chooses the level of every visible object. Theory and papers: `docs/theory/budget.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Policy {
    /// The finest of everything, whatever it costs.
    Full,
    /// The finest level whose polygons cover 1024 pixels each (FS93, §7).
    Static,
    /// The same with a threshold that follows the time of the frame before (FS93, §7).
    Threshold,
    /// Levels in falling benefit per cost (FS93, §6).
    Greedy,
    /// The same from the levels of the frame before (FS93, §6).
    GreedyIncremental,
    /// The better of the greedy answer and the best single object.
    GreedyRepaired,
    /// Objects and groups, from the cut of the frame before (MB97, §4).
    Hierarchical,
    /// Objects and groups in falling benefit per cost (MB97, §6).
    HierarchicalFlat,
    /// Objects and groups, always refining the most important next (MS95).
    MacielShirley,
    /// Every object gets its share of the time by value (RH05).
    RobinHood,
    /// Any number of triangles, the exact optimum (GB99).
    Convex,
    /// Any number of triangles, by interior point (GB99).
    ConvexBarrier,
    /// Steps of concave hulls in falling gain per cost, up to the first that does not fit.
    MarginalStop,
    /// The same, and then any that still fit.
    MarginalFill,
    /// Feedback on (ε, n) from the measured work of frames (GDC04).
    Feedback,
    /// Concave hulls, a cost table corrected by measurements, hysteresis on marginal value, a certificate every frame.
    #[default]
    Adaptive,
}

impl Policy {
    /// All policies.
    pub const ALL: [Self; 16] = [
        Self::Full,
        Self::Static,
        Self::Threshold,
        Self::Greedy,
        Self::GreedyIncremental,
        Self::GreedyRepaired,
        Self::Hierarchical,
        Self::HierarchicalFlat,
        Self::MacielShirley,
        Self::RobinHood,
        Self::Convex,
        Self::ConvexBarrier,
        Self::MarginalStop,
        Self::MarginalFill,
        Self::Feedback,
        Self::Adaptive,
    ];

    /// The name in scenes and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Static => "static",
            Self::Threshold => "threshold",
            Self::Greedy => "greedy",
            Self::GreedyIncremental => "greedy-incremental",
            Self::GreedyRepaired => "greedy-repaired",
            Self::Hierarchical => "hierarchical",
            Self::HierarchicalFlat => "hierarchical-flat",
            Self::MacielShirley => "maciel-shirley",
            Self::RobinHood => "robin-hood",
            Self::Convex => "convex",
            Self::ConvexBarrier => "convex-barrier",
            Self::MarginalStop => "marginal-stop",
            Self::MarginalFill => "marginal-fill",
            Self::Feedback => "feedback",
            Self::Adaptive => "adaptive",
        }
    }

    /// Whether the policy predicts the cost of levels.
    #[must_use]
    pub const fn predicts(self) -> bool {
        !matches!(self, Self::Full | Self::Static | Self::Threshold | Self::Feedback)
    }

    /// Whether the policy chooses between a group's impostor and its members; for the others there are members alone.
    #[must_use]
    pub const fn chooses_groups(self) -> bool {
        matches!(self, Self::Hierarchical | Self::HierarchicalFlat | Self::MacielShirley | Self::Adaptive)
    }

    /// Whether the policy weighs levels by the benefit as it is printed (FS93, §5): accuracy by samples, motion and hysteresis by level.
    #[must_use]
    pub const fn has_printed_benefit(self) -> bool {
        matches!(self, Self::Greedy | Self::GreedyIncremental | Self::GreedyRepaired)
    }

    /// Whether the slider of hysteresis changes the policy's choice.
    #[must_use]
    pub const fn has_hysteresis(self) -> bool {
        self.has_printed_benefit() || matches!(self, Self::Adaptive)
    }

    /// How much each factor counts in the benefit of a level where neither scene nor user says: size, accuracy and importance in full. With
    /// the benefit as printed that is all, as in the timed test of (FS93, §7); else motion counts by half: moving objects are judged less
    /// strictly than resting ones.
    #[must_use]
    pub const fn usual_sliders(self) -> Sliders {
        let motion = if self.has_printed_benefit() { 0.0 } else { 0.5 };
        Sliders { size: 1.0, accuracy: 1.0, importance: 1.0, focus: 0.0, motion, hysteresis: 0.0 }
    }

    /// Whether the policy takes pixels from the picture where all else is at its coarsest: one that ignores the time of frames does not.
    #[must_use]
    pub const fn scales_pictures(self) -> bool {
        self.predicts() || matches!(self, Self::Feedback)
    }

    /// The factors of the benefit that the policy uses: the distance from the middle of the picture always counts for (GB99).
    pub(crate) fn sliders(self, asked: Sliders) -> Sliders {
        match self {
            Self::Convex | Self::ConvexBarrier => Sliders { focus: 1.0, ..asked },
            _ => asked,
        }
    }

    /// The prices that the policy uses: by area for Robin Hood (RH05), else two stages (FS93). The default uses the stages too: areas that
    /// objects occlude from each other are priced in full, and its γ is fitted to the remainder (control.md, section 7).
    pub(crate) fn prices(self, known: &Prices) -> Prices {
        if self == Self::RobinHood { *known } else { known.by_lines() }
    }

    /// The policy of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|policy| policy.name() == name)
    }
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
        /// κ, 0.001 … 1.99: the share of an error that one frame removes.
        kappa: f64,
        /// λ, 0 … 1.99: the share of an error's change that one frame adds; above 0 it is a PI law that cannot wind up.
        lead: f64,
        /// The fraction of the frame that is left free, 0 … 0.9: T_set = (1 − margin) T.
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
