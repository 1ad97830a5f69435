//! The state of a controller as it reports it: moving, resting, or stopped at an end of its range.
//!
//! In: the states of the laws. Out: [`Status`], and its sentence for the viewer and the report. Never here: state.

use super::query::Promise;
use crate::Bound;
use crate::log_law::Rest;
use std::fmt;

/// The present activity of the picture's controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Status {
    /// No frame has been measured yet.
    #[default]
    Waiting,
    /// The controller moves (ε, n) towards the target time.
    Moving,
    /// The work is on target.
    Settled,
    /// The controller is stopped at this end of the range of the objects in view.
    Clamped(Bound),
    /// Everything is at its coarsest, and the work is on target because the picture is drawn with fewer pixels.
    Reduced,
    /// Everything is at its coarsest and frames are in time, but they take some of the time that is reserved for others.
    Reserved,
    /// There is time left, but the next finer level would be late.
    BetweenLevels,
    /// Nothing in view can be drawn in more than one way.
    Fixed,
    /// The policy requests the finest level and ignores the time.
    Full,
}

impl From<Rest> for Status {
    fn from(rest: Rest) -> Self {
        match rest {
            Rest::Moving => Self::Moving,
            Rest::Settled => Self::Settled,
            Rest::Clamped(bound) => Self::Clamped(bound),
            Rest::BetweenLevels => Self::BetweenLevels,
        }
    }
}

impl Status {
    /// The status of a policy that predicts without feedback: its promise.
    pub(crate) fn of_promise(promise: &Promise) -> Self {
        if promise.feasible { Self::Settled } else { Self::Clamped(Bound::Coarsest) }
    }

    /// The end at which the controller is stopped.
    #[must_use]
    pub fn clamped(self) -> Option<Bound> {
        if let Self::Clamped(bound) = self { Some(bound) } else { None }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Waiting => "waiting for a first measured frame",
            Self::Moving => "moving towards the target",
            Self::Settled => "on target",
            Self::Clamped(Bound::Finest) => "at its finest: ε may not be finer, and there is time left",
            Self::Clamped(Bound::Coarsest) => "at its coarsest: ε may not be coarser, and frames still take too long",
            Self::Reduced => "at its coarsest, and on target with fewer pixels",
            Self::Reserved => {
                "at its coarsest: frames are in time, but take some of the time that is reserved for agents"
            }
            Self::BetweenLevels => "between levels: there is time left, but the next finer level would be late",
            Self::Fixed => "fixed: nothing in view has a range to choose from",
            Self::Full => "full detail: the frame time is ignored",
        })
    }
}
