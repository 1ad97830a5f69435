//! A session in a window: passes the viewer's actions to the session, and its state to the viewer.
//!
//! In: a session and where its scene came from. Out: an [`Outcome`] when the window closes. Never here: egui, panels.

mod scene_files;
mod time;

use super::live_tuning;
use super::live_tuning::{Tuned, Tuning};
use super::view_model;
use super::view_model::Meter;
use crate::ui;
use crate::ui::{
    Action, Bounds, FrameTimes, HandStatus, Message, Severity, Simulation, Skip, Status, TurnRow, ViewRequest,
    WindowError, WindowOptions, run_window,
};
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, SimSpan};
use metachron_lod::control::Policy;
use metachron_render::{Camera, Gpu, Hand, Hit, Picture, Ray};
use metachron_runtime::{StreamReader, TimelineCommand};
use metachron_scene::Source;
use metachron_session::{Finished, FrameRecord, Outcome, REWIND_BYTES, Session};
use scene_files::WatchedFiles;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A run in a window.
pub struct WindowPlan {
    /// The source of the scene, so that it can be read again.
    pub source: Source,
    /// Values that override the scene's own.
    pub overrides: Vec<(String, String)>,
    /// Width and height of the window, points; `None` restores the size at its last closing.
    pub size: Option<[f32; 2]>,
    /// Whether panels and picture look as in a first window, and not as they were left.
    pub reset: bool,
    /// Folder for screenshots.
    pub screenshots: PathBuf,
    /// Simulated seconds after which the window closes by itself.
    pub seconds: Option<f64>,
    /// Frames after which the window closes by itself.
    pub frames: Option<u64>,
}

/// Reason why a window could not be shown; the session is returned if it can continue without one.
pub enum WindowFailure {
    /// There is no display or no adapter for one.
    NoWindow(Box<Session>, WindowError),
    /// The window was open, and its display is gone: the outcome of the run until then.
    Gone(Box<Outcome>, WindowError),
}

/// Shows `session` in a window until it is closed, or until `go_on`, called many times a second whether or not anything is drawn, returns
/// `false`. `go_on` receives the last frame, and the share of the run that is done if the run has an end.
///
/// The outcome is that of the last start: a reset begins a new run. Frames drawn while time is paused or the window is hidden are left out,
/// and of a run without an end at least the newest [`FRAMES_KEPT`] are included.
///
/// # Errors
/// [`WindowFailure::NoWindow`] returns the session with its time paused, [`WindowFailure::Gone`] the outcome.
pub fn play_in_window(session: Session, plan: WindowPlan, go_on: GoOn<'_>) -> Result<Outcome, WindowFailure> {
    let (size, reset, screenshots) = (plan.size, plan.reset, plan.screenshots.clone());
    let options = WindowOptions { size, reset, screenshots, lose_device_after: None };
    let mut simulation = WindowSimulation::new(session, plan, go_on);
    match run_window(&mut simulation, &options) {
        Ok(_) => Ok(simulation.session.end(simulation.adapter, simulation.stopped)),
        Err(error @ WindowError::Gone(_)) => {
            Err(WindowFailure::Gone(Box::new(simulation.session.end(simulation.adapter, true)), error))
        }
        Err(error) => Err(WindowFailure::NoWindow(Box::new(simulation.session), error)),
    }
}

/// Receives the last frame and the share that is done, 0 … 1, of a run that has an end; returns whether to continue.
pub type GoOn<'a> = &'a mut dyn FnMut(&FrameRecord, Option<f64>) -> bool;

/// A session as the viewer sees it.
struct WindowSimulation<'a> {
    go_on: GoOn<'a>,
    adapter: Option<String>,
    stopped: bool,
    session: Session,
    plan: WindowPlan,
    status: Status,
    meter: Meter,
    notices: Vec<(Instant, Message)>,
    hand: Option<Hand>,
    tuning: Option<Tuning>,
    started: Duration,
    /// Drawing time within the declared frame.
    declared_draw: Duration,
    refreshed: Option<Duration>,
    last: FrameRecord,
    pictures: u64,
    speed: f64,
    running: bool,
    /// The run was put back, and its next frame begins at this moment.
    went_on: bool,
    files: WatchedFiles,
    /// Why the files as they are now cannot be shown.
    file_error: Option<Message>,
    /// How far the turns of each agent whose lane was shown have been read.
    turn_readers: BTreeMap<AgentId, StreamReader>,
}

/// Frames stored of a run without an end: an hour at 30 frames a second, some 10 MB.
pub const FRAMES_KEPT: usize = 108_000;
/// Update period of the panels: faster is not readable.
const PANELS_EVERY: Duration = Duration::from_millis(100);
/// How long a message stays: time to read a long line twice.
const MESSAGE_STAYS: Duration = Duration::from_secs(12);
/// Angular frequency of a body on the user spring, rad/s: firm, and slow enough for every agent's step.
const HAND_RAD_S: f64 = 25.0;
/// Fraction of critical damping of the user spring.
const HAND_DAMPING: f64 = 0.7;

