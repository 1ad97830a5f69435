//! The window itself: eframe around the [`Viewer`], paced at the target rate, reopened when its device is lost.
//!
//! In: a [`Simulation`] and [`WindowOptions`]. Out: how the window ended. Never here: the content of the window.
//! eframe reconfigures an outdated surface and remakes a lost one, but does not notice a lost device; so [`run_window`] receives the loss
//! from wgpu, closes the window and opens it again on a new device. The simulation keeps running.

use super::present_time::Presenting;
use super::protocol::{FrameTimes, Message, Severity, Simulation, Skip};
use super::screen::GpuScreen;
use super::{Layout, Screen, Viewer, WindowRequests};
use eframe::{CreationContext, NativeOptions, egui_wgpu};
use metachron_render::DeviceLoss;
use std::cell::{Cell, OnceCell};
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Start options of a window.
#[derive(Debug, Clone)]
pub struct WindowOptions {
    /// Initial width and height, points; `None` restores the size at which the window was last closed.
    pub size: Option<[f32; 2]>,
    /// Whether panels and picture look as in a first window, and not as they were left.
    pub reset: bool,
    /// Folder for screenshots; it exists.
    pub screenshots: PathBuf,
    /// Destroys the device after this many pictures, once: tests that the window comes back. Never set by users.
    pub lose_device_after: Option<u64>,
}

/// How a window ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WindowEnd {
    /// The user closed it.
    Closed,
    /// The simulation requested it ([`Simulation::wants_close`]).
    Finished,
}

/// Reasons for having no window.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WindowError {
    /// There is no display to open a window on; the run can go on without one.
    #[error("there is no display: {0}")]
    NoDisplay(String),
    /// No adapter can draw into a window.
    #[error("no graphics adapter can draw into a window: {0}; on Debian and Ubuntu install mesa-vulkan-drivers")]
    NoAdapter(String),
    /// The device was lost this many times in a row, each within a second of being made.
    #[error("the graphics device was lost {0} times, each within a second of its creation")]
    DeviceUnstable(u32),
    /// The window was open, and its display is gone.
    #[error("the window was lost: {0}")]
    Gone(String),
    /// The window could not be made for another reason.
    #[error("the window could not be opened: {0}")]
    Failed(String),
}

/// A device that is lost sooner than this counts against [`LOSSES_MAX`].
const YOUNG: Duration = Duration::from_secs(1);
/// Early losses in a row after which the window gives up.
const LOSSES_MAX: u32 = 5;
/// While the window is hidden, [`Simulation::wants_close`] is polled at this interval.
const HIDDEN_POLL: Duration = Duration::from_millis(200);
/// Interval between pictures while the simulation is paused and there is no input.
const STILL_PERIOD: Duration = Duration::from_millis(250);
/// Seconds without input before a paused picture counts as still: by then a single step and mesh morphs have ended.
const CALM: f64 = 0.5;
/// First pictures of a new device that are excluded from statistics: shaders are compiled, buffers grow.
const WARM_UP: u64 = 3;
/// A picture due within this time is drawn now instead of waiting.
const EARLY: Duration = Duration::from_micros(500);
/// A picture later than this was delayed by the one before.
const LATE: Duration = Duration::from_millis(1);

/// Opens the window and shows `simulation` in it until the user or the simulation closes it.
///
/// To be called on the main thread. A lost device is replaced; the simulation is not notified and need not react.
///
/// # Errors
/// [`WindowError::NoDisplay`] where a run should go on without a window, [`WindowError::Gone`] where it should end, as its display is gone;
/// the others where graphics fail. The simulation is left unchanged.
pub fn run_window(simulation: &mut dyn Simulation, options: &WindowOptions) -> Result<WindowEnd, WindowError> {
    find_display()?;
    let mut viewer = Viewer::default();
    let mut options = options.clone();
    let (mut losses, mut first) = (0, true);
    loop {
        let opened = Instant::now();
        match open(simulation, &mut viewer, &options, first)? {
            WindowState::Open | WindowState::Closed => return Ok(WindowEnd::Closed),
            WindowState::Finished => return Ok(WindowEnd::Finished),
            WindowState::DeviceLost => {}
        }
        losses = if opened.elapsed() < YOUNG { losses + 1 } else { 0 };
        if losses >= LOSSES_MAX {
            return Err(WindowError::DeviceUnstable(losses));
        }
        (options.lose_device_after, first) = (None, false);
        let text = "The graphics device was lost and has been recreated.".to_owned();
        viewer.note(0.0, Message { severity: Severity::Warning, text });
    }
}

/// Environment variables that name a display, in the order in which they are tried.
const DISPLAYS: [&str; 3] = ["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"];

