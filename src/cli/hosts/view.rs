//! `view`: a window on a world that another process serves.
//!
//! In: an endpoint. Out: the outputs of `run`, of the frames drawn here. Never here: steps, which are made where the world runs.

use super::args::ViewArgs;
use super::common::{INSECURE, SaidScene, reached, refused, scene_of};
use crate::cli::play::{GoOn, headless, in_window};
use crate::cli::run::{Request, RunLength, check_outputs, check_windowless, finish};
use metachron_console::exit::Exit;
use metachron_hosts::RemoteWorld;
use metachron_session::Session;
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

/// The request to draw the scene that the host says.
fn request(args: &ViewArgs, world: &RemoteWorld) -> anyhow::Result<Request> {
    let SaidScene { scene, source, overrides } = scene_of(&args.endpoint, world, &args.limits, args.target_fps)?;
    Ok(Request {
        window: !args.headless,
        #[cfg(feature = "viewer")]
        reset_window: args.reset_window,
        end: args.frames.map(RunLength::Frames).or(args.seconds.map(RunLength::Seconds)),
        ..Request::of(scene, source, overrides, &args.output, args.size)
    })
}