impl<'a> WindowSimulation<'a> {
    fn new(mut session: Session, plan: WindowPlan, go_on: GoOn<'a>) -> Self {
        session.keep_frames(frames_kept(&plan));
        session.keep_moments(REWIND_BYTES);
        // time is paused until the window shows the scene, but not that of others
        if !session.is_elsewhere() {
            session.drive(TimelineCommand::Pause);
        }
        let mut simulation = Self {
            go_on,
            adapter: None,
            stopped: false,
            status: view_model::initial_status(&session),
            meter: Meter::new(&session),
            notices: Vec::new(),
            session,
            files: WatchedFiles::of(&plan.source),
            file_error: None,
            turn_readers: BTreeMap::new(),
            plan,
            hand: None,
            tuning: None,
            started: Duration::ZERO,
            declared_draw: Duration::ZERO,
            refreshed: None,
            last: FrameRecord::default(),
            pictures: 0,
            speed: 1.0,
            running: true,
            went_on: false,
        };
        simulation.refresh();
        simulation
    }

    fn replace(&mut self, mut session: Session) {
        self.stop_tuning();
        session.keep_frames(frames_kept(&self.plan));
        session.keep_moments(REWIND_BYTES);
        session.drive(TimelineCommand::Speed(self.speed));
        if self.running {
            session.begin();
        } else {
            session.drive(TimelineCommand::Pause);
        }
        let prices = *self.session.control().prices();
        if !session.is_virtual() {
            session.control().set_prices(prices);
        }
        let selected = self.status.selected.filter(|_| session.scene().name == self.session.scene().name);
        let recorded = self.session.end_recording();
        drop(std::mem::replace(&mut self.session, session));
        self.status = Status { selected, ..view_model::initial_status(&self.session) };
        self.meter = Meter::new(&self.session);
        self.notices.clear();
        self.turn_readers.clear();
        match recorded {
            Ok(true) => self.show_message(Severity::Note, "the recording ends with the run before this one".to_owned()),
            Ok(false) => {}
            Err(error) => self.show_message(Severity::Failure, error.to_string()),
        }
        (self.hand, self.refreshed, self.went_on) = (None, None, false);
        self.refresh();
    }

    /// Restarts the same scene, under the target, policy, law and sliders set by the user.
    fn reset(&mut self) {
        let policy = self.session.policy_name();
        let control = self.session.control();
        let (hz, law, sliders) = (control.target_hz(), control.law(), control.given_sliders());
        self.restart(self.session.scene().clone());
        self.session.set_policy(policy);
        let control = self.session.control();
        control.set_law(law);
        control.set_sliders(sliders);
        control.set_target_hz(hz);
        self.refreshed = None;
        self.refresh();
    }

    /// Sets the pressure of an object's filling; the slider stays where it is put.
    fn set_pressure(&mut self, agent: AgentId, pressure_pa: f64) {
        if self.session.set_pressure(agent, pressure_pa).is_err() {
            return;
        }
        let row = self.status.agents.iter_mut().find(|row| row.id == agent);
        row.and_then(|row| row.filled.as_mut()).into_iter().for_each(|filled| filled.pressure_pa = pressure_pa);
    }

    /// Starts time, unless the user has paused it.
    fn begin(&mut self) {
        if self.running {
            self.session.begin();
        }
    }

    /// Shows whether time passes in a world elsewhere, and why something of it is not shown or did not act.
    fn follow_elsewhere(&mut self) {
        if self.session.is_elsewhere() {
            self.running = self.session.passes();
        }
        if let Some(error) = self.session.take_error_elsewhere() {
            self.show_message(Severity::Failure, error.to_string());
        }
    }

    fn show_message(&mut self, severity: Severity, text: String) {
        let message = Message { severity, text };
        self.notices.retain(|(_, old)| *old != message);
        self.notices.push((Instant::now() + MESSAGE_STAYS, message));
    }

    fn pull(&mut self, hand: Option<Hand>) {
        if let Some(left) = self.hand.filter(|old| hand.is_none_or(|new| new.object != old.object)) {
            self.send_spring(left.object, None);
        }
        self.hand = hand;
        if let Some(hand) = hand {
            let mass_kg = view_model::mass_kg(&self.session.scene().agents[hand.object.0 as usize].spec);
            let pull = AnchorSpring {
                by: None,
                anchor: hand.anchor,
                target: hand.target,
                target_velocity: DVec3::ZERO,
                stiffness_n_m: mass_kg * HAND_RAD_S * HAND_RAD_S,
                damping_n_s_m: 2.0 * HAND_DAMPING * mass_kg * HAND_RAD_S,
            };
            self.send_spring(hand.object, Some(pull));
        }
    }

