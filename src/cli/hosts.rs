//! `host`, `view`, `tool` and `identity`: a world that is served to other processes, a window on one that another process serves, a device that
//! leads an object of it, and certificates for all.
//!
//! In: arguments. Out: a served world and what it carries, second by second; the outputs of `run` of a world elsewhere. Never here: messages,
//! the rights of callers.

pub mod args;
mod common;
mod placed;
mod tool;
mod view;

use super::run::stem;
use args::{HostArgs, IdentityCommand};
use common::{LINE_EVERY, red, refused, scene_files, stopped, warn_open};
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, data, message, print_overlaps, warn_priority};
use metachron_hosts::{Authority, Host, Identity, Refusals, SceneFiles, Serving, serve};
use metachron_runtime::{AgentHandle, TimelineCommand};
use metachron_scene::{Limits, Source, load};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Scene, World};
pub(super) use placed::place;
use serde::Serialize;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
pub(super) use tool::tool;
pub(super) use view::view;

/// Whether a scene was given is looked at so often.
const GIVEN_EVERY: Duration = Duration::from_millis(20);

/// A line of a host.
#[derive(Debug, Serialize)]
struct Carried {
    sim_s: f64,
    agents: usize,
    /// Cores that the agents' steps took since the last line.
    cpu: f64,
    callers: usize,
    /// Bytes a second that each caller was sent since the last line.
    sent_bytes_s: f64,
    refused: Refusals,
    /// Whether any process of the network may read and command the world.
    insecure_lan: bool,
}

/// A world that a host serves, with the text and files of its scene.
struct Work {
    world: World,
    name: String,
    files: SceneFiles,
}

/// Serves a scene until Ctrl-C; without one, parts of the scenes that callers give, one after the other.
pub(super) fn host(args: &HostArgs) -> anyhow::Result<Exit> {
    let identity = args.identity.as_ref().map(Identity::from_file).transpose().map_err(refused)?;
    let stopped = stopped()?;
    let (give, given) = channel();
    let mut work = args.scene.as_deref().map(|scene| own_scene(scene, args)).transpose()?;
    loop {
        let world = match &work {
            Some(work) => work.world.clone(),
            None => World::start(&Scene::builder().build()?, ExecutorKind::Lockstep)?,
        };
        let mut serving = Serving::new(&args.name, &args.listen).operators(&args.operators).viewers(&args.viewers);
        if args.scene.is_none() {
            let (give, limits) = (give.clone(), args.limits.limits());
            serving = serving.begins(move |files| {
                let work = given_scene(files, limits).map_err(|error| format!("{error:#}"))?;
                give.send(work).map_err(|_| "the host ends".to_owned())
            });
        }
        let serving = work.iter().fold(serving, |serving, work| serving.scene(work.files.clone()));
        let serving = if args.insecure_lan { serving.insecure_lan() } else { serving };
        let host = serve(Arc::new(world.clone()), identity.clone().into_iter().fold(serving, Serving::identity));
        let host = host.map_err(refused)?;
        let serves = work.as_ref().map_or("waits for work", |work| &*work.name);
        message(&format!("`{}` at {}: {serves}, until Ctrl-C", args.name, args.listen));
        warn_open(host.is_open());
        if args.scene.is_some() && !args.paused {
            world.drive(TimelineCommand::Run);
        }
        let next = carry(&world, &host, &Waits { stopped: &stopped, given: &given }, args.json)?;
        // the answer to the caller that gave it has left
        drop(host);
        drop(world.stop());
        if next.is_none() {
            return Ok(Exit::Ok);
        }
        work = next;
    }
}

/// Signals that end the service of a world.
struct Waits<'a> {
    stopped: &'a Receiver<()>,
    given: &'a Receiver<Work>,
}

/// Says each second what a world carries, until Ctrl-C, or until another scene is given.
fn carry(world: &World, host: &Host, waits: &Waits<'_>, json: bool) -> anyhow::Result<Option<Work>> {
    let mut counted = Counted { at: Instant::now(), cpu_s: 0.0, sent: 0 };
    loop {
        match waits.stopped.recv_timeout(GIVEN_EVERY) {
            Err(RecvTimeoutError::Timeout) => {}
            _ => return Ok(None),
        }
        if let Ok(work) = waits.given.try_recv() {
            return Ok(Some(work));
        }
        if counted.at.elapsed() >= LINE_EVERY {
            data(&line(&carried(world, host, &mut counted), json)?)?;
            host.take_refused().iter().for_each(|(peer, refused)| message(&of_peer(peer, *refused)));
        }
    }
}

