//! The window: panels around the picture, keys and mouse, and the shell that survives a lost device.
//!
//! In: a [`Simulation`] (picture, numbers, picking). Out: [`Action`]s. Never here: the runtime, scenes, controllers.
//! [`Viewer`] is the whole user interface without a window, so that tests can drive it; [`run_window`] opens a window around it.

mod bar;
mod blit;
mod budget_bar;
mod commands;
mod couplings;
mod forces;
mod history;
mod icons;
mod lanes;
mod mouse;
mod native_window;
mod overlays;
mod plots;
mod protocol;
mod screen;
mod side;
mod table;
mod text;
mod theme;
mod timeline;

pub use commands::{Command, Group, MOUSE, SHORTCUTS, Shortcut, keys_text};
pub use history::{FrameSummary, History};
pub use native_window::{WindowEnd, WindowError, WindowOptions, run_window};
pub use protocol::{
    Action, AgentRow, AgentState, Bounds, ContactSolve, CouplingRow, Filled, Forces, FrameTimes, HandStatus, Law, Look,
    Message, Severity, Shares, Simulation, Skip, Status, Tuning, TurnRow, ViewRequest,
};

use egui::{Frame, Margin, Panel, Rect, Sense, Ui};
use lanes::Lanes;
use metachron_render::{Colouring, Size, Style};
use mouse::Hand;
use overlays::Finder;
use std::time::{Duration, Instant};

/// The source of a frame's picture: the window's device, or a test.
pub trait Screen {
    /// Draws the picture that `simulation` composes for this request, or returns the last picture if the next is not due yet.
    /// The shape covers `over`.
    fn draw(&mut self, simulation: &mut dyn Simulation, view: &ViewRequest, over: Rect) -> Option<egui::Shape>;

    /// The adapter's name, for the information panel.
    fn adapter(&self) -> &str;
}

/// Requests to the window after a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WindowRequests {
    /// Write the picture to a file.
    pub screenshot: bool,
    /// Close the window.
    pub quit: bool,
    theme: bool,
}

/// Drawing options of the picture, stored between runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct DrawingOptions {
    /// Colour objects by their resolution.
    pub colours: bool,
    /// Colour objects by the age of their state; not together with `colours`.
    pub ages: bool,
    /// Shade objects by their detail; not together with the other two.
    pub details: bool,
    /// Show distances along the view; not together with the other three.
    pub depths: bool,
    /// Draw the edges of triangles.
    pub wireframe: bool,
    /// Draw contact points and forces.
    pub forces: bool,
}

impl DrawingOptions {
    /// These, but of the meanings of colours the one that `wanted` has in addition.
    fn plain_or(self, wanted: Self) -> Self {
        Self {
            colours: wanted.colours && !self.colours,
            ages: wanted.ages && !self.ages,
            details: wanted.details && !self.details,
            depths: wanted.depths && !self.depths,
            ..wanted
        }
    }

    fn style(self) -> Style {
        let colouring = match self {
            Self { colours: true, .. } => Colouring::Resolution,
            Self { ages: true, .. } => Colouring::Age,
            Self { details: true, .. } => Colouring::Detail,
            Self { depths: true, .. } => Colouring::Depth,
            _ => Colouring::Material,
        };
        Style { colouring, wireframe: self.wireframe, forces: self.forces }
    }
}

/// The part of the layout that is stored between runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Layout {
    /// Drawing options of the picture.
    pub looks: DrawingOptions,
    /// Whether the panels are shown.
    pub panels: bool,
    /// Whether the timeline is shown.
    pub timeline: bool,
    /// Whether the lanes of turns are shown.
    pub lanes: bool,
    /// Whether the run's numbers are shown over the picture.
    pub info: bool,
    /// Whether the window of costs and rates is open.
    pub costs: bool,
    /// Whether the window of histories is open.
    pub histories: bool,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            panels: true,
            timeline: true,
            lanes: false,
            info: false,
            costs: false,
            histories: false,
            looks: DrawingOptions::default(),
        }
    }
}

/// The user interface, without the window and the device.
#[derive(Debug)]
pub struct Viewer {
    /// The part of the layout that is stored between runs.
    pub layout: Layout,
    hand: Hand,
    history: History,
    lanes: Lanes,
    help: bool,
    finder: Option<Finder>,
    size: Size,
    /// The window's own messages, in addition to the simulation's.
    notes: Vec<(f64, Message)>,
}

/// Least room below the bar for the panels, height and width, points: in a smaller window the picture takes all of it.
const TALL: f32 = 340.0;
const BROAD: f32 = 600.0;

/// Display time of the window's own messages, seconds.
const NOTE_S: f64 = 6.0;

impl Default for Viewer {
    fn default() -> Self {
        Self {
            layout: Layout::default(),
            hand: Hand::default(),
            history: History::default(),
            lanes: Lanes::default(),
            help: false,
            finder: None,
            size: Size { width: 1, height: 1 },
            notes: Vec::new(),
        }
    }
}

impl Viewer {
    /// Sets egui's theme. Call once per context.
    pub fn install(ctx: &egui::Context) {
        theme::install(ctx);
    }

