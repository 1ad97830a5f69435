//! The frame loop that connects runtime, control and picture: gather, choose, draw, measure.
//!
//! In: a checked [`metachron_world::Scene`]. Out: frames on the screen or in a file, and an [`Outcome`] that summarises the run.
//! A [`Session`] is a running scene; [`play_headless`] drives it; a [`WorldView`] is the picture of a world that a program runs by itself. Never here: a window, arguments, a control law, physics.
//!
//! ```
//! use metachron_render::{Size, Style};
//! use metachron_scene::{Source, load};
//! use metachron_session::{Drawing, End, Headless, Session, play_headless};
//! use metachron_world::Pace;
//!
//! let text = b"format = 1\nexecutor = 'lockstep'\n[[object]]\nname = 'ball'\nmodel = 'rigid'\nshape = 'ball'\nradius_m = 0.1";
//! let scene = load(&Source::memory("falling", text).unwrap(), &[]).unwrap();
//! let (size, style) = (Size { width: 320, height: 180 }, Style::default());
//! let plan = Headless { end: End::Frames(30), size, style, drawing: Drawing::Nothing, png: None, depth: None, film: None };
//! let outcome = play_headless(Session::open(scene, Pace::RealTime).unwrap(), plan, &mut |_, _| true).unwrap();
//! assert_eq!((outcome.frames.len(), outcome.agents.len()), (30, 1));
//! assert!((outcome.sim_s - 0.5).abs() < 0.02); // 30 frames at 60 Hz, to a frame
//! assert!(outcome.adapter.is_none());
//! ```
mod agent_experiment;
mod assemble;
#[cfg(feature = "picture")]
pub mod calibrate;
#[cfg(test)]
mod checkpoint_tests;
mod coupling_record;
mod cpu_budget;
mod drawn_form;
mod elsewhere;
mod error;
mod error_control;
mod event_record;
mod experiment;
#[cfg(feature = "picture")]
mod film;
pub mod fit;
#[cfg(feature = "picture")]
mod fly_through;
mod governor;
mod headless;
mod integrator_cost;
mod outcome;
mod parameter_sweep;
mod reference_run;
pub mod report;
mod session;
mod step_response;
mod trace;
mod visible_resolution;
mod world_view;

pub use agent_experiment::{AgentExperiment, AgentResponse, agent_experiment};
pub use assemble::law;
pub use coupling_record::Coupling;
pub use error::SessionError;
pub use error_control::ToleranceStatus;
pub use event_record::{Event, Sensing};
pub use experiment::{Design, Experiment, ExperimentResult, experiment};
#[cfg(feature = "picture")]
pub use fly_through::FlyThrough;
#[cfg(feature = "picture")]
pub use headless::draw_frame;
pub use headless::{Drawing, End, Headless, PictureFormat, play_headless};
pub use integrator_cost::solve_prices;
pub use outcome::{AgentOutcome, FrameRecord, Outcome, ProbeOutcome};
pub use parameter_sweep::{Played, Point, apply, method_of, play_points, setting_of};
pub use reference_run::{PairError, ReferenceComparison, compare_with_reference};
pub use session::{Finished, REWIND_BYTES, RewindStatus, Session};
pub use step_response::{After, Pushes, median, push};
pub use trace::Trace;
pub use world_view::WorldView;
