//! The frame-rate law exactly as printed (GDC04, eq. 1): a difference of rates moves ε, and ε moves n.
//!
//! In: the target frame rate and the measured one, in frames per second. Out: ε̂, ρ and n. Never here: corrections. The loop gain depends
//! on the machine; [`crate::log_law`] is the corrected law.
//! Theory: `docs/theory/control.md`, eq. 1 … 6.

use crate::{Bound, within};

/// The gains of the printed law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// α: change of ε̂ for each frame per second that is missing; > 0.
    /// Past 2 / (df/dε̂) the loop oscillates without end (control.md, eq. 4).
    pub alpha: f64,
    /// β: change of ρ for each unit of ε̂; > 0. Where β ε̂ ln 2 > 1, coarsening makes frames slower (control.md, eq. 6).
    pub beta: f64,
}

impl Default for Gains {
    /// The values of (GDC04): α = 10⁻⁴, β = 5.
    fn default() -> Self {
        Self { alpha: 1e-4, beta: 5.0 }
    }
}

/// Ranges of ε̂ and n; both ends are included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Finest and coarsest ε̂, `0 < finest <= coarsest`.
    pub eps: (f64, f64),
    /// Lowest and highest n.
    pub n: (u8, u8),
}

/// The state of the printed law: ε̂ and the real number ρ behind n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrisoniLaw {
    gains: Gains,
    limits: Limits,
    eps: f64,
    rho: f64,
    rest: Option<Bound>,
}

impl GrisoniLaw {
    /// A law that starts at (`eps`, `rho`), ε̂ brought inside its limits; ρ is 0 where it is not finite.
    #[must_use]
    pub fn new(gains: Gains, limits: Limits, eps: f64, rho: f64) -> Self {
        let rho = if rho.is_finite() { rho } else { 0.0 };
        Self { gains, limits, eps: within(eps, limits.eps.0, limits.eps.1), rho, rest: None }
    }

    /// Updates the law: a frame ran at `f_hz`, the target is `f0_hz`.
    ///
    /// ε ← ε + α (f₀ − f), ρ ← ρ + β (ε' − ε) (GDC04, eq. 1), with ε' clamped before ρ follows it.
    /// Gives `false`, and changes nothing, if a rate is not above zero and finite, or a gain is not finite.
    pub fn observe(&mut self, f0_hz: f64, f_hz: f64) -> bool {
        let real = |f: f64| f.is_finite() && f > 0.0;
        let wish = self.eps + self.gains.alpha * (f0_hz - f_hz);
        let rho = self.rho + self.gains.beta * (within(wish, self.limits.eps.0, self.limits.eps.1) - self.eps);
        if !(real(f0_hz) && real(f_hz) && wish.is_finite() && rho.is_finite()) {
            return false;
        }
        self.eps = within(wish, self.limits.eps.0, self.limits.eps.1);
        self.rho = rho;
        self.rest = match wish {
            wish if wish < self.limits.eps.0 => Some(Bound::Finest),
            wish if wish > self.limits.eps.1 => Some(Bound::Coarsest),
            _ => None,
        };
        true
    }

    /// ε̂, dimensionless: 40 ε / L for a tube of length L.
    #[must_use]
    pub fn eps(&self) -> f64 {
        self.eps
    }

    /// ρ, the real number whose floor is n.
    #[must_use]
    pub fn rho(&self) -> f64 {
        self.rho
    }

    /// n = ⌊ρ⌋ inside its limits.
    #[must_use]
    pub fn n(&self) -> u8 {
        within(libm::floor(self.rho), f64::from(self.limits.n.0), f64::from(self.limits.n.1)) as u8
    }

    /// The end of the range at which the last update clamped ε̂.
    #[must_use]
    pub fn rest(&self) -> Option<Bound> {
        self.rest
    }

    /// Sets other gains from the next update on; the state stays.
    pub fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }

    /// Sets other limits; ε̂ moves inside them and ρ follows.
    pub fn set_limits(&mut self, limits: Limits) {
        let eps = within(self.eps, limits.eps.0, limits.eps.1);
        let rho = self.rho + self.gains.beta * (eps - self.eps);
        self.rho = if rho.is_finite() { rho } else { self.rho };
        (self.limits, self.eps) = (limits, eps);
    }

    /// Multiplies ε̂ by `factor` and leaves ρ: a disturbance from outside, or another start.
    pub fn coarsen(&mut self, factor: f64) {
        self.eps = within(self.eps * factor, self.limits.eps.0, self.limits.eps.1);
    }
}
