//! How a given lag is shared among culling, choosing and drawing (GB99).
//!
//! In: the greatest lag allowed, the optimiser's share, the measured time of culling. Out: times for choosing and for drawing.
//! Never here: a clock or a camera; who draws extrapolates its motion by the lag. Theory: `docs/theory/budget.md`, eq. 53.

/// What a user gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pipeline {
    /// The greatest lag from input to picture; > 0.
    pub lag: f64,
    /// The part of what culling leaves that choosing may take, 0 … 1.
    pub share: f64,
    /// Whether the next frame is chosen while this one is drawn: then drawing has all that culling leaves, and choosing takes none of it.
    pub overlapped: bool,
}

/// The time of each part, ≥ 0. Culling and what is longer of the other two where they go side by side, else culling and both, are the
/// lag where culling does not take it all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// For choosing.
    pub choose: f64,
    /// For drawing.
    pub draw: f64,
    /// By how much the motion of the camera is to be extrapolated.
    pub extrapolate: f64,
}

impl Pipeline {
    /// Shares the lag out after culling took `cull`. What is none counts as a culling that left nothing.
    #[must_use]
    pub fn split(&self, cull: f64) -> Split {
        let lag = if self.lag.is_finite() && self.lag > 0.0 { self.lag } else { 0.0 };
        let share = crate::within(self.share, (0.0, 1.0));
        let cull = if cull.is_finite() { cull.max(0.0) } else { lag };
        let rest = (lag - cull).max(0.0);
        let choose = share * rest;
        let draw = if self.overlapped { rest } else { rest - choose };
        Split { choose, draw, extrapolate: lag }
    }
}
