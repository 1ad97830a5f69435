//! Where agents were in a run, state by state, to be compared with another run of the same scene.
//!
//! In: the newest states. Out: a [`Trace`]. Never here: the comparison.

use super::couplings::Coupling;
use crate::scene::{Scene, Spec};
use glam::DVec3;
use metachron_agents::{AgentId, Body, CurveState, SimTime, Snapshot};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Material points of a tube that are written down, evenly from start to end.
const TUBE_POINTS: u32 = 9;

/// Where agents were in a run.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    pub(super) states: Vec<Traced>,
    last: Vec<Option<SimTime>>,
    /// Impulses that pairs had exchanged in all, by the coupling's number and the time of the run, each time that one had grown.
    exchanged: Vec<(SimTime, usize, f64)>,
    /// The newest of them, coupling by coupling.
    newest: Vec<f64>,
}

/// One state of one agent.
#[derive(Debug, Clone)]
pub(super) struct Traced {
    pub(super) agent: AgentId,
    pub(super) time: SimTime,
    pub(super) points_m: Vec<DVec3>,
    /// Linear momentum, N·s.
    pub(super) momentum: DVec3,
}

impl Trace {
    /// Writes down every state that is newer than the last one of its agent.
    pub(super) fn note(&mut self, scene: &Scene, newest: &[Arc<Snapshot>]) {
        self.last.resize(newest.len(), None);
        for ((member, snapshot), last) in scene.agents.iter().zip(newest).zip(&mut self.last) {
            if matches!(snapshot.body, Body::Nothing) || last.is_some_and(|last| last >= snapshot.time) {
                continue;
            }
            *last = Some(snapshot.time);
            let points_m = points(&snapshot.body).map(|(at, _)| at).collect();
            let momentum = momentum(&member.spec, &snapshot.body);
            self.states.push(Traced { agent: member.id, time: snapshot.time, points_m, momentum });
        }
    }

    /// Writes down what couplings, always in the same order, have exchanged by `now`.
    pub(super) fn note_couplings(&mut self, now: SimTime, all: &[Coupling]) {
        for (at, coupling) in all.iter().enumerate() {
            if self.newest.get(at) != Some(&coupling.impulse_n_s) {
                self.newest.resize(self.newest.len().max(at + 1), 0.0);
                self.newest[at] = coupling.impulse_n_s;
                self.exchanged.push((now, at, coupling.impulse_n_s));
            }
        }
    }

    /// Those of `all` that were there by `time`, with the impulses that they had exchanged by then.
    pub(super) fn couplings_by(&self, time: SimTime, all: &[Coupling]) -> Vec<Coupling> {
        let mut by_then = BTreeMap::new();
        by_then.extend(self.exchanged.iter().take_while(|one| one.0 <= time).map(|&(_, at, impulse)| (at, impulse)));
        let one = |(at, impulse_n_s): (usize, f64)| Some(Coupling { impulse_n_s, ..all.get(at)?.clone() });
        by_then.into_iter().filter_map(one).collect()
    }
}

/// The material points of a body that are compared, and their velocities.
pub(super) fn points(body: &Body) -> impl Iterator<Item = (DVec3, DVec3)> {
    let count = if matches!(body, Body::Curve(_)) { TUBE_POINTS } else { 1 };
    (0..count).filter_map(move |k| body.probe(f64::from(k) / f64::from(TUBE_POINTS - 1)))
}

/// Linear momentum of an agent in the state `body`, N·s; zero for what has no mass.
pub(super) fn momentum(spec: &Spec, body: &Body) -> DVec3 {
    match (spec, body) {
        (Spec::Rigid(spec), Body::Rigid(state)) => state.velocity * spec.mass_kg,
        (Spec::Tube(spec), Body::Curve(curve)) => flow(curve) * spec.mass_per_length_kg_m,
        _ => DVec3::ZERO,
    }
}

/// Mass of an agent in the state `body`, kilograms.
pub(super) fn mass_kg(spec: &Spec, body: &Body) -> f64 {
    match (spec, body) {
        (Spec::Rigid(spec), _) => spec.mass_kg,
        (Spec::Tube(spec), Body::Curve(curve)) => {
            spec.mass_per_length_kg_m * curve.arc_m.last().copied().unwrap_or(0.0)
        }
        _ => 0.0,
    }
}

/// Velocity summed along the rest length, m²/s: exact for a velocity that is linear between nodes.
fn flow(curve: &CurveState) -> DVec3 {
    let pairs = curve.arc_m.windows(2).zip(curve.velocities.windows(2));
    pairs.map(|(arc, velocity)| 0.5 * (arc[1] - arc[0]) * (velocity[0] + velocity[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_of_a_turning_line_is_its_middles() {
        let arc_m = vec![0.0, 0.1, 0.3, 1.0];
        let velocities = arc_m.iter().map(|s| DVec3::Y * (2.0 * s)).collect();
        let flow = flow(&CurveState { arc_m, velocities, ..CurveState::default() });
        assert!((flow - DVec3::Y).length() < 1e-15, "{flow}"); // 1 m at a mean of 1 m/s
    }
}
