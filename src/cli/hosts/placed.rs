//! `run --hosts`: a scene that several hosts step together.
//!
//! In: names of hosts, a request. Out: the same request with a world of its scene on each host. Never here: who steps what.

use super::args::CallArgs;
use super::common::{calling, refused, scene_files};
use crate::cli::args::RunArgs;
use crate::cli::run::Request;
use metachron_console::output::BadInput;
use metachron_console::values::Pin;
use metachron_hosts::{HostsError, RemoteWorld, SceneFiles, connect};
use metachron_world::{PlacedHost, SceneMark};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

/// A host has so long to make a world of a scene and to serve it.
const BEGINS_WITHIN: Duration = Duration::from_secs(30);
/// The host is asked so often.
const ASKED_EVERY: Duration = Duration::from_millis(50);

/// A host of an argument.
struct HostWish<'a> {
    name: &'a str,
    endpoint: String,
}

impl<'a> HostWish<'a> {
    fn of(host: &'a str) -> Self {
        match host.split_once('=') {
            Some((name, endpoint)) => Self { name, endpoint: endpoint.to_owned() },
            None => Self { name: host, endpoint: format!("tls/{host}:7447") },
        }
    }
}

/// Gives the scene of `request` to the hosts that `args` names, if any.
pub(in super::super) fn place(args: &RunArgs, request: &mut Request) -> anyhow::Result<()> {
    if args.hosts.is_empty() && args.host_of.is_empty() {
        return Ok(());
    }
    let wishes: Vec<HostWish<'_>> = args.hosts.iter().map(|host| HostWish::of(host)).collect();
    let names: Vec<&str> = wishes.iter().map(|wish| wish.name).collect();
    let mut endpoints = BTreeSet::new();
    for (number, HostWish { name, endpoint }) in wishes.iter().enumerate() {
        if name.is_empty() || names[..number].contains(name) {
            return Err(BadInput(format!("--hosts: \"{name}\" is empty or there twice")).into());
        }
        if !endpoints.insert(endpoint) {
            return Err(BadInput(format!("--hosts: \"{name}\" is at {endpoint}, and another host too")).into());
        }
    }
    let refuse = |object: &str, host: &str, expected: &str| {
        BadInput(format!("the host of object \"{object}\" is \"{host}\": expected {expected}"))
    };
    for Pin { object, host } in &args.host_of {
        let pinned = request.scene.agents.iter_mut().find(|agent| agent.name == *object);
        let expected = "an object that moves, by its name in the scene";
        pinned.ok_or_else(|| refuse(object, host, expected))?.host = Some(host.clone());
    }
    for agent in &request.scene.agents {
        let Some(host) = agent.host.as_ref().filter(|host| !names.contains(&&***host)) else { continue };
        let of_names = || format!("one of the hosts {}", names.join(", "));
        let expected = if names.is_empty() { "a run with --hosts".to_owned() } else { of_names() };
        return Err(refuse(&agent.name, host, &expected).into());
    }
    let files = scene_files(&request.source, &request.overrides)?;
    for HostWish { name, endpoint } in wishes {
        let world = Arc::new(begun(&endpoint, &args.call, &files, request.scene.mark())?);
        request.hosts.push(PlacedHost { name: name.to_owned(), world });
    }
    Ok(())
}

/// The world of a scene that a host has begun.
fn begun(endpoint: &str, call: &CallArgs, files: &SceneFiles, scene: SceneMark) -> anyhow::Result<RemoteWorld> {
    let waiting = connect(calling(endpoint, call)?).map_err(refused)?;
    waiting.begin(files.clone()).map_err(|error| BadInput(format!("{endpoint}: {error}")))?;
    let (before, asked) = (waiting.run(), Instant::now());
    drop(waiting);
    while asked.elapsed() < BEGINS_WITHIN {
        match connect(calling(endpoint, call)?.scene(scene.clone())) {
            Ok(world) if world.run() != before => return Ok(world),
            // the world before is still served, or nothing yet
            Ok(_) | Err(HostsError::NoWorld { .. } | HostsError::Network { .. } | HostsError::OtherScene { .. }) => {}
            Err(HostsError::World(_)) => {}
            Err(error) => return Err(refused(error)),
        }
        thread::sleep(ASKED_EVERY);
    }
    Err(BadInput(format!("{endpoint}: the host has not begun the scene in {} s", BEGINS_WITHIN.as_secs())).into())
}