/// Fails if this system names no display: the error of winit is hard to read in that case.
fn find_display() -> Result<(), WindowError> {
    let unix_desktop = cfg!(unix) && !cfg!(target_os = "macos");
    let named = DISPLAYS.into_iter().any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()));
    if unix_desktop && !named {
        return Err(WindowError::NoDisplay("neither DISPLAY nor WAYLAND_DISPLAY is set".to_owned()));
    }
    Ok(())
}

/// State of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WindowState {
    Open,
    Closed,
    Finished,
    DeviceLost,
}

/// One window on one device, until either ends.
fn open(
    simulation: &mut dyn Simulation,
    viewer: &mut Viewer,
    options: &WindowOptions,
    first: bool,
) -> Result<WindowState, WindowError> {
    let (window_state, device) = (Rc::new(Cell::new(WindowState::Open)), Rc::new(OnceCell::<DeviceLoss>::new()));
    let (shell_state, watched) = (Rc::clone(&window_state), Rc::clone(&device));
    let native = native_options(&simulation.status().scene, options.size);
    let creator = move |cc: &CreationContext<'_>| -> Result<Box<dyn eframe::App + '_>, _> {
        Viewer::install(&cc.egui_ctx);
        if let Some(layout) =
            cc.storage.filter(|_| first && !options.reset).and_then(|s| eframe::get_value::<Layout>(s, LAYOUT))
        {
            viewer.layout = layout;
        }
        let state = cc.wgpu_render_state.as_ref().ok_or("eframe was built without wgpu")?;
        let screen = GpuScreen::new(state, options.lose_device_after)?;
        let _ = watched.set(screen.lost().clone());
        simulation.drawn_by(screen.adapter(), screen.is_software());
        Ok(Box::new(Shell::new(simulation, viewer, screen, shell_state, options.screenshots.clone())))
    };
    let run = || eframe::run_native("metachron", native, Box::new(creator));
    let lost = || device.get().is_some_and(|lost| lost.reason().is_some());
    let opened = || device.get().is_some();
    // egui panics if a device is lost between its own calls, and winit if the display is lost; neither the simulation nor the viewer is being
    // modified at that point
    match catch_winit_panic(|| panic::catch_unwind(AssertUnwindSafe(run))) {
        (_, true) => return Err(display_error(opened())),
        (Ok(ended), _) => ended.map_err(|error| named_error(error, opened()))?,
        (Err(_), _) if lost() => return Ok(WindowState::DeviceLost),
        (Err(bug), _) => panic::resume_unwind(bug),
    }
    Ok(window_state.get())
}

/// Returns the result of `run`, and whether winit panicked meanwhile, as it does where the display does not answer; that panic is not
/// printed.
fn catch_winit_panic<T>(run: impl FnOnce() -> T) -> (T, bool) {
    let (before, panicked) = (Arc::new(panic::take_hook()), Arc::new(AtomicBool::new(false)));
    let (previous_hook, panic_flag) = (Arc::clone(&before), Arc::clone(&panicked));
    panic::set_hook(Box::new(move |panic| match panic.location() {
        Some(place) if place.file().split(['/', '\\']).any(|part| part.starts_with("winit-")) => {
            panic_flag.store(true, Ordering::Relaxed)
        }
        _ => previous_hook(panic),
    }));
    let given = run();
    drop(panic::take_hook());
    if let Ok(before) = Arc::try_unwrap(before) {
        panic::set_hook(before);
    }
    (given, panicked.load(Ordering::Relaxed))
}

const LAYOUT: &str = "metachron layout";

fn named_error(error: eframe::Error, opened: bool) -> WindowError {
    match error {
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => display_error(opened),
        eframe::Error::Wgpu(error) => WindowError::NoAdapter(error.to_string()),
        other => WindowError::Failed(other.to_string()),
    }
}

/// The error for a display that does not answer, or no longer answers if the window was already `opened`.
fn display_error(opened: bool) -> WindowError {
    let read = |key: &str| std::env::var(key).ok();
    if opened {
        return WindowError::Gone(display_message(read, "no longer responds"));
    }
    let why = display_message(read, "does not respond");
    WindowError::NoDisplay(format!(
        "{why}; set DISPLAY or WAYLAND_DISPLAY to a working display, or run with --headless"
    ))
}

/// Message: the requested display and that it `fails`; the message of winit itself only names a line of its source.
fn display_message(read: impl Fn(&str) -> Option<String>, fails: &str) -> String {
    let named = |key: &'static str| read(key).filter(|value| !value.is_empty()).map(|value| (key, value));
    let Some((key, value)) = DISPLAYS.into_iter().find_map(named) else {
        return "the system cannot open a window".to_owned();
    };
    format!("the display `{value}` ({key}) {fails}")
}

