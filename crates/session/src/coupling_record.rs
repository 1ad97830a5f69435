//! Couplings between agents in a run, collected from the states that they publish.
//!
//! In: the newest states at each gathering, and which agents have new ones. Out: a [`Coupling`] for every pair and kind that ever occurred.
//! A pair is read again only when one of its agents has a new state: a heap at rest costs nothing. Never here: forces.

use glam::DVec3;
use metachron_core::{AgentId, Snapshot};
use metachron_core::{PairKind, PairState};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The interaction of two agents.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    /// The grasping tool, or the side that publishes the pair: in a cluster the lower number.
    pub a: AgentId,
    /// The peer.
    pub b: AgentId,
    /// The kind of coupling: `cluster`, `ledger`, `tlm`, `grasp` or `attach`.
    pub kind: &'static str,
    /// Contacts or attachments at the end of the run.
    pub contacts: u32,
    /// Force at the end of the run, newtons.
    pub force_n: f64,
    /// Largest force seen by a frame, newtons.
    pub force_max_n: f64,
    /// Overlap at the end of the run, metres.
    pub penetration_m: f64,
    /// Largest overlap seen by a frame, metres.
    pub penetration_max_m: f64,
    /// Impulses exchanged, magnitudes summed, N·s.
    pub impulse_n_s: f64,
    /// Impulse given and not yet taken at the last reading, N·s.
    pub in_flight_n_s: f64,
    /// Largest difference between the ledgers of both sides at equal revisions, as a share of the impulse exchanged; if the revisions never
    /// were equal, the difference of the newest ledgers beyond the impulse that the owner reports as in flight. `None`
    /// where there are no two ledgers to compare.
    pub momentum_error: Option<f64>,
    /// Whether both ledgers were ever seen at the same revision.
    pub(super) compared: bool,
    /// Inverse effective masses of `a` and `b` along the normal of the contact with the largest force, 1/kg, when they last pressed on each
    /// other; `None` where none are published: in heaps, and for links, penalties and lines.
    pub inverse_mass_per_kg: Option<[f64; 2]>,
    /// Mass added by the law, kilograms.
    pub parasitic_kg: f64,
}

/// All couplings of a run so far.
#[derive(Debug, Default)]
pub(super) struct Couplings {
    all: Vec<Coupling>,
    known: BTreeMap<(AgentId, AgentId, &'static str), usize>,
    /// Indices of each agent's couplings.
    of: Vec<Vec<usize>>,
    /// Agents with a new state, each once, and the agents coupled to them.
    changed: Vec<AgentId>,
    is_changed: Vec<bool>,
}

impl Coupling {
    pub(super) const fn new(a: AgentId, b: AgentId, kind: &'static str) -> Self {
        Self {
            a,
            b,
            kind,
            contacts: 0,
            force_n: 0.0,
            force_max_n: 0.0,
            penetration_m: 0.0,
            penetration_max_m: 0.0,
            impulse_n_s: 0.0,
            in_flight_n_s: 0.0,
            momentum_error: None,
            compared: false,
            inverse_mass_per_kg: None,
            parasitic_kg: 0.0,
        }
    }

    fn update(&mut self, state: &PairState) {
        self.contacts = state.contacts;
        self.force_n = state.force_n;
        self.force_max_n = self.force_max_n.max(state.force_n);
        self.penetration_m = state.penetration_m;
        self.penetration_max_m = self.penetration_max_m.max(state.penetration_m);
        self.impulse_n_s = state.impulse_n_s;
        self.in_flight_n_s = state.in_flight_n_s;
        self.inverse_mass_per_kg = state.inverse_mass_per_kg;
        self.parasitic_kg = state.parasitic_kg;
    }

    /// Compares the ledgers of both sides, which differ by `apart_n_s`.
    fn compare(&mut self, apart_n_s: f64, same_reading: bool) {
        if self.impulse_n_s <= 0.0 {
            return;
        }
        if same_reading {
            let error = apart_n_s / self.impulse_n_s;
            self.momentum_error = Some(self.momentum_error.filter(|_| self.compared).unwrap_or(0.0).max(error));
            self.compared = true;
        } else if !self.compared {
            self.momentum_error = Some((apart_n_s - self.in_flight_n_s).max(0.0) / self.impulse_n_s);
        }
    }
}

impl Couplings {
    /// All couplings, in the order in which they were first seen.
    pub(super) fn all(&self) -> &[Coupling] {
        &self.all
    }

    /// Reports a new state of `id`.
    pub(super) fn mark_changed(&mut self, id: AgentId) {
        let at = id.0 as usize;
        if self.is_changed.len() <= at {
            self.is_changed.resize(at + 1, false);
        }
        if !std::mem::replace(&mut self.is_changed[at], true) {
            self.changed.push(id);
        }
    }

