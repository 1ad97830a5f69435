//! The common part of the commands of worlds elsewhere: reaching a world, reading its scene, Ctrl-C, errors.
//!
//! In: an endpoint, how it is called. Out: the world there and its scene. Never here: what a command does with them.

use super::args::CallArgs;
use anyhow::Context;
use metachron_console::output::{BadInput, message};
use metachron_console::values::LimitArgs;
use metachron_hosts::{Calling, HostsError, Identity, RemoteWorld, SceneFiles, connect};
use metachron_scene::{Source, load};
use metachron_world::{Scene, SceneText, WorldCalls};
use std::io::IsTerminal;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Lines come so often.
pub(super) const LINE_EVERY: Duration = Duration::from_secs(1);

/// Said where `--insecure-lan` opens a world, or a view of one, to the network.
pub(super) const INSECURE: &str =
    "--insecure-lan: any process of the network may read and command this world, and nothing is encrypted";

/// Says that a world is open to the network, where it is.
pub(super) fn warn_open(is_open: bool) {
    if is_open {
        message(&red(INSECURE, std::io::stderr().is_terminal()));
    }
}

/// In red on a terminal.
pub(super) fn red(text: &str, is_terminal: bool) -> String {
    if is_terminal { format!("\x1b[31m{text}\x1b[0m") } else { text.to_owned() }
}

/// Told of Ctrl-C, of the first one alone.
pub(super) fn stopped() -> anyhow::Result<Receiver<()>> {
    let (stop, stopped) = channel();
    // no reader waits for a second Ctrl-C
    ctrlc::set_handler(move || stop.send(()).unwrap_or(())).context("Ctrl-C cannot be caught")?;
    Ok(stopped)
}

/// The world at an endpoint, to look at or to act on.
pub(super) fn reached(endpoint: &str, call: &CallArgs, is_looking: bool) -> Result<RemoteWorld, HostsError> {
    let calling = calling(endpoint, call)?;
    connect(if is_looking { calling.looking() } else { calling })
}

/// How the world at an endpoint is called.
pub(super) fn calling(endpoint: &str, call: &CallArgs) -> Result<Calling, HostsError> {
    let identity = call.identity.as_ref().map(Identity::from_file).transpose()?;
    let calling = identity.into_iter().fold(Calling::at(endpoint), Calling::identity);
    Ok(if call.insecure_lan { calling.insecure_lan() } else { calling })
}

/// The text of a scene, and the files that it names.
pub(super) fn scene_files(source: &Source, overrides: &[(String, String)]) -> anyhow::Result<SceneFiles> {
    let (name, text) = (source.name().to_owned(), source.text().to_owned());
    let scene = SceneText { name, text, folder: None, overrides: overrides.to_vec() };
    Ok(SceneFiles { scene, files: source.files_beside().map_err(BadInput)? })
}

/// A scene as a host says it, with what it was read from.
pub(super) struct SaidScene {
    pub scene: Scene,
    pub source: Source,
    pub overrides: Vec<(String, String)>,
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

/// An endpoint or a name that cannot be is bad input; a network that fails is a failure.
pub(super) fn refused(error: HostsError) -> anyhow::Error {
    match error {
        HostsError::BadEndpoint { .. }
        | HostsError::BadName { .. }
        | HostsError::NeedsCertificates { .. }
        | HostsError::IdentityOrNot { .. }
        | HostsError::NoCallers
        | HostsError::BadIdentity { .. }
        | HostsError::BadAddress { .. }
        | HostsError::LongScene { .. } => BadInput(error.to_string()).into(),
        other => other.into(),
    }
}
