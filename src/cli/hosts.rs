//! `host` and `view`: a world that is served to other processes, and a window on one that another process serves.
//!
//! In: arguments. Out: a served world and what it carries, second by second; the outputs of `run` of a world elsewhere. Never here: messages,
//! who is let in.

pub mod args;
mod view;

use anyhow::Context;
use args::HostArgs;
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, data, message, print_overlaps, warn_priority};
use metachron_hosts::{Host, HostsError, SceneFiles, Serving, serve};
use metachron_runtime::{AgentHandle, TimelineCommand};
use metachron_scene::{Source, load};
use metachron_world::{SceneText, World};
use serde::Serialize;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};
pub(super) use view::view;

/// A line of a host.
#[derive(Debug, Serialize)]
struct Carried {
    sim_s: f64,
    agents: usize,
    /// Cores that the agents' steps took since the last line.
    cpu: f64,
    callers: usize,
    refused: RefusedRow,
}

#[derive(Debug, Serialize)]
struct RefusedRow {
    malformed: u64,
    flooded: u64,
    repeated: u64,
    strangers: u64,
}

/// Lines come so often.
const LINE_EVERY: Duration = Duration::from_secs(1);

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
    let host = serve(Arc::new(world.clone()), serving).map_err(refused)?;
    let (stop, stopped) = channel();
    // no reader waits for a second Ctrl-C
    ctrlc::set_handler(move || stop.send(()).unwrap_or(())).context("Ctrl-C cannot be caught")?;
    message(&format!("`{}` serves {} at {}, until Ctrl-C", args.name, scene.name, args.listen));
    if !args.paused {
        world.drive(TimelineCommand::Run);
    }
    let mut counted = (Instant::now(), 0.0);
    while matches!(stopped.recv_timeout(LINE_EVERY), Err(RecvTimeoutError::Timeout)) {
        data(&line(&carried(&world, &host, &mut counted), args.json)?)?;
    }
    drop(host);
    world.stop();
    Ok(Exit::Ok)
}

/// The world and its callers now; `counted` is when CPU time was last read, and its value then, seconds.
fn carried(world: &World, host: &Host, counted: &mut (Instant, f64)) -> Carried {
    let now = (Instant::now(), world.agents().iter().map(AgentHandle::cpu_s).sum::<f64>());
    let before = std::mem::replace(counted, now);
    let refused = host.refused();
    Carried {
        sim_s: world.time().as_secs_f64(),
        agents: world.all_objects().count(),
        cpu: (now.1 - before.1).max(0.0) / (now.0 - before.0).as_secs_f64(),
        callers: host.callers(),
        refused: RefusedRow {
            malformed: refused.malformed,
            flooded: refused.flooded,
            repeated: refused.repeated,
            strangers: refused.strangers,
        },
    }
}

fn line(carried: &Carried, json: bool) -> anyhow::Result<String> {
    if json {
        return Ok(serde_json::to_string(carried)? + "\n");
    }
    let Carried { sim_s, agents, cpu, callers, refused } = carried;
    let RefusedRow { malformed, flooded, repeated, strangers } = refused;
    let refused = malformed + flooded + repeated + strangers;
    Ok(format!("{sim_s:>9.1} s  {agents} agents  {cpu:.2} cores  {callers} callers  {refused} messages refused\n"))
}

/// An endpoint or a name that cannot be is bad input; a network that fails is a failure.
fn refused(error: HostsError) -> anyhow::Error {
    match error {
        HostsError::BadEndpoint { .. } | HostsError::BadName { .. } | HostsError::NeedsCertificates { .. } => {
            BadInput(error.to_string()).into()
        }
        other => other.into(),
    }
}
