//! The boundary of the window: what it shows and what it can ask for.
//!
//! In: a [`Show`], implemented where the rooms are joined. Out: [`Action`]s, and a [`ViewRequest`] for each frame.
//! Never here: egui, a window, the runtime. The viewer knows the rest of metachron through these types only.

use super::super::{Camera, Hit, Picture, Ray, Size, Style};
use glam::DVec3;
use metachron_budget::cost::benefit::Sliders;
use metachron_core::{AgentId, Resolution, SimTime};
use std::path::PathBuf;
use std::time::Duration;

/// What the window shows and what it can ask for.
///
/// No call may wait for an agent: the window is drawn by the thread that makes these calls.
pub trait Show {
    /// Applies what the user asked for.
    fn apply(&mut self, action: Action);

    /// Gathers the newest states, chooses a level for each object and gives the picture to draw.
    fn compose(&mut self, view: &ViewRequest) -> &Picture;

    /// Called while the adapter draws what was composed for this request: there is time for the next picture's sake until it is drawn.
    fn while_drawn(&mut self, _view: &ViewRequest) {}

    /// Takes the finished frame's measured work.
    fn measured(&mut self, times: &FrameTimes);

    /// The numbers of the panels, as of the last frame.
    fn status(&self) -> &Status;

    /// Where the scene's own camera is now.
    fn scene_camera(&self) -> Camera;

    /// The nearest movable object on `ray`.
    fn pick(&self, ray: Ray) -> Option<Hit>;

    /// A ball around one object, or around every movable object; `None` where there is nothing to see.
    fn bounds(&self, of: Option<AgentId>) -> Option<Bounds>;

    /// Where a camera will be when the picture that is drawn next is finished.
    fn ahead(&mut self, camera: Camera) -> Camera {
        camera
    }

    /// Told who draws, each time a device is made.
    fn drawn_by(&mut self, _adapter: &str, _on_processor: bool) {}

    /// Whether the run has ended and the window should close by itself; asked many times a second, hidden or not.
    fn wants_close(&mut self) -> bool {
        false
    }
}

/// What the user asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Let simulated time pass.
    Run,
    /// Hold simulated time.
    Pause,
    /// Hold simulated time and advance it by one frame.
    SingleStep,
    /// Start the scene again from its first state.
    Reset,
    /// Read the scene file again and start it.
    Reload,
    /// Simulated seconds for each second of wall time, > 0.
    Speed(f64),
    /// Wanted frames per second, > 0.
    TargetFps(f64),
    /// The policy that chooses levels, by name; one of [`Status::policies`].
    Policy(String),
    /// The feedback law and its gains.
    Law(Law),
    /// How much each factor counts in what a level is worth.
    Sliders(Sliders),
    /// Keep all levels as they are, or let them be chosen again.
    Freeze(bool),
    /// Look for better gains of the feedback law on this scene and this machine, and take them.
    Tune,
    /// Stop looking and go on as before.
    StopTuning,
    /// Take hold of an object with a spring.
    DragStart(Hit),
    /// Move the free end of that spring to this point, metres.
    DragMove(DVec3),
    /// Let go.
    DragEnd,
    /// Mark an object, or none.
    Select(Option<AgentId>),
    /// Load the scene file that was dropped on the window.
    OpenScene(PathBuf),
}

/// The picture's feedback law and its gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// The law as printed (GDC04, eq. 1), on ε̂ = 40 ε/L.
    Printed {
        /// α: change of ε̂ for each frame per second that is missing, > 0.
        alpha: f64,
        /// β: change of ρ for each unit of ε̂, > 0.
        beta: f64,
    },
    /// The law on the logarithm of the measured time, whose gain no machine changes.
    Corrected {
        /// κ, 0.01 … 0.99: the share of an error that one frame removes.
        kappa: f64,
        /// λ, 0 … 0.99: the share of an error's change that one frame adds; above 0 it is a PI law that cannot wind up.
        lead: f64,
        /// Share of the frame's time that is left free, 0 … 0.9.
        margin: f64,
    },
}

/// One frame to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewRequest {
    /// The picture's size; neither side is zero.
    pub size: Size,
    /// What it is seen through.
    pub camera: Camera,
    /// How it is drawn.
    pub style: Style,
}

/// A ball around something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Its centre, metres.
    pub centre: DVec3,
    /// Its radius in metres, > 0.
    pub radius_m: f64,
}

/// The hand's spring as it is now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Where the free end of the spring is, metres.
    pub target: DVec3,
    /// The force on the object in newtons, ≥ 0.
    pub force_n: f64,
}

/// Where the time of a frame went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameTimes {
    /// Gathering states and choosing levels.
    pub compose: Duration,
    /// Drawing the picture, on the CPU.
    pub draw: Duration,
    /// Drawing the picture, on the adapter, where it has timestamps.
    pub draw_gpu: Option<Duration>,
    /// Panels and plots, as measured in the frame before.
    pub panels: Duration,
    /// Showing what was drawn, where the processor does it: as it was lately.
    pub present: Duration,
    /// All work of the frame until the picture was finished: what the controller holds at its set point.
    pub work: Duration,
    /// From the start of the frame before to the start of this one.
    pub interval: Duration,
    /// Why this frame must teach a controller nothing.
    pub skip: Option<Skip>,
}

/// Why a frame's times say nothing about the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Skip {
    /// The first frames of a device: shaders are compiled, buffers grow.
    WarmUp,
    /// The picture changed its size.
    Resized,
    /// The window was hidden before this frame.
    Hidden,
    /// Simulated time stands still.
    Still,
}

