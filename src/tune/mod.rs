//! Gains that are found, explained and safe: how a scene's picture answers to its resolution, and which law holds it best.
//!
//! In: frames of an experiment ([`Observed`]). Out: the plant behind them ([`Plant`]), what a law does to it ([`explain`], [`judge`])
//! and the gains that do best ([`search()`]). Closed loops are played with the controller that draws, [`crate::control::PictureControl`],
//! on the fitted plant, so that what is found is what runs. Never here: scenes, threads of agents, drawing, files.
//! Theory: `docs/theory/control.md`, section 6.

mod disturb;
mod explain;
mod line;
mod margins;
mod measures;
mod plant;
mod play;
mod relay;
mod search;
mod trials;

pub use disturb::Disturbance;
pub use explain::{Explanation, FixedPoint, explain};
pub use line::Line;
pub use margins::Loop;
pub use measures::{BAND, Cycle, LATE, Measures};
pub use plant::{NoPlant, Observed, Plant, Reach};
pub use play::{Beat, Start, Trial, play};
pub use relay::relay_gains;
pub use search::{Family, Found, Search, search};
pub use trials::{Extent, Verdict, judge};
