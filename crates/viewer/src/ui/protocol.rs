//! The interface between the window and the program: data shown, and actions requested.
//!
//! In: a [`Simulation`], implemented where the program's parts are joined. Out: [`Action`]s, and a [`ViewRequest`] for each frame.
//! Never here: egui, a window, the runtime. The viewer knows the rest of metachron through these types only.

use glam::DVec3;
use metachron_core::{AgentId, Resolution, SimTime, SolveLevel};
pub use metachron_lod::control::Law;
use metachron_lod::cost::benefit::Sliders;
use metachron_render::{Camera, Hit, Picture, Ray, Size, Style, ToolForce};
pub use metachron_runtime::AgentState;
use metachron_session::RewindStatus;
use std::path::PathBuf;
use std::time::Duration;

/// Supplies the window with its content and applies the user's actions.
///
/// No call may wait for an agent: the thread that makes these calls draws the window.
pub trait Simulation {
    /// Applies a user action.
    fn apply(&mut self, action: Action);

    /// Gathers the newest states, chooses a level for each object and returns the picture to draw.
    fn compose(&mut self, view: &ViewRequest) -> &Picture;

    /// Called while the adapter draws the picture of this request: CPU time that can be used to prepare the next picture.
    fn while_drawn(&mut self, _view: &ViewRequest) {}

    /// Receives the times of the finished frame.
    fn measured(&mut self, times: &FrameTimes);

    /// The numbers of the panels, as of the last frame.
    fn status(&self) -> &Status;

    /// Passes on the turns that an agent has made since this was called for it last; from the first call on its newest ones are kept.
    fn turns(&mut self, _of: AgentId, _take: &mut dyn FnMut(TurnRow)) {}

    /// The scene's own camera at present.
    fn scene_camera(&self) -> Camera;

    /// The nearest movable object on `ray`.
    fn pick(&self, ray: Ray) -> Option<Hit>;

    /// A bounding ball of one object, or of every movable object; `None` where nothing is drawn.
    fn bounds(&self, of: Option<AgentId>) -> Option<Bounds>;

    /// The camera predicted for the time at which the next picture is finished.
    fn predict_camera(&mut self, camera: Camera) -> Camera {
        camera
    }

    /// Called with the adapter's name each time a device is made; `_on_processor` is true for a software rasteriser.
    fn drawn_by(&mut self, _adapter: &str, _on_processor: bool) {}

    /// Whether the run has ended and the window should close by itself; polled many times a second, hidden or not.
    fn wants_close(&mut self) -> bool {
        false
    }
}

/// An action requested by the user.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Run the simulation.
    Run,
    /// Pause the simulation.
    Pause,
    /// Pause and advance by one frame.
    SingleStep,
    /// Use the camera of the scene with this number in [`Status::cameras`].
    Camera(usize),
    /// Look at a moment of the past, or return from it.
    Look(Look),
    /// Restart the scene from its initial state.
    Reset,
    /// Reload the scene file and start it.
    Reload,
    /// Simulated seconds per second of wall time, > 0.
    Speed(f64),
    /// Target frames per second, > 0.
    TargetFps(f64),
    /// The policy that chooses levels, by name; one of [`Status::policies`].
    Policy(String),
    /// The feedback law and its gains.
    Law(Law),
    /// The weights of the factors in the benefit of a level.
    Sliders(Sliders),
    /// Freeze all levels, or let them be chosen again.
    Freeze(bool),
    /// Search better gains of the feedback law for this scene and this machine, and apply them.
    Tune,
    /// Stop the search; the gains stay unchanged.
    StopTuning,
    /// Attach the user spring to an object.
    DragStart(Hit),
    /// Move the free end of that spring to this point, metres.
    DragMove(DVec3),
    /// Release the spring.
    DragEnd,
    /// Select an object, or none.
    Select(Option<AgentId>),
    /// The pressure of an object's filling.
    Pressure {
        /// The object.
        agent: AgentId,
        /// Inside minus outside, Pa, finite.
        pressure_pa: f64,
    },
    /// Load the scene file that was dropped on the window.
    OpenScene(PathBuf),
}

/// The kept moment to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// The last one that is not later than this.
    At(SimTime),
    /// The one before.
    Back,
    /// The one after.
    Forward,
    /// The present.
    Live,
}

/// One frame to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewRequest {
    /// The picture's size; neither side is zero.
    pub size: Size,
    /// Its camera.
    pub camera: Camera,
    /// Its drawing options.
    pub style: Style,
}

