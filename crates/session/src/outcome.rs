//! Results of a run: every frame, every agent, every probe.
//!
//! In: a session that has ended. Out: an [`Outcome`]. Never here: statistics (the report makes them), files.

use super::coupling_record::Coupling;
use super::error::SessionError;
use super::error_control::ToleranceStatus;
use super::event_record::{Event, Sensing};
use super::trace::Trace;
use glam::DVec3;
use metachron_core::{ClusterState, Resolution};
use metachron_runtime::{AgentStats, Sample};
use metachron_world::Reading;
use serde::Serialize;
use std::sync::Arc;

/// One frame: a row of `--frames-csv`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct FrameRecord {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// Simulated time it shows, seconds.
    pub sim_s: f64,
    /// Work of the frame, milliseconds: gather, choose, draw, adapter; virtual in lockstep.
    pub frame_ms: f64,
    /// The adapter's own time for the newest frame that it has reported, milliseconds; `None` where it has no time stamps.
    pub gpu_ms: Option<f64>,
    /// From the start of the previous frame to the start of this one, milliseconds; the target's for the first frame.
    pub interval_ms: f64,
    /// Estimated time of drawing everything at its finest, milliseconds, by the declared machine's price of a triangle.
    pub full_ms: f64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Objects in view: of the potentially visible ones the objects that are seen in the part of the frustum that
    /// portals leave.
    pub objects: u64,
    /// Objects in cells that the eye reaches through portals, and objects in no cell in view.
    pub potentially_visible: u64,
    /// Objects in view that are drawn: as themselves, not left out and not replaced by an impostor.
    pub drawn: u64,
    /// Gathering states and finding visible objects, milliseconds; declared in lockstep, as is choosing.
    pub cull_ms: f64,
    /// Choosing levels, milliseconds; with a bounded lag the next frame's, during the drawing of this one.
    pub select_ms: f64,
    /// Making the picture and drawing it, milliseconds.
    pub draw_ms: f64,
    /// From where the camera was read to the finished picture, milliseconds.
    pub lag_ms: f64,
    /// Time of the frame as predicted by the policy, milliseconds; `None` of a policy without a prediction.
    pub predicted_ms: Option<f64>,
    /// Value of the choice over its upper bound; `None` of a policy without a certificate.
    pub value_over_bound: Option<f64>,
    /// Objects in view whose level differs from that of the previous frame.
    pub changes: u32,
    /// Of these, objects that are back at a level which they had two or three frames before.
    pub reversals: u32,
    /// Objects in view that were left out for lack of time.
    pub holes: u32,
    /// Passes of a search that goes on from the frame before; 0 for other policies.
    pub passes: u32,
    /// The loop's ε̂ = 40·ε/L of the printed law, or the corrected law's scene-wide ε in metres.
    pub eps: f64,
    /// Mean level n of the tubes in view, else of everything in view.
    pub n: f64,
    /// Fraction of its width and height that the picture was drawn with.
    pub render_scale: f64,
    /// Whether objects threw shadows in it, where the light does.
    pub shadows: bool,
    /// Pieces of objects drawn as points.
    pub points: u64,
    /// Pieces of objects drawn as lines.
    pub lines: u64,
    /// Objects drawn with one colour a triangle.
    pub flat: u32,
    /// Objects drawn with colours at vertices.
    pub gouraud: u32,
    /// Objects drawn with light at every pixel.
    pub per_pixel: u32,
    /// Objects drawn with light at every pixel and their texture.
    pub textured: u32,
    /// Objects drawn with soft shadows besides.
    pub shadowed: u32,
}

/// A probe's point at the end of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeOutcome {
    /// The object's name.
    pub object: String,
    /// Share of its rest length.
    pub at: f64,
    /// Position, metres.
    pub position: DVec3,
    /// Velocity, m/s.
    pub velocity: DVec3,
    /// Time and position of the first state at or after every multiple of the probe's period.
    pub samples: Option<Vec<Sample>>,
}

/// An agent at the end of the run, with the resolution of its picture.
#[derive(Debug, Clone)]
pub struct AgentOutcome {
    /// Its statistics.
    pub stats: AgentStats,
    /// Simulated time that it has not lived, seconds: its dropped time, and its lag at the end.
    pub given_up_s: f64,
    /// The resolution it was last drawn at; `None` where it has no picture.
    pub picture: Option<Resolution>,
    /// How it meets its error tolerance; `None` without one.
    pub tolerance: Option<ToleranceStatus>,
}

/// A run that has ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The scene's name.
    pub scene: String,
    /// The policy that chose levels.
    pub policy: &'static str,
    /// The feedback law.
    pub law: &'static str,
    /// The executor.
    pub executor: &'static str,
    /// How time passed at the end: `free` where it waited for agents, else `real-time`, whatever its speed.
    pub pace: &'static str,
    /// The adapter that drew; `None` where nothing was drawn.
    pub adapter: Option<String>,
    /// Target time of a frame, milliseconds.
    pub target_ms: f64,
    /// Frames drawn in all.
    pub finished: u64,
    /// Every frame of a run with an end; of one without, the newest ([`crate::Session::keep_frames`]).
    pub frames: Vec<FrameRecord>,
    /// Warm-up frames, from which the controller does not learn (the first ones): left out of the statistics of frame times.
    pub warm_up: usize,
    /// Simulated time, seconds.
    pub sim_s: f64,
    /// Wall time before real time begins to pass, seconds: an adapter is opened and measured, a first picture drawn.
    pub start_up_s: f64,
    /// Wall time from then on, seconds; virtual in lockstep.
    pub wall_s: f64,
    /// CPU time of all agents' turns, seconds; measured, in lockstep too.
    pub cpu_s: f64,
    /// Hash of all final states.
    pub state_hash: u64,
    /// All agents.
    pub agents: Vec<AgentOutcome>,
    /// All couplings.
    pub couplings: Vec<Coupling>,
    /// Events of attachments, in the order of time.
    pub events: Vec<Event>,
    /// Touches of sensors.
    pub sensors: Vec<Sensing>,
    /// The reading of each sensor of the scene at the end; `None` where its object has gone.
    pub readings: Vec<Option<Reading>>,
    /// Each agent's part in the contact cluster that it was stepped in last.
    pub clusters: Vec<Option<ClusterState>>,
    /// States of the agents over time, if requested ([`crate::Session::keep_trace`]).
    pub trace: Option<Trace>,
    /// All probes.
    pub probes: Vec<ProbeOutcome>,
    /// Message if the controller rested on a limit at the end: which one.
    pub clamp: Option<String>,
    /// Whether the drawing costs of the adapter could not be measured, so that default prices were used.
    pub unpriced: bool,
    /// Whether the user ended the run before its end.
    pub interrupted: bool,
    /// Why the run ended before its end, where the user did not end it: a recording, film or picture could not be written, a world elsewhere
    /// did not answer, or its time stood.
    pub cut_off: Option<Arc<SessionError>>,
    /// Warnings about its figures and pictures ([`crate::Session::notes`]).
    pub notes: Vec<String>,
}