    /// Updates the couplings of the agents reported by [`Self::mark_changed`] from the `newest` states.
    pub(super) fn note(&mut self, newest: &[Arc<Snapshot>]) {
        self.reset_changed();
        let changed = std::mem::take(&mut self.changed);
        for &id in &changed {
            let Some(snapshot) = newest.get(id.0 as usize) else { continue };
            self.note_grasp(id, snapshot);
            for state in &snapshot.pairs {
                self.note_pair(id, state, newest);
            }
        }
        changed.iter().for_each(|id| self.is_changed[id.0 as usize] = false);
        self.changed = changed;
        self.changed.clear();
    }

    /// Clears the current contacts, force and overlap of the couplings of all reported agents, and adds their peers to the list.
    fn reset_changed(&mut self) {
        let of = std::mem::take(&mut self.of);
        for k in 0..self.changed.len() {
            for &at in of.get(self.changed[k].0 as usize).into_iter().flatten() {
                let coupling = &mut self.all[at];
                (coupling.contacts, coupling.force_n, coupling.penetration_m) = (0, 0.0, 0.0);
                let (a, b) = (coupling.a, coupling.b);
                self.mark_changed(a);
                self.mark_changed(b);
            }
        }
        self.of = of;
    }

    /// Records the grasp of a tool.
    fn note_grasp(&mut self, holder: AgentId, snapshot: &Snapshot) {
        let Some((tool, grasp)) = snapshot.body.tool().and_then(|tool| Some((tool, tool.grasp?))) else { return };
        let coupling = self.at(holder, grasp.target, PairKind::Grasp.name());
        coupling.contacts = 1;
        coupling.force_n = tool.force_n;
        coupling.force_max_n = coupling.force_max_n.max(tool.force_n);
    }

    fn note_pair(&mut self, owner: AgentId, state: &PairState, newest: &[Arc<Snapshot>]) {
        let other = state.with;
        let Some((mine, theirs)) = newest.get(owner.0 as usize).zip(newest.get(other.0 as usize)) else { return };
        let held_by_tool = state.kind == PairKind::Grasp && theirs.body.tool().is_some();
        let (a, b) = if held_by_tool { (other, owner) } else { (owner, other) };
        let coupling = self.at(a, b, state.kind.name());
        coupling.update(state);
        if held_by_tool {
            coupling.inverse_mass_per_kg = state.inverse_mass_per_kg.map(|[mine, its]| [its, mine]);
        }
        if let Some((apart_n_s, same_reading)) = difference_n_s(mine, owner, theirs, other) {
            coupling.compare(apart_n_s, same_reading);
        }
    }

    fn at(&mut self, a: AgentId, b: AgentId, kind: &'static str) -> &mut Coupling {
        let at = self.number(a, b, kind);
        &mut self.all[at]
    }

