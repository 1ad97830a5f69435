//! The window: a running scene with panels around its picture, keys and mouse.
//!
//! In: a plan of what to play. Out: the outcome of the run. Never here: physics, a law of control, the format of scenes.
//!
//! ```
//! use metachron_viewer::ui::next_speed;
//!
//! // the keys + and - step through a table of speeds, simulated seconds per second
//! assert_eq!(next_speed(1.0, true), 2.0);
//! assert_eq!(next_speed(1.0, false), 0.5);
//! assert_eq!(next_speed(10.0, true), 10.0);
//! ```

mod live_tuning;
pub mod ui;
mod view_model;
mod window;

pub use window::{FRAMES_KEPT, GoOn, WindowFailure, WindowPlan, play_in_window};
