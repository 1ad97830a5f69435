//! The window: a running scene with panels around its picture, keys and mouse.
//!
//! In: a plan of what to play. Out: the outcome of the run. Never here: physics, a law of control, the format of scenes.

mod live_tuning;
pub mod ui;
mod view_model;
mod window;

pub use window::{FRAMES_KEPT, GoOn, WindowFailure, WindowPlan, play_in_window};
