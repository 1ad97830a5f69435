//! `view`: a window on a world that another process serves.
//!
//! In: an endpoint. Out: the outputs of `run`, of the frames drawn here. Never here: steps, which are made where the world runs.

use super::args::ViewArgs;
use super::{INSECURE, refused};
use crate::cli::play::{GoOn, headless, in_window};
use crate::cli::run::{Request, RunLength, check_outputs, check_windowless, finish, stem, style};
use metachron_console::exit::Exit;
use metachron_console::output::BadInput;
use metachron_hosts::{Calling, HostsError, Identity, RemoteWorld, connect};
use metachron_scene::{Source, load};
use metachron_session::Session;
use metachron_world::{Pace, WorldCalls};
use std::sync::Arc;

/// Shows a world elsewhere until the window is closed.
pub(in super::super) fn view(args: &ViewArgs) -> anyhow::Result<Exit> {
    check_windowless(&args.output, args.headless)?;
    check_outputs(&args.output, None, None)?;
    let world = reached(args).map_err(refused)?;
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

/// The world at the endpoint of the arguments.
fn reached(args: &ViewArgs) -> Result<RemoteWorld, HostsError> {
    let identity = args.identity.as_ref().map(Identity::from_file).transpose()?;
    let calling = identity.into_iter().fold(Calling::at(&args.endpoint).looking(), Calling::identity);
    connect(if args.insecure_lan { calling.insecure_lan() } else { calling })
}

/// The request to draw the scene that the host says, which is checked as a file is, and must be that of its world.
fn request(args: &ViewArgs, world: &RemoteWorld) -> anyhow::Result<Request> {
    let files = world.scene_files()?.ok_or_else(|| {
        BadInput(format!("{}: the host does not say its scene, and its shapes are not known", args.endpoint))
    })?;
    let source = Source::recorded(&files.scene.name, &files.scene.text, None)?;
    let source = source.with_files(files.files).within(args.limits.limits());
    let of_target = args.target_fps.map(|hz| ("target.frame_hz".to_owned(), hz.to_string()));
    let overrides: Vec<_> = files.scene.overrides.into_iter().chain(of_target).collect();
    let scene = load(&source, &overrides)?;
    let (here, there) = (scene.mark(), world.scene());
    if here.hash != there.hash {
        let why = format!("{}: the host says another scene than the one that its world is of", args.endpoint);
        return Err(BadInput(why).into());
    }
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
