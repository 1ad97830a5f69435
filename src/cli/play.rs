//! Plays a request and turns the outcome into a report.
//!
//! In: a [`Request`]. Out: [`Played`]. This is where the command line meets the frame loop; never here: the loop itself.

use super::devices;
use super::exports::Exports;
use super::run::{Played, Request, RunLength, Step};
use anyhow::Context;
use metachron_console::output::BadInput;
use metachron_core::{AgentId, AttachmentEvent, ClusterState, ContactPartner, SensorTouch, SimSpan};
use metachron_lod::Bound;
use metachron_render::Size;
#[cfg(feature = "render")]
use metachron_render::{Gpu, GpuError, Offscreen, RendererOptions};
use metachron_runtime::{AgentState, Percentiles, TimelineCommand};
use metachron_session::report::{
    AgentReport, BudgetReport, ClusterRow, CouplingError, CouplingReport, EventReport, HostReport, MovedReport,
    OverlapReport, ProbeReport, Quantiles, ReadingReport, ReferenceReport, Report, SensorReport, summarise,
    summarise_choices, summarise_undrawn,
};
use metachron_session::{
    AgentOutcome, Coupling, Drawing, End, Event, FrameRecord, Headless, Outcome, PairError, ProbeOutcome,
    ReferenceComparison, Sensing, Session, compare_with_reference, play_headless,
};
#[cfg(feature = "viewer")]
use metachron_viewer::ui::WindowError;
#[cfg(feature = "viewer")]
use metachron_viewer::{WindowFailure, WindowPlan, play_in_window};
use metachron_world::kinds::ExecutorKind;
use metachron_world::{HostLoad, Pace, PlacedWorld, Reading, RecordingFile, Scene, SceneText, Sensor, WorldCalls};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Begins to write down the commands to the run.
fn record(session: &Session, path: &Path, request: &Request) -> anyhow::Result<()> {
    let file = RecordingFile::create(path).context("the recording cannot be written")?;
    let scene = SceneText {
        name: request.source.name().to_owned(),
        text: request.source.text().to_owned(),
        folder: request.source.folder().map(|folder| folder.to_string_lossy().into_owned()),
        overrides: request.overrides.clone(),
    };
    Ok(session.begin_recording(Box::new(file), scene)?)
}

/// Called for every frame; returns whether to go on.
pub(super) type GoOn<'a> = &'a mut dyn FnMut(Step) -> bool;

/// Width and height of a headless picture where no size is given, pixels.
const PICTURE_SIZE: [u32; 2] = [1280, 720];

/// Plays a request: in a window where one can be opened, else without.
///
/// # Errors
/// Errors of the models, the executor or the adapter.
pub(super) fn play(request: &Request, go_on: GoOn<'_>) -> anyhow::Result<Played> {
    let placed = match &*request.hosts {
        [] => None,
        hosts => Some(Arc::new(PlacedWorld::start(&request.scene, hosts.to_vec())?)),
    };
    let mut session = match &placed {
        Some(placed) => Session::open_elsewhere(request.scene.clone(), Arc::clone(placed) as Arc<dyn WorldCalls>)?,
        None => Session::open(request.scene.clone(), request.pace)?,
    };
    if !request.quiet {
        session.report_start_up(metachron_console::output::message);
    }
    if request.oracle {
        session.keep_trace();
    }
    if let Some(path) = &request.record {
        record(&session, path, request)?;
    }
    let served = devices::serve(&session, &request.scene, &request.devices)?;
    let timed = placed.as_ref().map(|placed| flowing(placed, &session, request)).transpose()?;
    let request = timed.as_ref().unwrap_or(request);
    // from the first frame on: before it an adapter is opened
    let mut flows = placed.clone();
    let go_on: GoOn<'_> = &mut |step| {
        let begun = flows.take().map_or(Ok(()), |placed| placed.drive(TimelineCommand::Run));
        go_on(step) && begun.is_ok()
    };
    let mut played = if request.window {
        in_window(session, request, go_on)?
    } else {
        headless(session, request, request.png.clone(), go_on)?
    };
    played.report.devices = devices::reports(served);
    if let Some(placed) = placed {
        report_hosts(&mut played.report, &placed, request.pace);
    }
    Ok(played)
}

