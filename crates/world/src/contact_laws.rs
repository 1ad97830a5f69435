//! Converts the joints, couplings and faults of a scene for agents and the runtime.
//!
//! In: a [`Scene`]. Out: for each agent its laws, links, faults, and the leader of the island in which it begins. Never here: forces.

use super::couplings::{Coupling, CouplingKind};
use super::{Scene, Spec};
use metachron_contact::{Law, Link};
use metachron_core::AgentId;
use metachron_runtime::Faults;
use std::collections::BTreeMap;

/// The ties of all agents of a scene.
pub struct Ties {
    laws: BTreeMap<AgentId, Vec<(AgentId, Law)>>,
    attached: BTreeMap<AgentId, Vec<Link>>,
    leaders: Vec<AgentId>,
}

impl Ties {
    /// Reads the ties of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let mut laws: BTreeMap<AgentId, Vec<_>> = BTreeMap::new();
        for (a, b, law) in contact_laws(scene) {
            laws.entry(a).or_default().push((b, law));
        }
        let mut attached: BTreeMap<AgentId, Vec<_>> = BTreeMap::new();
        for (id, link) in scene.couplings.iter().filter_map(link) {
            attached.entry(id).or_default().push(link);
        }
        Self { laws, attached, leaders: leaders(scene) }
    }

    /// The contact laws between `id` and its peers that are not the ledger; returned for one side of a pair.
    pub fn laws(&mut self, id: AgentId) -> Vec<(AgentId, Law)> {
        self.laws.remove(&id).unwrap_or_default()
    }

    /// The permanent links of `id`; returned for one side of a pair.
    pub fn attached(&mut self, id: AgentId) -> Vec<Link> {
        self.attached.remove(&id).unwrap_or_default()
    }

    /// The leader of the island in which `id` begins, if joints or resting contact connect it to others: the lowest number among them.
    pub fn together(&self, id: AgentId) -> Option<AgentId> {
        self.leaders.get(id.0 as usize).copied().filter(|leader| *leader != id)
    }
}

/// Converts injected faults to the runtime's type.
pub const fn faults(faults: super::couplings::Faults) -> Faults {
    let super::couplings::Faults { jitter, loss, seed } = faults;
    Faults { jitter, loss, seed }
}

/// Every pair with a law of its own; in a scene without contacts that is every pair of material objects.
#[must_use]
pub fn contact_laws(scene: &Scene) -> Vec<(AgentId, AgentId, Law)> {
    let contacts = scene.couplings.iter().filter(|c| c.kind == CouplingKind::Contact);
    let named: BTreeMap<_, _> = contacts.map(|c| ((c.a.min(c.b), c.a.max(c.b)), c.law)).collect();
    if scene.contacts {
        return named.into_iter().map(|((a, b), law)| (a, b, law)).collect();
    }
    let matter: Vec<AgentId> =
        scene.agents.iter().filter(|m| !matches!(m.spec, Spec::Synthetic(_))).map(|m| m.id).collect();
    let pairs = matter.iter().enumerate().flat_map(|(at, a)| matter[at + 1..].iter().map(move |b| (*a, *b)));
    pairs.map(|pair| (pair.0, pair.1, named.get(&pair).copied().unwrap_or(Law::Off))).collect()
}

fn link(coupling: &Coupling) -> Option<(AgentId, Link)> {
    let CouplingKind::Attach { at_a, at_b, stiffness_n_m, damping_n_s_m, rest_m } = coupling.kind else { return None };
    let law = coupling.law;
    Some((coupling.a, Link { other: coupling.b, here: at_a, there: at_b, stiffness_n_m, damping_n_s_m, rest_m, law }))
}

/// More bodies than this near each other begin in one island; with fewer, an island solves them directly, and they join it one by one.
const HEAP_MIN: usize = 128;

/// For each agent the lowest number among those that are connected to it by joints, by resting contact or as a heap: its own if there are
/// none. A stack that starts at rest must not first be dropped on itself, and a thousand bodies about to touch must not first detect each
/// other one by one.
#[must_use]
pub fn leaders(scene: &Scene) -> Vec<AgentId> {
    let mut above: Vec<usize> = (0..scene.agents.len()).collect();
    let jointed = scene.joints.iter().filter_map(|joint| Some((joint.a, joint.b?)));
    jointed.chain(scene.resting_pairs()).chain(heaps(scene)).for_each(|pair| join(&mut above, pair));
    (0..above.len()).map(|at| AgentId(root(&mut above, at) as u32)).collect()
}

/// The pairs of rigid bodies near each other that belong to clusters of more than [`HEAP_MIN`].
fn heaps(scene: &Scene) -> Vec<(AgentId, AgentId)> {
    let mut pairs = scene.near_pairs();
    let mut above: Vec<usize> = (0..scene.agents.len()).collect();
    pairs.iter().for_each(|pair| join(&mut above, *pair));
    let mut sizes = vec![0; above.len()];
    (0..above.len()).for_each(|at| sizes[root(&mut above, at)] += 1);
    pairs.retain(|(a, _)| sizes[root(&mut above, a.0 as usize)] > HEAP_MIN);
    pairs
}

/// Merges the clusters of both.
fn join(above: &mut [usize], (a, b): (AgentId, AgentId)) {
    let (a, b) = (root(above, a.0 as usize), root(above, b.0 as usize));
    above[a.max(b)] = a.min(b);
}

/// Finds the root in the union-find forest `above`, and shortens the path.
fn root(above: &mut [usize], mut at: usize) -> usize {
    while above[at] != at {
        above[at] = above[above[at]];
        at = above[at];
    }
    at
}