    /// Draws one frame of the interface and applies the user's input.
    ///
    /// Returns the requests to the window, and the time that `screen` took.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        simulation: &mut dyn Simulation,
        screen: &mut dyn Screen,
    ) -> (WindowRequests, Duration) {
        let now = ui.ctx().time();
        self.history.sample(now, simulation.status());
        match self.layout.panels && self.layout.lanes {
            true => self.lanes.gather(simulation),
            false => self.lanes.clear(),
        }
        self.notes.retain(|(until, _)| now < *until);
        let mut commands = commands::pressed(ui.ctx());
        let mut actions = dropped_scenes(ui);
        if self.layout.panels {
            self.panels(ui, simulation, &mut commands, &mut actions);
        }
        self.overlays(ui, simulation, &mut commands);
        if !self.layout.panels {
            commands.extend(overlays::panels_button(ui));
        }
        let mut requests = WindowRequests::default();
        for command in commands {
            self.execute(command, simulation, &mut actions, &mut requests);
        }
        if requests.theme {
            let other = if ui.ctx().theme() == egui::Theme::Dark { egui::Theme::Light } else { egui::Theme::Dark };
            ui.ctx().set_theme(other);
        }
        actions.drain(..).for_each(|action| simulation.apply(action));
        let drawing = self.central_panel(ui, simulation, screen);
        (requests, drawing)
    }

    /// Stores the times of a finished frame for the plots.
    pub fn measured(&mut self, times: &FrameTimes) {
        self.history.push_frame(times);
    }

    /// Shows a message of the window for a few seconds; `now_s` is egui's time.
    pub fn note(&mut self, now_s: f64, message: Message) {
        self.notes.push((now_s + NOTE_S, message));
    }

    fn panels(
        &mut self,
        ui: &mut Ui,
        simulation: &dyn Simulation,
        commands: &mut Vec<Command>,
        actions: &mut Vec<Action>,
    ) {
        let status = simulation.status();
        let summary = self.history.summary(status.target_hz);
        // the window is cleared to the panels' colour, so they need not be filled again
        let frame = |x, y| Frame::new().inner_margin(Margin::symmetric(x, y));
        Panel::top("bar").exact_size(44.0).frame(frame(14, 0)).show(ui, |ui| {
            commands.extend(bar::show(ui, status, &summary));
        });
        let room = ui.available_size();
        if room.y < TALL {
            return; // only the picture and the bar fit
        }
        if self.layout.timeline {
            Panel::bottom("timeline").exact_size(timeline::HEIGHT).frame(frame(14, 0)).show(ui, |ui| {
                actions.extend(timeline::show(ui, status));
            });
        }
        if self.layout.lanes {
            let panel = Panel::bottom("lanes").resizable(true).default_size(120.0).min_size(40.0);
            panel.frame(frame(8, 4)).show(ui, |ui| {
                actions.extend(lanes::show(ui, status, &mut self.lanes).map(|id| Action::Select(Some(id))));
            });
        }
        Panel::bottom("agents").resizable(true).default_size(152.0).min_size(70.0).frame(frame(8, 6)).show(ui, |ui| {
            match table::show(ui, status) {
                Some(table::Press::Select(id)) => actions.push(Action::Select(Some(id))),
                Some(table::Press::Frame(id)) => {
                    actions.push(Action::Select(Some(id)));
                    self.frame_object(simulation, Some(id));
                }
                None => {}
            }
        });
        if room.x < BROAD {
            return;
        }
        Panel::right("side").default_size(318.0).size_range(280.0..=460.0).frame(frame(14, 6)).show(ui, |ui| {
            actions.extend(side::show(ui, status, &self.history, &mut self.layout.looks));
        });
        if actions.iter().any(|action| matches!(action, Action::Camera(_))) {
            self.hand.follow_scene();
        }
    }

    fn overlays(&mut self, ui: &Ui, simulation: &dyn Simulation, commands: &mut Vec<Command>) {
        let ctx = ui.ctx();
        if self.help {
            self.help = overlays::help(ctx);
        }
        if let Some(finder) = &mut self.finder {
            let (chosen, open) = overlays::finder(ctx, finder);
            commands.extend(chosen);
            if !open {
                self.finder = None;
            }
        }
        let status = simulation.status();
        let right = ui.ctx().content_rect().right() - if self.layout.panels { 340.0 } else { 16.0 };
        let window = |title: &'static str| {
            let place = egui::pos2(right, 60.0);
            egui::Window::new(title)
                .resizable(false)
                .collapsible(false)
                .pivot(egui::Align2::RIGHT_TOP)
                .default_pos(place)
        };
        window("Cost and rate").open(&mut self.layout.costs).show(ctx, |ui| plots::costs(ui, status));
        let histories = window("Histories").open(&mut self.layout.histories);
        histories.show(ctx, |ui| plots::histories(ui, status, &self.history));
    }

    fn central_panel(&mut self, ui: &mut Ui, simulation: &mut dyn Simulation, screen: &mut dyn Screen) -> Duration {
        egui::CentralPanel::no_frame().show(ui, |ui| self.picture(ui, simulation, screen)).inner
    }

    fn picture(&mut self, ui: &mut Ui, simulation: &mut dyn Simulation, screen: &mut dyn Screen) -> Duration {
        let rect = ui.max_rect();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Picture"));
        for action in self.hand.input(ui, &response, simulation) {
            simulation.apply(action);
        }
        let size = mouse::size_of(rect, ui.ctx().pixels_per_point());
        self.size = size;
        let camera = self.hand.camera(simulation);
        let view = ViewRequest { size, camera: simulation.predict_camera(camera), style: self.layout.looks.style() };
        let start = Instant::now();
        let shape = screen.draw(simulation, &view, rect);
        let drawing = start.elapsed();
        let nothing = || egui::Shape::rect_filled(rect, 0.0, theme::palette(ui).ground);
        ui.painter().add(shape.unwrap_or_else(nothing));
        self.hand.draw(ui, &response, simulation);
        if let Some(shown) = &simulation.status().forces {
            forces::draw(ui, &self.hand.window(ui, &response, simulation), shown);
        }
        let status = simulation.status();
        if self.layout.info {
            overlays::info(ui, rect, status, &self.history.summary(status.target_hz), screen.adapter());
        }
        let notes = self.notes.iter().map(|(_, note)| note.clone());
        let messages: Vec<Message> = status.messages.iter().cloned().chain(notes).collect();
        overlays::messages(ui, rect, &messages);
        drawing
    }

    fn execute(
        &mut self,
        command: Command,
        simulation: &dyn Simulation,
        actions: &mut Vec<Action>,
        requests: &mut WindowRequests,
    ) {
        let status = simulation.status();
        let looks = &mut self.layout.looks;
        match command {
            Command::PauseOrRun => actions.push(if status.running { Action::Pause } else { Action::Run }),
            Command::Step if status.rewind.is_some_and(|rewind| rewind.shown.is_some()) => {
                actions.push(Action::Look(Look::Forward));
            }
            Command::Step => actions.push(Action::SingleStep),
            Command::Back => actions.push(Action::Look(Look::Back)),
            Command::Live => actions.push(Action::Look(Look::Live)),
            Command::Reset => actions.push(Action::Reset),
            Command::Reload => actions.push(Action::Reload),
            Command::Faster => actions.push(Action::Speed(commands::next_speed(status.speed, true))),
            Command::Slower => actions.push(Action::Speed(commands::next_speed(status.speed, false))),
            Command::RealTime => actions.push(Action::Speed(1.0)),
            Command::Frame => self.frame_object(simulation, status.selected),
            Command::Track => self.hand.track = !self.hand.track && status.selected.is_some(),
            Command::SceneCamera => {
                if self.hand.follows_scene() && status.cameras.len() > 1 {
                    actions.push(Action::Camera((status.camera + 1) % status.cameras.len()));
                }
                self.hand.follow_scene();
            }
            Command::Free => self.close_or_deselect(simulation, actions),
            Command::Colours => *looks = looks.plain_or(DrawingOptions { colours: !looks.colours, ..*looks }),
            Command::Depths => *looks = looks.plain_or(DrawingOptions { depths: !looks.depths, ..*looks }),
            Command::Forces => looks.forces = !looks.forces,
            Command::Lanes => self.layout.lanes = !self.layout.lanes,
            Command::Wireframe => looks.wireframe = !looks.wireframe,
            Command::Ages => *looks = looks.plain_or(DrawingOptions { ages: !looks.ages, ..*looks }),
            Command::HideUi => self.layout.panels = !self.layout.panels,
            Command::Timeline => self.layout.timeline = !self.layout.timeline,
            Command::ResetWindow => self.layout = Layout::default(),
            Command::Theme => requests.theme = true,
            Command::Screenshot => requests.screenshot = true,
            Command::Help => self.help = !self.help,
            Command::Info => self.layout.info = !self.layout.info,
            Command::Costs => self.layout.costs = !self.layout.costs,
            Command::Histories => self.layout.histories = !self.layout.histories,
            Command::Palette => self.finder = if self.finder.is_some() { None } else { Some(Finder::default()) },
            Command::Quit => requests.quit = true,
        }
    }

    fn close_or_deselect(&mut self, simulation: &dyn Simulation, actions: &mut Vec<Action>) {
        if self.help || self.finder.is_some() {
            (self.help, self.finder) = (false, None);
        } else {
            actions.push(Action::Select(None));
            self.hand.free(simulation);
        }
    }

    fn frame_object(&mut self, simulation: &dyn Simulation, object: Option<metachron_core::AgentId>) {
        if let Some(bounds) = simulation.bounds(object) {
            self.hand.frame(simulation, &bounds, self.size);
        }
    }
}

fn dropped_scenes(ui: &Ui) -> Vec<Action> {
    let dropped = ui.input(|input| input.raw.dropped_files.clone());
    dropped.into_iter().map(|file| Action::OpenScene(file.path().to_path_buf())).collect()
}