/// Lets the time of hosts pass, to a whole frame as in one process; the request of what is seen of it, which ends at the same moment.
fn flowing(placed: &Arc<PlacedWorld>, session: &Session, request: &Request) -> anyhow::Result<Request> {
    let mut request = request.clone();
    let period = SimSpan::from_nanos(session.period().as_nanos() as u64);
    let ends = if request.window { request.end } else { Some(request.headless_end()) };
    let frames = match ends {
        Some(RunLength::Seconds(s)) => SimSpan::from_secs_f64(s).map(|s| s.as_nanos().div_ceil(period.as_nanos())),
        Some(RunLength::Frames(frames)) => Some(frames),
        Some(RunLength::Recording) | None => None,
    };
    let length = frames.map(|frames| SimSpan::from_nanos(period.as_nanos().saturating_mul(frames)));
    placed.let_flow(request.pace == Pace::Free, length.map(|length| placed.time() + length))?;
    if let (Some(RunLength::Seconds(_)), Some(length)) = (ends, length) {
        request.end = Some(RunLength::Seconds(length.as_secs_f64()));
    }
    Ok(request)
}

/// Says in the report of a run on hosts who stepped what.
fn report_hosts(report: &mut Report, placed: &PlacedWorld, pace: Pace) {
    for agent in &mut report.agents {
        let object = placed.object(&agent.name).ok();
        agent.host = object.and_then(|object| placed.host_of(object)).map(str::to_owned);
    }
    report.hosts = placed.loads().into_iter().map(host_report).collect();
    report.executor = ExecutorKind::Lockstep.name().to_owned();
    report.escapes = Some(placed.escapes());
    if pace == Pace::Free {
        report.pace = "free";
    }
}

fn host_report(HostLoad { name, lost, objects, cpu, waited, moved, reborn }: HostLoad) -> HostReport {
    let (cpu_s, link_ms) = (cpu.as_secs_f64(), waited.as_secs_f64() * 1e3);
    HostReport { name, agents: objects, cpu_s, link_ms, moved, reborn, lost }
}

#[cfg(not(feature = "viewer"))]
pub(super) fn in_window(session: Session, request: &Request, go_on: GoOn<'_>) -> anyhow::Result<Played> {
    let png = cfg!(feature = "render").then(|| request.png_without_window.clone());
    let mut played = headless(session, request, png, go_on)?;
    played.no_window = Some("this build cannot open a window: it lacks the feature `viewer`".to_owned());
    Ok(played)
}

#[cfg(feature = "viewer")]
pub(super) fn in_window(mut session: Session, request: &Request, go_on: GoOn<'_>) -> anyhow::Result<Played> {
    choose_camera(&mut session, request)?;
    match play_in_window(session, window_plan(request), &mut |record, done| go_on(step(record, done))) {
        Ok(outcome) => Ok(played(&request.scene, outcome, None)),
        Err(WindowFailure::NoWindow(session, why)) => without_window(*session, &why, request, go_on),
        Err(WindowFailure::Gone(outcome, why)) => {
            Ok(Played { failure: Some(why.to_string()), ..played(&request.scene, *outcome, None) })
        }
    }
}

#[cfg(feature = "viewer")]
fn window_plan(request: &Request) -> WindowPlan {
    let (frames, seconds) = match request.end {
        Some(RunLength::Frames(frames)) => (Some(frames), None),
        Some(RunLength::Seconds(seconds)) => (None, Some(seconds)),
        Some(RunLength::Recording) | None => (None, None),
    };
    WindowPlan {
        source: request.source.clone(),
        overrides: request.overrides.clone(),
        size: request.size.map(|[width, height]| [width as f32, height as f32]),
        reset: request.reset_window,
        screenshots: PathBuf::from("."),
        seconds,
        frames,
    }
}

/// A window was requested and cannot be opened: the run goes on without it, and leaves a picture.
#[cfg(feature = "viewer")]
fn without_window(session: Session, why: &WindowError, request: &Request, go_on: GoOn<'_>) -> anyhow::Result<Played> {
    let mut played = headless(session, request, Some(request.png_without_window.clone()), go_on)?;
    played.no_window = Some(why.to_string());
    Ok(played)
}

/// Uses the camera that the user has named.
fn choose_camera(session: &mut Session, request: &Request) -> anyhow::Result<()> {
    let Some(name) = &request.camera else { return Ok(()) };
    let Some(number) = session.camera_names().position(|known| known == name) else {
        let known: Vec<_> = session.camera_names().collect();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        return Err(BadInput(format!("the scene has no camera `{name}`; its cameras are: {known}")).into());
    };
    session.use_camera(number);
    Ok(())
}

