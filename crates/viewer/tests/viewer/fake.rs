//! A window without a device: a simulation and a screen that write down all requests.

use egui::{Key, Pos2, Rect, Shape};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use metachron_core::{AgentId, Anchor, Resolution, SimTime};
use metachron_render::{Camera, Hit, Picture, Ray, Size};
use metachron_viewer::ui::{
    Action, AgentRow, AgentState, Bounds, FrameTimes, HandStatus, Law, Screen, Simulation, Status, Tuning, TurnRow,
    ViewRequest, Viewer, WindowRequests,
};
use std::collections::{BTreeMap, BTreeSet};

/// A show of three agents around the origin that writes down all requests.
pub struct Fake {
    pub status: Status,
    pub asked: Vec<Action>,
    pub picture: Picture,
    /// Turns that agents have made and that were not asked for yet, and whose were asked for.
    pub turns: BTreeMap<AgentId, Vec<TurnRow>>,
    pub asked_turns: BTreeSet<AgentId>,
}

pub const BALL: AgentId = AgentId(1);

impl Fake {
    pub fn new() -> Self {
        let mut tube = AgentRow::new(AgentId(0), "intestine", "tube");
        (tube.wanted_hz, tube.rate_hz, tube.dt_s, tube.step_s, tube.age_s) = (240.0, 239.4, 4.17e-3, 310e-6, 2.1e-3);
        tube.simulation = Some(Resolution { eps_m: 0.0125, n: 0 });
        tube.picture = Some(Resolution { eps_m: 0.0081, n: 3 });
        let mut ball = AgentRow::new(BALL, "stone", "rigid");
        ball.state = AgentState::Resting;
        let mut tool = AgentRow::new(AgentId(2), "grasper", "tool");
        tool.state = AgentState::Parked("the path left the world".to_owned());
        let status = Status {
            scene: "tube".to_owned(),
            sim_time: SimTime::from_nanos(12_345_000_000),
            running: true,
            speed: 1.0,
            real_time_factor: 0.99,
            target_hz: 30.0,
            policy: "feedback".to_owned(),
            policies: vec!["full".to_owned(), "feedback".to_owned()],
            law: Some(Law::Corrected { kappa: 0.3, lead: 0.0, margin: 0.1 }),
            laws: vec![Law::Printed { alpha: 1e-4, beta: 5.0 }, Law::Corrected { kappa: 0.5, lead: 0.0, margin: 0.1 }],
            agents: vec![tube, ball, tool],
            ..Status::default()
        };
        Self {
            status,
            asked: Vec::new(),
            picture: Picture::default(),
            turns: BTreeMap::new(),
            asked_turns: BTreeSet::new(),
        }
    }
}

impl Simulation for Fake {
    fn apply(&mut self, action: Action) {
        match &action {
            Action::Pause => self.status.running = false,
            Action::Run => self.status.running = true,
            Action::Select(id) => self.status.selected = *id,
            Action::Law(law) => self.status.law = Some(*law),
            Action::TargetFps(hz) => self.status.target_hz = *hz,
            Action::Speed(speed) => self.status.speed = *speed,
            Action::Tune => {
                self.status.tuning = Some(Tuning { done: 0.25, words: "drawing at many resolutions".to_owned() });
            }
            Action::StopTuning => self.status.tuning = None,
            Action::DragStart(hit) => {
                self.status.held = Some(HandStatus { target: hit.point_m, force_n: 0.0 });
            }
            Action::DragEnd => self.status.held = None,
            _ => {}
        }
        self.asked.push(action);
    }

    fn compose(&mut self, _view: &ViewRequest) -> &Picture {
        &self.picture
    }

    fn turns(&mut self, of: AgentId, take: &mut dyn FnMut(TurnRow)) {
        self.asked_turns.insert(of);
        self.turns.remove(&of).into_iter().flatten().for_each(take);
    }

    fn measured(&mut self, _times: &FrameTimes) {}

    fn status(&self) -> &Status {
        &self.status
    }

    fn scene_camera(&self) -> Camera {
        Camera::looking(DVec3::new(1.0, -1.0, 0.8), DVec3::ZERO, 0.8)
    }

    /// A ball of 0.1 m at the origin.
    fn pick(&self, ray: Ray) -> Option<Hit> {
        let along = -ray.origin.dot(ray.direction);
        let nearest = ray.origin + ray.direction * along;
        let hit = Hit { object: BALL, anchor: Anchor::Local(nearest), point_m: nearest, distance_m: along };
        (nearest.length() < 0.1).then_some(hit)
    }

    fn bounds(&self, of: Option<AgentId>) -> Option<Bounds> {
        let radius_m = if of.is_some() { 0.1 } else { 1.0 };
        Some(Bounds { centre: DVec3::ZERO, radius_m })
    }
}

/// A screen without a device that keeps the requests to draw.
#[derive(Default)]
pub struct Blank {
    pub views: Vec<ViewRequest>,
}

impl Screen for Blank {
    fn draw(&mut self, simulation: &mut dyn Simulation, view: &ViewRequest, _over: Rect) -> Option<Shape> {
        simulation.compose(view);
        self.views.push(view.clone());
        None
    }

    fn adapter(&self) -> &str {
        "no adapter"
    }
}

/// The interface, and the simulation and screen that it is shown on.
pub struct World {
    pub viewer: Viewer,
    pub simulation: Fake,
    pub screen: Blank,
    pub requests: WindowRequests,
    /// The size of the harness's drawing area for the interface: its window without a margin.
    pub inner: Size,
}

/// A window of 1280 by 800 before the three agents.
pub fn window() -> Harness<'static, World> {
    window_of(Fake::new())
}

/// The same before another show.
pub fn window_of(simulation: Fake) -> Harness<'static, World> {
    let world = World {
        viewer: Viewer::default(),
        simulation,
        screen: Blank::default(),
        requests: WindowRequests::default(),
        inner: Size { width: 0, height: 0 },
    };
    let draw = |ui: &mut egui::Ui, world: &mut World| {
        let room = ui.max_rect().size();
        world.inner = Size { width: room.x.round() as u32, height: room.y.round() as u32 };
        let (requests, _) = world.viewer.ui(ui, &mut world.simulation, &mut world.screen);
        world.requests.screenshot |= requests.screenshot;
        world.requests.quit |= requests.quit;
    };
    let mut harness = Harness::builder()
        .with_size(egui::vec2(1280.0, 800.0))
        .with_os(egui::os::OperatingSystem::Nix)
        .with_context_setup(Viewer::install)
        .build_ui_state(draw, world);
    harness.run_steps(2);
    harness
}

/// Its actions since the last call.
pub fn asked(harness: &mut Harness<'static, World>) -> Vec<Action> {
    harness.run_steps(2);
    std::mem::take(&mut harness.state_mut().simulation.asked)
}

/// Its actions when this key is pressed.
pub fn press(harness: &mut Harness<'static, World>, key: Key) -> Vec<Action> {
    harness.key_press(key);
    asked(harness)
}

/// Its last request for a view.
pub fn last_view(harness: &Harness<'static, World>) -> ViewRequest {
    harness.state().screen.views.last().unwrap().clone()
}

/// The middle of the picture, where the fake ball is seen.
pub fn middle(harness: &Harness<'static, World>) -> Pos2 {
    harness.get_by_label("Picture").rect().center()
}