    /// The index of a coupling; a new one if it is unknown.
    fn number(&mut self, a: AgentId, b: AgentId, kind: &'static str) -> usize {
        if let Some(&at) = self.known.get(&(a, b, kind)) {
            return at;
        }
        let at = self.all.len();
        self.known.insert((a, b, kind), at);
        self.all.push(Coupling::new(a, b, kind));
        for id in [a, b].map(|id| id.0 as usize) {
            if self.of.len() <= id {
                self.of.resize_with(id + 1, Vec::new);
            }
            self.of[id].push(at);
        }
        at
    }
}

/// Difference between the impulses in the ledgers that `owner` gave and `other` took, N·s, and whether both have the
/// same revision.
fn difference_n_s(mine: &Snapshot, owner: AgentId, theirs: &Snapshot, other: AgentId) -> Option<(f64, bool)> {
    let given = mine.given.iter().find(|ledger| ledger.with == other)?;
    let taken = theirs.taken.iter().find(|ledger| ledger.with == owner)?;
    let mut apart = DVec3::ZERO;
    // a force that is assumed to continue is given in the owner's next step: neither ledger is wrong because of it
    given.beyond(Some(taken), mine.time, |_, sum, _| apart += sum.linear);
    Some((apart.length(), given.revision == taken.revision && taken.coming.is_empty()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use metachron_core::Body;
    use metachron_core::{Ahead, Impulse, Ledger, Site};
    use metachron_core::{SimTime, ToolState};

    /// Reports all `states`.
    fn note(couplings: &mut Couplings, states: &[Arc<Snapshot>]) {
        (0..).map(AgentId).take(states.len()).for_each(|id| couplings.mark_changed(id));
        couplings.note(states);
    }

    fn pushed(x: f64) -> Impulse {
        Impulse { linear: DVec3::X * x, angular: DVec3::ZERO }
    }

    /// The states of an owner with the ledger `given` and of a peer with the ledger `taken`.
    fn states(given: &Ledger, taken: Ledger, state: PairState) -> Vec<Arc<Snapshot>> {
        let owner = Snapshot { given: vec![given.clone()], pairs: vec![state], ..Snapshot::default() };
        let other = Snapshot { taken: vec![Ledger { with: AgentId(0), ..taken }], ..Snapshot::default() };
        vec![Arc::new(owner), Arc::new(other)]
    }

    #[test]
    fn ledgers_of_equal_revision_are_compared_and_others_count_as_in_flight() {
        let mut given = Ledger::new(AgentId(1));
        given.give(Site::Whole, SimTime::ZERO, 0.0, pushed(2.0));
        let early = given.clone();
        given.give(Site::Whole, SimTime::ZERO, 0.1, pushed(2.0));
        let state = PairState {
            contacts: 1,
            impulse_n_s: 4.0,
            in_flight_n_s: 1.5,
            force_n: 3.0,
            ..PairState::new(AgentId(1), PairKind::Ledger)
        };
        let mut couplings = Couplings::default();
        note(&mut couplings, &states(&given, early.clone(), state));
        // two of four newton seconds are not taken yet, and the owner reports one and a half in flight
        assert_eq!(couplings.all()[0].momentum_error, Some(0.125));
        note(&mut couplings, &states(&given, given.clone(), state));
        assert_eq!(couplings.all()[0].momentum_error, Some(0.0));
        // the continuing force has been taken ahead
        let ahead = Some(Ahead { sum: pushed(1.0), from: SimTime::ZERO, middle_s: 0.1 });
        note(&mut couplings, &states(&given, Ledger { ahead, ..given.clone() }, state));
        assert_eq!(couplings.all()[0].momentum_error, Some(0.0));
        // a peer that lost half of it without noticing
        note(&mut couplings, &states(&given, Ledger { revision: given.revision, ..early }, state));
        assert_eq!(couplings.all()[0].momentum_error, Some(0.5));
        assert_eq!(
            (couplings.all().len(), couplings.all()[0].kind, couplings.all()[0].force_max_n),
            (1, "ledger", 3.0)
        );
    }

    #[test]
    fn inverse_masses_are_in_the_order_of_the_two_agents() {
        let (tip, rotation) = (DVec3::ZERO, glam::DQuat::IDENTITY);
        let still = DVec3::ZERO;
        let tool = ToolState {
            tip,
            led: tip,
            rotation,
            velocity: still,
            spin: still,
            jaw: 0.0,
            grasp: None,
            admits: None,
            force_n: 0.0,
            is_idle: false,
        };
        for (kind, body, want) in [
            (PairKind::Ledger, Body::Nothing, (0, 1, [3.0, 2.0])),
            (PairKind::Grasp, Body::Tool(tool), (1, 0, [2.0, 3.0])),
        ] {
            let pair = PairState { inverse_mass_per_kg: Some([3.0, 2.0]), ..PairState::new(AgentId(1), kind) };
            let owner = Snapshot { pairs: vec![pair], ..Snapshot::default() };
            let mut couplings = Couplings::default();
            note(&mut couplings, &[Arc::new(owner), Arc::new(Snapshot { body, ..Snapshot::default() })]);
            let rows = &couplings.all()[0];
            assert_eq!((rows.a.0, rows.b.0, rows.inverse_mass_per_kg.unwrap()), want, "{kind:?}");
        }
    }

    #[test]
    fn a_coupling_without_new_states_is_kept_and_either_agent_resets_it() {
        let pair = |contacts| PairState { contacts, ..PairState::new(AgentId(1), PairKind::Ledger) };
        let state = |pairs: Vec<PairState>| Arc::new(Snapshot { pairs, ..Snapshot::default() });
        let mut couplings = Couplings::default();
        let touching = [state(vec![pair(3)]), Arc::default()];
        note(&mut couplings, &touching);
        // no agent has a new state: nothing is read
        couplings.note(&[]);
        assert_eq!(couplings.all()[0].contacts, 3);
        // the peer has a new state: the owner is read again
        couplings.mark_changed(AgentId(1));
        couplings.note(&touching);
        assert_eq!(couplings.all()[0].contacts, 3);
        couplings.mark_changed(AgentId(0));
        couplings.note(&[Arc::default(), Arc::default()]);
        assert_eq!((couplings.all().len(), couplings.all()[0].contacts), (1, 0));
    }
}