pub(super) fn headless(
    mut session: Session,
    request: &Request,
    png: Option<PathBuf>,
    go_on: GoOn<'_>,
) -> anyhow::Result<Played> {
    choose_camera(&mut session, request)?;
    let [width, height] = request.size.unwrap_or(PICTURE_SIZE);
    let size = Size { width, height };
    let drawing = drawing(&session, request, request.draws(png.is_some()), size)?;
    let picture = png.clone().filter(|_| !matches!(drawing, Drawing::Nothing));
    let end = match request.headless_end() {
        RunLength::Frames(frames) => End::Frames(frames),
        RunLength::Seconds(seconds) => End::Seconds(seconds),
        RunLength::Recording => End::Recording,
    };
    let (depth, film) = (request.depth.clone(), request.video.clone());
    let plan = Headless { end, size, style: request.style, drawing, png, depth, film };
    // the second run takes about as long as the first, so each is half of the whole
    let half = if request.oracle { 0.5 } else { 1.0 };
    let mut exports = Exports::create(&request.exports, &request.scene, session.world())?;
    let outcome = play_headless(session, plan, &mut |record, done| {
        exports.take(record) && go_on(step(record, Some(half * done)))
    })?;
    let unwritten = exports.finish().err().map(|error| error.to_string());
    if !request.oracle || outcome.interrupted || outcome.cut_off.is_some() {
        let played = played(&request.scene, outcome, picture);
        return Ok(Played { oracle: request.oracle, failure: played.failure.clone().or(unwritten), ..played });
    }
    let last = outcome.frames.last().copied().unwrap_or_default();
    let oracle =
        compare_with_reference(&request.scene, &outcome, &mut |done| go_on(step(&last, Some(half + half * done))))?;
    let mut played = played(&request.scene, outcome, picture);
    played.oracle = true;
    played.interrupted = oracle.interrupted;
    played.report.oracle = Some(reference_report(&request.scene, &oracle));
    Ok(played)
}

/// Without the feature `render` nothing is drawn, and a picture that the user asked for cannot be.
#[cfg(not(feature = "render"))]
fn drawing(_: &Session, _: &Request, picture: bool, _: Size) -> anyhow::Result<Drawing> {
    if picture {
        return Err(metachron_console::output::BadInput(
            "this build cannot draw pictures: it lacks the feature `render`".to_owned(),
        )
        .into());
    }
    Ok(Drawing::Nothing)
}

/// How frames are drawn: in virtual time only a requested picture, in real time every frame if there is an adapter. Without an
/// adapter the run fails where the user named a file for the picture.
#[cfg(feature = "render")]
fn drawing(session: &Session, request: &Request, picture: bool, size: Size) -> anyhow::Result<Drawing> {
    if session.is_virtual() && !picture {
        return Ok(Drawing::Nothing);
    }
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(error @ GpuError::NoAdapter { .. }) if !request.draws(request.png.is_some()) => {
            if !request.quiet {
                metachron_console::output::message(&format!("nothing is drawn: {error}"));
            }
            return Ok(Drawing::Nothing);
        }
        Err(error) => {
            let error = anyhow::Error::from(error);
            return Err(match request.png.as_ref().or(request.depth.as_ref()).or(request.video.as_ref()) {
                Some(path) => error.context(format!("the picture {} cannot be drawn", path.display())),
                None => error,
            });
        }
    };
    if session.is_virtual() {
        return Ok(Drawing::Last(Box::new(Offscreen::new(gpu, size, RendererOptions::STILL)?)));
    }
    let options = RendererOptions::for_adapter(&gpu.info);
    Ok(Drawing::Every(Box::new(Offscreen::new(gpu, size, options)?)))
}

/// An error with its causes, in a line.
fn shown_with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

fn step(record: &FrameRecord, done: Option<f64>) -> Step {
    Step { done, sim_s: record.sim_s, frame_ms: record.frame_ms }
}

