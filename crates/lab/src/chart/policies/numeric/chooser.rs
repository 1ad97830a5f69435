//! The policies by name, over the visible part of a scene in numbers.
//!
//! In: things in view with their levels' costs and gains, the time of a frame, measured times. Out: a level for each, and a
//! predicted time. Never here: a policy's own arithmetic (the crate `metachron-lod` has it), the machine.

mod ours;
mod sharing;
mod whole;

pub(super) use whole::{benefit, problem};

use super::scene::{Scene, VisibleObject};
use metachron_lod::cost::overlap::Overlap;
use metachron_lod::cost::value::Value;
use metachron_lod::select::Level;
use metachron_lod::select::threshold::STATIC_PX;

/// The margin that every predicting policy leaves, as a part of T: the same for all, so that none gains by leaving less.
pub(super) const MARGIN: f64 = 0.02;

/// Pixels per polygon of [`Policy::StaticFine`].
const FINE_PX: f64 = 64.0;

/// The time of a frame, microseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Time {
    /// T.
    pub(crate) target: f64,
    /// Time of the logic, which runs in addition to drawing.
    pub(crate) logic: f64,
    /// Share of the shorter of logic and drawing that adds to the longer, 0 … 1.
    pub(crate) overlap: f64,
}

/// The choice for one thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pick {
    /// Its level; `None` where it is left out.
    pub(crate) level: Level,
    /// Part of that level that is drawn, 0 … 1.
    pub(crate) part: f64,
}

/// The choices for everything in view, in its order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Choice {
    pub(crate) picks: Vec<Pick>,
    /// The predicted time of the frame, microseconds; NaN where there is no prediction.
    pub(crate) predicted: f64,
    /// Upper bound of the loss against the best choice, as a part of the best; NaN where unknown.
    pub(crate) gap: f64,
}

/// A policy at work.
pub(crate) trait Chooser {
    /// Chooses for a frame.
    fn choose(&mut self, frame: u64, scene: &Scene, seen: &[VisibleObject], time: Time) -> Choice;

    /// Takes in the measured time of a frame, microseconds.
    fn learn(&mut self, _frame: u64, _took: f64, _time: Time) {}
}

/// A policy, by its name on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Policy {
    /// The finest level of everything.
    Full,
    /// 1024 pixels per polygon.
    Static,
    /// So few pixels per polygon that the static rule uses about the time available.
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
    /// The default policy of this program.
    Adaptive,
}

impl Policy {
    pub(crate) fn name(self) -> &'static str {
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

    /// A chooser without any history.
    pub(crate) fn chooser(self) -> Box<dyn Chooser> {
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
    /// Time available for drawing, microseconds: the rest of a frame after its logic.
    pub(crate) fn drawing(self) -> f64 {
        Overlap::Fitted(self.overlap).drawing(self.target, self.logic)
    }

    /// The same with `margin` of the frame left free.
    fn drawing_within(self, margin: f64) -> f64 {
        Self { target: (1.0 - margin) * self.target, ..self }.drawing()
    }

    /// The time of a frame that draws for `drawing`, microseconds.
    pub(crate) fn frame(self, drawing: f64) -> f64 {
        Overlap::frame(self.overlap, self.logic, drawing)
    }
}