fn native_options(scene: &str, size: Option<[f32; 2]>) -> NativeOptions {
    let viewport = egui::ViewportBuilder::default()
        .with_title(format!("metachron – {scene}"))
        .with_app_id("metachron")
        .with_inner_size(size.unwrap_or([1440.0, 900.0]))
        .with_min_inner_size([640.0, 420.0])
        .with_drag_and_drop(true)
        .with_icon(super::icons::window_icon());
    let mut wgpu_options = egui_wgpu::WgpuConfiguration::default();
    if let egui_wgpu::WgpuSetup::CreateNew(setup) = &mut wgpu_options.wgpu_setup {
        setup.device_descriptor = Arc::new(metachron_render::offscreen::device_descriptor);
    }
    let renderer = eframe::Renderer::Wgpu;
    // an explicit size overrides the stored one, which eframe restores before this hook runs
    let sized = move |size: [f32; 2]| -> eframe::WindowBuilderHook {
        Box::new(move |builder| builder.with_inner_size(size).with_maximized(false).with_fullscreen(false))
    };
    NativeOptions {
        viewport,
        wgpu_options,
        renderer,
        persist_window: size.is_none(),
        window_builder: size.map(sized),
        ..NativeOptions::default()
    }
}

/// The application inside eframe.
struct Shell<'a> {
    simulation: &'a mut dyn Simulation,
    viewer: &'a mut Viewer,
    screen: GpuScreen,
    window_state: Rc<Cell<WindowState>>,
    screenshots: PathBuf,
    pace: Pace,
    presenting: Presenting,
    /// Time that [`Viewer::ui`] spent on the picture in the previous frame.
    drawing: Duration,
    hidden: bool,
    /// Time of the last user input, in egui's time.
    touched_s: f64,
}

/// Schedule of the pictures.
struct Pace {
    due: Instant,
    started: Option<Instant>,
    pictures: u64,
}

impl Pace {
    fn is_due(&self, now: Instant, still: bool) -> bool {
        now + EARLY >= self.next(still)
    }

    /// Due time of the next picture; `still` allows a long interval.
    fn next(&self, still: bool) -> Instant {
        let next = self.started.filter(|_| still).map(|started| started + STILL_PERIOD);
        next.map_or(self.due, |next| next.max(self.due))
    }

    /// Counts a picture that starts now; returns the time since the one before.
    fn start(&mut self, now: Instant, period: Duration) -> Duration {
        // a late picture keeps the schedule if possible, and restarts it if a whole period late
        self.due = if self.due + period > now { self.due + period } else { now + period };
        self.pictures += 1;
        let before = self.started.replace(now);
        before.map_or(period, |before| now - before)
    }
}

impl<'a> Shell<'a> {
    fn new(
        simulation: &'a mut dyn Simulation,
        viewer: &'a mut Viewer,
        screen: GpuScreen,
        window_state: Rc<Cell<WindowState>>,
        screenshots: PathBuf,
    ) -> Self {
        let pace = Pace { due: Instant::now(), started: None, pictures: 0 };
        Self {
            simulation,
            viewer,
            screen,
            window_state,
            screenshots,
            pace,
            presenting: Presenting::default(),
            drawing: Duration::ZERO,
            hidden: false,
            touched_s: 0.0,
        }
    }

    /// Whether pictures may come slowly: the simulation is paused and there is no user input.
    fn is_still(&mut self, ctx: &egui::Context) -> bool {
        let (now_s, touched) = ctx.input(|input| {
            let held = input.pointer.any_down() || !input.keys_down.is_empty();
            (input.time, held || !input.raw.events.is_empty() || !input.raw.dropped_files.is_empty())
        });
        if touched || self.simulation.status().running {
            self.touched_s = now_s;
        }
        now_s - self.touched_s > CALM
    }

    fn close(&self, ctx: &egui::Context, window_state: WindowState) {
        self.window_state.set(window_state);
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }

    /// Collects the times of the picture just drawn, and passes them to the simulation and the plots.
    fn account(&mut self, interval: Duration, panels: Duration) {
        let Some(drawn) = self.screen.take_times() else { return };
        // a GPU presents on its own: waiting for it is not work
        let present = if self.screen.is_software() { self.presenting.time() } else { Duration::ZERO };
        let skip = if self.pace.pictures <= WARM_UP {
            Some(Skip::WarmUp)
        } else if std::mem::take(&mut self.hidden) {
            Some(Skip::Hidden)
        } else if drawn.resized {
            Some(Skip::Resized)
        } else if !self.simulation.status().running {
            Some(Skip::Still)
        } else {
            None
        };
        let times = FrameTimes {
            compose: drawn.compose,
            draw: drawn.draw,
            draw_gpu: drawn.gpu,
            panels,
            present,
            work: drawn.compose + drawn.draw + panels + present,
            interval,
            skip,
        };
        self.presenting.worked(drawn.compose + drawn.draw + panels, skip.is_none());
        self.simulation.measured(&times);
        self.viewer.measured(&times);
    }

