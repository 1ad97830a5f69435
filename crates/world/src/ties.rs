//! Converts the joints, couplings and faults of a scene for agents and the runtime.
//!
//! In: a [`Scene`]. Out: for each agent its laws, links, faults, and the leader of the cluster in which it begins. Never here: forces.

use super::couplings::{Coupling, CouplingKind};
use super::{Scene, Spec};
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, DisjointSets};
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
        for pair in contact_laws(scene) {
            laws.entry(pair.a).or_default().push((pair.b, pair.law));
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

    /// The leader of the cluster in which `id` begins, if ties or contact connect it to others: the lowest number among them.
    pub fn together(&self, id: AgentId) -> Option<AgentId> {
        self.leaders.get(id.0 as usize).copied().filter(|leader| *leader != id)
    }
}

/// Converts injected faults to the runtime's type.
pub const fn faults(faults: super::couplings::Faults) -> Faults {
    let super::couplings::Faults { jitter, loss, seed } = faults;
    Faults { jitter, loss, seed }
}

/// A pair with a law of its own.
struct PairLaw {
    a: AgentId,
    b: AgentId,
    law: Law,
}

/// The pairs that are not solved with all that they touch. In a scene without contacts those are all pairs of material objects that no
/// coupling names.
fn contact_laws(scene: &Scene) -> Vec<PairLaw> {
    let contacts = scene.couplings.iter().filter(|c| c.kind == CouplingKind::Contact);
    let mut laws: BTreeMap<_, _> = contacts.map(|c| ((c.a.min(c.b), c.a.max(c.b)), c.law)).collect();
    if !scene.contacts {
        let matter: Vec<AgentId> =
            scene.agents.iter().filter(|m| !matches!(m.spec, Spec::Synthetic(_))).map(|m| m.id).collect();
        let pairs = matter.iter().enumerate().flat_map(|(at, a)| matter[at + 1..].iter().map(move |b| (*a, *b)));
        for pair in pairs {
            laws.entry(pair).or_insert(Law::Off);
        }
    }
    let own = laws.into_iter().filter(|(_, law)| *law != Law::Ledger);
    own.map(|((a, b), law)| PairLaw { a, b, law }).collect()
}

fn link(coupling: &Coupling) -> Option<(AgentId, Link)> {
    let CouplingKind::Attach { at_a, at_b, stiffness_n_m, damping_n_s_m, rest_m } = coupling.kind else { return None };
    let law = coupling.law;
    Some((coupling.a, Link { other: coupling.b, here: at_a, there: at_b, stiffness_n_m, damping_n_s_m, rest_m, law }))
}

/// More bodies than this near each other begin in one cluster, instead of joining it one by one.
const HEAP_MIN: usize = 128;

/// For each agent the lowest number among those that are connected to it by joints, by attachments, by contact at the start or as a heap:
/// its own if there are none. A stack that starts at rest must not first be dropped on itself, and a thousand bodies about to touch must
/// not first detect each other one by one.
fn leaders(scene: &Scene) -> Vec<AgentId> {
    let mut sets = DisjointSets::default();
    sets.reset(scene.agents.len());
    let jointed = scene.joints.iter().filter_map(|joint| Some((joint.a, joint.b?)));
    let attached = scene.couplings.iter().filter(|c| c.kind != CouplingKind::Contact && c.law == Law::Ledger);
    let pairs = jointed.chain(attached.map(|c| (c.a, c.b))).chain(scene.touching_pairs()).chain(heaps(scene));
    pairs.for_each(|(a, b)| sets.join(a.0 as usize, b.0 as usize));
    (0..sets.len()).map(|at| AgentId(sets.lowest(at) as u32)).collect()
}

/// The pairs of rigid bodies near each other that belong to heaps of more than [`HEAP_MIN`].
fn heaps(scene: &Scene) -> Vec<(AgentId, AgentId)> {
    let mut pairs = scene.near_pairs();
    let (mut sets, mut sizes) = (DisjointSets::default(), vec![0; scene.agents.len()]);
    sets.reset(sizes.len());
    pairs.iter().for_each(|(a, b)| sets.join(a.0 as usize, b.0 as usize));
    (0..sizes.len()).for_each(|at| sizes[sets.lowest(at)] += 1);
    pairs.retain(|(a, _)| sizes[sets.lowest(a.0 as usize)] > HEAP_MIN);
    pairs
}