fn played(scene: &Scene, outcome: Outcome, picture: Option<PathBuf>) -> Played {
    let warm = outcome.warm_up.min(outcome.frames.len().saturating_sub(1));
    let frames = &outcome.frames[warm..];
    let mut summary = summarise(frames, outcome.target_ms);
    let mut choices = summarise_choices(frames);
    let declared = scene.executor == ExecutorKind::Lockstep;
    if outcome.adapter.is_none() && !declared {
        (summary, choices) = (summarise_undrawn(frames), choices.undrawn());
    }
    let spent_share = summary.frame_ms.map(|work| work.mean / outcome.target_ms);
    let clusters = clusters(scene, &outcome);
    let report = Report {
        scene: outcome.scene,
        policy: outcome.policy.to_owned(),
        law: outcome.law.to_owned(),
        executor: outcome.executor.to_owned(),
        pace: outcome.pace,
        adapter: outcome.adapter,
        frames: outcome.finished,
        sim_s: outcome.sim_s,
        wall_s: outcome.wall_s,
        start_up_s: outcome.start_up_s,
        cpu_s: outcome.cpu_s,
        state_hash: format!("{:016x}", outcome.state_hash),
        target_ms: outcome.target_ms,
        summary,
        agents: outcome.agents.iter().map(|one| agent(scene, one)).collect(),
        couplings: outcome.couplings.iter().map(|one| coupling(scene, one)).collect(),
        events: outcome.events.iter().map(|one| event(scene, one)).collect(),
        sensors: outcome.sensors.iter().map(|one| sensor(scene, one)).collect(),
        readings: scene
            .sensors
            .iter()
            .zip(&outcome.readings)
            .map(|(sensor, read)| reading(sensor, read.as_ref()))
            .collect(),
        devices: Vec::new(),
        hosts: Vec::new(),
        escapes: None,
        parked: outcome.agents.iter().filter(|one| matches!(one.stats.state, AgentState::Parked(_))).count() as u32,
        clusters,
        notes: outcome.notes,
        overlaps: scene.overlaps.iter().map(OverlapReport::of).collect(),
        moved: scene.moved.iter().map(MovedReport::of).collect(),
        oracle: None,
        budget: BudgetReport { spent_share, clamped: outcome.clamp, choices },
        probes: outcome.probes.iter().map(probe).collect(),
    };
    let (unpriced, interrupted) = (outcome.unpriced, outcome.interrupted);
    Played {
        report,
        frames: outcome.frames,
        no_window: None,
        failure: outcome.cut_off.map(|error| shown_with_causes(&*error)),
        picture,
        unpriced,
        oracle: false,
        interrupted,
    }
}

fn agent(scene: &Scene, agent: &AgentOutcome) -> AgentReport {
    let stats = &agent.stats;
    let parked_reason = match &stats.state {
        AgentState::Parked(reason) => Some(reason.clone()),
        AgentState::Running | AgentState::Stalled | AgentState::Resting | AgentState::Gone => None,
    };
    AgentReport {
        name: stats.name.to_string(),
        model: stats.model.to_owned(),
        host: None,
        state: match &stats.state {
            AgentState::Running => "running",
            AgentState::Stalled => "stalled",
            AgentState::Resting => "resting",
            AgentState::Parked(_) => "parked",
            AgentState::Gone => "gone",
        },
        steps: stats.steps,
        rate_hz: stats.mean_hz,
        wanted_hz: stats.wanted_hz,
        dt_ms: stats.dt.as_secs_f64() * 1e3,
        eps_m: stats.resolution.map(|held| held.eps_m),
        nodes: stats.nodes,
        n: agent.picture.map(|drawn| drawn.n),
        picture_eps_m: agent.picture.filter(|_| stats.resolution.is_some()).map(|drawn| drawn.eps_m),
        cpu_s: stats.cpu_s,
        age_ms: quantiles(stats.age),
        late_ms: quantiles(stats.late),
        lived_s: stats.lived.as_secs_f64(),
        given_up_s: agent.given_up_s,
        lengthened: stats.lengthened,
        under_resolved: (stats.under_resolved > 0).then_some(stats.under_resolved),
        dropped_ms: stats.dropped.as_secs_f64() * 1e3,
        rested_ms: stats.rested.as_secs_f64() * 1e3,
        led_by: stats.led_by.map(|id| scene.name_of(id).to_owned()),
        parked: parked_reason.is_some(),
        parked_reason,
        energy_j: stats.energy_j,
        residual_m: stats.residual_m,
        drift_m: stats.drift_m,
        tolerance_m: agent.tolerance.map(|status| status.tolerance_m),
        rests: agent.tolerance.and_then(|status| status.rests).map(|end| match end {
            Bound::Finest => "finest",
            Bound::Coarsest => "coarsest",
        }),
    }
}

fn quantiles(times: Percentiles) -> Quantiles {
    Quantiles { p50: times.p50_s * 1e3, p99: times.p99_s * 1e3 }
}

