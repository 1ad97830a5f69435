//! `tool`: a device here leads an object of a world that another process serves, and feels what that touches.
//!
//! In: a device, an endpoint. Out: the device's report, second by second. Never here: the phases of a tick, steps.

use super::args::ToolArgs;
use super::common::{LINE_EVERY, reached, refused, scene_of, stopped, warn_open};
use crate::cli::devices::{self, DeviceWish};
use anyhow::Context;
use metachron_console::exit::Exit;
use metachron_console::output::{BadInput, data, message};
use metachron_devices::{DeviceLoop, DeviceReport, LoopOptions, Served};
use metachron_runtime::Command;
use metachron_world::{GhostWorld, WorldCalls, WorldError};
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;
use std::time::{Duration, Instant};

/// The longest wait for the next states of a world: Ctrl-C is noticed so late.
const PATIENCE: Duration = Duration::from_millis(100);

/// Serves a device until Ctrl-C, or for as long as was asked.
pub(in super::super) fn tool(args: &ToolArgs) -> anyhow::Result<Exit> {
    let world = Arc::new(reached(&args.connect, &args.call, false).map_err(refused)?);
    warn_open(world.is_open());
    let scene = scene_of(&args.connect, &world, &args.limits, None)?.scene;
    let bad = |error: WorldError| BadInput(format!("--leads: {error}"));
    // the error of a caller that may only look comes before its device is opened
    world.command(world.object(&args.leads).map_err(bad)?, Command::wake())?;
    let mut ghosts = GhostWorld::of(&scene)?;
    ghosts.follow(&*world)?;
    let device = devices::open(&scene, &DeviceWish { kind: args.device, object: args.leads.clone() })?;
    let device_loop = DeviceLoop::new(ghosts.world(), &args.leads, device, LoopOptions::default()).map_err(bad)?;
    let device_loop = device_loop.elsewhere(Arc::clone(&world) as Arc<dyn WorldCalls>).map_err(bad)?;
    let stopped = stopped()?;
    let served = Served::start(device_loop).context("a device has no thread")?;
    message(&format!("`{}` at {} is led by a device here, until Ctrl-C", args.leads, args.connect));
    let (begun, mut said) = (Instant::now(), Instant::now());
    let mut follows = Ok(());
    while follows.is_ok()
        && stopped.try_recv() == Err(TryRecvError::Empty)
        && args.seconds.is_none_or(|seconds| begun.elapsed().as_secs_f64() < seconds)
    {
        // time that stands brings no later frame, and a host that is silent no answer
        let _ = world.next_frame(world.time(), PATIENCE);
        follows = world.answers().and_then(|()| ghosts.follow(&*world));
        if said.elapsed() >= LINE_EVERY {
            said = Instant::now();
            data(&line(&served.report(), args.json)?)?;
        }
    }
    data(&line(&served.stop(), args.json)?)?;
    if world.lost() > 0 {
        message(&format!("{} poses had no answer within a second", world.lost()));
    }
    Ok(follows.map(|()| Exit::Ok)?)
}

fn line(report: &DeviceReport, json: bool) -> anyhow::Result<String> {
    if json {
        return Ok(serde_json::to_string(report)? + "\n");
    }
    let DeviceReport { ticks, force_mean_n, force_max_n, energy_out_j, tank_j, stale, failures, .. } = report;
    let failed = report.first_failure.as_ref().map_or(String::new(), |why| format!(", first: {why}"));
    Ok(format!(
        "{ticks:>9} ticks  {force_mean_n:.2} N in the mean, {force_max_n:.2} N at most  {energy_out_j:.3} of {tank_j} J given  {stale} stale  {failures} failures{failed}\n"
    ))
}
