//! A running scene: the runtime, the controller and the scene view of one run, connected.
//!
//! A frame is [`Session::compose`] (gather, survey, choose), drawing by the caller, and [`Session::finish`] (measure, learn).
//! Never here: windows, files, arguments.

mod ahead;
mod cameras;
mod choose;
mod elsewhere;
mod gather;
mod limit;
mod pace;
mod record;
mod recording;
mod rewind;

use super::assemble;
use super::assemble::Governors;
#[cfg(feature = "picture")]
use super::calibrate;
use super::coupling_record::{Coupling, Couplings};
use super::cpu_budget::CpuBudget;
use super::elsewhere::Elsewhere;
use super::error::SessionError;
use super::error_control;
use super::error_control::ErrorStatus;
use super::event_record::{events, sensed};
use super::outcome::{AgentOutcome, FrameRecord, Outcome};
use super::trace::Trace;
use super::visible_resolution::VisibleResolution;
use cpu_time::ThreadTime;
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, SimTime};
use metachron_lod::control::{FrameWork, Law, ObjectView, PictureControl, Prices};
#[cfg(feature = "picture")]
use metachron_render::Gpu;
use metachron_render::{Camera, Level, Picture, SceneView};
use metachron_runtime::{AgentHandle, Agents, Command, Keyed, Machine, Reader};
use metachron_world::kinds::{ExecutorKind, LawKind};
use metachron_world::{Govern, Pace, Scene, World, WorldError, machine};
use rewind::Rewind;
pub use rewind::{REWIND_BYTES, RewindStatus};
use std::sync::Arc;
use std::time::Duration;

/// A running scene.
pub struct Session {
    scene: Scene,
    machine: Machine,
    /// Drawing costs on the declared machine.
    declared: Prices,
    world: World,
    /// The world that this one shows, where it runs elsewhere.
    elsewhere: Option<Elsewhere>,
    scene_view: SceneView,
    control: PictureControl,
    /// Whether pictures are drawn on the processor that agents step on.
    shares_processor: bool,
    cpu_budget: CpuBudget,
    /// Seconds of a core that the frame loop takes a frame beside an adapter, smoothed; and the CPU time of its thread at the last frame.
    frame_cpu_s: f64,
    thread_time: Option<Duration>,
    error_statuses: Vec<Arc<ErrorStatus>>,
    visible_resolution: VisibleResolution,
    reader: Reader,
    views: Vec<ObjectView>,
    /// The fixed part of every actor's description.
    fixed_parts: Vec<assemble::FixedPart>,
    levels: Vec<Level>,
    couplings: Couplings,
    trace: Option<Trace>,
    /// Moments that can be shown again, if any are kept.
    rewind: Option<Rewind>,
    /// Which of the scene's cameras is used.
    camera: usize,
    records: Vec<FrameRecord>,
    chosen: Chosen,
    last_start: Option<Duration>,
    /// When agents' processor time was last read, and its value then, seconds.
    agents_cpu: (Duration, f64),
    /// Time and position of the camera at its last reading.
    last_camera: Option<(Duration, Camera)>,
    /// When the last picture began, and the camera that saw it.
    last_seen_by: Option<(Duration, Camera)>,
    /// Predicted camera of the next frame at the time when its picture is finished.
    next_camera: Option<Camera>,
    /// Time from reading the camera to the finished picture, seconds, smoothed.
    lag_s: f64,
    /// Time of a choice, seconds, smoothed.
    choice_s: f64,
    /// When real time began to pass.
    begun: Duration,
    warm_up: usize,
    finished: u64,
    keep: usize,
    /// Whether default drawing prices replace the adapter's.
    unpriced: bool,
    /// Receives a line if start-up takes long.
    report_progress: fn(&str),
}

/// Times of a finished frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Finished {
    /// All work of the frame until its picture was finished.
    pub work: Duration,
    /// The part of it spent drawing the composed picture.
    pub draw: Duration,
    /// The adapter's own time for the newest frame that it has reported; `None` where it has no time stamps.
    pub gpu: Option<Duration>,
    /// Whether the controller must not learn from it.
    pub skip: bool,
}