/// A bounding ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Its centre, metres.
    pub centre: DVec3,
    /// Its radius in metres, > 0.
    pub radius_m: f64,
}

/// The state of the user spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandStatus {
    /// Position of the spring's free end, metres.
    pub target: DVec3,
    /// The force on the object in newtons, ≥ 0.
    pub force_n: f64,
}

/// Times of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameTimes {
    /// Gathering states and choosing levels.
    pub compose: Duration,
    /// Drawing the picture, on the CPU.
    pub draw: Duration,
    /// Drawing the picture, on the GPU, where it has time stamps.
    pub draw_gpu: Option<Duration>,
    /// Panels and plots, as measured in the frame before.
    pub panels: Duration,
    /// Presentation, where the CPU does it: a recent estimate.
    pub present: Duration,
    /// All work of the frame until the picture was finished: the controlled variable of the feedback law.
    pub work: Duration,
    /// From the start of the previous frame to the start of this one.
    pub interval: Duration,
    /// Reason to exclude this frame from feedback, if any.
    pub skip: Option<Skip>,
}

/// Reasons why a frame's times do not characterise the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Skip {
    /// The first frames of a device: shaders are compiled, buffers grow.
    WarmUp,
    /// The picture changed its size.
    Resized,
    /// The window was hidden before this frame.
    Hidden,
    /// The simulation is paused.
    Still,
}

/// The numbers of the panels.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// The scene's name.
    pub scene: String,
    /// Simulated time of the picture.
    pub sim_time: SimTime,
    /// The moments that can be looked at; `None` before there is one.
    pub rewind: Option<RewindStatus>,
    /// Whether the simulation runs.
    pub running: bool,
    /// Requested simulated seconds per second of wall time, > 0.
    pub speed: f64,
    /// Simulated seconds stepped per second of wall time, of the slowest agent, ≥ 0.
    pub real_time_factor: f64,
    /// Target frames per second, > 0.
    pub target_hz: f64,
    /// The executor that runs the agents.
    pub executor: String,
    /// The policy that chooses levels.
    pub policy: String,
    /// The names of all policies.
    pub policies: Vec<String>,
    /// The feedback law and its gains; `None` where the policy has none.
    pub law: Option<Law>,
    /// The weights of the factors in the benefit of a level; `None` where the policy does not weigh levels.
    pub sliders: Option<Sliders>,
    /// Whether the policy uses the slider of hysteresis.
    pub damped: bool,
    /// Whether levels are frozen.
    pub frozen: bool,
    /// Division of the time.
    pub shares: Shares,
    /// Progress of the search for better gains; `None` while none runs.
    pub tuning: Option<Tuning>,
    /// Every law with its default gains, or the scene's own where given.
    pub laws: Vec<Law>,
    /// The state variable of the feedback loop, for the plots.
    pub loop_value: Option<f64>,
    /// Message that the controller is at a limit, and at which.
    pub clamp: Option<String>,
    /// Triangles in the last picture.
    pub triangles: u64,
    /// Objects of that picture: potentially visible, visible, drawn; each part of the one before.
    pub objects: [u64; 3],
    /// Fraction of its width and height that it was drawn with, 0 … 1.
    pub render_scale: f64,
    /// Whether shadows are drawn in it, where the light throws any.
    pub shadows: bool,
    /// Total mechanical energy, joules.
    pub energy_j: f64,
    /// Hash of every agent's state, where the run computes one.
    pub state_hash: Option<u64>,
    /// The selected object.
    pub selected: Option<AgentId>,
    /// The user spring while attached.
    pub held: Option<HandStatus>,
    /// One row for each agent, in the scene's order.
    pub agents: Vec<AgentRow>,
    /// The names of the scene's cameras.
    pub cameras: Vec<String>,
    /// The number of the one that is used.
    pub camera: usize,
    /// The drawing of contact forces; `None` where they are not drawn.
    pub forces: Option<Forces>,
    /// The couplings between agents at present.
    pub couplings: Vec<CouplingRow>,
    /// Messages for the user, oldest first.
    pub messages: Vec<Message>,
}

/// The scale of contact forces, and the forces on tools.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Forces {
    /// Metres that the arrow of one newton has; 0 before any was drawn.
    pub scale_m_per_n: f64,
    /// The wrench on each tool.
    pub tools: Vec<ToolForce>,
}

/// A search for better gains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tuning {
    /// The fraction done, 0 … 1.
    pub done: f64,
    /// The present stage, or the best gains so far.
    pub words: String,
}

