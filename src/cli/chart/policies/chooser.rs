//! The policies by name, over what is seen of a scene in numbers.
//!
//! In: things in view with their levels' costs and gains, the time of a frame, measured times. Out: a level for each, and what
//! is promised. Never here: a policy's own arithmetic (the crate `metachron-budget` has it), the machine.

mod ours;
mod sharing;
mod whole;

pub(super) use whole::{problem, worth};

use super::scene::{Scene, Seen};
use metachron_budget::cost::overlap::Overlap;
use metachron_budget::cost::value::Value;
use metachron_budget::select::Level;
use metachron_budget::select::threshold::STATIC_PX;

/// The margin that every policy with a prediction leaves, as a part of T: none is better for leaving less.
pub(super) const MARGIN: f64 = 0.02;

/// Pixels a polygon of [`Policy::StaticFine`].
const FINE_PX: f64 = 64.0;

/// The time of a frame, microseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Time {
    /// T.
    pub(super) target: f64,
    /// What logic takes beside drawing.
    pub(super) logic: f64,
    /// How much of the shorter of logic and drawing adds to the longer, 0 … 1.
    pub(super) overlap: f64,
}

/// What is drawn of one thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pick {
    /// Its level; `None` where it is left out.
    pub(super) level: Level,
    /// How much of that level is drawn, 0 … 1.
    pub(super) part: f64,
}

/// What is drawn of everything in view, in its order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Choice {
    pub(super) picks: Vec<Pick>,
    /// The time that the frame is expected to take, microseconds; NaN where nothing is expected.
    pub(super) predicted: f64,
    /// How far below the best it can be, as a part of the best; NaN where that is not known.
    pub(super) gap: f64,
}

/// Who chooses.
pub(super) trait Chooser {
    /// Chooses for a frame.
    fn choose(&mut self, frame: u64, scene: &Scene, seen: &[Seen], time: Time) -> Choice;

    /// Learns what a frame took, microseconds.
    fn learn(&mut self, _frame: u64, _took: f64, _time: Time) {}
}

/// A policy, by the name that the command line knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Policy {
    /// The finest of everything.
    Full,
    /// 1024 pixels a polygon.
    Static,
    /// So few pixels a polygon that the static rule spends about the time it has.
    StaticFine,
    /// The threshold moved by the last frame's time.
    Threshold,
    /// Whole levels in falling benefit per cost.
    Greedy,
    /// Time in proportion to value.
    RobinHood(Value),
    /// Any resolution, by the closed form.
    Convex,
    /// Hull steps in falling gain per cost, without learning.
    MarginalFill,
    /// Ours.
    Adaptive,
}

impl Policy {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Static => "static",
            Self::StaticFine => "static-64-px",
            Self::Threshold => "threshold",
            Self::Greedy => "greedy",
            Self::RobinHood(_) => "robin-hood",
            Self::Convex => "convex",
            Self::MarginalFill => "marginal-fill",
            Self::Adaptive => "adaptive",
        }
    }

    /// A chooser that knows nothing yet.
    pub(super) fn chooser(self) -> Box<dyn Chooser> {
        match self {
            Self::Full => Box::new(whole::Full),
            Self::Static => Box::new(whole::Static(STATIC_PX)),
            Self::StaticFine => Box::new(whole::Static(FINE_PX)),
            Self::Threshold => Box::<whole::Threshold>::default(),
            Self::Greedy => Box::new(whole::Greedy),
            Self::MarginalFill => Box::new(whole::Marginal),
            Self::RobinHood(value) => Box::new(sharing::RobinHood(value)),
            Self::Convex => Box::new(sharing::Convex),
            Self::Adaptive => Box::<ours::Ours>::default(),
        }
    }
}

impl Pick {
    fn whole(level: Level) -> Self {
        Self { level, part: 1.0 }
    }
}

impl Time {
    /// What may be drawn for, microseconds: the rest of a frame beside its logic.
    pub(super) fn drawing(self) -> f64 {
        Overlap::Fitted(self.overlap).drawing(self.target, self.logic)
    }

    /// The same if `margin` of the frame stays free.
    fn drawing_within(self, margin: f64) -> f64 {
        Self { target: (1.0 - margin) * self.target, ..self }.drawing()
    }

    /// The time of a frame that draws for `drawing`, microseconds.
    pub(super) fn frame(self, drawing: f64) -> f64 {
        Overlap::frame(self.overlap, self.logic, drawing)
    }
}
