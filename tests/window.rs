//! The window on a real display: it plays a scene, loses its device, comes back, and says so where there is no display or it is gone.
//!
//! A window must be opened on the main thread, which the test harness keeps for itself: so this is a program of its own.
//! It starts an Xvfb of its own; each claim runs in a process with a home of its own. Without Xvfb or an adapter the
//! window is not tested, which METACHRON_REQUIRE_ADAPTER=1 turns into a failure.

use glam::DVec3;
use metachron_core::AgentId;
use metachron_render::{Camera, Gpu, Hit, Picture, Ray};
use metachron_runtime::AgentState;
use metachron_scene::Source;
use metachron_session::Session;
use metachron_viewer::ui::{
    Action, Bounds, FrameTimes, Simulation, Skip, Status, ViewRequest, WindowEnd, WindowError, WindowOptions,
    run_window,
};
use metachron_viewer::{WindowFailure, WindowPlan, play_in_window};
use metachron_world::Pace;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

/// A claim and the function that checks it in its own process. The last is checked without a display.
type Claim = (&'static str, fn());

const CLAIMS: [Claim; 4] = [
    (DISPLAY_GONE, a_display_that_goes_away_ends_the_run_with_its_outcome),
    ("the_tube_plays_in_a_window_and_the_window_ends_with_its_run", the_tube_plays_in_a_window),
    ("a_lost_device_is_replaced_and_the_show_goes_on", a_lost_device_is_replaced_and_the_show_goes_on),
    ("without_a_display_the_error_says_so", without_a_display_the_error_says_so),
];

/// The claim whose process has a display of its own, which is taken away from it.
const DISPLAY_GONE: &str = "a_display_that_goes_away_ends_the_run_with_its_outcome";

/// Pictures before the device is destroyed.
const LOST_AFTER: u64 = 6;
/// Pictures in all.
const PICTURES: usize = 14;
/// A window that has not ended by itself after this long is stuck.
const STUCK: Duration = Duration::from_secs(120);

/// A show of nothing that ends after [`PICTURES`].
struct Empty {
    status: Status,
    picture: Picture,
    frames: Vec<FrameTimes>,
    actions: Vec<Action>,
    begin: Instant,
}

impl Empty {
    fn new() -> Self {
        let status = Status { scene: "nothing".to_owned(), running: true, target_hz: 60.0, ..Status::default() };
        Self { status, picture: Picture::default(), frames: Vec::new(), actions: Vec::new(), begin: Instant::now() }
    }
}

impl Simulation for Empty {
    fn apply(&mut self, action: Action) {
        self.actions.push(action);
    }

    fn compose(&mut self, _view: &ViewRequest) -> &Picture {
        &self.picture
    }

    fn measured(&mut self, times: &FrameTimes) {
        self.frames.push(*times);
    }

    fn status(&self) -> &Status {
        &self.status
    }

    fn scene_camera(&self) -> Camera {
        Camera::looking(DVec3::ONE, DVec3::ZERO, 0.8)
    }

    fn pick(&self, _ray: Ray) -> Option<Hit> {
        None
    }

    fn bounds(&self, _of: Option<AgentId>) -> Option<Bounds> {
        None
    }

    fn wants_close(&mut self) -> bool {
        self.frames.len() >= PICTURES || self.begin.elapsed() > STUCK
    }
}

fn options() -> WindowOptions {
    WindowOptions {
        size: Some([800.0, 500.0]),
        reset: true,
        screenshots: std::env::temp_dir(),
        lose_device_after: Some(LOST_AFTER),
    }
}

fn a_lost_device_is_replaced_and_the_show_goes_on() {
    let mut simulation = Empty::new();
    let end = run_window(&mut simulation, &options());
    assert_eq!(end.unwrap(), WindowEnd::Finished);
    assert_eq!(simulation.frames.len(), PICTURES, "the window was stuck");
    let warm_up = simulation.frames.iter().filter(|frame| frame.skip == Some(Skip::WarmUp)).count();
    assert_eq!(warm_up, 6, "three pictures of each of two devices say nothing");
    assert_eq!(simulation.actions, [], "the show must not notice");
    assert!(simulation.frames.iter().all(|frame| frame.work >= frame.draw && frame.draw > Duration::ZERO));
}

fn without_a_display_the_error_says_so() {
    let mut simulation = Empty::new();
    let error = run_window(&mut simulation, &options()).unwrap_err();
    assert!(matches!(error, WindowError::NoDisplay(_)), "{error}");
    assert!(simulation.frames.is_empty());
}

/// Frames of the run that ends by itself.
const FRAMES: u64 = 8;

fn the_tube_plays_in_a_window() {
    metachron::scenes::provide();
    let source = Source::open("tube").unwrap();
    let session = Session::open(metachron_scene::load(&source, &[]).unwrap(), Pace::RealTime).unwrap();
    let screenshots = std::env::temp_dir();
    let size = Some([800.0, 500.0]);
    let plan = WindowPlan {
        source,
        overrides: Vec::new(),
        size,
        reset: true,
        screenshots,
        seconds: None,
        frames: Some(FRAMES),
    };
    let begin = Instant::now();
    let Ok(outcome) = play_in_window(session, plan, &mut |_, _| begin.elapsed() < STUCK) else { panic!("no window") };
    assert!(!outcome.interrupted, "the window was stuck");
    assert_eq!((outcome.finished, outcome.frames.len() as u64), (FRAMES, FRAMES));
    assert!(outcome.adapter.is_some() && outcome.frames.iter().all(|f| f.triangles > 0 && f.frame_ms > 0.0));
    // the second picture lets time begin
    assert_eq!(outcome.frames[0].sim_s, 0.0);
    assert!(outcome.frames.windows(2).skip(1).all(|f| f[1].sim_s > f[0].sim_s));
    assert!(outcome.agents[0].stats.steps > 0);
    assert!(outcome.agents.iter().all(|agent| !matches!(agent.stats.state, AgentState::Parked(_))));
}

fn a_display_that_goes_away_ends_the_run_with_its_outcome() {
    metachron::scenes::provide();
    let source = Source::open("pendulum").unwrap();
    let session = Session::open(metachron_scene::load(&source, &[]).unwrap(), Pace::RealTime).unwrap();
    let screenshots = std::env::temp_dir();
    let plan = WindowPlan {
        source,
        overrides: Vec::new(),
        size: None,
        reset: true,
        screenshots,
        seconds: None,
        frames: Some(10_000),
    };
    let mut told = false;
    let played = play_in_window(session, plan, &mut |frame, _| {
        if frame.frame >= FRAMES && !told {
            // the display is gone when a line comes back
            println!("{READY}");
            std::io::stdin().read_line(&mut String::new()).unwrap();
            told = true;
        }
        true
    });
    let Err(WindowFailure::Gone(outcome, error)) = played else { panic!("the window is still there") };
    assert!(outcome.interrupted && outcome.finished > FRAMES && outcome.agents[0].stats.steps > 0);
    assert!(error.to_string().contains("no longer responds"), "{error}");
}

/// The line of a process whose display is to be taken away.
const READY: &str = "take the display away";

/// Runs [`DISPLAY_GONE`] in a process of its own on `display`, which ends when that asks for it.
fn holds_without(display: Display, home: &Path) -> bool {
    let mut child = claim(DISPLAY_GONE, Some(&display.name), home);
    let mut child = child.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let said = BufReader::new(child.stdout.take().unwrap());
    let asked = said.lines().map_while(Result::ok).any(|line| line == READY);
    drop(display);
    if let Some(mut stdin) = child.stdin.take().filter(|_| asked) {
        stdin.write_all(b"\n").unwrap();
    }
    told(DISPLAY_GONE, child.wait().unwrap().success())
}

/// A display of our own, gone when this is dropped.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// Starts an Xvfb on a number that it finds free itself; `None` where there is no Xvfb.
    fn start() -> Option<Self> {
        let arguments = ["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"];
        let xvfb = Command::new("Xvfb").args(arguments).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut server = xvfb.ok()?;
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        let name = format!(":{}", number.trim());
        Some(Self { server, name })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // it may have ended by itself
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The process that checks a claim.
fn claim(name: &str, display: Option<&str>, home: &Path) -> Command {
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.args(["--claim", name]).env("HOME", home).env("XDG_DATA_HOME", home).env("XDG_RUNTIME_DIR", home);
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        child.env_remove(variable);
    }
    if let Some(display) = display {
        child.env("DISPLAY", display);
    }
    child
}

/// Runs a claim in a process of its own; gives whether it holds.
fn holds(name: &str, display: Option<&str>, home: &Path) -> bool {
    told(name, claim(name, display, home).status().unwrap().success())
}

fn told(name: &str, holds: bool) -> bool {
    println!("test {name} ... {}", if holds { "ok" } else { "FAILED" });
    holds
}

/// Whether the claim was not left out by a filter on the command line, as libtest takes it.
fn wanted(name: &str) -> bool {
    std::env::args().skip(1).find(|argument| !argument.starts_with('-')).is_none_or(|filter| name.contains(&filter))
}

fn verdict(all_hold: bool) -> ExitCode {
    if all_hold { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, name] = &arguments[..]
        && flag == "--claim"
    {
        let (_, check) = CLAIMS.into_iter().find(|claim| claim.0 == name).unwrap();
        check();
        return ExitCode::SUCCESS;
    }
    let (without, with) = CLAIMS.split_last().expect("there are claims");
    let with: Vec<_> = with.iter().map(|claim| claim.0).filter(|name| wanted(name)).collect();
    if !cfg!(target_os = "linux") || (!wanted(without.0) && with.is_empty()) {
        return ExitCode::SUCCESS;
    }
    let home = tempfile::tempdir().unwrap();
    let refused = !wanted(without.0) || holds(without.0, None, home.path());
    if with.is_empty() {
        return verdict(refused);
    }
    let (display, adapter) = (Display::start(), Gpu::headless().is_ok());
    let Some(display) = display.filter(|_| adapter) else {
        println!("no window was tested: it takes Xvfb and a graphics adapter (adapter found: {adapter})");
        let required = std::env::var_os("METACHRON_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
        return verdict(refused && !required);
    };
    let held = with.iter().filter(|name| match **name {
        DISPLAY_GONE => Display::start().is_some_and(|own| holds_without(own, home.path())),
        name => holds(name, Some(&display.name), home.path()),
    });
    verdict(refused && held.count() == with.len())
}
