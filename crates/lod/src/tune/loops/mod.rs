//! How a closed loop behaves: plant, law, disturbance, and the measures of what follows.
//!
//! In: frames of an experiment, a law with its gains. Out: settling, margins, fixed points. Never here: a search for better gains.

pub mod candidate;
pub mod disturbance;
pub mod equilibria;
pub mod margins;
pub mod measures;
pub mod plant;
pub mod play;
pub mod robust_fit;
