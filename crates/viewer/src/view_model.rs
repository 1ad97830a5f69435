//! Fills the viewer's panels with the numbers of a session.
//!
//! In: a [`Session`]. Out: a [`Status`]. Never here: how panels look.

use crate::ui::{AgentRow, AgentState, ContactSolve, CouplingRow, Filled, Law, Shares, Status, TurnRow};
use metachron_core::{SimTime, Snapshot};
use metachron_lod::control::Policy;
use metachron_runtime::{AgentStats, Turn};
use metachron_session::FrameRecord;
use metachron_session::Session;
use metachron_world::{Member, Spec};
use std::time::Duration;

/// Frames over which the budget bar is smoothed.
const SHARES_FRAMES: usize = 30;
/// Mass that the user spring moves of a body that bends, at most, and of a body without a mass of its own, kilograms.
const STRETCH_MASS_KG: f64 = 0.1;

/// By what share of its radius the slider of a tube's pressure can widen it.
const WIDENED_MAX: f64 = 0.3;

/// The panels of a session that has just begun.
pub(super) fn initial_status(session: &Session) -> Status {
    let scene = session.scene();
    let own = metachron_session::law(&scene.target);
    let others = [Law::CORRECTED, Law::PRINTED].into_iter();
    let laws = std::iter::once(own).chain(others.filter(|law| !law.is_same_law(&own))).collect();
    Status {
        scene: scene.name.clone(),
        executor: scene.executor.name().to_owned(),
        policies: Policy::ALL.iter().map(|kind| kind.name().to_owned()).collect(),
        laws,
        cameras: session.camera_names().map(str::to_owned).collect(),
        running: true,
        speed: 1.0,
        agents: scene.agents.iter().map(row).collect(),
        ..Status::default()
    }
}

/// The row of an agent that has not run yet.
fn row(agent: &Member) -> AgentRow {
    let row = AgentRow::new(agent.id, agent.name.clone(), agent.spec.model());
    let Spec::Tube(tube) = &agent.spec else { return row };
    let section = &tube.section;
    // p r² (1 − ν/2)/(E t), the law of a prescribed wall
    let most_pa = WIDENED_MAX * section.young_pa * section.wall_m / (section.radius_m * (1.0 - 0.5 * section.poisson));
    let pressure_pa = tube.pressure_keys.first().map_or(tube.pressure_pa, |key| key.pressure_pa);
    AgentRow { filled: (section.wall_m < section.radius_m).then_some(Filled { pressure_pa, most_pa }), ..row }
}

/// Values derived from differences of counters, over windows long enough to be meaningful.
pub(super) struct Meter {
    since: (Duration, SimTime),
    cpu_s: Vec<f64>,
    shares: Vec<f64>,
    dropped_s: Vec<f64>,
    real_time: f64,
}

/// Window over which CPU shares and the flow of time are measured: an agent's CPU time is updated about this often.
const METER_EVERY: Duration = Duration::from_millis(500);

impl Meter {
    /// A meter that starts now.
    pub fn new(session: &Session) -> Self {
        let agents = session.agents().len();
        let since = (session.now(), session.sim_now());
        Self {
            since,
            cpu_s: vec![0.0; agents],
            shares: vec![0.0; agents],
            dropped_s: vec![0.0; agents],
            real_time: 0.0,
        }
    }

    fn read(&mut self, session: &Session) {
        let agents = session.agents().len();
        for list in [&mut self.cpu_s, &mut self.shares, &mut self.dropped_s] {
            list.resize(agents, 0.0);
        }
        let (now, sim) = (session.now(), session.sim_now());
        let wall_s = now.saturating_sub(self.since.0).as_secs_f64();
        if wall_s < METER_EVERY.as_secs_f64() {
            return;
        }
        let mut most_s = 0.0_f64;
        for (at, agent) in session.agents().iter().enumerate() {
            let (cpu_s, dropped_s) = (agent.cpu_s(), agent.stats().dropped.as_secs_f64());
            most_s = most_s.max(dropped_s - self.dropped_s[at]);
            self.dropped_s[at] = dropped_s;
            self.shares[at] = ((cpu_s - self.cpu_s[at]) / wall_s).clamp(0.0, 1.0);
            self.cpu_s[at] = cpu_s;
        }
        // dropped time passes on the scene's clock but is not simulated
        self.real_time = (sim.since(self.since.1).as_secs_f64() - most_s).max(0.0) / wall_s;
        self.since = (now, sim);
    }
}