    fn fulfil(&mut self, ctx: &egui::Context, requests: WindowRequests) {
        if requests.quit {
            self.close(ctx, WindowState::Closed);
        }
        if requests.screenshot {
            let scene = self.simulation.status().scene.clone();
            let message = match self.screen.save(&self.screenshots, &scene) {
                Ok(path) => {
                    Message { severity: Severity::Note, text: format!("Picture written to {}", path.display()) }
                }
                Err(text) => Message { severity: Severity::Failure, text },
            };
            self.viewer.note(ctx.time(), message);
        }
    }
}

impl eframe::App for Shell<'_> {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        if self.window_state.get() != WindowState::Open {
            return;
        }
        if self.screen.lost().reason().is_some() {
            self.close(ctx, WindowState::DeviceLost);
        } else if self.simulation.wants_close() {
            self.close(ctx, WindowState::Finished);
        }
        if ctx.input(|input| input.viewport().visible()) == Some(false) {
            self.hidden = true;
            ctx.request_repaint_after(HIDDEN_POLL);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if self.window_state.get() != WindowState::Open {
            return;
        }
        let (now, first_pass) = (Instant::now(), ui.ctx().current_pass_index() == 0);
        let panels = frame.info().cpu_usage.map_or(Duration::ZERO, |s| Duration::from_secs_f32(s.max(0.0)));
        let panels = panels.saturating_sub(self.drawing);
        let period = Duration::from_secs_f64(1.0 / self.simulation.status().target_hz.clamp(0.1, 1000.0));
        let still = self.is_still(ui.ctx());
        let due = first_pass && self.pace.is_due(now, still);
        let late = now.saturating_duration_since(self.pace.next(still)) > LATE;
        let interval = if due { self.pace.start(now, period) } else { Duration::ZERO };
        if due {
            self.presenting.started(interval, late);
        }
        self.screen.set_due(due);
        let (requests, drawing) = self.viewer.ui(ui, self.simulation, &mut self.screen);
        self.drawing = if first_pass { drawing } else { self.drawing + drawing };
        self.account(interval, panels);
        if let Some(error) = self.screen.take_failure() {
            let text = format!("The picture could not be drawn: {error}");
            self.viewer.note(ui.ctx().time(), Message { severity: Severity::Failure, text });
        }
        self.fulfil(ui.ctx(), requests);
        if self.screen.lost().reason().is_some() {
            // egui must not draw on a lost device: its vertex buffer would be missing, and it would panic
            ui.ctx().graphics_mut(|layers| *layers = egui::layers::GraphicLayers::default());
        }
        ui.ctx().request_repaint_after(self.pace.next(still).saturating_duration_since(Instant::now()));
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, LAYOUT, &self.viewer.layout);
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_display_that_does_not_answer_is_named() {
        let message = display_message(|key| (key == "DISPLAY").then(|| ":77".to_owned()), "does not respond");
        assert_eq!(message, "the display `:77` (DISPLAY) does not respond");
        assert_eq!(display_message(|_| None, "does not respond"), "the system cannot open a window");
    }

    #[test]
    fn a_given_size_overrides_the_restored_one() {
        let restored = || egui::ViewportBuilder::default().with_inner_size([1000.0, 700.0]).with_maximized(true);
        let built = native_options("tube", Some([800.0, 600.0])).window_builder.unwrap()(restored());
        assert_eq!((built.inner_size, built.maximized), (Some([800.0, 600.0].into()), Some(false)));
        assert!(native_options("tube", None).window_builder.is_none());
    }

    #[test]
    fn pictures_keep_their_schedule_and_a_stall_restarts_it() {
        let begin = Instant::now();
        let period = Duration::from_millis(20);
        let mut pace = Pace { due: begin, started: None, pictures: 0 };
        assert_eq!(pace.start(begin, period), period);
        let late = begin + Duration::from_millis(23);
        assert!(pace.is_due(late, false) && !pace.is_due(begin + Duration::from_millis(19), false));
        assert!(!pace.is_due(late, true) && pace.is_due(begin + STILL_PERIOD, true));
        assert_eq!(pace.start(late, period), Duration::from_millis(23));
        assert_eq!(pace.due, begin + 2 * period);
        let stalled = begin + Duration::from_millis(500);
        pace.start(stalled, period);
        assert_eq!(pace.due, stalled + period);
    }
}
