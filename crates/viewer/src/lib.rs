//! The window: a running scene with panels around its picture, keys and mouse.
//!
//! In: a plan of the run. Out: the outcome of the run. Never here: physics, a law of control, the format of scenes.
//!
//! ```
//! use metachron_viewer::ui::{Command, SHORTCUTS, keys_text};
//! use std::collections::HashSet;
//!
//! let ctx = egui::Context::default(); // needs no window
//! ctx.set_os(egui::os::OperatingSystem::Nix);
//! assert_eq!(keys_text(&ctx, Command::Faster), "= or +");
//! assert_eq!(keys_text(&ctx, Command::Reload), "Ctrl+L");
//! let texts: HashSet<_> = SHORTCUTS.iter().map(|row| keys_text(&ctx, row.command)).collect();
//! assert_eq!(texts.len(), SHORTCUTS.len()); // no two commands share their keys
//! ```

mod live_tuning;
pub mod ui;
mod view_model;
mod window;

pub use window::{FRAMES_KEPT, GoOn, WindowFailure, WindowPlan, play_in_window};