/// Load of the last composition on the adapter, and its times.
#[derive(Debug, Clone, Copy, Default)]
struct Chosen {
    sim: SimTime,
    triangles: u64,
    more_triangles: f64,
    /// Gathering states and finding visible objects.
    cull: Duration,
    /// Choosing levels before the picture is made.
    select: Duration,
    /// Choosing the next frame's levels during the drawing of this one.
    select_next: Option<Duration>,
    /// Making the picture at these levels.
    build: Duration,
    /// Triangles without a chosen level: fixed solids, the floor, the caps of tubes.
    other_triangles: f64,
    objects: u64,
    potentially_visible: u64,
    drawn: u64,
    /// Time of the chosen objects on the declared machine, seconds.
    objects_s: f64,
    /// Mean level.
    n: f64,
}

/// First frames in real time, from which the controller does not learn: shaders are compiled, caches are cold.
const WARM_UP_FRAMES: u64 = 3;

/// The weight of a new measurement in the smoothed lag.
const LAG_NEWS: f64 = 0.2;

/// The weight of a new measurement in the smoothed CPU time of a frame.
const CPU_NEWS: f64 = 0.05;

/// Frames over which meshes blend to a new level.
const GEOMORPH_FRAMES: u8 = 6;

impl Session {
    /// Creates the agents of `scene`, whose time passes at `pace`; real time is held until [`Session::begin`].
    ///
    /// At [`Pace::Free`] no agent gives up time or makes longer steps than it was asked for; where time is real, each frame then waits for all
    /// agents, and is due a period of simulated time after the one before.
    ///
    /// # Errors
    /// [`SessionError::World`], also for a factor outside its range; nothing runs then.
    pub fn open(scene: Scene, pace: Pace) -> Result<Self, SessionError> {
        // nothing is known of this machine yet, and its first turns are to be in time
        let is_beside_a_clock = scene.executor != ExecutorKind::Lockstep && pace != Pace::Free;
        let governors = if is_beside_a_clock { Governors::from_coarsest(&scene) } else { Governors::of(&scene) };
        Self::open_as(scene, governors, |scene, govern| {
            let world = World::start_governed(scene, scene.executor, govern)?;
            // a world to which nothing was done is recorded without its state
            if pace != Pace::RealTime {
                world.set_pace(pace)?;
            }
            Ok(world)
        })
    }

    fn open_as(
        mut scene: Scene,
        mut governors: Governors,
        start: impl FnOnce(&Scene, Govern<'_>) -> Result<World, SessionError>,
    ) -> Result<Self, SessionError> {
        let machine = machine(&scene);
        let world = start(&scene, &mut |member| governors.governor(member))?;
        scene.executor = world.executor();
        let controlled = governors.controlled;
        let mut scene_view = assemble::scene_view(&scene);
        scene_view.set_geomorph_frames(GEOMORPH_FRAMES);
        Ok(Self {
            control: assemble::picture_control(&scene),
            shares_processor: scene.executor == ExecutorKind::Lockstep && !machine.graphics_card,
            visible_resolution: VisibleResolution::new(&controlled.budgets, &scene),
            cpu_budget: CpuBudget::new(controlled.budgets),
            frame_cpu_s: 0.0,
            thread_time: None,
            error_statuses: controlled.error_statuses,
            reader: Reader::new(world.agents()),
            scene_view,
            declared: assemble::prices(&machine.draw),
            machine,
            world,
            elsewhere: None,
            views: Vec::new(),
            fixed_parts: assemble::fixed_parts(&scene),
            levels: Vec::new(),
            couplings: Couplings::default(),
            trace: None,
            rewind: None,
            camera: 0,
            records: Vec::new(),
            chosen: Chosen::default(),
            last_start: None,
            agents_cpu: (Duration::ZERO, 0.0),
            last_camera: None,
            last_seen_by: None,
            next_camera: None,
            lag_s: 0.0,
            choice_s: 0.0,
            begun: Duration::ZERO,
            warm_up: 0,
            finished: 0,
            keep: usize::MAX,
            unpriced: false,
            report_progress: |_| {},
            scene,
        })
    }

    /// The scene being played.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Wall time since the start; virtual in lockstep.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.world.now()
    }

    /// Simulated time now.
    #[must_use]
    pub fn sim_now(&self) -> SimTime {
        self.world.time()
    }

    /// The world that is played.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// Whether time is virtual and costs are declared.
    #[must_use]
    pub fn is_virtual(&self) -> bool {
        self.scene.executor == ExecutorKind::Lockstep
    }

