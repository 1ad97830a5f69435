//! `view`: a window on a world that another process serves.
//!
//! In: an endpoint. Out: the outputs of `run`, of the frames drawn here. Never here: steps, which are made where the world runs.

use super::args::{CallArgs, ViewArgs};
use super::{INSECURE, refused};
use crate::cli::play::{GoOn, headless, in_window};
use crate::cli::run::{Request, RunLength, check_outputs, check_windowless, finish, stem, style};
use metachron_console::exit::Exit;
use metachron_console::output::BadInput;
use metachron_console::values::LimitArgs;
use metachron_hosts::{Calling, HostsError, Identity, RemoteWorld, connect};
use metachron_scene::{Source, load};
use metachron_session::Session;
use metachron_world::{Pace, Scene, WorldCalls};
use std::sync::Arc;

/// Shows a world elsewhere until the window is closed.
pub(in super::super) fn view(args: &ViewArgs) -> anyhow::Result<Exit> {
    check_windowless(&args.output, args.headless)?;
    check_outputs(&args.output, None, None)?;
    let world = reached(&args.endpoint, &args.call, true).map_err(refused)?;
    let request = request(args, &world)?;
    let play = |go_on: GoOn<'_>| {
        let mut session = Session::open_elsewhere(request.scene.clone(), Arc::new(world.clone()))?;
        if world.is_open() {
            session.note(INSECURE.to_owned());
        }
        if request.window {
            in_window(session, &request, go_on)
        } else {
            headless(session, &request, request.png.clone(), go_on)
        }
    };
    finish(&args.output, &play, &request.scene.name)
}

/// The world at an endpoint, to look at or to act on.
pub(super) fn reached(endpoint: &str, call: &CallArgs, is_looking: bool) -> Result<RemoteWorld, HostsError> {
    let identity = call.identity.as_ref().map(Identity::from_file).transpose()?;
    let calling = identity.into_iter().fold(Calling::at(endpoint), Calling::identity);
    let calling = if is_looking { calling.looking() } else { calling };
    connect(if call.insecure_lan { calling.insecure_lan() } else { calling })
}

/// A scene as a host says it, with what it was read from.
pub(super) struct SaidScene {
    pub scene: Scene,
    source: Source,
    overrides: Vec<(String, String)>,
}

/// The scene that the host says, which is checked as a file is, and must be that of its world; another target frame rate where one is given.
pub(super) fn scene_of(
    endpoint: &str,
    world: &RemoteWorld,
    limits: &LimitArgs,
    target_fps: Option<f64>,
) -> anyhow::Result<SaidScene> {
    let files = world.scene_files()?.ok_or_else(|| {
        BadInput(format!("{endpoint}: the host does not say its scene, and its shapes are not known"))
    })?;
    let source = Source::recorded(&files.scene.name, &files.scene.text, None)?;
    let source = source.with_files(files.files).within(limits.limits());
    let of_target = target_fps.map(|hz| ("target.frame_hz".to_owned(), hz.to_string()));
    let overrides: Vec<_> = files.scene.overrides.into_iter().chain(of_target).collect();
    let scene = load(&source, &overrides)?;
    let (here, there) = (scene.mark(), world.scene());
    if here.hash != there.hash {
        let why = format!("{endpoint}: the host says another scene than the one that its world is of");
        return Err(BadInput(why).into());
    }
    Ok(SaidScene { scene, source, overrides })
}

/// The request to draw the scene that the host says.
fn request(args: &ViewArgs, world: &RemoteWorld) -> anyhow::Result<Request> {
    let SaidScene { scene, source, overrides } = scene_of(&args.endpoint, world, &args.limits, args.target_fps)?;
    Ok(Request {
        quiet: args.output.quiet,
        overrides,
        pace: Pace::RealTime,
        window: !args.headless,
        #[cfg(feature = "viewer")]
        reset_window: args.reset_window,
        end: args.frames.map(RunLength::Frames).or(args.seconds.map(RunLength::Seconds)),
        size: args.size,
        style: style(&args.output.style),
        oracle: false,
        png: args.output.png.clone(),
        depth: args.output.depth.clone(),
        camera: args.output.camera.clone(),
        video: args.output.video.clone(),
        exports: args.output.exports(),
        devices: Vec::new(),
        record: None,
        png_without_window: format!("metachron-{}.png", stem(&scene.name)).into(),
        scene,
        source,
    })
}