/// Recent division of the time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shares {
    /// Fraction of all cores that agents work on, 0 … 1.
    pub simulation: f64,
    /// Gathering states and culling, as a fraction of the time of a frame.
    pub cull: f64,
    /// Choosing levels, likewise.
    pub select: f64,
    /// Making the picture and drawing it, likewise.
    pub draw: f64,
    /// All other work of a frame: panels, presenting.
    pub rest: f64,
}

/// A coupling of two agents in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct CouplingRow {
    /// The name of the agent that owns the coupling.
    pub a: String,
    /// The name of the peer.
    pub b: String,
    /// Its law.
    pub kind: &'static str,
    /// Number of contact or attachment points.
    pub contacts: u32,
    /// Mean force of the owner's last step, newtons, ≥ 0.
    pub force_n: f64,
    /// The deepest overlap, metres, ≥ 0.
    pub penetration_m: f64,
    /// Inverse effective mass of each along the normal at the contact with the largest force, 1/kg, where a contact was solved.
    pub inverse_mass_per_kg: Option<[f64; 2]>,
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
    /// Requested steps per second, ≥ 0.
    pub wanted_hz: f64,
    /// Measured steps per second, ≥ 0.
    pub rate_hz: f64,
    /// Step length in simulated seconds, ≥ 0.
    pub dt_s: f64,
    /// Resolution of the simulation.
    pub simulation: Option<Resolution>,
    /// Number of nodes of the simulation; `None` for a model without nodes.
    pub nodes: Option<u32>,
    /// Resolution of the picture.
    pub picture: Option<Resolution>,
    /// Age of the displayed state, seconds, ≥ 0.
    pub age_s: f64,
    /// Wall time of a step, seconds, ≥ 0.
    pub step_s: f64,
    /// Share of one core, 0 … 1.
    pub cpu_share: f64,
    /// Simulated time that was dropped since the start because it could not be caught up, seconds, ≥ 0.
    pub dropped_s: f64,
    /// The agent's estimate of its own error, metres, ≥ 0.
    pub residual_m: f64,
    /// The force that acts on a tool, newtons.
    pub force_n: Option<f64>,
    /// The name of the host that steps it, where several step the world.
    pub host: Option<String>,
    /// The pressure of its filling; `None` of an agent that has no inside.
    pub filled: Option<Filled>,
    /// The agent that steps it as a member of its cluster.
    pub led_by: Option<String>,
    /// The leader of its cluster, itself included; `None` of an agent that is alone.
    pub leader: Option<AgentId>,
    /// How the contacts of the cluster that it leads were solved last.
    pub contact: Option<ContactSolve>,
    /// Present activity.
    pub state: AgentState,
}

/// How the contacts of a cluster were solved in its last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSolve {
    /// The dearest level of a solve.
    pub level: SolveLevel,
    /// Factors of all solves.
    pub factors: u32,
    /// The greatest miss of the laws of contact and momentum, m/s.
    pub miss_m_s: f64,
    /// The deepest overlap, metres.
    pub depth_m: f64,
}

/// A turn of an agent: a step, or a wait for others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnRow {
    /// Wall time at which it began, seconds since the start; virtual in lockstep.
    pub begun_s: f64,
    /// Wall time at which it ended, likewise.
    pub ended_s: f64,
    /// The agent's own time at its end.
    pub time: SimTime,
    /// Its step in simulated seconds; 0 of a turn in which it only waited.
    pub dt_s: f64,
    /// The spacing ε that it was simulated at, metres; `None` of a model that has none.
    pub eps_m: Option<f64>,
    /// The agent whose turn it was: the leader of its cluster, or itself.
    pub leader: AgentId,
    /// How late it began, seconds of wall time, ≥ 0.
    pub late_s: f64,
    /// The simulated time that was given up before it, because it began too late, seconds, ≥ 0.
    pub dropped_s: f64,
}

/// The pressure of an object's filling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filled {
    /// The one that it started with or was set last, inside minus outside, Pa.
    pub pressure_pa: f64,
    /// The end of the slider for it, Pa, > 0.
    pub most_pa: f64,
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
            nodes: None,
            picture: None,
            age_s: 0.0,
            step_s: 0.0,
            cpu_share: 0.0,
            dropped_s: 0.0,
            residual_m: 0.0,
            force_n: None,
            host: None,
            filled: None,
            contact: None,
            led_by: None,
            leader: None,
            state: AgentState::Running,
        }
    }
}

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Information.
    Note,
    /// A request could not be fulfilled as given.
    Warning,
    /// Something failed.
    Failure,
}

/// A message for the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Severity.
    pub severity: Severity,
    /// The text.
    pub text: String,
}
