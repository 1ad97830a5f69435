//! The frame loop that connects runtime, control and compositor: gather, choose, draw, measure.
//!
//! In: a checked [`crate::world::Scene`]. Out: frames on the screen or in a file, and an [`Outcome`] that summarises the run.
//! A [`Session`] is a running scene; [`play_headless`] and [`play_in_window`] drive it. Never here: a control law, physics.

mod calibrate;
mod cast;
mod couplings;
mod error;
mod experiment;
mod fitting;
mod governor;
mod headless;
mod holding;
mod oracle;
mod outcome;
mod panels;
mod prices;
mod purse;
mod push;
mod session;
mod sight;
mod trace;
mod tuning;
mod walk;
mod window;

pub use couplings::Coupling;
pub use error::SessionError;
pub use experiment::{Experiment, Experimented, experiment};
pub use fitting::{Played, Point, apply, cells_of, method_of, play_points, setting_of, slacken};
pub use headless::{Drawing, End, Headless, play_headless};
pub use holding::Held;
pub use oracle::{Oracle, PairError, consult_oracle};
pub use outcome::{AgentOutcome, FrameRecord, Outcome, ProbeOutcome};
pub use prices::solve_prices;
pub use push::{After, Pushes, median, push};
pub use session::{Finished, Session};
pub use trace::Trace;
pub use walk::Walk;
pub use window::{FRAMES_KEPT, GoOn, WindowFailure, WindowPlan, play_in_window};