    fn send_spring(&mut self, to: AgentId, pull: Option<AnchorSpring>) {
        if let Err(error) = self.session.hand(to, pull) {
            self.show_message(Severity::Warning, error.to_string());
        }
    }

    fn tune(&mut self) {
        self.stop_tuning();
        self.tuning = Some(Tuning::begin(self.session.control()));
    }

    /// Stops a tuning in progress: policy and law are restored.
    fn stop_tuning(&mut self) {
        if let Some(tuning) = self.tuning.take() {
            tuning.stop(self.session.control());
        }
    }

    /// Applies the gains of a search that has ended.
    fn take_gains(&mut self) {
        let Some(tuning) = self.tuning.take_if(|tuning| tuning.is_over()) else { return };
        match tuning.end() {
            Tuned::Found(verdict) => {
                if let metachron_lod::tune::Candidate::Feedback(law) = verdict.candidate {
                    self.session.control().set_policy(Policy::Feedback);
                    self.session.control().set_law(law);
                }
                self.show_message(Severity::Note, format!("tuned: {}", live_tuning::verdict_text(&verdict)));
            }
            Tuned::Refused(why) => self.show_message(Severity::Warning, format!("not tuned: {why}")),
        }
    }

    /// Passes the frame to the experiment.
    fn note_frame(&mut self) {
        let Some(tuning) = &mut self.tuning else { return };
        if let Err(error) = tuning.note(&mut self.session, 1e-3 * self.last.frame_ms) {
            self.stop_tuning();
            self.show_message(Severity::Failure, format!("not tuned: {error}"));
        }
    }

    /// The share that is done of a run that ends by itself, 0 … 1.
    fn share_done(&self) -> Option<f64> {
        let frames = self.plan.frames.map(|all| self.session.frames() as f64 / all as f64);
        let seconds = self.plan.seconds.map(|all| self.session.played_s() / all);
        frames.or(seconds)
    }

    /// Updates the panels when they are due.
    fn refresh(&mut self) {
        let now = self.session.now();
        if self.refreshed.is_some_and(|last| now < last + PANELS_EVERY) {
            return;
        }
        let messages = view_model::fill(&mut self.status, &mut self.session, &mut self.meter);
        messages.into_iter().for_each(|text| self.show_message(Severity::Failure, text));
        self.refreshed = Some(now);
    }
}

/// Whether an action changes the later run, other than when.
const fn acts(action: &Action) -> bool {
    !matches!(
        action,
        Action::Look(_)
            | Action::Run
            | Action::Pause
            | Action::SingleStep
            | Action::Speed(_)
            | Action::Select(_)
            | Action::Camera(_)
    )
}

/// Frames stored in a run of this plan: all if it ends by itself.
const fn frames_kept(plan: &WindowPlan) -> usize {
    if plan.frames.is_some() || plan.seconds.is_some() { usize::MAX } else { FRAMES_KEPT }
}