/// The scene that a host was started with.
fn own_scene(name: &str, args: &HostArgs) -> anyhow::Result<Work> {
    let source = Source::open(name)?.within(args.limits.limits());
    let scene = load(&source, &args.set)?;
    print_overlaps(&scene);
    warn_priority(&scene);
    let (files, world) = (scene_files(&source, &args.set)?, World::start(&scene, scene.executor)?);
    Ok(Work { world, name: scene.name, files })
}

/// The scene that a caller gives, which is checked as a file is.
fn given_scene(files: SceneFiles, limits: Limits) -> anyhow::Result<Work> {
    let source = Source::recorded(&files.scene.name, &files.scene.text, None)?;
    let scene = load(&source.with_files(files.files.clone()).within(limits), &files.scene.overrides)?;
    Ok(Work { world: World::start(&scene, ExecutorKind::Lockstep)?, name: scene.name, files })
}

/// The sums at a moment of which lines tell the rates.
#[derive(Debug, Clone, Copy)]
struct Counted {
    at: Instant,
    cpu_s: f64,
    sent: u64,
}

/// The world and its callers now, and what came since `counted`.
fn carried(world: &World, host: &Host, counted: &mut Counted) -> Carried {
    let cpu_s = world.agents().iter().map(AgentHandle::cpu_s).sum();
    let now = Counted { at: Instant::now(), cpu_s, sent: host.sent() };
    let before = std::mem::replace(counted, now);
    let span_s = (now.at - before.at).as_secs_f64();
    Carried {
        sim_s: world.time().as_secs_f64(),
        agents: world.all_objects().count(),
        cpu: (now.cpu_s - before.cpu_s).max(0.0) / span_s,
        callers: host.callers(),
        sent_bytes_s: (now.sent - before.sent) as f64 / span_s,
        refused: host.refused(),
        insecure_lan: host.is_open(),
    }
}

fn line(carried: &Carried, json: bool) -> anyhow::Result<String> {
    if json {
        return Ok(serde_json::to_string(carried)? + "\n");
    }
    let Carried { sim_s, agents, cpu, callers, sent_bytes_s, refused, insecure_lan } = carried;
    let sent_kb_s = sent_bytes_s / 1e3;
    let refused = refused.total();
    let open =
        if *insecure_lan { red("  open to the network", std::io::stdout().is_terminal()) } else { String::new() };
    Ok(format!(
        "{sim_s:>9.1} s  {agents} agents  {cpu:.2} cores  {callers} callers, {sent_kb_s:.0} kB/s each  {refused} messages refused{open}\n"
    ))
}

/// The line that says which messages of a peer were refused in the last second.
fn of_peer(peer: &str, refused: Refusals) -> String {
    let Refusals { malformed, flooded, repeated, strangers, forbidden, .. } = refused;
    format!(
        "refused of {peer}: {malformed} malformed, {flooded} too many, {repeated} repeated, {strangers} of strangers, {forbidden} forbidden"
    )
}

/// Makes a certificate, and the authority that issues it where one is wanted.
pub(super) fn identity(command: &IdentityCommand) -> anyhow::Result<Exit> {
    let IdentityCommand::New(args) = command;
    let file = format!("{}.pem", args.name);
    let of = &args.authority;
    if !args.new_authority && !of.exists() {
        let why = format!("{}: no authority is there; expected its file, or --new-authority to make one", of.display());
        return Err(BadInput(why).into());
    }
    let authority =
        if args.new_authority { Authority::new(&stem(&of.to_string_lossy())) } else { Authority::from_file(of) };
    let authority = authority.map_err(refused)?;
    let identity = authority.issue(&args.name, &args.address, args.days).map_err(refused)?;
    if args.new_authority {
        authority.write(of).map_err(refused)?;
        message(&format!("{}: a new authority; its holder can issue every name", of.display()));
    }
    identity.write(&file).map_err(refused)?;
    let addresses: Vec<_> = std::iter::once(&args.name).chain(&args.address).map(String::as_str).collect();
    message(&format!("{file}: {} for {} days, reached as {}", args.name, args.days, addresses.join(", ")));
    Ok(Exit::Ok)
}
