//! The numbers of the viewer's panels, out of a session.
//!
//! In: a [`Session`]. Out: a [`Status`]. Never here: how panels look.

use super::session::Session;
use crate::compositor::viewer::{AgentRow, AgentState, Law, Status};
use crate::control;
use crate::runtime::{self, AgentStats};
use crate::scene::Spec;
use crate::scene::format::PolicyKind;
use metachron_agents::{Body, Snapshot};
use std::time::Duration;

/// Mass at which the user's hand takes hold of something that has none of its own, kilograms.
const HAND_MASS_KG: f64 = 0.1;
/// A hand moves a stretch of a tube, not all of it: no more than this mass of it, kilograms.
const STRETCH_MASS_KG: f64 = 0.1;

/// The panels of a session that has just begun.
pub(super) fn first(session: &Session) -> Status {
    let scene = session.scene();
    let own = viewer_law(super::cast::law(&scene.target));
    let others = [control::Law::CORRECTED, control::Law::PRINTED].map(viewer_law).into_iter();
    let laws = std::iter::once(own).chain(others.filter(|law| !law.is_same_law(&own))).collect();
    Status {
        scene: scene.name.clone(),
        executor: scene.executor.name().to_owned(),
        policies: PolicyKind::ALL.iter().map(|kind| kind.name().to_owned()).collect(),
        laws,
        running: true,
        speed: 1.0,
        agents: scene.agents.iter().map(|m| AgentRow::new(m.id, m.name.clone(), m.spec.model())).collect(),
        ..Status::default()
    }
}

/// Brings the numbers up to date; `since` has passed since the last time.
pub(super) fn fill(status: &mut Status, session: &mut Session, since: Duration) {
    let sim = session.sim_now();
    if !since.is_zero() {
        status.real_time_factor = sim.since(status.sim_time).as_secs_f64() / since.as_secs_f64();
    }
    let control = session.control();
    status.target_hz = control.target_hz();
    status.law = Some(viewer_law(control.law()));
    status.loop_value = Some(control.eps_hat());
    status.policy = session.policy_name().to_owned();
    status.clamp = session.clamp();
    status.triangles = session.picture().triangles();
    status.energy_j = 0.0;
    for (at, agent) in session.agents().iter().enumerate() {
        let (stats, newest) = (agent.stats(), agent.latest());
        let row = &mut status.agents[at];
        fill_row(row, &stats, &newest, since);
        row.picture = session.levels().get(at).copied();
        row.age_s = session.stage().age_s(agent.id()).unwrap_or(0.0);
        status.energy_j += stats.energy_j;
    }
}

fn fill_row(row: &mut AgentRow, stats: &AgentStats, newest: &Snapshot, since: Duration) {
    row.wanted_hz = stats.wanted_hz;
    row.rate_hz = stats.rate_hz;
    row.dt_s = stats.dt.as_secs_f64();
    row.simulation = stats.resolution;
    row.step_s = stats.work_s;
    row.cpu_share = if since.is_zero() { 0.0 } else { (stats.rate_hz * stats.work_s).min(1.0) };
    row.dropped_s = stats.dropped.as_secs_f64();
    row.residual_m = stats.residual_m;
    row.force_n = match &newest.body {
        Body::Tool(tool) => Some(tool.force_n),
        _ => None,
    };
    row.state = match &stats.state {
        runtime::AgentState::Running => AgentState::Running,
        runtime::AgentState::Resting => AgentState::Resting,
        runtime::AgentState::Parked(reason) => AgentState::Parked(reason.clone()),
    };
}

/// The mass that the user's hand feels, kilograms.
pub(super) fn mass_kg(spec: &Spec) -> f64 {
    match spec {
        Spec::Tube(tube) => {
            let length: f64 = tube.path_m.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
            (tube.mass_per_length_kg_m * length).min(STRETCH_MASS_KG)
        }
        Spec::Rigid(body) => body.mass_kg,
        Spec::Instrument(_) | Spec::Synthetic(_) => HAND_MASS_KG,
    }
}

/// The viewer's word for a law.
const fn viewer_law(law: control::Law) -> Law {
    match law {
        control::Law::Printed { alpha, beta } => Law::Printed { alpha, beta },
        control::Law::Corrected { kappa, margin } => Law::Corrected { kappa, margin },
    }
}

/// Control's word for a law.
pub(super) const fn control_law(law: Law) -> control::Law {
    match law {
        Law::Printed { alpha, beta } => control::Law::Printed { alpha, beta },
        Law::Corrected { kappa, margin } => control::Law::Corrected { kappa, margin },
    }
}