impl Simulation for WindowSimulation<'_> {
    fn apply(&mut self, action: Action) {
        if matches!(action, Action::TargetFps(_) | Action::Policy(_) | Action::Law(_) | Action::Freeze(true)) {
            self.stop_tuning();
        }
        if acts(&action) {
            self.session.branch_off();
        }
        match action {
            Action::Run => self.drive(TimelineCommand::Run),
            Action::Pause => self.drive(TimelineCommand::Pause),
            Action::SingleStep => {
                let frame = SimSpan::from_secs_f64(self.session.period().as_secs_f64()).unwrap_or(SimSpan::ZERO);
                self.drive(TimelineCommand::Step(frame));
            }
            Action::Camera(number) => {
                self.session.use_camera(number);
                self.status.camera = self.session.camera_number();
            }
            Action::Look(look) => self.look(look),
            Action::Reset | Action::Reload | Action::OpenScene(_) if self.session.is_elsewhere() => {
                let text = "the world runs elsewhere: its scene is started anew and exchanged by its host".to_owned();
                self.show_message(Severity::Warning, text);
            }
            Action::Reset => self.reset(),
            Action::Reload => self.reload(),
            Action::Speed(speed) => self.drive(TimelineCommand::Speed(speed)),
            Action::TargetFps(hz) => self.session.control().set_target_hz(hz),
            Action::Policy(name) => self.session.set_policy(&name),
            Action::Law(law) => self.session.control().set_law(law),
            Action::Sliders(sliders) => {
                let control = self.session.control();
                control.set_sliders(control.given_sliders().moved(control.sliders(), sliders));
            }
            Action::Freeze(frozen) => self.session.control().freeze(frozen),
            Action::Tune => self.tune(),
            Action::StopTuning => self.stop_tuning(),
            Action::DragStart(hit) => {
                self.pull(Some(Hand { object: hit.object, anchor: hit.anchor, target: hit.point_m }));
            }
            Action::DragMove(target) => self.pull(self.hand.map(|hand| Hand { target, ..hand })),
            Action::DragEnd => self.pull(None),
            Action::Pressure { agent, pressure_pa } => self.set_pressure(agent, pressure_pa),
            Action::Select(agent) => self.status.selected = agent,
            Action::OpenScene(path) => self.open(&path),
        }
    }

    fn compose(&mut self, view: &ViewRequest) -> &Picture {
        self.pictures += 1;
        if self.pictures == 2 {
            self.begin();
        }
        self.follow_files();
        self.follow_elsewhere();
        self.pass_time();
        self.take_gains();
        self.refresh();
        let now = Instant::now();
        self.notices.retain(|(until, _)| now < *until);
        self.status.messages.clear();
        self.status.messages.extend(self.notices.iter().map(|(_, message)| message.clone()));
        self.status.messages.extend(self.file_error.clone());
        let unanswered = self.session.unanswered().map(|error| error.to_string());
        let notes = self.session.notes().iter().cloned().chain(unanswered);
        self.status.messages.extend(notes.map(|text| Message { severity: Severity::Failure, text }));
        self.status.rewind = self.session.rewind();
        let shown = self.session.rewind().and_then(|rewind| rewind.shown);
        self.status.sim_time = shown.unwrap_or_else(|| self.session.sim_now());
        (self.status.running, self.status.speed) = (self.running, self.speed);
        self.status.held =
            self.hand.map(|hand| HandStatus { target: hand.target, force_n: self.session.hand_force_n(hand.object) });
        self.status.tuning = self.tuning.as_ref().map(|tuning| {
            let (done, words) = tuning.progress();
            ui::Tuning { done, words }
        });
        if let Some(tuning) = &mut self.tuning {
            tuning.choose(self.session.control());
        }
        self.session.compose(&view.camera, view.size, view.style, self.hand);
        if self.session.is_virtual() && !self.session.is_put_back() {
            self.session.choose_next_frame(&view.camera, view.size);
            self.declared_draw = self.session.spend_declared(view.size);
        }
        self.status.forces = view.style.forces.then(|| ui::Forces {
            scale_m_per_n: self.session.picture().force_scale,
            tools: self.session.scene_view().tool_forces(),
        });
        self.session.picture()
    }

    fn while_drawn(&mut self, view: &ViewRequest) {
        if !self.session.is_virtual() {
            self.session.choose_next_frame(&view.camera, view.size);
        }
    }

    fn measured(&mut self, times: &FrameTimes) {
        if matches!(times.skip, Some(Skip::Hidden | Skip::Still)) {
            self.session.pass_over();
            return;
        }
        let declared = || (self.session.now().saturating_sub(self.started), self.declared_draw);
        let (work, draw) = if self.session.is_virtual() { declared() } else { (times.work, times.draw) };
        let unlike = times.skip.is_some();
        let skip = unlike || self.tuning.as_ref().is_some_and(Tuning::draws);
        self.last = self.session.finish(self.started, Finished { work, draw, gpu: times.draw_gpu, skip });
        if !unlike {
            self.note_frame();
        }
    }

    fn status(&self) -> &Status {
        &self.status
    }

    fn drawn_by(&mut self, adapter: &str, on_processor: bool) {
        self.adapter = Some(adapter.to_owned());
        // the same adapter without a window: the benchmark needs a device of its own
        self.session.calibrate(adapter, on_processor, || Gpu::headless().ok());
    }

    fn predict_camera(&mut self, camera: Camera) -> Camera {
        self.session.predict_camera(camera)
    }

    fn turns(&mut self, of: AgentId, take: &mut dyn FnMut(TurnRow)) {
        let Some(agent) = self.session.agents().of(of) else { return };
        let reader = self.turn_readers.entry(of).or_insert_with(|| agent.listen_to_turns());
        agent.read_turns(reader, |turn| take(view_model::turn(&turn)));
    }

    fn scene_camera(&self) -> Camera {
        self.session.scene_camera()
    }

    fn pick(&self, ray: Ray) -> Option<Hit> {
        self.session.scene_view().pick(ray)
    }

    fn bounds(&self, of: Option<AgentId>) -> Option<Bounds> {
        self.session.scene_view().bounds(of).map(|(centre, radius_m)| Bounds { centre, radius_m })
    }

    fn wants_close(&mut self) -> bool {
        let done = self.share_done();
        self.stopped = self.stopped || !(self.go_on)(&self.last, done);
        self.stopped || done.is_some_and(|share| share >= 1.0)
    }
}

#[cfg(test)]
mod tests;
