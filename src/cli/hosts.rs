//! `host`, `view`, `tool` and `identity`: a world that is served to other processes, a window on one that another process serves, a device that
//! leads an object of it, and certificates for all.
//!
//! In: arguments. Out: a served world and what it carries, second by second; the outputs of `run` of a world elsewhere. Never here: messages,
//! the rights of callers.

pub mod args;
mod common;
mod tool;
mod view;

use super::run::stem;
use args::{HostArgs, IdentityCommand};
use common::{LINE_EVERY, red, refused, stopped, warn_open};
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, data, message, print_overlaps, warn_priority};
use metachron_hosts::{Authority, Host, Identity, Refusals, SceneFiles, Serving, serve};
use metachron_runtime::{AgentHandle, TimelineCommand};
use metachron_scene::{Source, load};
use metachron_world::{SceneText, World};
use serde::Serialize;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Instant;
pub(super) use tool::tool;
pub(super) use view::view;

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

/// Serves a scene until Ctrl-C.
pub(super) fn host(args: &HostArgs) -> anyhow::Result<Exit> {
    let source = Source::open(&args.scene)?.within(args.limits.limits());
    let scene = load(&source, &args.set)?;
    print_overlaps(&scene);
    warn_priority(&scene);
    let world = World::start(&scene, scene.executor)?;
    let (name, text) = (source.name().to_owned(), source.text().to_owned());
    let text = SceneText { name, text, folder: None, overrides: args.set.clone() };
    let files = source.files_beside().map_err(BadInput)?;
    let serving = Serving::new(&args.name, &args.listen).scene(SceneFiles { scene: text, files });
    let serving = serving.operators(&args.operators).viewers(&args.viewers);
    let serving = if args.insecure_lan { serving.insecure_lan() } else { serving };
    let identity = args.identity.as_ref().map(Identity::from_file).transpose().map_err(refused)?;
    let serving = identity.into_iter().fold(serving, Serving::identity);
    let host = serve(Arc::new(world.clone()), serving).map_err(refused)?;
    let stopped = stopped()?;
    message(&format!("`{}` serves {} at {}, until Ctrl-C", args.name, scene.name, args.listen));
    warn_open(host.is_open());
    if !args.paused {
        world.drive(TimelineCommand::Run);
    }
    let mut counted = Counted { at: Instant::now(), cpu_s: 0.0, sent: 0 };
    while matches!(stopped.recv_timeout(LINE_EVERY), Err(RecvTimeoutError::Timeout)) {
        data(&line(&carried(&world, &host, &mut counted), args.json)?)?;
        host.take_refused().iter().for_each(|(peer, refused)| message(&of_peer(peer, *refused)));
    }
    drop(host);
    world.stop();
    Ok(Exit::Ok)
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