/// Updates the numbers; returns a line for each agent that was parked since the last call.
pub(super) fn fill(status: &mut Status, session: &mut Session, meter: &mut Meter) -> Vec<String> {
    meter.read(session);
    // agents that have joined
    let known = status.agents.len();
    status.agents.extend(session.scene().agents.iter().skip(known).map(row));
    status.real_time_factor = meter.real_time;
    let mut messages = Vec::new();
    let control = session.control();
    status.target_hz = control.target_hz();
    let policy = control.policy();
    status.law = (policy == Policy::Feedback).then(|| control.law());
    status.sliders = policy.predicts().then(|| control.sliders());
    status.damped = policy.has_hysteresis();
    status.frozen = control.is_frozen();
    status.loop_value = Some(control.eps_hat());
    status.policy = session.policy_name().to_owned();
    status.clamp = session.clamp();
    status.triangles = session.picture().triangles();
    status.objects = session.newest_frames(1).last().map_or([0; 3], |f| [f.potentially_visible, f.objects, f.drawn]);
    status.render_scale = session.picture().scale;
    status.shadows = session.picture().shadows;
    status.shares = shares(session, meter);
    fill_couplings(status, session);
    status.energy_j = 0.0;
    for (at, agent) in session.agents().iter().enumerate().take(status.agents.len()) {
        let (stats, newest) = (agent.stats(), agent.latest());
        let row = &mut status.agents[at];
        let was_parked = matches!(row.state, AgentState::Parked(_));
        fill_row(row, &stats, &newest);
        row.led_by = stats.led_by.and_then(|leader| Some(session.agents().of(leader)?.name().to_owned()));
        row.host = session.host_of(agent.id()).map(str::to_owned);
        row.cpu_share = meter.shares[at];
        if let AgentState::Parked(reason) = &row.state
            && !was_parked
        {
            messages.push(format!("{} is parked: {reason}", row.name));
        }
        row.picture = session.levels().get(at).map(|level| level.resolution);
        row.age_s = session.scene_view().age_s(agent.id()).unwrap_or(0.0);
        status.energy_j += stats.energy_j;
    }
    messages
}

/// Shares of the frame time over the newest frames.
fn shares(session: &Session, meter: &Meter) -> Shares {
    let newest = session.newest_frames(SHARES_FRAMES);
    let target_ms = session.period().as_secs_f64() * 1e3;
    let mean =
        |of: fn(&FrameRecord) -> f64| newest.iter().map(of).sum::<f64>() / (newest.len().max(1) as f64 * target_ms);
    Shares {
        // starts at 0.0, because an empty sum is −0
        simulation: meter.shares.iter().fold(0.0, |sum, share| sum + share) / f64::from(session.cores()),
        cull: mean(|row| row.cull_ms),
        select: mean(|row| row.select_ms),
        draw: mean(|row| row.draw_ms),
        rest: mean(|row| (row.frame_ms - row.cull_ms - row.select_ms - row.draw_ms).max(0.0)),
    }
}

/// The couplings of all agents, each reported by the agent that owns it.
fn fill_couplings(status: &mut Status, session: &Session) {
    let Status { couplings, agents, .. } = status;
    couplings.clear();
    let name = |at: usize| agents.get(at).map_or_else(String::new, |row| row.name.clone());
    for (owner, agent) in session.agents().iter().enumerate() {
        couplings.extend(agent.latest().pairs.iter().filter(|pair| pair.contacts > 0).map(|pair| CouplingRow {
            a: name(owner),
            b: name(pair.with.0 as usize),
            kind: pair.kind.name(),
            contacts: pair.contacts,
            force_n: pair.force_n,
            penetration_m: pair.penetration_m,
            inverse_mass_per_kg: pair.inverse_mass_per_kg,
        }));
    }
}

fn fill_row(row: &mut AgentRow, stats: &AgentStats, newest: &Snapshot) {
    row.wanted_hz = stats.wanted_hz;
    row.rate_hz = stats.rate_hz;
    row.dt_s = stats.dt.as_secs_f64();
    row.simulation = stats.resolution;
    row.nodes = stats.nodes;
    row.step_s = stats.work_s;
    row.dropped_s = stats.dropped.as_secs_f64();
    row.leader = newest.cluster.map(|cluster| cluster.leader);
    row.contact = newest.cluster.and_then(|cluster| cluster.solves).map(|solves| ContactSolve {
        level: solves.level,
        factors: solves.last_factors,
        miss_m_s: solves.miss_m_s,
        depth_m: solves.depth_m,
    });
    row.residual_m = stats.residual_m;
    row.force_n = newest.body.tool().map(|tool| tool.force_n);
    row.state.clone_from(&stats.state);
}

/// A turn for its lane.
pub(super) fn turn(turn: &Turn) -> TurnRow {
    TurnRow {
        begun_s: turn.begun.as_secs_f64(),
        ended_s: turn.ended.as_secs_f64(),
        time: turn.time,
        dt_s: turn.dt.as_secs_f64(),
        eps_m: turn.eps_m,
        leader: turn.led_by,
        late_s: turn.late.as_secs_f64(),
        dropped_s: turn.dropped.as_secs_f64(),
    }
}

/// The mass for which the user spring is scaled, kilograms: of a body that bends, the stretch near the pulled point follows, not all of it.
pub(super) fn mass_kg(spec: &Spec) -> f64 {
    let mass_kg = spec.mass_kg().unwrap_or(STRETCH_MASS_KG);
    if spec.is_deformable() { mass_kg.min(STRETCH_MASS_KG) } else { mass_kg }
}