/// The clusters of more than one member, or with contacts, by their leaders.
fn clusters(scene: &Scene, outcome: &Outcome) -> Vec<ClusterRow> {
    let parts = &outcome.clusters;
    let name = |at: usize| scene.name_of(AgentId(at as u32)).to_owned();
    let led = |leader: AgentId| {
        let all = parts.iter().enumerate().filter_map(move |(at, part)| Some((at, (*part)?)));
        all.filter(move |(_, part)| part.leader == leader)
    };
    let row = |(at, part): (usize, &Option<ClusterState>)| {
        let leader = AgentId(at as u32);
        let state = part.filter(|state| state.leader == leader)?;
        let solves = state.solves?;
        let members: Vec<String> = led(leader).map(|(at, _)| name(at)).collect();
        (members.len() > 1 || solves.contacts > 0).then(|| ClusterRow {
            id: name(at),
            members,
            h_ms: state.step_s * 1e3,
            slack: 1.0 - outcome.agents[at].stats.turn_s / state.step_s,
            steps: led(leader).map(|(_, part)| part.parts).collect(),
            contacts: solves.contacts,
            problems: solves.problems,
            factors: solves.factors as f64 / solves.problems.max(1) as f64,
            products: solves.products as f64 / solves.problems.max(1) as f64,
            unfinished: solves.unfinished,
            level: solves.level.name(),
            miss_m_s: solves.miss_m_s,
            depth_m: solves.depth_m,
            depth_max_m: solves.deepest_m,
            depth_wanted_m: scene.contact_depth_m,
        })
    };
    parts.iter().enumerate().filter_map(row).collect()
}

fn coupling(scene: &Scene, coupling: &Coupling) -> CouplingReport {
    let name = |id: AgentId| scene.name_of(id).to_owned();
    CouplingReport {
        a: name(coupling.a),
        b: name(coupling.b),
        kind: coupling.kind.to_owned(),
        contacts: u64::from(coupling.contacts),
        momentum_error: coupling.momentum_error,
        impulse_n_s: coupling.impulse_n_s,
        in_flight_n_s: coupling.in_flight_n_s,
        inverse_mass_per_kg: coupling.inverse_mass_per_kg,
        penetration_m: coupling.penetration_m,
        penetration_max_m: coupling.penetration_max_m,
        force_n: coupling.force_n,
        force_max_n: coupling.force_max_n,
        parasitic_kg: coupling.parasitic_kg,
    }
}

fn event(scene: &Scene, event: &Event) -> EventReport {
    let name = |id: AgentId| scene.name_of(id).to_owned();
    let AttachmentEvent { attachment, kind, with, at, force_n } = event.what;
    EventReport {
        at_s: at.as_secs_f64(),
        kind: kind.name(),
        attachment: attachment.to_string(),
        a: name(event.agent),
        b: with.map_or_else(|| "world".to_owned(), name),
        force_n,
    }
}

fn sensor(scene: &Scene, sensing: &Sensing) -> SensorReport {
    let SensorTouch { with, touching, begins, ends, changed } = sensing.what;
    let b = match with {
        ContactPartner::Agent(id) => scene.name_of(id),
        ContactPartner::Static(number) => scene.obstacles.get(number as usize).map_or("", |solid| solid.name.as_str()),
    };
    let (a, b) = (scene.name_of(sensing.agent).to_owned(), b.to_owned());
    SensorReport { a, b, touching, begins, ends, changed_s: changed.as_secs_f64() }
}

fn reference_report(scene: &Scene, oracle: &ReferenceComparison) -> ReferenceReport {
    let name = |id: AgentId| scene.name_of(id).to_owned();
    let error = |pair: &PairError| CouplingError {
        a: name(pair.a),
        b: name(pair.b),
        position_rms_m: pair.position_rms_m,
        position_max_m: pair.position_max_m,
        momentum_max_n_s: pair.momentum_max_n_s,
        impulse_n_s: pair.impulse_n_s,
        impulse_oracle_n_s: pair.impulse_oracle_n_s,
    };
    let couplings = oracle.pairs.iter().map(error).collect();
    let ReferenceComparison { dt_s, sim_s, states, sensitivity_m, .. } = *oracle;
    ReferenceReport { dt_ms: dt_s * 1e3, sim_s, states, sensitivity_m, couplings }
}

fn reading(sensor: &Sensor, read: Option<&Reading>) -> ReadingReport {
    ReadingReport {
        name: sensor.name.clone(),
        kind: sensor.kind.name().to_owned(),
        at_s: read.map_or(0.0, |read| read.time.as_secs_f64()),
        values: read.map_or_else(Vec::new, |read| read.values.clone()),
    }
}

fn probe(probe: &ProbeOutcome) -> ProbeReport {
    let row = |&(time, at): &(metachron_core::SimTime, glam::DVec3)| [time.as_secs_f64(), at.x, at.y, at.z];
    ProbeReport {
        object: probe.object.clone(),
        at: probe.at,
        position_m: probe.position.to_array(),
        velocity_m_s: probe.velocity.to_array(),
        samples: probe.samples.as_ref().map(|samples| samples.iter().map(row).collect()),
    }
}