/// The numbers of the panels.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// The scene's name.
    pub scene: String,
    /// Simulated time of the picture.
    pub sim_time: SimTime,
    /// Whether simulated time passes.
    pub running: bool,
    /// Wanted simulated seconds for each second of wall time, > 0.
    pub speed: f64,
    /// Simulated seconds that were stepped for each second of wall time, by the agent that keeps up least, ≥ 0.
    pub real_time_factor: f64,
    /// Wanted frames per second, > 0.
    pub target_hz: f64,
    /// Which executor runs the agents.
    pub executor: String,
    /// The policy that chooses levels.
    pub policy: String,
    /// The names a policy can have.
    pub policies: Vec<String>,
    /// The feedback law and its gains; `None` where the policy has none.
    pub law: Option<Law>,
    /// How much each factor counts in what a level is worth; `None` where the policy does not weigh levels.
    pub sliders: Option<Sliders>,
    /// Whether the policy heeds the slider of hysteresis.
    pub damped: bool,
    /// Whether levels are kept as they are.
    pub frozen: bool,
    /// Where the time goes.
    pub shares: Shares,
    /// How far the search for better gains is; `None` while nobody looks for any.
    pub tuning: Option<Tuning>,
    /// Every law with its default gains; the scene's own where it gives them.
    pub laws: Vec<Law>,
    /// The loop's variable as its law keeps it, for the plots.
    pub loop_value: Option<f64>,
    /// Says that the controller rests on a limit, and on which.
    pub clamp: Option<String>,
    /// Triangles in the last picture.
    pub triangles: u64,
    /// Total mechanical energy, joules.
    pub energy_j: f64,
    /// Hash of every agent's state, where the run keeps one.
    pub state_hash: Option<u64>,
    /// The marked object.
    pub selected: Option<AgentId>,
    /// The hand's spring while it holds something.
    pub held: Option<Held>,
    /// One row for each agent, in the scene's order.
    pub agents: Vec<AgentRow>,
    /// What agents do to each other now.
    pub couplings: Vec<CouplingRow>,
    /// What the user should know, oldest first.
    pub messages: Vec<Message>,
}

/// A search for better gains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tuning {
    /// The share that is done, 0 … 1.
    pub done: f64,
    /// What it does now, or the best so far.
    pub words: String,
}

/// Where the time goes, lately.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shares {
    /// Share of all cores that agents work on, 0 … 1.
    pub simulation: f64,
    /// Gathering states and finding what is seen, as a part of the time of a frame.
    pub cull: f64,
    /// Choosing levels.
    pub select: f64,
    /// Making the picture and drawing it.
    pub draw: f64,
    /// Everything else that is work of a frame: panels, presenting.
    pub rest: f64,
}

/// A coupling of two agents in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct CouplingRow {
    /// The name of the agent that owns it.
    pub a: String,
    /// The name of the other.
    pub b: String,
    /// Its law.
    pub kind: &'static str,
    /// Places that touch or are held.
    pub contacts: u32,
    /// Mean force of the owner's last step, newtons, ≥ 0.
    pub force_n: f64,
    /// The deepest overlap, metres, ≥ 0.
    pub penetration_m: f64,
    /// How easily each gave way along the normal where it bore most, 1/kg, where a contact was solved.
    pub inverse_mass_per_kg: Option<[f64; 2]>,
    /// What is left in its energy tank, joules, where it has one.
    pub tank_j: Option<f64>,
}

/// What an agent does now.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AgentState {
    /// It steps.
    #[default]
    Running,
    /// It sleeps until something touches it.
    Resting,
    /// It was stopped, for this reason.
    Parked(String),
}

/// One agent in numbers.
#[derive(Debug, Clone)]
pub struct AgentRow {
    /// Its number.
    pub id: AgentId,
    /// The object's name.
    pub name: String,
    /// The model's name.
    pub model: String,
    /// Wanted steps per second, ≥ 0.
    pub wanted_hz: f64,
    /// Measured steps per second, ≥ 0.
    pub rate_hz: f64,
    /// Step length in simulated seconds, ≥ 0.
    pub dt_s: f64,
    /// Resolution of the simulation.
    pub simulation: Option<Resolution>,
    /// Resolution of the picture.
    pub picture: Option<Resolution>,
    /// Age of the state that was drawn, seconds, ≥ 0.
    pub age_s: f64,
    /// Wall time of a step, seconds, ≥ 0.
    pub step_s: f64,
    /// Share of one core, 0 … 1.
    pub cpu_share: f64,
    /// Simulated time that could not be made up since the start, seconds, ≥ 0.
    pub dropped_s: f64,
    /// The agent's estimate of its own error, metres, ≥ 0.
    pub residual_m: f64,
    /// The force that acts on a tool, newtons.
    pub force_n: Option<f64>,
    /// Whose clock it keeps while it shares a world with others.
    pub led_by: Option<String>,
    /// What it does now.
    pub state: AgentState,
}

impl AgentRow {
    /// A row without numbers yet.
    #[must_use]
    pub fn new(id: AgentId, name: impl Into<String>, model: impl Into<String>) -> Self {
        Self {
            id,
            name: name.into(),
            model: model.into(),
            wanted_hz: 0.0,
            rate_hz: 0.0,
            dt_s: 0.0,
            simulation: None,
            picture: None,
            age_s: 0.0,
            step_s: 0.0,
            cpu_share: 0.0,
            dropped_s: 0.0,
            residual_m: 0.0,
            force_n: None,
            led_by: None,
            state: AgentState::Running,
        }
    }
}

impl Law {
    /// Whether `other` is the same law, with any gains.
    #[must_use]
    pub fn is_same_law(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }
}

/// How much a message matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Weight {
    /// Good to know.
    Note,
    /// Something is not as it was asked for.
    Warning,
    /// Something failed.
    Failure,
}

/// A line for the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// How much it matters.
    pub weight: Weight,
    /// What to say.
    pub text: String,
}
