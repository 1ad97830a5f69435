//! How a given lag is shared among culling, choosing and drawing (GB99).
//!
//! In: the greatest lag allowed, the optimiser's share, the measured time of culling. Out: times for choosing and for drawing.
//! Never here: a clock or a camera; the renderer extrapolates its motion by the lag. Theory: `docs/theory/budget.md`, eq. 53.

/// The settings of the user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pipeline {
    /// The greatest lag from input to picture; > 0.
    pub lag: f64,
    /// The fraction of the time left by culling that choosing may take, 0 … 1.
    pub share: f64,
    /// Whether the next frame is chosen while this one is drawn: then drawing has all the time left by culling, and choosing takes none of
    /// it.
    pub overlapped: bool,
}

/// The time of each part, ≥ 0. Culling plus the longer of the other two if they run in parallel, else culling plus both, equals the lag
/// unless culling alone exceeds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// For choosing.
    pub choose: f64,
    /// For drawing.
    pub draw: f64,
    /// Time by which the motion of the camera is to be extrapolated.
    pub extrapolate: f64,
}

impl Pipeline {
    /// Divides the lag after culling took `cull`. An invalid `cull` counts as the whole lag.
    #[must_use]
    pub fn split(&self, cull: f64) -> Split {
        let lag = if self.lag.is_finite() && self.lag > 0.0 { self.lag } else { 0.0 };
        let share = crate::within(self.share, 0.0, 1.0);
        let cull = if cull.is_finite() { cull.max(0.0) } else { lag };
        let rest = (lag - cull).max(0.0);
        let choose = share * rest;
        let draw = if self.overlapped { rest } else { rest - choose };
        Split { choose, draw, extrapolate: lag }
    }
}
