//! Control laws and the sharing of a budget, as numbers: a time goes in, a coarseness comes out.
//!
//! In: measured times or rates, ranges, costs, benefits. Out: ε, n, shares of a budget, a level for every object.
//! Never here: clocks, objects, engine types. Theory: `docs/theory/control.md`, after (GDC04), and `docs/theory/budget.md`.
//!
//! ```
//! use metachron_lod::log_law::{Gains, LogLaw};
//!
//! // a plant on some machine: 1.4 ms and 22 ms/ε a frame, to be held at 30 ms
//! let mut law = LogLaw::new(Gains::default(), (-3.0, 3.0), 0.0);
//! for _ in 0..30 {
//!     let took_ms = 1.4 + 22.0 / law.value().exp();
//!     law.observe(took_ms / 30.0, None);
//! }
//! assert!(((1.4 + 22.0 / law.value().exp()) / 30.0 - 1.0).abs() < 0.05);
//! ```
#![cfg_attr(not(feature = "std"), no_std)]

extern crate alloc;

pub mod adaptive;
#[cfg(feature = "std")]
pub mod control;
pub mod cost;
pub mod grisoni;
pub mod hysteresis;
pub mod log_law;
pub mod select;
pub mod share;
#[cfg(feature = "std")]
pub mod tune;

/// An end of a range of resolutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "std", derive(serde::Serialize, serde::Deserialize))]
pub enum Bound {
    /// As fine as allowed: there is time left that cannot be used.
    Finest,
    /// As coarse as allowed: the target time cannot be reached.
    Coarsest,
}

/// `x` inside `lo..=hi`; `hi` if `x` is NaN. Never panics, unlike `f64::clamp`.
pub(crate) fn within(x: f64, lo: f64, hi: f64) -> f64 {
    if x.is_nan() { hi } else { x.max(lo).min(hi) }
}
