//! Records the states of agents in a run, for comparison with another run of the same scene.
//!
//! In: the newest states. Out: a [`Trace`]. Never here: the comparison.

use super::coupling_record::Coupling;
use glam::DVec3;
use metachron_core::{AgentId, Body, SimTime, Snapshot};
use metachron_world::Scene;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Recorded material points of a tube, evenly from start to end.
const TUBE_POINTS: u32 = 9;

/// States of the agents in a run.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    pub(super) states: Vec<TracedState>,
    last: Vec<Option<SimTime>>,
    /// Total impulses exchanged, with the time of the run and the index of the coupling, whenever one has grown.
    exchanged: Vec<(SimTime, usize, f64)>,
    /// The newest of them, per coupling.
    newest: Vec<f64>,
}

/// One state of one agent.
#[derive(Debug, Clone)]
pub(super) struct TracedState {
    pub(super) agent: AgentId,
    /// Its moment in scene time: the agent's own time plus the time it was put off.
    pub(super) moment: SimTime,
    pub(super) points_m: Vec<DVec3>,
    /// Linear momentum, N·s.
    pub(super) momentum: DVec3,
}

impl Trace {
    /// Records every state whose scene time is later than the last one of its agent; the agent's own time may go back when it adopts
    /// another.
    pub(super) fn note(&mut self, scene: &Scene, newest: &[Arc<Snapshot>]) {
        self.last.resize(newest.len(), None);
        for ((member, snapshot), last) in scene.agents.iter().zip(newest).zip(&mut self.last) {
            let moment = snapshot.moment();
            if matches!(snapshot.body, Body::Nothing) || last.is_some_and(|last| last >= moment) {
                continue;
            }
            *last = Some(moment);
            let points_m = points(&snapshot.body).map(|(at, _)| at).collect();
            let momentum = member.spec.momentum_n_s(&snapshot.body);
            self.states.push(TracedState { agent: member.id, moment, points_m, momentum });
        }
    }

    /// Records the impulses exchanged by `now`, for couplings that are always in the same order.
    pub(super) fn note_couplings(&mut self, now: SimTime, all: &[Coupling]) {
        for (at, coupling) in all.iter().enumerate() {
            if self.newest.get(at) != Some(&coupling.impulse_n_s) {
                self.newest.resize(self.newest.len().max(at + 1), 0.0);
                self.newest[at] = coupling.impulse_n_s;
                self.exchanged.push((now, at, coupling.impulse_n_s));
            }
        }
    }

    /// The couplings of `all` that existed by `time`, with the impulses exchanged by then.
    pub(super) fn couplings_by(&self, time: SimTime, all: &[Coupling]) -> Vec<Coupling> {
        let mut by_then = BTreeMap::new();
        by_then.extend(self.exchanged.iter().take_while(|one| one.0 <= time).map(|&(_, at, impulse)| (at, impulse)));
        let one = |(at, impulse_n_s): (usize, f64)| Some(Coupling { impulse_n_s, ..all.get(at)?.clone() });
        by_then.into_iter().filter_map(one).collect()
    }
}

/// The compared material points of a body, and their velocities.
pub(super) fn points(body: &Body) -> impl Iterator<Item = (DVec3, DVec3)> {
    let count = if matches!(body, Body::Curve(_)) { TUBE_POINTS } else { 1 };
    (0..count).filter_map(move |k| body.probe(f64::from(k) / f64::from(TUBE_POINTS - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::{RigidState, SimSpan};
    use metachron_scene::{Source, load};

    #[test]
    fn a_trace_follows_scene_time_when_an_agents_clock_jumps() {
        let text = "format = 1\nobject = [{ name = \"a\", model = \"rigid\", shape = \"ball\", radius_m = 1 }]\n";
        let scene = Source::memory("ball", text.as_bytes()).and_then(|source| load(&source, &[])).unwrap();
        let at = |ms: u64| SimTime::ZERO + SimSpan::from_nanos(ms * 1_000_000);
        let state = |(own, put_off): (u64, u64)| Snapshot {
            time: at(own),
            clock_offset: at(put_off).since(SimTime::ZERO),
            body: Body::Rigid(RigidState::default()),
            ..Snapshot::default()
        };
        let mut trace = Trace::default();
        // on time; put off by 0.3 s, published twice; the next step; on time again
        for one in [(1000, 0), (710, 300), (710, 300), (720, 300), (1030, 0)] {
            trace.note(&scene, &[Arc::new(state(one))]);
        }
        let moments: Vec<_> = trace.states.iter().map(|state| state.moment).collect();
        assert_eq!(moments, [1000, 1010, 1020, 1030].map(at));
    }
}
