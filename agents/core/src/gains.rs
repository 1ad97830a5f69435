//! Ranges of the gains of the feedback laws that hold a picture at its time, and agents at their share.
//!
//! In: nothing. Out: the least and the greatest value of each gain, which scene files, their schema, the sliders of the window and the search
//! for gains all allow. Never here: a law. Theory: `docs/theory/control.md`, eq. 1, 7 and 19.

use crate::NumberRange;

/// α of the printed law, dimensionless per frame/s: the change of ε̂ for each frame per second that is missing.
pub const ALPHA: NumberRange = NumberRange::new(1e-9, 1.0, "");
/// β of the printed law, dimensionless: the change of ρ for each unit of ε̂.
pub const BETA: NumberRange = NumberRange::new(1e-6, 1e3, "");
/// κ of the corrected law, dimensionless: below 1 it is stable for every scene, from 2 on for none.
pub const KAPPA: NumberRange = NumberRange::new(1e-3, 1.99, "");
/// λ of the corrected law, dimensionless: the share of an error's change that one frame adds.
pub const LEAD: NumberRange = NumberRange::new(0.0, 1.99, "");
/// The fraction of a frame that the corrected law leaves free.
pub const MARGIN: NumberRange = NumberRange::new(0.0, 0.9, "");
/// The share of the way to a finer level that one demand of an agent goes, dimensionless.
pub const REFINE: NumberRange = NumberRange::new(0.02, 1.0, "");
/// The share of a delay by others, of logarithms, that one demand of an agent removes, dimensionless.
pub const YIELD: NumberRange = NumberRange::new(0.02, 1.99, "");