    /// Frames finished.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.finished
    }

    /// The newest stored frames, at most `count`.
    pub fn newest_frames(&self, count: usize) -> &[FrameRecord] {
        &self.records[self.records.len().saturating_sub(count)..]
    }

    /// Cores that agents and the frame loop share.
    pub fn cores(&self) -> u32 {
        let real = || std::thread::available_parallelism().map_or(1, |cores| cores.get() as u32);
        if self.is_virtual() { self.machine.cores.max(1) } else { real() }
    }

    /// Stores at least the newest `frames` frames from now on, and fewer than twice as many: for runs without an end.
    pub const fn keep_frames(&mut self, frames: usize) {
        self.keep = frames;
    }

    /// Target time between frames.
    #[must_use]
    pub fn period(&self) -> Duration {
        Duration::from_secs_f64(1.0 / self.control.target_hz())
    }

    /// The agents.
    #[must_use]
    pub fn agents(&self) -> &Agents {
        self.world.agents()
    }

    /// The controller of the picture.
    pub const fn control(&mut self) -> &mut PictureControl {
        &mut self.control
    }

    /// Reports a long start-up through `report`; without it nothing is reported.
    pub fn report_start_up(&mut self, report: fn(&str)) {
        self.report_progress = report;
    }

    #[cfg(feature = "picture")]
    /// Applies the prices of the adapter that draws, if they are known or can be measured; declared costs stay as they are. `on_processor`:
    /// the adapter draws on the processor.
    pub fn calibrate(&mut self, adapter: &str, on_processor: bool, open: impl FnOnce() -> Option<Gpu>) {
        self.shares_processor |= on_processor && !self.is_virtual();
        if self.control.policy().predicts() && !self.is_virtual() {
            let prices = calibrate::prices(adapter, open, self.report_progress);
            self.unpriced = prices.is_none();
            prices.into_iter().for_each(|prices| self.control.set_prices(prices));
        }
    }

    /// The name of the policy that chooses levels, as written in scenes.
    #[must_use]
    pub fn policy_name(&self) -> &'static str {
        self.control.policy().name()
    }

    /// Selects the policy by name; an unknown name changes nothing.
    pub fn set_policy(&mut self, name: &str) {
        if let Ok(policy) = name.parse() {
            self.control.set_policy(policy);
        }
    }

    /// The name of the feedback law, as written in scenes.
    #[must_use]
    pub fn law_name(&self) -> &'static str {
        match self.control.law() {
            Law::Printed { .. } => LawKind::Printed.name(),
            Law::Corrected { .. } => LawKind::Corrected.name(),
        }
    }

    /// The force between the user spring and an agent, newtons.
    #[must_use]
    pub fn hand_force_n(&self, on: AgentId) -> f64 {
        let Some(state) = self.reader.newest().get(on.0 as usize) else { return 0.0 };
        // nothing resists the driving of a tool; the force shown is its grasp force
        if let Some(tool) = state.body.tool() {
            return tool.force_n;
        }
        state.grips.iter().filter(|grip| grip.by.is_none()).map(|grip| grip.force_n.length()).sum()
    }

    /// All drawable objects.
    #[must_use]
    pub const fn scene_view(&self) -> &SceneView {
        &self.scene_view
    }

    /// The picture composed last.
    #[must_use]
    pub fn picture(&self) -> &Picture {
        self.scene_view.picture()
    }

    /// The objects last reported to control.
    #[must_use]
    pub fn views(&self) -> &[ObjectView] {
        &self.views
    }

    /// The level each agent was last drawn at, in their order.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Attaches the user spring to an agent, or releases it (`None`). An agent that does not exist gives an error.
    pub fn hand(&self, to: AgentId, pull: Option<AnchorSpring>) -> Result<(), WorldError> {
        let world = self.acted_on();
        world.command(world.object_of(to)?, Command::Spring(Keyed::first(pull)))
    }

    /// Sets the pressure of an agent's filling, inside minus outside, Pa. An agent that nothing fills or that does not
    /// exist and a number that is not finite give an error.
    pub fn set_pressure(&self, of: AgentId, pressure_pa: f64) -> Result<(), WorldError> {
        let world = self.acted_on();
        world.command(world.object_of(of)?, Command::pressure(pressure_pa))
    }

    /// Ends the frame that began at `started`.
    pub fn finish(&mut self, started: Duration, finished: Finished) -> FrameRecord {
        let Finished { work, skip, .. } = finished;
        let draw = finished.draw + self.chosen.build;
        let record = self.record(started, finished);
        let lag_s = 1e-3 * record.lag_ms;
        self.lag_s = if self.finished == 0 { lag_s } else { self.lag_s + LAG_NEWS * (lag_s - self.lag_s) };
        self.measure_thread();
        self.learn_choice();
        self.finished += 1;
        self.last_start = Some(started);
        let cold = !self.is_virtual() && self.finished <= WARM_UP_FRAMES;
        self.warm_up += usize::from(cold);
        self.store(record);
        let beside = self.logic_beside(draw);
        self.control.observe(FrameWork { work, draw, beside, skip: skip || cold });
        record
    }

    /// Learns the time of a core that a frame takes: CPU time of this thread where time is real, else the declared
    /// time.
    fn measure_thread(&mut self) {
        let Chosen { cull, select, select_next, .. } = self.chosen;
        let declared = Some(cull + select + select_next.unwrap_or_default());
        let taken = if self.is_virtual() {
            declared
        } else {
            let now = ThreadTime::try_now().ok().map(|time| time.as_duration());
            std::mem::replace(&mut self.thread_time, now).and_then(|before| now?.checked_sub(before))
        };
        if let Some(taken) = taken {
            self.frame_cpu_s += CPU_NEWS * (taken.as_secs_f64() - self.frame_cpu_s);
        }
    }

    /// Ends a frame that is not counted: it enters neither the report nor the controller.
    pub const fn pass_over(&mut self) {
        self.last_start = None;
    }

    fn store(&mut self, record: FrameRecord) {
        self.records.push(record);
        if self.records.len() >= self.keep.saturating_mul(2) {
            let old = self.records.len() - self.keep;
            self.records.drain(..old);
            self.warm_up = self.warm_up.saturating_sub(old);
        }
    }

    /// Ends the run, and with its last states the recording.
    #[must_use]
    pub fn end(mut self, adapter: Option<String>, interrupted: bool) -> Outcome {
        self.gather();
        self.reader.finish(self.world.agents());
        let handles = self.world.agents().clone();
        let (clamp, notes) = (self.clamp(), self.notes().to_vec());
        let (scene, policy, law) = (self.scene.name.clone(), self.policy_name(), self.law_name());
        let pace = if self.world.is_free() { "free" } else { "real-time" };
        let given_up = |agent: &AgentHandle| agent.given_up(self.sim_now()).as_secs_f64();
        let given_up_s: Vec<_> = handles.iter().map(given_up).collect();
        let (wall_s, sim_s) = (self.now().saturating_sub(self.begun).as_secs_f64(), self.sim_now().as_secs_f64());
        let stats = self.world.stop();
        let cut_off = self.world.end_recording().err().map(|error| Arc::new(error.into()));
        let tolerance = |at: usize| error_control::tolerance_status(&self.error_statuses, AgentId(at as u32));
        let last: Vec<_> = handles.iter().map(AgentHandle::latest).collect();
        let drawn = |at: usize| self.levels.get(at).map(|level| level.resolution);
        Outcome {
            scene,
            policy,
            law,
            executor: self.scene.executor.name(),
            pace,
            adapter,
            target_ms: 1e3 / self.control.target_hz(),
            frames: self.records,
            finished: self.finished,
            warm_up: self.warm_up,
            sim_s,
            start_up_s: self.begun.as_secs_f64(),
            wall_s,
            cpu_s: stats.iter().map(|s| s.cpu_s).fold(0.0, |sum, s| sum + s), // an empty sum() is -0
            state_hash: metachron_runtime::state_hash(&handles),
            probes: record::probes(&self.scene, &handles),
            agents: stats
                .into_iter()
                .enumerate()
                .map(|(at, stats)| AgentOutcome {
                    picture: drawn(at),
                    tolerance: tolerance(at),
                    given_up_s: given_up_s[at],
                    stats,
                })
                .collect(),
            couplings: self.couplings.all().to_vec(),
            events: events(last.iter().map(|state| &**state)),
            readings: self.scene.sensors.iter().map(|sensor| self.world.read(&sensor.kind).ok()).collect(),
            sensors: sensed(last.iter().map(|state| &**state)),
            clusters: last.iter().map(|state| state.cluster).collect(),
            trace: self.trace,
            clamp,
            unpriced: self.unpriced,
            interrupted,
            cut_off,
            notes,
        }
    }

    /// Couplings between agents so far.
    #[must_use]
    pub fn couplings(&self) -> &[Coupling] {
        self.couplings.all()
    }

    /// Records the states of all agents from now on, for comparison with another run.
    pub fn keep_trace(&mut self) {
        self.trace.get_or_insert_default();
    }
}
